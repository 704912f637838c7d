"""Load a finished job's files; whatever is missing or malformed becomes a finding."""

import json
import math
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from fabweave.verify.crossing_map import CrossingMap, Sheet, read_crossing_map
from fabweave.verify.drawing import Drawing, Floats, ReadError
from fabweave.verify.measure.development import Development, develop_pieces
from fabweave.verify.measure.supplies import Supply, length_of, thread_supplies
from fabweave.verify.measure.threads import edge_of_crossings, thread_passes
from fabweave.verify.measure.walks import LoadedMesh, Pass, Walk, read_obj
from fabweave.verify.read.content import read_text
from fabweave.verify.read.folders import (
    SERVICE,
    Drawings,
    Offcuts,
    Ready,
    Rim,
    Service,
    read_offcuts,
    read_ready,
    read_rim,
    read_service,
)
from fabweave.verify.read.glb import Strip, read_model
from fabweave.verify.read.source_mesh import SourceMesh, read_source
from fabweave.verify.statement import Place, Tally

_Value = TypeVar("_Value")


@dataclass(frozen=True, eq=False)
class Job:
    """A job as read; None, or absent from a lookup, is what could not be read."""

    map: CrossingMap | None = None
    mesh: LoadedMesh | None = None
    model: dict[str, Strip] | None = None
    markers: dict[int, Floats] = field(default_factory=dict)
    dxf: dict[int, Drawing] = field(default_factory=dict)
    svg: dict[int, Drawing] = field(default_factory=dict)
    settings: dict[str, Any] | None = None
    ribbons: dict[str, Any] | None = None
    #: The sheets that are to be cut, where they are not the nominal ones.
    ready: Ready | None = None
    #: The mesh that the job was made from, if it is at hand.
    source: SourceMesh | None = None
    #: What is in the folder for a service, if there is one.
    service: Service | None = None
    #: What is in the folder of offcuts, if there is one.
    offcuts: Offcuts | None = None
    #: The rings around openings, if there is such a folder.
    rim: Rim | None = None

    @property
    def options(self) -> dict[str, Any]:
        """What job.toml says the job was asked for; empty if nothing."""
        return _options(self.settings)

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
    model, markers = read("model.glb", read_model) or (None, {})
    return Job(
        map=plan,
        mesh=read(
            "woven_mesh.obj",
            lambda path: replace(
                read_obj(path), course=_options(settings).get("course", LoadedMesh.course)
            ),
        ),
        model=model,
        markers=markers,
        dxf={number[name]: drawing for name, drawing in drawn.dxf.items()},
        svg={number[name]: drawing for name, drawing in drawn.svg.items()},
        settings=settings,
        ribbons=read(
            "ribbons.json",
            lambda path: _read_lists(path, "fabweave.ribbons/1", "threads", "findings"),
        ),
        source=read_source(directory, options, read),
        ready=read_ready(directory, options, number, read, tally),
        service=read(SERVICE, lambda path: read_service(path, tally.fail))
        if (directory / SERVICE).is_dir()
        else None,
        offcuts=read_offcuts(directory, read, _read_toml),
        rim=read_rim(directory, read, lambda path: _read_lists(path, "fabweave.rim/1", "rings")),
    )


def _read_toml(path: Path) -> dict[str, Any]:
    """Read settings."""
    try:
        return tomllib.loads(read_text(path))
    except tomllib.TOMLDecodeError as error:
        raise ReadError(f"it is not TOML: {error}") from error


def _read_lists(path: Path, schema: str, *keys: str) -> dict[str, Any]:
    """Read JSON that has lists of records."""
    document = _read_document(path, schema)
    for key in keys:
        records = document.get(key)
        if not isinstance(records, list) or not all(isinstance(one, dict) for one in records):
            raise ReadError(f"it has no list of {key}")
    return document


def _read_document(path: Path, schema: str) -> dict[str, Any]:
    """Read JSON of a schema, in millimetres."""
    try:
        document = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise ReadError(f"it is not JSON: {error}") from error
    if not isinstance(document, dict) or document.get("schema") != schema:
        raise ReadError(f"its schema is not {schema!r}")
    if document.get("units") != "mm":
        raise ReadError("its units are not 'mm'")
    return document
