"""Say how long a machine engraves, cuts and travels, on sheets that are drawn and before that."""

from collections.abc import Iterable, Sequence

import numpy as np

from fabweave.core.arc_path import stretch
from fabweave.core.arrays import FloatArray, IntArray, flags, frozen_value
from fabweave.core.records import record
from fabweave.nest.layout import Placement
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import Circle, Entity, Layer, SheetDrawing
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.sheets import draw_piece
from fabweave.stock.machine import Span
from fabweave.stock.material import Material, machine_of

#: Sides that are shorter are none, millimetres.
_NOTHING_MM = 1e-9


@frozen_value
class ToolPaths:
    """Runs of sides and arcs, one after another.

    Parameters
    ----------
    length_mm : (S,) float array
        Of each side.
    radius_mm : (S,) float array
        Of each arc; infinite for a straight side.
    corner : (S,) float array
        The cosine of half the angle by which the head turns where it comes to each side; NaN where
        a run begins. (It is s above: legs that turn by t have an angle of 180° - t between them.)
    run : (S,) int array
        Which run each side belongs to, from 0.
    count : int
        How many runs there are.
    """

    length_mm: FloatArray
    radius_mm: FloatArray
    corner: FloatArray
    run: IntArray
    count: int


def runs_of(entities: Sequence[Entity]) -> ToolPaths:
    """Return entities as runs, one each, in their order."""
    points, bulges, sizes = _sides(entities)
    # What leads from the end of a run to the start of the next is no side.
    last = flags(len(points), np.cumsum(sizes) - 1)
    chord = np.roll(points, -1, axis=0) - points
    straight = np.hypot(*chord.T)
    kept = ~last & (straight > _NOTHING_MM)
    run = np.repeat(np.arange(len(sizes)), sizes)[kept]
    chord, straight, bulges = chord[kept], straight[kept], bulges[kept]
    bent = bulges != 0.0
    safe = np.where(bent, np.abs(bulges), 1.0)
    radius = np.where(bent, straight * (1.0 + safe**2) / (4.0 * safe), np.inf)
    # An arc comes in half its sweep to one side of its chord, and leaves half to the other.
    heading, half = np.arctan2(chord[:, 1], chord[:, 0]), 2.0 * np.arctan(bulges)
    turn = (heading - half) - np.roll(heading + half, 1)
    corner = np.abs(np.cos(turn / 2.0))
    first = run != np.roll(run, 1)
    first[:1] = True
    corner[first] = np.nan
    return ToolPaths(straight * stretch(bulges), radius, corner, run, len(sizes))


