"""Turn polygons into pixels: squares of side s, owned by a polygon if their centres lie in it.

Every point is within s / √2 of a pixel's centre: so polygons that are inflated by as much, and own
no pixel in common, do not meet.
"""

import math

import numpy as np
import shapely

from fabweave.core.arrays import BoolArray, FloatArray, places_in_groups

#: Chords in a quarter circle of a buffered corner.
_ARC_STEPS = 16


def closed_sides(outline: FloatArray) -> FloatArray:
    """Return the sides of a closed outline (K, 2) by their ends, (K, 2, 2).

    Examples
    --------
    >>> import numpy as np
    >>> closed_sides(np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]))[2].tolist()
    [[0.0, 1.0], [0.0, 0.0]]
    """
    return np.stack([outline, np.roll(outline, -1, axis=0)], axis=1)


def inflated_sides(outline: FloatArray, radius_mm: float) -> FloatArray:
    """Return the sides of a polygon that contains everything within a radius of the outline.

    Parameters
    ----------
    outline : (K, 2) float array
        Simple polygon, millimetres.
    radius_mm : float
        The radius, positive.

    Returns
    -------
    (E, 2, 2) float array
        First and second end of every side, of the outer ring and of any holes.

    Examples
    --------
    >>> import numpy as np
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> inflated_sides(square, 2.0).min(axis=(0, 1)).round(1).tolist()
    [-2.0, -2.0]
    """
    return region_sides(shapely.polygons(outline), radius_mm)


def region_sides(region: shapely.Geometry, radius_mm: float) -> FloatArray:
    """Return the sides of what `inflated_sides` returns, of polygons that may have holes.

    Examples
    --------
    >>> region_sides(shapely.box(0.0, 0.0, 1.0, 1.0), 2.0).max().round(1)
    np.float64(3.0)
    """
    # The corners of a buffer are chords of arcs, and GEOS rounds their number, so that a chord
    # may span up to one and a half steps; the factor puts every chord outside its arc.
    reach = radius_mm / math.cos(1.5 * math.pi / (4.0 * _ARC_STEPS))
    return ring_sides(shapely.buffer(region, reach, quad_segs=_ARC_STEPS))


def ring_sides(region: shapely.Geometry) -> FloatArray:
    """Return the sides of all rings of polygons, (E, 2, 2).

    Examples
    --------
    >>> ring_sides(shapely.box(0.0, 0.0, 1.0, 1.0)).shape
    (4, 2, 2)
    """
    ends = [shapely.get_coordinates(ring) for ring in shapely.get_rings(shapely.get_parts(region))]
    return np.concatenate([np.stack([ring[:-1], ring[1:]], axis=1) for ring in ends])


def filled_pixels(sides: FloatArray, shape: tuple[int, int], pixel_mm: float) -> BoolArray:
    """Return which pixel centres lie inside polygons, by the even-odd rule along each row.

    Parameters
    ----------
    sides : (R, E, 2, 2) float array
        The closed sides of R polygons (the same one at R rotations, say), millimetres; pixel
        (row j, column i) has its centre at ((i + ½) s, (j + ½) s).
    shape : (int, int)
        Rows H and columns W.
    pixel_mm : float
        The side s of a pixel.

    Returns
    -------
    (R, H, W) bool array
        True where the centre is inside.

    Examples
    --------
    >>> import numpy as np
    >>> ring = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    >>> filled_pixels(closed_sides(ring)[None], (2, 3), 1.0).astype(int).tolist()
    [[[1, 1, 0], [0, 0, 0]]]
    """
    count, height, width = len(sides), *shape
    x0, y0 = sides[..., 0, 0].ravel(), sides[..., 0, 1].ravel()
    x1, y1 = sides[..., 1, 0].ravel(), sides[..., 1, 1].ravel()
    owner = np.repeat(np.arange(count), sides.shape[1])
    first = np.ceil(np.minimum(y0, y1) / pixel_mm - 0.5).astype(np.int64).clip(0, height)
    last = np.ceil(np.maximum(y0, y1) / pixel_mm - 0.5).astype(np.int64).clip(0, height)
    rows = last - first  # half-open, so that a vertex on a row counts once
    side = np.repeat(np.arange(len(rows)), rows)
    row = places_in_groups(rows) + first[side]
    share = ((row + 0.5) * pixel_mm - y0[side]) / (y1[side] - y0[side])
    x = x0[side] + share * (x1[side] - x0[side])
    column = np.ceil(x / pixel_mm - 0.5).astype(np.int64).clip(0, width)
    cell = (owner[side] * height + row) * (width + 1) + column
    crossings = np.bincount(cell, minlength=count * height * (width + 1))
    parity = np.cumsum(crossings.reshape(count, height, width + 1), axis=2, dtype=np.uint8)
    return (parity[:, :, :width] & 1).astype(np.bool_)
