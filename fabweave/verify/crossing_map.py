"""Hold the crossing map as plain values, found by id."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, TypeAlias

import numpy as np

from fabweave.verify.drawing import Floats

#: Corners, (N, 2).
Polygon: TypeAlias = Annotated[Floats, (2,)]


@dataclass(frozen=True, slots=True)
class Strand:
    """One side of a crossing."""

    thread: int
    piece: str
    station: int


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where two strands meet."""

    id: int
    edge: tuple[int, int]
    position: tuple[float, float, float]
    over: Strand
    under: Strand
    #: Whether a fastener goes through it; where that is not stated, one does if it has a hole.
    fastened: bool | None = None
    #: Whether it carries something besides the weave.
    hang: bool | None = None


@dataclass(frozen=True)
class Thread:
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


@dataclass(frozen=True, slots=True)
class Hole:
    """A hole of a piece; the diameter is None where no station states it."""

    x: float
    y: float
    diameter: float | None


@dataclass(frozen=True, eq=False, slots=True)
class Cutout:
    """What is stated to be cut out of a piece: a circle, or a path; and its station.

    ``ring`` is (N, 3): corners, and the bulge of the side that leaves each.
    """

    station: int
    circle: tuple[float, float, float] | None  # x, y, diameter
    ring: Floats | None

    @property
    def centre(self) -> tuple[float, float]:
        """Its middle."""
        if self.circle is not None:
            return self.circle[0], self.circle[1]
        ring = np.zeros((1, 2)) if self.ring is None else self.ring[:, :2]
        x, y = ((ring.min(axis=0) + ring.max(axis=0)) / 2.0).tolist()
        return x, y


@dataclass(frozen=True, slots=True)
class Station:
    """A crossing as seen from one piece."""

    crossing: int
    over: bool
    partner: str
    x: float
    y: float
    hole_mm: float | None
    joint: int | None


@dataclass(frozen=True, slots=True)
class Label:
    """A text engraved on a piece, and the box around (x, y) that it fills."""

    kind: str
    text: str
    station: int | None
    height_mm: float
    x: float
    y: float
    rotation_deg: float
    #: Along the text, and across it.
    box_mm: tuple[float, float]
    #: Whether strands cover it when the object is woven, where that is stated.
    hidden: bool | None = None


@dataclass(frozen=True, slots=True)
class Dropped:
    """Something that is engraved nowhere for want of room."""

    kind: str
    text: str
    station: int | None


@dataclass(frozen=True, eq=False)
class Piece:
    """What is cut, in its own coordinates, and where it stands.

    ``path`` is (N, 3): corners of what is cut, and the bulge of the side that leaves each.
    """

    id: str
    #: Pieces of one number can be put in one another's place.
    kind: int
    thread: int
    sheet: int
    rotation_deg: float
    shift: Floats
    joints: tuple[int | None, int | None]
    outline: Polygon
    path: Floats
    stations: tuple[Station, ...]
    labels: tuple[Label, ...]
    dropped: tuple[Dropped, ...]
    #: Everything that is cut out; None where the map leaves it to stations and joints.
    cutouts: tuple[Cutout, ...] | None = None
    #: Width of its sheet if that is drawn mirrored, with the pieces' insides up.
    mirror_mm: float | None = None
    #: Whether it covers the first piece of its kind when it is turned end for end.
    turned: bool = False
    #: How far it is said to be from its own development, to be equal to others of its kind.
    fitted_mm: float = 0.0

    @property
    def points(self) -> Floats:
        """Where its stations are, (N, 2)."""
        return np.array([(station.x, station.y) for station in self.stations]).reshape(-1, 2)

    @property
    def slots(self) -> list[Floats]:
        """The cut-outs that are no circles."""
        return [cutout.ring for cutout in self.cutouts or () if cutout.ring is not None]

    def placed(self, points: Floats) -> Floats:
        """Return points of the piece where they stand on its sheet."""
        angle = math.radians(self.rotation_deg)
        turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        result = np.asarray(points) @ turn.T + self.shift
        if self.mirror_mm is not None:
            result[..., 0] = self.mirror_mm - result[..., 0]
        return result

    def placed_ring(self, ring: Floats) -> Floats:
        """Return (N, 3) corners and bulges on its sheet; seen from the back, arcs turn round."""
        sense = 1.0 if self.mirror_mm is None else -1.0
        return np.column_stack([self.placed(ring[:, :2]), sense * ring[:, 2]])


@dataclass(frozen=True, eq=False, slots=True)
class Joint:
    """Where two pieces meet; ``holes`` is (n, 2, 2), for each hole its place in both pieces.

    What the map does not state is None; a lap is then as long as its crossing panel.
    """

    id: int
    pieces: tuple[str, str]
    crossing: int
    holes: Annotated[Floats, (2, 2)]
    kind: str = "rivet"
    hole_mm: float | None = None
    lap_mm: float | None = None
    grip_mm: float | None = None


@dataclass(frozen=True)
class Code:
    """Where a sheet has its QR code: the lower left corner, and the size of a dot."""

    x_mm: float
    y_mm: float
    dot_mm: float


