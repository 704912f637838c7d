"""Find where a title stands well on a piece: inside it, along it, clear of holes and lettering."""

from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
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
# How far outlines may stand off their arcs here, and how exactly the widest place is found.
_FLAT_MM, _EXACT_MM = 0.05, 0.5
# A place is wide that has this share of the widest circle.
_WIDE = 0.9
# Titles keep so far from engraved letters, millimetres.
_OFF_MM = 0.4
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

    It stands in the midst of where the piece is widest, clear of its outline, holes and engraved
    labels; of the directions level and along the outline there, the one is taken that
    admits the larger letters. Where none fits, labels are ignored; then holes and the outline are.

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
    >>> from fabweave.sheet.drawing import Polyline
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
    outers, inners = (
        [_region(entity) for entity in piece.entities if entity.layer is layer]
        for layer in (Layer.CUT_OUTER, Layer.CUT_INNER)
    )
    strokes = [
        entity.flattened(_FLAT_MM)
        for entity in piece.entities
        if isinstance(entity, Polyline) and entity.layer is Layer.ENGRAVE_LABEL
    ]
    if not outers:
        return None
    area = max(outers, key=lambda region: float(region.area))
    bare = area.difference(shapely.union_all(inners))
    # At once: what surrounds single strokes may be too bad a polygon to be united.
    letters = shapely.MultiLineString(strokes).buffer(_OFF_MM, quad_segs=1)
    for free in (bare.difference(letters), bare):
        title = _largest(free, piece.title, sizes)
        if title is not None:
            return title
    point = area.representative_point()
    return Title(float(point.x), float(point.y), 0.0, SMALLEST_TITLE_MM)


def _region(entity: Entity) -> _Region:
    """Return what an entity encloses."""
    if isinstance(entity, Circle):
        return shapely.Point(entity.x, entity.y).buffer(entity.radius)
    return shapely.make_valid(shapely.Polygon(entity.flattened(_FLAT_MM)))


def _largest(free: _Region, text: str, sizes: FloatArray) -> Title | None:
    """Return the title with the largest letters in the widest place of a region.

    A box grows about its middle with its letters. So the largest size that fits in a direction is
    the least, over all points of the border, of the greater of two distances: that along the
    direction in halves of the width, and that across it in halves of the height, at size one.
    """
    if not free.area > 0.0:
        return None
    # Letters have bends without end, of which the widest place wants to know little.
    rough = free.simplify(_EXACT_MM)
    radius = shapely.length(shapely.maximum_inscribed_circle(rough, _EXACT_MM))
    inside = rough.buffer(-_WIDE * radius, quad_segs=1)
    widest = max(shapely.get_parts(inside), key=shapely.area)
    way = shapely.shortest_line(widest.representative_point(), free.boundary)
    middle, touched = shapely.get_coordinates(way)
    # The outline runs square to the way there.
    across_deg = np.rad2deg(np.arctan2(*(touched - middle)[::-1]))
    along_deg = _STEP_DEG * np.rint((across_deg + 90.0) / _STEP_DEG)
    # From -90 (not included) to 90 degrees: no title stands on its head.
    direction_deg = np.array([0.0, 90.0 - (90.0 - along_deg) % 180.0])
    border = shapely.get_coordinates(shapely.segmentize(free.boundary, _STEP_MM)) - middle
    turn = np.exp(-1j * np.deg2rad(direction_deg))[:, None] * (border @ np.array([1.0, 1.0j]))
    wide, high = _LETTER_WIDTH * len(text) + _AIR, _LETTER_HEIGHT
    room = np.maximum(np.abs(turn.real) * 2.0 / wide, np.abs(turn.imag) * 2.0 / high)
    fits = np.round(np.minimum(room.min(axis=1), sizes[0]), 6)
    if not fits.max() >= sizes[-1]:
        return None
    # Where both are as good, the level one.
    angle = float(direction_deg[int(np.argmax(fits))])
    size = sizes[np.argmax(sizes <= fits.max() + 1e-6)]
    return Title(float(middle[0]), float(middle[1]), angle, float(size))
