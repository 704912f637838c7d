"""Cut the room of strands out of the quads of crossings: about their middles on the portals.

What a portal is, and where strands cross it, says :mod:`fabweave.mesh.portals`.
"""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, unit
from fabweave.mesh.halfedge import Halfedges

#: Rounds in which the share that keeps strands flat on one another is found.
_ROUNDS = 6
#: What is no larger than this many times something else is as large.
_SAME = 1.0 + 1e-9


def portal_middles(
    portals: FloatArray, halfedges: Halfedges, crossing_halfedge: IntArray
) -> FloatArray:
    """Return where strands cross the sides of each crossing's quad, (X, 4).

    The quad's corners are the tail of the crossing's half-edge, the centre on its right, its head,
    and the centre on its left; side k runs from corner k to the next, and has a share of that way.
    """
    left, right = crossing_halfedge, halfedges.twin[crossing_halfedge]
    corners = np.stack([right, halfedges.prev[right], left, halfedges.prev[left]], axis=1)
    middles = portals[corners]
    middles[:, 1::2] = 1.0 - middles[:, 1::2]
    return middles


def portal_windows(quads: FloatArray, middles: FloatArray) -> FloatArray:
    """Return the room that each pass has: the part of its quad about its own middle line.

    Parameters
    ----------
    quads : (P, 4, D) float array
        Right entry, right exit, left exit and left entry of each pass.
    middles : (P, 2) float array
        Where its middle crosses the exit, as a share of the way from right to left, and the entry,
        of the way from left to right.

    Returns
    -------
    (P, 4, D) float array
        Each portal's longest piece with that middle, at the same corners.
    """
    half = np.minimum(middles, 1.0 - middles)
    low, high = (middles - half)[:, :, None], (middles + half)[:, :, None]
    exits, entry = (quads[:, 1], quads[:, 2]), (quads[:, 3], quads[:, 0])
    (right_exit, left_exit), (left_entry, right_entry) = (
        tuple((1.0 - share[:, k]) * start + share[:, k] * end for share in (low, high))
        for k, (start, end) in enumerate((exits, entry))
    )
    return np.stack([right_entry, right_exit, left_exit, left_entry], axis=1)


@frozen_value
class Meeting:
    """Where the middles of the two strands meet at each crossing, and how wide they may be there.

    Parameters
    ----------
    point : (X, 3) float array
    along : (X, 2) float array
        How far along its middle line, from 0 to 1, each strand meets the other: the one from side
        3 of the quad to side 1, and the one from side 2 to side 0.
    most : (X,) float array
        The greatest share of their room that both may take.
    """

    point: FloatArray
    along: FloatArray
    most: FloatArray


def meet_strands(
    quads: FloatArray, normal: FloatArray, middles: FloatArray, length: float
) -> Meeting:
    """Find where strands meet, and the greatest share of their room that both may take.

    Where two strands lie on one another, both must be flat: the corners of that place lie within
    both crossing panels, which are so long relative to the room. As the corners move almost in
    proportion to the widths, some rounds of that rule find the share.

    Parameters
    ----------
    quads : (X, 4, 3) float array
        The planar quad of each crossing.
    normal : (X, 3) float array
    middles : (X, 4) float array
        As from :func:`portal_middles`.
    length : float
        Relative length of crossing panels, the greatest share of all.

    Examples
    --------
    In a square that is crossed in the middles of its sides, strands may be as wide as panels are
    long, and so they may in the rhombus of two regular triangles:

    >>> square = np.array([[[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]])
    >>> up = np.array([[0.0, 0, 1]])
    >>> meeting = meet_strands(square, up, np.full((1, 4), 0.5), 0.7)
    >>> meeting.point.tolist(), meeting.along.tolist(), meeting.most.tolist()
    ([[0.0, 0.0, 0.0]], [[0.5, 0.5]], [0.7])
    >>> rhombus = square * [np.sqrt(3), 1, 1]
    >>> meet_strands(rhombus, up, np.array([[0.75, 0.25, 0.75, 0.25]]), 0.7).most.round(9).tolist()
    [0.7]
    """
    along = unit(quads[:, 2] - quads[:, 0])
    plane = np.stack([along, np.cross(normal, along)], axis=2)
    flat = np.einsum("xkd,xdc->xkc", quads - quads[:, :1], plane)
    first = portal_windows(flat, middles[:, [1, 3]])
    second = portal_windows(np.roll(flat, 1, axis=1), middles[:, [0, 2]])
    u, v = _crossing_of(_line(first, 0.5), _line(second, 0.5))
    share = np.full(len(quads), length)
    for _ in range(_ROUNDS):
        reach = _reach(first, second, share, (u, v))
        share = np.where(reach > length * _SAME, share * length / reach, share)
    (start, way), here = _line(portal_windows(quads, middles[:, [1, 3]]), 0.5), u[:, None]
    return Meeting(start + here * way, np.stack([u, v], axis=1), share)


def _line(quad: FloatArray, side: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return start and way of the line at a share of the way from the right rail to the left."""
    s = np.broadcast_to(side, len(quad))[:, None]
    start = (1 - s) * quad[:, 0] + s * quad[:, 3]
    return start, (1 - s) * quad[:, 1] + s * quad[:, 2] - start


def _crossing_of(
    first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return how far along each of two lines they cross."""
    (one, way), (other, across) = first, second
    size = _cross(way, across)
    safe = np.where(size != 0, size, 1.0)
    return (
        np.where(size != 0, _cross(other - one, across) / safe, 0.5),
        np.where(size != 0, _cross(other - one, way) / safe, 0.5),
    )


def _reach(
    first: FloatArray, second: FloatArray, share: FloatArray, met: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Return how much of their panels' room strands of a width need to cross each other, (X,)."""
    reach = np.zeros(len(first))
    for one in (0.5 - share / 2, 0.5 + share / 2):
        for other in (0.5 - share / 2, 0.5 + share / 2):
            corner = _crossing_of(_line(first, one), _line(second, other))
            for here, middle in zip(corner, met, strict=True):
                room = np.minimum(middle, 1.0 - middle)
                reach = np.maximum(reach, np.abs(here - middle) / np.maximum(room, 1e-9))
    return reach


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
