"""Draw a card of a piece: flat, with what is in place where it goes, in order from its start.

On an object that curves away no single picture shows all that a piece meets; its card does.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.plan.crossing_map import JointRecord, PieceRecord, StepRecord
from fabweave.show.manual.book import Book, tag_size, text_width

#: Names on a card: the size of their letters, the height of a row, and the least room between two.
_TEXT, _ROW, _APART = 9.5, 11.0, 5.0
#: The size of millimetres behind a name.
_MM_TEXT = 7.5
#: The sign that all layers are in place stands behind a name and takes so much.
_COMPLETE = 11.0
#: The arrow behind the id of a piece, and how long the line to the nearest name is at the least.
_ARROW, _LEAD = 18.0, 5.0
#: A piece is drawn no higher than this, and no larger than so many points to a millimetre.
_HIGHEST, _LARGEST = 30.0, 1.2
#: A strand stands out so far beside the piece, and is so wide where there is room, in points.
_BESIDE, _STRAND = 2.5, 6.5
#: How light pieces are, 0 for black.
_PIECE = 0.86
#: A hole is drawn no smaller than this, in points.
_HOLE = 1.0
#: So far inside a piece a line across it meets it for certain.
_INSIDE = 0.3


@frozen_value
class Met:
    """What a card names at a station of its piece: who is met there, or a joint.

    Parameters
    ----------
    station : int
    over : bool or None
        Whether the piece lies over it; None for a joint.
    text : str
    complete : bool
        Whether all layers are in place there now, and matter.
    number : int or None
        Of what the piece lies over and runs under, from its start.
    along_mm : float or None
        How far that is from the start.
    """

    station: int
    over: bool | None
    text: str
    complete: bool
    number: int | None = None
    along_mm: float | None = None

    @property
    def parts(self) -> tuple[tuple[str, float, bool, float], ...]:
        """What is written: text, size, whether bold, and how light; one behind the other."""
        if self.number is None:
            return ((self.text, _TEXT, True, 0.0),)
        mm = "" if self.along_mm is None else f" {self.along_mm:.0f}"
        return (
            (f"{self.number} ", _TEXT, True, 0.0),
            (self.text, _TEXT, False, 0.0),
            (mm, _MM_TEXT, False, 0.35),
        )

    @property
    def wide(self) -> float:
        """How much room the name takes."""
        own = sum(text_width(text, size, bold=bold) for text, size, bold, _ in self.parts)
        return own + (_COMPLETE if self.complete else 0.0)


@frozen_value
class Named:
    """A name on a card, and what it names; in points from the upper left corner, y upwards.

    Parameters
    ----------
    met : Met
    at : (2,) float array
        Where it is met.
    strand : (4, 2) float array
        The corners of what crosses the piece there.
    name : (2,) float array
        The left end of the name, at the middle of its height.
    lead : (2, 2) float array
        The line to the name.
    """

    met: Met
    at: FloatArray
    strand: FloatArray
    name: FloatArray
    lead: FloatArray


@frozen_value
class Card:
    """A piece as it is drawn, in points from the upper left corner of its card, y upwards.

    Parameters
    ----------
    id : str
    nought : (2,) float array
        Where millimetres begin, at its lower edge.
    back : bool
        Whether its engraved arrow points to its start.
    tag : (2,) float array
        The middle of its id.
    outline : (N, 2) float array
    coming : tuple of (2, 2) float arrays
        Lines across it where strands are still to come.
    holes : (H, 3) float array
        The middle and the radius of each of its holes.
    names : tuple of Named
        In the order of the piece.
    high : float
        How high the card is.
    """

    id: str
    nought: FloatArray
    back: bool
    tag: FloatArray
    outline: FloatArray
    coming: tuple[FloatArray, ...]
    holes: FloatArray
    names: tuple[Named, ...]
    high: float


def what_is_met(
    piece: PieceRecord,
    step: StepRecord,
    strands: Mapping[tuple[int, bool], Sequence[str]],
    joints: Mapping[int, JointRecord],
    step_of: Mapping[str, int],
    idle: set[int],
) -> list[Met]:
    """Return what a piece of a step meets that is in place, from its start to its end.

    Parameters
    ----------
    piece : PieceRecord
    step : StepRecord
        In which it comes.
    strands : mapping
        From ``strand_pieces``.
    joints : mapping from id to JointRecord
    step_of : mapping from id to number
        The step of each piece.
    idle : set of int
        The crossings where nobody needs to know that all layers are in place.
    """
    first, last = (
        [Met(at, None, f"#{key}>{joints[key].mate(piece.id)}", complete=False)]
        if key is not None and key in step.joints
        else []
        for key, at in zip(piece.joints, (0, len(piece.stations) - 1), strict=True)
    )
    met = list(first)
    along = along_mm(piece)
    for at, station in enumerate(piece.stations):
        others = strands[station.crossing, not station.over]
        there = [other for other in others if step_of[other] <= step.step]
        if there and station.crossing in (step.over if station.over else step.under):
            complete = station.crossing in step.fasten and station.crossing not in idle
            number = len(met) - len(first) + 1
            met.append(Met(at, station.over, " ".join(there), complete, number, along[at]))
    return met + last


def along_mm(piece: PieceRecord) -> list[float]:
    """Return how far each station of a piece is from its first, along those between."""
    places = np.array([(station.x, station.y) for station in piece.stations])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.append(0.0, np.cumsum(steps)).tolist()


def lay_card(piece: PieceRecord, met: Sequence[Met], wide: float, *, back: bool) -> Card:
    """Lay a card out: the piece level, its start at the left, names above and below it in turn.

    Parameters
    ----------
    piece : PieceRecord
    met : sequence of Met
    wide : float
        How wide the card is, in points.
    back : bool
        Whether its engraved arrow points to its start.
    """
    tag = tag_size(piece.id)
    left = tag[0] + _ARROW
    outline, places, holes = _levelled(piece, left, wide)
    across, room = _across(outline, places)
    stations = np.array([meeting.station for meeting in met], dtype=np.int64)
    rows = _rows([meeting.wide for meeting in met], places[stations, 0], wide)
    tall = float(outline[:, 1].max())
    n_above, n_below = (len({row for row, _ in rows if row % 2 == side}) for side in (0, 1))
    top = tall + (_LEAD + _ROW * n_above if n_above else 0.0)
    high = top + (_LEAD + _ROW * n_below if n_below else 0.0)
    shift = np.array((0.0, -top))
    names = []
    for meeting, (row, start) in zip(met, rows, strict=True):
        edges, up = across[meeting.station], 1.0 if row % 2 == 0 else -1.0
        direction = (edges[1] - edges[0]) / max(float(np.linalg.norm(edges[1] - edges[0])), 1e-9)
        ends = edges + np.outer((-_BESIDE, _BESIDE), direction)
        side = (
            np.array((direction[1], -direction[0]))
            * min(_STRAND, 0.7 * room[meeting.station])
            / 2.0
        )
        away = _LEAD + _ROW * (row // 2 + 0.5)
        middle = tall + away if up > 0.0 else -away
        lead_y = middle - up * (0.36 * _TEXT + 1.0)
        spot = min(max(float(places[meeting.station, 0]), start + 3.0), start + meeting.wide - 3.0)
        lead = np.array((ends[1 if up > 0.0 else 0], (spot, lead_y)))
        strand = np.array((ends[0] - side, ends[0] + side, ends[1] + side, ends[1] - side))
        name = np.array((start, middle))
        at = places[meeting.station]
        names.append(Named(meeting, at + shift, strand + shift, name + shift, lead + shift))
    coming = [edges + shift for at, edges in enumerate(across) if at not in stations]
    first = np.array((tag[0] / 2.0, places[0, 1]))
    nought = across[0][0] + shift
    return Card(
        piece.id, nought, back, first + shift, outline + shift, tuple(coming),
        holes + np.append(shift, 0.0), tuple(names), high,
    )  # fmt: skip


def _levelled(
    piece: PieceRecord, left: float, wide: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the outline, stations and holes of a piece, from start to end, as it is drawn."""
    outline = np.array(piece.outline)
    places = np.array([(station.x, station.y) for station in piece.stations])
    cut = [(one.x, one.y, one.diameter_mm) for one in piece.cutouts if one.kind == "hole"]
    holes = np.array(cut, dtype=np.float64).reshape(-1, 3) * (1.0, 1.0, 0.5)
    x, y = places[-1] - places[0]
    length = float(np.hypot(x, y)) or 1.0
    turn = np.array([[x, -y], [y, x]]) / length if x or y else np.eye(2)
    low, high = (outline @ turn).min(axis=0), (outline @ turn).max(axis=0)
    scale = min((wide - left) / (high[0] - low[0]), _HIGHEST / (high[1] - low[1]), _LARGEST)
    corner = np.array((left, 0.0))
    drawn, at, middles = (
        corner + (points @ turn - low) * scale for points in (outline, places, holes[:, :2])
    )
    return drawn, at, np.column_stack((middles, np.maximum(holes[:, 2] * scale, _HOLE)))


