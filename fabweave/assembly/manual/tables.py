"""Write what each piece meets along its way, as it is engraved: to check it, or without engraving.

``stations.csv`` says the same with the numbers of crossings and distances, for programs.
"""

from collections.abc import Iterator, Mapping

from fabweave.assembly.manual.book import Book, text_width
from fabweave.flat.crossing_map import CrossingMap, JointRecord, PieceRecord

SECTION = "What each piece meets"
_INTRO = (
    "For each piece, along its arrow: a disc before each piece that it lies over, a ring before "
    "each that it runs under, and at its ends the joint and the piece that is joined there. The "
    "number after its name is the step in which it is placed."
)
#: Size of texts, distance of lines, between columns and of pieces, and the room of a sign.
_TEXT, _LINE, _GUTTER, _GAP, _SIGN = 9.5, 12.5, 18.0, 4.0, 8.0
_SPACE = 5.0


def write_tables(book: Book, crossing_map: CrossingMap) -> None:
    """Write for every piece what it meets, in two columns."""
    book.page(SECTION)
    book.y = book.block(book.left, book.y, _INTRO, book.right - book.left, size=_TEXT)
    wide = (book.right - book.left - _GUTTER) / 2
    step_of = {key: step.number for step in crossing_map.steps for key in step.pieces}
    joints = {joint.id: joint for joint in crossing_map.joints}
    top, column, y = book.y - 6.0, 0, book.y - 6.0
    for piece in crossing_map.pieces:
        head = f"{piece.id} ({step_of[piece.id]})"
        lines = _lines(list(_met(joints, piece)), wide, text_width(head, _TEXT, bold=True))
        if y - _LINE * len(lines) < book.foot:
            column, y = column + 1, top
            if column == 2:
                book.page(SECTION)
                column, top, y = 0, book.top - 6.0, book.top - 6.0
        x = book.left + column * (wide + _GUTTER)
        book.text(x, y - _LINE + 3.0, head, size=_TEXT, bold=True)
        for line in lines:
            y -= _LINE
            for at, over, text in line:
                if over is not None:
                    book.sign(x + at + 3.0, y + 6.4, over=over)
                book.text(x + at + (_SIGN if over is not None else 0.0), y + 3.0, text, size=_TEXT)
        y -= _GAP


def _met(
    joints: Mapping[int, JointRecord], piece: PieceRecord
) -> Iterator[tuple[bool | None, str]]:
    """Yield along a piece whether it lies over whom, and None with each joint."""
    first, last = (
        [(None, f"#{key}>{joints[key].mate(piece.id)}")] if key is not None else []
        for key in piece.joints
    )
    yield from first
    for station in piece.stations:
        yield station.over, station.partner
    yield from last


_Line = list[tuple[float, bool | None, str]]


def _lines(met: list[tuple[bool | None, str]], wide: float, head: float) -> list[_Line]:
    """Break what a piece meets into lines, the first one after its name, with places in them."""
    lines: list[_Line] = [[]]
    at = head + 2.0 * _SPACE
    for over, text in met:
        long = text_width(text, _TEXT) + (_SIGN if over is not None else 0.0)
        if at + long > wide and lines[-1]:
            lines.append([])
            at = 2.0 * _SPACE
        lines[-1].append((at, over, text))
        at += long + _SPACE
    return lines
