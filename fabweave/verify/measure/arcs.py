"""Measure runs of sides and arcs, from their points and bulges.

A bulge is the tangent of a quarter of the angle by which a side turns to the left.
"""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float64]
Ints: TypeAlias = npt.NDArray[np.int64]

#: Where arcs are looked at as runs of chords, those stand off by this.
CHORDS_MM = 5e-4
#: A side of a lesser bulge is straight, to all digits that floats have.
_STRAIGHT = 1e-9
#: An arc that needs more chords is wider than any sheet.
_MOST_CHORDS = 20_000.0


def chords_of(points: Floats) -> Floats:
    """Return the vector from each point to the next, from the last to the first."""
    return np.concatenate([points[1:], points[:1]]) - points


def arc_lengths(chords: Floats, bulges: Floats) -> Floats:
    """Return the lengths of sides, given the lengths of their chords."""
    bent = np.maximum(np.abs(bulges), _STRAIGHT)
    return chords * np.arctan(bent) * (1.0 + bent**2) / bent


def ring_length(ring: Floats) -> float:
    """Return the length of a closed run of points and bulges, (N, 3).

    Examples
    --------
    >>> round(ring_length(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])), 6)
    6.283185
    """
    return float(np.sum(arc_lengths(np.hypot(*chords_of(ring[:, :2]).T), ring[:, 2])))


def ring_area(ring: Floats) -> float:
    """Return the area in a closed run of points and bulges, positive if counter-clockwise.

    Examples
    --------
    >>> round(ring_area(np.array([[0.0, 0.0, 1.0], [2.0, 0.0, 1.0]])), 6)
    3.141593
    """
    points, bulges = ring[:, :2], ring[:, 2]
    x, y = (points - points[0]).T
    straight = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2.0
    chords = np.hypot(*chords_of(points).T)
    bent = np.abs(bulges) > _STRAIGHT
    turn = 4.0 * np.arctan(np.abs(bulges[bent]))
    radius = chords[bent] / (2.0 * np.sin(turn / 2.0))
    # A thin segment's area is two thirds of chord and height; the exact formula loses digits.
    height = np.abs(bulges[bent]) * chords[bent] / 2.0
    caps = np.where(
        turn < 1e-2,
        2.0 / 3.0 * chords[bent] * height * (1.0 + turn**2 / 80.0),
        radius**2 / 2.0 * (turn - np.sin(turn)),
    )
    return float(straight + np.sum(np.sign(bulges[bent]) * caps))


def along(points: Floats, bulges: Floats) -> tuple[Floats, Ints]:
    """Return points along sides from each point to the next, and the point each comes after.

    The last point ends the run, whatever its bulge. Arcs become chords within ``CHORDS_MM``.

    Examples
    --------
    >>> dense, _ = along(np.array([[0.0, 0.0], [2.0, 0.0]]), np.array([1.0, 0.0]))
    >>> dense[:, 1].min().round(3), dense[-1].tolist()
    (np.float64(-1.0), [2.0, 0.0])
    """
    place = points[:, 0] + 1j * points[:, 1]
    goal = np.append(place[1:], place[-1:])
    # What leaves its chord by less than that is straight.
    bent = np.abs(bulges) * np.abs(goal - place) > CHORDS_MM / 100.0
    bent[-1:] = False
    bulge = np.where(bent, bulges, 1.0)
    turn = 4.0 * np.arctan(bulge)
    centre = (place + goal) / 2.0 + 1j * (goal - place) * (1.0 - bulge**2) / (4.0 * bulge)
    radius = np.maximum(np.abs(place - centre), 1e-9)
    widest = 2.0 * np.arccos(np.maximum(1.0 - CHORDS_MM / radius, 0.0))
    steps = np.minimum(np.ceil(np.abs(turn) / widest), _MOST_CHORDS)
    counts = np.where(bent, steps, 1.0).astype(np.int64)
    after = np.repeat(np.arange(len(points)), counts)
    share = (np.arange(len(after)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[after]
    result = place[after]
    curved = bent[after] & (share > 0.0)
    side = after[curved]
    result[curved] = centre[side] + (place[side] - centre[side]) * np.exp(
        1j * share[curved] * turn[side]
    )
    return np.column_stack([result.real, result.imag]), after


def ring_points(ring: Floats) -> Floats:
    """Return points along a closed run of points and bulges; the first is there again at its end.

    Examples
    --------
    >>> ring_points(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]]))[-1].tolist()
    [0.0, 0.0]
    """
    closed = np.concatenate([ring, ring[:1]])
    return along(closed[:, :2], closed[:, 2])[0]