def _across(outline: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the right and the left edge at each station, and how far the next station is."""
    piece = shapely.make_valid(shapely.Polygon(outline))
    ways = np.gradient(places, axis=0) if len(places) > 1 else np.array([[1.0, 0.0]])
    lengths = np.maximum(np.linalg.norm(ways, axis=1), 1e-9)[:, None]
    ups = np.column_stack((-ways[:, 1], ways[:, 0])) / lengths
    reach = float(np.ptp(outline, axis=0).max())
    well_inside = shapely.buffer(piece, -_INSIDE)
    well_inside = piece if well_inside.is_empty else well_inside
    edges = []
    for place, up in zip(places, ups, strict=True):
        own = _nearest_run(piece, place, up, reach)
        if own.is_empty:
            # In the gap of an interlocking end: the strand is drawn where the piece begins.
            beside = shapely.shortest_line(shapely.Point(place), well_inside)
            own = _nearest_run(piece, shapely.get_coordinates(beside)[-1], up, reach)
        along = np.sort((shapely.get_coordinates(own) - place) @ up)
        edges.append(place + np.outer((along[0], along[-1]), up))
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    room = np.minimum(np.append(steps, np.inf), np.append(np.inf, steps))
    return np.array(edges), room


def _nearest_run(
    piece: shapely.Geometry, place: FloatArray, up: FloatArray, reach: float
) -> shapely.Geometry:
    """Return where a line through a place is on the piece, next to the place; maybe nowhere."""
    ray = shapely.LineString(place + np.outer((-reach, reach), up))
    inside = shapely.get_parts(shapely.intersection(ray, piece))
    point = shapely.Point(place)
    return min(inside, key=lambda part: shapely.distance(part, point), default=shapely.Point())


def _rows(widths: Sequence[float], spots: FloatArray, wide: float) -> list[tuple[int, float]]:
    """Return the row of each name and where it begins: even rows are above, odd ones below.

    Names take turns, in as few rows as have room for them.
    """
    count = 2
    while count < len(widths):
        most = max(
            sum(widths[row::count]) + _APART * (len(widths[row::count]) - 1) for row in range(count)
        )
        if most <= wide:
            break
        count += 2
    placed: list[tuple[int, float]] = [(0, 0.0)] * len(widths)
    for row in range(min(count, len(widths))):
        own = range(row, len(widths), count)
        starts = spread([float(spots[at]) for at in own], [widths[at] for at in own], wide)
        for at, start in zip(own, starts, strict=True):
            placed[at] = row, start
    return placed


def spread(middles: Sequence[float], widths: Sequence[float], wide: float) -> list[float]:
    """Return where names in a row begin, near what they name and clear of one another.

    Each is pushed from the left as far as it must be, and from the right, and stands between.

    Examples
    --------
    >>> spread([10.0, 12.0, 90.0], [10.0, 10.0, 20.0], 100.0)
    [2.5, 17.5, 80.0]
    """
    starts = [middle - width / 2.0 for middle, width in zip(middles, widths, strict=True)]
    one = _pushed_left(_pushed_right(starts, widths), widths, wide)
    other = _pushed_right(_pushed_left(starts, widths, wide), widths)
    return [(left + right) / 2.0 for left, right in zip(one, other, strict=True)]


def _pushed_right(starts: Sequence[float], widths: Sequence[float]) -> list[float]:
    """Move names to the right where they are on the one before, or begin too far left."""
    moved, end = [], 0.0
    for start, width in zip(starts, widths, strict=True):
        moved.append(max(start, end))
        end = moved[-1] + width + _APART
    return moved


def _pushed_left(starts: Sequence[float], widths: Sequence[float], wide: float) -> list[float]:
    """Move names to the left where they are on the one behind, or end too far right."""
    back = _pushed_right(
        [wide - start - width for start, width in zip(starts[::-1], widths[::-1], strict=True)],
        widths[::-1],
    )
    return [wide - start - width for start, width in zip(back[::-1], widths, strict=True)]


def write_card(book: Book, card: Card, left: float, top: float) -> None:
    """Draw a card with its upper left corner at a place."""
    corner = np.array((left, top))
    for name in card.names:
        if name.met.over:
            _draw_strand(book, name, corner)
    book.line(card.outline + corner, width=0.8, closed=True, fill=_PIECE)
    for line in card.coming:
        book.line(line + corner, width=0.5, grey=0.6)
    for x, y, radius in (card.holes + np.append(corner, 0.0)).tolist():
        book.circle(x, y, radius)
    if not any(name.met.along_mm == 0.0 for name in card.names):
        x, y = (card.nought + corner).tolist()
        book.text(x, y - _MM_TEXT, "0", size=_MM_TEXT, align=0.5, grey=0.35)
    for name in card.names:
        if name.met.over is False:
            _draw_strand(book, name, corner)
    x, y = (card.tag + corner).tolist()
    book.tag(x, y, card.id, dark=True)
    draw_arrow(book, x + tag_size(card.id)[0] / 2.0 + 2.0, y, back=card.back)
    for name in card.names:
        book.line(name.lead + corner, width=0.5, grey=0.35)
    for name in card.names:
        x, y = (name.at + corner).tolist()
        if name.met.over is not None:
            book.sign(x, y, over=name.met.over)
        x, y = (name.name + corner).tolist()
        if name.met.complete:
            book.complete(x + name.met.wide - _COMPLETE / 2.0 + 1.0, y)
        for text, size, bold, grey in name.met.parts:
            book.text(x, y, text, size=size, bold=bold, grey=grey, middle=True)
            x += text_width(text, size, bold=bold)


def _draw_strand(book: Book, name: Named, corner: FloatArray) -> None:
    """Draw what crosses a piece."""
    book.line(name.strand + corner, width=0.5, grey=0.45, closed=True, fill=1.0)


def draw_arrow(book: Book, x: float, y: float, *, back: bool) -> None:
    """Draw the engraved arrow, which points along the thread."""
    tail, tip = (x + _ARROW - 6.0, x) if back else (x, x + _ARROW - 6.0)
    way = 4.0 if back else -4.0
    book.line([(tail, y), (tip, y)], width=0.9)
    book.line([(tip + way, y + 2.6), (tip, y), (tip + way, y - 2.6)], width=0.9)
