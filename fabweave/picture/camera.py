"""Choose from where an object is seen, and map it to the pixels of a picture."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.errors import InputError

#: A picture has no more pixels.
MOST_PIXELS = 60_000_000
#: Share of the picture left free around the object.
MARGIN = 0.05
# The front, where y is least. The views tried, from it: right of it, left of it; of what is so many
# times longer than it is wide, more from the side.
_FRONT_DEG = -90.0
_TURNS_DEG, _LONG = (30.0, -30.0, 15.0, -15.0, 60.0, -60.0), 1.3
#: What is as high as it is wide is seen at eye height; the flatter, the higher, so that a ring
#: shows its hole. Height over width where that begins and ends.
_EYE_DEG, _FLAT_DEG = 12.0, 36.0
_UPRIGHT, _FLAT = 0.9, 0.25
#: How much higher is tried, too.
_RISE_DEG = 12.0
#: What is open has an outside: the mean of its normals is at least so long, where that of a closed
#: body is zero. A mask or a relief stands if that mean is so level; a roof is flat, and its mean is
#: so upright (beyond the last it is a plane), and so low it is looked at.
_OPEN, _LEVEL, _ROOF, _PLANE = 0.3, 0.7, 0.75, 0.97
_ROOF_DEG = 20.0
#: What bulges less than this, as a share of its width, has its outside where its normals say.
_BULGE = 0.02
#: What is open above (a bowl, a vase, a tube) is seen from so high that its rim reads. The rim lies
#: in this share of the height at the top, and within half of it nothing is above a quarter down.
_RIM_DEG, _RIM, _WITHIN, _DOWN = 24.0, 0.08, 0.5, 0.25
#: A rim is no narrower than this share of the whole.
_TIP = 0.05
#: The head of a body is on top. Where the top, so much of the height, leans by this share of the
#: width, views from there count more; by more than the last to the back, and that is the front.
_HEAD, _LEANS, _BACK = 0.3, 0.12, 0.2
#: Another view must show this much more; one from higher up, as the horizon reads better.
_WORTH_A_TURN, _WORTH_A_RISE = 1.15, 1.2
#: What a view is worth in which nearly all that is seen of a body lies in one plane, and the length
#: of the mean of the normals that are seen from which that is so (of a sphere it is two thirds).
_WORTH_IF_FLAT, _ONE_PLANE = 0.8, 0.86


@dataclass(frozen=True)
class View:
    """A direction from which an object is seen, from afar (parallel projection).

    Parameters
    ----------
    azimuth_deg : float
        Where the eye is around the z axis, which points up: 0 is on the x axis, and -90 in front,
        where x points right.
    elevation_deg : float
        How high the eye is over the horizon, -90 to 90.
    width_mm : float or None
        How much of the world the picture shows across, so that several pictures have one scale;
        None makes the object fill it.

    Examples
    --------
    >>> View(-90.0, 0.0).axes().round(12).tolist()
    [[1.0, 0.0, 0.0], [-0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
    """

    azimuth_deg: float = -60.0
    elevation_deg: float = 30.0
    width_mm: float | None = None

    def axes(self) -> FloatArray:
        """Return the unit vectors to the right, up and towards the eye as rows, (3, 3)."""
        if not (np.isfinite(self.azimuth_deg) and -90.0 <= self.elevation_deg <= 90.0):
            raise InputError(
                f"the view has azimuth {self.azimuth_deg} and elevation {self.elevation_deg}; "
                "the azimuth must be a number, the elevation one from -90 to 90 degrees"
            )
        turn, rise = np.radians((self.azimuth_deg, self.elevation_deg))
        towards = np.array([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)])
        right = np.array([-np.sin(turn), np.cos(turn), 0.0])
        return np.stack((right, np.cross(towards, right), towards))


@frozen_value
class Frame:
    """How a picture maps an object to pixels.

    Parameters
    ----------
    width_px, height_px : int
        Size of the picture.
    axes : (3, 3) float array
        Rows to the right, up and towards the eye.
    pixels_per_mm : float
        Scale.
    left_px, top_px : float
        Where the model's origin is.
    """

    width_px: int
    height_px: int
    axes: FloatArray
    pixels_per_mm: float
    left_px: float
    top_px: float

    def pixels(self, points: FloatArray) -> FloatArray:
        """Return x to the right, y from the top and nearness of points, all in pixels, (N, 3)."""
        turned = points @ self.axes.T * self.pixels_per_mm
        return turned * (1.0, -1.0, 1.0) + (self.left_px, self.top_px, 0.0)


def frame_object(
    points: FloatArray, view: View, size_px: tuple[int, int], margin: float = MARGIN
) -> Frame:
    """Return the frame in which an object fills a picture, with a little margin around.

    Where the view says how wide the picture is, the object stands in its middle at that scale.

    Parameters
    ----------
    points : (V, 3) float array
        Everything that must be in the picture.
    view : View
        From where it is seen.
    size_px : (int, int)
        Width and height in pixels.
    margin : float
        Share of the picture left free on each side.

    Raises
    ------
    InputError
        If there are no points, one is not finite, or the picture would be empty or too large.

    Examples
    --------
    >>> frame = frame_object(np.array([[-1.0, 0, -1], [1.0, 0, 1]]), View(-90.0, 0.0), (100, 100))
    >>> frame.pixels(np.array([[1.0, 7.0, 1.0]])).round(6).tolist()
    [[95.0, 5.0, -315.0]]
    """
    width, height = size_px
    if view.width_mm is not None and not 0.0 < view.width_mm < np.inf:
        raise InputError(f"a picture cannot show {view.width_mm} mm across; take more than 0")
    if not (width >= 1 and height >= 1 and width * height <= MOST_PIXELS):
        raise InputError(
            f"a picture of {width} x {height} pixels cannot be made; take at least one pixel and "
            f"at most {MOST_PIXELS // 1_000_000} million"
        )
    if len(points) == 0 or not np.all(np.isfinite(points)):
        what = "has no points" if len(points) == 0 else "has points that are not finite"
        raise InputError(f"the object to be shown {what}; check the mesh first")
    axes = view.axes()
    across = points @ axes[:2].T
    low, high = across.min(axis=0), across.max(axis=0)
    extent = np.maximum(high - low, 1e-9 * max(float(np.abs(points).max()), 1e-9))
    room = np.array([width, height]) * (1.0 - 2.0 * margin)
    scale = float(np.min(room / extent)) if view.width_mm is None else width / view.width_mm
    middle = (low + high) / 2.0 * scale
    return Frame(
        width, height, axes, scale, float(width / 2.0 - middle[0]), float(height / 2.0 + middle[1])
    )


def choose_view(points: FloatArray, triangles: IntArray) -> View:
    """Choose a three-quarter view that shows much of an object, at the height of the eye.

    Of a few views, that is taken which turns the largest area towards the eye; of nearly equal
    ones the earlier, so that a round object is seen from the usual place. Flat objects are
    looked at more from above; and a body is not looked at straight on one of its faces, as the
    tetrahedron would be, whose other faces then are hidden.

    The front is where y is least; but a mask or a relief that stands is looked in the face, from
    the side to which it bulges or, where it is flat, that of its normals; and a body whose top, its
    head, leans to the back is seen from there, and rather from the side to which it leans. What is
    open above is seen from so high that its rim reads, and a roof from a low side.

    Parameters
    ----------
    points : (V, 3) float array
        Positions.
    triangles : (T, 3) int array
        Corners, counter-clockwise as seen from outside.
    """
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    best, most = View(), -1.0
    if not len(triangles):
        return best
    used = points[np.unique(triangles)]
    across, along, _ = np.ptp(used, axis=0)
    middles = corners.mean(axis=1)
    front, lean = _front(middles, normal), np.zeros(2)
    level = float(np.hypot(*front[:2])) > _LEVEL * float(np.linalg.norm(front))
    if level:
        facing = float(np.degrees(np.arctan2(front[1], front[0])))
    else:
        lean = _lean(middles, normal)
        facing = -_FRONT_DEG if lean[1] > max(_BACK, abs(lean[0])) else _FRONT_DEG
    elevations = _heights(used, front, level=level)
    turns = _TURNS_DEG if along > _LONG * across and not level else _TURNS_DEG[:4]
    for elevation in elevations:
        for turn in turns:
            view = View(round(facing + turn, 1), elevation)
            towards = view.axes()[2]
            area = _shown(normal, towards) * (1.0 + float(lean @ towards[:2]))
            first = elevation == elevations[0] or best.elevation_deg == elevation
            if area > most * (_WORTH_A_TURN if first else _WORTH_A_RISE):
                best, most = view, area
    return best


def _front(places: FloatArray, normal: FloatArray) -> FloatArray:
    """Return the mean normal of what is open, on the side to which it bulges; zero if it is closed.

    Parameters
    ----------
    places, normal : (T, 3) float arrays
        Middles of triangles, and their normals, twice as long as their areas.
    """
    area = np.linalg.norm(normal, axis=1)
    mean = np.asarray(normal.sum(axis=0) / max(float(area.sum()), 1e-300), dtype=np.float64)
    long = float(np.linalg.norm(mean))
    if long < _OPEN:
        return np.zeros(3)
    # What bulges to the front is in front in its middle, and farther back around.
    away = places - np.average(places, axis=0, weights=np.maximum(area, 1e-300))
    ahead = away @ (mean / long)
    aside = np.sum(away**2, axis=1) - ahead**2
    bulge = float(np.average((aside - aside.mean()) * ahead, weights=np.maximum(area, 1e-300)))
    return -mean if bulge > _BULGE * float(aside.mean()) ** 1.5 else mean


def _lean(places: FloatArray, normal: FloatArray) -> FloatArray:
    """Return how far an object's top is off the middle of its surface, over its width; or zero."""
    area = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    extent = np.ptp(places, axis=0)
    top = places[:, 2] >= places[:, 2].max() - _HEAD * extent[2]
    away = np.average(places[top], axis=0, weights=area[top])
    away -= np.average(places, axis=0, weights=area)
    lean = away[:2] / np.maximum(extent[:2], 1e-9 * max(float(extent.max()), 1e-300))
    return np.asarray(lean if np.hypot(*lean) > _LEANS else np.zeros(2))


def _heights(points: FloatArray, front: FloatArray, *, level: bool) -> tuple[float, float]:
    """Return from how high an object is looked at."""
    across, along, high = np.ptp(points, axis=0)
    upright = high / max(float(np.sqrt(across * along)), 1e-300)
    lower = float(np.interp(upright, (_FLAT, _UPRIGHT), (_FLAT_DEG, _EYE_DEG)))
    if level:
        return _EYE_DEG, _EYE_DEG
    if upright < _FLAT and _ROOF < front[2] < _PLANE:
        return _ROOF_DEG, _ROOF_DEG
    if _open_above(points):
        lower = max(lower, _RIM_DEG)
    return round(lower, 1), round(lower + _RISE_DEG, 1)


def _open_above(points: FloatArray) -> bool:
    """Tell whether there is a rim on top, and nothing in it."""
    top, high = float(points[:, 2].max()), float(np.ptp(points[:, 2]))
    rim = points[points[:, 2] >= top - _RIM * high, :2]
    radii = np.ptp(rim, axis=0) / 2.0
    if radii.min() < _TIP * np.ptp(points[:, :2], axis=0).max():
        return False
    aside = np.linalg.norm((points[:, :2] - (rim.max(axis=0) - radii)) / radii, axis=1)
    return not np.any((aside < _WITHIN) & (points[:, 2] > top - _DOWN * high))


def _shown(normal: FloatArray, towards: FloatArray) -> float:
    """Return how much a view shows: twice the area turned to the eye, less if it looks flat."""
    turned = normal @ towards
    front = np.maximum(turned, 0.0)
    # Of what looks at the eye, each facet's direction with the area that is seen of it.
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    mean = np.linalg.norm((front / size) @ normal)
    flat = mean > _ONE_PLANE * front.sum()
    return float(np.abs(turned).sum()) * (_WORTH_IF_FLAT if flat else 1.0)
