"""Draw sheets: every piece where it stands, with its marks, holes and outline."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.offcut import Offcut
from fabweave.piece.piece import Piece
from fabweave.sheet.drawing import Circle, Entity, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.labels.lettering import lettered
from fabweave.sheet.labels.marks import Marks
from fabweave.sheet.labels.texts import OVER_SIGN, UNDER_SIGN
from fabweave.sheet.sheet_notes import sheet_notes, stock_notes
from fabweave.stock.rotations import HALF_TURN_DEG

#: Runs of so many pieces are improved at a time: every pair of links of a run is looked at.
_WINDOW = 500
#: A run is improved so many times at most; most are at rest after a dozen.
_ROUNDS = 25
#: What shortens the way by less is not done, or rounding might go on for ever.
_GAIN_MM = 1e-3


def short_route(ends: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return an order of pieces, and which are walked backwards, with little way between them.

    Each piece is entered at one of its two ends and left at the other. The way begins at the
    origin and ends anywhere. It goes to the nearest end of a piece that is left, and is then
    shortened: whatever run of pieces is shorter backwards is turned round (2-opt).

    Parameters
    ----------
    ends : (N, 2, 2) float array
        Both ends of each piece, millimetres.

    Returns
    -------
    order : (N,) int array
        The pieces one after another.
    backwards : (N,) bool array
        In that order, whether each is entered at its second end.

    Examples
    --------
    >>> ends = np.array([[[9.0, 0.0], [6.0, 0.0]], [[1.0, 0.0], [5.0, 0.0]]])
    >>> order, backwards = short_route(ends)
    >>> order.tolist(), backwards.tolist()
    ([1, 0], [False, True])
    """
    order, backwards = _nearest_next(ends)
    for start in range(0, len(order), _WINDOW // 2):
        stop = min(start + _WINDOW, len(order))
        for _ in range(_ROUNDS):
            if not _shorten(ends, order, backwards, start, stop):
                break
    return order, backwards


def spread_heat(order: IntArray, backwards: BoolArray) -> tuple[IntArray, BoolArray]:
    """Return an order in which no piece follows its neighbour: every second one, then back.

    The material round a cut has cooled when the piece beside it is cut. The tool travels about
    twice as far as in the order that is given.

    Parameters
    ----------
    order : (N,) int array
    backwards : (N,) bool array
        As ``short_route`` returns them.

    Examples
    --------
    >>> order, backwards = spread_heat(np.arange(5), np.zeros(5, dtype=bool))
    >>> order.tolist(), backwards.tolist()
    ([0, 2, 4, 3, 1], [False, False, False, True, True])
    """
    way = np.concatenate((np.arange(0, len(order), 2), np.arange(1, len(order), 2)[::-1]))
    return order[way], backwards[way] ^ (way % 2 == 1)


def chained_strokes(groups: Sequence[Sequence[FloatArray]]) -> list[FloatArray]:
    """Return the strokes of all groups, one group after another, with little way between them.

    Within a group the next stroke is always the one with the nearest end, and is drawn from there;
    the first of all is drawn as it is.

    Parameters
    ----------
    groups : sequence of sequences of (N, 2) float arrays
        Strokes, such as those of each label of a piece, millimetres.

    Examples
    --------
    >>> strokes = [np.array([[x, 0.0], [x + 1.0, 0.0]]) for x in (0.0, 5.0, 2.0)]
    >>> [stroke[0, 0].item() for stroke in chained_strokes([strokes])]
    [0.0, 2.0, 5.0]
    """
    chain: list[FloatArray] = []
    for strokes in groups:
        ends = np.array([(stroke[0], stroke[-1]) for stroke in strokes]).reshape(-1, 2, 2)
        for _ in strokes:
            here = chain[-1][-1] if chain else strokes[0][0]
            distance = np.hypot(ends[:, :, 0] - here[0], ends[:, :, 1] - here[1])
            # Rounding makes ties fall the same way on every machine.
            number, side = divmod(int(np.argmin(np.round(distance, 6))), 2)
            chain.append(strokes[number][::-1] if side else strokes[number])
            ends[number] = np.inf
    return chain


def _nearest_next(ends: FloatArray) -> tuple[IntArray, BoolArray]:
    """Go to the nearest end of those left, from the origin on."""
    count = len(ends)
    order = np.empty(count, dtype=np.int64)
    backwards = np.empty(count, dtype=np.bool_)
    left = ends.copy()
    here = np.zeros(2)
    for at in range(count):
        # Rounding makes ties fall the same way on every machine.
        distance = np.round(np.hypot(left[:, :, 0] - here[0], left[:, :, 1] - here[1]), 6)
        piece, side = divmod(int(np.argmin(distance)), 2)
        order[at], backwards[at] = piece, side == 1
        here = ends[piece, 1 - side]
        left[piece] = np.inf
    return order, backwards


def _shorten(
    ends: FloatArray, order: IntArray, backwards: BoolArray, start: int, stop: int
) -> bool:
    """Turn runs round that are shorter so, in place; say whether there were any."""
    window = slice(start, stop)
    sides = backwards[window].astype(np.int64)
    enter, leave = ends[order[window], sides], ends[order[window], 1 - sides]
    before = np.zeros(2) if start == 0 else ends[order[start - 1], 1 - int(backwards[start - 1])]
    come = np.concatenate((before[None], leave[:-1]))  # from where each is entered
    last = stop == len(order)
    beyond = leave[-1] if last else ends[order[stop], int(backwards[stop])]
    go = np.concatenate((enter[1:], beyond[None]))  # to where each is left
    into, out = np.hypot(*(enter - come).T), np.hypot(*(go - leave).T)
    # A run from i to j turned round is entered where j was left, and left where i was entered.
    first = _distances(come, leave)
    second = _distances(enter, go)
    if last:
        second[:, -1] = 0.0
    gain = np.round(into[:, None] + out[None, :] - first - second, 6)
    gain[np.tril_indices(len(gain), -1)] = 0.0
    i, j = np.nonzero(gain > _GAIN_MM)
    taken = np.zeros(len(gain) + 1, dtype=np.bool_)
    for k in np.lexsort((j, i, -gain[i, j]))[: 4 * len(gain)].tolist():
        a, b = int(i[k]), int(j[k])
        # Runs that share no link do not change one another's gain.
        if taken[a : b + 2].any():
            continue
        taken[a : b + 2] = True
        run = slice(start + a, start + b + 1)
        order[run] = order[run][::-1].copy()
        backwards[run] = ~backwards[run][::-1]
    return bool(len(i))


def _distances(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the distance of every two points."""
    return np.hypot(first[:, None, 0] - second[None, :, 0], first[:, None, 1] - second[None, :, 1])


def sheet_name(number: int) -> str:
    """Return the name of a sheet and of its files; numbers start at 1."""
    return f"sheet_{number:02d}"


def draw_sheets(
    pieces: Sequence[Piece],
    marks: Sequence[Marks],
    layout: Layout,
    *,
    title: str,
    captions: Sequence[str] = (),
    mirrored: bool = False,
    cool: bool = False,
    names: Sequence[str] = (),
    offcuts: Sequence[Offcut] = (),
    warnings: Sequence[str] = (),
) -> tuple[SheetDrawing, ...]:
    """Draw every sheet of a layout.

    Parameters
    ----------
    pieces, marks
        The pieces and what is engraved on them.
    layout : Layout
        Where each piece stands.
    title : str
        Name of the job, lettered in the margin.
    captions : sequence of str
        What else is lettered on each sheet, such as its material; by default nothing.
    mirrored : bool
        Whether pieces lie face down: what stands at x on a sheet of the layout is drawn at the
        sheet's width minus x, so that the insides are engraved. Notes are not mirrored.
    cool : bool
        Whether pieces side by side are not to be cut one after another (``spread_heat``).
    names : sequence of str
        What people call each piece, where that is not its id.
    offcuts : sequence of Offcut
        What is left of sheets, one at most of each, as it is drawn.
    warnings : sequence of str
        Lettered in the margin of each sheet, capitals.

    Returns
    -------
    tuple of SheetDrawing
        One for each sheet, pieces in an order of little travel (``short_route``), each walked
        from end to end: its labels on the way there, the strokes of each from the nearest end to
        the next (``chained_strokes``), its ticks on the way back, its holes on the way there
        again, and the outline from that end. Nothing that is not a piece is on a layer that is
        cut.
    """
    placed: list[list[Placement]] = [[] for _ in layout.sheets]
    for placement in sorted(layout.placements, key=lambda placement: placement.piece):
        placed[placement.sheet].append(placement)
    count, left = len(layout.sheets), {offcut.sheet: offcut for offcut in offcuts}
    legend = _legend(marks, mirrored=mirrored)
    suffixes = [f" {lettered(caption)}" if caption else "" for caption in captions] or [""] * count
    drawings = []
    for at, (sheet, suffix) in enumerate(zip(layout.sheets, suffixes, strict=True)):
        width = sheet.width_mm if mirrored else None
        drawn = _draw_pieces(pieces, marks, placed[at], width, names, cool=cool)
        lying = sheet.mirrored() if mirrored else sheet
        if lying.grain_deg is None and layout.rotations.step_deg == HALF_TURN_DEG:
            lying = replace(lying, grain_deg=0.0)
        texts = [f"{lettered(title)} SHEET {at + 1}/{count}{suffix}".strip(), *warnings, *legend]
        notes = sheet_notes(lying, texts, margin_mm=layout.margin_mm, pieces=drawn)
        drawings.append(
            SheetDrawing(
                name=sheet_name(at + 1),
                width_mm=sheet.width_mm,
                height_mm=sheet.height_mm,
                pieces=tuple(drawn),
                notes=(*notes.drawn, *stock_notes(lying, left.get(at))),
                left_out=notes.left_out,
            )
        )
    return tuple(drawings)


def _legend(marks: Sequence[Marks], *, mirrored: bool) -> list[str]:
    """Return notes that say what the engraving means."""
    kinds = {kind for piece_marks in marks for label in piece_marks.labels for kind in label.kinds}
    legend = []
    if kinds:
        legend.append(f"THE ENGRAVED FACE IS THE {'IN' if mirrored else 'OUT'}SIDE")
    elif mirrored:
        legend.append("THE UPPER FACE IS THE INSIDE")
    if "sign" in kinds:
        legend.append(f"{OVER_SIGN} THIS PIECE PASSES OVER, {UNDER_SIGN} UNDER")
    if "step" in kinds:
        legend.append("(7): PLACED IN STEP 7")
    if any(label.hidden for piece_marks in marks for label in piece_marks.labels):
        legend.append("LETTERS ARE COVERED WHEN IT IS WOVEN")
    return legend


def _draw_pieces(
    pieces: Sequence[Piece],
    marks: Sequence[Marks],
    placements: Sequence[Placement],
    mirror_mm: float | None,
    names: Sequence[str],
    *,
    cool: bool,
) -> list[PieceDrawing]:
    """Draw the pieces of a sheet in the order of the cut, mirrored in its width if one is given."""
    ends = np.empty((len(placements), 2, 2))
    for at, placement in enumerate(placements):
        corners = pieces[placement.piece].path.points
        x = corners[:, 0]
        ends[at] = _place(corners[[np.argmin(x), np.argmax(x)]], placement, mirror_mm)
    order, backwards = short_route(ends)
    if cool:
        order, backwards = spread_heat(order, backwards)
    drawn = [
        draw_piece(pieces[placement.piece], marks[placement.piece], placement, mirror_mm, way)
        for placement, way in zip(
            (placements[at] for at in order.tolist()),
            np.where(backwards, -1.0, 1.0).tolist(),
            strict=True,
        )
    ]
    if not names:
        return drawn
    return [
        replace(one, name=names[placements[at].piece])
        for one, at in zip(drawn, order.tolist(), strict=True)
    ]


def _place(points: FloatArray, placement: Placement, mirror_mm: float | None) -> FloatArray:
    """Return where points of a piece are drawn."""
    placed: FloatArray = placement.apply(points)
    return placed if mirror_mm is None else placed * (-1.0, 1.0) + (mirror_mm, 0.0)


def draw_piece(
    piece: Piece, marks: Marks, placement: Placement, mirror_mm: float | None, way: float
) -> PieceDrawing:
    """Return a piece's entities on its sheet, mirrored in its width if one is given.

    The piece is walked along its x axis, or back if ``way`` is -1.
    """
    labels = _along([label.centre[None] for label in marks.labels], way)
    letters = chained_strokes([marks.labels[at].strokes for at in labels])
    ticks = [marks.ticks[at] for at in _along(marks.ticks, -way)]
    holes, slots = piece.holes, [slot.path for slot in piece.slots]
    begin = -int(np.argmax(way * piece.path.points[:, 0]))
    outline = np.roll(piece.path.points, begin, axis=0)
    parts = [*letters, *ticks, holes[:, 1:3], *(slot.points for slot in slots), outline]
    # One motion for all points: a piece has hundreds of strokes.
    placed = np.split(
        _place(np.concatenate(parts), placement, mirror_mm),
        np.cumsum([len(part) for part in parts[:-1]]),
    )
    layers = [Layer.ENGRAVE_LABEL] * len(letters) + [Layer.ENGRAVE_MARK] * len(ticks)
    entities: list[Entity] = [
        Polyline(layer, points) for layer, points in zip(layers, placed, strict=False)
    ]
    # Turning a piece leaves its bulges as they are; seen from the back arcs turn the other way.
    sense = 1.0 if mirror_mm is None else -1.0
    inner: list[Entity] = [
        Circle(Layer.CUT_INNER, x, y, diameter / 2)
        for (x, y), diameter in zip(placed[len(layers)].tolist(), holes[:, 3].tolist(), strict=True)
    ]
    inner += [
        Polyline(Layer.CUT_INNER, points, closed=True, bulges=sense * slot.bulges)
        for points, slot in zip(placed[len(layers) + 1 : -1], slots, strict=True)
    ]
    firsts = [*holes[:, None, 1:3], *(slot.points for slot in slots)]
    entities += [inner[at] for at in _along(firsts, way)]
    bulges = sense * np.roll(piece.path.bulges, begin)
    entities.append(Polyline(Layer.CUT_OUTER, placed[-1], closed=True, bulges=bulges))
    return PieceDrawing(piece.id, tuple(entities))


def _along(runs: Sequence[FloatArray], way: float) -> list[int]:
    """Return the order of runs of points along the x axis, or back if ``way`` is -1."""
    x = np.array([run[0, 0] for run in runs])
    return np.argsort(np.round(way * x, 6), kind="stable").tolist()
