"""Refuse drawings that a machine would cut wrongly.

The writers call ``check_drawing`` first, so that no file is ever written from a spoiled drawing.
What else has to hold of a sheet is proved from the files.
"""

from itertools import chain

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.cut.drawing import Circle, Layer, Polyline, SheetDrawing

#: The shortest segment that laser programs take without merging it away, millimetres.
MIN_SEGMENT_MM = 0.1
#: A coordinate beyond this is a mistaken unit, millimetres (a hundred metres).
_MOST_MM = 1e5


def on_grid(points: FloatArray) -> FloatArray:
    """Return points rounded to the step of the files, without negative zeros.

    Examples
    --------
    >>> import numpy as np
    >>> on_grid(np.array([[1.00004, -0.00001]])).tolist()
    [[1.0, 0.0]]
    """
    return np.round(points, 4) + 0.0


def check_drawing(drawing: SheetDrawing) -> None:
    """Raise unless a drawing can be written and cut.

    Coordinates are finite and within a hundred metres; every piece is engraved, then its holes,
    then its outline (the order of ``Layer``), and has an outline; what is cut is closed, unless
    outlines are open on purpose; no segment is shorter than 0.1 mm, no circle narrower than
    twice that, and nothing is drawn twice.

    Parameters
    ----------
    drawing : SheetDrawing
        What is to be written.

    Raises
    ------
    InputError
        With the first kind of fault found, how often it occurs and in which pieces.

    Examples
    --------
    >>> check_drawing(SheetDrawing("sheet 1", 600.0, 400.0, (), ()))
    """
    names = [*(piece.piece_id for piece in drawing.pieces), "the notes"]

    def refuse(problem: str, owners: IntArray, cure: str) -> None:
        """Raise for a fault that occurs once for each owner; do nothing where there is none."""
        if len(owners):
            named = [names[at] for at in dict.fromkeys(owners.tolist())]
            raise InputError(f"{len(owners)} {problem}, in {few_of(named)}; {cure}")

    groups = [*(piece.entities for piece in drawing.pieces), drawing.notes]
    entities = list(chain.from_iterable(groups))
    rank_of = {layer: rank for rank, layer in enumerate(Layer)}
    rank = np.array([rank_of[entity.layer] for entity in entities], dtype=np.int64)
    owner = np.repeat(np.arange(len(groups)), [len(group) for group in groups])
    noted = owner == len(drawing.pieces)
    refuse(
        "line(s) are among the notes, and not on their layer, or the other way round",
        owner[noted != (rank == rank_of[Layer.NOTES])],
        "put notes on the layer NOTES",
    )
    refuse(
        "line(s) are not in cutting order",
        owner[1:][(np.diff(rank) < 0) & (np.diff(owner) == 0)],
        "put engraving first, then holes, then the outline",
    )
    refuse(
        "piece(s) have no outline",
        np.setdiff1d(np.arange(len(drawing.pieces)), owner[rank == rank_of[Layer.CUT_OUTER]]),
        "give each piece a closed line on CUT_OUTER",
    )
    shut = {Layer.CUT_INNER} if drawing.open_outlines else {Layer.CUT_INNER, Layer.CUT_OUTER}
    is_open = [
        isinstance(one, Polyline) and not one.closed and one.layer in shut for one in entities
    ]
    refuse(
        "line(s) that are cut are open",
        owner[np.array(is_open, dtype=np.bool_)],
        "close them, or engrave them",
    )
    circles = [(one.x, one.y, one.radius) for one in entities if isinstance(one, Circle)]
    is_circle = np.array([isinstance(one, Circle) for one in entities], dtype=np.bool_)
    lines = [entity for entity in entities if isinstance(entity, Polyline)]
    runs = [line.points for line in lines]
    of_points = np.repeat(owner[~is_circle], [len(run) for run in runs])
    points, rounds = np.concatenate([*runs, np.empty((0, 2))]), np.array(circles).reshape(-1, 3)
    sheet = np.array([drawing.width_mm, drawing.height_mm])
    if not np.all((sheet > 0.0) & (sheet <= _MOST_MM)):
        raise InputError(
            f"sheet {drawing.name!r} measures {sheet[0]} x {sheet[1]} mm, not 0 to 100 m"
        )
    for values, owners in ((points, of_points), (rounds, owner[is_circle])):
        refuse(
            "point(s) are not finite, or over 100 m away",
            owners[~np.all(np.abs(values) <= _MOST_MM, axis=1)],
            "coordinates must be numbers, in millimetres",
        )
    starts, ends = _sides(lines)
    length = np.hypot(*(points[ends] - points[starts]).T)
    # A thousandth of the limit forgives rounding where a point was shared or placed.
    refuse(
        f"segment(s) are shorter than {MIN_SEGMENT_MM} mm",
        of_points[starts[length < MIN_SEGMENT_MM * 0.999]],
        "drop points that coincide; a closed line must not repeat its first point",
    )
    refuse(
        f"circle(s) have a radius under {MIN_SEGMENT_MM} mm",
        owner[is_circle][rounds[:, 2] < MIN_SEGMENT_MM],
        "make the holes larger",
    )
    bends = [np.zeros(len(one.points)) if one.bulges is None else one.bulges for one in lines]
    # Two arcs may share their ends, and not their heights; from the other end, left is right.
    height = np.concatenate([*bends, np.empty(0)])[starts] * length / 2.0
    packed = _packed(points)
    height = np.where(packed[starts] < packed[ends], height, -height)
    low, high = (side(packed[starts], packed[ends]) for side in (np.minimum, np.maximum))
    refuse(
        "segment(s) are drawn twice",
        of_points[starts[_repeats(low, high, np.rint(height * 1e4).astype(np.int64))]],
        "draw each line once: the laser would burn it twice",
    )
    refuse(
        "circle(s) are drawn twice",
        owner[is_circle][_repeats(_packed(rounds[:, :2]), _packed(rounds[:, 1:]))],
        "draw each hole once",
    )


def _sides(lines: list[Polyline]) -> tuple[IntArray, IntArray]:
    """Return the points at both ends of each side of lines whose points follow one another."""
    counts = np.array([len(line.points) for line in lines], dtype=np.int64)
    last = np.cumsum(counts) - 1
    following = np.arange(1, int(counts.sum()) + 1)
    following[last] = last - counts + 1
    is_open = np.array([not line.closed for line in lines], dtype=np.bool_)
    starts = np.delete(np.arange(len(following)), last[is_open])
    return starts, following[starts]


def _packed(points: FloatArray) -> IntArray:
    """Return one integer for each point on the grid of the files."""
    grid = np.rint(points * 1e4).astype(np.int64)
    return (grid[:, 0] << 32) + grid[:, 1]


def _repeats(*keys: IntArray) -> IntArray:
    """Return the indices of entries that repeat an earlier entry in all keys."""
    order = np.lexsort(keys)
    same = np.all([np.diff(key[order]) == 0 for key in keys], axis=0)
    return np.sort(order[1:][same])
