"""Draw the map of the manual: each thread as a band with its pieces, joints and what crosses it."""

from collections.abc import Mapping
from itertools import groupby
from typing import TypeAlias

from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
from fabweave.plan.crossing_map import CrossingMap, PieceRecord, StationRecord, ThreadRecord
from fabweave.show.manual.book import LEADING, SMALL, Book, text_width, wrapped

MAP = "Threads and their pieces"
_INTRO = (
    "Each thread is drawn as a band in the colours that it has on the cover. Above the band "
    "are its pieces, with a line at each joint (#) between them; below it are the pieces that "
    "cross it, each strand drawn, with a disc where the thread goes over and a ring where it "
    "goes under, as on the pieces. A closed thread ends with the joint at which it began. Beside "
    "the name of the thread is the step in which each piece is placed."
)
#: Least and greatest distance of crossings along a band, in points, and the band's half width.
_PITCH, _WIDEST, _HALF = 9.9, 16.0, 4.5
#: Above the middle of a band stand its pieces, then its joints; below it signs, then partners.
_PIECES_UP, _JOINTS_UP, _SIGNS_DOWN, _PARTNERS_DOWN = 14.5, 23.5, 11.5, 15.5
#: The least size of a name that has little room, in points.
_LEAST = 8.0
#: Height of a thread's heading, of what is above and below a band, and half the width of a strand
#: that crosses it.
_HEAD, _ABOVE, _BELOW, _STRAND = 14.0, 34.0, 36.0, 1.9


#: A crossing on the way along a thread as one of its pieces sees it, and which piece.
_Stop: TypeAlias = tuple[StationRecord, str]


def thread_stops(thread: ThreadRecord, pieces: Mapping[str, PieceRecord]) -> list[_Stop]:
    """Return the crossings of a thread in order, those of joints once.

    A closed thread ends with the joint at which it began.

    Parameters
    ----------
    thread : ThreadRecord
    pieces : mapping from id to PieceRecord
        All pieces.
    """
    stops: list[_Stop] = []
    for key in thread.pieces:
        piece = pieces[key]
        shared = 1 if stops and piece.joints[0] is not None else 0
        stops += [(station, key) for station in piece.stations[shared:]]
    return stops


def write_map(book: Book, crossing_map: CrossingMap, colours: Colours) -> None:
    """Draw each thread as a band in its colours, with its pieces, joints and what crosses it."""
    book.page(MAP)
    book.y = book.block(book.left, book.y, _INTRO, book.right - book.left, size=SMALL)
    pieces = {piece.id: piece for piece in crossing_map.pieces}
    step_of = {key: step.step for step in crossing_map.steps for key in step.pieces}
    wide = book.right - book.left
    per_row = int(wide / _PITCH) - 1
    for thread in crossing_map.threads:
        stops = thread_stops(thread, pieces)
        name = f"Thread {thread.label}"
        figures = "ring" if thread.closed else "open"
        figures += agree(len(thread.pieces), ", {n} [piece|pieces]")
        figures += agree(len(set(thread.crossings)), ", {n} [crossing|crossings]")
        steps = ", ".join(f"{key} {step_of[key]}" for key in thread.pieces)
        beside = text_width(name, 12.0, bold=True) + 8.0
        lines = wrapped(f"{figures}; steps: {steps}", SMALL, wide - beside)
        book.room(_HEAD + LEADING * SMALL * (len(lines) - 1) + _ABOVE + _BELOW, MAP)
        book.y -= _HEAD
        book.text(book.left, book.y, name, size=12.0, bold=True)
        for number, line in enumerate(lines):
            book.y -= LEADING * SMALL if number else 0.0
            book.text(book.left + beside, book.y, line, size=SMALL)
        pitch = max(_PITCH, min(_WIDEST, wide / (len(stops) + 1)))
        start = 0
        while start < len(stops):
            end = _row_end(stops, start, per_row)
            book.room(_ABOVE + _BELOW, MAP)
            book.y -= _ABOVE
            _write_row(book, stops[start:end], pitch, colours)
            book.y -= _BELOW
            start = end


def _row_end(stops: list[_Stop], start: int, most: int) -> int:
    """Return where a row ends: at a joint if there is one, so that pieces stay whole."""
    end = min(start + most, len(stops))
    if end == len(stops):
        return end
    joints = (at + 1 for at in range(end - 1, start, -1) if stops[at][0].joint is not None)
    return next(joints, end)


def _write_row(book: Book, stops: list[_Stop], pitch: float, colours: Colours) -> None:
    """Draw a part of a thread; the middle of its band is where the book stands."""
    y = book.y
    places = [book.left + (number + 1) * pitch for number in range(len(stops))]
    for x, (stop, _) in zip(places, stops, strict=True):
        if stop.over:
            _strand(book, x, y)
    halves = [tuple(part) for stop, _ in stops for part in colours[stop.crossing, int(stop.over)]]
    left = book.left + pitch / 2
    for colour, run in groupby(halves):
        wide = len(list(run)) * pitch / 2
        book.area(left, y - _HALF, wide, 2 * _HALF, colour)
        left += wide
    for x, (stop, _) in zip(places, stops, strict=True):
        if not stop.over:
            _strand(book, x, y)
        if stop.joint is not None:
            book.line([(x, y - _HALF - 1.0), (x, y + _JOINTS_UP - 2.0)], width=1.3)
            book.text(x, y + _JOINTS_UP, f"#{stop.joint}", size=SMALL, align=0.5)
        book.sign(x, y - _SIGNS_DOWN, over=stop.over)
        low = y - _PARTNERS_DOWN
        book.text(x, low, stop.partner, size=SMALL, align=1.0, angle_deg=90.0, middle=True)
    first = 0
    for at in range(1, len(stops) + 1):
        if at == len(stops) or stops[at][1] != stops[first][1]:
            # From the joint where the piece begins, which is the stop before, to its last stop.
            left = places[first] - pitch if first else places[0]
            _name_piece(book, stops[first][1], left, places[at - 1], y + _PIECES_UP)
            first = at


def _name_piece(book: Book, key: str, left: float, right: float, y: float) -> None:
    """Write the id of a piece above the middle of what is seen of it, in its room."""
    room = max(right - left, _PITCH) - 3.0
    size = min(10.0, max(_LEAST, 10.0 * room / text_width(key, 10.0, bold=True)))
    book.text((left + right) / 2, y - _PIECES_UP + 6.5, key, size=size, bold=True, align=0.5)


def _strand(book: Book, x: float, y: float) -> None:
    """Draw the strand that crosses a band."""
    book.box(x - _STRAND, y - _HALF - 3.5, 2 * _STRAND, 2 * _HALF + 5.0, width=0.5, fill=1.0)
