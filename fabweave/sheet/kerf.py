"""Move outlines outward and holes inward by half the kerf, exactly, arcs as arcs.

A beam that follows a line burns half the kerf on either side of it. To leave a piece as large as
it is drawn, the beam has to follow the curve at half the kerf from the outline, outside it, and
from a hole, inside it. Of a path of sides and arcs that is again such a path: straight sides move
along their normals, arcs keep their centres, and corners go where the moved sides meet. What strips
side by side share is cut once: one line for two edges.

Micro-joints are small bridges that are left in outlines, so that pieces stay in the sheet until
they are broken out.
"""

import re
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from fabweave.core.arc_path import Path, points_on_sides, stretch
from fabweave.core.arrays import BoolArray, FloatArray, frozen_value
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.core.units import parse_length
from fabweave.sheet.drawing import (
    MIN_SEGMENT_MM,
    Circle,
    Entity,
    Layer,
    PieceDrawing,
    Polyline,
    SheetDrawing,
    on_grid,
)

#: Edges lie on one line to this.
_SAME_MM = 1e-3


def with_common_cuts(drawing: SheetDrawing) -> SheetDrawing:
    """Return a sheet on which no line is cut twice: each piece leaves out what is cut before it.

    Parameters
    ----------
    drawing : SheetDrawing
        Drawn for the middle of the beam. Sides along x and y share edges at will; others are cut
        as they are.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
    >>> pieces = [PieceDrawing(name, (Polyline(Layer.CUT_OUTER, square + (0.0, y), True),))
    ...     for name, y in (("A", 0.0), ("B", 9.0))]
    >>> _, b = with_common_cuts(SheetDrawing("sheet 1", 20.0, 20.0, tuple(pieces), ())).pieces
    >>> [run.points.tolist() for run in b.entities]
    [[[9.0, 9.0], [9.0, 18.0], [0.0, 18.0], [0.0, 9.0]]]
    """
    done: dict[tuple[int, int], list[tuple[float, float]]] = defaultdict(list)
    pieces = []
    for piece in drawing.pieces:
        entities: list[Entity] = []
        for entity in piece.entities:
            if entity.layer is Layer.CUT_OUTER and isinstance(entity, Polyline):
                entities += (
                    Polyline(Layer.CUT_OUTER, run) for run in _runs(_left(entity.points, done))
                )
            else:
                entities.append(entity)
        pieces.append(PieceDrawing(piece.piece_id, tuple(entities), piece.name))
    return replace(drawing, pieces=tuple(pieces), open_outlines=True)


def _left(
    points: FloatArray, done: dict[tuple[int, int], list[tuple[float, float]]]
) -> Iterator[FloatArray]:
    """Yield what no line covers of the sides of a closed run, and cover it."""
    points = on_grid(points)
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        axis = int(np.argmax(np.abs(end - start)))
        if abs(end - start)[1 - axis] > _SAME_MM:
            yield np.stack([start, end])
            continue
        line = round(float(start[1 - axis]) / _SAME_MM)
        # What is off by a rounding may be on the next line.
        near = [part for at in (line - 1, line, line + 1) for part in done[axis, at]]
        low, high = sorted((float(start[axis]), float(end[axis])))
        open_ = [(low, high)]
        for begin, stop in near:
            open_ = [
                part
                for first, last in open_
                for part in ((first, min(last, begin)), (max(first, stop), last))
                if part[1] - part[0] >= MIN_SEGMENT_MM
            ]
        done[axis, line] += open_
        for part in open_ if end[axis] > start[axis] else [one[::-1] for one in open_[::-1]]:
            run = np.stack([start, end])
            run[:, axis] = part
            yield run


def _runs(sides: Iterator[FloatArray]) -> list[FloatArray]:
    """Return sides as runs: what begins where another ended goes on from there."""
    runs: list[FloatArray] = []
    for side in sides:
        if runs and np.abs(runs[-1][-1] - side[0]).max() <= _SAME_MM:
            runs[-1] = np.concatenate([runs[-1], side[1:]])
        else:
            runs.append(side)
    if len(runs) > 1 and np.abs(runs[-1][-1] - runs[0][0]).max() <= _SAME_MM:
        first = runs.pop(0)
        runs[-1] = np.concatenate([runs[-1], first[1:]])
    return runs


