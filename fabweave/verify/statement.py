"""Hold what a job states to what it should state, and say in plain words where it does not."""

import csv
import math
import re
import struct
import traceback
import zlib
from collections import Counter
from collections.abc import Iterable
from typing import Any

from shapely.errors import ShapelyError

from fabweave.verify.report import FINDINGS_KEPT, MEANINGS, Check, Measure

#: So many items of a list, and so many letters of a value, are told in a finding.
_ITEMS, _LETTERS = 5, 120
#: By the end of a quantity's name: how its unit is written.
_UNITS = {"_mm": " mm", "_mm2": " mm²", "_deg": "°"}


#: What files that are not as agreed may raise anywhere.
_BY_FILES = (
    LookupError, ValueError, TypeError, ArithmeticError, AttributeError, ShapelyError, MemoryError,
    RecursionError, SyntaxError, OSError, re.error, zlib.error, struct.error, csv.Error,
)  # fmt: skip


class Tally:
    """Collect what one check counts, measures and finds.

    Examples
    --------
    >>> tally = Tally("sheets")
    >>> pair = tally.at("sheet_01", "pieces A1 and B2")
    >>> pair.at_least("gap_mm", 2.5, 3.0, "they are {} apart")
    False
    >>> result = tally.result()
    >>> result.ok, result.count, result.worst, result.findings[0]
    (False, 1, 2.5, 'sheet_01, pieces A1 and B2: they are 2.5000 mm apart (at least 3 mm)')
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._count = 0
        self._found = 0
        self._findings: list[str] = []
        self._faults: list[str] = []
        self._measured: dict[str, tuple[float, Measure]] = {}

    def at(self, *where: str) -> "Place":
        """Return a place in the job's files: each word narrows the one before it."""
        return Place(self, where)

    def count(self, number: int = 1) -> None:
        """Count things that were checked."""
        self._count += number

    def fail(self, finding: str) -> None:
        """Keep a finding."""
        self._found += 1
        if len(self._findings) < FINDINGS_KEPT:
            self._findings.append(finding)

    def unfinished(self, what: str, error: Exception) -> None:
        """Keep that something could not be finished: files that contradict one another, or we.

        Files can break any assumption, and then an error of these kinds is a finding about them.
        Any other is a fault of the verifier, and is told as such.
        """
        said = f"{type(error).__name__}: {str(error)[:_LETTERS]}"
        if isinstance(error, _BY_FILES):
            self.fail(f"{what}: the files are not as agreed, or contradict one another ({said})")
            return
        self.fail(f"{what}: a fault of the verifier, which says nothing about the job ({said})")
        self._faults.append("".join(traceback.format_exception(error)))

    def measure(self, quantity: str, value: float, limit: float, *, least: bool) -> bool:
        """Count a value that may not exceed (or, with ``least``, fall below) a limit; judge it."""
        self._count += 1
        excess = float(limit - value if least else value - limit)
        if quantity not in self._measured or not excess <= self._measured[quantity][0]:
            self._measured[quantity] = (excess, Measure(quantity, float(value), float(limit)))
        return excess <= 0.0  # NaN objects

    def result(self) -> Check:
        """Return the result."""
        ranked = [
            (excess / max(abs(measure.limit), 1e-9), measure.value)
            for excess, measure in self._measured.values()
        ]
        return Check(
            name=self._name,
            meaning=MEANINGS[self._name],
            ok=self._found == 0,
            count=self._count,
            worst=max(ranked)[1] if ranked else None,
            findings=tuple(self._findings),
            found=self._found,
            measured=tuple(measure for _, measure in self._measured.values()),
            faults=tuple(self._faults),
        )


