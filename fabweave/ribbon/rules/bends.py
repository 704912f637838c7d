"""Measure how ribbons bend, twist and fold, and how wide they really are."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.ribbon.project import Ribbons, following_rung, preceding_rung

#: Panels whose outward sides look away from one another have no plane between them.
_FACING = 0.2
#: A span is judged as one arch only if it goes on from panel to panel without turning back.
_ONWARD = 0.5
#: Turns within this of half a turn, in radians, have no sign.
_HALF_TURN = 1e-4


@frozen_value
class Bends:
    """What is measured at each rung, or on the quad that follows it; NaN where there is none.

    Parameters
    ----------
    width_mm : (R,) float array
        Width across the walking direction; a slanted rung is longer than the ribbon is wide.
    bend_rad_mm : (R,) float array
        Bend at the rung per millimetre: the reciprocal of the radius, positive where the ribbon
        is convex as seen from outside.
    twist_rad_mm : (R,) float array
        Turn of the quad's rungs about the middle line, per millimetre along it.
    turn_deg : (R,) float array
        Angle by which the mean planes of the quads on either side turn about the rung.
    fold_deg : (R,) float array
        Angle between the two facets that meet at the rung.
    diagonal_deg : (R,) float array
        Angle between the two facets of the quad.
    step_mm : (R,) float array
        Length of the quad along the middle line.
    """

    width_mm: FloatArray
    bend_rad_mm: FloatArray
    twist_rad_mm: FloatArray
    turn_deg: FloatArray
    fold_deg: FloatArray
    diagonal_deg: FloatArray
    step_mm: FloatArray

    @property
    def radius_mm(self) -> FloatArray:
        """Radius of the bend at each rung; infinite where it is straight, or an end."""
        bend = np.abs(self.bend_rad_mm)
        return np.where(bend > 0, 1 / np.where(bend > 0, bend, 1.0), np.inf)


@frozen_value
class Spans:
    """What is measured between each pass and the next of its thread; NaN where there is none.

    Parameters
    ----------
    radius_mm : (P,) float array
        Largest radius to which any ribbon between the two crossings can be bent throughout.
    twist_deg : (P,) float array
        Turn about the middle line over a length that equals the width, spread over the span.
    length_mm : (P,) float array
        From the middle of one panel to that of the next, along the middle line.
    """

    radius_mm: FloatArray
    twist_deg: FloatArray
    length_mm: FloatArray


def measure_bends(ribbons: Ribbons) -> Bends:
    """Measure every rung and quad of the ribbons as they are modelled.

    The bend at a rung is the angle by which the mean planes of the quads on either side turn about
    it, spread over half of either quad, measured across the rung. For equal flat quads of length s
    on a cylinder of radius R that is s / (2 asin(s / 2R)) = R (1 - s^2 / 24 R^2 - ...), whichever
    way the strip winds: the radius to second order. Mean planes are taken because the two facets of
    a skew quad fold to and fro where a ribbon twists, at any fineness; that is not a bend, and is
    measured as twist.

    Parameters
    ----------
    ribbons : Ribbons
        With any number of rungs.
    """
    following = following_rung(ribbons.offsets, ribbons.closed)
    has_quad = following >= 0
    after = np.where(has_quad, following, np.arange(len(following)))
    before = preceding_rung(following)
    inner = has_quad & (before >= 0)
    prior = np.where(inner, before, 0)

    right, left = ribbons.right, ribbons.left
    rung, middle = left - right, (right + left) / 2
    step = middle[after] - middle
    length = np.where(has_quad, _norm(step), np.nan)
    width = _width(rung, step, before, has_quad)
    normal = np.cross(left[after] - right, left - right[after])
    across = _unit(rung)
    reach = step[prior] - _dot(step[prior], across)[:, None] * across
    spread = (_norm(reach) + _norm(step - _dot(step, across)[:, None] * across)) / 2
    about = signed_angle(normal[prior], normal, across)
    turn = signed_angle(rung, rung[after], _unit(step))
    # Rounding decides on the sign of a half turn: none is counted as turning clockwise.
    turn = np.where(turn < _HALF_TURN - np.pi, np.pi, turn)
    twist = np.where(has_quad, _ratio(turn, length), np.nan)

    first, second = _facet_normals(ribbons, after)
    fold = np.where(inner, _angle_deg(second[prior], first), np.nan)
    return Bends(
        width_mm=width,
        bend_rad_mm=np.where(inner, _ratio(about, spread), np.nan),
        twist_rad_mm=twist,
        turn_deg=np.where(inner, np.degrees(about), np.nan),
        fold_deg=fold,
        diagonal_deg=np.where(has_quad, _angle_deg(first, second), np.nan),
        step_mm=length,
    )


def measure_spans(ribbons: Ribbons, bends: Bends) -> Spans:
    """Measure between crossings what no ribbon can avoid, however softly it takes the bends.

    Panels are modelled flat, so all bending stands between them; a real strip spreads it. Let a
    and b be the slopes of two consecutive panels against the chord of length s between them. Every
    curve with these ends bends somewhere by at least k / s, where
    k = |a + b| + sqrt(2 a^2 + 2 b^2), and one made of two arcs bends no more (bang-bang control of
    the slope; to second order in the slopes). So a ribbon of radius s / k is the softest there is:
    on a circular arc, a = -b and the radius is the circle's; between over and under on flat
    ground, a = b. Crossings are taken to keep their places and their planes.

    A span that turns back on its way (at a boundary) is not measured.

    Parameters
    ----------
    ribbons : Ribbons
    bends : Bends
        Of the same ribbons.
    """
    following = following_rung(ribbons.pass_offsets, ribbons.closed)
    here, there = ribbons.entry, ribbons.entry[np.maximum(following, 0)]
    middle = (ribbons.right + ribbons.left) / 2
    place = (middle[here] + middle[here + 1]) / 2
    chord = (middle[there] + middle[there + 1]) / 2 - place
    normal = _unit(
        np.cross(
            ribbons.left[here + 1] - ribbons.right[here],
            ribbons.left[here] - ribbons.right[here + 1],
        )
    )
    ahead = normal[np.maximum(following, 0)]
    along = _unit(chord)
    upward = normal + ahead
    upward = upward - _dot(upward, along)[:, None] * along
    facing = _norm(upward) > _FACING
    upward = _unit(upward)
    slopes = []
    for plane in (normal, ahead):
        rise, level = -_dot(plane, along), _dot(plane, upward)
        # A plane beyond the vertical still has a slope: that of a wall.
        slopes.append(np.arctan2(rise, np.maximum(level, 1e-9)))
    a, b = slopes
    need = np.abs(a + b) + np.sqrt(2 * a**2 + 2 * b**2)
    need = np.where(facing, need, np.radians(_angle_deg(normal, ahead)))

    length = _sum_between(ribbons, following, bends.step_mm)
    length = length + (bends.step_mm[here] + bends.step_mm[there]) / 2
    way = _unit(middle[here + 1] - middle[here])
    level_way = way - _dot(way, upward)[:, None] * upward
    level_ahead = _unit(middle[there + 1] - middle[there])
    level_ahead = level_ahead - _dot(level_ahead, upward)[:, None] * upward
    # Down a steep slope little of a direction is level: compare with what there is.
    onward = (_dot(level_way, along) > _ONWARD * _norm(level_way)) & (
        _dot(level_ahead, along) > _ONWARD * _norm(level_ahead)
    )
    measured = (following >= 0) & (onward | ~facing)
    turn = _sum_between(ribbons, following, bends.twist_rad_mm * bends.step_mm)
    broad = (bends.width_mm[here] + bends.width_mm[there]) / 2
    return Spans(
        radius_mm=np.where(
            measured, np.where(need > 0, length / np.where(need > 0, need, 1.0), np.inf), np.nan
        ),
        twist_deg=np.where(
            following >= 0, _ratio(np.degrees(np.abs(turn)) * broad, length), np.nan
        ),
        length_mm=np.where(following >= 0, length, np.nan),
    )


def signed_angle(first: FloatArray, second: FloatArray, axis: FloatArray) -> FloatArray:
    """Return by how much vectors turn about unit axes, (N,), in radians from -pi to pi.

    Examples
    --------
    >>> turned = signed_angle(*(np.array([v]) for v in ([1., 0, 5], [0., 2, 7], [0., 0, 1])))
    >>> round(float(np.degrees(turned[0])), 9)
    90.0
    """
    sine = _dot(np.cross(first, second), axis)
    cosine = _dot(first, second) - _dot(first, axis) * _dot(second, axis)
    return np.arctan2(sine, cosine)


def _width(rung: FloatArray, step: FloatArray, before: IntArray, has_quad: BoolArray) -> FloatArray:
    """Return the width across the direction in which the middle line passes each rung."""
    way = np.where(has_quad[:, None], _unit(step), 0.0)
    arrives = before >= 0
    way[arrives] += _unit(step[before[arrives]])
    way = _unit(way)
    return _norm(rung - _dot(rung, way)[:, None] * way)


def _facet_normals(ribbons: Ribbons, after: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return the area vectors of each quad's two facets: the one at its near rung first."""
    a, b, c, d = ribbons.right, ribbons.right[after], ribbons.left[after], ribbons.left
    slanted = ribbons.from_right[:, None]
    near = np.where(slanted, np.cross(c - a, d - a), np.cross(b - a, d - a))
    far = np.where(slanted, np.cross(b - a, c - a), np.cross(c - b, d - b))
    return near, far