#: How far a moved outline may be from where it should be, millimetres: leaving out a side of a
#: tenth of a millimetre in a hollow costs as much.
TOLERANCE_MM = 0.03
#: A corner that would go farther than so many times half the kerf, as one sharper than 29° would,
#: is cut off square instead, if that leaves a side that is long enough.
_MITRE = 4.0
#: A corner never goes farther than so many times half the kerf.
_MOST_MITRE = 12.0
#: How often the meeting points of moved sides are improved; each time some digits are won.
_STEPS = 12
#: Keeps two sides that meet at almost no angle from sending their meeting point far away.
_DAMPING = 1e-4


def compensated(drawing: SheetDrawing, kerf_mm: float) -> SheetDrawing:
    """Return a sheet drawn for the middle of a beam that burns a line of some width.

    Outlines grow and cut-outs shrink by half the kerf; what is engraved, and the notes, stay.

    Parameters
    ----------
    drawing : SheetDrawing
        Nominal.
    kerf_mm : float
        Width of the burnt line; 0 returns the drawing as it is.

    Raises
    ------
    InputError
        If the kerf is negative or no number.
    CannotMakeError
        Where a piece has a notch, or a hole, that is narrower than the kerf.

    Examples
    --------
    >>> from fabweave.sheet.drawing import Polyline
    >>> square = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]]), True)
    >>> hole = Circle(Layer.CUT_INNER, 4.5, 4.5, 1.0)
    >>> sheet = SheetDrawing("sheet 1", 20.0, 10.0, (PieceDrawing("A1", (hole, square)),), ())
    >>> inner, outer = compensated(sheet, 0.2).pieces[0].entities
    >>> inner.radius, outer.points.round(6).tolist()
    (0.9, [[-0.1, -0.1], [9.1, -0.1], [9.1, 9.1], [-0.1, 9.1]])
    """
    if not (np.isfinite(kerf_mm) and kerf_mm >= 0.0):
        raise InputError(f"the kerf is {kerf_mm} mm; it must be a length, such as 0.15mm")
    if kerf_mm == 0.0:
        return drawing
    tight: list[str] = []
    pieces = []
    for piece in drawing.pieces:
        moved = [_moved_entity(entity, kerf_mm / 2.0) for entity in piece.entities]
        if any(entity is None for entity in moved):
            tight.append(piece.piece_id)
        pieces.append(
            PieceDrawing(piece.piece_id, tuple(entity for entity in moved if entity is not None))
        )
    if tight:
        raise CannotMakeError(
            f"a kerf of {kerf_mm:g} mm is too wide for {len(tight)} piece(s) of {drawing.name}: "
            f"{few_of(tight)}; they have holes, notches or points that are narrower; measure the "
            "kerf with fabweave coupon, or leave --kerf out"
        )
    return replace(drawing, pieces=tuple(pieces))


def _moved_entity(entity: Entity, half_mm: float) -> Entity | None:
    """Return what is cut, moved; what is engraved as it is; None for what cannot be moved."""
    if entity.layer not in (Layer.CUT_INNER, Layer.CUT_OUTER):
        return entity
    outward = half_mm if entity.layer is Layer.CUT_OUTER else -half_mm
    if isinstance(entity, Circle):
        radius = entity.radius + outward
        return replace(entity, radius=radius) if radius >= MIN_SEGMENT_MM else None
    path = offset_path(Path(entity.points, entity.bends), outward)
    return None if path is None else replace(entity, points=path.points, bulges=path.bulges)