@dataclass(frozen=True, eq=False)
class Rest:
    """What is kept of a sheet."""

    name: str
    outline: Polygon


@dataclass(frozen=True, eq=False)
class Sheet:
    """A sheet that is cut."""

    number: int
    name: str
    width_mm: float
    height_mm: float
    mirrored: bool
    #: What it is called in the stock; empty if it is of a size alone.
    stock: str
    offcut: bool
    price: float | None
    grain_deg: float | None
    outline: Polygon
    defects: tuple[Polygon, ...]
    code: Code | None = None
    #: What it is of, where the map states it.
    material: str | None = None
    thickness_mm: float | None = None
    rest: Rest | None = None


@dataclass(frozen=True, slots=True)
class Cut:
    """What the map says of the drawings; ``colours`` are exact, with the AutoCAD index."""

    profile: str
    preset: str
    dxf: str
    svg_units: str
    hairline_mm: float
    colours: dict[str, tuple[str, int]]
    code: str | None = None
    #: What was to be engraved; empty in maps that do not say.
    labels: str = ""


@dataclass(frozen=True, slots=True)
class Step:
    """A step of the assembly; crossings and joints are ids."""

    step: int
    pieces: tuple[str, ...]
    crossings: tuple[int, ...]
    over: tuple[int, ...]
    under: tuple[int, ...]
    joints: tuple[int, ...]
    fasten: tuple[int, ...]
    closes: bool
    effort: float
    text: str
    #: The pieces of the ring that is laid in it, if it lays one.
    ring: tuple[str, ...] | None = None


@dataclass(frozen=True)
class CrossingMap:
    """The whole plan; lists keep the file's order, and lookups find by id."""

    pattern: str
    exact: bool
    broken: tuple[int, int, int]
    margin_mm: float
    gap_mm: float
    #: The angles that pieces may have: multiples of the step from the grain on; None for any.
    step_deg: float | None
    tolerance_deg: float
    #: From where angles count: so far from the grain.
    from_grain_deg: float
    cut: Cut
    sheets: tuple[Sheet, ...]
    threads: tuple[Thread, ...]
    crossings: tuple[Crossing, ...]
    pieces: tuple[Piece, ...]
    joints: tuple[Joint, ...]
    steps: tuple[Step, ...]
    #: Effort of this order, thread by thread, and by piece number.
    efforts: tuple[float, float, float]
    #: Mean effort of the last tenth of the pieces, as a multiple of that of all.
    last_tenth: float
    #: Whether the layout is to be taken from here to make the job again, where that is stated.
    recorded: bool | None = None
    #: Of a fabric: the threads that are its warp, and the label of each crossing.
    warp: tuple[int, ...] = ()
    labels: tuple[int, ...] = ()
    #: How many rotations carry the weave onto itself, where some were asked for.
    rotations: int | None = None
    thread: dict[int, Thread] = field(default_factory=dict)
    crossing: dict[int, Crossing] = field(default_factory=dict)
    piece: dict[str, Piece] = field(default_factory=dict)
    #: What is cut besides, and of which piece each of them is a copy.
    spares: tuple[Piece, ...] = ()
    spare_of: dict[str, str] = field(default_factory=dict)
    joint: dict[int, Joint] = field(default_factory=dict)
    sheet: dict[int, Sheet] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Fill the lookups."""
        self.thread.update((thread.id, thread) for thread in self.threads)
        self.crossing.update((crossing.id, crossing) for crossing in self.crossings)
        self.piece.update((piece.id, piece) for piece in self.pieces)
        self.joint.update((joint.id, joint) for joint in self.joints)
        self.sheet.update((sheet.number, sheet) for sheet in self.sheets)

    @property
    def to_cut(self) -> tuple[Piece, ...]:
        """All that is cut: the pieces, then the spares."""
        return (*self.pieces, *self.spares)

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

    @cached_property
    def holes(self) -> dict[str, list[Hole]]:
        """The round holes of each piece and spare.

        Where a piece does not list its cut-outs: one at each station that states a diameter, and
        its joints'. A joint's hole on a station's own is the same hole; others have that
        station's diameter.
        """
        return {piece.id: self._holes(piece) for piece in self.to_cut}

    def _holes(self, piece: Piece) -> list[Hole]:
        """Return the holes of one piece."""
        if piece.cutouts is not None:
            return [Hole(*cutout.circle) for cutout in piece.cutouts if cutout.circle is not None]
        holes = [Hole(s.x, s.y, s.hole_mm) for s in piece.stations if s.hole_mm is not None]
        for joint_id, side, at in ((piece.joints[0], 1, 0), (piece.joints[1], 0, -1)):
            joint = self.joint.get(joint_id) if joint_id is not None else None
            if joint is None or not piece.stations:
                continue
            diameter = piece.stations[at].hole_mm
            for x, y in joint.holes[:, side].tolist():
                near = 0.25 * (diameter or 1.0)
                if all(math.hypot(hole.x - x, hole.y - y) > near for hole in holes):
                    holes.append(Hole(x, y, diameter))
        return holes
