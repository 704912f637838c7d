"""Round ribbons off: more cross-lines between crossings, along fair rails."""

from dataclasses import replace

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, unit
from fabweave.ribbon.project import Ribbons, better_diagonals, following_rung


def smooth_ribbons(ribbons: Ribbons, steps: int) -> Ribbons:
    """Replace the connector between two crossing panels by a finer chain of facets.

    Both rails go on from one panel to the next along cubic curves that leave and arrive in the
    direction of the panels' sides, so that the development's outline has no kink there. The
    chain is still one of planar facets: it unfolds exactly. Crossing panels stay as they are, and
    so do turns at the boundary and the ends of open ribbons.

    Parameters
    ----------
    ribbons : Ribbons
        As projected.
    steps : int
        Cross-lines between two panels; 0 leaves the ribbons as they are.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = torus(8, 4, 35.0, 15.0)
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.25)
    >>> ribbons.n_rungs, smooth_ribbons(ribbons, 3).n_rungs
    (256, 640)
    """
    if steps < 1:
        return ribbons
    following = following_rung(ribbons.offsets, ribbons.closed)
    leaves, arrives = _connectors(ribbons, following)
    inserted = np.zeros(ribbons.n_rungs + 1, dtype=np.int64)
    inserted[leaves + 1] = steps
    number = np.arange(ribbons.n_rungs + 1) + np.cumsum(inserted)

    rails = []
    share = np.arange(1, steps + 1) / (steps + 1)
    between = number[leaves][:, None] + np.arange(1, steps + 1)
    for rail in (ribbons.right, ribbons.left):
        longer = np.empty((number[-1], 3))
        longer[number[:-1]] = rail
        longer[between] = _curve(rail, leaves, arrives, share)
        rails.append(longer)
    right, left = rails
    offsets = number[ribbons.offsets]
    # Rungs put in after the last one of a ring belong to it, not to the next thread.
    return replace(
        ribbons,
        offsets=offsets,
        right=right,
        left=left,
        from_right=better_diagonals(right, left, following_rung(offsets, ribbons.closed)),
        entry=number[ribbons.entry],
    )


def _connectors(ribbons: Ribbons, following: IntArray) -> tuple[IntArray, IntArray]:
    """Return the rungs at which ribbons leave a panel and arrive at the next one without a turn."""
    enters = np.zeros(ribbons.n_rungs, dtype=bool)
    enters[ribbons.entry] = True
    leaves = ribbons.entry + 1
    arrives = following[leaves]
    direct = (arrives >= 0) & enters[arrives]
    return leaves[direct], arrives[direct]


def _curve(rail: FloatArray, leaves: IntArray, arrives: IntArray, share: FloatArray) -> FloatArray:
    """Return points on cubic curves between rungs, (C, K, 3), by Hermite's formula."""
    start, end = rail[leaves], rail[arrives]
    chord = end - start
    away = _pull(start - rail[leaves - 1], chord)
    onwards = _pull(rail[arrives + 1] - end, chord)
    t = share[None, :, None]
    return np.asarray(
        (1 + 2 * t) * (1 - t) ** 2 * start[:, None]
        + t * (1 - t) ** 2 * away[:, None]
        + t**2 * (3 - 2 * t) * end[:, None]
        - t**2 * (1 - t) * onwards[:, None]
    )


def _pull(side: FloatArray, chord: FloatArray) -> FloatArray:
    """Return how a curve goes on along a panel's side: as far as its chord is long.

    Where it turns by more than 60 degrees that is less, down to nothing at a right angle; else
    the ribbon would often run through itself there.
    """
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    way = unit(side)
    ahead = np.einsum("ij,ij->i", way, unit(chord))[:, None]
    return np.asarray(np.clip(2.0 * ahead, 0.0, 1.0) * length * way)