class Place:
    """A place in a job's files, such as a row of a table, where something is stated.

    Each method holds one statement to what it should be, counts it, and says whether it holds. If
    not, a finding names the place, what is stated there, and what should be.

    Examples
    --------
    >>> tally = Tally("stock")
    >>> sheet = tally.at("waste.json", "sheet 2")
    >>> sheet.number("waste_mm2", 1200.0, 1250.5, within=0.01)
    False
    >>> sheet.same("pieces", ["A1", "A4"], ["A1", "A2"])
    False
    >>> sheet.equal("the name", "sheet_02", "sheet_02")
    True
    >>> sheet.against("job.toml").equal("price", None, 3.5)
    False
    >>> for finding in tally.result().findings:
    ...     print(finding)
    waste.json, sheet 2: waste_mm2 is 1200, but should be 1250.5
    waste.json, sheet 2: pieces lack A2, and have A4, which should not be there
    waste.json, sheet 2: price is nothing, but should be 3.5, as in job.toml
    """

    def __init__(self, tally: Tally, where: tuple[str, ...], source: str = "") -> None:
        self._tally = tally
        self._where = where
        self._source = source

    def __str__(self) -> str:
        """Return what the place is called in findings."""
        return ", ".join(self._where)

    def at(self, *where: str) -> "Place":
        """Return a place within this one."""
        return Place(self._tally, self._where + where, self._source)

    def against(self, source: str) -> "Place":
        """Return this place, where values and numbers are to be those of another file."""
        return Place(self._tally, self._where, f", as in {source}")

    def count(self, number: int = 1) -> None:
        """Count things that were checked."""
        self._tally.count(number)

    def fail(self, finding: str) -> None:
        """Keep a finding, but count nothing."""
        self._tally.fail(f"{self}: {finding}")

    def expect(self, condition: object, finding: str) -> bool:
        """Hold the place to a condition of its own kind."""
        self._tally.count()
        if not condition:
            self.fail(finding)
        return bool(condition)

    def equal(self, name: str, stated: object, wanted: object) -> bool:
        """Hold a value to another, exactly."""
        return self._judge(name, stated, wanted, good=bool(stated == wanted))

    def number(
        self, name: str, stated: object, wanted: float | None, *, within: float = 0.0
    ) -> bool:
        """Hold a number to what it comes to; what nothing is known of may not be stated."""
        if wanted is None:
            return self._judge(name, stated, None, good=stated is None)
        # Written so that NaN objects.
        return self._judge(name, stated, wanted, good=abs(as_number(stated) - wanted) <= within)

    def same(self, names: str, stated: Iterable[Any], wanted: Iterable[Any]) -> bool:
        """Hold a list to another, in whatever order: nothing missing, nothing too many."""
        there, due = Counter(iter(stated)), Counter(iter(wanted))
        self._tally.count()
        parts = [
            text.format(_listed(items))
            for text, items in (
                ("lack {}", due - there), ("have {}, which should not be there", there - due),
            )
            if items
        ]  # fmt: skip
        if parts:
            self.fail(f"{names} {', and '.join(parts)}")
        return not parts

    def at_most(self, quantity: str, value: float, limit: float, meaning: str) -> bool:
        """Hold a measured value to a limit that it may not exceed; ``{}`` stands for the value."""
        return self._measure(quantity, value, limit, meaning, least=False)

    def at_least(self, quantity: str, value: float, limit: float, meaning: str) -> bool:
        """Hold a measured value to a limit that it may not fall below."""
        return self._measure(quantity, value, limit, meaning, least=True)

    def _measure(
        self, quantity: str, value: float, limit: float, meaning: str, *, least: bool
    ) -> bool:
        good = self._tally.measure(quantity, value, limit, least=least)
        if not good:
            unit = _UNITS.get(quantity[quantity.rfind("_") :], "")
            finding = meaning.replace("{}", f"{value:.4f}{unit}")
            self.fail(f"{finding} (at {'least' if least else 'most'} {limit:g}{unit})")
        return good

    def _judge(self, name: str, stated: object, wanted: object, *, good: bool) -> bool:
        self._tally.count()
        if not good:
            wants = f"{_shown(wanted)}{self._source}"
            self.fail(f"{name} is {_shown(stated)}, but should be {wants}")
        return good


def as_number(value: object) -> float:
    """Return a number that a file states; NaN for anything else, which fails every comparison."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return math.nan


def stated_number(record: object, key: str) -> float:
    """Return a number of a record; NaN if it states none."""
    return as_number(record.get(key) if isinstance(record, dict) else None)


def cell_number(text: str) -> float | None:
    """Return the number in a cell of a table: None if it is empty, NaN if it holds no number."""
    try:
        return float(text) if text else None
    except ValueError:
        return math.nan


def _shown(value: object) -> str:
    """Return a value as findings show it."""
    if isinstance(value, float):
        return f"{value:.9g}"
    text = "nothing" if value is None else repr(value)
    return text if len(text) <= _LETTERS else f"{text[:_LETTERS]} …"


def _listed(items: Counter[Any]) -> str:
    """Name the first few of some items."""
    names = [str(item) for item in sorted(items.elements(), key=str)]
    more = len(names) - _ITEMS
    return ", ".join(names[:_ITEMS]) + (f" and {more} more" if more > 0 else "")
