"""Separate the items of one sheet until all keep the gap, moving and turning all of them at once.

The overlap of two items is measured at samples of their outlines in each other's distance field.
Each step linearises these distances in the motions of all items, and solves for the least motion
that separates what is too near (Levenberg and Marquardt's method). It knows nothing of
permutations: items slide and turn, they do not jump.
"""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.nest.container import Container
from fabweave.nest.separate.overlap import (
    ItemArrays,
    ObstacleField,
    PlacedItems,
    distances,
    near_samples,
    place_items,
)

#: The distance that is aimed at is larger than the gap by this, millimetres, and what may be
#: missing from it in the end.
_SPARE_MM, _DONE_MM = 0.03, 0.02
#: Pairs this much wider than the gap, millimetres, are kept for the next steps.
_NEAR_MM = 6.0
#: The longest motion in one step, millimetres.
_STEP_MM = 3.0
#: How much farther an item's outermost sample moves than one at its mean radius, about.
_OUTERMOST = 1.5
#: Damping of a step: a share of the mean stiffness, and the least.
_DAMPING, _LEAST_DAMPING = 0.03, 1e-3
#: How much stiffer than items the border is.
_BORDER = 3.0
#: Poses are rounded to this fraction of a millimetre and of a radian: no last bit is carried on.
_GRAIN = 4096.0
#: In so many steps the overlap must come down to this share, or the items are given up.
_PATIENCE, _SHARE = 12, 0.9


def separate(
    arrays: ItemArrays,
    poses: FloatArray,
    container: Container,
    gap_mm: float,
    *,
    steps: int,
    pull_mm: tuple[float, float] = (0.0, 0.0),
    pulls: int = 0,
    obstacle: ObstacleField | None = None,
    moving: BoolArray | None = None,
) -> FloatArray | None:
    """Move the items of a sheet until they keep the gap, or give up.

    Parameters
    ----------
    arrays : ItemArrays
        N items.
    poses : (N, 3) float array
        Where they are: centroids in millimetres from the corner of the usable area, and angles in
        radians.
    container : Container
        The usable area, and the angles at which items may lie; the poses must keep this rule.
    gap_mm : float
        The least distance.
    steps : int
        How many steps to try.
    pull_mm : (float, float)
        How far free items move in each of the first ``pulls`` steps.
    pulls : int
        How many steps pull.
    obstacle : ObstacleField, optional
        What items keep the gap from besides.
    moving : (N,) bool array, optional
        The items that may move; the others keep the gap from one another, and stay. All may move
        unless this is given.

    Returns
    -------
    (N, 3) float array or None
        Poses that keep the gap as far as samples say: for a proof, distances must be measured
        exactly. None if that takes too long, or the overlap no longer becomes less.
    """
    aim = gap_mm + _SPARE_MM
    moving = np.ones(len(poses), dtype=np.bool_) if moving is None else moving
    usable, rotations = np.array(container.size_mm), container.rotations
    drift = np.inf
    energies: list[float] = []
    for step in range(steps + pulls):
        placed = place_items(arrays, poses)
        if drift > _NEAR_MM:
            samples, items = near_samples(placed, aim + _NEAR_MM, moving)
            drift = 0.0
        equations = _normal_equations(placed, samples, items, usable, aim, obstacle, moving)
        if step >= pulls:
            if equations.worst_mm < _DONE_MM:
                if 2.0 * drift <= _NEAR_MM:
                    return poses
                drift = np.inf
                continue
            energies.append(equations.energy)
            if len(energies) > _PATIENCE and energies[-1] > _SHARE * energies[-1 - _PATIENCE]:
                return None
        force, matrix = equations.force.copy(), equations.matrix.copy()
        stiff = np.diag(matrix)
        if rotations.fixed:
            matrix[2::3] = matrix[:, 2::3] = force[:, 2] = 0.0
        damping = _DAMPING * float(stiff.sum()) / max(int((stiff > 0.0).sum()), 1) + _LEAST_DAMPING
        matrix[np.diag_indices(len(matrix))] += damping
        if step < pulls:
            force[:, :2] += damping * np.array(pull_mm)
        move = np.linalg.solve(matrix, force.ravel()).reshape(-1, 3)
        size = np.sqrt((move**2).sum(axis=1))
        move *= np.minimum(1.0, _STEP_MM / np.maximum(size, 1e-9))[:, None]
        drift += float(np.minimum(size, _STEP_MM).max(initial=0.0)) * _OUTERMOST
        move[:, 2] /= arrays.radius[moving]
        moved = np.round((poses[moving] + move) * _GRAIN) / _GRAIN
        moved[:, 2] = rotations.nearest(moved[:, 2])
        poses = poses.copy()
        poses[moving] = moved
    return None