def offset_path(path: Path, outward_mm: float) -> Path | None:
    """Return the path at a distance from a closed path, in the same sense of turning.

    Parameters
    ----------
    path : Path
        Simple; no side shorter than ``MIN_SEGMENT_MM``.
    outward_mm : float
        How far outside it, or inside where negative; small against its sides and radii.

    Returns
    -------
    Path or None
        Corners are mitred, or cut off square where they are sharp; sides that vanish in a notch,
        or become shorter than ``MIN_SEGMENT_MM``, are left out. None if no such path is within
        ``TOLERANCE_MM`` of the true offset, because a notch is too narrow or a point too sharp.

    Examples
    --------
    An arc keeps its centre:

    >>> disc = Path(np.array([[-1.0, 0], [0, -1], [1, 0], [0, 1]]), np.full(4, np.tan(np.pi / 8)))
    >>> wide = offset_path(disc, 0.5)
    >>> wide.points.round(6).tolist(), round(wide.area / np.pi, 6)
    ([[-1.5, 0.0], [0.0, -1.5], [1.5, 0.0], [0.0, 1.5]], 2.25)
    """
    # Outside is to the right of a path that runs counter-clockwise.
    sense = np.sign(path.area)
    sides, corners = _blunted(_sides_of(path), path.points, sense * np.sign(outward_mm))
    sides = sides.moved(sense * outward_mm)
    while True:
        corners = _meeting(sides, corners)
        chords = np.roll(corners, -1, axis=0) - corners
        length = np.hypot(*chords.T)
        backward = np.sum(chords * sides.chord, axis=1) <= 0.0
        size = np.where(backward, -length, length)
        worst = int(np.argmin(size))
        if size[worst] >= MIN_SEGMENT_MM:
            break
        if len(sides.chord) <= 3:
            return None
        # Its two corners become one, near the middle, where its neighbours meet.
        corners[(worst + 1) % len(corners)] = corners[worst] + chords[worst] / 2.0
        corners = np.delete(corners, worst, axis=0)
        sides = sides.without(worst)
    result = Path(corners, sides.bulges(length))
    return result if _is_offset(path, result, outward_mm) else None


