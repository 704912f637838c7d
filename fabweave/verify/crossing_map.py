"""Read the crossing map as plain values, found by id; what breaks its schema is named."""

import math
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, NotRequired, TypeAlias, TypedDict, TypeVar

import msgspec
import numpy as np

from fabweave.verify.drawing import Floats, ReadError, read_content

#: Corners, (N, 2); and with the bulge of the side that leaves each, (N, 3).
Polygon: TypeAlias = Floats
Ring: TypeAlias = Floats


class Strand(msgspec.Struct, frozen=True):
    """One side of a crossing."""

    thread: int
    piece: str
    station: int


class Crossing(msgspec.Struct, frozen=True):
    """Where two strands meet."""

    id: int
    edge: tuple[int, int]
    position: tuple[float, float, float]
    over: Strand
    under: Strand
    #: Whether a fastener goes through it.
    fastened: bool
    #: Whether it carries something besides the weave.
    hang: bool | None = None


class Thread(msgspec.Struct, frozen=True, dict=True):
    """A thread with its crossings and pieces in walking order."""

    id: int
    label: str
    closed: bool
    crossings: tuple[int, ...]
    over: tuple[bool, ...]
    pieces: tuple[str, ...]
    bunch: int

    @cached_property
    def places(self) -> dict[int, list[int]]:
        """Where along the thread each crossing stands."""
        places: dict[int, list[int]] = {}
        for at, crossing in enumerate(self.crossings):
            places.setdefault(crossing, []).append(at)
        return places


class Cutout(msgspec.Struct, frozen=True):
    """What is stated to be cut out of a piece at a station: a slot by its path, or a round hole."""

    station: int
    x: float = math.nan
    y: float = math.nan
    diameter_mm: float = math.nan
    path: Ring | None = None

    def __post_init__(self) -> None:
        """Require what its kind needs."""
        if self.path is not None:
            _require_shape(self.path, 3, "the path of a slot")
        elif not math.isfinite(self.x + self.y + self.diameter_mm):
            raise ValueError("a hole lacks its place or size")

    @property
    def centre(self) -> tuple[float, float]:
        """Its middle."""
        if self.path is None:
            return self.x, self.y
        x, y = ((self.path.min(axis=0) + self.path.max(axis=0)) / 2.0)[:2].tolist()
        return x, y


class Station(msgspec.Struct, frozen=True):
    """A crossing as seen from one piece."""

    crossing: int
    over: bool
    partner: str
    x: float
    y: float
    hole_mm: float | None
    joint: int | None


class Placement(msgspec.Struct, frozen=True):
    """Where a piece stands on its sheet."""

    rotation_deg: float
    x_mm: float
    y_mm: float


class Piece(msgspec.Struct, frozen=True, dict=True):
    """What is cut, in its own coordinates, and where it stands."""

    id: str
    #: Pieces of one number can be put in one another's place.
    kind: int
    thread: int
    sheet: int
    placement: Placement
    joints: tuple[int | None, int | None]
    outline: Polygon
    stations: tuple[Station, ...]
    #: What is cut; the outline is a polygon near it.
    path: Ring
    #: Everything that is cut out.
    cutouts: tuple[Cutout, ...]
    #: Width of its sheet if that is drawn mirrored, with the pieces' insides up.
    mirror_mm: float | None = None
    #: Whether it covers the first piece of its kind when it is turned end for end.
    turned: bool = False
    #: How far it is said to be from its own development, to be equal to others of its kind.
    fitted_mm: float = 0.0
    #: The stations at which ticks are engraved.
    ticks: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        """Require corners."""
        _require_shape(self.outline, 2, "the outline")
        _require_shape(self.path, 3, "the path", least=2)

    @property
    def points(self) -> Floats:
        """Where its stations are, (N, 2)."""
        return np.array([(station.x, station.y) for station in self.stations]).reshape(-1, 2)

    @cached_property
    def cut_at(self) -> dict[int, list[Cutout]]:
        """The cut-outs of each station that has any."""
        cutouts: dict[int, list[Cutout]] = {}
        for cutout in self.cutouts:
            cutouts.setdefault(cutout.station, []).append(cutout)
        return cutouts

    @property
    def slots(self) -> list[Floats]:
        """The cut-outs that are no circles."""
        return [cutout.path for cutout in self.cutouts if cutout.path is not None]

    @property
    def holes(self) -> list[Cutout]:
        """The round ones."""
        return [cutout for cutout in self.cutouts if cutout.path is None]

    def placed(self, points: Floats) -> Floats:
        """Return points of the piece where they stand on its sheet."""
        angle = math.radians(self.placement.rotation_deg)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        result = np.asarray(points) @ turn.T + [self.placement.x_mm, self.placement.y_mm]
        if self.mirror_mm is not None:
            result[..., 0] = self.mirror_mm - result[..., 0]
        return result

    def placed_ring(self, ring: Floats) -> Floats:
        """Return (N, 3) corners and bulges on its sheet; seen from the back, arcs turn round."""
        sense = 1.0 if self.mirror_mm is None else -1.0
        return np.column_stack([self.placed(ring[:, :2]), sense * ring[:, 2]])


