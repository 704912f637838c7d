"""Write the cover of the manual: the object, what is needed on the table, and how to proceed."""

import io
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from PIL import Image

from fabweave.core.arrays import frozen_value
from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
from fabweave.piece.joint.kinds import KINDS
from fabweave.plan.bill_of_materials import BillOfMaterials, buy_lines, set_with
from fabweave.plan.crossing_map import CrossingMap
from fabweave.show.manual.book import LEADING, TEXT, Book, text_width, wrapped
from fabweave.show.manual.painting import packed
from fabweave.show.manual.parts_list import bags_of
from fabweave.show.paper_limits import MOST_VIEWED

COVER = "Overview"
#: The parts of the cover below what is said of the object.
TABLE, PROCEED = "On the table", "How to proceed"
#: Size of their heads, and room below each line.
_HEAD, _BELOW = 12.0, 4.0
_VIEWER = " assembly.html shows the same steps on an object that you can turn and zoom."


@frozen_value
class Facts:
    """What the manual says about a job besides its crossing map.

    Parameters
    ----------
    title : str
        Name of the object.
    buildable : str
        Whether it can be built, and what wants care.
    form : str
        What becomes of its form when it is let go; empty if that is not known.
    building : str
        How it springs while it is built; empty if that is not known.
    size_mm : tuple of float
        Its extents along x, y, z.
    material : str
        In words, with its thickness.
    bill : BillOfMaterials
        What is bought besides sheets.
    colours : (X, 2, 2, 3) uint8 array
        The colours of each crossing's strands in the pictures, of the one below and of the one
        above: as it comes, and as it leaves.
    portrait : bytes
        The picture of the object, a PNG file.
    costs : tuple of (str, str)
        Names and texts of what is said of times, difficulty and money.
    beside : tuple of (str, int)
        Folders with more sheets, and how many there are.
    base : str
        What is to be there for its base; empty if it has none.
    """

    title: str
    buildable: str
    form: str
    building: str
    size_mm: tuple[float, ...]
    material: str
    bill: BillOfMaterials
    colours: Colours
    portrait: bytes
    costs: tuple[tuple[str, str], ...]
    beside: tuple[tuple[str, int], ...] = ()
    base: str = ""


def write_cover(book: Book, crossing_map: CrossingMap, facts: Facts) -> None:
    """Write the cover: the object, what it is made of, and what it takes to put it together."""
    book.page(COVER)
    wide = book.right - book.left
    book.y -= 34.0
    size = min(30.0, 30.0 * wide / max(text_width(facts.title, 30.0, bold=True), 1.0))
    book.text(book.left, book.y, facts.title, size=max(size, 14.0), bold=True)
    book.y -= 10.0
    with Image.open(io.BytesIO(facts.portrait)) as file:
        picture = packed(np.asarray(file.convert("RGB")))
    parts = [
        _Part("", _overview(crossing_map, facts)),
        _Part(TABLE, _on_the_table(crossing_map, facts), indent=16.0),
        _Part(PROCEED, _proceed(crossing_map, facts.bill), beside=16.0),
    ]
    natural = wide * picture.height_px / picture.width_px
    # A long verdict makes the picture smaller, down to a half, and then runs on to a second page.
    room = book.y - book.foot - 10.0 - sum(part.height(wide) for part in parts)
    high = min(natural, max(room, natural / 2.0))
    left = book.left + (wide - wide * high / natural) / 2.0
    book.image(picture, left, book.y - high, wide * high / natural, high)
    book.y -= high + 10.0
    for part in parts:
        part.write(book)


class _Part(NamedTuple):
    """A part of the cover: its head, and lines with their names; ticked off where they stand in."""

    head: str
    lines: Sequence[tuple[str, str]]
    indent: float = 0.0
    beside: float = 76.0

    def height(self, wide: float) -> float:
        """Return how high it is on a page so wide."""
        return self._head_high() + sum(self._line_high(text, wide) for _, text in self.lines)

    def write(self, book: Book) -> None:
        """Write it, on as many pages as it takes."""
        wide = book.right - book.left
        if self.head:
            book.room(self._head_high() + self._line_high(self.lines[0][1], wide), COVER)
            book.y -= 8.0 + LEADING * _HEAD
            book.text(book.left, book.y + 0.25 * _HEAD, self.head, size=_HEAD, bold=True)
            book.y -= 2.0
        left = book.left + self.indent + self.beside
        for name, text in self.lines:
            book.room(self._line_high(text, wide), COVER)
            if self.indent:
                book.tick_box(book.left, book.y - LEADING * TEXT - 0.5)
                _draw_sign(book, name)
            end = book.block(left, book.y, text, book.right - left)
            at = book.y - LEADING * TEXT + 0.25 * TEXT
            book.text(book.left + self.indent, at, name, bold=True)
            book.y = end - _BELOW

    def _head_high(self) -> float:
        return 10.0 + LEADING * _HEAD if self.head else 0.0

    def _line_high(self, text: str, wide: float) -> float:
        lines = wrapped(text, TEXT, wide - self.indent - self.beside)
        return LEADING * TEXT * len(lines) + _BELOW


