"""Say what each bunch of threads is cut from: a material, its sheets, and the gap on them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.stock.bending import laid_across
from fabweave.stock.material import Material
from fabweave.stock.per_bunch import NAMED, ByBunch, bunch_number
from fabweave.stock.sheet_size import SheetSize


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
        return " and ".join(material.description for material in self.materials)

    @property
    def description(self) -> str:
        """All materials in words."""
        if not self.several:
            return self.each[0].description
        return "; ".join(
            f"{supply.description} ({', '.join(_in_words(name) for name in supply.bunches)})"
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


def _in_words(name: str) -> str:
    return name if name in NAMED else f"bunch {name}"
