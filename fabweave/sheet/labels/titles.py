"""Find where a title stands well on a piece: inside it, along it, clear of holes and lettering."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely
from scipy.spatial import KDTree

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.sheet.drawing import Circle, Entity, Layer, PieceDrawing, Polyline

_Region: TypeAlias = Any  # a shapely geometry: shapely ships no types

#: The smallest title, taken where no larger one fits, millimetres.
SMALLEST_TITLE_MM = 2.5
# How many font sizes are tried.
_N_SIZES = 9
# Titles stand in directions that are whole numbers of these.
_STEP_DEG = 5.0
# A capital's box in heights of the font, with air for the halo.
_LETTER_WIDTH, _AIR, _LETTER_HEIGHT = 0.62, 0.45, 1.05
# How many points of a piece are looked at, and at how many of them letters are tried.
_SAMPLES, _CANDIDATES = 120, 8
# How far outlines may stand off their arcs here, millimetres.
_FLAT_MM = 0.05
# How far apart the points stand by which a title keeps clear of lines, millimetres; letters have
# more air than half of it.
_STEP_MM = 0.8


class Title(NamedTuple):
    """Where a title stands: its middle, its direction (counter-clockwise) and its font size."""

    x: float
    y: float
    angle_deg: float = 0.0
    height_mm: float = 6.0


def place_titles(pieces: Sequence[PieceDrawing], *, largest_mm: float = 9.0) -> dict[str, Title]:
    """Return a title for each piece.

    Of the points of the piece that are farthest from its outline, its holes and its engraved
    labels, and of directions level and along the outline nearby, the pair is taken that admits
    the largest letters. Where none fits, labels are ignored; then holes and the outline are.

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
    titles = {piece.piece_id: _place(piece, sizes) for piece in pieces}
    return {name: title for name, title in titles.items() if title is not None}


def _place(piece: PieceDrawing, sizes: FloatArray) -> Title | None:
    """Return the title of one piece; sizes come the largest first."""
    outers, inners, labels = (
        [entity for entity in piece.entities if entity.layer is layer]
        for layer in (Layer.CUT_OUTER, Layer.CUT_INNER, Layer.ENGRAVE_LABEL)
    )
    strokes = [label.points for label in labels if isinstance(label, Polyline)]
    if not outers:
        return None
    area = max((_outline_of(ring) for ring in outers), key=lambda region: float(region.area))
    discs = np.array([(e.x, e.y, e.radius) for e in inners if isinstance(e, Circle)])
    discs = discs.reshape(-1, 3)
    slots = [_outline_of(entity) for entity in inners if isinstance(entity, Polyline)]
    free = area.difference(shapely.union_all(slots)) if slots else area
    middles = _grid(free)
    rim = shapely.get_coordinates(shapely.segmentize(free, _STEP_MM))
    title = None
    if len(middles):
        distance, nearest = KDTree(rim).query(middles)
        # Letters run along the outline that is next to them.
        run = rim[1:] - rim[:-1]
        run = run[np.minimum(nearest, len(run) - 1)]
        along_deg = np.rad2deg(np.arctan2(run[:, 1], run[:, 0]))
        depth: FloatArray = np.minimum(np.asarray(distance), _clearance(middles, discs))
        turn = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
        ring = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        rounds = (discs[:, None, :2] + discs[:, None, 2:] * ring).reshape(-1, 2)
        obstacles = np.concatenate([rim, rounds])
        if strokes:
            letters, spots = _lettering(strokes)
            low = np.minimum(depth, _clearance(middles, spots))
            everything = np.concatenate([obstacles, letters])
            title = _largest(middles, low, along_deg, everything, piece.title, sizes)
        if title is None:
            title = _largest(middles, depth, along_deg, obstacles, piece.title, sizes)
    if title is None:
        point = area.representative_point()
        title = Title(float(point.x), float(point.y), 0.0, SMALLEST_TITLE_MM)
    return title


def _outline_of(entity: Entity) -> _Region:
    if isinstance(entity, Circle):
        return shapely.Point(entity.x, entity.y).buffer(entity.radius)
    polygon = shapely.Polygon(entity.flattened(_FLAT_MM))
    return polygon if polygon.is_valid else shapely.make_valid(polygon)


