"""Write the crossing tables of the manual: each piece station by station."""

from fabweave.assembly.manual.book import SMALL, Book
from fabweave.assembly.stations import StationRow, piece_stations
from fabweave.flat.crossing_map import CrossingMap

SECTION = "Crossing tables"
_COLUMNS, _ROW, _HEAD, _GAP = 2, 11.5, 27.0, 9.0
#: Where the cells of a row begin, as shares of a column: station, crossing, distance, over or
#: under whom, joint with whom, step.
_STOPS = (0.0, 0.09, 0.24, 0.38, 0.62, 0.86)
_NAMES = ("st.", "crossing", "mm", "passes", "joint", "step")


def write_tables(book: Book, crossing_map: CrossingMap) -> None:
    """Write for every piece its stations, in columns."""
    book.page(SECTION)
    book.y = book.block(
        book.left,
        book.y,
        "For each piece, station by station along its arrow: the crossing, the distance from the "
        "first station, the piece that it passes over or under, the joint and the piece that is "
        "joined there, and the step in which the crossing is made.",
        book.right - book.left,
        size=SMALL,
    )
    wide = (book.right - book.left + 18.0) / _COLUMNS
    top, column, y = book.y - 6.0, 0, book.y - 6.0
    for key, rows in piece_stations(crossing_map).items():
        left = list(rows)
        while left:
            fits = int((y - book.foot - _HEAD) / _ROW)
            # A table is cut only if it is longer than a whole column.
            if fits < min(len(left), int((top - book.foot - _HEAD) / _ROW)):
                column, y = column + 1, top
                if column == _COLUMNS:
                    book.page(SECTION)
                    column, top, y = 0, book.top - 6.0, book.top - 6.0
                continue
            here, left = left[:fits], left[fits:]
            _write_table(book, book.left + column * wide, y, wide - 18.0, key, here)
            y -= _HEAD + _ROW * len(here) + _GAP


def _write_table(
    book: Book, x: float, y: float, wide: float, key: str, rows: list[StationRow]
) -> None:
    """Write stations of one piece."""
    y -= 12.0
    book.text(x, y, f"Piece {key}", size=11.0, bold=True)
    y -= 11.0
    for stop, name in zip(_STOPS, _NAMES, strict=True):
        book.text(x + stop * wide, y, name, size=SMALL, grey=0.35)
    book.line([(x, y - 2.5), (x + wide, y - 2.5)], width=0.4)
    for row in rows:
        y -= _ROW
        for stop, cell in zip(_STOPS, row_cells(row), strict=True):
            book.text(x + stop * wide, y, cell, size=SMALL)


def row_cells(row: StationRow) -> tuple[str, ...]:
    """Return the cells of a station as they are printed; - is nothing.

    Examples
    --------
    >>> row_cells(StationRow("A1", 0, 14, 0.0, "under", "E3", 2, 4, "A4", 4.1, 7))
    ('0', '14', '0.0', 'under E3', '#4 A4', '7')
    """
    joint = "-" if row.joint is None else f"#{row.joint} {row.mate}"
    return (
        str(row.station),
        str(row.crossing),
        f"{row.distance_mm:.1f}",
        f"{row.lies} {row.partner}",
        joint,
        str(row.step),
    )
