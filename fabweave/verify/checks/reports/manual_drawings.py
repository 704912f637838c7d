"""Check the parts list and the sheets of the manual: texts, and what is drawn to scale."""

import re
from collections import Counter
from collections.abc import Sequence
from itertools import takewhile

import numpy as np

from fabweave.verify.crossing_map import CrossingMap, Piece, Sheet
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.areas import span_and_width
from fabweave.verify.measure.words import counted
from fabweave.verify.read.manual import ManualPage
from fabweave.verify.running_text import RunningText, printed
from fabweave.verify.statement import Place

#: Points of a page in a millimetre.
_POINTS_MM = 72.0 / 25.4
#: Places and lengths are rounded to a millimetre; arcs are drawn by chords that are off by a tenth
#: at the most.
_SAME_MM, _CHORD_MM = 0.55, 0.11
#: Figures of the same shape agree to this share of their size, and their scales to that.
_SHARE, _SCALE = 5e-3, 2e-3
#: How a sheet is called of which only one part has pieces, and is drawn.
_SOME = ", the part with pieces"
#: A sheet is drawn in no more parts.
_MOST_PARTS = 4
_SPARES = (
    " A spare, such as A1S1, is one more of the kind of A1: put it in the place of any piece of "
    "that kind that breaks."
)


def check_parts(plan: CrossingMap, pages: Sequence[ManualPage], place: Place) -> None:
    """Require that the parts list has each kind of piece, drawn to scale, with its size and places.

    Parameters
    ----------
    plan : CrossingMap
    pages : sequence of ManualPage
        Of that section.
    place : Place
    """
    text = RunningText([said for page in pages for said in page.texts], place)
    figures = [figure for page in pages for figure in page.figures]
    kinds: dict[int, list[Piece]] = {}
    for piece in plan.to_cut:
        kinds.setdefault(piece.kind, []).append(piece)
    parts = list(kinds.values())
    if not place.equal("the number of drawn pieces", len(figures), len(parts)):
        return
    # Arcs are drawn by chords: that changes the area of a narrow piece, but hardly its length.
    scales = [
        float(span_and_width(figure)[0] / max(span_and_width(alike[0].outline)[0], 1e-9))
        for figure, alike in zip(figures, parts, strict=True)
    ]
    scale = float(np.median(scales))
    spares = and_spares(len(plan.spare_of))
    text.block(
        *(
            f"{counted(len(plan.pieces), 'piece')}{spares} of {counted(len(parts), 'kind')}, "
            f"engraved face up, drawn at a scale of {words}. Pieces of one kind are cut alike: "
            "they are drawn once, and their ids stand by sheet. Where there is only one, its "
            "place is that of its middle on the sheet, in mm from the left edge and from the lower "
            "edge." + (_SPARES if spares else "")
            for words in _scale_words(scale)
        )
    )
    for alike, figure in zip(parts, figures, strict=True):
        piece, several = alike[0], len(alike) > 1
        name = f"Kind {piece.kind}" if several else piece.id
        here = place.at(f"piece {name}")
        _check_shape(piece, figure / scale, here)
        text.block(name)
        length = float(np.ptp(figure[:, 0])) / scale
        stations = counted(len(piece.stations), "station")
        times = f"x {_times(plan, alike)}: " if several else ""
        said = text.match(rf"{times}(\d+) mm, {stations}", f"{times}{length:.0f} mm, {stations}")
        if said is not None:
            here.number("its length", float(said[1]), length, within=_SAME_MM + _SCALE * length)
        if several:
            _check_spots(plan, alike, text)
        else:
            _check_spot(plan, piece, text, here)
    text.end()


def _times(plan: CrossingMap, alike: Sequence[Piece]) -> str:
    """Return how many pieces of a kind are woven, and how many are spares."""
    spares = sum(piece.id in plan.spare_of for piece in alike)
    return f"{len(alike) - spares}{and_spares(spares)}"


def and_spares(count: int) -> str:
    """Return what is said of spares after a number of pieces.

    Examples
    --------
    >>> and_spares(0), and_spares(1), and_spares(2)
    ('', ' and 1 spare', ' and 2 spares')
    """
    return f" and {counted(count, 'spare')}" if count else ""


