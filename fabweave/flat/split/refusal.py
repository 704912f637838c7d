"""Say of which stretches of threads no piece can be made, why, by how much, and what would help."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.core.messages import agree
from fabweave.flat.outline import resting_frame, strip_outlines
from fabweave.flat.split.candidate_costs import Bed, Candidates
from fabweave.flat.split.candidates import station_of_site
from fabweave.flat.split.self_clearance import SELF_CLEARANCE_MM, keeps_clear
from fabweave.flat.unfold.development import Strips

#: So many stretches are named.
_NAMED = 4
#: What lies on itself by less only comes too near to itself.
_LEAST_OVERLAP_MM2 = 0.1
#: What makes strips that come back to themselves keep clear.
_APART = ("a smaller --width", "a smoother mesh (--fair)")


@dataclass(frozen=True)
class _Cause:
    """Why a stretch can be no piece.

    Parameters
    ----------
    measured : str
        What was found of it.
    rule : str
        What it breaks, the same for all that do; may be empty.
    remedies : tuple of str
        What would help.
    """

    measured: str
    rule: str
    remedies: tuple[str, ...]


def splitting_refusal(
    candidates: Candidates,
    bed: Bed,
    threads: Sequence[int],
    labels: Sequence[str],
    longest_mm: float,
) -> str:
    """Return a message that says why some threads cannot be cut into pieces.

    Parameters
    ----------
    candidates : Candidates
        The pieces to choose from, no longer than ``longest_mm``.
    bed : Bed
        What pieces must fit on.
    threads : sequence of int
        Threads that cannot be cut.
    labels : sequence of str
        Names of all threads.
    longest_mm : float
        No piece may be longer along its middle.
    """
    said: list[str] = []
    rules: dict[str, None] = {}
    remedies: dict[str, None] = {}
    for thread in threads:
        for first, last, strip, clear in _stretches(candidates, thread):
            causes = _causes(strip, bed, longest_mm, clear=clear)
            if causes:
                what = ", ".join(cause.measured for cause in causes)
                said.append(f"{labels[thread]} between its crossings {first} and {last} ({what})")
            for cause in causes:
                rules[cause.rule] = None
                remedies.update(dict.fromkeys(cause.remedies))
    helps = f"{', '.join(remedies)} or a finer mesh (--refine) would help"
    return (
        agree(len(said), "{n} stretch[|es] of thread [has|have] ")
        + f"no crossing for a joint, and can be no piece: {'; '.join(said[:_NAMED])}"
        + (f"; and {len(said) - _NAMED} more" if len(said) > _NAMED else "")
        + f". {'. '.join([*filter(None, rules), helps[0].upper() + helps[1:]])}"
    )


def _stretches(candidates: Candidates, thread: int) -> list[tuple[int, int, Strips, bool]]:
    """Return the stretches of a thread between neighbouring sites, the shortest pieces there are.

    Returns
    -------
    list of (int, int, Strips, bool)
        Its first and last pass, its strip, and whether a piece may carry it so far as it keeps
        clear of itself.
    """
    sites, course = candidates.sites, candidates.course
    rows = slice(sites.offsets[thread], sites.offsets[thread + 1])
    begin, start = sites.position[rows], station_of_site(course, sites)[rows]
    steps = sites.steps[rows]
    if not sites.closed[thread] and len(steps) > 1:
        begin, start, steps = begin[:-1], start[:-1], steps[:-1]
    measured = candidates.windows.passes.shape[1] > 0
    clear = candidates.clear[rows, 0] if measured else np.ones(len(start), dtype=bool)
    lap = int(sites.lengths[thread])
    return [
        (first, (first + step) % lap, course.stretches(*np.array([[at], [at + step]])), free)
        for first, step, at, free in zip(
            begin.tolist(), steps.tolist(), start.tolist(), clear.tolist(), strict=False
        )
    ]


def _causes(strip: Strips, bed: Bed, longest_mm: float, *, clear: bool) -> list[_Cause]:
    """Return why a strip can be no piece; nothing if it can."""
    causes = []
    middle = (strip.right + strip.left) / 2
    length = float(np.hypot(*np.diff(middle, axis=0).T).sum())
    if length > longest_mm:
        rule = f"No piece may be longer than {longest_mm:g} mm"
        causes.append(_Cause(f"{length:.1f} mm long", rule, ("a longer --max-length",)))
    if not keeps_clear(strip)[0]:
        overlap = _overlap_mm2(strip)
        near = f"nearer than {SELF_CLEARANCE_MM:g} mm to itself when unfolded"
        lying = f"lying on itself over {overlap:.1f} mm² when unfolded"
        return [*causes, _Cause(lying if overlap > _LEAST_OVERLAP_MM2 else near, "", _APART)]
    outline = strip_outlines(strip)[0]
    if not bed.fits(outline):
        causes.append(_too_large(outline, middle, bed))
    elif not causes and not clear:
        causes.append(_Cause("crossing itself as it is cut, laps and all", "", _APART))
    return causes


def _too_large(outline: FloatArray, middle: FloatArray, bed: Bed) -> _Cause:
    """Say by how much a piece is too large for the stock."""
    size = np.ptp(resting_frame(outline, middle[0], middle[-1]).apply(outline), axis=0)
    said = f"{size.max():.1f} × {size.min():.1f} mm"
    larger = ("a larger --sheet", "a smaller --size")
    if bed.free_mm is None:
        return _Cause(said, "That is too large for the sheet", larger)
    room = f"{max(bed.free_mm):.1f} × {min(bed.free_mm):.1f} mm"
    rule = f"The sheets have {room} free, inside margins, defects and laps"
    if np.all(np.sort(size) <= np.sort(bed.free_mm)):
        return _Cause(f"{said} at no allowed angle", rule, ("--rotations free", *larger))
    return _Cause(said, rule, larger)


def _overlap_mm2(strip: Strips) -> float:
    """Return over what area an unfolded strip lies on itself."""
    corners = (strip.right[:-1], strip.right[1:], strip.left[1:], strip.left[:-1])
    facets = shapely.make_valid(shapely.polygons(np.stack(corners, axis=1)))
    return float(shapely.area(facets).sum() - shapely.union_all(facets).area)
