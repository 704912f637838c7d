"""Lay the pieces of a ring out as a picture of the manual: flat, with numbers at their holes."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.flat.rim_ring import RimRing

#: Numbers stand so far beyond the border, and need so much room, in points; pieces so much between.
_BEYOND, _NUMBER, _BETWEEN = 7.0, 7.0, 6.0
#: The corners of arcs are off by so much, millimetres.
_FLAT_MM = 0.05
_POINTS_MM = 72.0 / 25.4


@frozen_value
class FlatPiece:
    """A piece of a ring in a picture, in points from its upper left corner, y upwards.

    Parameters
    ----------
    id : str
    outline : (N, 2) float array
    holes : (H, 2) float array
    numbers : (H, 2) float array
        Where the number of each hole stands, beyond the outer border.
    hole : float
        The radius of the holes.
    middle : (2,) float array
        Where the id stands: in the middle of the band, between two holes.
    """

    id: str
    outline: FloatArray
    holes: FloatArray
    numbers: FloatArray
    hole: float
    middle: FloatArray


@frozen_value
class RingPicture:
    """The pieces of a ring below one another, how high that is, and how many times smaller."""

    pieces: tuple[FlatPiece, ...]
    high: float
    ratio: float


def ring_picture(ring: RimRing, wide: float) -> RingPicture:
    """Return the pieces of a ring, all in one scale, in a picture of some width in points.

    They lie letters up, as they are engraved.
    """
    outlines = [piece.path.flattened(_FLAT_MM) for piece in ring.pieces]
    widest = max(float(np.ptp(outline[:, 0])) for outline in outlines)
    needed = widest * _POINTS_MM / (wide - 2.0 * (_BEYOND + _NUMBER))
    ratio = max(math.ceil(10.0 * needed) / 10.0, 1.0)
    scale = _POINTS_MM / ratio
    pieces, top = [], 0.0
    for piece, outline in zip(ring.pieces, outlines, strict=True):
        radii = np.hypot(*outline.T) * scale
        reach = float(radii.max()) + _BEYOND
        holes = piece.holes[:, :2] * scale
        numbers = holes * (reach / np.hypot(*holes.T))[:, None]
        drawn = np.concatenate((outline * scale, numbers))
        low, high = drawn.min(axis=0) - _NUMBER, drawn.max(axis=0) + _NUMBER
        shift = np.array([(wide - low[0] - high[0]) / 2.0, top - high[1]])
        half = len(holes) // 2
        between = holes[half - 1 : half + 1].mean(axis=0)
        away = (radii.min() + radii.max()) / 2.0
        pieces.append(
            FlatPiece(
                id=piece.id,
                outline=outline * scale + shift,
                holes=holes + shift,
                numbers=numbers + shift,
                hole=float(piece.holes[0, 2]) / 2.0 * scale,
                middle=between * (away / np.hypot(*between)) + shift,
            )
        )
        top -= float(high[1] - low[1]) + _BETWEEN
    return RingPicture(tuple(pieces), -top, ratio)
