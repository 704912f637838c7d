"""Write how the feet of an object are tied to its base, with the board: after the last step."""

from fabweave.core.messages import agree
from fabweave.sheet.base_board import BaseBoard
from fabweave.sheet.drawing import Circle, Polyline
from fabweave.show.manual.book import SMALL, TEXT, Book

SECTION = "Base"
#: Arcs of the board are off by so much, millimetres; letters are lines so thick, points.
_FLAT_MM, _LETTER = 0.05, 0.4


def base_words(base: BaseBoard) -> str:
    """Return what is to be there for the base."""
    return (
        f"a board of {base.size}, 3 mm or thicker, with the holes of base.dxf, or drilled through "
        "base.pdf printed at 100 %; thin wire, pliers"
    )


def write_base(book: Book, base: BaseBoard) -> None:
    """Write the last step, and draw the board as it is seen from above."""
    book.page(SECTION)
    wide = book.right - book.left
    drawing = base.drawing
    feet = agree(len(base.names), "{n} [foot|feet]")
    text = (
        f"Last, tie {feet} to the board ({base.size}). The wire takes the place of the "
        "fastener. Stand the object on the board, front to front. At "
        "each foot lead a wire up through one hole, through the hole where the two strips cross "
        "whose names stand there, and down through the other hole. Draw it tight until the rim "
        "touches the board, or the foot is as high as the list says; twist its ends beneath. "
        "Begin with feet that are far apart."
    )
    book.y = book.block(book.left, book.y, text, wide, size=TEXT) - 8.0
    room = book.y - book.foot - 120.0
    scale = min(wide / drawing.width_mm, room / drawing.height_mm)
    left, low = book.left, book.y - scale * drawing.height_mm
    for one in drawing.pieces[0].entities:
        if isinstance(one, Circle):
            book.circle(left + scale * one.x, low + scale * one.y, scale * one.radius)
        elif isinstance(one, Polyline):
            points = scale * one.flattened(_FLAT_MM) + (left, low)
            book.line(points, closed=one.closed, width=_LETTER)
    book.y = low - 6.0
    high = zip(base.names, base.high_mm.tolist(), strict=True)
    told = "; ".join(f"{name}: {height:.0f} mm" for name, height in high)
    text = f"So high are the holes of the feet above the board: {told}."
    book.y = book.block(book.left, book.y, text, wide, size=SMALL)