def _check_spots(plan: CrossingMap, alike: Sequence[Piece], text: RunningText) -> None:
    """Require the ids of pieces of one kind, sheet by sheet."""
    for sheet in sorted({piece.sheet for piece in alike}):
        name = plan.sheet[sheet].name if sheet in plan.sheet else "?"
        ids = " ".join(piece.id for piece in alike if piece.sheet == sheet)
        text.block(f"{name}: {ids}")


def _scale_words(scale: float) -> list[str]:
    """Return what may be said of a scale, points to a millimetre, measured to a share."""
    scales = (_POINTS_MM / scale * (1.0 + by) for by in (0.0, -_SCALE, _SCALE))
    return list(dict.fromkeys(f"1 : {one:.1f}" for one in scales))


def _check_shape(piece: Piece, drawn: Floats, place: Place) -> None:
    """Check that a piece is drawn at the scale of all, and as long and wide as it is."""
    for shape, true in zip(span_and_width(drawn), span_and_width(piece.outline), strict=True):
        place.number(
            "the span or the width of its drawing", float(shape), float(true),
            within=_SHARE * float(true) + 2 * _CHORD_MM,
        )  # fmt: skip


def _check_spot(plan: CrossingMap, piece: Piece, text: RunningText, place: Place) -> None:
    """Check where a piece is said to be."""
    name = plan.sheet[piece.sheet].name if piece.sheet in plan.sheet else "?"
    outline = piece.placed(piece.outline)
    middle = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
    said = text.match(
        rf"{re.escape(name)} at (-?\d+), (-?\d+)",
        f"{name} at {middle[0]:.0f}, {middle[1]:.0f}",
    )
    if said is not None:
        for stated, true in zip(said.groups(), middle.tolist(), strict=True):
            place.number("its place", float(stated), true, within=_SAME_MM)


def check_sheets(plan: CrossingMap, pages: Sequence[ManualPage], place: Place) -> None:
    """Require the pages of every sheet: its drawing, the names on it, and the list to tick off.

    Parameters
    ----------
    plan : CrossingMap
    pages : sequence of ManualPage
        Of that section.
    place : Place
    """
    left = list(pages)
    several = len({(sheet.material, sheet.thickness_mm) for sheet in plan.sheets}) > 1
    for sheet in plan.sheets:
        here = place.at(sheet.name)
        own = _pages_of(sheet, left)
        del left[: len(own)]
        # A drawing in several parts has a page for each; the list may go on without a drawing.
        parts = [page for page in own if _is_head(sheet, page)]
        pieces = plan.on_sheet(sheet.number)
        shared = _shared_out(plan, sheet, parts)
        for number, page in enumerate(parts, start=1):
            text = RunningText(page.texts, here)
            _check_part(plan, sheet, page, text, (number, len(parts)), several)
        names = [piece.id for lot in shared for piece in lot]
        here.same("names of pieces", names, [piece.id for piece in pieces])
        said = [text for page in own for text in page.texts]
        ticks = [_ticks(sheet), *_ticked(plan, pieces)]
        start = said.index(ticks[0]) if ticks[0] in said else len(said)
        here.equal("the list to tick off", said[start:], ticks)
    place.expect(not left, f"{len(left)} pages of sheets belong to no sheet")


def _ticked(plan: CrossingMap, pieces: Sequence[Piece]) -> list[str]:
    """Return the list to tick off: each piece, or each kind where pieces bear no more than that."""
    counts = Counter(_name(plan, piece) for piece in pieces)
    by_kind = plan.cut.labels == "kinds"
    return [
        f"{name} x {counts[name]}" if by_kind else name for name in sorted(counts, key=_natural)
    ]


def _name(plan: CrossingMap, piece: Piece) -> str:
    """Return what a piece is called by what it bears."""
    return f"K{piece.kind}" if plan.cut.labels == "kinds" else piece.id


