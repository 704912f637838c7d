"""Read the sheets of stock that a person has or can buy."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from fabweave.core.errors import InputError
from fabweave.core.units import format_length, parse_length
from fabweave.stock.per_bunch import bunch_number
from fabweave.stock.sheet_size import SheetSize

#: A longer side is a slip of the unit, not a sheet.
MAX_SIDE_MM = 20_000.0
#: Nobody has more sheets of one size.
MOST_SHEETS = 1_000_000
#: What knife plotters cut of a sheet on a mat, by the mat's inches: half an inch less each way.
MATS_MM = {"mat-12x12": (290.0, 290.0), "mat-12x24": (290.0, 595.0)}
_STOCK = re.compile(r"(?P<size>[^:*]*?)\s*(?:[:*]\s*(?P<quantity>.*?))?\s*")
_PAIR = re.compile(r"(?P<width>[^x×]+)[x×](?P<height>[^x×]+)", re.IGNORECASE)
_BARE = re.compile(r"\s*[\d.eE+-]+\s*")
_UNIT = re.compile(r"[^\d\s.+-]+\s*$")


def parse_stock(text: str) -> SheetSize:
    """Return the sheet that a text such as ``600x400mm:3`` describes.

    The unit may stand once, at the end, for both sides; no unit means millimetres. A number
    after ``:`` or ``*`` says how many such sheets there are; without it there are enough. The name
    of a bunch and ``=`` before it say that the sheet is for that one only. The mats of knife
    plotters go by their names, ``mat-12x12`` and ``mat-12x24``.

    Parameters
    ----------
    text : str
        ``WIDTHxHEIGHT``, with an optional unit, an optional quantity and an optional bunch.

    Returns
    -------
    SheetSize
        The sheet, in millimetres.

    Raises
    ------
    InputError
        If the text does not describe a sheet.

    Examples
    --------
    >>> sheet = parse_stock("600x400mm:3")
    >>> sheet.width_mm, sheet.height_mm, sheet.quantity
    (600.0, 400.0, 3)
    >>> parse_stock("24 x 18 in").height_mm
    457.2
    >>> parse_stock("weft=600x400mm").bunch
    'weft'
    >>> format_stock(parse_stock("mat-12x24:2"))
    '290x595mm:2'
    """
    if "=" in text:
        bunch, _, size = text.partition("=")
        bunch = bunch.strip().lower()
        bunch_number(bunch)
        return replace(parse_stock(size), bunch=bunch)
    name, *rest = text.partition(":")
    if (mat := MATS_MM.get(name.strip().lower())) is not None:
        text = f"{mat[0]:g}x{mat[1]:g}mm{''.join(rest)}"
    stock = _STOCK.fullmatch(text)
    pair = _PAIR.fullmatch(stock["size"]) if stock else None
    if stock is None or pair is None:
        raise InputError(
            f"sheet {text[:80]!r} is not WIDTHxHEIGHT with an optional unit and quantity, "
            "such as 600x400mm or 24x18in:3"
        )
    width, height = pair["width"], pair["height"]
    if _BARE.fullmatch(width):
        unit = _UNIT.search(height)
        width += unit[0] if unit else ""
    sides = (
        parse_length(width, what=f"width of sheet {text!r}:"),
        parse_length(height, what=f"height of sheet {text!r}:"),
    )
    if max(sides) > MAX_SIDE_MM:
        raise InputError(
            f"sheet {text!r} is {format_length(max(sides))} long, but no sheet is longer than "
            f"{format_length(MAX_SIDE_MM)}; check the unit, as in 600x400mm or 60x40cm"
        )
    quantity: int | None = None
    if stock["quantity"] is not None:
        digits = re.fullmatch(r"[0-9]{1,9}", stock["quantity"])
        if not digits or not 1 <= int(stock["quantity"]) <= MOST_SHEETS:
            raise InputError(
                f"quantity {stock['quantity'][:40]!r} of sheet {text[:80]!r} must be a whole "
                f"number from 1 to {MOST_SHEETS}; leave it out if there is no limit"
            )
        quantity = int(stock["quantity"])
    return SheetSize(sides[0], sides[1], quantity)


def format_stock(sheet: SheetSize) -> str:
    """Return the text that `parse_stock` reads as this sheet.

    Examples
    --------
    >>> format_stock(SheetSize(609.6, 457.2, 2))
    '609.6x457.2mm:2'
    """
    size = f"{round(sheet.width_mm, 3):.10g}x{format_length(sheet.height_mm)}"
    if sheet.bunch:
        size = f"{sheet.bunch}={size}"
    return size if sheet.quantity is None else f"{size}:{sheet.quantity}"


def stock_table(sheets: Iterable[SheetSize]) -> dict[str, list[dict[str, Any]]] | None:
    """Return the tables that `stockfile.stock_of` reads as these sheets; None if there are none.

    Examples
    --------
    >>> stock_table([SheetSize(600.0, 400.0, 2, name="A", price=3.0)])
    {'sheet': [{'name': 'A', 'size': '600x400mm', 'quantity': 2, 'price': 3.0}]}
    """
    tables: dict[str, list[dict[str, Any]]] = {}
    for sheet in sheets:
        entry = {
            "name": sheet.name,
            "size": None
            if sheet.outline
            else format_stock(SheetSize(sheet.width_mm, sheet.height_mm)),
            "outline": [list(point) for point in sheet.outline] or None,
            "quantity": sheet.quantity,
            "price": sheet.price,
            "grain": sheet.grain_deg,
            "material": sheet.material,
            "defects": [{"polygon": [list(point) for point in ring]} for ring in sheet.defects]
            or None,
        }
        kept = {key: value for key, value in entry.items() if value is not None}
        tables.setdefault("offcut" if sheet.offcut else "sheet", []).append(kept)
    return tables or None


def stock_for(sheets: Sequence[SheetSize], material: str) -> tuple[SheetSize, ...]:
    """Return the sheets that are of a material, or of none in particular.

    Raises
    ------
    InputError
        If there are sheets, but of other materials only.

    Examples
    --------
    >>> card, any_sheet = SheetSize(9.0, 9.0, material="card"), SheetSize(8.0, 8.0)
    >>> len(stock_for([card, any_sheet], "card")), len(stock_for([card, any_sheet], "shim"))
    (2, 1)
    """
    matches = tuple(sheet for sheet in sheets if sheet.material in (None, material))
    if sheets and not matches:
        others = sorted({sheet.material for sheet in sheets if sheet.material is not None})
        raise InputError(
            f"the stock has no sheets of {material}, only of {', '.join(others)}; use --material "
            f"{others[0]}, or add sheets of {material} or sheets without a material"
        )
    return matches


def usable_size(sheet: SheetSize, margin_mm: float) -> tuple[float, float]:
    """Return width and height of what the margin leaves of a sheet, in millimetres.

    Raises
    ------
    InputError
        If the margin is negative or leaves nothing.

    Examples
    --------
    >>> usable_size(SheetSize(600.0, 400.0), 10.0)
    (580.0, 380.0)
    """
    if not margin_mm >= 0.0:
        raise InputError(f"the margin is {margin_mm} mm; it must be zero or more")
    width, height = sheet.width_mm - 2.0 * margin_mm, sheet.height_mm - 2.0 * margin_mm
    if not (width > 0.0 and height > 0.0):
        raise InputError(
            f"a margin of {format_length(margin_mm)} leaves nothing of a sheet of "
            f"{format_stock(SheetSize(sheet.width_mm, sheet.height_mm))}: use a smaller margin"
        )
    return width, height


def check_stock(sheets: Sequence[SheetSize], margin_mm: float) -> None:
    """Raise InputError unless there is stock and a margin that leaves something of each sheet.

    Examples
    --------
    >>> check_stock([SheetSize(600.0, 400.0)], 10.0)
    """
    if not sheets:
        raise InputError("no sheet was given: name at least one, such as 600x400mm")
    for sheet in sheets:
        if not (0.0 < sheet.width_mm <= MAX_SIDE_MM and 0.0 < sheet.height_mm <= MAX_SIDE_MM):
            raise InputError(
                f"sheet of {sheet.width_mm} × {sheet.height_mm} mm: both sides must be more "
                f"than 0 and at most {MAX_SIDE_MM:.0f} mm"
            )
        if sheet.quantity is not None and sheet.quantity < 1:
            raise InputError(
                f"sheet {format_stock(sheet)} has a quantity of {sheet.quantity}: "
                "it must be at least 1, or None for enough"
            )
        usable_size(sheet, margin_mm)
