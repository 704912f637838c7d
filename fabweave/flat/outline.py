"""Turn unfolded strips into the outlines of pieces, in each piece's own frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from fabweave.core.arc_path import Path, straight_path
from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.flat.path_fit import fit_paths
from fabweave.flat.unfold.development import Strips

#: Outlines have no side shorter than this: cutters and their software stumble over shorter ones.
SHORTEST_SIDE_MM = 0.1

#: Vertices that stand off their neighbours' line by less than this are dropped.
STRAIGHT_MM = 0.02

#: What is cut stays this near to the exact development, wherever it is.
FIT_MM = 0.02

#: Polygons inscribed in what is cut stay this near to it.
INSCRIBED_MM = 0.01


@dataclass(frozen=True)
class Frame:
    """The rigid motion from a strip's frame to its piece's frame: p -> R(angle) p + shift."""

    angle: float
    shift: FloatArray

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points in the piece's frame."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return points @ np.array([[cosine, sine], [-sine, cosine]]) + self.shift


def strip_outline(right: FloatArray, left: FloatArray) -> FloatArray:
    """Return the outline of a strip: along its right rail and back along its left one.

    Sides shorter than 0.1 mm and vertices on a straight line are left out; the four end corners
    stay.

    Returns
    -------
    (K, 2) float array
        Counter-clockwise, first point not repeated; fewer than four points if the strip is
        narrower than the shortest side.
    """
    rails = np.concatenate((_thin(right), _thin(left)[::-1]))
    if np.hypot(*(right[0] - left[0])) < SHORTEST_SIDE_MM:
        rails = rails[:-1]
    if np.hypot(*(right[-1] - left[-1])) < SHORTEST_SIDE_MM:
        rails = np.delete(rails, len(_thin(right)), axis=0)
    return rails


def _thin(rail: FloatArray) -> FloatArray:
    """Drop points nearer than the shortest side to the last kept one; keep both ends."""
    steps = np.hypot(*np.diff(rail, axis=0).T)
    if np.all(steps >= SHORTEST_SIDE_MM):
        return rail
    kept = [0]
    for index in range(1, len(rail) - 1):
        if np.hypot(*(rail[index] - rail[kept[-1]])) >= SHORTEST_SIDE_MM:
            kept.append(index)
    while len(kept) > 1 and np.hypot(*(rail[-1] - rail[kept[-1]])) < SHORTEST_SIDE_MM:
        kept.pop()
    kept.append(len(rail) - 1)
    return rail[kept]


def strip_outlines(strips: Strips) -> list[FloatArray]:
    """Return the outline of every strip in its own frame, in order."""
    raw = raw_outlines(strips)
    polygons = shapely.polygons([shapely.LinearRing(p) if len(p) >= 3 else None for p in raw])
    simple = shapely.is_valid(polygons)
    thinner = shapely.simplify(polygons, STRAIGHT_MM, preserve_topology=True)
    return [
        shapely.get_coordinates(new)[:-1] if ok else points
        for new, ok, points in zip(thinner, simple, raw, strict=True)
    ]


def ring_paths(raw: Sequence[FloatArray]) -> list[Path]:
    """Return each of some closed polygons as a path of few sides and arcs.

    No point of a path is more than 0.02 mm from its polygon, and no point of the polygon from
    the path; turns of more than 12 degrees stay as they are.
    """
    paths = fit_paths(raw, FIT_MM)
    polygons = shapely.polygons([shapely.LinearRing(path.flattened(FIT_MM / 10)) for path in paths])
    # A strip narrower than the tolerance might cross itself.
    return [
        path if ok else straight_path(points)
        for path, ok, points in zip(paths, shapely.is_valid(polygons), raw, strict=True)
    ]


def inscribed_polygon(path: Path) -> FloatArray:
    """Return the polygon for nesting and marks: its corners are on the path, 0.01 mm near."""
    return path.flattened(INSCRIBED_MM, least_mm=SHORTEST_SIDE_MM)


def raw_outlines(strips: Strips) -> list[FloatArray]:
    """Return the outlines with all vertices."""
    bounds = strips.offsets.tolist()
    return [strip_outline(strips.right[a:b], strips.left[a:b]) for a, b in pairwise(bounds)]


def simple(outlines: Sequence[FloatArray]) -> BoolArray:
    """Say which outlines are simple polygons.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> simple([square, square[[0, 2, 1, 3]], square[:2]]).tolist()
    [True, False, False]
    """
    polygons = [
        shapely.Polygon(outline) if len(outline) >= 3 else shapely.Polygon() for outline in outlines
    ]
    return np.asarray(shapely.is_valid(polygons) & ~shapely.is_empty(polygons))


def resting_frame(outline: FloatArray, start: FloatArray, end: FloatArray) -> Frame:
    """Return the motion that lays an outline along +x in its smallest rectangle, corner at 0.

    Parameters
    ----------
    outline : (K, 2) float array
        A polygon.
    start, end : (2,) float arrays
        Two of its points; ``end`` comes to lie to the right of ``start``.
    """
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    sides = np.diff(hull, axis=0)
    angles = -np.arctan2(sides[:, 1], sides[:, 0])
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x = cosine * hull[:, 0] - sine * hull[:, 1]
    y = sine * hull[:, 0] + cosine * hull[:, 1]
    wide, high = np.ptp(x, axis=1), np.ptp(y, axis=1)
    # Rounding makes ties fall the same way on every machine.
    best = int(np.argmin(np.round(wide * high, 6)))
    angle = float(angles[best])
    if high[best] > wide[best]:
        angle += np.pi / 2
    way = end - start
    if np.cos(angle) * way[0] - np.sin(angle) * way[1] < 0:
        angle += np.pi
    turned = Frame(angle, np.zeros(2)).apply(outline)
    return Frame(angle, -turned.min(axis=0))
