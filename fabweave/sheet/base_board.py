"""Draw the board that the feet of an open object are tied to, at true size.

Strips turn back at an open rim, so that their lowest crossings lie a little above the ground, and
stand upright or slant there: no hole in a board is in line with theirs. A wire goes up through one
hole, through the hole of the crossing, and down through another: that holds a foot where it is
drawn whichever way its strips slant.
"""

from collections.abc import Sequence

import numpy as np
import shapely
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.sheet.drawing import Layer, Polyline, SheetDrawing, draw_flat
from fabweave.sheet.labels.lettering import place_text, text_box

#: What a drawing of the board is called.
BASE = "base"
#: The hole of a wire where crossings have none, millimetres.
WIRE_MM = 2.0
#: Between the edges of a foot's two holes there is so much more than their diameter, and no two
#: holes are nearer; so far from all is the edge of the board, millimetres.
_APART_MM, _LEAST_MM, _BORDER_MM = 2.0, 1.0, 10.0
#: How high names are, and how far from the hole, millimetres.
_NAME_MM, _OFF_MM = 3.5, 2.0
#: Strips that lie flatter have no side: horizontal part of their normal.
_FLAT = 0.2


@frozen_value
class BaseBoard:
    """A board that feet are tied to.

    Parameters
    ----------
    drawing : SheetDrawing
        Seen from above, the front at the bottom.
    names : tuple of str
        Of the strips that cross at each foot, the upper one first.
    high_mm : (N,) float array
        How high each foot is above the board.
    hole_mm : float
    """

    drawing: SheetDrawing
    names: tuple[str, ...]
    high_mm: FloatArray
    hole_mm: float

    @property
    def size(self) -> str:
        """How large it is, in words."""
        return f"{self.drawing.width_mm:.0f} x {self.drawing.height_mm:.0f} mm"


def base_board(
    names: Sequence[str], places: FloatArray, normals: FloatArray, hole_mm: float
) -> BaseBoard:
    """Return the board of an object's feet.

    Parameters
    ----------
    names : sequence of str
        Of the strips that cross at each foot.
    places, normals : (N, 3) float arrays
        Where feet are above the ground, millimetres, and outward at their crossings.
    hole_mm : float
        The two holes of each, across the strips and as far from the foot.

    Raises
    ------
    CannotMakeError
        If holes run into one another.

    Examples
    --------
    >>> feet = np.array([[0.0, 0.0, 5.0], [90.0, 0.0, 5.0], [0.0, 60.0, 5.0]])
    >>> board = base_board(["A1 B1", "A1 C1", "B1 C1"], feet, np.eye(3), 2.0)
    >>> sum(one.layer is Layer.CUT_INNER for one in board.drawing.pieces[0].entities)
    6
    """
    feet = places[:, :2]
    away = feet - feet.mean(axis=0)
    way = np.where(np.hypot(*normals[:, :2].T)[:, None] > _FLAT, normals[:, :2], away)
    way = np.where(np.einsum("nd,nd->n", way, away)[:, None] < 0.0, -way, way)
    way = way / np.maximum(np.hypot(*way.T), 1e-9)[:, None]
    reach = (hole_mm + _APART_MM / 2.0) * way
    holes = np.stack([feet + reach, feet - reach], axis=1)
    _check_apart(holes.reshape(-1, 2), hole_mm)
    strokes, ends = _letters(names, holes, way, hole_mm)
    low = ends.min(axis=0) - _BORDER_MM
    high = low + np.ceil(ends.max(axis=0) + _BORDER_MM - low)
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    ticks = np.stack([feet + reach / 3.0, feet - reach / 3.0], axis=1)
    drawn = draw_flat(
        BASE,
        [stroke - low for stroke in strokes],
        list(ticks - low),
        [(x, y, hole_mm) for x, y in (holes - low).reshape(-1, 2).tolist()],
        Polyline(Layer.CUT_OUTER, corners - low, closed=True),
    )
    wide, deep = (high - low).tolist()
    drawing = SheetDrawing(BASE, wide, deep, (drawn,), ())
    return BaseBoard(drawing, tuple(names), places[:, 2], hole_mm)


def _check_apart(holes: FloatArray, hole_mm: float) -> None:
    """Raise if holes run into one another."""
    nearest = float(np.asarray(cKDTree(holes).query(holes, k=2)[0])[:, 1].min())
    if nearest < hole_mm + _LEAST_MM:
        raise CannotMakeError(
            f"of the base, holes of {hole_mm:g} mm would be {nearest:.1f} mm apart",
            "a larger --size or --base off",
        )


def _letters(
    names: Sequence[str], holes: FloatArray, way: FloatArray, hole_mm: float
) -> tuple[list[FloatArray], FloatArray]:
    """Return the strokes of names, and what the board has to reach, (K, 2).

    A name stands outside of its holes, or inside where another is in the way there; a name that
    has no room is left out.
    """
    taken = list(shapely.buffer(shapely.points(holes.reshape(-1, 2)), hole_mm / 2.0 + 0.5))
    strokes: list[FloatArray] = []
    for name, own, along in zip(names, holes, way, strict=True):
        wide = text_box(name, _NAME_MM).width
        turn = (np.degrees(np.arctan2(along[1], along[0])) + 90.0) % 180.0 - 90.0
        across = np.array([-along[1], along[0]]) * _NAME_MM / 2.0
        for hole, out in zip(own, (along, -along), strict=True):
            centre = hole + (hole_mm / 2.0 + _OFF_MM + wide / 2.0) * out
            half = wide / 2.0 * along
            box = shapely.Polygon(
                [centre - half - across, centre + half - across, centre + half + across,
                 centre - half + across]
            )  # fmt: skip
            if not any(box.intersects(other) for other in taken):
                taken.append(box.buffer(_LEAST_MM / 2.0))
                strokes += place_text(name, _NAME_MM, centre, turn)
                break
    ends = np.concatenate([np.array(shape.exterior.coords) for shape in taken])
    middle = np.array([ends[:, 0].mean(), ends[:, 1].min() - 2.0 * _NAME_MM])
    strokes += place_text("FRONT", _NAME_MM, middle, 0.0)
    return strokes, np.concatenate([ends, middle[None] - _NAME_MM])
