"""Load a finished job's files; whatever is missing or malformed becomes a finding."""

import csv
import io
import math
import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

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
from fabweave.verify.measure.walks import Pass, Walk, edge_of_crossings, thread_passes
from fabweave.verify.read.dxf import read_dxf
from fabweave.verify.read.glb import Strip, read_model
from fabweave.verify.read.mesh import LoadedMesh, SourceMesh, read_obj, read_source
from fabweave.verify.read.svg import read_svg
from fabweave.verify.report import Place, Tally

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
#: The list of cuts of straight strips.
CUTS = "cut_list.csv"
#: Where offcuts lie.
OFFCUTS = "offcuts"
#: Where files for a service lie, and the table of them.
SERVICE, TABLE = "service", "parts.csv"
#: What the plan has, as tables for people; and what else is written with every plan.
PIECES, STATIONS, CROSSINGS = "pieces.csv", "stations.csv", "crossing_map.csv"
_BESIDE = ("waste.json", "preflight.json", VERDICT)
#: What people are told of rings, and of a former.
_RIM_TEXT, _FORMER_TEXT = "rim/rim.txt", "former/former.txt"
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
    #: The sheets on which what pieces share is cut once.
    shared: frozenset[str] = frozenset()

    def name_of(self, sheet: str) -> str:
        """Return what the files of a sheet are to be called, without suffix."""
        words = [sheet]
        if self.kerf_mm:
            words.append(f"kerf{self.kerf_mm:g}mm")
        if self.micro is not None:
            words.append(f"micro{self.micro[0]}x{self.micro[1]:g}mm")
        if sheet in self.shared:
            words.append("common")
        return "_".join(words)


@dataclass(frozen=True)
class Rim(Drawings):
    """The rings that are told of, and the drawings of their sheets."""

    rings: list[dict[str, Any]] = field(default_factory=list)


@dataclass(frozen=True)
class Former(Drawings):
    """What is said of a former, and the drawings of its sheets."""

    record: FormerRecord | None = None


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
    gaps = {length_of(gap) for gap in by_bunch(options.get("gap")).values()}
    straight = options.get("strips") == "straight"
    common = straight and micro is None and gaps == {kerf}
    sheets = list(sheets)
    ready = Ready(kerf_mm=kerf, micro=micro, shared=frozenset(sheets if common else ()))
    asked = bool(kerf) or micro is not None
    beside = sorted(
        path.stem for folder in (RIM, FORMER) for path in (directory / folder).glob("*.dxf")
    )
    drawn = [*(sheets if asked or common else ()), *(beside if asked else ())]
    names = {name: ready.name_of(name) for name in drawn}
    for name, stem in names.items():
        ready.add(name, f"{READY}/{stem}", read)
    for path in sorted((directory / READY).iterdir()) if (directory / READY).is_dir() else ():
        # A sheet left over from an earlier run would be cut too.
        tally.at(READY, path.name).expect(path.stem in names.values(), "it is no sheet of this job")
    return ready if names else None


def read_rim(directory: Path, read: Read) -> Rim | None:
    """Read all that is in the folder of rings; None if there is none."""
    if not (directory / RIM).is_dir():
        return None
    record = read(RIM_RECORD, lambda path: read_json(path, RimRecord))
    rim = Rim(rings=record["rings"] if record else [])
    for path in sorted((directory / RIM).glob("*.dxf")):
        rim.add(path.stem, f"{RIM}/{path.stem}", read)
    return rim


def read_former(directory: Path, read: Read) -> Former | None:
    """Read all that is in the folder of a former; None if there is none."""
    if not (directory / FORMER).is_dir():
        return None
    former = Former(record=read(FORMER_RECORD, lambda path: read_json(path, FormerRecord)))
    for path in sorted((directory / FORMER).glob("*.dxf")):
        former.add(path.stem, f"{FORMER}/{path.stem}", read)
    return former


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


