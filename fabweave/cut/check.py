"""Refuse drawings that a machine would cut wrongly.

The writers call ``check_drawing`` first, so that no file is ever written from a spoiled drawing.
"""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from fabweave.arrays import BoolArray, FloatArray, IntArray
from fabweave.cut.drawing import Circle, Layer, Polyline, SheetDrawing
from fabweave.errors import InputError

#: The shortest segment that laser programs take without merging it away, millimetres.
MIN_SEGMENT_MM = 0.1
#: Files carry coordinates to this step, millimetres.
STEP_MM = 1e-4
#: A coordinate beyond this is a mistaken unit, millimetres (a hundred metres).
MAX_COORDINATE_MM = 1e5

_NOTES_OWNER = "the notes"

# Names the owners of what is selected.
_Owners: TypeAlias = Callable[[BoolArray | IntArray], list[str]]


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

    The sheet has a size and a name; piece ids are unique, of ASCII and without spaces; every
    piece is engraved, then its holes, then its outline (the order of ``Layer``) and has an
    outline; what is cut is closed; only notes are on NOTES; coordinates are finite and within a
    hundred metres; no segment, the closing one included, is shorter than 0.1 mm; no line and no
    circle is there twice.

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
    _check_sheet(drawing)
    entities = [entity for piece in drawing.pieces for entity in piece.entities]
    entities.extend(drawing.notes)
    owners = [piece.piece_id for piece in drawing.pieces for _ in piece.entities]
    owners.extend([_NOTES_OWNER] * len(drawing.notes))
    _check_layers(drawing)
    _check_polylines(
        [
            (entity, owner)
            for entity, owner in zip(entities, owners, strict=True)
            if isinstance(entity, Polyline)
        ]
    )
    _check_circles(
        [
            (entity, owner)
            for entity, owner in zip(entities, owners, strict=True)
            if isinstance(entity, Circle)
        ]
    )


def _refuse(problem: str, owners: Sequence[str], cure: str) -> None:
    """Raise for a fault that occurs once for each owner named; do nothing where there is none."""
    if not owners:
        return
    named = list(dict.fromkeys(owners))
    places = ", ".join(named[:8]) + (f" and {len(named) - 8} more" if len(named) > 8 else "")
    raise InputError(f"{len(owners)} {problem}, in {places}; {cure}")


def _check_sheet(drawing: SheetDrawing) -> None:
    sizes = (drawing.width_mm, drawing.height_mm)
    if not all(np.isfinite(size) and 0.0 < size <= MAX_COORDINATE_MM for size in sizes):
        raise InputError(
            f"sheet {drawing.name!r} measures {sizes[0]} x {sizes[1]} mm; "
            "both sides must be positive lengths of at most 100 m"
        )
    if not drawing.name.strip() or not drawing.name.isprintable():
        raise InputError(f"a sheet is named {drawing.name!r}; give it a printable name")
    ids = [piece.piece_id for piece in drawing.pieces]
    # An id becomes part of an XML id, and of a DXF string that old versions keep in a code page.
    bad = [repr(name) for name in ids if re.fullmatch(r"[!-~]{1,60}", name) is None]
    _refuse("piece id(s) cannot be written", bad, "use 1 to 60 characters of ASCII, no spaces")
    twice = [name for name, count in Counter(ids).items() if count > 1]
    _refuse("piece id(s) occur more than once", twice, "give every piece an id of its own")


def _check_layers(drawing: SheetDrawing) -> None:
    rank = {layer: index for index, layer in enumerate(Layer)}
    noted: list[str] = []
    disordered: list[str] = []
    uncut: list[str] = []
    for piece in drawing.pieces:
        ranks = [rank[entity.layer] for entity in piece.entities]
        if rank[Layer.NOTES] in ranks:
            noted.append(piece.piece_id)
        if ranks != sorted(ranks):
            disordered.append(piece.piece_id)
        if rank[Layer.CUT_OUTER] not in ranks:
            uncut.append(piece.piece_id)
    _refuse("piece(s) have entities on NOTES", noted, "put them into the notes of the sheet")
    _refuse(
        "piece(s) are not in the order of the cut",
        disordered,
        "put engraving first, then holes, then the outline",
    )
    _refuse("piece(s) have no outline", uncut, "give each piece a closed line on CUT_OUTER")
    strays = [entity.layer.value for entity in drawing.notes if entity.layer is not Layer.NOTES]
    _refuse("note(s) are on a layer of the pieces", strays, "put notes on the layer NOTES")