def _lettering(strokes: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Return points all along some strokes, (N, 2), and a disc over each stroke, (M, 3)."""
    counts = np.array([len(stroke) for stroke in strokes])
    points = np.concatenate(strokes)
    first = offsets_of(counts)
    halves = np.delete((points[:-1] + points[1:]) / 2.0, first[1:-1] - 1, axis=0)
    low = np.minimum.reduceat(points, first[:-1])
    high = np.maximum.reduceat(points, first[:-1])
    radius = np.hypot(*(high - low).T)[:, None] / 2.0
    return np.concatenate([points, halves]), np.concatenate([(low + high) / 2.0, radius], axis=1)


def _clearance(points: FloatArray, discs: FloatArray) -> FloatArray:
    """Return how far each point is from the next of some discs, below zero inside one."""
    if not len(discs):
        return np.full(len(points), np.inf)
    dx = points[:, 0, None] - discs[:, 0]
    dy = points[:, 1, None] - discs[:, 1]
    apart: FloatArray = np.sqrt(dx * dx + dy * dy) - discs[:, 2]
    return apart.min(axis=1)


def _grid(free: _Region) -> FloatArray:
    """Return the points of a grid that lie in a region, (N, 2)."""
    if free.is_empty or free.area <= 0.0:
        return np.empty((0, 2))
    left, bottom, right, top = free.bounds
    step = float(np.sqrt(free.area / _SAMPLES))
    # Odd numbers, so that the middle of a straight strip is among them.
    nx, ny = (
        int((high - low) / step / 2.0) * 2 + 1 for low, high in ((left, right), (bottom, top))
    )
    x = left + (right - left) * (np.arange(nx) + 0.5) / nx
    y = bottom + (top - bottom) * (np.arange(ny) + 0.5) / ny
    grid: FloatArray = np.stack([np.tile(x, len(y)), np.repeat(y, len(x))], axis=1)
    shapely.prepare(free)
    inside = np.asarray(shapely.contains_xy(free, grid[:, 0], grid[:, 1]), dtype=np.bool_)
    return grid[inside]


def _largest(
    middles: FloatArray,
    depth: FloatArray,
    along_deg: FloatArray,
    obstacles: FloatArray,
    text: str,
    sizes: FloatArray,
) -> Title | None:
    """Return the title with the largest letters whose box holds no point of an obstacle.

    A box grows about its middle with its letters. So the largest size that fits at a middle in a
    direction is the least, over all obstacles, of the greater of two distances: that along the
    direction in halves of the width, and that across it in halves of the height, at size one.
    """
    # Equal depths keep the order of the grid, whatever the machine.
    chosen = np.argsort(-np.round(depth, 6), kind="stable")[:_CANDIDATES]
    chosen = chosen[depth[chosen] > 0.0]  # not in a hole
    if not len(chosen):
        return None
    near = np.rint(along_deg[chosen] / _STEP_DEG)
    steps = np.stack([np.zeros(len(near)), near], axis=1)
    # From -90 (not included) to 90 degrees: no title stands on its head.
    half_turn = 180.0 / _STEP_DEG
    direction_deg = -((-steps + half_turn / 2.0) % half_turn - half_turn / 2.0) * _STEP_DEG + 0.0
    angle = np.deg2rad(direction_deg)[:, :, None]
    cosine, sine = np.cos(angle), np.sin(angle)
    dx, dy = (obstacles[:, axis] - middles[chosen, axis, None, None] for axis in (0, 1))
    wide, high = _LETTER_WIDTH * len(text) + _AIR, _LETTER_HEIGHT
    along = np.abs(dx * (cosine * 2.0 / wide) + dy * (sine * 2.0 / wide))
    across = np.abs(dy * (cosine * 2.0 / high) - dx * (sine * 2.0 / high))
    fits = np.round(np.minimum(np.maximum(along, across).min(axis=2), sizes[0]), 6)
    if not fits.max() >= sizes[-1]:
        return None
    # Where several are as good: the deepest point, and there the direction nearest to level.
    place = int(np.argmax(fits.max(axis=1)))
    best = direction_deg[place][fits[place] == fits.max()]
    size = sizes[np.argmax(sizes <= fits.max() + 1e-6)]
    x, y = middles[chosen[place]].tolist()
    return Title(x, y, float(best[np.argmin(np.abs(best))]), float(size))
