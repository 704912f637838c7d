"""Tell how far apart strands lie at a crossing, with the true thickness of either."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.weave.pattern import Weave, strand_passes


def crossing_threads(weave: Weave) -> tuple[IntArray, IntArray]:
    """Return the thread that goes over and the one that goes under at each crossing, (X,) each."""
    lower, upper = weave.threads.thread_of_pass[strand_passes(weave)].T
    return upper, lower


def crossing_heights(
    weave: Weave,
    thickness_mm: FloatArray,
    clearance_mm: float,
    laps: IntArray | None = None,
) -> FloatArray:
    """Return how far either strand's middle surface lies from the plane of each crossing, (X,).

    Let the strand above be a mm thick, the one below b, and the air between them c. Above its
    lower face the upper strand has half of itself, a/2, up to its middle surface; below its upper
    face the lower one has b/2. So the middle surfaces are a/2 + c + b/2 apart. Where two pieces
    of the lower strand lap, it is 2 b thick, and what is laid is the middle of both layers: then
    they are a/2 + c + b apart, b/2 more. (Joints lie where their own thread goes under.)

    Both strands take half of the distance, the upper one outward and the lower one inward, so that
    the crossing stays midway between them on the surface, and a thick strand need not climb more
    than the thin one that it crosses.

    Parameters
    ----------
    weave : Weave
    thickness_mm : (T,) float array
        Of each thread.
    clearance_mm : float
    laps : (N,) int array, optional
        The crossings at which the strand below laps; by default any may.

    Examples
    --------
    A warp of 0.5 mm and a weft of 0.8 mm with 0.1 mm between: 0.75 mm from middle to middle; under
    the warp a lap of the weft makes that 1.15 mm, under the weft one of the warp 1 mm.

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.bunches import part_bunches
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(parse_shape("shape:torus?m=4&n=4"))))
    >>> thickness = np.array([0.5, 0.8])[part_bunches(weave.threads)]
    >>> none = np.zeros(0, dtype=np.int64)
    >>> np.unique((2 * crossing_heights(weave, thickness, 0.1, none)).round(9)).tolist()
    [0.75]
    >>> np.unique((2 * crossing_heights(weave, thickness, 0.1)).round(9)).tolist()
    [1.0, 1.15]
    """
    upper, lower = crossing_threads(weave)
    height = ((thickness_mm[upper] + thickness_mm[lower]) / 2 + clearance_mm) / 2
    lapped = slice(None) if laps is None else laps
    height[lapped] += thickness_mm[lower[lapped]] / 4
    return np.asarray(height)