def _sum_between(ribbons: Ribbons, following: IntArray, values: FloatArray) -> FloatArray:
    """Sum values of quads from each panel (not included) to the next one (not included)."""
    total = np.concatenate(([0.0], np.cumsum(np.nan_to_num(values))))
    start, end = ribbons.entry + 1, ribbons.entry[np.maximum(following, 0)]
    thread = np.searchsorted(ribbons.offsets, ribbons.entry, side="right") - 1
    wraps = end < start
    around = total[ribbons.offsets[thread + 1]] - total[ribbons.offsets[thread]]
    return total[end] - total[start] + np.where(wraps, around, 0.0)


def _ratio(value: FloatArray, length: FloatArray) -> FloatArray:
    """Return values per length; 0 on what has no length, and so nothing to bend."""
    return np.where(length > 0, value / np.where(length > 0, length, 1.0), 0.0)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", first, second))


def _norm(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(_dot(vectors, vectors)))


def _unit(vectors: FloatArray) -> FloatArray:
    length = _norm(vectors)[:, None]
    return vectors / np.where(length > 0, length, 1.0)


def _angle_deg(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the angle between vectors, accurate near 0 and 180 degrees too."""
    return np.degrees(np.arctan2(_norm(np.cross(first, second)), _dot(first, second)))