def _check_polylines(polylines: Sequence[tuple[Polyline, str]]) -> None:
    shapeless = [
        owner
        for line, owner in polylines
        if line.points.ndim != 2
        or line.points.shape[1] != 2
        or len(line.points) < (3 if line.closed else 2)
    ]
    _refuse(
        "polyline(s) have too few points",
        shapeless,
        "an open one needs at least two (x, y) points and a closed one three",
    )
    open_cuts = [
        owner
        for line, owner in polylines
        if line.layer in (Layer.CUT_INNER, Layer.CUT_OUTER) and not line.closed
    ]
    _refuse("line(s) that are cut are open", open_cuts, "close them, or engrave them")
    if not polylines:
        return
    points = np.concatenate([line.points for line, _ in polylines])
    counts = np.array([len(line.points) for line, _ in polylines])
    closed = np.array([line.closed for line, _ in polylines])
    line_of = np.repeat(np.arange(len(polylines)), counts)

    def at(bad: BoolArray | IntArray) -> list[str]:
        return [polylines[index][1] for index in line_of[bad].tolist()]

    _check_coordinates(points, at)
    last = np.cumsum(counts) - 1
    following = np.arange(1, len(points) + 1)
    following[last] = last - counts + 1
    starts = np.delete(np.arange(len(points)), last[~closed])
    ends = following[starts]
    length = np.hypot(*(points[ends] - points[starts]).T)
    # A thousandth of the limit forgives rounding where a point was shared or placed.
    short = starts[length < MIN_SEGMENT_MM * 0.999]
    _refuse(
        f"segment(s) are shorter than {MIN_SEGMENT_MM} mm",
        at(short),
        "drop points that coincide; a closed line must not repeat its first point",
    )
    packed = _packed(points)
    low = np.minimum(packed[starts], packed[ends])
    high = np.maximum(packed[starts], packed[ends])
    _refuse(
        "segment(s) are drawn twice",
        at(starts[_repeats(low, high)]),
        "draw each line once: the laser would burn it twice",
    )


def _check_circles(circles: Sequence[tuple[Circle, str]]) -> None:
    if not circles:
        return
    values = np.array([(circle.x, circle.y, circle.radius) for circle, _ in circles])

    def at(bad: BoolArray | IntArray) -> list[str]:
        return [circles[index][1] for index in np.arange(len(circles))[bad].tolist()]

    _check_coordinates(values, at)
    small = values[:, 2] < MIN_SEGMENT_MM
    _refuse("circle(s) have a radius under 0.1 mm", at(small), "make the holes larger")
    repeats = _repeats(_packed(values[:, :2]), np.rint(values[:, 2] / STEP_MM).astype(np.int64))
    _refuse("circle(s) are drawn twice", at(repeats), "draw each hole once")


def _check_coordinates(values: FloatArray, at: _Owners) -> None:
    unreal: BoolArray = np.any(~np.isfinite(values), axis=1)
    _refuse("point(s) are not finite", at(unreal), "compute them again: they are no numbers")
    far: BoolArray = np.any(np.abs(values) > MAX_COORDINATE_MM, axis=1)
    _refuse("point(s) are over 100 m away", at(far), "coordinates must be millimetres")


def _packed(points: FloatArray) -> IntArray:
    """Return one integer for each point on the grid of the files."""
    grid = np.rint(points / STEP_MM).astype(np.int64)
    return (grid[:, 0] << 32) + grid[:, 1]


def _repeats(first: IntArray, second: IntArray) -> IntArray:
    """Return the indices of pairs that an earlier pair equals."""
    order = np.lexsort((second, first))
    same = (np.diff(first[order]) == 0) & (np.diff(second[order]) == 0)
    return np.sort(order[1:][same])