@frozen_value
class _Sides:
    """Sides as whole lines and circles, which can be moved and met.

    Of each: a point on it, the unit vector to its right there, its curvature (positive to the
    left, 0 if straight), and the chord from its start to its end.
    """

    point: FloatArray
    right: FloatArray
    curvature: FloatArray
    chord: FloatArray

    @property
    def columns(self) -> tuple[FloatArray, ...]:
        """The four columns."""
        return self.point, self.right, self.curvature, self.chord

    def rolled(self) -> "_Sides":
        """Return of each side the one before it."""
        return _Sides(*(np.roll(value, 1, axis=0) for value in self.columns))

    def moved(self, by_mm: float) -> "_Sides":
        """Return the sides moved to their right."""
        return replace(
            self,
            point=self.point + by_mm * self.right,
            curvature=self.curvature / (1.0 + by_mm * self.curvature),
        )

    def without(self, at: int) -> "_Sides":
        """Return all sides but one."""
        return _Sides(*(np.delete(value, at, axis=0) for value in self.columns))

    def distance(self, where: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far right of each side a point is, and the direction in which that grows."""
        off = where - self.point
        across = np.sum(off * self.right, axis=1)
        # From the middle of its circle; for a straight side the middle is infinitely far.
        spoke = self.right + self.curvature[:, None] * off
        size = np.hypot(*spoke.T)
        # (|spoke| - 1) / curvature, without dividing by a curvature that may be 0.
        distance = (2.0 * across + self.curvature * np.sum(off**2, axis=1)) / (size + 1.0)
        return distance, spoke / size[:, None]

    def bulges(self, length: FloatArray) -> FloatArray:
        """Return the bulges that sides with chords of some lengths have."""
        bent = np.clip(length / 2.0 * np.abs(self.curvature), 0.0, 1.0)
        return np.sign(self.curvature) * bent / (1.0 + np.sqrt(1.0 - bent**2))


def _sides_of(path: Path) -> _Sides:
    """Return the sides of a path, each with the point in its middle."""
    start, chord = path.points, np.roll(path.points, -1, axis=0) - path.points
    length = np.hypot(*chord.T)
    right = np.stack((chord[:, 1], -chord[:, 0]), axis=1) / length[:, None]
    # An arc to the left stands off its chord to the right, by half the chord times the bulge.
    middle = start + chord / 2.0 + (path.bulges * length / 2.0)[:, None] * right
    curvature = 4.0 * path.bulges / (length * (1.0 + path.bulges**2))
    return _Sides(middle, right, curvature, chord)


def _blunted(sides: _Sides, corners: FloatArray, right: float) -> tuple[_Sides, FloatArray]:
    """Return sides and corners with a side of no length at each sharp corner, square to it.

    ``right`` is 1 if sides are moved to their right, -1 if to their left.
    """
    _, after = sides.distance(corners)
    _, before = sides.rolled().distance(corners)
    out = right * (after + before) / 2.0
    size = np.hypot(*out.T)
    x, y = before.T
    turn = right * (x * after[:, 1] - y * after[:, 0])
    # Halves of unit vectors at an angle: the mitre's length is one over the length of their sum.
    at = np.flatnonzero((size * _MITRE < 1.0) & (turn > 0.0) & (size > 0.0))
    square = right * out[at] / size[at, None]
    blunt = _Sides(
        corners[at], square, np.zeros(len(at)), np.stack((-square[:, 1], square[:, 0]), 1)
    )
    both = [
        np.insert(value, at, more, axis=0)
        for value, more in zip(sides.columns, blunt.columns, strict=True)
    ]
    return _Sides(*both), np.insert(corners, at, corners[at], axis=0)


def _meeting(sides: _Sides, near: FloatArray) -> FloatArray:
    """Return where each side meets the one before it, near some points (Newton's method)."""
    before, at = sides.rolled(), near.copy()
    for _ in range(_STEPS):
        (f, u), (g, v) = before.distance(at), sides.distance(at)
        # The least step to both, damped: sides that run on into each other leave it open how far.
        cosine, damped = np.sum(u * v, axis=1), 1.0 + _DAMPING
        determinant = damped**2 - cosine**2
        at -= ((damped * f - cosine * g) / determinant)[:, None] * u
        at -= ((damped * g - cosine * f) / determinant)[:, None] * v
    return at


def _is_offset(path: Path, moved: Path, outward_mm: float) -> bool:
    """Return whether a path is where it should be, judged by another way to offset."""
    nominal, drawn = (
        shapely.Polygon(curve.flattened(TOLERANCE_MM / 10.0)) for curve in (path, moved)
    )
    if not (drawn.is_valid and drawn.area > 0.0):
        return False
    # The beam keeps its distance everywhere, and goes no farther than corners need.
    near, far = outward_mm - TOLERANCE_MM, outward_mm + TOLERANCE_MM
    if outward_mm < 0.0:
        less, more = nominal.buffer(near, join_style="mitre"), nominal.buffer(far)
    else:
        less = nominal.buffer(near)
        more = nominal.buffer(far, join_style="mitre", mitre_limit=_MOST_MITRE)
    return bool(drawn.covers(less) and more.covers(drawn))


#: How wide a micro-joint is unless said otherwise, millimetres.
BRIDGE_MM = 0.25
#: Narrower ones break in the machine, wider ones do not break by hand, millimetres.
_WIDTHS_MM = (0.1, 5.0)
#: Nobody wants more of them in one outline.
_MOST = 50
#: An outline has a micro-joint for each such length at most, millimetres.
_APART_MM = 15.0
#: So much of a side is left on either side of a micro-joint, millimetres.
_REST_MM = 0.2
#: An arc that bulges by more than this over a micro-joint is no place for one, millimetres.
_BULGE_MM = 0.01
_WORDS = re.compile(r"(?P<count>[0-9]{1,9})(?::(?P<width>.+))?")


@dataclass(frozen=True)
class MicroJoints:
    """How many bridges an outline has, and how wide they are in millimetres."""

    count: int
    width_mm: float = BRIDGE_MM

    def __str__(self) -> str:
        """Return the text that ``parse_micro_joints`` reads."""
        return f"{self.count}:{self.width_mm:g}mm"


def parse_micro_joints(text: str) -> MicroJoints:
    """Return the micro-joints that a text such as ``4`` or ``4:0.3mm`` asks for.

    Raises
    ------
    InputError
        If the text asks for none, too many, or for bridges under 0.1 or over 5 mm.

    Examples
    --------
    >>> parse_micro_joints("4")
    MicroJoints(count=4, width_mm=0.25)
    >>> str(parse_micro_joints("2:0.5mm"))
    '2:0.5mm'
    """
    words = _WORDS.fullmatch(text.strip())
    if words is None or not 1 <= int(words["count"]) <= _MOST:
        raise InputError(
            f"micro-joints {text!r} must be NUMBER or NUMBER:WIDTH, with a number from 1 to "
            f"{_MOST}, such as 4 or 4:0.3mm"
        )
    width_text = words["width"]
    width = (
        BRIDGE_MM if width_text is None else parse_length(width_text, what="width of micro-joints")
    )
    least, most = _WIDTHS_MM
    if not least <= width <= most:
        raise InputError(
            f"micro-joints are {width:g} mm wide, but must be {least:g} to {most:g} mm wide"
        )
    return MicroJoints(int(words["count"]), width)


def bridged(drawing: SheetDrawing, wanted: MicroJoints, *, kerf_mm: float = 0.0) -> SheetDrawing:
    """Return a sheet whose outlines are open at micro-joints.

    They stand at equal distances along the outline, or as near to that as there are sides long
    and straight enough to hold one and a little more; a short outline has fewer, and one at
    least where there is such a side.

    Parameters
    ----------
    drawing : SheetDrawing
    wanted : MicroJoints
    kerf_mm : float
        Width of the burnt line: the beam stops so much earlier that the bridge is as wide as
        it was asked for.

    Returns
    -------
    SheetDrawing
        Its outlines are open runs, one after another round the piece.

    Examples
    --------
    >>> square = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]]), True)
    >>> sheet = SheetDrawing("sheet 1", 20.0, 10.0, (PieceDrawing("A1", (square,)),), ())
    >>> one, two = bridged(sheet, MicroJoints(2, 1.0)).pieces[0].entities
    >>> one.points.tolist()
    [[5.0, 0.0], [9.0, 0.0], [9.0, 9.0], [5.0, 9.0]]
    """
    gap = wanted.width_mm + kerf_mm
    return replace(
        drawing,
        pieces=tuple(
            PieceDrawing(
                piece.piece_id,
                tuple(
                    run for entity in piece.entities for run in _opened(entity, wanted.count, gap)
                ),
            )
            for piece in drawing.pieces
        ),
        open_outlines=True,
    )


def _opened(entity: Entity, count: int, gap_mm: float) -> list[Entity]:
    """Return the runs that are left of an outline; anything else as it is."""
    if not isinstance(entity, Polyline) or entity.layer is not Layer.CUT_OUTER:
        return [entity]
    bulges = entity.bends
    chords = np.hypot(*(np.roll(entity.points, -1, axis=0) - entity.points).T)
    ends = np.cumsum(chords * stretch(bulges))
    starts = np.concatenate(([0.0], ends[:-1]))
    radii = chords * (1.0 + bulges**2) / (4.0 * np.maximum(np.abs(bulges), 1e-12))
    flat = gap_mm**2 / (8.0 * radii) <= _BULGE_MM
    middles = _middles(starts, ends, flat, count, gap_mm)
    if not len(middles):
        return [entity]
    along = np.concatenate((starts, starts + ends[-1], 2.0 * ends[-1:]))
    # A run goes from the end of one gap to the beginning of the next.
    begins = middles + gap_mm / 2.0
    stops = np.roll(middles, -1) - gap_mm / 2.0
    stops[-1] += ends[-1]
    return [
        _run(entity.points, bulges, along, float(begin), float(stop))
        for begin, stop in zip(begins, stops, strict=True)
    ]


def _middles(
    starts: FloatArray, ends: FloatArray, flat: BoolArray, count: int, gap_mm: float
) -> FloatArray:
    """Return where along the outline its gaps have their middles, in ascending order."""
    whole = float(ends[-1])
    count = max(1, min(count, int(whole / _APART_MM)))
    need = gap_mm / 2.0 + _REST_MM
    wide = flat & (ends - starts >= 2.0 * need)
    if not wide.any():
        return np.zeros(0)
    wished = (np.arange(count) + 0.5) * whole / count - whole / (4.0 * count)
    near = np.clip(wished[:, None], (starts[wide] + need)[None], (ends[wide] - need)[None])
    best = np.argmin(np.round(np.abs(near - wished[:, None]), 6), axis=1)
    middles = np.sort(near[np.arange(count), best])
    # Where sides are short two wishes may come to the same place.
    far = np.diff(middles, prepend=middles[-1] - whole) > gap_mm + 4.0 * _REST_MM
    return middles[far] if far.any() else middles[:1]


def _run(
    points: FloatArray, bulges: FloatArray, along: FloatArray, begin: float, stop: float
) -> Polyline:
    """Return the part of an outline between two places along it.

    ``along`` has where each side begins, twice round; ``stop`` may be a round later.
    """
    first = int(np.searchsorted(along, begin, side="right")) - 1
    last = int(np.searchsorted(along, stop, side="left")) - 1
    sides = np.arange(first, last + 1)
    length = np.diff(along)[sides]
    low = np.clip((begin - along[sides]) / length, 0.0, 1.0)
    high = np.clip((stop - along[sides]) / length, 0.0, 1.0)
    corners, sweep = np.roll(points, -1, axis=0), 4.0 * np.arctan(bulges)
    wrapped = sides % len(points)
    entry = points_on_sides(points[wrapped], corners[wrapped], sweep[wrapped], low)
    exit_ = points_on_sides(
        points[wrapped[-1:]], corners[wrapped[-1:]], sweep[wrapped[-1:]], high[-1:]
    )
    cut = np.tan(sweep[wrapped] * (high - low) / 4.0)
    return Polyline(
        Layer.CUT_OUTER,
        np.concatenate((entry, exit_)),
        bulges=np.concatenate((cut, [0.0])) if np.any(cut) else None,
    )


#: The folder of these sheets in a job's folder.
CUT_FOLDER = "cut"


def kerfed_sheets(
    drawings: Sequence[SheetDrawing],
    kerf_mm: float,
    micro_joints: MicroJoints | None,
    *,
    common: bool = False,
) -> tuple[SheetDrawing, ...]:
    """Return the sheets as they are to be cut; none where that is as they are drawn.

    Parameters
    ----------
    drawings : sequence of SheetDrawing
        Nominal.
    kerf_mm : float
        Width of the burnt line, or 0.
    micro_joints : MicroJoints or None
    common : bool
        Whether what pieces share is cut once.

    Returns
    -------
    tuple of SheetDrawing
        Their names say what was done to them, as in ``sheet_01_kerf0.15mm_micro4x0.25mm``.

    Raises
    ------
    CannotMakeError
        If the kerf cannot be taken off (see ``compensated``).
    """
    if not kerf_mm and micro_joints is None and not common:
        return ()
    words = [f"kerf{kerf_mm:g}mm"] if kerf_mm else []
    if micro_joints is not None:
        words.append(f"micro{micro_joints.count}x{micro_joints.width_mm:g}mm")
    if common:
        words.append("common")
    result = []
    for drawing in drawings:
        kerfed = compensated(drawing, kerf_mm)
        if micro_joints is not None:
            kerfed = bridged(kerfed, micro_joints, kerf_mm=kerf_mm)
        if common:
            kerfed = with_common_cuts(kerfed)
        result.append(replace(kerfed, name="_".join([drawing.name, *words])))
    return tuple(result)


def check_kerf(kerf_mm: float, gap_mm: float) -> None:
    """Raise InputError if cuts of pieces side by side would run into one another."""
    if kerf_mm and gap_mm < 2.0 * kerf_mm:
        raise InputError(
            f"pieces are {gap_mm:g} mm apart, but a kerf of {kerf_mm:g} mm needs twice its width "
            f"between them: use --gap {2.0 * kerf_mm:g}mm or more"
        )


def kerf_notes(
    drawings: Sequence[SheetDrawing],
    kerf_mm: float,
    micro_joints: MicroJoints | None,
    *,
    service: bool = False,
    common: bool = False,
) -> list[Note]:
    """Return what a job's notes say of these sheets; nothing where there are none.

    ``service`` says that there are files for a service, too; ``common``, that what pieces share is
    cut once.
    """
    done = [f"compensation for a kerf of {kerf_mm:g} mm"] if kerf_mm else []
    if micro_joints is not None:
        done.append(f"micro-joints of {micro_joints.width_mm:g} mm in the outlines")
    if common:
        done.append("what strips share cut once")
    if not done:
        return []
    notes = [
        f"{CUT_FOLDER}/ holds the sheets to cut, with {' and '.join(done)}; the sheets in sheets/ "
        "are nominal"
    ]
    if service and kerf_mm:
        notes.append(
            "warning: cutting services compensate for the kerf themselves, so the files in "
            f"service/ are nominal; do not send a service the files in {CUT_FOLDER}/"
        )
    whole = [
        piece.piece_id
        for drawing in drawings
        for piece in drawing.pieces
        if micro_joints is not None
        and all(getattr(entity, "closed", True) for entity in piece.entities[-1:])
    ]
    if whole:
        notes.append(
            f"{agree(len(whole), '{n} piece[ has|s have]')} no micro-joints, because no side is "
            f"long and straight enough: {few_of(whole)}"
        )
    return Note.each("kerf", notes)
