"""Find which parts of a piece the strands above it cover when the object is woven."""

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.flat.joint.ends import Stations
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave

#: Less of a panel than this is no cover, square millimetres.
_LEAST_MM2 = 0.01
_POLYGON = shapely.GeometryType.POLYGON


def covered_parts(
    ribbons: Ribbons, weave: Weave, stations: Stations
) -> tuple[FloatArray | None, ...]:
    """Return the part of each crossing panel that the strand above covers.

    Both panels of a crossing are level, so the upper one is dropped along their normal. What lies
    beyond the panel, where the ribbon is folded, counts as seen.

    Parameters
    ----------
    ribbons, weave
        The ribbons in space, and who is on top.
    stations : Stations
        Where the panels lie on the strips.

    Returns
    -------
    tuple of (K, 2) float array or None
        For each station a simple polygon in its strip's frame; None where the piece is on top.
    """
    parts: list[FloatArray | None] = [None] * len(stations.passes)
    under = np.flatnonzero(~weave.over[stations.passes])
    if not len(under):
        return tuple(parts)
    above = np.zeros(weave.threads.n_crossings, dtype=np.int64)
    above[weave.threads.crossing[weave.over]] = np.flatnonzero(weave.over)
    own = _panels(ribbons, stations.passes[under])
    other = _panels(ribbons, above[stations.crossing[under]])
    panel = stations.panel[under]
    below, over = shapely.polygons(panel), shapely.polygons(_dropped(other, own, panel))
    sound = shapely.is_valid(below) & shapely.is_valid(over)
    shared = shapely.intersection(below[sound], over[sound])
    whole = (shapely.get_type_id(shared) == _POLYGON) & (shapely.area(shared) > _LEAST_MM2)
    for at, part in zip(under[sound][whole].tolist(), shared[whole].tolist(), strict=True):
        parts[at] = shapely.get_coordinates(part.exterior)[:-1]
    return tuple(parts)


def _panels(ribbons: Ribbons, passes: IntArray) -> FloatArray:
    """Return the corners of crossing panels, (N, 4, 3), in the order of ``Stations.panel``."""
    entry = ribbons.entry[passes]
    leave = entry + 1
    return np.stack(
        (ribbons.right[entry], ribbons.right[leave], ribbons.left[leave], ribbons.left[entry]),
        axis=1,
    )


def _dropped(other: FloatArray, own: FloatArray, panel: FloatArray) -> FloatArray:
    """Drop the corners of panels in space on others, and return where they fall on these, flat."""
    sides = np.stack((own[:, 1] - own[:, 0], own[:, 3] - own[:, 0]), axis=1)
    flat = np.stack((panel[:, 1] - panel[:, 0], panel[:, 3] - panel[:, 0]), axis=1)
    gram = sides @ np.swapaxes(sides, 1, 2)
    away = (other - own[:, :1]) @ np.swapaxes(sides, 1, 2)
    shares = np.linalg.solve(gram, np.swapaxes(away, 1, 2))
    return np.asarray(np.swapaxes(shares, 1, 2) @ flat + panel[:, :1])
