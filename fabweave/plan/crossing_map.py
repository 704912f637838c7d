"""Hold the crossing map: what crosses what, and where everything is; ``crossing_map.json``.

The map is built by ``fabweave.job.map_builder`` when a job is complete, and read again when a
finished job is nested anew, checked before cutting, or tested with a coupon. So its values stand
above all these rooms, and know nothing of them. Lengths are in millimetres, rounded to a millionth,
and angles in degrees.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.core.records import from_json, optional, read_json, record, to_json
from fabweave.weave.twill.conditions import Broken
from fabweave.weave.weave_pattern import WeaveResult


@record
class WeaveRecord:
    """The weave: its pattern, whether it is exact, and how many conditions of a twill it breaks.

    ``voted`` is what the paper's vote breaks, and ``at_least_broken`` what every weave breaks,
    where this is known. ``broken_at_turns`` counts where threads of a twill turn back at a rim and
    lose their rhythm, if they do: such places are no conditions. Of a fabric, ``warp`` lists the
    warp threads and ``labels`` the label of each crossing; of a twill in rings, ``rows`` lists the
    row of each crossing modulo 4.
    """

    pattern: str
    exact: bool
    broken: Broken
    broken_at_turns: int | None = optional(default=None)
    voted: Broken | None = optional(default=None)
    at_least_broken: int | None = optional(default=None)
    warp: tuple[int, ...] | None = optional(default=None)
    labels: tuple[int, ...] | None = optional(default=None)
    rows: tuple[int, ...] | None = optional(default=None)


def weave_record(result: WeaveResult) -> WeaveRecord:
    """Return what the map says about the weave."""
    weave, twill = result.weave, result.twill
    return WeaveRecord(
        pattern=weave.pattern,
        exact=weave.exact,
        broken=weave.broken,
        broken_at_turns=weave.broken_at_turns or None,
        voted=None if twill is None else twill.voted,
        at_least_broken=None if twill is None or twill.bound is None else twill.bound.least,
        warp=None if result.warp is None else tuple(np.flatnonzero(result.warp).tolist()),
        labels=None if result.label is None else tuple(result.label.tolist()),
        rows=None if twill is None or twill.rows is None else tuple(twill.rows.tolist()),
    )


@record
class RotationRecord:
    """The angles at which pieces may lie: multiples of a step, None for any, give or take.

    They count from the grain, or from so many degrees off it.
    """

    step_deg: float | None
    tolerance_deg: float
    from_grain_deg: float | None = optional()


@record
class LayoutRecord:
    """What the layout keeps: margin of sheets, gap between pieces, angles; and notes about it.

    ``recorded`` says that another run may not find it again, so that it is to be taken from here.
    """

    margin_mm: float
    gap_mm: float
    rotations: RotationRecord
    notes: tuple[str, ...]
    recorded: bool | None = optional()


@record
class LayerRecord:
    """The colour of a layer, ``#RRGGBB``, and as an AutoCAD colour index."""

    layer: str
    colour: str
    aci: int


@record
class CutRecord:
    """What the files for the cutter are like."""

    profile: str
    preset: str
    dxf: str
    svg_units: str
    hairline_mm: float
    labels: str | None = optional()
    layers: tuple[LayerRecord, ...]


#: x and y, or x, y and the bulge of the side that leaves the corner.
Point: TypeAlias = tuple[float, float]
Corner: TypeAlias = tuple[float, float, float]


@record
class RestRecord:
    """What is kept of a sheet: the name of the offcut, and its outline as it is drawn."""

    name: str
    outline: tuple[Point, ...]


@record
class SheetRecord:
    """A sheet as it lies on the bed.

    ``sheet`` counts from 1; ``mirrored`` says that the sheet is drawn from its back. ``stock`` is
    its name in the list of stock, empty if it is in none; ``grain_deg`` the direction of its grain.
    Of a roll it is what is used, and ``roll_mm`` is how long all of the roll is.
    """

    sheet: int
    name: str
    width_mm: float
    height_mm: float
    mirrored: bool
    stock: str
    offcut: bool
    price: float | None
    grain_deg: float | None
    outline: tuple[Point, ...]
    defects: tuple[tuple[Point, ...], ...]
    rest: RestRecord | None = None
    roll_mm: float | None = optional()
    material: str
    thickness_mm: float


@record
class ThreadRecord:
    """A thread: its crossings in walking order, whether it is over at each, and its pieces."""

    id: int
    label: str
    closed: bool
    bunch: int
    crossings: tuple[int, ...]
    over: tuple[bool, ...]
    pieces: tuple[str, ...]


@record
class StrandRecord:
    """One strand of a crossing: its thread, piece and station; at a joint, the piece that ends."""

    thread: int
    piece: str
    station: int