class Spare(msgspec.Struct, frozen=True):
    """What is cut besides: a copy of a piece, with its own name and place."""

    id: str
    of: str
    sheet: int
    placement: Placement


class Joint(msgspec.Struct, frozen=True):
    """Where two pieces meet; ``holes`` is (n, 2, 2), for each hole its place in both pieces.

    A lap of no stated length is as long as its crossing panel; ``ahead_mm`` says how much of it
    lies ahead of the crossing, where that is not half.
    """

    id: int
    pieces: tuple[str, str]
    crossing: int
    holes: Floats
    kind: str
    hole_mm: float | None
    grip_mm: float | None
    lap_mm: float | None = None
    ahead_mm: float | None = None

    def __post_init__(self) -> None:
        """Require two places for each hole."""
        if self.holes.size and self.holes.shape[1:] != (2, 2):
            raise ValueError("holes are not pairs of points")
        if not self.holes.size:
            msgspec.structs.force_setattr(self, "holes", np.zeros((0, 2, 2)))


class Rest(msgspec.Struct, frozen=True):
    """What is kept of a sheet."""

    name: str
    outline: Polygon

    def __post_init__(self) -> None:
        """Require corners."""
        _require_shape(self.outline, 2, "the outline")


class Sheet(msgspec.Struct, frozen=True):
    """A sheet that is cut."""

    number: int = msgspec.field(name="sheet")
    name: str
    width_mm: float
    height_mm: float
    mirrored: bool
    #: What it is called in the stock; empty if it is of a size alone.
    stock: str
    offcut: bool
    grain_deg: float | None
    outline: Polygon
    defects: tuple[Polygon, ...]
    #: What it is of, where the map states it.
    material: str | None = None
    thickness_mm: float | None = None
    rest: Rest | None = None
    #: If it is what is used of a roll: how long the whole roll is.
    roll_mm: float | None = None

    def __post_init__(self) -> None:
        """Require corners."""
        for ring in (self.outline, *self.defects):
            _require_shape(ring, 2, "an outline or a defect")


class LayerColour(msgspec.Struct, frozen=True):
    """The colour that the map says a layer has, exactly, and as an AutoCAD index."""

    layer: str
    colour: str
    aci: int


class Cut(msgspec.Struct, frozen=True):
    """What the map says of the drawings."""

    profile: str
    preset: str
    dxf: str
    svg_units: str
    hairline_mm: float
    layers: tuple[LayerColour, ...]
    #: What was to be engraved; empty in maps that do not say.
    labels: str = ""


#: Where a clip is: the crossing, and the two pieces there that it holds together.
Clip: TypeAlias = tuple[int, str, str]


