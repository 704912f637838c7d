"""Load a finished job's files; whatever is missing or malformed becomes a finding."""

import csv
import io
import math
import os
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from fabweave.verify.crossing_map import (
    CrossingMap,
    FormerRecord,
    FormRecord,
    RibbonReport,
    RimRecord,
    Sheet,
    read_crossing_map,
    read_json,
)
from fabweave.verify.drawing import PLAIN_LAYER, Drawing, ReadError, read_text
from fabweave.verify.measure.development import Development, develop_pieces
from fabweave.verify.measure.walks import (
    Pass,
    Walk,
    edge_of_crossings,
    thread_passes,
    thread_strips,
)
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.glb import Strip, read_model
from fabweave.verify.read.mesh import LoadedMesh, SourceMesh, read_obj, read_source
from fabweave.verify.read.svg import read_svg
from fabweave.verify.report import Place, Tally

if TYPE_CHECKING:
    from fabweave.verify.read.queue import Shared

#: Reads a file of the job by its name and a reader, or tells why not, and returns None.
Read: TypeAlias = Callable[[str, Callable[[Path], Any]], Any]

#: Where the sheets lie that are to be cut, with kerf and micro-joints.
READY = "cut"
#: Where rings lie, and the record that tells of them.
RIM, RIM_RECORD = "rim", "rim/rim.json"
#: Where a former lies, and its record.
FORMER, FORMER_RECORD = "former", "former/former.json"
#: Where it is told how the object is when it was let go, and its model then.
FORM, RELAXED, VERDICT = "form.json", "model_relaxed.glb", "verdict.json"
#: The mesh that it settles onto, where the one that is woven was moved for that.
AIMED = "aimed_mesh.obj"
#: The list of cuts of straight strips.
CUTS = "cut_list.csv"
#: Where offcuts lie.
OFFCUTS = "offcuts"
#: Where files for a service lie, and the table of them.
SERVICE, TABLE = "service", "parts.csv"
#: The board that feet are tied to.
BASE = "base"
#: What the plan has, as tables for people; and what else is written with every plan.
PIECES, STATIONS, CROSSINGS = "pieces.csv", "stations.csv", "crossing_map.csv"
_BESIDE = ("waste.json", "preflight.json", VERDICT)
#: The list of offcuts as stock.
OFFCUT_STOCK = "offcuts/stock.toml"
#: Where drawings may lie: a machine may get any.
_DRAWN = ("sheets", READY, RIM, FORMER, OFFCUTS, SERVICE)
#: The marks of straight strips.
STICKS = "sticks.csv"
_PART = re.compile(r"[a-z0-9.-]+_[0-9.]+mm/kind_[0-9]+_qty_[0-9]+\.dxf")
_MICRO = re.compile(r"(\d+):([\d.]+)mm")


@dataclass(frozen=True)
class Drawings:
    """The drawings of a folder in both formats, by the names of what they draw."""

    folder: str
    dxf: dict[str, Drawing] = field(default_factory=dict)
    svg: dict[str, Drawing] = field(default_factory=dict)
    #: Those on which what pieces share is cut once.
    shared: frozenset[str] = frozenset()

    def stem_of(self, name: str) -> str:
        """Return what the files of a name are to be called, without suffix."""
        return name

    def add(self, name: str, read: Read) -> None:
        """Read both drawings of a name; one that cannot be read is left out."""
        for suffix, reader, kept in ((".dxf", read_dxf, self.dxf), (".svg", read_svg, self.svg)):
            drawing = read(f"{self.folder}/{self.stem_of(name)}{suffix}", reader)
            if drawing is not None:
                kept[name] = drawing

    def drawn(self) -> Iterator[tuple[str, str, Drawing]]:
        """Yield every drawing with its name and that of its file."""
        for suffix, drawn in ((".dxf", self.dxf), (".svg", self.svg)):
            for name, drawing in drawn.items():
                yield name, f"{self.folder}/{self.stem_of(name)}{suffix}", drawing


