"""Find where names stand across pieces that are too narrow to hold them."""

import numpy as np

from fabweave.assembly.manual.book import PLATE, text_width
from fabweave.core.arrays import FloatArray

#: Names are tried at so many places along a piece, the middle first.
_PLACES = 15


def upright(angle_deg: float) -> float:
    """Return the direction of a text that is not on its head, between -90 and 90 degrees.

    Examples
    --------
    >>> upright(135.0), upright(-90.0), upright(90.0)
    (-45.0, 90.0, 90.0)
    """
    return float(90.0 - (90.0 - angle_deg) % 180.0)


def place_across(outlines: dict[str, FloatArray]) -> dict[str, tuple[float, float, float]]:
    """Find a place for the name of each piece, along it, clear of the names before if it can be.

    Parameters
    ----------
    outlines : dict from piece id to (N, 2) float array
        Corners on the page, in points.

    Returns
    -------
    dict from piece id to (x, y, angle)
        Middle of the name, and its direction in degrees. A name that is clear nowhere stands where
        it is farthest from others.

    Examples
    --------
    >>> strip = np.array([[0.0, 0], [100, 0], [100, 2], [0, 2]])
    >>> [round(float(value), 1) for value in place_across({"A1": strip})["A1"]]
    [50.0, 1.0, 0.0]
    """
    places: dict[str, tuple[float, float, float]] = {}
    taken = np.full((1, 2), np.inf)
    for key, outline in outlines.items():
        reach = text_width(key, PLATE, bold=True) / 2
        best = -np.inf
        for middle, way in _candidates(outline):
            # A name is clear if the middles of its letters are.
            spots = middle + way * np.linspace(-reach, reach, 5)[:, None]
            gaps = np.linalg.norm(spots[:, None] - taken, axis=2)
            clear = min(float(gaps.min()), PLATE)
            if clear > best:
                best, chosen = clear, spots
                angle = upright(float(np.degrees(np.arctan2(way[1], way[0]))))
                places[key] = float(middle[0]), float(middle[1]), angle
            if clear >= PLATE:
                break
        taken = np.concatenate((taken, chosen))
    return places


def _candidates(outline: FloatArray) -> list[tuple[FloatArray, FloatArray]]:
    """Return places along a strip's middle with the direction there, from the middle outwards."""
    rails = _rails(outline)
    steps = np.linspace(0.12, 0.88, _PLACES)
    steps = steps[np.argsort(np.abs(steps - 0.5), kind="stable")]
    places = []
    for step in steps.tolist():
        ends = [
            np.array([_along(rail, step + by) for rail in rails]).mean(axis=0)
            for by in (-0.04, 0.0, 0.04)
        ]
        way = ends[2] - ends[0]
        size = float(np.linalg.norm(way))
        places.append((ends[1], way / size if size else np.array([1.0, 0.0])))
    return places


def _rails(outline: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Cut a strip's outline at its ends, the two places with half of its border between them."""
    size = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
    border = np.concatenate(([0.0], np.cumsum(size)))
    closed = np.concatenate((outline, outline[:1]))
    half = border[-1] / 2
    starts = np.arange(0.0, half, half / 64)
    ends, opposite = (
        np.column_stack([np.interp(at, border, closed[:, axis]) for axis in (0, 1)])
        for at in (starts, starts + half)
    )
    start = float(starts[np.argmax(np.linalg.norm(ends - opposite, axis=1))])
    ways = np.linspace(0.0, half, 65)
    there, back = (
        np.column_stack([np.interp(at % border[-1], border, closed[:, axis]) for axis in (0, 1)])
        for at in (start + ways, start - ways)
    )
    return there, back


def _along(rail: FloatArray, share: float) -> FloatArray:
    """Return a point of an evenly divided line."""
    at = share * (len(rail) - 1)
    low = min(int(at), len(rail) - 2)
    return np.asarray(rail[low] + (rail[low + 1] - rail[low]) * (at - low))
