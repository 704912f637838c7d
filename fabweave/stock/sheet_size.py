"""Hold a sheet of stock: its size, number, price, grain, outline and defects."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from fabweave.core.errors import InputError
from fabweave.core.units import format_length, parse_length
from fabweave.stock.per_bunch import bunch_number

#: A closed run of points in the frame of a sheet, millimetres.
Ring: TypeAlias = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SheetSize:
    """A sheet of stock, in its own frame: from its lower left corner, millimetres.

    Parameters
    ----------
    width_mm, height_mm : float
        Of the sheet, or of the rectangle around it.
    quantity : int or None
        How many there are; None for enough.
    name : str
        What it is called in a list of stock; empty if it is in none.
    price : float or None
        Of one sheet, in any currency.
    material : str or None
        What it is made of; None for any.
    grain_deg : float or None
        The direction of its grain, from its width on; None if it has none.
    offcut : bool
        Whether it is left over from earlier work, and so used first.
    outline : Ring
        Its outline if that is not a rectangle.
    defects : tuple of Ring
        Polygons that pieces keep the gap from.
    bunch : str
        The bunch of threads that alone is cut from it; empty for any.
    roll_mm : float or None
        If it is a roll, or what is used of one: how long the whole roll is. Its width is the length
        that there is, and its height that of the strip.
    """

    width_mm: float
    height_mm: float
    quantity: int | None = None
    name: str = ""
    price: float | None = None
    material: str | None = None
    grain_deg: float | None = None
    offcut: bool = False
    outline: Ring = ()
    defects: tuple[Ring, ...] = ()
    bunch: str = ""
    roll_mm: float | None = None

    @property
    def plain(self) -> bool:
        """Whether there is nothing to know but size, number and bunch."""
        return self == SheetSize(
            self.width_mm, self.height_mm, self.quantity, bunch=self.bunch, roll_mm=self.roll_mm
        )

    @property
    def is_roll(self) -> bool:
        """Whether it is a roll."""
        return self.roll_mm is not None

    @property
    def ring(self) -> Ring:
        """The outline, of a rectangle too."""
        wide, high = self.width_mm, self.height_mm
        return self.outline or ((0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high))

    @property
    def area_mm2(self) -> float:
        """The area inside the outline; defects are not taken off.

        Examples
        --------
        >>> SheetSize(4.0, 3.0, outline=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))).area_mm2
        6.0
        """
        x, y = np.array(self.ring).T
        return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0

    def mirrored(self) -> "SheetSize":
        """Return the sheet as it is seen from its back, turned over sideways.

        Examples
        --------
        >>> SheetSize(4.0, 3.0, outline=((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))).mirrored().outline
        ((4.0, 0.0), (0.0, 0.0), (4.0, 3.0))
        """

        def turned(ring: Ring) -> Ring:
            return tuple((round(self.width_mm - x, 6), y) for x, y in ring)

        return replace(
            self,
            grain_deg=None if self.grain_deg is None else -self.grain_deg % 180.0,
            outline=turned(self.outline),
            defects=tuple(turned(ring) for ring in self.defects),
        )


#: A longer side is a slip of the unit, not a sheet.
MAX_SIDE_MM = 20_000.0
#: No roll is longer, or wider.
MAX_ROLL_MM, MAX_STRIP_MM = 500_000.0, 300.0
#: Nobody has more sheets of one size.
MOST_SHEETS = 1_000_000
#: What knife plotters cut of a sheet on a mat, by the mat's inches: half an inch less each way.
MATS_MM = {"mat-12x12": (290.0, 290.0), "mat-12x24": (290.0, 595.0)}
#: Sheets that are known by name: mats, paper of ISO 216 and of ANSI, the long side first.
NAMED_MM = MATS_MM | {
    "a5": (210.0, 148.0), "a4": (297.0, 210.0), "a3": (420.0, 297.0), "a2": (594.0, 420.0),
    "a1": (841.0, 594.0), "a0": (1189.0, 841.0), "letter": (279.4, 215.9),
    "legal": (355.6, 215.9), "tabloid": (431.8, 279.4),
}  # fmt: skip
_STOCK = re.compile(r"(?P<size>[^:*]*?)\s*(?:[:*]\s*(?P<quantity>.*?))?\s*")
_PAIR = re.compile(r"(?P<width>[^x×]+)[x×](?P<height>[^x×]+)", re.IGNORECASE)
_BARE = re.compile(r"\s*[\d.eE+-]+\s*")
_UNIT = re.compile(r"[^\d\s.+-]+\s*$")


def parse_stock(text: str) -> SheetSize:
    """Return the sheet that a text such as ``600x400mm:3`` describes.

    The unit may stand once, at the end, for both sides; no unit means millimetres. A number
    after ``:`` or ``*`` says how many such sheets there are; without it there are enough. The name
    of a bunch and ``=`` before it say that the sheet is for that one only. Paper goes by its name,
    such as ``A4`` or ``letter``, and so do the mats of knife plotters, ``mat-12x12`` and
    ``mat-12x24``.

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
    >>> [format_stock(parse_stock(name)) for name in ("mat-12x24:2", "A4", "600*400mm")]
    ['290x595mm:2', '297x210mm', '600x400mm']
    """
    if "=" in text:
        bunch, _, size = text.partition("=")
        bunch = bunch.strip().lower()
        bunch_number(bunch)
        return replace(parse_stock(size), bunch=bunch)
    name, *rest = text.partition(":")
    if (known := NAMED_MM.get(name.strip().lower())) is not None:
        text = f"{known[0]:g}x{known[1]:g}mm{''.join(rest)}"
    elif not re.search("[x×]", text, re.IGNORECASE):
        text = text.replace("*", "x", 1)
    stock = _STOCK.fullmatch(text)
    pair = _PAIR.fullmatch(stock["size"]) if stock else None
    if stock is None or pair is None:
        raise InputError(
            f"sheet {text[:80]!r} is not WIDTHxHEIGHT with an optional unit and quantity, "
            "such as 600x400mm or 24x18in:3, and not the name of a paper, such as A4"
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
    return SheetSize(sides[0], sides[1], _quantity(stock["quantity"], f"sheet {text[:80]!r}"))


def _quantity(text: str | None, what: str) -> int | None:
    """Return how many there are; None for enough."""
    if text is None:
        return None
    if not re.fullmatch(r"[0-9]{1,9}", text) or not 1 <= int(text) <= MOST_SHEETS:
        raise InputError(
            f"quantity {text[:40]!r} of {what} must be a whole number from 1 to {MOST_SHEETS}; "
            "leave it out if there is no limit"
        )
    return int(text)


def parse_roll(text: str) -> SheetSize:
    """Return the roll that a text such as ``roll:12mm:50m:2`` describes: width, length, number.

    Raises
    ------
    InputError
        If the text does not describe a roll.

    Examples
    --------
    >>> roll = parse_roll("roll:12mm:50m")
    >>> roll.width_mm, roll.height_mm, format_stock(roll)
    (50000.0, 12.0, 'roll:12mm:50000mm')
    """
    parts = [part.strip() for part in text.split(":")]
    if not 3 <= len(parts) <= 4 or not parts[1] or not parts[2]:
        raise InputError(
            f"roll {text[:80]!r} is not roll:WIDTH:LENGTH with an optional number of rolls, such "
            "as roll:12mm:50m or roll:0.5in:100ft:2"
        )
    wide = round(parse_length(parts[1], what=f"width of {text[:80]!r}:"), 3)
    long = round(parse_length(parts[2], what=f"length of {text[:80]!r}:"), 3)
    if not (0.0 < wide <= MAX_STRIP_MM and wide < long <= MAX_ROLL_MM):
        raise InputError(
            f"{text[:80]!r} is {format_length(wide)} wide and {format_length(long)} long: write "
            f"the width of the strip first, up to {MAX_STRIP_MM:g} mm, then the length of the "
            f"roll, up to {MAX_ROLL_MM / 1000:g} m, as in roll:12mm:50m"
        )
    return SheetSize(long, wide, _quantity((*parts, None)[3], repr(text[:80])), roll_mm=long)


def format_stock(sheet: SheetSize) -> str:
    """Return the text that `parse_stock`, or `parse_roll`, reads as this sheet.

    Examples
    --------
    >>> format_stock(SheetSize(609.6, 457.2, 2))
    '609.6x457.2mm:2'
    """
    size = f"{round(sheet.width_mm, 3):.10g}x{format_length(sheet.height_mm)}"
    if sheet.roll_mm is not None:
        size = f"roll:{format_length(sheet.height_mm)}:{format_length(sheet.roll_mm)}"
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
        shape: dict[str, Any] = {"outline": [list(point) for point in sheet.outline]}
        if sheet.is_roll:
            shape = {"roll": format_stock(replace(sheet, quantity=None)).removeprefix("roll:")}
        elif not sheet.outline:
            shape = {"size": format_stock(SheetSize(sheet.width_mm, sheet.height_mm))}
        entry = {
            "name": sheet.name,
            **shape,
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
        most = MAX_ROLL_MM if sheet.is_roll else MAX_SIDE_MM
        if not (0.0 < sheet.width_mm <= most and 0.0 < sheet.height_mm <= most):
            raise InputError(
                f"sheet of {sheet.width_mm} × {sheet.height_mm} mm: both sides must be more "
                f"than 0 and at most {most:.0f} mm"
            )
        if sheet.quantity is not None and sheet.quantity < 1:
            raise InputError(
                f"sheet {format_stock(sheet)} has a quantity of {sheet.quantity}: "
                "it must be at least 1, or None for enough"
            )
        usable_size(sheet, margin_mm)


def on_bed(sheet: SheetSize, bed: SheetSize | None) -> SheetSize:
    """Return what of a sheet a machine's bed takes, laid with its longer side along the bed's.

    No machine cuts a roll.

    Examples
    --------
    >>> format_stock(on_bed(SheetSize(1000.0, 700.0), SheetSize(400.0, 800.0)))
    '800x400mm'
    """
    if bed is None or sheet.is_roll:
        return sheet
    most = sorted((bed.width_mm, bed.height_mm), reverse=sheet.width_mm >= sheet.height_mm)
    return replace(
        sheet, width_mm=min(sheet.width_mm, most[0]), height_mm=min(sheet.height_mm, most[1])
    )


def check_bed(sheets: Iterable[SheetSize], bed: SheetSize | None) -> None:
    """Raise InputError unless a machine's bed takes each sheet, either way round."""
    for sheet in sheets:
        if on_bed(sheet, bed) != sheet:
            raise InputError(
                f"the sheet {format_stock(sheet)} is larger than the bed of the machine: name a "
                f"sheet such as --sheet {format_stock(on_bed(sheet, bed))}, or set another "
                "machine.bed"
            )
