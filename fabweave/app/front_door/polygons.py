"""Turn pieces into shapely polygons."""

import shapely

from fabweave.flat.outline import inscribed_polygon
from fabweave.flat.piece import Piece


def piece_polygon(piece: Piece) -> shapely.Polygon:
    """Return a piece as a polygon with its round holes and slots, in its own frame."""
    holes = [
        shapely.Point(x, y).buffer(diameter / 2, quad_segs=16).exterior
        for _, x, y, diameter in piece.holes.tolist()
    ]
    slots = [shapely.LinearRing(inscribed_polygon(slot.path)) for slot in piece.slots]
    return shapely.Polygon(piece.outline, [*holes, *slots])