def _sides(entities: Sequence[Entity]) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the points of all entities, the bulge after each, and how many points each has.

    The first point of what is closed is there again at its end; a circle is two half circles.
    """
    points, bulges = [np.zeros((0, 2))], [np.zeros(0)]
    for entity in entities:
        if isinstance(entity, Circle):
            x, y, radius = entity.x, entity.y, entity.radius
            points.append(np.array([[x + radius, y], [x - radius, y], [x + radius, y]]))
            bulges.append(np.ones(3))
            continue
        corners, bent = entity.points, entity.bends
        if entity.closed:
            corners, bent = np.concatenate((corners, corners[:1])), np.append(bent, 0.0)
        points.append(corners)
        bulges.append(bent)
    sizes = np.array([len(part) for part in points[1:]], dtype=np.int64)
    return np.concatenate(points), np.concatenate(bulges), sizes


def run_times(
    runs: ToolPaths, speed_mm_s: float, acceleration_mm_s2: float, deviation_mm: float
) -> FloatArray:
    """Return how long each run takes, (R,), seconds.

    Parameters
    ----------
    runs : ToolPaths
    speed_mm_s : float
        What is commanded; sides that are too short do not reach it.
    acceleration_mm_s2, deviation_mm : float
        Of the machine: a and δ of this module's text.

    Examples
    --------
    A stroke of 2 mm at 1000 mm/s² takes 2 √(L/a): 22 mm/s in the mean.

    >>> from fabweave.sheet.drawing import Layer, Polyline
    >>> stroke = Polyline(Layer.ENGRAVE_MARK, np.array([[0.0, 0.0], [2.0, 0.0]]))
    >>> (2.0 / run_times(runs_of([stroke]), 200.0, 1000.0, 0.01)).round(1).tolist()
    [22.4]
    """
    way, rate = runs.length_mm, acceleration_mm_s2
    top = np.minimum(speed_mm_s**2, rate * runs.radius_mm)  # squares of speeds
    sine = np.where(np.isnan(runs.corner), 0.0, runs.corner)
    # Sides that lead straight on have no corner, and may be passed at any speed.
    tight = np.divide(
        rate * deviation_mm * sine, 1.0 - sine, out=np.full(len(way), np.inf), where=sine < 1.0
    )
    enter = np.minimum(tight, np.minimum(top, np.roll(top, 1)))
    begins = np.isnan(runs.corner)
    enter[begins] = 0.0
    # Where one run ends and the next begins, both are at rest, so minima do not reach across.
    come = 2.0 * rate * (np.cumsum(way) - way)
    goes = come + 2.0 * rate * way
    enter = np.minimum.accumulate(enter - come) + come
    leave = np.where(np.roll(begins, -1), 0.0, np.roll(enter, -1))
    slowed = np.minimum.accumulate((leave + goes)[::-1])[::-1] - goes
    leave = np.clip(slowed, 0.0, None)
    enter = np.where(begins, 0.0, np.roll(leave, 1))
    peak = np.minimum(top, (enter + leave) / 2.0 + rate * way)
    fast = np.sqrt(peak)
    ramps = (2.0 * fast - np.sqrt(enter) - np.sqrt(leave)) / rate
    even = (way - (2.0 * peak - enter - leave) / (2.0 * rate)) / fast
    sums = np.bincount(runs.run, ramps + even, minlength=runs.count)
    return np.asarray(sums, dtype=np.float64)


def hop_times(length_mm: FloatArray, speed_mm_s: float, acceleration_mm_s2: float) -> FloatArray:
    """Return how long straight moves from rest to rest take, seconds.

    Examples
    --------
    Where the speed is reached it is L/v + v/a, else 2 √(L/a).

    >>> hop_times(np.array([400.0, 10.0, 0.0]), 200.0, 1000.0).tolist()
    [2.2, 0.2, 0.0]
    """
    ramp_mm = speed_mm_s**2 / acceleration_mm_s2
    far = length_mm / speed_mm_s + speed_mm_s / acceleration_mm_s2
    times: FloatArray = np.where(
        length_mm >= ramp_mm, far, 2.0 * np.sqrt(length_mm / acceleration_mm_s2)
    )
    return times


def ends_of(entities: Sequence[Entity]) -> tuple[FloatArray, FloatArray]:
    """Return where each entity begins and where it ends, both (N, 2); a circle at its right."""
    begins = np.empty((len(entities), 2))
    ends = np.empty((len(entities), 2))
    for at, entity in enumerate(entities):
        if isinstance(entity, Circle):
            begins[at] = ends[at] = entity.x + entity.radius, entity.y
        else:
            begins[at] = entity.points[0]
            ends[at] = entity.points[0 if entity.closed else -1]
    return begins, ends


#: In the order in which programs burn them, each over the whole sheet.
ENGRAVED = (Layer.ENGRAVE_LABEL, Layer.ENGRAVE_MARK)
CUT = (Layer.CUT_INNER, Layer.CUT_OUTER)
#: Before pieces lie on a sheet: the way from one to the next, as a share of a piece's length. All
#: ways together come within a twentieth of what they are in jobs of 8 to 140 pieces, nested.
_APPROACH = 0.5
#: Pieces may be asked for where they are not placed yet.
_UNPLACED = Placement(0, 0, 0.0, 0.0, 0.0)


@record
class MachineTime:
    """Seconds on the surface, through the sheet, and on the way; None where no speed is known.

    Each is a least and a greatest time: of the fastest and the slowest speeds, accelerations and
    rests of a material's machine.
    """

    engrave_s: Span
    cut_s: Span | None
    travel_s: Span

    @property
    def total_s(self) -> Span | None:
        """All of it."""
        if self.cut_s is None:
            return None
        return _sum([self.engrave_s, self.cut_s, self.travel_s])


def add_times(times: Iterable[MachineTime]) -> MachineTime:
    """Return several times as one; of none, no time at all.

    Examples
    --------
    >>> one = MachineTime(engrave_s=(1.0, 2.0), cut_s=(3.0, 4.0), travel_s=(0.0, 1.0))
    >>> add_times([one, one]).total_s
    (8.0, 14.0)
    """
    each = list(times)
    cuts = [time.cut_s for time in each if time.cut_s is not None]
    return MachineTime(
        engrave_s=_sum(time.engrave_s for time in each),
        cut_s=_sum(cuts) if len(cuts) == len(each) else None,
        travel_s=_sum(time.travel_s for time in each),
    )


def scaled_time(time: MachineTime, factor: float) -> MachineTime:
    """Return a time that takes so many times longer, rounded to milliseconds."""
    engrave, cut, travel = (
        None if span is None else (round(factor * span[0], 3), round(factor * span[1], 3))
        for span in (time.engrave_s, time.cut_s, time.travel_s)
    )
    return MachineTime(engrave_s=engrave or (0.0, 0.0), cut_s=cut, travel_s=travel or (0.0, 0.0))


def sheet_time(drawing: SheetDrawing, material: Material) -> MachineTime:
    """Return what a sheet takes, with all ways between its lines.

    Layer by layer, pieces in their order: as a program goes that burns one colour after another.
    The way begins at the origin.

    Parameters
    ----------
    drawing : SheetDrawing
    material : Material
    """
    layers = {layer: list[Entity]() for layer in (*ENGRAVED, *CUT)}
    for piece in drawing.pieces:
        for entity in piece.entities:
            layers[entity.layer].append(entity)
    engraved = [entity for layer in ENGRAVED for entity in layers[layer]]
    cut = [entity for layer in CUT for entity in layers[layer]]
    begins, ends = ends_of([*engraved, *cut])
    here = np.concatenate((np.zeros((1, 2)), ends[:-1]))[: len(begins)]
    return _time(engraved, cut, np.hypot(*(begins - here).T), material)


def piece_time(pieces: Sequence[Piece], marks: Sequence[Marks], material: Material) -> MachineTime:
    """Return what pieces take before they are nested.

    Engraving and cutting are what they are on any sheet. Ways within a piece are those of a walk
    along it; from one to the next they are estimated.

    Parameters
    ----------
    pieces : sequence of Piece
    marks : sequence of Marks
        What is engraved on each.
    material : Material
        All are of it.
    """
    engraved: list[Entity] = []
    cut: list[Entity] = []
    ways = [np.zeros(0)]
    for piece, piece_marks in zip(pieces, marks, strict=True):
        drawn = draw_piece(piece, piece_marks, _UNPLACED, None, 1.0)
        approach = _APPROACH * float(np.ptp(piece.outline[:, 0]))
        for layer in (*ENGRAVED, *CUT):
            entities = [entity for entity in drawn.entities if entity.layer is layer]
            (engraved if layer in ENGRAVED else cut).extend(entities)
            if entities:
                begins, ends = ends_of(entities)
                ways += [np.hypot(*(begins[1:] - ends[:-1]).T), np.array([approach])]
    return _time(engraved, cut, np.concatenate(ways), material)


def _time(
    engraved: Sequence[Entity], cut: Sequence[Entity], way_mm: FloatArray, material: Material
) -> MachineTime:
    """Return what lines and the ways between them take on the machine of a material."""
    machine, surface, through = machine_of(material), runs_of(engraved), runs_of(cut)
    engrave, cutting, travel = [], [], []
    # First the fastest of everything, then the slowest.
    for fast, slow in ((1, 0), (0, 1)):
        rate, corner = machine.acceleration_mm_s2[fast], machine.deviation_mm
        burn = run_times(surface, machine.engrave_mm_s[fast], rate, corner)
        engrave.append(float(burn.sum()) + len(engraved) * machine.laser_on_s[slow])
        travel.append(float(hop_times(way_mm, machine.rapid_mm_s[fast], rate).sum()))
        if material.speed_mm_s is not None:
            speed = sorted(material.speed_mm_s)[fast]
            burn = run_times(through, speed, rate, corner)
            cutting.append(float(burn.sum()) + len(cut) * machine.pierce_s[slow])
    return MachineTime(
        engrave_s=(engrave[0], engrave[1]),
        cut_s=(cutting[0], cutting[1]) if cutting else None,
        travel_s=(travel[0], travel[1]),
    )


def _sum(spans: Iterable[Span]) -> Span:
    """Return the sums of both ends."""
    low = high = 0.0
    for span in spans:
        low, high = low + span[0], high + span[1]
    return low, high
