"""Plan what each bunch of threads is cut from, from what the settings say."""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.stock.material import Material, material_library, material_named, with_thickness
from fabweave.stock.per_bunch import ByBunch, bunch_number, format_by_bunch, split_by_bunch
from fabweave.stock.sheet_size import SheetSize
from fabweave.stock.sheet_text import format_stock, stock_for
from fabweave.stock.supplies import Supplies, Supply

_Value = TypeVar("_Value")
_SORT = re.compile(r"[a-z0-9][a-z0-9 -]{0,23}")


def plan_supplies(
    materials: ByBunch[str],
    thickness_mm: ByBunch[float | None],
    gap_mm: ByBunch[float | None],
    sheets: Sequence[SheetSize],
    user_materials: Sequence[Material] = (),
) -> Supplies:
    """Put together what each bunch is cut from.

    Parameters
    ----------
    materials : pairs of str
        The name of a material for all bunches, or for each; after a colon it may say of which
        sort, such as ``card:red``.
    thickness_mm, gap_mm : pairs
        Of all bunches or each; None for the material's own.
    sheets : sequence of SheetSize
        The stock. A sheet that names a bunch is for that one only, one that tells its material for
        threads of that; any other is for all, and may not be counted if there are several supplies.
        Where there is none, the material's default.
    user_materials : sequence of Material
        Beside those of the library.

    Returns
    -------
    Supplies

    Raises
    ------
    InputError
        If there is no such material, or some settings name other bunches than the rest.

    Examples
    --------
    >>> both = plan_supplies(
    ...     (("warp", "card"), ("weft", "birch-veneer")), (("", None),), (("", None),), ())
    >>> [(supply.bunches, supply.material.name) for supply in both.each]
    [(('warp',), 'card'), (('weft',), 'birch-veneer')]
    >>> alike = plan_supplies(
    ...     (("warp", "card"), ("weft", "card")), (("", 0.4),), (("", None),), ())
    >>> alike.description
    'Card, 300 g/m², 0.4 mm'
    """
    named = {name: bunch_number(name) for name in _names(materials, thickness_mm, gap_mm, sheets)}
    groups: dict[tuple[Material, tuple[SheetSize, ...], float], list[str]] = {}
    added = []
    for name in named or {"": 0}:
        number = named.get(name)
        material = sort_of_material(_value(materials, number), user_materials)
        thick, gap = _value(thickness_mm, number), _value(gap_mm, number)
        if thick is not None:
            material = with_thickness(material, thick)
        stock = _sheets_of(material, number, sheets)
        if not stock:
            stock = (SheetSize(*material.sheet_mm),)
            added.append(replace(stock[0], bunch=name))
        gap = material.gap_mm if gap is None else gap
        groups.setdefault((material, stock, gap), []).append(name)
    each = tuple(
        Supply(tuple(filter(None, names)), material, stock, gap)
        for (material, stock, gap), names in groups.items()
    )
    if len(each) == 1:
        return Supplies(each, each[0].sheets)
    _require_apart(each)
    there = {sheet for supply in each for sheet in supply.sheets}
    kept = [sheet for sheet in sheets if replace(sheet, bunch="") in there]
    return Supplies(each, (*kept, *added))


def _require_apart(each: Sequence[Supply]) -> None:
    """Raise InputError if some sheets are counted, but it is not clear for which supply."""
    owners = Counter(
        sheet for supply in each for sheet in set(supply.sheets) if sheet.quantity is not None
    )
    shared = [sheet for sheet, count in owners.items() if count > 1]
    if shared:
        raise InputError(
            f"{agree(len(shared), '{n} [entry|entries]')} of the stock (such as "
            f"{shared[0].name or format_stock(shared[0])}) could be of any of the "
            f"{len(each)} materials, and the number of sheets is limited: name the bunch, as in "
            f"--sheet {each[-1].bunches[0]}={format_stock(shared[0])}, or the material in the list "
            "of stock"
        )


def _sheets_of(
    material: Material, number: int | None, sheets: Sequence[SheetSize]
) -> tuple[SheetSize, ...]:
    """Return the sheets that are for a bunch and of its material."""
    offered = [
        replace(sheet, bunch="")
        for sheet in sheets
        if not sheet.bunch or bunch_number(sheet.bunch) == number
    ]
    known = (None, material.name, material.name.partition(":")[0])
    fitting = tuple(sheet for sheet in offered if sheet.material in known)
    return fitting or stock_for(offered, material.name)


