"""Nest pieces around some that stay where somebody put them."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.nesting import nest
from fabweave.stock.sheet_size import SheetSize

_NUMBER = r"(-?\d{1,5}(?:\.\d{1,6})?)"
_PIN = re.compile(rf"(\w{{1,12}})@(\d{{1,4}}):{_NUMBER},{_NUMBER},{_NUMBER}", re.ASCII)
#: What sheets with pins are called while the rest is nested.
_HELD = "with pins "


@dataclass(frozen=True)
class Pin:
    """A piece that stays: on which sheet, counted from 0, and how it is moved there."""

    id: str
    sheet: int
    x_mm: float
    y_mm: float
    rotation_deg: float


def parse_pins(text: str) -> tuple[Pin, ...]:
    """Read pieces that stay where they are: ``A3@1:120,40,90``, with ``/`` between several.

    Each is a piece, a sheet, and the motion that lays it there: x, y and degrees, as the crossing
    map tells placements.

    Raises
    ------
    InputError
        If it reads otherwise, or names a piece twice.

    Examples
    --------
    >>> parse_pins("A3@1:120,40.5,90")
    (Pin(id='A3', sheet=0, x_mm=120.0, y_mm=40.5, rotation_deg=90.0),)
    """
    pins = []
    for part in "".join(text.split()).split("/"):
        match = _PIN.fullmatch(part)
        if match is None or int(match[2]) < 1:
            raise InputError(
                f"{part[:40]!r} pins no piece: write a piece, its sheet, x and y in millimetres "
                "and degrees, as in A3@1:120,40,90, with / between several"
            )
        pins.append(Pin(match[1], int(match[2]) - 1, *map(float, match.groups()[2:])))
    if len({pin.id for pin in pins}) < len(pins):
        raise InputError("a piece is pinned twice; name each piece once")
    return tuple(pins)


def nest_around(
    pins: Sequence[Pin],
    outlines: Sequence[FloatArray],
    sheets: Sequence[SheetSize],
    *,
    ids: Sequence[str],
    before: int = 0,
    **how: Any,
) -> Layout:
    """Nest pieces as :func:`fabweave.nest.nesting.nest` does, around those that are pinned.

    To the rest, what is pinned is like defects of its sheet, from which it keeps the gap. Sheets
    with pins are of the first size of the stock. They keep their numbers as far as there are
    sheets before them: around pins, fewer may do.

    Parameters
    ----------
    pins : sequence of Pin
        Those of other pieces are left out of account.
    outlines, sheets, ids, how
        As ``nest`` takes them.
    before : int
        How many sheets there are before these.

    Raises
    ------
    InputError
        If a piece is pinned on a sheet that is not there, with pins or without.
    """
    number = {name: at for at, name in enumerate(ids)}
    held = {
        number[pin.id]: replace(pin, sheet=pin.sheet - before) for pin in pins if pin.id in number
    }
    if wrong := [pin.id for pin in held.values() if pin.sheet < 0]:
        raise InputError(
            f"pieces are pinned on a sheet of another material: {few_of(wrong)}; the sheets of "
            f"theirs begin with {before + 1}"
        )
    if not held:
        return nest(outlines, sheets, ids=ids, **how)
    base, *others = sheets
    used = sorted({pin.sheet for pin in held.values()})
    left = None if base.quantity is None else base.quantity - len(used)
    if left is not None and left < 0:
        raise InputError(f"pieces are pinned on {len(used)} sheets, and there are {base.quantity}")
    placed = {
        piece: Placement(piece, pin.sheet, pin.rotation_deg, pin.x_mm, pin.y_mm)
        for piece, pin in held.items()
    }
    blocked = [
        replace(
            base, quantity=1, name=f"{_HELD}{sheet}", offcut=True,
            defects=(*base.defects, *(
                tuple(map(tuple, place.apply(outlines[piece]).tolist()))
                for piece, place in placed.items() if place.sheet == sheet
            )),
        )
        for sheet in used
    ]  # fmt: skip
    stock = [*blocked, *([] if left == 0 else [replace(base, quantity=left)]), *others]
    rest = [piece for piece in range(len(outlines)) if piece not in held]
    part = nest([outlines[piece] for piece in rest], stock, ids=[ids[one] for one in rest], **how)
    order: list[int | str] = [
        at for at, sheet in enumerate(part.sheets) if not sheet.name.startswith(_HELD)
    ]
    for sheet in used:
        order.insert(min(sheet, len(order)), f"{_HELD}{sheet}")
    at_of = {name: at for at, name in enumerate(order)}
    moved = [pin for pin in held.values() if at_of[f"{_HELD}{pin.sheet}"] != pin.sheet]
    if moved:
        count = len(nest(outlines, sheets, ids=ids, **how).sheets)
        if strange := [pin.id for pin in moved if pin.sheet >= count]:
            least, most = before + 1, before + count
            raise InputError(
                f"pieces are pinned on a sheet that is not there: {few_of(strange)}; use sheet "
                + (f"{least}" if count == 1 else f"{least} to {most}")
            )
    new_number = [at_of[sheet.name if sheet.name.startswith(_HELD) else at]
                  for at, sheet in enumerate(part.sheets)]  # fmt: skip
    for place in part.placements:
        placed[rest[place.piece]] = replace(
            place, piece=rest[place.piece], sheet=new_number[place.sheet]
        )
    for piece, pin in held.items():
        placed[piece] = replace(placed[piece], sheet=at_of[f"{_HELD}{pin.sheet}"])
    return replace(
        part,
        sheets=tuple(
            replace(base, quantity=1) if isinstance(at, str) else part.sheets[at] for at in order
        ),
        placements=tuple(placed[piece] for piece in range(len(outlines))),
    )
