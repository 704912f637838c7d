"""Find the way by which a former leaves the woven object: its opening, or what is still to come."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, unit
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.piece.former import Former, Laid, WayOut, closed_triangles, rim_loops, snapped
from fabweave.piece.piece import Piece
from fabweave.plan.access import shut_from
from fabweave.plan.crossing_map import StepRecord
from fabweave.plan.order import Order
from fabweave.ribbon.lay import WovenObject

#: Through less no hand comes, and the former stays, millimetres.
_LEAST_MM = 40.0
#: A way is wide from here on, millimetres; it is looked for at so many places of the order.
_WIDE_MM, _TRIES = 70.0, 80


def let_out(former: Former, woven: WovenObject, pieces: Sequence[Piece], order: Order) -> Laid:
    """Find the way out of a former, and make its plates break where they would not fit through."""
    way = _opening(woven.mesh, woven.halfedges) or _gap(woven, pieces, order)
    if way is None:
        return Laid(former, None)
    deep = _depth(*closed_triangles(woven.mesh, woven.halfedges), way.at, way.inward)
    plates = tuple(snapped(plate, way.wide_mm, deep) for plate in former.plates)
    return Laid(replace(former, plates=plates), replace(way, deep_mm=deep))


@frozen_value
class Leaving:
    """When a former comes out: the first step without it, and what is said of that in which step.

    Without a way out it is there after the last step, too, and nothing is said.
    """

    until: int
    step: int
    told: str


def leaving(laid: Laid, steps: Sequence[StepRecord]) -> Leaving:
    """Find the step before which a former is taken out: that of a piece, or after all strips."""
    way, placed, last = laid.way, 0, len(steps)
    if way is None:
        return Leaving(last + 1, last, "")
    for step in steps:
        placed += len(step.pieces)
        if not step.pieces or (way.before is not None and placed > way.before):
            told = f"First take the former out through the {way.gap} (step 0.3)."
            return Leaving(step.step, step.step, told)
    return Leaving(last + 1, last, f"Then take the former out through the {way.gap} (step 0.3).")


def _opening(mesh: PolyMesh, halfedges: Halfedges) -> WayOut | None:
    """Return the widest opening of a mesh that a hand comes through, if there is one."""
    ways = []
    for loop in rim_loops(halfedges):
        points = mesh.vertices[loop]
        middle = points.mean(axis=0)
        after = np.roll(points, -1, axis=0)
        normal = unit(np.cross(points - middle, after - middle).sum(axis=0))
        if normal @ (mesh.vertices.mean(axis=0) - middle) < 0.0:
            normal = -normal
        side, start = after - points, middle - points
        share = np.clip(np.sum(start * side, axis=1) / np.sum(side**2, axis=1), 0.0, 1.0)
        away = np.linalg.norm(start - share[:, None] * side, axis=1)
        ways.append(WayOut(middle, normal, 2.0 * float(away.min()), 0.0, None))
    best = max(ways, key=lambda way: way.wide_mm, default=None)
    return None if best is None or best.wide_mm < _LEAST_MM else best


def _gap(woven: WovenObject, pieces: Sequence[Piece], order: Order) -> WayOut | None:
    """Return the middle of what the last pieces leave open.

    They are as few as leave it wide, and more than come when no hand reaches the inside; where
    half of them do not, the widest way counts.
    """
    ribbons, crossing = woven.ribbons, woven.weave.threads.crossing
    latest, count = shut_from(order), len(pieces)
    best: WayOut | None = None
    for before in range(latest, count // 2, -max(1, count // _TRIES)):
        taken = np.zeros(len(ribbons.centre), dtype=np.bool_)
        for number in order.order[:before].tolist():
            taken[pieces[number].crossings] = True
        free = np.flatnonzero(~taken)
        if not len(free):
            continue
        entry = ribbons.entry[taken[crossing]]
        ends = [rail[at] for rail in (ribbons.right, ribbons.left) for at in (entry, entry + 1)]
        room = np.asarray(cKDTree(np.concatenate(ends)).query(ribbons.centre[free])[0])
        wide, at = 2.0 * float(room.max()), free[int(room.argmax())]
        if wide > (_LEAST_MM if best is None else best.wide_mm):
            best = WayOut(ribbons.centre[at], -ribbons.normal[at], wide, 0.0, before)
        if best is not None and best.wide_mm >= _WIDE_MM:
            break
    return best


def _depth(points: FloatArray, triangles: IntArray, start: FloatArray, way: FloatArray) -> float:
    """Return how far a ray goes inside closed triangles before it meets the other side."""
    corner = points[triangles]
    one, two, back = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], start - corner[:, 0]
    across = np.cross(way, two)
    volume = np.sum(one * across, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.sum(back * across, axis=1) / volume
        turned = np.cross(back, one)
        v, far = turned @ way / volume, np.sum(two * turned, axis=1) / volume
    hit = far[(u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (far > 1.0)]
    return float(hit.min(initial=np.inf)) if len(hit) else 0.0
