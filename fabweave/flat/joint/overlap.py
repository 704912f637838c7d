"""Find pieces that should meet end to end and would lie on one another beside their seam."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.flat.joint.ends import CutStrips
from fabweave.flat.joint.planning import JointPlan

#: What they may cover of one another, in the mean over the width of the ribbon.
_MOST_MM = 0.03
_GRID_MM = 1e-6


def overlapping_ends(cut: CutStrips, plan: JointPlan) -> IntArray:
    """Return the crossings of joints without a lap whose pieces would overlap when laid flat.

    A ribbon that bends sharply in its plane beside the crossing comes back to it: then both
    pieces want the same place beside their seam.

    Parameters
    ----------
    cut : CutStrips
        The pieces as they are cut.
    plan : JointPlan

    Returns
    -------
    (K,) int array
        Crossings.
    """
    flush = plan.where(lambda kind: not kind.laps)
    begins = {int(joint): piece for piece, joint in enumerate(cut.before) if joint}
    found = [
        int(plan.crossing[joint - 1])
        for piece, joint in enumerate(cut.after.tolist())
        if joint and flush[joint - 1] and begins[joint] != piece
        if _covered_mm(cut, piece, begins[joint]) > _MOST_MM
    ]
    return np.array(found, dtype=np.int64)


def _covered_mm(cut: CutStrips, ends: int, begins: int) -> float:
    """Return what two pieces cover of one another near the panel that both have."""
    stations = cut.stations
    last, first = int(stations.offsets[ends + 1]) - 1, int(stations.offsets[begins])
    panel = stations.panel[last]
    centre, width = panel.mean(axis=0), float(np.hypot(*(panel[3] - panel[0])))
    reach = float(np.hypot(*(panel - centre).T).max()) + 0.5 * width
    turn = complex(*stations.way[last]) * complex(*stations.way[first]).conjugate()
    moved = (cut.outlines[begins] - stations.point[first]) @ _turned(turn) + stations.point[last]
    near = shapely.Point(centre).buffer(reach)
    parts = [
        shapely.intersection(shapely.make_valid(shapely.Polygon(outline)), near, grid_size=_GRID_MM)
        for outline in (cut.outlines[ends], moved)
    ]
    return float(shapely.area(shapely.intersection(*parts, grid_size=_GRID_MM))) / width


def _turned(turn: complex) -> FloatArray:
    """Return the matrix by which rows of points are turned."""
    return np.array([[turn.real, turn.imag], [-turn.imag, turn.real]])
