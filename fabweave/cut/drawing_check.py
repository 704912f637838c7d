"""Refuse drawings that a machine would cut wrongly.

The writers call ``check_drawing`` first, so that no file is ever written from a spoiled drawing.
"""

import re
from collections import Counter
from collections.abc import Sequence
from itertools import chain
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.cut.drawing import Circle, Layer, Polyline, SheetDrawing
from fabweave.cut.line_overlap import overlapping

#: The shortest segment that laser programs take without merging it away, millimetres.
MIN_SEGMENT_MM = 0.1
#: Files carry coordinates to this step, millimetres.
STEP_MM = 1e-4
#: A coordinate beyond this is a mistaken unit, millimetres (a hundred metres).
MAX_COORDINATE_MM = 1e5

_NOTES_OWNER = "the notes"


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
    outline; what is cut is closed, unless outlines are open on purpose; only notes are on NOTES;
    coordinates are finite and within a hundred metres; no segment, the closing one included, is
    shorter than 0.1 mm; no arc sweeps half a turn or more; no line and no circle is there twice,
    and no straight line that is cut lies on another one for a part of its length.

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
    groups = [*(piece.entities for piece in drawing.pieces), drawing.notes]
    entities = list(chain.from_iterable(groups))
    rank_of = {layer: index for index, layer in enumerate(Layer)}
    ranks = np.array([rank_of[entity.layer] for entity in entities], dtype=np.int64)
    owners = _Owners(
        (*(piece.piece_id for piece in drawing.pieces), _NOTES_OWNER),
        np.repeat(np.arange(len(groups)), [len(group) for group in groups]),
    )
    _check_layers(drawing, ranks, owners)
    is_line = np.array([isinstance(entity, Polyline) for entity in entities], dtype=np.bool_)
    lines = [entity for entity in entities if isinstance(entity, Polyline)]
    shut = {Layer.CUT_INNER} if drawing.open_outlines else {Layer.CUT_INNER, Layer.CUT_OUTER}
    _check_polylines(lines, ranks[is_line], owners.of(is_line), shut)
    circles = [entity for entity in entities if isinstance(entity, Circle)]
    _check_circles(circles, owners.of(~is_line))


class _Owners(NamedTuple):
    """The owner of each entity, line or point: names of the pieces, the notes last, and indices."""

    names: tuple[str, ...]
    which: IntArray

    def of(self, chosen: BoolArray | IntArray) -> "_Owners":
        """Return the owners of some of them."""
        return _Owners(self.names, self.which[chosen])

    def listed(self) -> list[str]:
        """Return the name of each owner."""
        return [self.names[index] for index in self.which.tolist()]


def _refuse(problem: str, owners: Sequence[str], cure: str) -> None:
    """Raise for a fault that occurs once for each owner named; do nothing where there is none."""
    if not owners:
        return
    named = list(dict.fromkeys(owners))
    raise InputError(f"{len(owners)} {problem}, in {few_of(named)}; {cure}")


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


def _check_layers(drawing: SheetDrawing, ranks: IntArray, owners: _Owners) -> None:
    layers = list(Layer)
    notes, outer = layers.index(Layer.NOTES), layers.index(Layer.CUT_OUTER)
    n_pieces = len(drawing.pieces)
    ours = owners.which < n_pieces

    def named(pieces: IntArray) -> list[str]:
        return owners._replace(which=np.unique(pieces)).listed()

    noted = owners.which[ours & (ranks == notes)]
    _refuse("piece(s) have entities on NOTES", named(noted), "put them into the notes of the sheet")
    back = (np.diff(ranks) < 0) & (np.diff(owners.which) == 0) & ours[1:]
    _refuse(
        "piece(s) are not in cutting order",
        named(owners.which[1:][back]),
        "put engraving first, then holes, then the outline",
    )
    uncut = np.setdiff1d(np.arange(n_pieces), owners.which[ranks == outer])
    _refuse("piece(s) have no outline", named(uncut), "give each piece a closed line on CUT_OUTER")
    strays = [layers[rank].value for rank in ranks[~ours & (ranks != notes)].tolist()]
    _refuse("note(s) are on a layer of the pieces", strays, "put notes on the layer NOTES")
    wide = [
        piece.piece_id
        for piece in drawing.pieces
        for entity in piece.entities
        if isinstance(entity, Polyline) and entity.width_mm is not None
    ]
    _refuse("line(s) of pieces have a width", wide, "only notes may have one: cut hairlines")


