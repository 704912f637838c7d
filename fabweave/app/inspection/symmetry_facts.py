"""Find out which motions map a woven mesh onto itself, and how few kinds of pieces that allows."""

from typing import Any

import numpy as np

from fabweave.app.woven_object import WovenObject
from fabweave.mesh.symmetry.group import Symmetry, orbits
from fabweave.mesh.symmetry.search import EXACT
from fabweave.weave.symmetry import find_weave_symmetry, nearest_symmetry


def symmetry_facts(woven: WovenObject, n_pieces: int | None) -> dict[str, Any]:
    """Return the symmetry of a mesh and of its weave.

    Parameters
    ----------
    woven : WovenObject
        The mesh and its weave.
    n_pieces : int or None
        How many pieces it is cut from, if that is known.
    """
    mesh = nearest_symmetry(woven.mesh, woven.halfedges)
    tolerance = mesh.tolerance
    weave = find_weave_symmetry(woven.mesh, woven.halfedges, woven.weave, tolerance=tolerance)
    kinds = None
    if n_pieces is not None:
        # Each orbit of threads has kinds of its own, and each kind a place for each rotation; a
        # piece is not the mirror image of itself.
        every = np.arange(woven.weave.threads.n_threads)
        turned = orbits(weave.thread_images(every)[weave.group.proper], len(every))
        kinds = max(int(turned.max(initial=-1)) + 1, -(-n_pieces // weave.group.n_rotations))
    return {
        "tolerance_percent": round(100 * tolerance, 6),
        "exact": tolerance == EXACT,
        "mesh": _counts(mesh),
        "weave": _counts(weave.group),
        "axes": _axes(weave.group),
        "orbits": {
            "threads": int(weave.thread_orbits.max(initial=-1)) + 1,
            "crossings": int(weave.crossing_orbits.max(initial=-1)) + 1,
        },
        "kinds_possible": kinds,
    }


def _counts(group: Symmetry) -> dict[str, int]:
    return {"rotations": group.n_rotations, "reflections": group.n_reflections}


def _axes(group: Symmetry) -> list[dict[str, Any]]:
    """Return how many axes there are about which the weave may be turned so many times."""
    turns = np.flatnonzero(group.proper & (group.angle_deg != 0.0))
    _, line = np.unique(np.round(group.axis[turns], 6), axis=0, return_inverse=True)
    folds, numbers = np.unique(np.bincount(line.ravel()) + 1, return_counts=True)
    pairs = zip(folds.tolist(), numbers.tolist(), strict=True)
    return [{"fold": fold, "count": number} for fold, number in reversed(list(pairs))]
