"""Find where a title stands well on a piece: inside it, along it, clear of holes and lettering."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely

from fabweave.arrays import FloatArray
from fabweave.cut.drawing import Circle, Layer, PieceDrawing, Polyline

_Region: TypeAlias = Any  # a shapely geometry: shapely ships no types

#: The smallest title, taken where no larger one fits, millimetres.
SMALLEST_TITLE_MM = 2.5
# How many font sizes are tried.
_N_SIZES = 9
_DIRECTIONS_DEG = np.arange(-75.0, 91.0, 15.0)
# A capital's box in heights of the font, with air for the halo.
_LETTER_WIDTH, _AIR, _LETTER_HEIGHT = 0.62, 0.45, 1.05
# How many points of a piece are looked at, and at how many of them sizes are tried.
_SAMPLES, _CANDIDATES = 150, 12


class Title(NamedTuple):
    """Where a title stands: its middle, its direction (counter-clockwise) and its font size."""

    x: float
    y: float
    angle_deg: float = 0.0
    height_mm: float = 6.0


def place_titles(pieces: Sequence[PieceDrawing], *, largest_mm: float = 9.0) -> dict[str, Title]:
    """Return a title for each piece.

    Of the points of the piece that are farthest from its outline, its holes and its engraved
    labels, and of directions between -75 and 90 degrees, the pair is taken that admits the
    largest letters. Where none fits, holes and labels are ignored; then the outline is.

    Parameters
    ----------
    pieces : sequence of PieceDrawing
        Pieces on a sheet, millimetres; one without an outline gets no title.
    largest_mm : float
        Font size of a title that has room enough.

    Returns
    -------
    dict from piece id to Title
        No title stands on its head.

    Examples
    --------
    >>> box = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 10.0], [0.0, 10.0]])
    >>> piece = PieceDrawing("A1", (Polyline(Layer.CUT_OUTER, box, closed=True),))
    >>> title = place_titles([piece])["A1"]
    >>> title.angle_deg, title.height_mm
    (0.0, 9.0)
    """
    sizes = np.geomspace(max(largest_mm, SMALLEST_TITLE_MM), SMALLEST_TITLE_MM, _N_SIZES)
    found = {piece.piece_id: _place(piece, sizes) for piece in pieces}
    return {name: title for name, title in found.items() if title is not None}


def _place(piece: PieceDrawing, sizes: FloatArray) -> Title | None:
    """Return the title of one piece; sizes come the largest first."""
    rings = [_outline_of(entity) for entity in piece.entities if entity.layer is Layer.CUT_OUTER]
    if not rings:
        return None
    area = max(rings, key=lambda region: float(region.area))
    holes = [_outline_of(entity) for entity in piece.entities if entity.layer is Layer.CUT_INNER]
    labels = [
        shapely.box(*shapely.LineString(entity.points).bounds).buffer(0.3)
        for entity in piece.entities
        if entity.layer is Layer.ENGRAVE_LABEL and isinstance(entity, Polyline)
    ]
    for obstacles in (holes + labels, holes):
        title = _largest(area.difference(shapely.union_all(obstacles)), piece.piece_id, sizes)
        if title is not None:
            return title
    point = area.representative_point()
    return Title(float(point.x), float(point.y), 0.0, SMALLEST_TITLE_MM)


def _outline_of(entity: Polyline | Circle) -> _Region:
    if isinstance(entity, Circle):
        return shapely.Point(entity.x, entity.y).buffer(entity.radius)
    return shapely.make_valid(shapely.Polygon(entity.points))


def _largest(free: _Region, text: str, sizes: FloatArray) -> Title | None:
    """Return the title with the largest letters whose box lies in a region."""
    points = _middles(free)
    if not len(points):
        return None
    half = np.array([_LETTER_WIDTH * len(text) + _AIR, _LETTER_HEIGHT]) / 2.0
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    angle = np.deg2rad(_DIRECTIONS_DEG)
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = np.stack(
        [
            np.outer(cosine, corners[:, 0]) - np.outer(sine, corners[:, 1]),
            np.outer(sine, corners[:, 0]) + np.outer(cosine, corners[:, 1]),
        ],
        axis=-1,
    )
    # Boxes for each size, then each point, then each direction: the first that fits is the best.
    boxes = sizes[:, None, None, None, None] * turned[None, None] + points[None, :, None, None, :]
    shapely.prepare(free)
    fits = shapely.contains_properly(free, shapely.polygons(boxes.reshape(-1, 4, 2)))
    best = np.flatnonzero(fits.reshape(len(sizes), -1).any(axis=1))
    if not len(best):
        return None
    at = fits.reshape(len(sizes), len(points), -1)[best[0]]
    # Among directions that fit at one point, the middle one keeps most clear of the outline.
    place = int(np.argmax(at.sum(axis=1)))
    directions = np.flatnonzero(at[place])
    direction = _DIRECTIONS_DEG[directions[np.argmin(np.abs(_DIRECTIONS_DEG[directions]))]]
    x, y = points[place].tolist()
    return Title(x, y, float(direction), float(sizes[best[0]]))


def _middles(free: _Region) -> FloatArray:
    """Return the points of a grid that are deepest in a region, the deepest first, (N, 2)."""
    if free.is_empty or free.area <= 0.0:
        return np.empty((0, 2))
    left, bottom, right, top = free.bounds
    step = float(np.sqrt(free.area / _SAMPLES))
    x, y = np.meshgrid(
        np.arange(left + step / 2.0, right, step), np.arange(bottom + step / 2.0, top, step)
    )
    grid: FloatArray = np.stack([x.ravel(), y.ravel()], axis=1)
    shapely.prepare(free)
    inside = np.asarray(shapely.contains_xy(free, grid[:, 0], grid[:, 1]), dtype=np.bool_)
    grid = grid[inside]
    depth: FloatArray = shapely.distance(free.boundary, shapely.points(grid))
    # Equal depths keep the order of the grid, whatever the machine.
    return grid[np.argsort(-np.round(depth, 6), kind="stable")[:_CANDIDATES]]
