"""Hold closed paths of straight sides and circular arcs, and measure them exactly.

An arc is a side with a bulge: the tangent of a quarter of its sweep, positive where the path turns
left (counter-clockwise) on its way from one point to the next. That is the convention of DXF; a
bulge of 0 is a straight side, 1 a half circle.
"""

import numpy as np

from fabweave.core.arrays import FloatArray, frozen_value, offsets_of


@frozen_value
class Path:
    """A closed path: (N, 2) points and the (N,) bulges of the sides that leave them."""

    points: FloatArray
    bulges: FloatArray

    @property
    def area(self) -> float:
        """The area enclosed, positive if the path runs counter-clockwise.

        Examples
        --------
        >>> disc = Path(np.array([[-1.0, 0.0], [1.0, 0.0]]), np.ones(2))
        >>> round(disc.area - np.pi, 12), round(disc.length - 2 * np.pi, 12)
        (0.0, 0.0)
        """
        start, end = self.points, np.roll(self.points, -1, axis=0)
        chord = np.hypot(*(end - start).T)
        # About the first point, so that far from the origin no digits are lost.
        (x, y), (u, v) = (start - start[0]).T, (end - start[0]).T
        return float(np.sum(x * v - y * u) / 2 + np.sum(_segment_areas(chord, self.bulges)))

    @property
    def length(self) -> float:
        """The length all around."""
        chord = np.hypot(*(np.roll(self.points, -1, axis=0) - self.points).T)
        return float(np.sum(chord * stretch(self.bulges)))

    def flattened(self, tolerance_mm: float, *, least_mm: float = 0.0) -> FloatArray:
        """Return the corners of a polygon inscribed in the path; see `flattened`."""
        return flattened(self.points, self.bulges, tolerance_mm, closed=True, least_mm=least_mm)


def straight_path(points: FloatArray) -> Path:
    """Return a polygon as a path."""
    return Path(points, np.zeros(len(points)))


def stretch(bulges: FloatArray) -> FloatArray:
    """Return how many times longer than their chords arcs are.

    Examples
    --------
    >>> stretch(np.array([0.0, 1.0, -1.0])).round(6).tolist()
    [1.0, 1.570796, 1.570796]
    """
    bent = np.abs(bulges)
    safe = np.where(bent > 0.0, bent, 1.0)
    return np.where(bent > 0.0, np.arctan(bent) / safe * (1.0 + bent**2), 1.0)


def _segment_areas(chord: FloatArray, bulges: FloatArray) -> FloatArray:
    """Return the areas between arcs and their chords, signed as the bulges."""
    half = 2.0 * np.arctan(bulges)  # half the sweep
    flat = np.abs(half) < 1e-3
    sine = np.where(flat, 1.0, np.sin(half))
    # (2 a - sin 2a) / (8 sin² a), where a is half the sweep; near 0 by its series.
    curved = (half - np.sin(half) * np.cos(half)) / (4.0 * sine**2)
    return chord**2 * np.where(flat, half / 6.0 * (1.0 + 2.0 * half**2 / 15.0), curved)


def flattened(
    points: FloatArray,
    bulges: FloatArray,
    tolerance_mm: float,
    *,
    closed: bool,
    least_mm: float = 0.0,
) -> FloatArray:
    """Return points along a run of sides and arcs, the points of the run among them.

    Parameters
    ----------
    points : (N, 2) float array
    bulges : (N,) float array
        Of the side that leaves each point; the last one is ignored in an open run.
    tolerance_mm : float
        No chord stands off its arc by more than this.
    closed : bool
        Whether a last side leads back to the first point, which is not repeated.
    least_mm : float
        No chord is shorter than this, unless its arc is.

    Returns
    -------
    (M, 2) float array

    Examples
    --------
    >>> half = np.array([[0.0, 0.0], [2.0, 0.0]])
    >>> flattened(half, np.array([1.0, 0.0]), 0.3, closed=False).round(3).tolist()
    [[0.0, 0.0], [1.0, -1.0], [2.0, 0.0]]
    """
    last = None if closed else len(points) - 1
    start, end = points[:last], np.roll(points, -1, axis=0)[:last]
    bulge = bulges[:last]
    chord = end - start
    length = np.hypot(*chord.T)
    sweep = 4.0 * np.arctan(np.abs(bulge))
    bent = bulge != 0.0
    radius = np.divide(
        length * (1.0 + bulge**2), 4.0 * np.abs(bulge), out=np.full(len(bulge), np.inf), where=bent
    )
    # A chord of sweep s stands off by r (1 - cos s/2).
    most = 4.0 * np.arcsin(np.sqrt(np.minimum(tolerance_mm / (2.0 * radius), 0.5)))
    steps = np.ceil(np.divide(sweep, most, out=np.ones(len(bulge)), where=bent))
    if least_mm > 0.0:
        arc = length * stretch(bulge)
        # The margin is for chords, which are shorter than their arcs.
        steps = np.minimum(steps, np.maximum(np.floor(0.98 * arc / least_mm), 1.0))
    counts = np.maximum(steps, 1.0).astype(np.int64)
    side = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(side)) - offsets_of(counts)[side]) / counts[side]
    chords, sweeps = chord[side], 4.0 * np.arctan(bulge[side])
    result = points_on_sides(start[side], start[side] + chords, sweeps, share)
    return result if closed else np.concatenate((result, points[-1:]))


def points_on_sides(
    start: FloatArray, end: FloatArray, sweep: FloatArray, share: FloatArray
) -> FloatArray:
    """Return a point on each of some sides and arcs, at a share of its length.

    Parameters
    ----------
    start, end : (N, 2) float arrays
    sweep : (N,) float array
        The angle that each arc turns, radians, positive to the left; 0 for a straight side.
    share : (N,) float array
        From 0 at the start to 1 at the end.

    Returns
    -------
    (N, 2) float array

    Examples
    --------
    >>> ends = np.array([[0.0, 0.0]]), np.array([[2.0, 0.0]])
    >>> points_on_sides(*ends, np.array([np.pi]), np.array([0.5])).round(6).tolist()
    [[1.0, -1.0]]
    """
    half, chord, bent = sweep / 2.0, end - start, sweep != 0.0
    # By the tangent half-angle: the point that divides the sweep so stands at these fractions of
    # the chord along it and to its right.
    sine = np.where(bent, np.sin(half), 1.0)
    along = np.where(bent, np.sin(share * half) * np.cos((1 - share) * half) / sine, share)
    right = np.where(bent, np.sin(share * half) * np.sin((1 - share) * half) / sine, 0.0)
    x, y = chord.T
    placed: FloatArray = start + along[:, None] * chord + right[:, None] * np.stack((y, -x), axis=1)
    return placed