@dataclass(frozen=True)
class Ready(Drawings):
    """The sheets to cut, by their nominal names, and what the settings say was done to them."""

    kerf_mm: float = 0.0
    #: How many interruptions an outline has at most, and how wide the bridges are.
    micro: tuple[int, float] | None = None

    def stem_of(self, name: str) -> str:
        """Return what the files of a sheet are to be called, without suffix."""
        words = [name]
        if self.kerf_mm:
            words.append(f"kerf{self.kerf_mm:g}mm")
        if self.micro is not None:
            words.append(f"micro{self.micro[0]}x{self.micro[1]:g}mm")
        if name in self.shared:
            words.append("common")
        return "_".join(words)


@dataclass(frozen=True)
class Beside(Drawings):
    """The sheets of rings, or of a former, and the record of what is on them."""

    record: Any = None


@dataclass(frozen=True)
class Service(Drawings):
    """The rows of the table, the drawings by their row's file, and all files that are there."""

    rows: list[dict[str, str]] = field(default_factory=list)
    files: tuple[str, ...] = ()

    def stem_of(self, name: str) -> str:
        """Return what files are called whose DXF has a name."""
        return name.removesuffix(".dxf")


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
    gaps = {length_of(gap) for gap in by_bunch(options.get("gap")).values()}
    straight = options.get("strips") == "straight"
    common = straight and micro is None and gaps == {kerf}
    sheets = list(sheets)
    shared = frozenset(sheets if common else ())
    ready = Ready(READY, kerf_mm=kerf, micro=micro, shared=shared)
    asked = bool(kerf) or micro is not None
    beside = sorted(
        path.stem for folder in (RIM, FORMER) for path in (directory / folder).glob("*.dxf")
    )
    drawn = [*(sheets if asked or common else ()), *(beside if asked else ())]
    for name in drawn:
        ready.add(name, read)
    find_strange(directory / READY, set(map(ready.stem_of, drawn)), tally)
    return ready if drawn else None


def find_strange(folder: Path, known: Collection[str], tally: Tally) -> None:
    """Tell of what is in a folder beside: a sheet left over from an earlier run would be cut."""
    for path in sorted(folder.iterdir()) if folder.is_dir() else ():
        named = path.stem in known or path.name in known
        tally.at(folder.name, path.name).expect(named, "it is no sheet of this job")


def read_beside(
    directory: Path, name: str, kind: type[Any], read: Read, tally: Tally
) -> Beside | None:
    """Read all that is in the folder of rings, or of a former; None if there is none."""
    folder = directory / name
    if not folder.is_dir():
        return None
    record, told = f"{name}.json", f"{name}.txt"
    beside = Beside(name, record=read(f"{name}/{record}", lambda path: read_json(path, kind)))
    read(f"{name}/{told}", read_text)
    sheets = sorted(path.stem for path in folder.glob("*.dxf"))
    for sheet in sheets:
        beside.add(sheet, read)
    find_strange(folder, {*sheets, record, told}, tally)
    return beside


def read_offcuts(directory: Path, read: Read) -> dict[str, Drawing]:
    """Read the drawings of offcuts, by where they are; what cannot be read is left out."""
    paths = [path for path in (directory / OFFCUTS).glob("*") if path.name != "stock.toml"]
    names = [f"{OFFCUTS}/{path.name}" for path in sorted(paths)]
    drawings = ((name, read(name, read_dxf)) for name in names)
    return {name: drawing for name, drawing in drawings if drawing is not None}


def read_table(path: Path) -> list[dict[str, str]]:
    """Read the rows of a table."""
    return list(csv.DictReader(io.StringIO(read_text(path), newline=""), strict=True))