def _draw_sign(book: Book, name: str) -> None:
    """Draw the sign that all steps have for a thing of the list, where there is one."""
    x, y = book.left + 82.0, book.y - LEADING * TEXT + 4.0
    if name == "Fasteners":
        book.complete(x, y)
    elif name == "Clips":
        book.clip(x, y - 5.0)


def _overview(crossing_map: CrossingMap, facts: Facts) -> list[tuple[str, str]]:
    """Return what is said of the object, each line with its name."""
    spares = len(crossing_map.spares or ())
    return [
        ("Buildable?", facts.buildable),
        *([("Form", f"When you let go, it {facts.form}")] if facts.form else []),
        *([("On the way", facts.building)] if facts.building else []),
        ("Size", " x ".join(f"{length:.0f}" for length in facts.size_mm) + " mm"),
        ("Material", facts.material),
        (
            "Made of",
            agree(len(crossing_map.pieces), "{n} [piece|pieces]")
            + (agree(spares, " and {n} spare[|s]") if spares else "")
            + agree(len(crossing_map.sheets), f" on {{n}} {_stock(crossing_map)}[|s], ")
            + agree(len(crossing_map.threads), "{n} [thread|threads], ")
            + agree(len(crossing_map.crossings), "{n} [crossing|crossings], ")
            + agree(len(crossing_map.joints), "{n} [joint|joints]"),
        ),
        *facts.costs,
    ]


def _stock(crossing_map: CrossingMap) -> str:
    """Return what pieces are cut from."""
    return "roll" if any(sheet.roll_mm for sheet in crossing_map.sheets) else "sheet"


def _on_the_table(crossing_map: CrossingMap, facts: Facts) -> list[tuple[str, str]]:
    """Return what has to be there before the first step, each line with its name."""
    stock = _stock(crossing_map)
    sheets = agree(len(crossing_map.sheets), f"the {{n}} {stock}[|s]")
    for folder, count in facts.beside:
        sheets += agree(count, " and the {n} [sheet|sheets] in ") + f"{folder}/"
    lines = [(f"{stock.capitalize()}s", f"{sheets}, cut")]
    lines += [("Base", facts.base)] if facts.base else []
    lines += buy_lines(facts.bill)
    kinds = sorted({joint.kind for joint in crossing_map.joints})
    tools = [*(KINDS[kind].tools for kind in kinds), *set_with(facts.bill).values()]
    if stock == "roll":
        lines.append(("Tapes", "sticks.pdf, printed at 100 %: the marks of each strip"))
        tools = ["scissors", "a printer", "a pencil and a hole punch",
                 "glue or tape to join the tapes", *tools]  # fmt: skip
    told = dict.fromkeys(tool for tool in tools if tool not in ("", "fingers"))
    measure = "a ruler or a tape measure, for places on strips; a pencil to tick the boxes"
    lines.append(("Tools", "; ".join([*told, measure])))
    return lines


def _proceed(crossing_map: CrossingMap, bill: BillOfMaterials) -> list[tuple[str, str]]:
    """Return what is done, in order, each line with its number."""
    viewer = _VIEWER if len(crossing_map.crossings) <= MOST_VIEWED else ""
    lines = ["Take the pieces out of their sheets, one sheet after another, and tick each off."]
    if _stock(crossing_map) == "roll":
        lines = [
            "Print sticks.pdf at 100 %, and check its ruler. Join the lengths of each tape.",
            "Cut a strip off the roll, and tick it in the list of rolls. Lay its tape along it, "
            "copy the marks to its outer face, punch the holes, and write its name at both ends.",
        ]
    lines += [f"Sort them: {_piles(crossing_map)}.", f"Follow the steps.{viewer}"]
    if bill.fasteners:
        lines.append(
            "Set a fastener where a step shows a circle with a cross. Put on a clip where it shows "
            "one, and take it off when a later step says so."
        )
    if "thread" in set_with(bill):
        lines.append(
            "Lead the thread through the hole and around the edges of the strips, draw it tight, "
            "and knot its ends twice."
        )
    return [(str(number), line) for number, line in enumerate(lines, start=1)]


def _piles(crossing_map: CrossingMap) -> str:
    """Return how pieces are sorted: by what is engraved on them."""
    if crossing_map.cut.labels == "kinds":
        kinds = Counter(piece.kind for piece in crossing_map.pieces)
        return (
            agree(len(kinds), "{n} [pile|piles], one for each kind, of ")
            + _from_to(kinds.values())
            + "; any piece of a pile fits any of its places"
        )
    bags = bags_of(crossing_map)
    return agree(len(bags), "{n} [bag|bags], step by step") + ", with the labels at the end"


def _from_to(counts: Iterable[int]) -> str:
    """Return how many pieces there are in a pile."""
    low, high = min(counts := list(counts)), max(counts)
    return agree(high, "{n} [piece|pieces]") if low == high else f"{low} to {high} pieces"