class Step(msgspec.Struct, frozen=True):
    """A step of the assembly; crossings and joints are ids."""

    step: int
    pieces: tuple[str, ...]
    crossings: tuple[int, ...]
    over: tuple[int, ...]
    under: tuple[int, ...]
    joints: tuple[int, ...]
    fasten: tuple[int, ...]
    closes: bool
    #: The pieces of the ring that is laid in it, if it lays one.
    ring: tuple[str, ...] | None = None
    #: Where clips are put on after it, and taken off.
    clips: tuple[Clip, ...] = ()
    unclips: tuple[Clip, ...] = ()
    #: Fasteners of this step that no hand reaches from the inside.
    outside: tuple[int, ...] = ()


class Weave(msgspec.Struct, frozen=True):
    """What the map claims of the weave."""

    pattern: str
    exact: bool
    broken: dict[Literal["edge", "face", "vertex"], int]
    #: Of a twill: where threads turn back at the boundary and lose their rhythm.
    broken_at_turns: int = 0
    #: Of a fabric: the threads that are its warp, and the label of each crossing.
    warp: tuple[int, ...] = ()
    labels: tuple[int, ...] = ()
    #: Of a twill in rings: the row of each crossing, modulo 4; empty if it is none.
    rows: tuple[int, ...] = ()


class Rotations(msgspec.Struct, frozen=True):
    """The angles that pieces may have: multiples of the step from the grain on; None for any."""

    step_deg: float | None
    tolerance_deg: float
    #: From where angles count: so far from the grain.
    from_grain_deg: float = 0.0


class Layout(msgspec.Struct, frozen=True):
    """How pieces may lie on sheets."""

    margin_mm: float
    gap_mm: float
    rotations: Rotations


class CrossingMap(msgspec.Struct, frozen=True, dict=True):
    """The whole plan; lists keep the file's order, and lookups find by id."""

    schema: Literal["fabweave.crossing-map/1"]
    units: Literal["mm"]
    weave: Weave
    layout: Layout
    cut: Cut
    sheets: tuple[Sheet, ...]
    threads: tuple[Thread, ...]
    crossings: tuple[Crossing, ...]
    pieces: tuple[Piece, ...]
    joints: tuple[Joint, ...]
    steps: tuple[Step, ...]
    spares: tuple[Spare, ...] = ()

    def __post_init__(self) -> None:
        """Tell the pieces of mirrored sheets that they are drawn from the other side."""
        mirrors = {sheet.number: sheet.width_mm for sheet in self.sheets if sheet.mirrored}
        pieces = tuple(
            msgspec.structs.replace(one, mirror_mm=mirrors.get(one.sheet)) for one in self.pieces
        )
        msgspec.structs.force_setattr(self, "pieces", pieces if mirrors else self.pieces)
        for spare in self.spares:
            if spare.of not in self.piece:
                raise ValueError(f"{spare.id} is a spare of {spare.of!r}, which is no piece")

    @cached_property
    def thread(self) -> dict[int, Thread]:
        """Threads by their ids."""
        return {thread.id: thread for thread in self.threads}

    @cached_property
    def crossing(self) -> dict[int, Crossing]:
        """Crossings by their ids."""
        return {crossing.id: crossing for crossing in self.crossings}

    @cached_property
    def piece(self) -> dict[str, Piece]:
        """Pieces by their ids."""
        return {piece.id: piece for piece in self.pieces}

    @cached_property
    def joint(self) -> dict[int | None, Joint]:
        """Joints by their ids."""
        return {joint.id: joint for joint in self.joints}

    @cached_property
    def sheet(self) -> dict[int, Sheet]:
        """Sheets by their numbers."""
        return {sheet.number: sheet for sheet in self.sheets}

    @cached_property
    def spare_of(self) -> dict[str, str]:
        """Of which piece each spare is a copy."""
        return {spare.id: spare.of for spare in self.spares}

    @cached_property
    def to_cut(self) -> tuple[Piece, ...]:
        """All that is cut: the pieces, then the spares."""
        mirrors = {sheet.number: sheet.width_mm for sheet in self.sheets if sheet.mirrored}
        spares = (
            msgspec.structs.replace(
                self.piece[spare.of],
                id=spare.id,
                sheet=spare.sheet,
                placement=spare.placement,
                mirror_mm=mirrors.get(spare.sheet),
                turned=False,
            )
            for spare in self.spares
        )
        return (*self.pieces, *spares)

    @cached_property
    def cut_piece(self) -> dict[str, Piece]:
        """All that is cut, by its ids."""
        return {piece.id: piece for piece in self.to_cut}

    def on_sheet(self, number: int) -> list[Piece]:
        """Return the pieces of a sheet, with the spares there."""
        return self._by_sheet.get(number, [])

    @cached_property
    def _by_sheet(self) -> dict[int, list[Piece]]:
        pieces: dict[int, list[Piece]] = {}
        for piece in self.to_cut:
            pieces.setdefault(piece.sheet, []).append(piece)
        return pieces