def _check_polylines(
    lines: Sequence[Polyline], ranks: IntArray, owners: _Owners, shut: set[Layer]
) -> None:
    """Check all lines; those on the layers ``shut`` must be closed."""
    if not lines:
        return
    shapes = [line.points.shape for line in lines]
    counts = np.array([shape[0] if shape[1:] == (2,) else 0 for shape in shapes], dtype=np.int64)
    bent = np.array([line.bulges is not None for line in lines], dtype=np.bool_)
    closed = np.array([line.closed for line in lines], dtype=np.bool_)
    _refuse(
        "polyline(s) have too few points",
        owners.of(counts < np.where(closed & ~bent, 3, 2)).listed(),
        "open ones need at least two (x, y) points, closed ones with straight sides three",
    )
    cut = [rank for rank, layer in enumerate(Layer) if layer in shut]
    _refuse(
        "line(s) that are cut are open",
        owners.of(np.isin(ranks, cut) & ~closed).listed(),
        "close them, or engrave them",
    )
    points = np.concatenate([line.points for line in lines])
    line_of = np.repeat(np.arange(len(lines)), counts)
    at = owners.of(line_of)
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
        at.of(short).listed(),
        "drop points that coincide; a closed line must not repeat its first point",
    )
    bulges = _bulges(lines, counts, at)[starts]
    _refuse(
        "arc(s) sweep half a turn or more, or are not finite",
        at.of(starts[~(np.abs(bulges) < 1.0)]).listed(),
        "divide them: SVG readers may draw the other half of the circle",
    )
    packed = _packed(points)
    low = np.minimum(packed[starts], packed[ends])
    high = np.maximum(packed[starts], packed[ends])
    # Two arcs may share their ends, and not their heights; from the other end, left is right.
    height = np.where(packed[starts] < packed[ends], bulges, -bulges) * length / 2.0
    _refuse(
        "segment(s) are drawn twice",
        at.of(starts[_repeats(low, high, np.rint(height / STEP_MM).astype(np.int64))]).listed(),
        "draw each line once: the laser would burn it twice",
    )
    through = starts[np.isin(ranks, cut)[line_of[starts]] & (bulges == 0.0)]
    on_others = overlapping(points[through], points[following[through]])
    _refuse(
        "cut segment(s) lie on others",
        at.of(through[on_others]).listed(),
        "merge them: the laser would burn the shared part twice",
    )


def _bulges(lines: Sequence[Polyline], counts: IntArray, at: _Owners) -> FloatArray:
    """Return the bulge after each point of some lines."""
    bulges = np.zeros(int(counts.sum()))
    strange = np.zeros(len(bulges), dtype=np.bool_)
    for line, end, count in zip(lines, np.cumsum(counts).tolist(), counts.tolist(), strict=True):
        if line.bulges is not None:
            run = slice(end - count, end)
            strange[run] = line.bulges.shape != (count,)
            bulges[run] = 0.0 if strange[run].any() else line.bulges
    _refuse(
        "point(s) belong to lines with more or fewer bulges than points",
        at.of(strange).listed(),
        "give each point the bulge of the side that leaves it",
    )
    return bulges


def _check_circles(circles: Sequence[Circle], owners: _Owners) -> None:
    if not circles:
        return
    values = np.array([(circle.x, circle.y, circle.radius) for circle in circles])
    _check_coordinates(values, owners)
    small = owners.of(values[:, 2] < MIN_SEGMENT_MM)
    _refuse("circle(s) have a radius under 0.1 mm", small.listed(), "make the holes larger")
    repeats = _repeats(_packed(values[:, :2]), np.rint(values[:, 2] / STEP_MM).astype(np.int64))
    _refuse("circle(s) are drawn twice", owners.of(repeats).listed(), "draw each hole once")


def _check_coordinates(values: FloatArray, at: _Owners) -> None:
    unreal: BoolArray = np.any(~np.isfinite(values), axis=1)
    _refuse(
        "point(s) are not finite",
        at.of(unreal).listed(),
        "compute them again: they are not numbers",
    )
    far: BoolArray = np.any(np.abs(values) > MAX_COORDINATE_MM, axis=1)
    _refuse("point(s) are over 100 m away", at.of(far).listed(), "coordinates must be millimetres")


def _packed(points: FloatArray) -> IntArray:
    """Return one integer for each point on the grid of the files."""
    grid = np.rint(points / STEP_MM).astype(np.int64)
    return (grid[:, 0] << 32) + grid[:, 1]


def _repeats(*keys: IntArray) -> IntArray:
    """Return the indices of entries that repeat an earlier entry in all keys."""
    order = np.lexsort(keys)
    same = np.all([np.diff(key[order]) == 0 for key in keys], axis=0)
    return np.sort(order[1:][same])
