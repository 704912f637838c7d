"""Say what each bunch of threads is cut from: a material, its sheets, and the gap on them."""

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, TypeVar

import numpy as np

from fabweave.arrays import FloatArray, IntArray, frozen
from fabweave.bybunch import NAMED, ByBunch, bunch_number
from fabweave.errors import InputError
from fabweave.sheet.layout import Layout, SheetSize
from fabweave.sheet.material import Material, material_named, with_thickness
from fabweave.sheet.stock import format_stock, stock_for
from fabweave.words import agree

_Value = TypeVar("_Value")
_SORT = re.compile(r"[a-z0-9][a-z0-9 -]{0,23}")


class _Threaded(Protocol):
    """What belongs to a thread, such as a piece."""

    @property
    def thread(self) -> int:
        """Its number."""


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
    def told(self) -> str:
        """Its material in words, with the thickness."""
        return f"{self.material.title}, {self.material.thickness_mm:g} mm"


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
    """

    each: tuple[Supply, ...]
    sheets: tuple[SheetSize, ...]

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
        return " and ".join(material.title for material in self.materials)

    @property
    def told(self) -> str:
        """All materials in words."""
        if not self.several:
            return self.each[0].told
        return "; ".join(
            f"{supply.told} ({', '.join(_in_words(name) for name in supply.bunches)})"
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
        found = [
            (bunch_number(name), name, supply) for supply in self.each for name in supply.bunches
        ]
        return sorted(found, key=lambda one: one[0])

    def of(self, bunches: IntArray) -> IntArray:
        """Return which supply each thread is cut from, (T,).

        Parameters
        ----------
        bunches : (T,) int array
            The bunch of each thread.
        """
        if not self.several:
            return np.zeros(len(bunches), dtype=np.int64)
        found = np.empty(max(max(supply.numbers) for supply in self.each) + 1, dtype=np.int64)
        for index, supply in enumerate(self.each):
            found[list(supply.numbers)] = index
        return found[bunches]

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
        asked = {bunch_number(name) for name in names}
        two = count == len(NAMED)
        wrong = [n for n in names if bunch_number(n) >= count or (n in NAMED and not two)]
        missing = sorted(set(range(count)) - asked)
        if not wrong and not missing:
            return
        there = list(NAMED) if two else [str(number) for number in range(count)]
        problems = []
        if wrong:
            problems.append(f"there is no bunch {', '.join(wrong)}")
        if missing:
            unnamed = ", ".join(there[number] for number in missing[:8])
            problems.append(f"nothing is said of {unnamed}")
        raise InputError(
            "materials by bunch must name every bunch of the weave once: "
            f"{' and '.join(problems)}. Its threads part into {count} bunch{'es' * (count != 1)}: "
            f"{', '.join(there[:8])}{', …' if count > 8 else ''}"
        )


@dataclass(frozen=True, eq=False)
class Allotment:
    """Which supply every thread and every sheet of a job is of.

    Parameters
    ----------
    supplies : Supplies
    threads : (T,) int array
        The supply of each thread, as an index of ``supplies.each``.
    sheets : (S,) int array
        That of each sheet.
    """

    supplies: Supplies
    threads: IntArray
    sheets: IntArray

    def __post_init__(self) -> None:
        """Freeze the arrays."""
        for name in ("threads", "sheets"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def of_thread(self, thread: int) -> Supply:
        """Return what a thread is cut from."""
        return self.supplies.each[int(self.threads[thread])]

    def of_pieces(self, pieces: Sequence[_Threaded]) -> list[int]:
        """Return the supply of each piece, as an index of ``supplies.each``."""
        return self.threads[[piece.thread for piece in pieces]].tolist()

    def of_sheet(self, sheet: int) -> Supply:
        """Return what a sheet is of, counted from 0."""
        return self.supplies.each[int(self.sheets[sheet])]

    def captions(self) -> tuple[str, ...]:
        """Return what each sheet is of, (S,), in few letters."""
        told = [material.caption for material in self.supplies.materials]
        return tuple(told[index] for index in self.sheets.tolist())


def allot(
    supplies: Supplies, bunches: IntArray, layout: Layout, pieces: Sequence[_Threaded]
) -> Allotment:
    """Say which supply every thread and every sheet is of; a sheet is of that of its pieces.

    Parameters
    ----------
    supplies : Supplies
    bunches : (T,) int array
        The bunch of each thread.
    layout : Layout
    pieces : sequence of Piece
    """
    threads = supplies.of(bunches)
    sheets = np.zeros(len(layout.sheets), dtype=np.int64)
    for placement in layout.placements:
        sheets[placement.sheet] = threads[pieces[placement.piece].thread]
    return Allotment(supplies, threads, sheets)


def _in_words(name: str) -> str:
    return name if name in NAMED else f"bunch {name}"


def plan_supplies(
    materials: ByBunch[str],
    thickness_mm: ByBunch[float | None],
    gap_mm: ByBunch[float | None],
    sheets: Sequence[SheetSize],
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
    >>> plan_supplies((("warp", "card"), ("weft", "card")), (("", 0.4),), (("", None),), ()).told
    'Card, 300 g/m², 0.4 mm'
    """
    named = {name: bunch_number(name) for name in _names(materials, thickness_mm, gap_mm, sheets)}
    found: dict[tuple[Material, tuple[SheetSize, ...], float], list[str]] = {}
    added = []
    for name in named or {"": 0}:
        number = named.get(name)
        material = sort_of_material(_value(materials, number))
        thick, gap = _value(thickness_mm, number), _value(gap_mm, number)
        if thick is not None:
            material = with_thickness(material, thick)
        own = _sheets_of(material, number, sheets)
        if not own:
            own = (SheetSize(*material.sheet_mm),)
            added.append(replace(own[0], bunch=name))
        gap = material.gap_mm if gap is None else gap
        found.setdefault((material, own, gap), []).append(name)
    each = tuple(
        Supply(tuple(filter(None, own)), material, own_sheets, gap)
        for (material, own_sheets, gap), own in found.items()
    )
    if len(each) == 1:
        return Supplies(each, each[0].sheets)
    _require_apart(each)
    there = {sheet for supply in each for sheet in supply.sheets}
    kept = [sheet for sheet in sheets if replace(sheet, bunch="") in there]
    return Supplies(each, (*kept, *added))