def _named(plan: CrossingMap, sheet: Sheet, page: ManualPage) -> list[str]:
    """Return the names that a page has on its drawing."""
    known = {_name(plan, piece) for piece in plan.on_sheet(sheet.number)}
    return list(takewhile(known.__contains__, page.texts[1:]))


def _shared_out(plan: CrossingMap, sheet: Sheet, parts: Sequence[ManualPage]) -> list[list[Piece]]:
    """Return the pieces that each part of a sheet's drawing has.

    By the names there; where several pieces have one name, by equal parts of the sheet, the first
    number of them in which every page has the names of its pieces.
    """
    named, pieces = [_named(plan, sheet, page) for page in parts], plan.on_sheet(sheet.number)
    if plan.cut.labels != "kinds":
        return [[plan.cut_piece[name] for name in names] for names in named]
    size = np.array([sheet.width_mm, sheet.height_mm])
    axis = int(np.argmax(size))
    placed = [piece.placed(piece.outline)[:, axis] for piece in pieces]
    middle = np.array([(along.min() + along.max()) / 2.0 for along in placed])
    for count in range(1, _MOST_PARTS + 1):
        lots: dict[int, list[Piece]] = {}
        tiles = np.minimum(middle * count // size[axis], count - 1).astype(np.int64)
        for tile, piece in sorted(zip(tiles.tolist(), pieces, strict=True), key=lambda one: one[0]):
            lots.setdefault(tile, []).append(piece)
        told = [sorted(_name(plan, piece) for piece in lot) for lot in lots.values()]
        if told == [sorted(names) for names in named]:
            return list(lots.values())
    return [[] for _ in parts]


def _pages_of(sheet: Sheet, pages: Sequence[ManualPage]) -> list[ManualPage]:
    """Return the pages of a sheet: the next ones, up to the head of another."""
    count = next((at for at, page in enumerate(pages) if at and _other(sheet, page)), len(pages))
    return list(pages[:count])


def _is_head(sheet: Sheet, page: ManualPage) -> bool:
    return bool(page.texts) and page.texts[0].startswith((f"{sheet.name}:", f"{sheet.name},"))


def _other(sheet: Sheet, page: ManualPage) -> bool:
    """Return whether a page begins with the head of another sheet."""
    first = page.texts[0] if page.texts else ""
    return ", scale 1 : " in first and not _is_head(sheet, page)


def _check_part(
    plan: CrossingMap,
    sheet: Sheet,
    page: ManualPage,
    text: RunningText,
    part: tuple[int, int],
    several: bool,
) -> None:
    """Check what is said of the drawing of a sheet, or of a part of it."""
    some = _SOME if page.texts[0].startswith(f"{sheet.name}{_SOME}:") else ""
    which = f", part {part[0]} of {part[1]}" if part[1] > 1 else some
    head = (
        sheet.name
        + which
        + f": {sheet.width_mm:g} x {sheet.height_mm:g} mm"
        + (f", {sheet.material} {sheet.thickness_mm:g} mm" if several else "")
        + (", mirrored, as it is cut" if sheet.mirrored else "")
    )
    text.match(re.escape(printed(head)) + r"(, left edge at the bottom)?, scale 1 : \d+\.\d", head)
    text.some_of(_named(plan, sheet, page))
    text.block(_stock_words(sheet))
    if text.next:
        text.block(_ticks(sheet))


def _ticks(sheet: Sheet) -> str:
    """Return the head of the list of a sheet's pieces."""
    return f"Pieces of {sheet.name}, to tick off as you take them out:"


def _stock_words(sheet: Sheet) -> str:
    """Return what the stock is called, and what its drawing shows beside the pieces."""
    said = ["Dotted: the margin."]
    if sheet.stock:
        offcut = " (an offcut)" if sheet.offcut else ""
        said.insert(0, f"From the stock: {sheet.stock}{offcut}.")
    if sheet.defects:
        said.append("Hatched: defects.")
    if sheet.rest is not None:
        said.append(f"Dashed: {sheet.rest.name}, to be kept.")
    return " ".join(said)


def _natural(key: str) -> tuple[str, int]:
    """Sort A2 before A10."""
    letters = key.rstrip("0123456789")
    return letters, int(key[len(letters) :] or 0)
