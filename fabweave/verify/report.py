"""Hold what was proved about a finished job: one result for each check."""

import csv
import html
import math
import re
import struct
import traceback
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

from shapely.errors import ShapelyError

SCHEMA = "fabweave.verify/1"

#: How many findings of a check are kept in words; all are counted.
FINDINGS_KEPT = 8

#: Every check in the order of the report, with its one-line meaning.
MEANINGS: Mapping[str, str] = MappingProxyType(
    {
        "seal": "the folder holds the files that were made, unchanged, and no others",
        "files": "every file is there, can be read, keeps its schema, and every reference resolves",
        "source": "the woven mesh has the size that is asked for, and the faces of what was given",
        "mesh-walks": "the threads are exactly the straight-ahead walks of the woven mesh",
        "over-under": "each crossing has one strand over and one under, and every record agrees",
        "pattern": "the weave has the pattern and the broken conditions that it claims",
        "space": "in the model the over strand stands outside the under strand at each crossing",
        "clearance": "ribbons are nowhere nearer to one another than is said",
        "bends": "ribbons are nowhere narrower, bent or twisted more than is said",
        "grain": "bends that want it lie across the grain, and what is said of others is so",
        "piece-order": "pieces carry their thread's stations in order and share only joints",
        "joints": "joined pieces, superposed, lap hole on hole, butt, or hold one another",
        "kinds": "pieces of one kind cover one another, face up",
        "crossing-holes": "all strands at a crossing have the same holes; nothing else is cut out",
        "fastened": "fasteners go through the crossings that were to take one, and no others",
        "unfolding": "each piece is the unreflected development of its part of the model",
        "outlines-dxf": "the DXF sheets cut exactly the pieces' outlines and holes, in millimetres",
        "outlines-svg": "the SVG sheets cut exactly the same, and engrave what the DXF engraves",
        "lines": "no side of a line is shorter than a tenth of a millimetre, none lies on another",
        "cut": "the sheets with kerf and micro-joints stand off the pieces by half the kerf",
        "order": "engraving comes before holes and holes before outlines, each inside the outline",
        "colours": "lines have the colours, widths and layers that the machine's preset gives them",
        "labels": "letters are off edges, holes and marks, on the side that is asked for",
        "notes": "what is told on sheets is within them, off their pieces, and legible",
        "sheets": "pieces keep inside the margins of their sheet and apart by the gap",
        "service": "each file for a service cuts its piece alone, and quantities are right",
        "sticks": "the marks of straight strips are those of the plan, kind by kind",
        "cut-list": "the list of cuts has each straight strip once, where and as long as it is",
        "tables": "the tables of pieces, stations and crossings say what the plan says",
        "stock": "sheets, angles and prices are those of the stock in the settings",
        "offcuts": "what is kept of sheets is free, drawn as it is, and listed as stock",
        "rim": "rings along rims unfold exactly, and lie hole on hole on the crossings beside them",
        "former": "a former keeps off all strips, holds together, bears their names, comes out",
        "base": "holes of the board that feet are tied to are about these, wherever it lies",
        "form": "its relaxed strips are those that are cut, and it goes as far as its record says",
        "simple": "outlines are simple, counter-clockwise, free of tiny sides and clear of holes",
        "materials": "every piece is on a sheet of its thread's material",
        "steps": "steps make the whole weave once, hold loose ends, and set fasteners within reach",
    }
)

#: What is proved of sheets that jobs share, beside what is proved of any.
_OF_SHARED = {"shared": "each piece of each job is on the shared sheets, once, as it was planned"}


@dataclass(frozen=True)
class Measure:
    """The most extreme value of one measured quantity and the limit it was held to."""

    value: float
    limit: float


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Parameters
    ----------
    name, meaning : str
        A stable name, and what is proved when the check is ok.
    ok : bool
        Whether nothing was found.
    count : int
        How many things were checked.
    worst : float or None
        The measured value that comes nearest to its limit or lies furthest beyond it.
    findings : tuple of str
        The first few things that are wrong, with ids and numbers.
    found : int
        How many things are wrong altogether.
    measured : dict of Measure
        The most extreme value of each quantity that was measured, by its name.
    faults : tuple of str
        Tracebacks, where the verifier itself was at fault.
    """

    name: str
    meaning: str
    ok: bool
    count: int
    worst: float | None
    findings: tuple[str, ...]
    found: int
    measured: dict[str, Measure]
    faults: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain values."""
        return {name: value for name, value in asdict(self).items() if name != "faults"}

    @property
    def nearest(self) -> str:
        """The value that comes nearest to its limit, and that, with their unit."""
        for quantity, measure in self.measured.items():
            if measure.value == self.worst:
                return f"{measure.value:.2g} of {measure.limit:.2g}{_unit(quantity)}"
        return ""


