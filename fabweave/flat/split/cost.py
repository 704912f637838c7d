"""Predict what pieces cost: sheet, joints and unevenness, in square millimetres of sheet.

What a nested piece takes of a sheet lies between its own area and that of its convex hull, both
inflated by half the gap. Regression over real nestings gave the shares below: six models (torus
24 × 12, cube after three Catmull-Clark steps, slab with two holes after two, sphere, knot, spot)
cut evenly to 110 to 500 mm, 24 jobs of 70 to 450 pieces on sheets of 600 × 400 mm at quick effort
with a gap of 2 mm. The two shares predict the used area with a root mean square error of 9 %
(11 % for a model left out of the regression); the area of the least rectangles alone is 20 % off,
that of the hulls alone 13 %. ``tests/benchmarks/bench_split.py`` compares
what comes of it with other ways to cut.
"""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.flat.split.candidates import Windows

_AREA_SHARE = 0.5
_HULL_SHARE = 0.85

#: A piece that passes fewer crossings is hardly held by the weave; avoided where possible.
FEWEST_PASSES = 3

#: What is done only if there is no other way costs this much more, in square millimetres.
AVOIDED_MM2 = 1e8


def sheet_area(
    area_mm2: FloatArray, rim_mm: FloatArray, hull_mm2: FloatArray, gap_mm: float
) -> FloatArray:
    """Return the predicted area of sheet that nested pieces take, in square millimetres.

    Parameters
    ----------
    area_mm2, rim_mm, hull_mm2 : float arrays
        Area and length of the outlines, and area of their convex hulls.
    gap_mm : float
        Least distance between pieces.

    Examples
    --------
    >>> import numpy as np
    >>> bar = np.array([1000.0]), np.array([220.0]), np.array([1000.0])
    >>> sheet_area(*bar, 2.0).round(3).tolist()
    [1647.0]
    """
    inflated = rim_mm * (gap_mm / 2)
    return np.asarray(_AREA_SHARE * (area_mm2 + inflated) + _HULL_SHARE * (hull_mm2 + inflated))


def window_costs(
    windows: Windows, *, gap_mm: float, even_mm2: float, longest_mm: float
) -> FloatArray:
    """Return the cost of each window without its joints, (N, D); infinite where there is none.

    Parameters
    ----------
    windows : Windows
        Every possible piece.
    gap_mm : float
        Least distance of pieces on a sheet.
    even_mm2 : float
        What is added for a piece of the greatest length; less for a shorter one, by the square of
        its length. Of ways to cut that waste as much, the even one is the cheapest.
    longest_mm : float
        Longer windows are none.
    """
    there = (windows.passes > 0) & (windows.length_mm <= longest_mm + 1e-9)
    cost = np.full(there.shape, np.inf)
    length = windows.length_mm[there]
    cost[there] = sheet_area(
        windows.area_mm2[there], windows.rim_mm[there], windows.hull_mm2[there], gap_mm
    )
    if len(length):
        cost[there] += even_mm2 * (length / length.max()) ** 2
    cost[there & (windows.passes < FEWEST_PASSES)] += AVOIDED_MM2
    # Congruent pieces cost the same in spite of rounding, so ties fall the same way everywhere.
    return np.round(cost, 3)
