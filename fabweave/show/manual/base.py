"""Write how the feet of an object are tied to its base, with the board: after the last step."""

import numpy as np

from fabweave.core.messages import agree
from fabweave.sheet.base_board import BaseBoard
from fabweave.sheet.drawing import Circle, Layer
from fabweave.show.manual.book import SMALL, TEXT, Book

SECTION = "Base"
#: Arcs of the board are off by so much, millimetres; lines are so thick, and numbers stand so far
#: from holes, points.
_FLAT_MM, _LINE, _BESIDE = 0.05, 0.4, 7.0


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
        f"Last, tie {feet} to the board ({base.size}). The wire takes the place of the fastener. "
        "Stand the object on the board, front to front. At each foot lead a wire up through one "
        "hole, through the hole where its two strips cross, and down through the other hole. Draw "
        "it tight until the rim touches the board, or the foot is as high as the list says; twist "
        "its ends beneath. Begin with feet that are far apart."
    )
    book.y = book.block(book.left, book.y, text, wide, size=TEXT) - 8.0
    # The board bears the names of strips, which are too small here: numbers go around instead.
    entities = drawing.pieces[0].entities
    holes = np.array([(one.x, one.y) for one in entities if isinstance(one, Circle)])
    outer, inner = holes.reshape(-1, 2, 2).transpose(1, 0, 2)
    feet_at, way = (outer + inner) / 2.0, outer - inner
    around = feet_at - feet_at.mean(axis=0)
    order = np.argsort(np.arctan2(around[:, 0], around[:, 1]), kind="stable")
    told = "; ".join(
        f"{number} {base.names[at]}: {base.high_mm[at]:.0f} mm"
        for number, at in enumerate(order.tolist(), start=1)
    )
    text = f"Feet, their strips, and how high their holes are above the board: {told}."
    book.y = book.block(book.left, book.y, text, wide, size=SMALL) - 8.0
    room = book.y - book.foot - 2.0 * TEXT
    scale = min(wide / drawing.width_mm, room / drawing.height_mm)
    left, low = book.left, book.y - scale * drawing.height_mm
    for one in entities:
        if isinstance(one, Circle):
            book.circle(left + scale * one.x, low + scale * one.y, scale * one.radius)
        elif one.layer is not Layer.ENGRAVE_LABEL:
            points = scale * one.flattened(_FLAT_MM) + (left, low)
            book.line(points, closed=one.closed, width=_LINE)
    way = way / np.hypot(*way.T)[:, None]
    beyond = scale * base.hole_mm / 2.0 + _BESIDE
    for number, at in enumerate(order.tolist(), start=1):
        x, y = (left, low) + scale * outer[at] + beyond * way[at]
        book.text(x, y - SMALL / 3.0, str(number), size=SMALL, bold=True, align=0.5)
    book.text(left + scale * drawing.width_mm / 2.0, low - TEXT, "front", size=TEXT, align=0.5)
