"""Hold what was proved about a finished job: one result for each check."""

import html
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

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
        "looks": "drawings have the version, units, colours and line widths that were asked for",
        "cut": "the sheets with kerf and micro-joints stand off the pieces by half the kerf",
        "order": "engraving comes before holes and holes before outlines, each inside the outline",
        "labels": "labels are legible, off edges and holes, in their places, and say what is true",
        "sheets": "pieces keep inside the margins of their sheet and apart by the gap",
        "service": "each file for a service cuts its piece alone, and quantities are right",
        "stock": "sheets, angles and prices are those of the stock in the settings",
        "offcuts": "what is kept of sheets is free, drawn as it is, and listed as stock",
        "rim": "rings around openings lie hole on hole on the crossings beside them, all round",
        "simple": "outlines are simple, counter-clockwise, free of tiny sides and clear of holes",
        "materials": "every piece is on a sheet of its thread's material",
        "steps": "done in order, the steps make the whole weave once",
    }
)


@dataclass(frozen=True)
class Measure:
    """The most extreme value of one measured quantity and the limit it was held to."""

    what: str
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
    measured : tuple of Measure
        The most extreme value of each quantity that was measured.
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
    measured: tuple[Measure, ...]
    faults: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the result as plain values."""
        return {
            "name": self.name,
            "meaning": self.meaning,
            "ok": self.ok,
            "count": self.count,
            "worst": None if self.worst is None else round(self.worst, 9),
            "findings": list(self.findings),
            "found": self.found,
            "measured": {
                measure.what: {"value": round(measure.value, 9), "limit": round(measure.limit, 9)}
                for measure in self.measured
            },
        }


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
            f"<p>{html.escape(repr(self))}</p><table><tr><th>check</th><th></th><th>checked</th>"
            f"<th>what it proves</th></tr>{rows}</table><ul>{findings}</ul>"
        )
