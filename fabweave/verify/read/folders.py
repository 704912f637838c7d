"""Read the folders that a job may have beside its sheets: to cut, for a service, rings, offcuts."""

import csv
import io
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from fabweave.verify.drawing import Drawing, ReadError
from fabweave.verify.read.content import read_text
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg
from fabweave.verify.statement import Tally

#: Reads a file of the job by its name and a reader, or tells why not, and returns None.
Read: TypeAlias = Callable[[str, Callable[[Path], Any]], Any]

#: Where the sheets lie that are to be cut, with kerf and micro-joints.
READY = "cut"
#: Where rings lie, and the record that tells of them.
RIM, RIM_RECORD = "rim", "rim/rim.json"
#: Where offcuts lie, and the list of stock that names them.
OFFCUTS, STOCK = "offcuts", "offcuts/stock.toml"
#: Where files for a service lie, and the table of them.
SERVICE, TABLE = "service", "parts.csv"
COLUMNS = (
    "file", "quantity", "kind", "pieces", "material", "thickness_mm", "length_mm", "width_mm",
    "area_mm2", "cut_length_mm", "holes",
)  # fmt: skip
#: Everything is on this layer of a DXF file for a service.
PLAIN_LAYER = "0"
_PART = re.compile(r"[a-z0-9-]+_[0-9.]+mm/kind_[0-9]+_qty_[0-9]+\.dxf")
_MICRO = re.compile(r"(\d+):([\d.]+)mm")


@dataclass(frozen=True)
class Drawings:
    """The drawings of a folder in both formats, by the names of what they draw."""

    dxf: dict[str, Drawing] = field(default_factory=dict)
    svg: dict[str, Drawing] = field(default_factory=dict)

    def add(self, key: str, stem: str, read: Read) -> None:
        """Read both drawings of a name; one that cannot be read is left out."""
        for suffix, reader, kept in ((".dxf", read_dxf, self.dxf), (".svg", read_svg, self.svg)):
            drawing = read(f"{stem}{suffix}", reader)
            if drawing is not None:
                kept[key] = drawing


@dataclass(frozen=True)
class Ready(Drawings):
    """The sheets to cut, by their nominal names, and what the settings say was done to them."""

    kerf_mm: float = 0.0
    #: How many interruptions an outline has at most, and how wide the bridges are.
    micro: tuple[int, float] | None = None

    def name_of(self, sheet: str) -> str:
        """Return what the files of a sheet are to be called, without suffix."""
        words = [sheet]
        if self.kerf_mm:
            words.append(f"kerf{self.kerf_mm:g}mm")
        if self.micro is not None:
            words.append(f"micro{self.micro[0]}x{self.micro[1]:g}mm")
        return "_".join(words)


@dataclass(frozen=True)
class Rim(Drawings):
    """The rings that are told of, and the drawings of their sheets."""

    rings: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True)
class Offcuts(Drawings):
    """The drawings of offcuts, by where they are, and the list of stock beside them."""

    stock: dict[str, Any] | None = None


@dataclass(frozen=True)
class Service(Drawings):
    """The rows of the table, the drawings by their row's file, and all files that are there."""

    rows: list[dict[str, str]] = field(default_factory=list)
    files: tuple[str, ...] = ()


def read_ready(
    directory: Path, options: dict[str, Any], sheets: Iterable[str], read: Read, tally: Tally
) -> Ready | None:
    """Read the sheets that are to be cut; None where the settings want none.

    ``sheets`` are the names of the nominal ones; files that do not belong there are told.
    """
    kerf, micro, place = 0.0, None, tally.at("job.toml")
    try:
        kerf = float(str(options.get("kerf", 0.0)).removesuffix("mm"))
    except ValueError:
        place.fail(f"the kerf {options['kerf']!r} is no length")
    if "micro_joints" in options:
        words = _MICRO.fullmatch(str(options["micro_joints"]))
        if place.expect(words, "micro_joints are not NUMBER:WIDTH") and words:
            micro = int(words[1]), float(words[2])
    ready = Ready(kerf_mm=kerf, micro=micro)
    asked = bool(kerf) or micro is not None
    rings = sorted(path.stem for path in (directory / RIM).glob("*.dxf"))
    names = {name: ready.name_of(name) for name in (*sheets, *rings)} if asked else {}
    for name, stem in names.items():
        ready.add(name, f"{READY}/{stem}", read)
    for path in sorted((directory / READY).iterdir()) if (directory / READY).is_dir() else ():
        # A sheet left over from an earlier run would be cut too.
        tally.at(READY, path.name).expect(path.stem in names.values(), "it is no sheet of this job")
    return ready if names else None


def read_rim(
    directory: Path, read: Read, read_lists: Callable[[Path], dict[str, Any]]
) -> Rim | None:
    """Read all that is in the folder of rings, their record by a reader; None if there is none."""
    if not (directory / RIM).is_dir():
        return None
    rim = Rim(rings=(read(RIM_RECORD, read_lists) or {"rings": []})["rings"])
    for path in sorted((directory / RIM).glob("*.dxf")):
        rim.add(path.stem, f"{RIM}/{path.stem}", read)
    return rim


def read_offcuts(
    directory: Path, read: Read, read_toml: Callable[[Path], dict[str, Any]]
) -> Offcuts | None:
    """Read all that is in the folder of offcuts, the list by a reader; None if there is none."""
    if not (directory / OFFCUTS).is_dir():
        return None
    offcuts = Offcuts(stock=read(STOCK, read_toml))
    for path in sorted((directory / OFFCUTS).iterdir()):
        name = f"{OFFCUTS}/{path.name}"
        drawing = read(name, read_dxf) if name != STOCK else None
        if drawing is not None:
            offcuts.dxf[name] = drawing
    return offcuts


def read_service(directory: Path, fail: Callable[[str], None]) -> Service:
    """Read a service's folder; what a row names and cannot be read is told.

    Raises
    ------
    ReadError
        If the table has not the columns that it should.
    """
    with io.StringIO(read_text(directory / TABLE), newline="") as file:
        try:
            table = list(csv.reader(file, strict=True))
        except csv.Error as error:
            raise ReadError(f"it is not CSV: {error}") from error
    if not table or tuple(table[0]) != COLUMNS or any(len(row) != len(COLUMNS) for row in table):
        raise ReadError(f"its rows do not all have the columns {list(COLUMNS)}")
    paths = (path for path in directory.rglob("*") if path.is_file())
    service = Service(
        rows=[dict(zip(COLUMNS, row, strict=True)) for row in table[1:]],
        files=tuple(sorted(path.relative_to(directory).as_posix() for path in paths)),
    )
    for name in (row["file"] for row in service.rows):
        if not _PART.fullmatch(name):
            fail(f"{SERVICE}/{TABLE}: no file of a piece is called {name!r}")
            continue
        try:
            service.dxf[name] = read_dxf(directory / name, layers=(PLAIN_LAYER,))
            service.svg[name] = read_svg((directory / name).with_suffix(".svg"), layered=False)
        except (ReadError, OSError, UnicodeDecodeError) as error:
            fail(f"{SERVICE}/{name} or its SVG cannot be read: {error}")
    return service
