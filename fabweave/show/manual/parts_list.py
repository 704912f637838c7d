"""Draw the parts list of the manual: each kind of piece once, and where its pieces lie."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.messages import agree
from fabweave.plan.crossing_map import CrossingMap, PieceRecord
from fabweave.sheet.drawing import SheetDrawing
from fabweave.show.manual.book import LEADING, SMALL, Book, text_width, wrapped
from fabweave.show.manual.sheets import DrawnPiece, drawn_pieces, levelling

PARTS = "Parts list"
#: Cells of the parts list: at most so many in a row, the space below a piece for two lines of text,
#: and that beside it.
_COLUMNS, _TEXTS, _BESIDE = 3, 40.0, 14.0
#: Height of what is said above them.
_INTRODUCED = 50.0
_SPARES = (
    " A spare, such as A1S1, is one more of the kind of A1: put it in the place of any piece of "
    "that kind that breaks."
)


def write_parts(book: Book, crossing_map: CrossingMap, drawings: Sequence[SheetDrawing]) -> None:
    """Write the parts list: each kind of piece to one scale, with its length, stations and places.

    Pieces of which only one is cut are called by their id, and their place is told; of others the
    ids stand by sheet, those of spares among them.
    """
    drawn = drawn_pieces(*drawings)
    kinds: dict[int, list[PieceRecord]] = {}
    for piece in crossing_map.to_cut:
        kinds.setdefault(piece.kind, []).append(piece)
    parts = list(kinds.values())
    own, spares = {piece.id for piece in crossing_map.pieces}, len(crossing_map.spares or ())
    outlines = [drawn[pieces[0].id].outline for pieces in parts]
    level = [outline @ levelling(outline) for outline in outlines]
    names = {sheet.sheet: sheet.name for sheet in crossing_map.sheets}
    told = [_places(pieces, names, drawn) for pieces in parts]
    book.page(PARTS)
    # Few kinds are drawn large: in as few columns as a page has room for.
    for columns in range(1, _COLUMNS + 1):
        cells = _cells(book, level, told, columns)
        if sum(cells.heights) <= book.y - book.foot - _INTRODUCED:
            break
    if max(cells.heights) > book.top - book.foot:
        # Only what stands alone in its row can go on over pages.
        cells = _cells(book, level, told, 1)
    book.y = book.block(
        book.left,
        book.y,
        agree(len(own), "{n} [piece|pieces]")
        + (agree(spares, " and {n} spare[|s]") if spares else "")
        + agree(len(parts), " of {n} [kind|kinds], engraved face up, drawn at a scale of")
        + f" 1 : {72.0 / 25.4 / cells.scale:.1f}. Pieces of one kind are cut alike: they are drawn "
        "once, and their ids stand by sheet. Where there is only one, its place is that of its "
        "middle on the sheet, in mm from the left edge and from the lower edge."
        + (_SPARES if spares else ""),
        book.right - book.left,
        size=SMALL,
    )
    book.y -= 8.0
    for number, row in enumerate(cells.rows):
        book.room(cells.heights[number], PARTS)
        low = book.y - cells.heights[number]
        for column, at in enumerate(row):
            points, piece, count = level[at], parts[at][0], len(parts[at])
            wanted = sum(one.id in own for one in parts[at])
            more = agree(count - wanted, " and {n} spare[|s]") if count > wanted else ""
            x = book.left + column * cells.width
            y = book.y - cells.highs[number]
            shift = np.array([x, y]) - points.min(axis=0) * cells.scale
            book.line(points * cells.scale + shift, width=0.6, closed=True, fill=0.9)
            y -= 13.0
            key = piece.id if count == 1 else f"Kind {piece.kind}"
            book.text(x, y, key, size=12.0, bold=True)
            book.text(
                x + text_width(key, 12.0, bold=True) + 6.0,
                y,
                ("" if count == 1 else f"x {wanted}{more}: ")
                + f"{np.ptp(points[:, 0]):.0f} mm, "
                + agree(len(piece.stations), "{n} [station|stations]"),
                size=SMALL,
            )
            for line in cells.places[at]:
                y -= LEADING * SMALL
                if y < book.foot:
                    book.page(PARTS)
                    y = book.y - SMALL
                    low = book.foot
                book.text(x, y, line, size=SMALL)
        book.y = low


class _Cells(NamedTuple):
    """How the parts list is laid out.

    ``width`` is that of a cell in points, and ``scale`` points for a millimetre of a piece; there
    are ``rows`` of parts, ``places`` are the lines below each part, ``highs`` and ``heights`` those
    of the pieces of each row, and of all of it.
    """

    width: float
    scale: float
    rows: tuple[range, ...]
    places: tuple[list[str], ...]
    highs: tuple[float, ...]
    heights: tuple[float, ...]


def _cells(
    book: Book, level: Sequence[FloatArray], told: Sequence[Sequence[str]], columns: int
) -> _Cells:
    """Lay parts with these outlines and texts out in columns."""
    width = (book.right - book.left) / columns
    scale = (width - _BESIDE) / max(float(np.ptp(points[:, 0])) for points in level)
    rows = tuple(
        range(first, min(first + columns, len(level))) for first in range(0, len(level), columns)
    )
    places = tuple(
        [line for text in texts for line in wrapped(text, SMALL, width - _BESIDE)] for texts in told
    )
    highs = tuple(max(float(np.ptp(level[at][:, 1])) for at in row) * scale for row in rows)
    heights = tuple(
        high + _TEXTS + LEADING * SMALL * (max(len(places[at]) for at in row) - 1)
        for high, row in zip(highs, rows, strict=True)
    )
    return _Cells(width, scale, rows, places, highs, heights)


def _places(
    pieces: Sequence[PieceRecord], names: Mapping[int, str], drawn: Mapping[str, DrawnPiece]
) -> list[str]:
    """Say where pieces of one kind are: their ids sheet by sheet, or the place of the only one."""
    if len(pieces) == 1:
        across, up = drawn[pieces[0].id].middle.tolist()
        return [f"{names[pieces[0].sheet]} at {across:.0f}, {up:.0f}"]
    by_sheet: dict[int, list[str]] = {}
    for piece in pieces:
        by_sheet.setdefault(piece.sheet, []).append(piece.id)
    return [f"{names[sheet]}: {' '.join(by_sheet[sheet])}" for sheet in sorted(by_sheet)]
