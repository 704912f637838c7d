"""Ribbons of known shape."""

from dataclasses import replace

import numpy as np

from fabweave.ribbon.project import Ribbons, better_diagonals, following_rung


def strip(right: np.ndarray, left: np.ndarray, *, closed: bool = False, entry=None) -> Ribbons:
    """One ribbon through given rungs; panels begin at ``entry``."""
    count = len(right)
    entry = np.array([1] if entry is None else entry)
    offsets, ring = np.array([0, count]), np.array([closed])
    return Ribbons(
        offsets=offsets,
        right=np.asarray(right, float),
        left=np.asarray(left, float),
        from_right=better_diagonals(
            np.asarray(right, float), np.asarray(left, float), following_rung(offsets, ring)
        ),
        pass_offsets=np.array([0, len(entry)]),
        entry=entry,
        closed=ring,
        normal=np.zeros((0, 3)),
        centre=np.zeros((0, 3)),
    )


def shifted(ribbons: Ribbons, thread: int, by: np.ndarray) -> Ribbons:
    """Return ribbons of which one is moved."""
    own = slice(*ribbons.offsets[thread : thread + 2])
    right, left = ribbons.right.copy(), ribbons.left.copy()
    right[own] += by
    left[own] += by
    return replace(ribbons, right=right, left=left)
