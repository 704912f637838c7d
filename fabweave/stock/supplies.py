"""Say what each bunch of threads is cut from: a material, its sheets, and the gap on them."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import agree, few_of
from fabweave.stock.material import (
    Material,
    laid_across,
    material_library,
    material_named,
    with_thickness,
)
from fabweave.stock.per_bunch import NAMED, ByBunch, bunch_number, format_by_bunch, split_by_bunch
from fabweave.stock.sheet_size import SheetSize, check_bed, format_stock, on_bed, stock_for


@dataclass(frozen=True)
class Supply:
    """A material with its sheets, and the bunches that are cut from it.

    Parameters
    ----------
    bunches : tuple of str
        As they were named; none if all threads are cut from it.
    material : Material
    sheets : tuple of SheetSize
    gap_mm : float
        Least distance between two pieces.
    """

    bunches: tuple[str, ...]
    material: Material
    sheets: tuple[SheetSize, ...]
    gap_mm: float

    @property
    def numbers(self) -> tuple[int, ...]:
        """The numbers of its bunches."""
        return tuple(bunch_number(name) for name in self.bunches)

    @property
    def description(self) -> str:
        """Its material in words, with the thickness."""
        return self.material.description


@dataclass(frozen=True)
class Supplies:
    """Everything that a job is cut from.

    Bunches whose material, thickness, gap and sheets are equal share one supply, and so one
    nesting. Whoever wants them apart, as the two are of different colours, says so in the name:
    ``warp=card:red,weft=card:blue``.

    Parameters
    ----------
    each : tuple of Supply
        One for all threads, or several in the order of their bunches.
    sheets : tuple of SheetSize
        The stock of all, as settings hold it: sheets that are for one bunch only name it.
    margin_mm : float
        Least distance from the edge of a sheet.
    rotations : str
        How pieces may lie, as ``--rotations`` says it.
    mirrored : bool
        Whether whole sheets are drawn mirrored, as the inside of pieces is engraved.
    former : Supply, optional
        What a former is cut from.
    """

    each: tuple[Supply, ...]
    sheets: tuple[SheetSize, ...]
    margin_mm: float = 0.0
    rotations: str = "auto"
    mirrored: bool = False
    former: Supply | None = None

    def as_nested(self, sheets: tuple[SheetSize, ...]) -> tuple[SheetSize, ...]:
        """Return sheets as pieces are nested on them.

        Where sheets are drawn mirrored, their outlines are mirrored before, and so lie on the bed
        as they are.
        """
        return tuple(sheet.mirrored() for sheet in sheets) if self.mirrored else sheets

    @property
    def rolls(self) -> bool:
        """Whether strips are cut from rolls; then all are."""
        return any(sheet.is_roll for sheet in self.sheets)

    @property
    def several(self) -> bool:
        """Whether threads are cut from different supplies."""
        return len(self.each) > 1

    @property
    def materials(self) -> tuple[Material, ...]:
        """The material of each supply."""
        return tuple(supply.material for supply in self.each)

    @property
    def only(self) -> Material:
        """The material of a job that has a single one."""
        (supply,) = self.each
        return supply.material

    @property
    def titles(self) -> str:
        """The names of all materials for people."""
        return " and ".join(material.description for material in self.materials)

    @property
    def description(self) -> str:
        """All materials in words."""
        if not self.several:
            return self.each[0].description
        return "; ".join(
            f"{supply.description} "
            f"({', '.join(one if one in NAMED else f'bunch {one}' for one in supply.bunches)})"
            for supply in self.each
        )

    @property
    def gap_mm(self) -> float:
        """The greatest gap of all."""
        return max(supply.gap_mm for supply in self.each)

    def by_bunch(self, value: Callable[[Supply], float]) -> float | ByBunch[float]:
        """Return a figure of the only supply, or of each bunch's, as settings hold it."""
        if not self.several:
            return value(self.each[0])
        return tuple((name, value(supply)) for _, name, supply in self._by_number())

    def _by_number(self) -> list[tuple[int, str, Supply]]:
        """Return number, name and supply of each bunch."""
        numbered = [
            (bunch_number(name), name, supply) for supply in self.each for name in supply.bunches
        ]
        return sorted(numbered, key=lambda entry: entry[0])

    def across(self) -> "Supplies":
        """Return the same with all pieces across the grain, where a material has one."""
        return replace(
            self,
            each=tuple(
                replace(supply, material=laid_across(supply.material)) for supply in self.each
            ),
        )

    def of(self, bunches: IntArray) -> IntArray:
        """Return which supply each thread is cut from, (T,).

        Parameters
        ----------
        bunches : (T,) int array
            The bunch of each thread.
        """
        if not self.several:
            return np.zeros(len(bunches), dtype=np.int64)
        supply_of_bunch = np.empty(
            max(max(supply.numbers) for supply in self.each) + 1, dtype=np.int64
        )
        for index, supply in enumerate(self.each):
            supply_of_bunch[list(supply.numbers)] = index
        return supply_of_bunch[bunches]

    def thickness_mm(self, bunches: IntArray) -> FloatArray:
        """Return the thickness of each thread's material, (T,)."""
        return np.array([material.thickness_mm for material in self.materials])[self.of(bunches)]

    def require(self, bunches: IntArray) -> None:
        """Raise InputError unless exactly the bunches that there are have a supply.

        Parameters
        ----------
        bunches : (T,) int array
            The bunch of each thread.
        """
        if not self.each[0].bunches:
            return
        count = int(bunches.max(initial=-1)) + 1
        names = [name for supply in self.each for name in supply.bunches]
        numbers = {bunch_number(name) for name in names}
        two = count == len(NAMED)
        wrong = [n for n in names if bunch_number(n) >= count or (n in NAMED and not two)]
        missing = sorted(set(range(count)) - numbers)
        if not wrong and not missing:
            return
        bunch_names = list(NAMED) if two else [str(number) for number in range(count)]
        problems = []
        if wrong:
            problems.append(f"there is no bunch {', '.join(wrong)}")
        if missing:
            unnamed = [bunch_names[number] for number in missing]
            problems.append(f"no material is given for {few_of(unnamed)}")
        raise InputError(
            f"materials by bunch must name every bunch of the weave once, but "
            f"{' and '.join(problems)}. The weave has {count} bunch{'es' * (count != 1)}: "
            f"{few_of(bunch_names)}"
        )


_Value = TypeVar("_Value")
_SORT = re.compile(r"[a-z0-9][a-z0-9 -]{0,23}")


def plan_supplies(
    materials: ByBunch[str],
    thickness_mm: ByBunch[float | None],
    gap_mm: ByBunch[float | None],
    sheets: Sequence[SheetSize],
    user_materials: Sequence[Material] = (),
    bed: SheetSize | None = None,
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
    bed : SheetSize, optional
        The largest sheet that the machine takes, either way round.

    Returns
    -------
    Supplies

    Raises
    ------
    InputError
        If there is no such material, a sheet is larger than the bed, or some settings name other
        bunches than the rest.

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
    check_bed(sheets, bed)
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
            stock = (on_bed(SheetSize(*material.sheet_mm), bed),)
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
