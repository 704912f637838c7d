"""Report the ribbons: the figures of every thread, and what was found."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.core.records import from_json, optional, read_json, record
from fabweave.job.planned import PlannedJob
from fabweave.piece.development import wave_turns
from fabweave.ribbon.measures import thread_lengths
from fabweave.ribbon.project import Ribbons
from fabweave.ribbon.rules.bends import measure_bends, measure_spans
from fabweave.ribbon.rules.broken_rule import FAR, BrokenRule, sentence, written
from fabweave.ribbon.rules.remedy import SIZED, Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.stock.material import Material, forming_advice, min_bend_radius_mm
from fabweave.stock.ribbon_limits import Limits


def hole_findings(planned: PlannedJob) -> list[BrokenRule]:
    """Find the crossings that have no room for a hole with its distance to every edge.

    Returns
    -------
    list of BrokenRule
        One or none. Its size is that at which all crossings have room.
    """
    piece_set, rules, woven = planned.piece_set, planned.rules, planned.woven
    if not rules:
        return []
    rule = (piece_set.rules or rules)[-1]
    narrow = np.flatnonzero(piece_set.room_mm < rule.edge_mm)
    if not len(narrow):
        return []
    crossing = int(narrow[np.argmin(piece_set.room_mm[narrow])])
    threads, labels = woven.weave.threads, woven.labels
    upper, lower = np.flatnonzero(threads.crossing == crossing)
    thread, other = threads.thread_of_pass[[upper, lower]].tolist()
    x, y, z = (round(float(value), 3) for value in woven.ribbons.centre[crossing])
    return [
        BrokenRule(
            rule="hole",
            severity="warn",
            value=float(piece_set.room_mm[crossing]),
            limit=rule.edge_mm,
            unit="mm",
            thread=labels[thread],
            station=int(upper - threads.offsets[thread]),
            crossing=crossing,
            other=labels[other],
            position=(x, y, z),
            count=len(narrow),
            of=threads.n_crossings,
            far=int(np.count_nonzero(piece_set.room_mm[narrow] < FAR * rule.edge_mm)),
        )
    ]


@record
class LimitRecord:
    """What one material takes, and the clearance between ribbons; what is not said is left out.

    ``bend_along_mm`` is the radius of strips along the grain, where pieces lie across it.
    """

    thickness_mm: float | None = optional(default=None)
    bend_mm: float | None = optional(default=None)
    width_mm: float | None = optional(default=None)
    twist_deg: float | None = optional(default=None)
    clearance_mm: float | None = optional(default=None)
    bend_along_mm: float | None = optional(default=None)


@record
class ThreadRibbon:
    """The figures of a thread's ribbon; None where there is no figure.

    Parameters
    ----------
    thread : str
        Its label.
    crossings : int
    length_mm : float
        Along the middle.
    narrowest_mm, widest_mm : float
        Least and greatest width across.
    bend_mm : float
        Radius of the softest ribbon that keeps the crossings where they are.
    modelled_bend_mm : float
        Radius of the tightest bend as modelled, where crossing panels are flat.
    fold_deg : float
        Greatest angle between neighbouring facets.
    crease_deg : float
        Greatest turn at one cross-line.
    twist_deg : float
        Greatest twist over a length that equals the width, spread from crossing to crossing.
    wave_deg : float
        How much the unfolded middle line turns, on average from crossing to crossing.
    limits : LimitRecord or None
        What its material takes, where materials differ.
    """

    thread: str
    crossings: int
    length_mm: float | None
    narrowest_mm: float | None
    widest_mm: float | None
    bend_mm: float | None
    modelled_bend_mm: float | None
    fold_deg: float | None
    crease_deg: float | None
    twist_deg: float | None
    wave_deg: float | None
    limits: LimitRecord | None = optional(default=None)


@record
class RibbonReport:
    """The figures of the ribbons as they are made, and what was found: ``ribbons.json``.

    ``limits`` are those of all threads, but for the clearance only if threads have the same;
    ``smallest_size_mm`` is the size of the object from which on all rules hold.
    """

    schema: Literal["fabweave.ribbons/1"]
    units: Literal["mm"]
    limits: LimitRecord
    smallest_size_mm: int | None
    findings: tuple[BrokenRule, ...]
    threads: tuple[ThreadRibbon, ...]


def ribbon_report(
    check: RibbonCheck,
    ribbons: Ribbons,
    labels: Sequence[str],
    holes: Sequence[BrokenRule] = (),
) -> RibbonReport:
    """Return the figures of the ribbons as they are made, and the findings.

    Parameters
    ----------
    check : RibbonCheck
    ribbons : Ribbons
        As they are cut.
    labels : sequence of str
        Names of the threads.
    holes : sequence of BrokenRule
        What :func:`hole_findings` found.
    """
    limits = check.limits
    several = isinstance(limits.thickness_mm, np.ndarray)
    clearance_mm = limits.clearance_mm
    return RibbonReport(
        schema="fabweave.ribbons/1",
        units="mm",
        limits=replace(
            LimitRecord() if several else _limit_record(limits), clearance_mm=clearance_mm
        ),
        smallest_size_mm=check.smallest_mm,
        findings=tuple(written(finding) for finding in (*check.findings, *holes)),
        threads=_thread_records(ribbons, labels, limits if several else None),
    )


def read_ribbon_report(path: Path) -> RibbonReport:
    """Read the ``ribbons.json`` of a finished job.

    Raises
    ------
    InputError
        If the file cannot be read, or is no such report; the message says why.
    """
    read = partial(from_json, RibbonReport)
    return read_json(path, read, "report on ribbons", "ribbons.json")


def _limit_record(limits: Limits) -> LimitRecord:
    """Return what one material takes."""
    bend, along = (round(float(np.max(each)), 4) for each in (limits.bend_mm, limits.along_mm))
    return LimitRecord(
        thickness_mm=float(np.max(limits.thickness_mm)),
        bend_mm=bend,
        width_mm=float(np.max(limits.width_mm)),
        twist_deg=round(float(np.max(limits.twist_deg)), 4),
        bend_along_mm=along if along > bend else None,
    )


def _thread_records(
    ribbons: Ribbons, labels: Sequence[str], limits: Limits | None
) -> tuple[ThreadRibbon, ...]:
    """Return one record for each thread that crosses anything, with its limits if there are any."""
    bends = measure_bends(ribbons)
    spans = measure_spans(ribbons, bends)
    counts = np.diff(ribbons.pass_offsets)
    of_rung = np.repeat(np.arange(len(counts)), np.diff(ribbons.offsets))
    of_pass = np.repeat(np.arange(len(counts)), counts)
    turns = np.bincount(of_rung, np.abs(wave_turns(ribbons)), len(counts))
    fold = np.fmax(bends.fold_deg, bends.diagonal_deg)
    columns = {
        "length_mm": thread_lengths(ribbons),
        "narrowest_mm": _extreme(bends.width_mm, of_rung, len(counts), least=True),
        "widest_mm": _extreme(bends.width_mm, of_rung, len(counts), least=False),
        "bend_mm": _extreme(spans.radius_mm, of_pass, len(counts), least=True),
        "modelled_bend_mm": _extreme(bends.radius_mm, of_rung, len(counts), least=True),
        "fold_deg": _extreme(fold, of_rung, len(counts), least=False),
        "crease_deg": _extreme(np.abs(bends.turn_deg), of_rung, len(counts), least=False),
        "twist_deg": _extreme(spans.twist_deg, of_pass, len(counts), least=False),
        "wave_deg": turns / np.maximum(counts, 1),
    }
    return tuple(
        ThreadRibbon(
            thread=labels[thread],
            crossings=int(counts[thread]),
            limits=None if limits is None else _limit_record(limits.of(np.array([thread]))),
            **{name: _rounded(values[thread]) for name, values in columns.items()},
        )
        for thread in np.flatnonzero(counts).tolist()
    )


def _extreme(values: FloatArray, owner: IntArray, n_threads: int, *, least: bool) -> FloatArray:
    """Return the least or greatest value of each thread, (T,); infinite where it has none."""
    figures = np.full(n_threads, np.inf if least else -np.inf)
    given = ~np.isnan(values)
    (np.minimum if least else np.maximum).at(figures, owner[given], values[given])
    return figures


def _rounded(value: float) -> float | None:
    return round(float(value), 3) if np.isfinite(value) else None


def ribbon_notes(check: RibbonCheck, materials: Sequence[Material] = ()) -> list[Note]:
    """Return what a maker should know of ribbons: the worst place of each rule, and the size.

    Of the materials, it is said how they can be made to bend as tightly as is wanted.
    """
    broken = {finding.rule: sentence(finding) for finding in check.findings}
    bend = [broken.pop("bend", _bend_note(check)), *_turning_note(check)]
    bend += _forming_notes(check, materials)
    told = [("bend", text) for text in bend]
    if "twist" not in broken:
        told += [("twist", text) for text in _twist_note(check)]
    told += [*broken.items(), *(("checks", text) for text in _size_note(check))]
    if check.untried is not None:
        why = f"it was not tried, because {check.untried}"
        told.append(("checks", f"checks: --refine might fix these too; {why}"))
    return [Note(rule, text, detail=True) for rule, text in told]


def _size_note(check: RibbonCheck) -> list[str]:
    """Say at which size the rules hold; no note where there is nothing that a size would change."""
    if check.depth < Depth.SEARCHED:
        return []  # nobody looked for it
    sized = [finding for finding in check.findings if finding.rule in SIZED]
    what, size = "widths, bends, creases and clearances", check.smallest_mm
    if size is None:
        if not sized:
            return []
        return [
            "checks: no size mends all of these; see each note, or use a mesh with larger faces"
        ]
    if not sized:
        also = f", and would at --size {size}mm too" if size < check.size_mm else ""
        return [f"checks: {what} all hold{also}"]
    but = f"; {' and '.join(check.still)} would not" if check.still else ""
    return [f"checks: {what} would all hold at --size {size}mm{but}"]


def _twist_note(check: RibbonCheck) -> list[str]:
    """Say how much ribbons are twisted, where that is little enough."""
    twist = check.measured["twist"]
    if not len(twist.value):
        return []
    at = int(np.argmin(twist.margins))
    return [
        f"twist: at most {twist.value[at]:.1f}° over one width; the material takes "
        f"{twist.limit_at(at):.1f}°"
    ]


def _bend_note(check: RibbonCheck) -> str:
    """Say how tight the tightest bend is against what the material takes."""
    bend = check.measured["bend"]
    least = float(bend.value.min(initial=np.inf))
    limits = np.unique(check.limits.bend_mm)
    takes = f"the material takes {limits[0]:.1f} mm"
    if len(limits) > 1:
        takes = "the materials take " + " and ".join(f"{limit:.1f} mm" for limit in limits)
    if not np.isfinite(least):
        return f"bend: none; {takes}"
    return f"bend: radius {least:.1f} mm or more; {takes}"


def _forming_notes(check: RibbonCheck, materials: Sequence[Material]) -> list[str]:
    """Say how materials can be softened, where some bend is too tight for them as they are."""
    tight = [finding.value for finding in check.findings if finding.rule == "bend"]
    advice = [
        forming_advice(material, min(tight))
        for material in materials
        if tight and min(tight) < min_bend_radius_mm(material)
    ]
    return [f"bend: {told}" for told in dict.fromkeys(advice) if told is not None]


def _turning_note(check: RibbonCheck) -> list[str]:
    """Say how many bends are not measured: ribbons that turn back are no one arch."""
    # Twist is measured between all crossings.
    bend, twist = check.measured["bend"], check.measured["twist"]
    count = len(np.setdiff1d(twist.passes, bend.passes))
    if not count:
        return []
    return [
        f"bend: not measured in {agree(count, '{n} [place|places]')} where ribbons turn back "
        "between one crossing and the next; creases are measured there"
    ]