@record
class CrossingRecord:
    """A crossing: the ends of its edge in the woven mesh, its place in space, and both strands.

    ``fastened`` says whether a fastener goes through it, ``hang`` whether it carries something
    besides the weave.
    """

    id: int
    edge: tuple[int, int]
    position: tuple[float, float, float]
    over: StrandRecord
    under: StrandRecord
    fastened: bool
    hang: bool | None = optional()


@record
class PlacementRecord:
    """The motion of a piece onto its sheet: a point p stands at R(rotation) p + (x, y)."""

    rotation_deg: float
    x_mm: float
    y_mm: float


@record
class StationRecord:
    """A crossing as seen from a piece: the piece it meets there, the hole and the joint, if any."""

    crossing: int
    over: bool
    partner: str
    x: float
    y: float
    hole_mm: float | None
    joint: int | None


@record
class CutoutRecord:
    """What is cut out of a piece: a round hole at a place, or a slot with its path."""

    station: int
    kind: Literal["hole", "slot"]
    x: float | None = optional(default=None)
    y: float | None = optional(default=None)
    diameter_mm: float | None = optional(default=None)
    path: tuple[Corner, ...] | None = optional(default=None)

    def __post_init__(self) -> None:
        """Require what its kind needs."""
        needs = {"hole": (self.x, self.y, self.diameter_mm), "slot": (self.path,)}[self.kind]
        if None in needs:
            raise ValueError("a hole needs x, y and diameter_mm, and a slot needs path")

    @property
    def hole(self) -> tuple[float, float, float] | None:
        """The centre of a round hole and its diameter."""
        if self.x is None or self.y is None or self.diameter_mm is None:
            return None
        return self.x, self.y, self.diameter_mm


@record
class LabelRecord:
    """A lettered text: the height of a capital, the middle of its box, and its reading direction.

    ``box_mm`` is its length along that direction and its height; ``station`` is None for what is
    said of the whole piece. What is ``hidden`` is covered by strands in the woven object.
    """

    kind: str
    text: str
    station: int | None
    height_mm: float
    x: float
    y: float
    rotation_deg: float
    box_mm: tuple[float, float]
    hidden: bool | None = optional()


@record
class DroppedRecord:
    """A label that found no room."""

    kind: str
    text: str
    station: int | None


@record
class PieceRecord:
    """A piece in its own coordinates, with its place on a sheet.

    Pieces of one ``kind`` are congruent; one that is ``turned`` covers the first of its kind when
    it is turned end for end, and one that is ``fitted_mm`` was moved so far to be equal to it.
    ``joints`` are those at its first and its last station; ``path`` is what is cut, ``outline`` a
    polygon near it. At the stations in ``ticks``, where it passes under without a hole, lines are
    engraved inside its edges, abreast of the crossing.
    """

    id: str
    kind: int
    turned: bool | None = optional()
    fitted_mm: float | None = optional()
    thread: int
    sheet: int
    placement: PlacementRecord
    joints: tuple[int | None, int | None]
    path: tuple[Corner, ...]
    outline: tuple[Point, ...]
    stations: tuple[StationRecord, ...]
    cutouts: tuple[CutoutRecord, ...]
    ticks: tuple[int, ...] | None = optional()
    labels: tuple[LabelRecord, ...]
    dropped: tuple[DroppedRecord, ...]


@record
class SpareRecord:
    """A piece that is cut once more: ``of`` which piece it is a copy, and its own place."""

    id: str
    of: str
    sheet: int
    placement: PlacementRecord
    labels: tuple[LabelRecord, ...]
    dropped: tuple[DroppedRecord, ...]


@record
class JointRecord:
    """A joint: the piece that ends there, the one that begins there, and what holds them.

    ``holes`` are its fasteners: for each the point on the first and on the second piece.
    ``hole_mm`` is their diameter and ``grip_mm`` the thickness of all layers, None without any.
    ``ahead_mm`` says how much of a lap lies ahead of the crossing, where that is not half.
    """

    id: int
    pieces: tuple[str, str]
    crossing: int
    kind: str
    holes: tuple[tuple[Point, Point], ...]
    hole_mm: float | None
    lap_mm: float
    ahead_mm: float | None = optional()
    grip_mm: float | None

    def mate(self, piece: str) -> str:
        """Return the piece that is joined to a piece here; a piece may be joined to itself."""
        first, second = self.pieces
        return second if first == piece else first


@record
class AssemblyRecord:
    """What the assembly costs, where 1 is laying a strand over another.

    ``by_thread`` and ``by_number`` are what two naive orders cost; ``last_tenth`` is the mean
    effort of the last tenth of the pieces, as a multiple of that of all.
    """

    effort: float
    by_thread: float
    by_number: float
    last_tenth: float


