"""Hold the groups of a DXF file as columns, and find what entities say by group code."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from fabweave.verify.drawing import Floats, Ints, ReadError
from fabweave.verify.read.content import read_content

#: Groups that name something: entities, layers, line types, applications and pieces.
_NAMES = (0, 2, 6, 8, 1000, 1001)


@dataclass(frozen=True, eq=False)
class Groups:
    """Pairs of group code and value."""

    code: Ints
    value: Sequence[str]

    def part(self, begin: int, end: int) -> "Groups":
        """Return some of the groups."""
        return Groups(self.code[begin:end], self.value[begin:end])

    def sections(self) -> dict[str, "Groups"]:
        """Return the groups of each section.

        Raises
        ------
        ReadError
            If a section has no name, or there are two of a name.
        """
        found: dict[str, Groups] = {}
        marks = [
            at
            for at in np.flatnonzero(self.code == 0).tolist()
            if self.value[at] in ("SECTION", "ENDSEC")
        ]
        for mark, end in pairwise([*marks, len(self.code)]):
            if self.value[mark] != "SECTION":
                continue
            if mark + 1 >= len(self.code) or self.code[mark + 1] != 2:
                raise ReadError("a section has no name")
            name = self.value[mark + 1]
            if name in found:
                raise ReadError(f"there are two sections {name}")
            found[name] = self.part(mark + 2, end)
        return found


def read_groups(path: Path) -> Groups:
    """Read a DXF text file to its end.

    Raises
    ------
    ReadError
        If a group code is no number, or the file is truncated.
    """
    text = read_content(path).decode("utf-8", errors="replace").replace("\r\n", "\n")
    lines = text.split("\n")
    values = lines[1::2]
    codes = lines[: 2 * len(values) : 2]
    try:
        groups = Groups(np.fromiter(map(int, codes), np.int64, len(codes)), values)
    except (ValueError, OverflowError) as error:
        raise ReadError(f"a line that should be a group code is not a number: {error}") from error
    if not values or groups.code[-1] != 0 or values[-1] != "EOF":
        raise ReadError("the file does not end with EOF: it is truncated")
    # Programs differ in whether blanks belong to a name, and in what comes after the end.
    if any(values[at] != values[at].strip() for at in np.flatnonzero(np.isin(groups.code, _NAMES))):
        raise ReadError("a name has blanks around it")
    if sum(values[at] == "EOF" for at in np.flatnonzero(groups.code == 0).tolist()) > 1:
        raise ReadError("the file goes on after EOF")
    return groups


@dataclass(frozen=True, eq=False)
class Entities:
    """The entities of a section: each begins at a group 0.

    ``owner`` is the entity of each group; -1 for what comes before the first entity.
    """

    groups: Groups

    @cached_property
    def begin(self) -> Ints:
        """Where each entity begins."""
        return np.flatnonzero(self.groups.code == 0)

    @cached_property
    def owner(self) -> Ints:
        """The entity of each group."""
        return np.cumsum(self.groups.code == 0) - 1

    @cached_property
    def kind(self) -> list[str]:
        """What each entity is."""
        return self.text(self.begin)

    def at(self, *codes: int) -> Ints:
        """Return the groups of entities that have one of some codes, in file order."""
        wanted = (
            np.isin(self.groups.code, codes) if len(codes) > 1 else self.groups.code == codes[0]
        )
        return np.flatnonzero(wanted & (self.owner >= 0))

    def first(self, places: Ints) -> Ints:
        """Return those groups that are the first of their entity, from a list in file order."""
        return places[np.diff(self.owner[places], prepend=-1) > 0]

    def text(self, places: Ints) -> list[str]:
        """Return the values of some groups."""
        return list(map(self.groups.value.__getitem__, places.tolist()))

    def texts(self, places: Ints, missing: str) -> list[str]:
        """Return a value for each entity: the first of some groups, in file order."""
        result = [missing] * len(self.begin)
        first = self.first(places)
        for entity, value in zip(self.owner[first].tolist(), self.text(first), strict=True):
            result[entity] = value
        return result

    def numbers(self, places: Ints) -> Floats:
        """Return the values of some groups as numbers.

        Raises
        ------
        ReadError
            If one is not a finite number.
        """
        values = self.text(places)
        try:
            result = np.fromiter(map(float, values), np.float64, len(values))
        except ValueError as error:
            raise ReadError(f"{self.name(places[0])} or a later one: {error}") from error
        if not np.all(np.isfinite(result)):
            worst = places[np.flatnonzero(~np.isfinite(result))[0]]
            raise ReadError(f"{self.name(worst)} has a coordinate or value that is not finite")
        return result

    def first_numbers(self, code: int, among: Ints, default: float | None = None) -> Floats:
        """Return for some entities, in file order, the first number with a code.

        Raises
        ------
        ReadError
            If one is not a finite number, or missing without a default.
        """
        wanted = np.zeros(len(self.begin), dtype=bool)
        wanted[among] = True
        places = self.at(code)
        places = places[wanted[self.owner[places]]]
        values = self.numbers(places)
        first = np.diff(self.owner[places], prepend=-1) > 0
        result = np.full(len(self.begin), np.nan if default is None else default)
        result[self.owner[places[first]]] = values[first]
        lost = among[np.isnan(result[among])]
        if len(lost):
            raise ReadError(f"{self.name(self.begin[lost[0]])}: group {code} is missing")
        return result[among]

    def name(self, place: int | np.integer) -> str:
        """Name the entity of a group by its kind and handle."""
        return self.names[int(self.owner[place])]

    @cached_property
    def names(self) -> list[str]:
        """The kind and handle of each entity, or its number where it has no handle."""
        handles = self.texts(self.at(5), "")
        return [
            f"{kind} {handle or number}"
            for number, (kind, handle) in enumerate(zip(self.kind, handles, strict=True), start=1)
        ]
