"""Say what an option takes: how its value is read from text, checked, and written in job.toml.

What stands in other rooms is named by text here, and imported when a value needs it: the table of
options is read before any command knows what it is asked for.
"""

import math
import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import import_module
from inspect import signature
from numbers import Integral, Real
from typing import Any, TypeAlias

from fabweave.core.entries import Accept, list_of
from fabweave.core.errors import InputError
from fabweave.core.messages import shown
from fabweave.core.units import parse_length
from fabweave.stock.per_bunch import by_bunch, format_by_bunch, split_by_bunch

#: Returns the words that an option takes.
Words: TypeAlias = Callable[[], Iterable[str]]
#: Lengths are no smaller than what any machine cuts, and no greater than the largest object.
LEAST_MM, MOST_MM = 0.001, 1e6
#: TOML holds whole numbers up to this.
MOST_WHOLE = 2**63 - 1
#: A name that people give stands in one line.
_LONGEST_LINE = 80


def load(place: str) -> Any:
    """Return what stands at a place, such as ``fabweave.stock.rotations.parse_rotations``."""
    module, _, name = place.rpartition(".")
    return getattr(import_module(module), name)


def later(place: str) -> Callable[..., Any]:
    """Return a function that calls what stands at a place, which is imported only then."""

    def call(*values: Any) -> Any:
        return load(place)(*values)

    return call


@dataclass(frozen=True)
class Kind:
    """What an option takes.

    Parameters
    ----------
    metavar : str
        Stands for the value in help.
    expected : str
        What a value must be, for errors; ``{choices}`` stands for the words that it takes.
    accept : callable
        Returns a value as settings hold it, or None if it is not what is expected.
    read : callable
        Returns the value that a text means, or the text where it means none.
    write : callable
        Returns a value as job.toml has it; None if it is left out.
    unit : str
        In which plain numbers count.
    automatic : str
        The word that leaves the choice to fabweave.
    words : callable
        Returns the words that it takes, if it takes certain words.
    flag, repeatable : bool
        Whether it has no value but is said or not, and whether it may be said several times.
    textual : bool
        Whether a plain number is read as if it were typed.
    of_table : callable or None
        Returns the value that a table of job.toml describes, if there may be one.
    """

    metavar: str
    expected: str
    accept: Accept
    read: Callable[[str], Any]
    write: Callable[[Any], Any] = lambda value: value
    unit: str = ""
    automatic: str = ""
    words: Words = tuple
    flag: bool = False
    repeatable: bool = False
    textual: bool = False
    of_table: Callable[[Mapping[str, Any]], Any] | None = None

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that it takes, if it takes certain words."""
        return tuple(self.words())

    @property
    def told(self) -> str:
        """What a value must be."""
        return self.expected.replace("{choices}", ", ".join(self.choices))

    def parse(self, value: Any) -> Any:
        """Return what was typed, what job.toml has, or a plain value, as settings hold it.

        Raises
        ------
        InputError
            If the option does not take it; the message says what it takes.
        """
        if isinstance(value, str) and value and value == self.automatic:
            return None
        if self.repeatable and isinstance(value, list | tuple):
            return self.hold(tuple(part for one in value for part in self._parse_one(one)))
        return self._parse_one(value)

    def _parse_one(self, value: Any) -> Any:
        """Return what was said once, as settings hold it."""
        if isinstance(value, os.PathLike):
            value = os.fspath(value)
        if self.textual and not math.isnan(_as_number(value)):
            value = f"{_as_number(value):.10g}"
        if self.of_table is not None and isinstance(value, Mapping):
            value = self.of_table(value)
        return self.hold(self.read(value) if isinstance(value, str) else value)

    def argument(self, name: str, value: Any) -> Any:
        """Return the value of an argument of a function, as it was given, in the usual form.

        Raises
        ------
        InputError
            If it is not what is expected; the message says the name, too.

        Examples
        --------
        >>> whole(1, 3).argument("sheet", 2)
        2
        >>> whole(1, 3).argument("sheet", 4)
        Traceback (most recent call last):
            ...
        fabweave.core.errors.InputError: sheet: 4 is not a whole number from 1 to 3
        """
        try:
            return self.parse(value)
        except InputError as error:
            raise InputError(f"{name}: {error}") from error

    def hold(self, value: Any) -> Any:
        """Return a value as settings hold it.

        Raises
        ------
        InputError
            If it is not what is expected.
        """
        found = self.accept(value)
        if found is None:
            raise InputError(f"{shown(value)} is not {self.told}")
        return found


def as_it_is(value: Any) -> Any:
    """Return a value."""
    return value


def _as_number(value: Any) -> float:
    """Return a plain number, which may be beyond all bounds; NaN for what is none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def flag() -> Kind:
    """Return the kind of what is said, or not."""

    def accept(value: Any) -> bool | None:
        return value if isinstance(value, bool) else None

    return Kind("", "True or False", accept, as_it_is, flag=True)


