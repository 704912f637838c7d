"""Measure the areas, rectangles and cut lengths of pieces."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import shapely
from scipy.spatial.distance import pdist

from fabweave.verify.crossing_map import CrossingMap, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.arcs import ring_area, ring_length


class Areas(NamedTuple):
    """What pieces come to: inside their outlines, in holes and slots, and the length of cuts."""

    outline_mm2: float
    holes_mm2: float
    cut_mm: float
    #: How many holes and slots there are.
    cutouts: int

    @property
    def piece_mm2(self) -> float:
        """What is left of the material."""
        return self.outline_mm2 - self.holes_mm2


def areas_of(piece: Piece, plan: CrossingMap) -> Areas:
    """Return what a piece comes to."""
    diameters = np.array([hole.diameter or 0.0 for hole in plan.holes[piece.id]])
    slots = piece.slots
    return Areas(
        abs(ring_area(piece.path)),
        float(np.sum(np.pi * diameters**2 / 4.0)) + sum(abs(ring_area(slot)) for slot in slots),
        ring_length(piece.path)
        + float(np.sum(np.pi * diameters))
        + sum(ring_length(slot) for slot in slots),
        len(diameters) + len(slots),
    )


def sum_areas(areas: Iterable[Areas]) -> Areas:
    """Return what pieces come to together."""
    return Areas(*(sum(column) for column in zip(Areas(0.0, 0.0, 0.0, 0), *areas, strict=True)))


def polygon_area(outline: Floats) -> float:
    """Return the area of a polygon."""
    x, y = (outline - outline[0]).T
    return abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))) / 2


def rectangles_around(outline: Floats) -> Floats:
    """Return length and width of the rectangle along each side of a figure's hull, (K, 2)."""
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    along = np.diff(hull, axis=0)
    along = along / np.hypot(*along.T)[:, None]
    across = np.array([-along[:, 1], along[:, 0]])
    spans = np.stack([np.ptp(hull @ along.T, axis=0), np.ptp(hull @ across, axis=0)], axis=1)
    return np.sort(spans, axis=1)[:, ::-1]


def least_rectangle(outline: Floats) -> Floats:
    """Return length and width of the smallest rectangle: it lies along a side of the hull."""
    rectangles = rectangles_around(outline)
    return np.asarray(rectangles[np.argmin(rectangles.prod(axis=1))])


def span_and_width(outline: Floats) -> Floats:
    """Return how far a figure reaches, and how narrow a slot it passes.

    Unlike the sides of the smallest rectangle, both change as little as the points do.
    """
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    return np.array([pdist(hull).max(), rectangles_around(outline).min()])
