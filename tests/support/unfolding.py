"""Measure how exact an unfolding is."""

import numpy as np

from fabweave.flat.unfold.development import Strips
from fabweave.ribbon.project import Ribbons


def worst_stretch(ribbons: Ribbons, strips: Strips) -> float:
    """The largest relative change of length over all facet edges, diagonals included."""
    right, left = ribbons.right[strips.rung], ribbons.left[strips.rung]
    inner = np.ones(len(strips.rung), dtype=bool)
    inner[strips.offsets[1:][np.diff(strips.offsets) > 0] - 1] = False
    near = np.flatnonzero(inner)
    far = near + 1
    slanted = ribbons.from_right[strips.rung[near]]
    start = np.where(slanted, near, near + len(right))
    end = np.where(slanted, far + len(right), far)
    space, flat = np.concatenate((right, left)), np.concatenate((strips.right, strips.left))
    every = np.arange(len(right))
    edges = np.concatenate(
        (
            np.column_stack((every, every + len(right))),
            np.column_stack((near, far)),
            np.column_stack((near, far)) + len(right),
            np.column_stack((start, end)),
        )
    )
    length = np.linalg.norm(space[edges[:, 0]] - space[edges[:, 1]], axis=1)
    unfolded = np.linalg.norm(flat[edges[:, 0]] - flat[edges[:, 1]], axis=1)
    return float(np.max(np.abs(unfolded - length) / length))