@frozen_value
class _NormalEquations:
    """The normal equations of one step for the M moving items, and the overlap."""

    matrix: FloatArray  # (3 M, 3 M)
    force: FloatArray  # (M, 3)
    worst_mm: float  # what the worst sample misses
    energy: float  # sum of squares of what is missing


def _normal_equations(
    placed: PlacedItems,
    samples: IntArray,
    items: IntArray,
    usable: FloatArray,
    aim: float,
    obstacle: ObstacleField | None,
    moving: BoolArray,
) -> _NormalEquations:
    """Return the equations that correct the distances of samples from items below the aim."""
    arrays, points = placed.arrays, placed.points
    # What does not move shares one more place in the equations, which is dropped.
    count = int(moving.sum())
    place = np.where(moving, np.cumsum(moving) - 1, count)
    distance, normal = distances(placed, points[samples], items)
    hit = distance < aim
    samples, items, normal = samples[hit], items[hit], normal[hit]
    missing = aim - distance[hit]
    owner = arrays.owner[samples]
    arm, other_arm = placed.arm[samples], points[samples] - placed.poses[items, :2]
    rows = np.concatenate(
        [
            normal,
            _lever(arm, normal, arrays.radius[owner]),
            -normal,
            -_lever(other_arm, normal, arrays.radius[items]),
        ],
        axis=1,
    )
    # The border: what is outside, or would be with the aim's spare.
    beyond = np.concatenate([-points, points - usable], axis=1) + _SPARE_MM
    beyond[~moving[arrays.owner]] = 0.0
    outside, side = np.nonzero(beyond > 0.0)
    inward = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[side]
    excess = beyond[outside, side]
    if obstacle is not None:
        apart, away = obstacle.distances(points)
        near = np.flatnonzero((apart < aim) & moving[arrays.owner])
        outside = np.concatenate([outside, near])
        inward = np.concatenate([inward, away[near]])
        excess = np.concatenate([excess, aim - apart[near]])
    border_owner = arrays.owner[outside]
    lever = _lever(placed.arm[outside], inward, arrays.radius[border_owner])
    walls = np.concatenate([inward, lever, np.zeros((len(outside), 3))], axis=1) * _BORDER
    rows = np.concatenate([rows, walls])
    residual = np.concatenate([missing, _BORDER * excess])
    pairs = [np.append(owner, border_owner), np.append(items, border_owner)]
    column = 3 * place[np.stack(pairs, axis=1)]
    column = (column[:, :, None] + np.arange(3)).reshape(-1, 6)
    size = 3 * (count + 1)
    cell = (column[:, :, None] * size + column[:, None, :]).ravel()
    weight = (rows[:, :, None] * rows[:, None, :]).ravel()
    # Of nothing, bincount returns counts: whole numbers.
    matrix = np.bincount(cell, weight, minlength=size * size).astype(np.float64)
    forces = (rows * residual[:, None]).ravel()
    force = np.bincount(column.ravel(), forces, minlength=size).astype(np.float64)
    return _NormalEquations(
        matrix=matrix.reshape(size, size)[:-3, :-3],
        force=force[:-3].reshape(count, 3),
        worst_mm=max(float(missing.max(initial=0.0)), float(excess.max(initial=0.0))),
        energy=float((residual**2).sum()),
    )


def _lever(arm: FloatArray, normal: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how turning an item by one over its radius moves a point along a normal, (K, 1)."""
    return ((arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / radius)[:, None]