def _require_apart(each: Sequence[Supply]) -> None:
    """Raise InputError if some sheets are counted, and it is not said for which supply they are."""
    owners = Counter(
        sheet for supply in each for sheet in set(supply.sheets) if sheet.quantity is not None
    )
    shared = [sheet for sheet, count in owners.items() if count > 1]
    if shared:
        raise InputError(
            f"{agree(len(shared), '{n} [entry|entries]')} of the stock (such as "
            f"{shared[0].name or format_stock(shared[0])}) could be of any of "
            f"{len(each)} materials, and their number is limited: say for which bunch, as in "
            f"--sheet {each[-1].bunches[0]}={format_stock(shared[0])}, or in the list of what "
            "material"
        )


def _sheets_of(
    material: Material, number: int | None, sheets: Sequence[SheetSize]
) -> tuple[SheetSize, ...]:
    """Return the sheets that are for a bunch and of its material."""
    there = [
        replace(sheet, bunch="")
        for sheet in sheets
        if not sheet.bunch or bunch_number(sheet.bunch) == number
    ]
    known = (None, material.name, material.name.partition(":")[0])
    own = tuple(sheet for sheet in there if sheet.material in known)
    return own or stock_for(there, material.name)


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
        own = {bunch_number(name): name for name, _ in values if name}
        if own and spoken and set(own) != set(spoken):
            told = ", ".join(own[number] for number in sorted(own))
            before = ", ".join(spoken[number] for number in sorted(spoken))
            raise InputError(
                f"the {what} is given for {told}, and other settings for {before}: name the same "
                "bunches, all of them, or give one value for all"
            )
        spoken = spoken or own
    of_sheets = {bunch_number(sheet.bunch): sheet.bunch for sheet in sheets if sheet.bunch}
    if of_sheets and spoken and not set(of_sheets) <= set(spoken):
        strange = ", ".join(name for number, name in of_sheets.items() if number not in spoken)
        before = ", ".join(spoken[number] for number in sorted(spoken))
        raise InputError(f"a sheet is for {strange}, and materials are for {before}")
    if of_sheets and not spoken:
        raise InputError(
            f"a sheet is for {', '.join(of_sheets.values())}, but there is one material for all: "
            "give materials by bunch, too, such as --material warp=card,weft=card"
        )
    return [spoken[number] for number in sorted(spoken)]


def _value(values: ByBunch[_Value], number: int | None) -> _Value:
    """Return what holds for a bunch: its own value, or that for all."""
    for name, value in values:
        if not name or bunch_number(name) == number:
            return value
    raise ValueError(f"nothing is said of bunch {number}")


def sort_of_material(name: str) -> Material:
    """Return a material of the library, of a certain sort if one is named after a colon.

    Examples
    --------
    >>> sort_of_material("card:red").title
    'Card, 300 g/m², red'
    """
    plain, colon, sort = (word.strip() for word in name.lower().partition(":"))
    material = material_named(plain)
    if not colon:
        return material
    if not _SORT.fullmatch(sort):
        raise InputError(
            f"{name[:60]!r} names no sort of {material.name}: after the colon, write letters, "
            "digits, spaces and hyphens, 24 at most, such as card:red"
        )
    return replace(material, name=f"{material.name}:{sort}", title=f"{material.title}, {sort}")
