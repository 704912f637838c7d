"""Build tubes along torus knots."""

import math

import numpy as np
from scipy.spatial.distance import cdist

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.grids import grid_quads

# The knot winds around a torus whose tube is this thick, relative to its ring.
_FLATNESS = 0.5
# Samples of the curve for each lobe; the reach is then found to within a percent.
_SAMPLES = 96


def knot(p: int, q: int, m: int, n: int, tube: float, size: float) -> PolyMesh:
    """Return a tube along the (p, q) torus knot, an exact m × n grid of quads.

    The rows follow a rotation-minimising frame, turned a little more at every step so that they
    close up without a shift; so the threads are those of an m × n torus, ``2 · gcd(m, n)``.

    Parameters
    ----------
    p, q : int
        Turns around the axis, and turns around the ring; without a common divisor.
    m, n : int
        Quads along the knot, or 0 for about square ones, and quads around the tube.
    tube : float
        Radius of the tube.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of genus 1.

    Raises
    ------
    InputError
        If the turns have a common divisor, if there are too few quads, or if the tube is thicker
        than the knot's reach, so that it would run through itself.

    Examples
    --------
    >>> knot(2, 3, 60, 6, 8.0, 100.0).n_faces
    360

    References
    ----------
    Wang, Jüttler, Zheng, Liu, "Computation of rotation minimizing frames", ACM TOG 27(1), 2008.
    Litherland, Simon, Durumeric, Rawdon, "Thickness of knots", Topology and its Applications 91
    (1999): the reach is the least of the radii of curvature and of half the distances between
    strands.
    """
    if math.gcd(p, q) != 1:
        raise InputError(
            f"the shape knot: p ({p}) and q ({q}) have the common divisor {math.gcd(p, q)}, so "
            "there would be several strands; choose p and q without one, such as p=2&q=3"
        )
    curve = torus_knot(p, q, _SAMPLES * max(p, q))
    span = float(np.ptp(curve, axis=0).max())
    if 2 * tube >= size:
        raise InputError(
            f"the shape knot: a tube of radius {tube:g} mm is thicker than the size ({size:g} mm)"
        )
    length = np.linalg.norm(curve - np.roll(curve, 1, axis=0), axis=1).sum()
    if m and m < 8 * max(p, q):
        raise InputError(
            f"the shape knot: m ({m}) must be {8 * max(p, q)} or more to follow the curves, or 0"
        )
    if not m:
        around = (size - 2 * tube) / span * length / (2 * math.pi * tube / n)
        m = max(2 * round(around / 2), 8 * max(p, q))
    middle = _evenly(curve, m)
    normal, binormal = closed_frame(middle)
    angle = np.arange(n) * (2 * math.pi / n)
    # Rows run so that, with columns along the knot, faces turn outward.
    around_tube = (
        np.cos(angle)[:, None] * normal[:, None] + np.sin(angle)[:, None] * binormal[:, None]
    )
    scale = _scale_to_size(middle[:, None], tube * around_tube, size)
    reach = scale * reach_of(curve)
    if tube >= reach:
        raise InputError(
            f"the shape knot: a tube of radius {tube:g} mm runs through itself, because "
            f"the ({p}, {q}) knot only has room for {reach:.3g} mm at this size; choose a "
            "thinner tube"
        )
    places = scale * middle[:, None] + tube * around_tube
    return PolyMesh.from_faces(places.reshape(-1, 3), grid_quads(m, n, wrap=(True, True)))


def torus_knot(p: int, q: int, count: int) -> FloatArray:
    """Return places along the (p, q) torus knot around a ring of radius 1, (count, 3).

    Examples
    --------
    >>> torus_knot(2, 3, 4)[0, :2].tolist()
    [1.5, 0.0]
    """
    turn = np.arange(count) * (2 * math.pi / count)
    out = 1 + _FLATNESS * np.cos(q * turn)
    return np.column_stack(
        [out * np.cos(p * turn), out * np.sin(p * turn), -_FLATNESS * np.sin(q * turn)]
    )