#: Where a clip is: the crossing, and the two pieces there that it holds together.
ClipPlace: TypeAlias = tuple[int, str, str]


@record
class StepRecord:
    """A step of the assembly, its pieces in the order in which they are placed.

    ``crossings`` are made in it, both strands being there for the first time; at ``over`` and
    ``under`` a new piece lies over, or slides below, what is in place. ``joints`` are made, and at
    ``fasten`` the last layer comes. ``closes`` says that a piece is joined at both ends. The last
    steps lay each a ``ring``: it has these pieces of its own, and ``fasten`` are those that it
    holds, which wait for it. After it, ``clips`` are put on and ``unclips`` taken off; ``outside``
    are those of ``fasten`` that no hand reaches from the inside.
    """

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
    ring: tuple[str, ...] | None = optional(default=None)
    clips: tuple[ClipPlace, ...] | None = optional(default=None)
    unclips: tuple[ClipPlace, ...] | None = optional(default=None)
    outside: tuple[int, ...] | None = optional(default=None)

    @property
    def handled(self) -> int:
        """How many pieces are taken in hand, those of a ring, too."""
        return len(self.pieces) + len(self.ring or ())


@record
class CrossingMap:
    """A whole job: its threads, crossings, pieces, joints, sheets and steps.

    Threads and crossings stand at the place of their number, sheets at that of their number less
    one, steps in their order.
    """

    schema: Literal["fabweave.crossing-map/1"]
    units: Literal["mm"]
    weave: WeaveRecord
    layout: LayoutRecord
    cut: CutRecord
    sheets: tuple[SheetRecord, ...]
    threads: tuple[ThreadRecord, ...]
    crossings: tuple[CrossingRecord, ...]
    pieces: tuple[PieceRecord, ...]
    spares: tuple[SpareRecord, ...] | None = optional()
    joints: tuple[JointRecord, ...]
    assembly: AssemblyRecord
    steps: tuple[StepRecord, ...]

    @property
    def to_cut(self) -> tuple[PieceRecord, ...]:
        """All that is cut: the pieces, then the spares, as if they were pieces."""
        pieces = {piece.id: piece for piece in self.pieces}
        spares = (
            replace(
                pieces[spare.of],
                id=spare.id,
                turned=None,
                sheet=spare.sheet,
                placement=spare.placement,
                labels=spare.labels,
                dropped=spare.dropped,
            )
            for spare in self.spares or ()
        )
        return (*self.pieces, *spares)

    def to_json(self) -> dict[str, Any]:
        """Return what ``crossing_map.json`` holds."""
        return to_json(self)

    @classmethod
    def from_json(cls, text: str | bytes) -> "CrossingMap":
        """Read a map from what ``crossing_map.json`` holds.

        Raises
        ------
        InputError
            If something is missing or of the wrong type, or a reference leads nowhere; the message
            says what and where.
        """
        crossing_map = from_json(cls, text)
        _check_references(crossing_map)
        return crossing_map

    def on_sheet(self, piece: PieceRecord, points: FloatArray) -> FloatArray:
        """Return points of a piece, (N, 2), where they are drawn on its sheet."""
        sheet, placement = self.sheets[piece.sheet - 1], piece.placement
        angle = np.deg2rad(placement.rotation_deg)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        placed = np.asarray(points @ turn.T + [placement.x_mm, placement.y_mm])
        if sheet.mirrored:
            placed[:, 0] = sheet.width_mm - placed[:, 0]
        return placed


def read_crossing_map(path: Path) -> CrossingMap:
    """Read the ``crossing_map.json`` of a finished job.

    Raises
    ------
    InputError
        If the file cannot be read, or is not a crossing map; the message says why.
    """
    return read_json(path, CrossingMap.from_json, "crossing map", "crossing_map.json")


def _check_references(crossing_map: CrossingMap) -> None:
    """Raise InputError if a piece or spare has no sheet, or a spare no piece.

    A map may come from anywhere as a layout. That all else it names is there, verify proves.
    """
    numbers = [sheet.sheet for sheet in crossing_map.sheets]
    if numbers != list(range(1, len(numbers) + 1)):
        raise InputError(f"its sheets are numbered {few_of(numbers)}, not from 1 upwards in order")
    pieces, spares = crossing_map.pieces, crossing_map.spares or ()
    origins = {spare.of for spare in spares} - {piece.id for piece in pieces}
    sheets = {piece.sheet for piece in pieces} | {spare.sheet for spare in spares}
    for what, unknown in (("piece", sorted(origins)), ("sheet", sorted(sheets - set(numbers)))):
        if unknown:
            raise InputError(f"it names {what} {few_of(unknown)}, which it does not list")