def thread_supplies(options: Mapping[str, Any], plan: CrossingMap) -> dict[int, Supply]:
    """Return the supply of each thread, by its id."""
    settings = {key: by_bunch(options.get(key)) for key in ("material", "thickness", "gap")}
    supplies = {}
    for thread in plan.threads:
        material, thickness, gap = (
            values.get(thread.bunch, values.get(None)) for values in settings.values()
        )
        supplies[thread.id] = Supply(material, length_of(thickness), length_of(gap))
    return supplies


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
    model: dict[str, Strip] | None = None
    dxf: dict[int, Drawing] = field(default_factory=dict)
    svg: dict[int, Drawing] = field(default_factory=dict)
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
    rim: Rim | None = None
    #: The former, if there is such a folder.
    former: Former | None = None
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

    @property
    def options(self) -> dict[str, Any]:
        """What job.toml says the job was asked for; empty if nothing."""
        return _options(self.settings)

    @property
    def openings(self) -> list[dict[str, Any]]:
        """What job.toml says of the openings that were made."""
        outcome = (self.settings or {}).get("outcome")
        openings = outcome.get("openings") if isinstance(outcome, dict) else None
        return openings if isinstance(openings, list) else []

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
        return thread_passes(self.map, self.mesh, self.edges, self.model, turning=turning)

    @property
    def boundary(self) -> object:
        """What the settings say that threads do at the boundary; unsaid, they end there."""
        return self.options.get("boundary", "end")

    @cached_property
    def supplies(self) -> dict[int, Supply]:
        """What each thread is cut from, as the settings say."""
        return {} if self.map is None else thread_supplies(self.options, self.map)

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
        for ring in self.rim.rings if self.rim is not None else ():
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
        if self.map is None or self.model is None:
            return {}
        return develop_pieces(self.map, self.model)


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
    drawings = job.dxf if kind == "dxf" else job.svg
    for sheet in required(job.map).sheets:
        drawing = drawings.get(sheet.number)
        if drawing is not None:
            yield sheet, drawing, tally.at(f"{sheet.name}.{kind}")
        elif needed:
            tally.fail(f"{sheet.name}.{kind} is not checked, because it could not be read")


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

    def if_there(name: str, reader: Callable[[Path], _Value]) -> _Value | None:
        """Read what not every job has."""
        return read(name, reader) if (directory / name).exists() else None

    plan = read("crossing_map.json", read_crossing_map)
    drawn = Drawings()
    number = {sheet.name: sheet.number for sheet in plan.sheets} if plan is not None else {}
    for name in number:
        drawn.add(name, f"sheets/{name}", read)
    if plan is not None and (directory / "sheets").is_dir():
        for path in sorted((directory / "sheets").iterdir()):
            # A sheet left over from an earlier run would be cut too.
            tally.at("sheets", path.name).expect(path.stem in number, "it is no sheet of this job")
    settings = read("job.toml", _read_toml)
    options = _options(settings)
    tables = {name: read(name, read_table) for name in (PIECES, STATIONS, CROSSINGS)}
    for name in _BESIDE:
        tally.at(name).expect((directory / name).is_file(), "it is missing")
    for text, record in ((_RIM_TEXT, RIM_RECORD), (_FORMER_TEXT, FORMER_RECORD)):
        if (folder := (directory / text).parent).is_dir():
            read(text, read_text)
            stems = {path.stem for path in folder.glob("*.dxf")}
            for path in sorted(folder.iterdir()):
                named = path.stem in stems or f"{folder.name}/{path.name}" in (text, record)
                tally.at(folder.name, path.name).expect(named, "it is no sheet of this job")
    _find_strays(directory, tally)
    return Job(
        map=plan,
        mesh=read("woven_mesh.obj", read_obj),
        model=read("model.glb", read_model),
        dxf={number[name]: drawing for name, drawing in drawn.dxf.items()},
        svg={number[name]: drawing for name, drawing in drawn.svg.items()},
        settings=settings,
        ribbons=read("ribbons.json", lambda path: read_json(path, RibbonReport)),
        source=read_source(directory, options, read),
        ready=read_ready(directory, options, number, read, tally),
        service=if_there(SERVICE, lambda path: read_service(path, tally.fail)),
        sticks=if_there(STICKS, read_table),
        offcuts=read_offcuts(directory, read),
        rim=read_rim(directory, read),
        former=read_former(directory, read),
        form=if_there(FORM, lambda path: read_json(path, FormRecord)),
        relaxed=if_there(RELAXED, read_model),
        verdict=if_there(VERDICT, lambda path: read_json(path, dict)),
        cuts=if_there(CUTS, read_table),
        tables={name: rows for name, rows in tables.items() if rows is not None},
        offcut_stock=if_there(OFFCUT_STOCK, _read_toml),
    )


def _find_strays(directory: Path, tally: Tally) -> None:
    """Tell of drawings where none of a job's lie."""
    for where, _, names in os.walk(directory):
        folder = Path(where).relative_to(directory)
        if folder.parts[:1] not in {(one,) for one in _DRAWN}:
            drawn = [name for name in names if Path(name).suffix.lower() in (".dxf", ".svg")]
            place = tally.at(folder.as_posix())
            place.expect(not drawn, f"{drawn[:3]} are no drawings of this job")


def _read_toml(path: Path) -> dict[str, Any]:
    """Read settings."""
    try:
        return tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise ReadError(f"it is not TOML: {error}") from error