def reach_of(curve: FloatArray) -> float:
    """Return the radius up to which a tube around a closed curve does not meet itself.

    Parameters
    ----------
    curve : (N, 3) float array
        Places along the curve, close together.

    Returns
    -------
    float
        The reach, by Litherland, Simon, Durumeric, Rawdon (1999).

    Examples
    --------
    >>> turn = np.arange(400) * (2 * np.pi / 400)
    >>> round(reach_of(np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])), 3)
    1.0
    """
    before, after = np.roll(curve, 1, axis=0), np.roll(curve, -1, axis=0)
    sides = np.linalg.norm(np.stack([curve - before, after - curve, after - before]), axis=2)
    area = np.linalg.norm(np.cross(curve - before, after - curve), axis=1)
    bend = float((sides.prod(axis=0) / (2 * np.maximum(area, 1e-300))).min())
    along = np.cumsum(sides[1]) - sides[1]
    total = float(sides[1].sum())
    apart = np.abs(along[:, None] - along)
    # By Schur's theorem, nearer along the curve no two places are closer than 2 · bend.
    far = np.minimum(apart, total - apart) >= math.pi * bend
    least = float(cdist(curve, curve)[far].min(initial=np.inf))
    return min(bend, least / 2)


def closed_frame(middle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a frame across a closed curve that turns as little as it can and closes up.

    Parameters
    ----------
    middle : (M, 3) float array
        Places along the curve, evenly spaced.

    Returns
    -------
    normal, binormal : (M, 3) float arrays
        Unit vectors; tangent, binormal, normal are right-handed in this order.
    """
    tangent = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    count = len(middle)
    normal = np.empty((count + 1, 3))
    lowest = np.eye(3)[np.abs(tangent[0]).argmin()]
    normal[0] = np.cross(tangent[0], lowest)
    normal[0] /= np.linalg.norm(normal[0])
    for place in range(count):
        # Two reflections carry the frame on: one takes place to place, one tangent to tangent.
        following = (place + 1) % count
        step = middle[following] - middle[place]
        mirrored = [_reflected(v, step) for v in (normal[place], tangent[place])]
        normal[place + 1] = _reflected(mirrored[0], tangent[following] - mirrored[1])
    first, last = normal[0], normal[-1]
    side = np.cross(tangent[0], first)
    missing = -math.atan2(last @ side, last @ first)
    turn = (np.arange(count) * missing / count)[:, None]
    left = np.cross(tangent, normal[:-1])
    turned = np.cos(turn) * normal[:-1] + np.sin(turn) * left
    return turned, np.cross(turned, tangent)


def _reflected(vector: FloatArray, across: FloatArray) -> FloatArray:
    square = float(across @ across)
    return vector if square < 1e-30 else vector - 2 * (across @ vector) / square * across


def _evenly(curve: FloatArray, count: int) -> FloatArray:
    """Return places at even distances along a closed polyline."""
    ring = np.concatenate([curve, curve[:1]])
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(ring, axis=0), axis=1))))
    wanted = np.arange(count) * along[-1] / count
    return np.column_stack([np.interp(wanted, along, ring[:, k]) for k in range(3)])


def _scale_to_size(curve: FloatArray, offset: FloatArray, size: float) -> float:
    """Return the scale at which scale · curve + offset has a largest dimension.

    The dimension is a maximum of linear functions of the scale, so Newton's method from a large
    scale comes down to the answer in finitely many steps.
    """
    shape = offset.shape
    flat, across = np.broadcast_to(curve, shape).reshape(-1, 3), offset.reshape(-1, 3)
    scale = 2 * size / float(np.ptp(flat, axis=0).max())
    for _ in range(50):
        places = scale * flat + across
        axis = int(np.ptp(places, axis=0).argmax())
        high, low = places[:, axis].argmax(), places[:, axis].argmin()
        slope = float(flat[high, axis] - flat[low, axis])
        excess = float(places[high, axis] - places[low, axis]) - size
        scale -= excess / slope
        if abs(excess) <= 1e-12 * size:
            break
    return scale