def read_service(directory: Path, fail: Callable[[str], None]) -> Service:
    """Read a service's folder; what a row names and cannot be read is told."""
    rows = read_table(directory / TABLE)
    paths = (path for path in directory.rglob("*") if path.is_file())
    service = Service(
        SERVICE,
        rows=rows,
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


_NAMES = ("warp", "weft")


@dataclass(frozen=True)
class Supply:
    """What a thread is cut from, as the settings say; None where they say nothing."""

    material: str | None = None
    thickness_mm: float | None = None
    gap_mm: float | None = None


def by_bunch(text: object) -> dict[int | None, str]:
    """Return a setting's value for each bunch that it names; one value for all under None.

    Examples
    --------
    >>> by_bunch("warp=card,weft=birch-veneer"), by_bunch("2mm")
    ({0: 'card', 1: 'birch-veneer'}, {None: '2mm'})
    """
    if not isinstance(text, str):
        return {}
    if "=" not in text:
        return {None: text}
    values: dict[int | None, str] = {}
    for part in text.split(","):
        name, _, value = (word.strip() for word in part.partition("="))
        number = _NAMES.index(name) if name in _NAMES else int(name) if name.isdecimal() else -1
        values[number] = value
    return values


def length_of(text: str | None) -> float | None:
    """Return a length as fabweave writes it."""
    try:
        return None if text is None else float(text.removesuffix("mm"))
    except ValueError:
        return None


_Value = TypeVar("_Value")


@dataclass(frozen=True, eq=False)
class Job:
    """A job as read; None, or absent from a lookup, is what could not be read."""

    map: CrossingMap | None = None
    mesh: LoadedMesh | None = None
    #: What it settles onto, where that is another one.
    aimed: LoadedMesh | None = None
    model: dict[str, Strip] | None = None
    #: The nominal sheets.
    sheets: Drawings = Drawings("sheets")
    settings: dict[str, Any] | None = None
    ribbons: RibbonReport | None = None
    #: The sheets that are to be cut, where they are not the nominal ones.
    ready: Ready | None = None
    #: The mesh that the job was made from, if it is at hand.
    source: SourceMesh | None = None
    #: What is in the folder for a service, if there is one.
    service: Service | None = None
    #: The rows of the table of marks on straight strips, if there is one.
    sticks: list[dict[str, str]] | None = None
    #: The drawings of offcuts, by where they are.
    offcuts: dict[str, Drawing] = field(default_factory=dict)
    #: The rings around openings, if there is such a folder.
    rim: Beside | None = None
    #: The former, if there is such a folder.
    former: Beside | None = None
    #: The board that feet are tied to, if there is one.
    base: Drawings | None = None
    #: How it is when it was let go, the model of that, and what is said of it; none of large ones.
    form: FormRecord | None = None
    relaxed: dict[str, Strip] | None = None
    verdict: dict[str, Any] | None = None
    #: The rows of the tables for people, by their names.
    tables: dict[str, list[dict[str, str]]] = field(default_factory=dict)
    #: The list of offcuts as stock.
    offcut_stock: dict[str, Any] | None = None
    #: The rows of the list of cuts, if there is one.
    cuts: list[dict[str, str]] | None = None
    #: Whose pieces these are, if they are of several jobs that share sheets.
    shared: "Shared | None" = None

    @property
    def wished(self) -> LoadedMesh | None:
        """The mesh that the object is to be in the end."""
        return self.mesh if self.aimed is None else self.aimed

    @property
    def options(self) -> dict[str, Any]:
        """What job.toml says the job was asked for; empty if nothing."""
        return _options(self.settings)

    @property
    def based(self) -> bool:
        """Whether its feet are to be tied to a board."""
        return self.options.get("base") == "on"

    @property
    def drawings(self) -> list[Drawings]:
        """All sheets that machines may get, by the folders in which they lie."""
        each = (self.sheets, self.ready, self.rim, self.former, self.base)
        return [drawings for drawings in each if drawings is not None]

    @property
    def rings(self) -> list[dict[str, Any]]:
        """What is said of the rings around openings."""
        return self.rim.record["rings"] if self.rim is not None and self.rim.record else []

    @property
    def openings(self) -> list[dict[str, Any]]:
        """What job.toml says of the openings that were made."""
        outcome = (self.settings or {}).get("outcome")
        openings = outcome.get("openings") if isinstance(outcome, dict) else None
        return openings if isinstance(openings, list) else []

    @property
    def taken(self) -> dict[str, Any]:
        """What job.toml says was taken of the mesh as given, or added; empty where all was."""
        outcome = (self.settings or {}).get("outcome")
        taken = outcome.get("taken") if isinstance(outcome, dict) else None
        return taken if isinstance(taken, dict) else {}

    @cached_property
    def edges(self) -> dict[int, int]:
        """The edge of each crossing that lies on an inner edge of the mesh."""
        if self.map is None or self.mesh is None:
            return {}
        return edge_of_crossings(self.map, self.mesh)

    @cached_property
    def passes(self) -> tuple[dict[int, tuple[Pass, ...]], list[Walk]]:
        """The mesh's walks along the threads, and the walks that no thread takes."""
        if self.map is None or self.mesh is None:
            return {}, []
        turning = self.boundary == "turn"
        return thread_passes(self.map, self.mesh, self.edges, self.strips, turning=turning)

    @cached_property
    def strips(self) -> dict[int, Strip]:
        """The model's strip of each thread, where it has the panels of that."""
        return {} if self.map is None else thread_strips(self.map, self.model or {})

    @property
    def boundary(self) -> object:
        """What the settings say that threads do at the boundary; unsaid, they end there."""
        return self.options.get("boundary", "end")

    @cached_property
    def supplies(self) -> dict[int, Supply]:
        """What each thread is cut from, as the settings say."""
        settings = [by_bunch(self.options.get(key)) for key in ("material", "thickness", "gap")]
        supplies = {}
        for thread in self.map.threads if self.map is not None else ():
            material, *lengths = (each.get(thread.bunch, each.get(None)) for each in settings)
            supplies[thread.id] = Supply(material, *map(length_of, lengths))
        return supplies

    @cached_property
    def layers(self) -> dict[int, tuple[int, float]]:
        """How many layers lie at each crossing, and how thick they are together.

        The thickness is not a number where the settings do not tell that of all threads.
        """
        layers: dict[int, tuple[int, float]] = {}
        for piece in self.map.pieces if self.map is not None else ():
            supply = self.supplies.get(piece.thread, Supply())
            thick = math.nan if supply.thickness_mm is None else supply.thickness_mm
            for station in piece.stations:
                count, total = layers.get(station.crossing, (0, 0.0))
                layers[station.crossing] = (count + 1, total + thick)
        for ring in self.rings:
            for hole in (hole for piece in ring["pieces"] for hole in piece["holes"]):
                count, total = layers.get(hole["crossing"], (0, 0.0))
                layers[hole["crossing"]] = (count + 1, total + ring["thickness_mm"])
        return layers

    @property
    def clearance_mm(self) -> float | None:
        """The air between ribbons that is wanted, if the settings state it."""
        text = self.options.get("clearance")
        return None if text is None else length_of(str(text))

    @cached_property
    def developments(self) -> dict[str, Development]:
        """The development of each piece's part of the model, laid on the piece."""
        return {} if self.map is None else develop_pieces(self.map, self.strips)


def _options(settings: dict[str, Any] | None) -> dict[str, Any]:
    """Return the table of a job.toml that says what was asked for; empty where there is none."""
    options = (settings or {}).get("job")
    return options if isinstance(options, dict) else {}


def required(value: _Value | None) -> _Value:
    """Return what a check needs; that it could be read has been seen to."""
    if value is None:
        raise ReadError("a file that is needed could not be read")
    return value


def sheet_drawings(
    job: Job, kind: str, tally: Tally, *, needed: bool = False
) -> Iterator[tuple[Sheet, Drawing, Place]]:
    """Yield each sheet with its drawing of a kind, ``dxf`` or ``svg``, and the name of that file.

    One that could not be read is left out, and a finding where it is needed.
    """
    drawings = job.sheets.dxf if kind == "dxf" else job.sheets.svg
    for sheet in required(job.map).sheets:
        drawing = drawings.get(sheet.name)
        if drawing is not None:
            yield sheet, drawing, tally.at(f"{sheet.name}.{kind}")
        elif needed:
            tally.fail(f"{sheet.name}.{kind} is not checked, because it could not be read")


def reader(directory: Path, tally: Tally) -> Read:
    """Return what reads the files of a folder, counts them, and tells what cannot be read."""

    def read(name: str, reader: Callable[[Path], _Value]) -> _Value | None:
        """Read one file, or say why not."""
        tally.count()
        if "\0" in name or ".." in Path(name).parts or Path(name).is_absolute():
            tally.fail(f"{name!r} is not in the job's folder")
            return None
        try:
            return reader(directory / name)
        except FileNotFoundError:
            tally.fail(f"{name} is missing")
        except (ReadError, OSError, UnicodeDecodeError) as error:
            tally.fail(f"{name} cannot be read: {error}")
        except Exception as error:  # whatever stands in the files, this is a finding
            tally.unfinished(f"{name} cannot be read", error)
        return None

    return read


def load_job(directory: Path, tally: Tally) -> Job:
    """Read every file of a job, and count them.

    Parameters
    ----------
    directory : Path
        The job's folder.
    tally : Tally
        Where missing and malformed files are told.

    Returns
    -------
    Job
        What could be read.
    """
    read = reader(directory, tally)

    def if_there(name: str, reader: Callable[[Path], _Value]) -> _Value | None:
        """Read what not every job has."""
        return read(name, reader) if (directory / name).exists() else None

    plan = read("crossing_map.json", read_crossing_map)
    sheets = Drawings("sheets")
    names = dict.fromkeys(sheet.name for sheet in plan.sheets) if plan is not None else {}
    for name in names:
        sheets.add(name, read)
    if plan is not None:
        find_strange(directory / sheets.folder, names, tally)
    settings = read("job.toml", read_toml)
    options = _options(settings)
    tables = {name: read(name, read_table) for name in (PIECES, STATIONS, CROSSINGS)}
    for name in _BESIDE:
        tally.at(name).expect((directory / name).is_file(), "it is missing")
    _find_strays(directory, tally)
    return Job(
        map=plan,
        mesh=read("woven_mesh.obj", read_obj),
        aimed=if_there(AIMED, read_obj),
        model=read("model.glb", read_model),
        sheets=sheets,
        settings=settings,
        ribbons=read("ribbons.json", lambda path: read_json(path, RibbonReport)),
        source=read_source(directory, options, read),
        ready=read_ready(directory, options, names, read, tally),
        service=if_there(SERVICE, lambda path: read_service(path, tally.fail)),
        sticks=if_there(STICKS, read_table),
        offcuts=read_offcuts(directory, read),
        rim=read_beside(directory, RIM, RimRecord, read, tally),
        former=read_beside(directory, FORMER, FormerRecord, read, tally),
        base=_read_base(directory, read),
        form=if_there(FORM, lambda path: read_json(path, FormRecord)),
        relaxed=if_there(RELAXED, read_model),
        verdict=if_there(VERDICT, lambda path: read_json(path, dict)),
        cuts=if_there(CUTS, read_table),
        tables={name: rows for name, rows in tables.items() if rows is not None},
        offcut_stock=if_there(OFFCUT_STOCK, read_toml),
    )


def _read_base(directory: Path, read: Read) -> Drawings | None:
    """Read the board that feet are tied to; None if there is none."""
    if not any((directory / BASE).with_suffix(suffix).exists() for suffix in (".dxf", ".svg")):
        return None
    base = Drawings(".")
    base.add(BASE, read)
    return base


def _find_strays(directory: Path, tally: Tally) -> None:
    """Tell of drawings where none of a job's lie."""
    for where, _, names in os.walk(directory):
        folder = Path(where).relative_to(directory)
        if folder.parts[:1] not in {(one,) for one in _DRAWN}:
            drawn = [name for name in names if Path(name).suffix.lower() in (".dxf", ".svg")]
            drawn = [one for one in drawn if folder.parts or Path(one).stem != BASE]
            place = tally.at(folder.as_posix())
            place.expect(not drawn, f"{drawn[:3]} are no drawings of this job")


def read_toml(path: Path) -> dict[str, Any]:
    """Read settings."""
    try:
        return tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise ReadError(f"it is not TOML: {error}") from error
