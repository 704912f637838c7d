"""Find the way by which a former leaves the woven object: its opening, or what is still to come."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, unit
from fabweave.former.plates import Former, Laid, WayOut, rim_loops, snapped
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.piece.congruence import DECIMALS
from fabweave.piece.development import piece_stretches
from fabweave.piece.piece import Piece
from fabweave.plan.crossing_map import StepRecord
from fabweave.plan.order import Order
from fabweave.plan.reach import shut_from
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import following_rung

#: Through less no hand comes, and the former stays, millimetres.
_LEAST_MM = 40.0
#: A way is wide from here on, millimetres; it is looked for at so many places of the order.
_WIDE_MM, _TRIES = 70.0, 80
#: So many crossings, those farthest from the rungs that are there, are looked at more closely.
_LOOKED_AT = 8
#: A ray meets what it passes as close as this, as a share of a triangle's sides.
_GRAZED = 1e-4


def let_out(former: Former, woven: WovenObject, pieces: Sequence[Piece], order: Order) -> Laid:
    """Find the way out of a former, and make its plates break where they would not fit through.

    A former of which a plate would not break stays inside, as one without a way out does.
    """
    way = _opening(woven.mesh, woven.halfedges) or _gap(woven, pieces, order)
    if way is None:
        return Laid(former, None)
    # As it is written, so that what is measured is what is read.
    at, inward = way.at.round(DECIMALS), way.inward.round(DECIMALS)
    deep = _depth(*_fans(woven.mesh, woven.halfedges), at, inward)
    way = replace(way, at=at, inward=inward, deep_mm=deep)
    plates = [snapped(plate, way.wide_mm, way.deep_mm) for plate in former.plates]
    broken = tuple(plate for plate in plates if plate is not None)
    if len(broken) < len(plates):
        return Laid(former, None)
    return Laid(replace(former, plates=broken), way)


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
    rim = np.flatnonzero(halfedges.twin < 0)
    ends = mesh.vertices[halfedges.tail[rim]], mesh.vertices[halfedges.head[rim]]
    for loop in rim_loops(halfedges):
        points = mesh.vertices[loop]
        middle = points.mean(axis=0)
        after = np.roll(points, -1, axis=0)
        normal = unit(np.cross(points - middle, after - middle).sum(axis=0))
        if normal @ (mesh.vertices.mean(axis=0) - middle) < 0.0:
            normal = -normal
        ways.append(WayOut(middle, normal, _room(middle, *ends), 0.0, None))
    best = max(ways, key=lambda way: way.wide_mm, default=None)
    return None if best is None or best.wide_mm < _LEAST_MM else best


def _gap(woven: WovenObject, pieces: Sequence[Piece], order: Order) -> WayOut | None:
    """Return the middle of what the last pieces leave open.

    They are as few as leave it wide, and more than come when no hand reaches the inside; where
    half of them do not, the widest way counts.
    """
    ribbons, rank = woven.ribbons, np.argsort(order.order)
    rung, owner = piece_stretches(ribbons, woven.weave, pieces).quads()
    after = following_rung(ribbons.offsets, ribbons.closed)[rung]
    rails = ribbons.right, ribbons.left
    start, end = (np.stack([rail[at] for rail in rails], axis=1) for at in (rung, after))
    latest, count = shut_from(order), len(pieces)
    best: WayOut | None = None
    for before in range(latest, count // 2, -max(1, count // _TRIES)):
        there = rank[owner] < before
        taken = np.zeros(len(ribbons.centre), dtype=np.bool_)
        for number in order.order[:before].tolist():
            taken[pieces[number].crossings] = True
        free = np.flatnonzero(~taken)
        if not len(free):
            continue
        lines = start[there].reshape(-1, 3), end[there].reshape(-1, 3)
        near = 2.0 * np.asarray(cKDTree(lines[0]).query(ribbons.centre[free])[0])
        for at in np.argsort(-near, kind="stable")[:_LOOKED_AT].tolist():
            least = _LEAST_MM if best is None else best.wide_mm
            middle, normal = ribbons.centre[free[at]], ribbons.normal[free[at]]
            if near[at] > least and (wide := _room(middle, *lines)) > least:
                best = WayOut(middle, -normal, wide, 0.0, before)
        if best is not None and best.wide_mm >= _WIDE_MM:
            break
    return best


def _room(middle: FloatArray, start: FloatArray, end: FloatArray) -> float:
    """Return how wide the circle about a point is that no line from a start to its end meets."""
    side, reach = end - start, middle - start
    square = np.maximum(np.sum(side**2, axis=1), 1e-300)
    share = np.clip(np.sum(reach * side, axis=1) / square, 0.0, 1.0)
    return 2.0 * float(np.linalg.norm(reach - share[:, None] * side, axis=1).min())


def _fans(mesh: PolyMesh, halfedges: Halfedges) -> tuple[FloatArray, IntArray]:
    """Return a mesh as points and triangles: its faces and openings as fans about their means."""
    rounds = [*mesh.faces(), *(loop[::-1] for loop in rim_loops(halfedges))]
    means = [mesh.vertices[corners].mean(axis=0) for corners in rounds]
    triangles = [
        (start, end, mesh.n_vertices + number)
        for number, corners in enumerate(rounds)
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True)
    ]
    return np.concatenate((mesh.vertices, means)), np.array(triangles)


def _depth(points: FloatArray, triangles: IntArray, start: FloatArray, way: FloatArray) -> float:
    """Return how far a ray goes inside closed triangles before it meets the other side.

    What it grazes, it meets: so much beyond a triangle's sides counts, as a share of them.
    """
    corner = points[triangles]
    one, two, back = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], start - corner[:, 0]
    across = np.cross(way, two)
    volume = np.sum(one * across, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.sum(back * across, axis=1) / volume
        turned = np.cross(back, one)
        v, far = turned @ way / volume, np.sum(two * turned, axis=1) / volume
        inside = (u >= -_GRAZED) & (v >= -_GRAZED) & (u + v <= 1.0 + _GRAZED)
    hit = far[inside & (far > 1.0)]
    return float(hit.min(initial=np.inf)) if len(hit) else 0.0