@dataclass(frozen=True, repr=False)
class VerifyReport:
    """What was proved, check by check.

    Examples
    --------
    >>> VerifyReport(())
    VerifyReport(proved by 0 checks)
    """

    checks: tuple[Check, ...]

    @property
    def ok(self) -> bool:
        """Whether every check is ok."""
        return all(check.ok for check in self.checks)

    @property
    def failed(self) -> tuple[str, ...]:
        """The names of the checks that object."""
        return tuple(check.name for check in self.checks if not check.ok)

    def to_json(self) -> dict[str, Any]:
        """Return the report as plain values for ``verify.json``."""
        return {
            "schema": SCHEMA,
            "ok": self.ok,
            "checks": [check.to_json() for check in self.checks],
        }

    def __repr__(self) -> str:
        """Return whether the job is proved, in a line."""
        if self.ok:
            return f"VerifyReport(proved by {len(self.checks)} checks)"
        return f"VerifyReport({len(self.failed)} of {len(self.checks)} checks object: " + (
            ", ".join(self.failed) + ")"
        )

    def _repr_html_(self) -> str:
        """Return the report as notebooks show it: a table of the checks, findings below."""
        rows = "".join(
            f"<tr><td>{check.name}</td><td>{'ok' if check.ok else '<b>objects</b>'}</td>"
            f"<td>{check.count}</td><td style='text-align:left'>{check.meaning}</td></tr>"
            for check in self.checks
        )
        findings = "".join(
            f"<li>{check.name}: {html.escape(finding)}</li>"
            for check in self.checks
            for finding in check.findings
        )
        return (
            f"<p>{html.escape(repr(self))}</p><table><tr><th>check</th><td></td><th>checked</th>"
            f"<th>what it proves</th></tr>{rows}</table><ul>{findings}</ul>"
        )


#: What is measured is told with so many decimals.
_DECIMALS = 9
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
            measure = Measure(round(float(value), _DECIMALS), round(float(limit), _DECIMALS))
            self._measured[quantity] = (excess, measure)
        return excess <= 0.0  # NaN objects

    def result(self) -> Check:
        """Return the result."""
        ranked = [
            (excess / max(abs(measure.limit), 1e-9), measure.value)
            for excess, measure in self._measured.values()
        ]
        return Check(
            name=self._name,
            meaning=_OF_SHARED.get(self._name) or MEANINGS[self._name],
            ok=self._found == 0,
            count=self._count,
            worst=max(ranked)[1] if ranked else None,
            findings=tuple(self._findings),
            found=self._found,
            measured={quantity: measure for quantity, (_, measure) in self._measured.items()},
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
            unit = _unit(quantity)
            finding = meaning.replace("{}", f"{value:.4f}{unit}")
            self.fail(f"{finding} (at {'least' if least else 'most'} {limit:g}{unit})")
        return good

    def _judge(self, name: str, stated: object, wanted: object, *, good: bool) -> bool:
        self._tally.count()
        if not good:
            wants = f"{_shown(wanted)}{self._source}"
            self.fail(f"{name} is {_shown(stated)}, but should be {wants}")
        return good


def _unit(quantity: str) -> str:
    """Return how the unit of a quantity is written."""
    return _UNITS.get(quantity[quantity.rfind("_") :], "")


def as_number(value: object) -> float:
    """Return a number that a file states; NaN for anything else, which fails every comparison."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return math.nan


def stated_number(record: object, key: str) -> float:
    """Return a number of a record; NaN if it states none."""
    return as_number(record.get(key) if isinstance(record, dict) else None)


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