def _names(
    materials: ByBunch[str],
    thickness_mm: ByBunch[float | None],
    gap_mm: ByBunch[float | None],
    sheets: Sequence[SheetSize],
) -> list[str]:
    """Return the names of all bunches that settings speak of, in the order of their numbers."""
    spoken: dict[int, str] = {}
    for what, values in (
        ("material", materials), ("thickness", thickness_mm), ("gap", gap_mm),
    ):  # fmt: skip
        bunches = {bunch_number(name): name for name, _ in values if name}
        if bunches and spoken and set(bunches) != set(spoken):
            named = ", ".join(bunches[number] for number in sorted(bunches))
            before = ", ".join(spoken[number] for number in sorted(spoken))
            raise InputError(
                f"the {what} is given for {named}, but other settings are for {before}: name the "
                "same bunches in each, or give one value for all"
            )
        spoken = spoken or bunches
    of_sheets = {bunch_number(sheet.bunch): sheet.bunch for sheet in sheets if sheet.bunch}
    if of_sheets and spoken and not set(of_sheets) <= set(spoken):
        strange = ", ".join(name for number, name in of_sheets.items() if number not in spoken)
        before = ", ".join(spoken[number] for number in sorted(spoken))
        raise InputError(
            f"a sheet is for {strange}, but materials are for {before}: name the same bunches"
        )
    if of_sheets and not spoken:
        raise InputError(
            f"a sheet is for {', '.join(of_sheets.values())}, but there is one material for all: "
            "give a material for each bunch too, such as --material warp=card,weft=card"
        )
    return [spoken[number] for number in sorted(spoken)]


def _value(values: ByBunch[_Value], number: int | None) -> _Value:
    """Return what holds for a bunch: its own value, or that for all."""
    for name, value in values:
        if not name or bunch_number(name) == number:
            return value
    raise ValueError(f"nothing is given for bunch {number}")


def parse_materials(text: str) -> ByBunch[str]:
    """Return the names of materials that a text names: one for all bunches, or one for each.

    Examples
    --------
    >>> parse_materials("warp=card,weft=birch-veneer")
    (('warp', 'card'), ('weft', 'birch-veneer'))
    """
    return split_by_bunch(text, what="material")


def tidy_materials(text: str) -> str:
    """Return the usual form of a text that names materials.

    Examples
    --------
    >>> tidy_materials("warp=Card: red, weft=birch-veneer")
    'warp=card:red,weft=birch-veneer'
    """
    return format_by_bunch(parse_materials(text), lambda name: "".join(_split_sort(name)))


def materials_in_use(
    materials: ByBunch[str], user_materials: Sequence[Material]
) -> tuple[Material, ...]:
    """Return those of the user's own materials that are named, in order of the alphabet.

    Of two of one name the later counts; one that is just as ours is left out.

    Examples
    --------
    >>> felt = replace(material_named("card"), name="felt")
    >>> materials_in_use((("warp", "felt:red"), ("weft", "card")), [felt]) == (felt,)
    True
    """
    named = {_split_sort(name)[0] for _, name in materials}
    in_use = {material.name: material for material in user_materials if material.name in named}
    library = material_library()
    return tuple(in_use[name] for name in sorted(in_use) if in_use[name] not in library)


def _split_sort(name: str) -> tuple[str, str, str]:
    """Return the name of a material, the colon, and the sort after it, if there is one."""
    plain, colon, sort = (word.strip() for word in name.lower().partition(":"))
    return plain, colon, sort


def sort_of_material(name: str, user_materials: Sequence[Material] = ()) -> Material:
    """Return a material of the library, of a certain sort if one is named after a colon.

    Parameters
    ----------
    name : str
    user_materials : sequence of Material
        Beside those of the library.

    Examples
    --------
    >>> sort_of_material("card:red").full_title
    'Card, 300 g/m², red'
    """
    plain, colon, sort = _split_sort(name)
    material = material_named(plain, user_materials)
    if not colon:
        return material
    if not _SORT.fullmatch(sort):
        raise InputError(
            f"{name[:60]!r} is not a valid sort of {material.name}: after the colon, write up to "
            "24 letters, digits, spaces and hyphens, such as card:red"
        )
    return replace(material, name=f"{material.name}:{sort}", title=f"{material.title}, {sort}")
