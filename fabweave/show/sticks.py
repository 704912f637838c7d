"""Draw story sticks: tapes at full size with all marks of straight strips, to lay beside them."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from math import ceil

import numpy as np
import shapely

from fabweave.core.arc_path import Path
from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.messages import agree
from fabweave.core.units import unit_mm
from fabweave.plan.crossing_map import CrossingMap, JointRecord
from fabweave.plan.sticks import Stick, StickMark, station_of, story_sticks
from fabweave.show.manual.book import MARGIN, SMALL, Book, text_width
from fabweave.show.manual.cards import draw_arrow, spread

_TITLE = "Story sticks"
_POINTS = 72.0 / 25.4
#: Width and height of the papers, in whole points: some programs fit other pages to such a size,
#: and shrink them. A roll is as wide as that of most plotters, and no page of a PDF is longer than
#: so many points.
PAPERS = {"a4": (842.0, 595.0), "letter": (792.0, 612.0), "a3": (1191.0, 842.0)}
_ROLL_HIGH, _LONGEST = 1684.0, 14_400.0
#: So much of a tape is glued under the next one.
LAP_MM = 10.0
#: Tapes part so far from marks, where there is room.
_CLEAR_MM = 6.0
#: A tape is at least so high, and of wider strips than that it shows the middle; its lines stand
#: out so far beside a strip that is laid on it.
_LEAST_HIGH_MM, _MOST_HIGH_MM, _BEYOND_MM = 8.0, 100.0, 1.5
#: All else is in points. An upright text is so wide; a line leads from a mark to what is written
#: of it; rows of names stand below, with so much between two names, as ``spread`` has it.
_UPRIGHT, _LEAD, _ROW, _APART = 6.0, 8.0, 12.0, 5.0
_HEAD, _BETWEEN, _ARROW, _SIGN = 20.0, 14.0, 16.0, 8.0
#: Rulers at the foot of a page: how high they stand, and their lengths in mm and in inches.
_FOOT, _RULES_MM, _RULES_IN = 36.0, (0, 100, 250), (0, 4)
#: What else stands on a page takes so much.
_ELSE = 220.0
#: Arcs are drawn as chords that are so near.
_FLAT_MM = 0.01

_HOW = (
    "A tape shows a strip at full size, its outer face up, from its start at the left. Lay the "
    "strip on its outline, or cut the tape out and lay it on the strip. Mark the strip at each "
    "line, cut it at the thick ones, punch or drill at each cross, and write its name on it. Over "
    "a line stands how far it is from the start in mm, and the diameter of a hole; up is how far "
    "that is from the lower edge. A disc: the strip goes over there. A ring: it goes under. Below "
    "stands who is met there, piece by piece, and #4>B2 for joint 4 with B2. Where the arrow "
    "before a piece points to the left, its start is at the right end of the tape. To glue lengths "
    "of a tape together, cut the next one off at its dashed line, and lay it on the grey end of "
    "the one before, up to the dashed line there."
)


@frozen_value
class Tape:
    """A length of a stick that is printed in one.

    Parameters
    ----------
    stick : Stick
    number, count : int
        Which one of how many, from 1.
    start_mm, end_mm : float
        What it shows of the strip, but for what is glued under the next one.
    room : float
        How wide it may be, in points.
    """

    stick: Stick
    number: int
    count: int
    start_mm: float
    end_mm: float
    room: float

    @property
    def shown_mm(self) -> float:
        """Where it ends, with what is glued under the next one."""
        return self.end_mm + (LAP_MM if self.number < self.count else 0.0)

    @property
    def high_mm(self) -> float:
        """How much it shows across the strip."""
        return min(self.stick.width_mm, _MOST_HIGH_MM)

    @property
    def whole(self) -> bool:
        """Whether it is as wide as the strip."""
        return self.stick.width_mm <= _MOST_HIGH_MM

    @property
    def joins(self) -> list[tuple[float, int]]:
        """Where it meets others: the place along the strip, and the number of the join."""
        before = [(self.start_mm, self.number - 1)] * (self.number > 1)
        return before + [(self.end_mm, self.number)] * (self.number < self.count)

    @property
    def tall(self) -> float:
        """How tall its lines are, in points."""
        return max(self.high_mm + 2.0 * _BEYOND_MM, _LEAST_HIGH_MM) * _POINTS

    @cached_property
    def marks(self) -> list[StickMark]:
        """Its own marks."""
        first, last = self.number == 1, self.number == self.count
        return [
            mark
            for mark in self.stick.marks
            if (first or mark.along_mm >= self.start_mm) and (last or mark.along_mm < self.end_mm)
        ]

    @property
    def stations(self) -> list[StickMark]:
        """Those of its marks where others are met."""
        return [mark for mark in self.marks if mark.what in ("crossing", "joint")]

    @cached_property
    def labels(self) -> list[tuple[float, str]]:
        """What stands over it: where, and what."""
        found = [(mark.along_mm, _told(mark)) for mark in self.marks]
        found += [(at, f"{at:.2f} join {self.stick.kind}.{number}") for at, number in self.joins]
        return sorted(found)

    @property
    def label_high(self) -> float:
        """How much room its labels take."""
        return max((text_width(text, SMALL) for _, text in self.labels), default=0.0)

    def high(self, rows: "_Rows") -> float:
        """Return how high it is with all that belongs to it."""
        below = rows.high * len(rows.cells) + _BETWEEN
        return _HEAD + self.label_high + 2.0 * _LEAD + self.tall + below


@frozen_value
class _Rows:
    """What stands below a tape: rows of names, a column for each station, in points.

    Parameters
    ----------
    cells : tuple of tuple of str
        The numbers of the stations, and piece by piece who is met there.
    upright : bool
        Whether there is room only for names that stand upright.
    wide : tuple of float
        The widths of the columns.
    high : float
        The height of a row.
    """

    cells: tuple[tuple[str, ...], ...]
    upright: bool
    wide: tuple[float, ...]
    high: float


def sticks_pdf(crossing_map: CrossingMap, title: str, paper: str) -> bytes:
    """Return the story sticks of a map whose pieces are straight as a PDF.

    Parameters
    ----------
    crossing_map : CrossingMap
    title : str
    paper : str
        ``a4``, ``letter`` or ``a3``, on its side; ``roll`` for pages as long as the longest tape.
    """
    sticks, joints = story_sticks(crossing_map), {one.id: one for one in crossing_map.joints}
    names = [text_width(piece.id, SMALL, bold=True) for piece in crossing_map.pieces]
    gutter = max(names, default=0.0) + _ARROW + _APART
    border = 2.0 * MARGIN + gutter
    longest = max((stick.length_mm for stick in sticks), default=0.0) * _POINTS
    wide = min(ceil(longest + border), _LONGEST) if paper == "roll" else PAPERS[paper][0]
    tapes = [tape for stick in sticks for tape in _tapes(stick, wide - border)]
    high = sum(tape.high(_rows(tape, joints)) for tape in tapes) if paper == "roll" else 0.0
    size = max(wide, PAPERS["a4"][0]), min(ceil(high + _ELSE), _ROLL_HIGH)
    book = Book(size if paper == "roll" else PAPERS[paper], title, full_size=True)
    book.foot += _FOOT
    _page(book)
    book.y = book.block(book.left, book.y, _HOW, min(book.right - book.left, 760.0)) - _BETWEEN
    for tape in tapes:
        rows = _rows(tape, joints)
        high = tape.high(rows)
        if high > book.top - book.foot:  # its rows go on on the next page
            high -= rows.high * (len(rows.cells) - 2)
        if book.y - high < book.foot and book.y < book.top:
            _page(book)
        _draw(book, tape, gutter)
        _write(book, tape, gutter, rows)
    return book.finish()


def lengths(places: Sequence[float], room_mm: float) -> list[tuple[float, float]]:
    """Return where tapes begin and end that show a strip together, each in so much room.

    They part where no mark is near, and where one is glued on another, that has to have room for
    it.

    Parameters
    ----------
    places : sequence of float
        Of all marks, from the start of the strip to its end, in order.
    room_mm : float

    Examples
    --------
    >>> lengths([0.0, 30.0, 60.0, 100.0], 70.0)
    [(0.0, 54.0), (54.0, 100.0)]
    """
    marks, stops = np.array(places), [0.0]
    middles = (marks[1:] + marks[:-1]) / 2.0
    while places[-1] - stops[-1] > room_mm:
        reach = stops[-1] + room_mm - LAP_MM
        spots = np.concatenate(([reach], middles, marks - _CLEAR_MM))
        spots = spots[(spots > (stops[-1] + reach) / 2.0) & (spots <= reach)]
        clear = np.abs(spots[:, None] - marks).min(axis=1).clip(max=_CLEAR_MM)
        stops.append(float(spots[np.lexsort((spots, clear))[-1]]))
    return list(zip(stops, [*stops[1:], places[-1]], strict=True))


def _size(upright: float) -> float:
    """Return the size of upright text that has so much room."""
    return SMALL * (upright + _APART) / (_UPRIGHT + _APART)


def _tapes(stick: Stick, room: float) -> list[Tape]:
    """Return the tapes of a stick."""
    places = np.clip([mark.along_mm for mark in stick.marks], 0.0, stick.length_mm).tolist()
    parts = lengths(places, room / _POINTS)
    return [Tape(stick, at, len(parts), *part, room) for at, part in enumerate(parts, start=1)]


def _rows(tape: Tape, joints: Mapping[int, JointRecord]) -> _Rows:
    """Return what stands below a tape."""
    stations = [mark.station for mark in tape.stations if mark.station is not None]
    cells = [tuple(map(str, stations))]
    for piece in tape.stick.pieces:
        met = [piece.stations[station_of(piece, at)] for at in stations]
        cells.append(
            tuple(
                one.partner
                + ("" if one.joint is None else f" #{one.joint}>{joints[one.joint].mate(piece.id)}")
                for one in met
            )
        )
    wide = [
        max(
            _SIGN * (not row) + text_width(text, SMALL, bold=not row)
            for row, text in enumerate(column)
        )
        for column in zip(*cells, strict=True)
    ]
    upright = sum(wide) + _APART * (len(wide) - 1) > tape.room
    high = max(wide) + _APART if upright else _ROW
    columns = _upright(len(wide), tape.room) if upright else tuple(wide)
    return _Rows(tuple(cells), upright, columns, high)


def _upright(count: int, room: float) -> tuple[float, ...]:
    """Return how wide upright texts are to be, which are smaller where they have little room."""
    return (min(_UPRIGHT, max(room / max(count, 1) - _APART, 0.0)),) * count


def _told(mark: StickMark) -> str:
    """Return what stands over a mark."""
    words = [f"{mark.along_mm:.2f}"]
    if mark.what == "hole":
        words.append(f"up {mark.across_mm:.2f}")
    if mark.what in ("cut", "slot"):
        words.append(mark.what)
    if mark.hole_mm is not None:
        words.append(f"Ø {mark.hole_mm:g}")
    return "  ".join(words)


def _page(book: Book) -> None:
    """Begin a page, with rulers at its foot that show whether it is printed at full size."""
    book.page(_TITLE)
    inch = unit_mm("in")
    for y, numbers, unit, step in ((18.0, _RULES_MM, 1.0, "mm"), (0.0, _RULES_IN, inch, "in")):
        places = [book.left + number * unit * _POINTS for number in numbers]
        book.line([(places[0], MARGIN + y), (places[-1], MARGIN + y)], width=0.6)
        for place, number in zip(places, numbers, strict=True):
            book.line([(place, MARGIN + y), (place, MARGIN + y + 8.0)], width=0.6)
            if number:
                text = f"{number} {step}"
                book.text(place - 3.0, MARGIN + y + 2.5, text, size=SMALL, align=1.0)
    told = "Print at 100 %. Measure these before use."
    book.text(places[-1] + 12.0, MARGIN, told, bold=True)


def _draw(book: Book, tape: Tape, gutter: float) -> None:
    """Draw a tape below what is on the page, and what stands over it."""
    stick, left = tape.stick, book.left + gutter
    _head(book, tape)
    top = book.y - _HEAD - tape.label_high - _LEAD
    low, middle = top - tape.tall, top - tape.tall / 2.0

    def at(points: FloatArray) -> FloatArray:
        shift = np.array([tape.start_mm, stick.width_mm / 2.0])
        return np.asarray((points - shift) * _POINTS + (left, middle))

    def x(along_mm: float) -> float:
        return left + (along_mm - tape.start_mm) * _POINTS

    if tape.shown_mm > tape.end_mm:
        book.box(x(tape.end_mm), low, LAP_MM * _POINTS, tape.tall, width=0.0, fill=0.88)
    piece = stick.pieces[0]
    rings = [np.array(piece.outline)]
    for path in (np.array(one.path) for one in piece.cutouts if one.path is not None):
        rings.append(Path(path[:, :2], path[:, 2]).flattened(_FLAT_MM))
    corner = rings[0].min(axis=0)
    # What lies on the border of a window is not in it.
    beyond = 0.5 * np.array([tape.number == 1, tape.whole, tape.number == tape.count, tape.whole])
    edge_mm = (stick.width_mm - tape.high_mm) / 2.0
    window = np.array([tape.start_mm, edge_mm, tape.shown_mm, edge_mm + tape.high_mm])
    window += beyond * (-1.0, -1.0, 1.0, 1.0)
    for ring in rings:
        closed = shapely.LineString(np.concatenate((ring, ring[:1])) - corner)
        for line in shapely.get_parts(shapely.clip_by_rect(closed, *window.tolist())):
            book.line(at(shapely.get_coordinates(line)))
    under = [mark for mark in stick.marks if tape.end_mm <= mark.along_mm < tape.shown_mm]
    for mark in tape.marks + under:
        if abs(mark.across_mm - stick.width_mm / 2.0) <= tape.high_mm / 2.0:
            _mark(book, mark, at(np.array([mark.along_mm, mark.across_mm])), (low, top))
    for stop_mm, _ in tape.joins:
        book.line([(x(stop_mm), low), (x(stop_mm), top)], width=1.0, dash=(6.0, 2.0))

    spots = [(along - tape.start_mm) * _POINTS for along, _ in tape.labels]
    wide = _upright(len(spots), tape.room)
    starts, size = spread(spots, wide, tape.room), _size(wide[0])
    for spot, start, (_, text) in zip(spots, starts, tape.labels, strict=True):
        there = left + start + wide[0] / 2.0
        book.line([(left + spot, top), (there, top + _LEAD - 2.0)], grey=0.5, width=0.3)
        book.text(there, top + _LEAD, text, size=size, angle_deg=90.0, middle=True)
    book.y = low


def _head(book: Book, tape: Tape) -> None:
    """Say of which kind a tape is."""
    stick, inch = tape.stick, unit_mm("in")
    name = f"Kind {stick.kind}"
    if tape.count > 1:
        name += f", length {tape.number} of {tape.count}"
    book.text(book.left, book.y - 12.0, name, size=12.0, bold=True)
    length, width = stick.length_mm, stick.width_mm
    told = agree(len(stick.pieces) + len(stick.spares), "{n} strip[|s]") + (
        f", {length:.2f} × {width:.2f} mm ({length / inch:.3f} × {width / inch:.3f} in)"
    )
    if stick.spares:
        told += f", with {' '.join(stick.spares)} to spare"
    book.text(book.left + text_width(name, 12.0, bold=True) + 8.0, book.y - 12.0, told)


def _mark(book: Book, mark: StickMark, spot: FloatArray, ends: tuple[float, float]) -> None:
    """Draw a mark: a line across the tape, a cross, and a hole."""
    x, y = spot.tolist()
    if mark.what == "cut":
        book.line([(x, ends[0]), (x, ends[1])], width=1.4)
    elif mark.what in ("crossing", "joint"):
        book.line([(x, ends[0]), (x, ends[1])], width=0.7)
    if mark.hole_mm is not None:
        arm = (mark.hole_mm / 2.0 + 1.5) * _POINTS
        book.line([(x - arm, y), (x + arm, y)])
        book.circle(x, y, mark.hole_mm / 2.0 * _POINTS)
        if mark.what == "hole":
            book.line([(x, y - arm), (x, y + arm)])


def _write(book: Book, tape: Tape, gutter: float, rows: _Rows) -> None:
    """Write below a tape its stations, and piece by piece who is met there."""
    left, angle_deg = book.left + gutter, 90.0 if rows.upright else 0.0
    spots = [(mark.along_mm - tape.start_mm) * _POINTS for mark in tape.stations]
    starts = spread(spots, rows.wide, tape.room)
    middles = [left + start + one / 2.0 for start, one in zip(starts, rows.wide, strict=True)]
    for spot, middle in zip(spots, middles, strict=True):
        book.line([(left + spot, book.y), (middle, book.y - _LEAD + 2.0)], grey=0.5, width=0.3)
    book.y -= _LEAD
    size = _size(rows.wide[0]) if rows.upright else SMALL

    def write(cells: Sequence[str], *, head: bool) -> None:
        book.y -= rows.high
        for middle, text, mark in zip(middles, cells, tape.stations, strict=True):
            shift = _SIGN if head else 0.0
            begin = 0.0 if rows.upright else -(text_width(text, SMALL, bold=head) + shift) / 2.0
            way, lift = (np.array((0.0, 1.0)), 0.0) if rows.upright else (np.array((1.0, 0.0)), 3.4)
            place = np.array((middle, book.y + lift))
            if head:
                book.sign(*(place + (begin + 2.7) * way).tolist(), over=bool(mark.over))
            x, y = (place + (begin + shift) * way).tolist()
            book.text(x, y, text, size=size, bold=head, angle_deg=angle_deg, middle=True)

    write(rows.cells[0], head=True)
    for piece, cells in zip(tape.stick.pieces, rows.cells[1:], strict=True):
        if book.y - rows.high < book.foot:
            _page(book)
            write(rows.cells[0], head=True)
        write(cells, head=False)
        y = book.y + 0.36 * SMALL
        draw_arrow(book, book.left, y, back=bool(piece.turned))
        book.text(book.left + _ARROW, book.y, piece.id, size=SMALL, bold=True)
    book.y -= _BETWEEN
