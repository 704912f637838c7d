"""Lay ribbons of one width: as wide across themselves as they have room, all along."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, unit
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.measures import panel_widths
from fabweave.ribbon.project import (
    Ribbons,
    better_diagonals,
    following_rung,
    preceding_rung,
    project_ribbons,
)
from fabweave.ribbon.width import WidthRule
from fabweave.weave.pattern import Weave, strand_passes

#: Panels reach so far along their strands, in halves of the width of the strand that they cross.
_BEYOND = 1.05
#: Strands that cross at a smaller sine would need endless panels.
_LEAST_SINE = 0.05
#: Rungs either way of whose middle line a rail keeps its distance, and rounds in which it is found.
_NEAR, _ROUNDS = 4, 5
#: No rung is longer than so many widths: beyond, it runs along the ribbon, and not across it.
_LONGEST = 1.7
#: Rounds in which lengths of neighbouring rungs are levelled, so that rails are smooth.
_LEVELLED = 4


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
    far = np.minimum(shared + beside, size / 2.0)
    missing = np.clip(shared + beside - far, 0.0, beside)
    tangent = np.sign(slant) * missing / np.maximum(width / 2.0, 1e-300)
    half = (factor * width / 2.0)[:, None] * (leftward + tangent[:, None] * along)
    right, left = ribbons.right.copy(), ribbons.left.copy()
    for rung, way in ((enter, -far), (leave, far)):
        end = (middle[enter] + middle[leave]) / 2.0 + way[:, None] * along
        right[rung], left[rung] = end - half, end + half
    return replace(ribbons, right=right, left=left)


def even_rails(ribbons: Ribbons, weave: Weave, width: FloatArray) -> Ribbons:
    """Move both rails, along their rungs, to half a width from the ribbon's middle line.

    Rungs stay in their lines, so the ribbon keeps its surface, and what it develops to its course.
    Turns at a boundary and ends stay as they are.

    Parameters
    ----------
    ribbons : Ribbons
        Smoothed or not.
    weave : Weave
    width : (P,) float array
        At each pass, across the strand; between two passes it changes evenly.
    """
    rung, wanted = _of_no_turn(ribbons, weave, width)
    following = following_rung(ribbons.offsets, ribbons.closed)
    itself = np.arange(ribbons.n_rungs)
    before, after = (
        np.where(beside >= 0, beside, itself) for beside in (preceding_rung(following), following)
    )
    window = [rung]
    for _ in range(_NEAR):
        window = [before[window[0]], *window, after[window[-1]]]
    middle = (ribbons.right + ribbons.left) / 2
    line = middle[np.stack(window, axis=1)]
    step = np.diff(line, axis=1)
    offset = middle[rung][:, None] - line[:, :-1]
    across = unit(ribbons.left[rung] - ribbons.right[rung])
    half = wanted / 2.0
    # From the start of each step to a place on the rung, and so how far that is from the step. The
    # few steps come first: numpy is quick along many rungs.
    square = np.maximum(np.einsum("nkd,nkd->nk", step, step), 1e-300)
    far, along = (np.einsum("nkd,nkd->nk", offset, other) for other in (offset, step))
    out, ahead = (np.einsum("nkd,nd->nk", other, across) for other in (offset, step))
    square, far, along, out, ahead = (
        np.ascontiguousarray(each.T) for each in (square, far, along, out, ahead)
    )
    levels = []
    for side in (-half, half):
        factor = np.ones(len(rung))
        for _ in range(_ROUNDS):
            place = factor * side
            onward = along + place * ahead
            share = np.clip(onward / square, 0.0, 1.0)
            apart = far + place * (2.0 * out + place) - share * (2.0 * onward - share * square)
            distance = np.sqrt(np.maximum(apart.min(axis=0), 1e-300))
            factor = np.clip(factor * half / distance, 1.0, _LONGEST)
        level = np.ones((ribbons.n_rungs, 1))
        level[rung, 0] = factor
        levels.append(level)
    # Strands meet in the middles of panels.
    panels = np.concatenate([ribbons.entry, ribbons.entry + 1])
    for times in range(_LEVELLED + 1):
        if times:
            levels = [(level[before] + 2.0 * level + level[after]) / 4.0 for level in levels]
        both = (levels[0][panels] + levels[1][panels]) / 2.0
        for level in levels:
            level[panels] = both
    right, left = ribbons.right.copy(), ribbons.left.copy()
    right[rung] = middle[rung] - levels[0][rung] * half[:, None] * across
    left[rung] = middle[rung] + levels[1][rung] * half[:, None] * across
    return replace(
        ribbons, right=right, left=left, from_right=better_diagonals(right, left, following)
    )


def _of_no_turn(ribbons: Ribbons, weave: Weave, width: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the rungs of panels, and those between two panels without a turn, and widths there."""
    threads, enter = weave.threads, ribbons.entry
    last = ribbons.offsets[threads.thread_of_pass + 1]
    onward = following_rung(threads.offsets, threads.closed)
    end = np.where(onward == np.arange(1, len(onward) + 1), np.append(enter[1:], 0), last)
    turns = np.bincount(threads.turn_pass, minlength=len(width)) > 0
    count = np.where((onward >= 0) & ~turns, end - enter, 2)
    passed = np.repeat(np.arange(len(width)), count)
    place = np.arange(len(passed)) - np.repeat(np.cumsum(count) - count, count)
    share = np.maximum(place - 1, 0) / (count[passed] - 1)
    wanted = (1.0 - share) * width[passed] + share * width[onward[passed]]
    return enter[passed] + place, wanted