def choice(words: tuple[str, ...] | str) -> Kind:
    """Return the kind of one of a few words, or of those that stand at a place."""

    def known() -> tuple[str, ...]:
        return tuple(load(words)) if isinstance(words, str) else words

    def accept(value: Any) -> str | None:
        return value if isinstance(value, str) and value in known() else None

    return Kind("", "one of {choices}", accept, as_it_is, words=known)


def whole(least: int, most: int) -> Kind:
    """Return the kind of whole numbers in a range."""

    def accept(value: Any) -> int | None:
        fits = isinstance(value, Integral) and not isinstance(value, bool)
        return int(value) if fits and least <= int(value) <= most else None

    def read(text: str) -> Any:
        digits = text.strip().removeprefix("-")
        return int(text) if digits.isascii() and digits.isdigit() and len(digits) < 30 else text

    return Kind("N", f"a whole number from {least} to {most}", accept, read)


def number(below: float = math.inf) -> Kind:
    """Return the kind of numbers greater than 0, and less than a bound."""

    def accept(value: Any) -> float | None:
        plain = _as_number(value)
        return plain if 0.0 < plain < below else None

    def read(text: str) -> Any:
        try:
            return float(text)
        except ValueError:
            return text

    end = "" if math.isinf(below) else f" and less than {below:g}"
    return Kind("NUMBER", f"a number greater than 0{end}", accept, read)


def real(least: float = -math.inf, most: float = math.inf) -> Kind:
    """Return the kind of numbers in a range, the ends with it."""

    def accept(value: Any) -> float | None:
        plain = _as_number(value)
        return plain if least <= plain <= most else None

    ends = "" if least == -math.inf else f" from {least:g} to {most:g}"
    return Kind("NUMBER", f"a number{ends}", accept, as_it_is)


def several(one: Kind, count: int) -> Kind:
    """Return the kind of a list, tuple or array of so many values of a kind."""

    def accept(value: Any) -> tuple[Any, ...] | None:
        return list_of(value.tolist() if hasattr(value, "tolist") else value, one.accept, count)

    return Kind("", f"a list of {count}, each {one.told}", accept, as_it_is)


def either(one: Kind, other: Kind) -> Kind:
    """Return the kind of values that are of one kind or of another."""

    def accept(value: Any) -> Any:
        found = one.accept(value)
        return other.accept(value) if found is None else found

    return Kind("", f"{one.told}, or {other.told}", accept, as_it_is)


def called(example: str) -> Kind:
    """Return the kind of functions that can be called as an example shows."""
    count = example.count(",") + 1

    def accept(value: Any) -> Any:
        if not callable(value) or isinstance(value, type):
            return None
        try:
            signature(value).bind(*range(count))
        except TypeError:
            return None
        except ValueError:  # some functions of C do not say what they take
            pass
        return value

    return Kind("", f"a function that is called as {example}", accept, as_it_is)


def length(
    most: float,
    *,
    least: float = LEAST_MM,
    zero: str | None = None,
    automatic: str = "",
    metavar: str = "LENGTH",
) -> Kind:
    """Return the kind of lengths in millimetres.

    Parameters
    ----------
    most, least : float
        The range, in millimetres: what lies outside is a slip of the unit, and arithmetic would get
        coarse, or layouts large, with it.
    zero : str or None
        How job.toml has a length of 0; None if 0 is no length here, empty if it is left out.
    automatic : str
        The word that leaves the choice to fabweave.
    metavar : str
    """

    def accept(value: Any) -> float | None:
        plain = _as_number(value)
        return plain if least <= plain <= most or (plain == 0.0 and zero is not None) else None

    def read(text: str) -> float:
        if zero and text == zero:
            return 0.0
        read = parse_length(text, zero_ok=zero is not None)
        if accept(read) is None:
            raise InputError(f"{shown(text)} is not {expected}")
        return read

    def write(value: float | None) -> str | None:
        if value is None or (value == 0.0 and zero == ""):
            return None
        return zero if value == 0.0 and zero is not None else f"{value:.10g}mm"

    ends = f"from {least:g} to {most:.0f} mm" + ("" if zero is None else ", or 0")
    example = "12 or '0.5in'" if most > 100.0 else "0.2 or '0.01in'"
    expected = f"a length {ends}, such as {example}"
    return Kind(metavar, expected, accept, read, write, unit="mm", automatic=automatic)


