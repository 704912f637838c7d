"""Lay ribbons of one width: as wide across themselves as they have room, all along."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.project import Ribbons, better_diagonals, following_rung, project_ribbons
from fabweave.ribbon.width import WidthRule
from fabweave.weave.pattern import Weave, strand_passes

#: Panels reach so far beyond the strand that they cross, in halves of its width, but at least so
#: far as a share of what they reach by the paper's rule.
_BEYOND, _LEAST_REACH = 1.05, 0.2
#: Strands that cross at a smaller sine would need endless panels.
_LEAST_SINE = 0.05
#: Rungs either way of whose middle line a rail keeps its distance, and rounds in which it is found.
_NEAR, _ROUNDS = 4, 5
#: No rung is longer than so many widths: beyond, it runs along the ribbon, and not across it.
_LONGEST = 1.7
#: Rounds in which lengths of neighbouring rungs are levelled, so that rails are smooth.
_LEVELLED = 2


def panel_widths(ribbons: Ribbons) -> FloatArray:
    """Return how wide each panel is where it begins and where it ends, (P, 2).

    It is measured across the panel's middle line: a slanted rung is longer than that.
    """
    middle = ribbons.left + ribbons.right
    along = unit(middle[ribbons.entry + 1] - middle[ribbons.entry])[:, None]
    rungs = (ribbons.left - ribbons.right)[ribbons.entry[:, None] + [0, 1]]
    return np.asarray(np.linalg.norm(np.cross(along, rungs), axis=2))


def even_widths(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    rule: WidthRule,
    *,
    length: float,
    portals: FloatArray | None = None,
) -> FloatArray:
    """Return the width at each pass, (P,), of ribbons that have one width wherever they can.

    Panels at crossings have one width: the room of the narrower of their two cross-lines counts.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh and the weave on it.
    rule : WidthRule
        An even one.
    length, portals
        As for :func:`~fabweave.ribbon.project.project_ribbons`.
    """
    laid = project_ribbons(
        mesh,
        halfedges,
        weave,
        height_mm=0.0,
        length=length,
        width=min(rule.relative, length),
        portals=portals,
    )
    room = panel_widths(laid).min(axis=1)
    return rule.even_widths(room, following_rung(laid.pass_offsets, laid.closed))


def short_panels(ribbons: Ribbons, weave: Weave, width: FloatArray, factor: FloatArray) -> Ribbons:
    """End panels square to their strands, just beyond the strand that they cross.

    What two strands of widths a and b share at a crossing at the angle φ reaches b / 2 sin φ along
    the first from its middle, and on one side a / 2 |cot φ| farther. Where a panel has no room for
    both, its end is slanted, by no more than to the other's edge. Shorter panels leave longer ways
    to turn, and to climb, between them.

    Parameters
    ----------
    ribbons : Ribbons
        As projected: no panel gets longer.
    weave : Weave
    width : (P,) float array
        At each pass, across the strand.
    factor : (P,) float array
        On that width, where ribbons are narrowed; panels stay as long as without it, lest what
        comes after them runs into the strand that they cross.
    """
    enter, leave = ribbons.entry, ribbons.entry + 1
    middle = (ribbons.right + ribbons.left) / 2
    along = unit(middle[leave] - middle[enter])
    size = np.linalg.norm(middle[leave] - middle[enter], axis=1)
    crossing = weave.threads.crossing
    leftward = np.cross(ribbons.normal[crossing], along)
    other = np.empty(len(width), dtype=np.int64)
    lower, upper = strand_passes(weave).T
    other[lower], other[upper] = upper, lower
    sine = np.einsum("pd,pd->p", along[other], leftward)
    cosine = np.einsum("pd,pd->p", along[other], along) * np.where(sine < 0, -1.0, 1.0)
    sine = np.maximum(np.abs(sine), _LEAST_SINE)
    slant = cosine / sine
    shared = _BEYOND * width[other] / (2.0 * sine)
    beside = width / 2.0 * np.abs(slant)
    reach = np.einsum("pd,pd->p", ribbons.centre[crossing] - middle[enter], along)
    right, left = ribbons.right.copy(), ribbons.left.copy()
    for rung, room, way in ((enter, reach, -1.0), (leave, size - reach, 1.0)):
        far = np.minimum(shared + beside, np.maximum(room, _LEAST_REACH * size))
        missing = np.clip(shared + beside - far, 0.0, beside)
        tangent = np.sign(slant) * missing / np.maximum(width / 2.0, 1e-300)
        end = middle[enter] + (reach + way * far)[:, None] * along
        half = (factor * width / 2.0)[:, None] * (leftward + tangent[:, None] * along)
        right[rung], left[rung] = end - half, end + half
    return replace(ribbons, right=right, left=left)


def even_rails(ribbons: Ribbons, weave: Weave, width: FloatArray) -> Ribbons:
    """Move both rails, along their rungs, to half a width from the ribbon's middle line.

    Rungs stay in their lines, so the ribbon keeps its surface, and what it develops to its course.
    Turns at a boundary stay as they are.

    Parameters
    ----------
    ribbons : Ribbons
        Smoothed or not.
    weave : Weave
    width : (P,) float array
        At each pass, across the strand; between two passes it changes evenly.
    """
    rung, wanted = _rungs_across(ribbons, weave, width)
    after = following_rung(ribbons.offsets, ribbons.closed)
    before = np.full(ribbons.n_rungs, -1, dtype=np.int64)
    before[after[after >= 0]] = np.flatnonzero(after >= 0)
    itself = np.arange(ribbons.n_rungs)
    after, before = np.where(after >= 0, after, itself), np.where(before >= 0, before, itself)
    near = [rung]
    for _ in range(_NEAR):
        near = [before[near[0]], *near, after[near[-1]]]
    middle = (ribbons.right + ribbons.left) / 2
    line = middle[np.stack(near, axis=1)]
    start, step = line[:, :-1], np.diff(line, axis=1)
    square = np.maximum(np.einsum("nkd,nkd->nk", step, step), 1e-300)
    half = wanted[:, None] / 2.0
    rails = []
    for rail in (ribbons.right, ribbons.left):
        across = unit(rail[rung] - middle[rung])
        factor = np.ones((len(rung), 1))
        for _ in range(_ROUNDS):
            way = (middle[rung] + factor * half * across)[:, None] - start
            share = np.clip(np.einsum("nkd,nkd->nk", way, step) / square, 0.0, 1.0)
            far = np.linalg.norm(way - share[:, :, None] * step, axis=2).min(axis=1, keepdims=True)
            factor = np.clip(factor * half / np.maximum(far, 1e-300), 1.0, _LONGEST)
        level = np.ones((ribbons.n_rungs, 1))
        level[rung] = factor
        for _ in range(_LEVELLED):
            level = (level[before] + 2.0 * level + level[after]) / 4.0
        moved = rail.copy()
        moved[rung] = middle[rung] + level[rung] * half * across
        rails.append(moved)
    right, left = rails
    following = following_rung(ribbons.offsets, ribbons.closed)
    return replace(
        ribbons, right=right, left=left, from_right=better_diagonals(right, left, following)
    )


def _rungs_across(ribbons: Ribbons, weave: Weave, width: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the rungs that are of no turn, and how wide the ribbon is to be at each."""
    threads = weave.threads
    number = np.arange(ribbons.n_rungs)
    thread = np.searchsorted(ribbons.offsets, number, side="right") - 1
    passed = np.maximum(np.searchsorted(ribbons.entry, number, side="right") - 1, 0)
    turns: BoolArray = np.bincount(threads.turn_pass, minlength=len(width)) > 0
    of_turn = turns[passed] & (number > ribbons.entry[passed] + 1)
    # Threads stand one apart, so that what follows the last rung has a place of its own.
    woven = np.flatnonzero(threads.woven)
    first, last = threads.offsets[woven], threads.offsets[woven + 1] - 1
    onward = np.where(threads.closed[woven], first, last)
    known = [
        (ribbons.offsets[woven] + woven, width[first]),
        (ribbons.entry + threads.thread_of_pass, width),
        (ribbons.entry + 1 + threads.thread_of_pass, width),
        (ribbons.offsets[woven + 1] + woven, width[onward]),
    ]
    places, widths = (np.concatenate(part) for part in zip(*known, strict=True))
    order = np.argsort(places, kind="stable")
    wanted = np.interp(number + thread, places[order], widths[order])
    return number[~of_turn], wanted[~of_turn]