class RibbonReport(TypedDict):
    """What is said of the ribbons, and the rules that do not hold."""

    schema: Literal["fabweave.ribbons/1"]
    units: Literal["mm"]
    limits: NotRequired[Any]
    threads: list[dict[str, Any]]
    findings: list[dict[str, Any]]


class StateRecord(TypedDict):
    """Where an object is said to be when it was let go, or stands, or bears a load."""

    name: str
    energy_nmm: float
    residual_n: float
    bodies: list[list[float]]
    angles: list[float]
    inner: list[list[float]]
    settled: bool


class FormRecord(TypedDict):
    """What these states were found with."""

    schema: Literal["fabweave.form/1"]
    threads: list[dict[str, float]]
    pins_nmm: list[float]
    held: list[int]
    held_n_mm: float
    load_n: list[tuple[int, float]]
    strips_mm: float | None
    aim: NotRequired[list[tuple[float, float, float]]]
    states: list[StateRecord]


class RimRecord(TypedDict):
    """What is said of the rings around openings."""

    schema: Literal["fabweave.rim/2"]
    units: Literal["mm"]
    rings: list[dict[str, Any]]


class WayRecord(TypedDict):
    """How a former is said to come out; ``before`` which piece of the order, None after all."""

    at: tuple[float, float, float]
    inward: tuple[float, float, float]
    wide_mm: float
    deep_mm: float
    before: int | None


class PlateRecord(TypedDict):
    """What is said of a plate of a former: where its sheet lies in space, and what it meets."""

    id: str
    spine: bool
    sheet: str
    origin: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], tuple[float, float, float]]
    slots: list[dict[str, Any]]
    strips: list[dict[str, Any]]
    snaps: list[list[tuple[float, float]]]


class FormerRecord(TypedDict):
    """What is said of a former."""

    schema: Literal["fabweave.former/1"]
    units: Literal["mm"]
    material: str
    thickness_mm: float
    way_out: WayRecord | None
    sheets: list[dict[str, Any]]
    plates: list[PlateRecord]


_Kind = TypeVar("_Kind")


def read_json(path: Path, kind: type[_Kind]) -> _Kind:
    """Read a file of one of these kinds.

    Raises
    ------
    ReadError
        If it is not JSON or breaks the schema; the message says where.
    """
    data = read_content(path)
    try:
        return msgspec.json.decode(data, type=kind, dec_hook=_array)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise ReadError(str(error)) from error


def read_crossing_map(path: Path) -> CrossingMap:
    """Read the crossing map; errors as for `read_json`."""
    return read_json(path, CrossingMap)


def _array(_: Any, value: Any) -> Floats:
    """Return a list of points as an array of finite numbers."""
    array = np.array(value, dtype=np.float64)
    if not np.all(np.isfinite(array)):
        raise ValueError("a coordinate is not finite")
    return array


def _require_shape(points: Floats, width: int, what: str, *, least: int = 3) -> None:
    """Require a list of points of so many numbers."""
    if points.ndim != 2 or points.shape[1] != width or len(points) < least:
        raise ValueError(f"{what} is no list of {least} or more points of {width} numbers")