def length_by_bunch(most: float, *, zero: str | None = None) -> Kind:
    """Return the kind of a length, or of pairs of a bunch's name and its length."""
    one = length(most, zero=zero)

    def accept(value: Any) -> Any:
        if not isinstance(value, tuple):
            return one.accept(value)
        if not value or not all(isinstance(pair, tuple) and len(pair) == 2 for pair in value):
            return None
        # Names are checked as those that are typed.
        split_by_bunch(",".join(f"{name}={each}" for name, each in value), what="length")
        lengths = [one.accept(each) for _, each in value]
        names = [str(name) for name, _ in value]
        return None if None in lengths else tuple(zip(names, lengths, strict=True))

    def read(text: str) -> Any:
        if "=" not in text:
            return one.read(text)
        pairs = split_by_bunch(text, what="length")
        return tuple((name, one.read(each)) for name, each in pairs)

    def write(value: Any) -> str | None:
        return None if value is None else format_by_bunch(by_bunch(value), one.write)

    expected = f"{one.expected}, or one for each bunch, such as 'warp=2mm,weft=3mm'"
    return Kind(one.metavar, expected, accept, read, write, unit="mm")


def hairline() -> Kind:
    """Return the kind of a line's width, or of the name of a preset whose lines are as wide."""
    width = length(1.0, metavar="LENGTH|NAME")

    def names() -> tuple[str, ...]:
        return tuple(load("fabweave.sheet.presets.preset_names")())

    def accept(value: Any) -> float | None:
        if width.accept(value) is not None:
            load("fabweave.sheet.presets.check_hairline")(float(value))
        return width.accept(value)

    def read(text: str) -> Any:
        if text in names():
            return load("fabweave.sheet.presets.preset_named")(text).hairline_mm
        return width.read(text)

    return Kind(width.metavar, width.expected, accept, read, width.write, unit="mm")


def text(
    metavar: str,
    expected: str,
    parser: str = "",
    *,
    words: Words = tuple,
    form: Callable[[str], object] = as_it_is,
) -> Kind:
    """Return the kind of texts that a parser takes; they are kept in their usual form."""

    def accept(value: Any) -> str | None:
        if not isinstance(value, str):
            return None
        if parser:
            load(parser)(value)
        return str(form(value))

    return Kind(metavar, expected, accept, as_it_is, words=words, textual=True)


def line(metavar: str, expected: str) -> Kind:
    """Return the kind of names that people give: a line of at most 80 characters, in UTF-8."""

    def accept(value: Any) -> str | None:
        if not isinstance(value, str):
            return None
        told = " ".join(value.split())
        return told if told.isprintable() and 0 < len(told) <= _LONGEST_LINE else None

    return Kind(metavar, expected, accept, as_it_is)


def value_of(metavar: str, example: str, parser: str, type_: str, automatic: str = "") -> Kind:
    """Return the kind of values that a parser reads from text, and that are that text again.

    The word ``automatic`` leaves the choice to fabweave.
    """

    def accept(value: Any) -> Any:
        if not isinstance(value, load(type_)):
            return None
        load(parser)(str(value))
        return value

    def write(value: Any) -> str | None:
        return None if value is None else str(value)

    expected = f"{type_.rpartition('.')[2]}, or a text such as {example!r}"
    return Kind(metavar, expected, accept, later(parser), write, textual=True, automatic=automatic)


def place(metavar: str, expected: str, write: Callable[[Any], Any] = as_it_is) -> Kind:
    """Return the kind of the names of files."""

    def accept(value: Any) -> str | None:
        if not (isinstance(value, str) and value.strip() and "\0" not in value):
            return None
        try:
            value.encode()
        except UnicodeEncodeError:
            # job.toml and titles have it, and are in UTF-8.
            told = ascii(value)
            raise InputError(
                f"the name {told} is not in UTF-8, and cannot be written down; rename the file"
            ) from None
        return value

    return Kind(metavar, expected, accept, as_it_is, write)
