"""Read the files for a service: one of each distinct piece, and the table of quantities."""

import csv
import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from fabweave.verify.drawing import Drawing, ReadError
from fabweave.verify.read.content import read_text
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.svg import read_svg

FOLDER, TABLE = "service", "parts.csv"
COLUMNS = (
    "file", "quantity", "kind", "pieces", "material", "thickness_mm", "length_mm", "width_mm",
    "area_mm2", "cut_length_mm", "holes",
)  # fmt: skip
#: Everything is on this layer of a DXF file.
LAYER = "0"
_FILE = re.compile(r"[a-z0-9-]+_[0-9.]+mm/kind_[0-9]+_qty_[0-9]+\.dxf")


@dataclass(frozen=True, eq=False)
class Service:
    """The rows of the table, the drawings by their row's file, and all files that are there."""

    rows: list[dict[str, str]]
    dxf: dict[str, Drawing]
    svg: dict[str, Drawing]
    files: tuple[str, ...]


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
    if not table or tuple(table[0]) != COLUMNS:
        raise ReadError(f"its columns are {table[0] if table else []}, not {list(COLUMNS)}")
    if any(len(row) != len(COLUMNS) for row in table):
        raise ReadError(f"a row has not {len(COLUMNS)} cells")
    rows = [dict(zip(COLUMNS, row, strict=True)) for row in table[1:]]
    dxf: dict[str, Drawing] = {}
    svg: dict[str, Drawing] = {}
    for row in rows:
        name = row["file"]
        if not _FILE.fullmatch(name):
            fail(f"{FOLDER}/{TABLE}: no file of a piece is called {name!r}")
            continue
        try:
            dxf[name] = read_dxf(directory / name, layers=(LAYER,))
            svg[name] = read_svg((directory / name).with_suffix(".svg"), layered=False)
        except (ReadError, OSError, UnicodeDecodeError) as error:
            fail(f"{FOLDER}/{name} or its SVG cannot be read: {error}")
    paths = (path for path in directory.rglob("*") if path.is_file())
    return Service(
        rows, dxf, svg, tuple(sorted(path.relative_to(directory).as_posix() for path in paths))
    )
