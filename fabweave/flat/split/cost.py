"""Predict what pieces cost: sheet, joints and unevenness, in square millimetres of sheet.

What a nested piece takes of a sheet lies between its own area and that of its convex hull, both
inflated by half the gap, as pieces lie in one another's bays. Regression over real nestings gave
the shares below: seven models (three tori, two cubes after two and three Catmull-Clark steps, an
icosahedron woven plainly and in three directions), each cut to 150 mm, 300 mm and as long as can
be: 19 jobs of 24 to 378 pieces on sheets of 600 × 400 mm at quick effort with a gap of 2 mm. The
two shares predict the used area with a root mean square error of 7 %. ``bench_prediction.py`` in
``tests/benchmarks`` compares what is predicted with what is made, and
``bench_split.py`` what comes of it with
other ways to cut. A piece that is longer from end to end than the longest side lies askew on its
sheet, with room for one more at most: 29 pieces of up to 670 mm took 14 sheets, 60 of up to 300 mm
took 5.
"""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray
from fabweave.flat.split.candidates import Windows

_AREA_SHARE = 1.07
_HULL_SHARE = 0.31

#: A piece that passes fewer crossings is hardly held by the weave; avoided where possible.
FEWEST_PASSES = 3

#: What is done only if there is no other way costs this much more, in square millimetres.
AVOIDED_MM2 = 1e8


def sheet_area(
    area_mm2: FloatArray,
    rim_mm: FloatArray,
    hull_mm2: FloatArray,
    askew: BoolArray,
    *,
    gap_mm: float,
    askew_mm2: float,
) -> FloatArray:
    """Return the predicted area of sheet that nested pieces take, in square millimetres.

    Parameters
    ----------
    area_mm2, rim_mm, hull_mm2 : float arrays
        Area and length of the outlines, and area of their convex hulls.
    askew : bool array
        Which of them lie askew on a sheet.
    gap_mm : float
        Least distance between pieces.
    askew_mm2 : float
        What a piece that lies askew takes at least.

    Examples
    --------
    >>> import numpy as np
    >>> bar = np.array([1000.0]), np.array([220.0]), np.array([1000.0]), np.array([False])
    >>> sheet_area(*bar, gap_mm=2.0, askew_mm2=9e4).round(3).tolist()
    [1683.6]
    """
    inflated = rim_mm * (gap_mm / 2)
    taken = _AREA_SHARE * (area_mm2 + inflated) + _HULL_SHARE * (hull_mm2 + inflated)
    return np.where(askew, np.maximum(taken, askew_mm2), taken)


def window_costs(
    windows: Windows,
    *,
    gap_mm: float,
    even_mm2: float,
    longest_mm: float,
    side_mm: float = np.inf,
    askew_mm2: float = 0.0,
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
    side_mm, askew_mm2 : float
        The longest side of any sheet, and what a piece takes at least that is longer from end to
        end.
    """
    there = (windows.passes > 0) & (windows.length_mm <= longest_mm + 1e-9)
    cost = np.full(there.shape, np.inf)
    length = windows.length_mm[there]
    cost[there] = sheet_area(
        windows.area_mm2[there],
        windows.rim_mm[there],
        windows.hull_mm2[there],
        windows.extent_mm[there] > side_mm,
        gap_mm=gap_mm,
        askew_mm2=askew_mm2,
    )
    if len(length):
        cost[there] += even_mm2 * (length / length.max()) ** 2
    cost[there & (windows.passes < FEWEST_PASSES)] += AVOIDED_MM2
    # Congruent pieces cost the same in spite of rounding, so ties fall the same way everywhere.
    return np.round(cost, 3)
