"""Push pieces on one sheet apart until all keep the gap, moving and turning all of them at once.

The overlap of two pieces is measured at samples of their outlines in each other's distance
field. Each step linearises these distances in the motions of all pieces, and solves for the
least motion that mends what is too near (Levenberg and Marquardt's method). It knows nothing of
permutations: pieces slide and turn, they do not jump.
"""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.nest.separate.obstacle import Barrier
from fabweave.nest.separate.overlap import Crowd, Stand, distances, near_pairs, stand_at
from fabweave.stock.rotations import FREE, Turns

_SPARE_MM = 0.03  # the distance that is aimed at is this much larger than the gap
_DONE_MM = 0.02  # what may be missing from that in the end
_NEAR_MM = 6.0  # pairs this much wider than the gap are kept for the next steps
_STEP_MM = 3.0  # the longest motion in one step
_DAMPING = 0.03  # of a step, as a share of the mean stiffness
_BORDER = 3.0  # how much stiffer than pieces the border is
_GRAIN = 4096.0  # poses are rounded to this fraction, so that no last bit is carried on
_PATIENCE = 12  # steps in which the overlap must become less by a share
_SHARE = 0.9


@frozen_value
class Settled:
    """Poses (N, 3) after settling, whether they keep the gap, and the steps that it took."""

    poses: FloatArray
    ok: bool
    steps: int


def settle(
    crowd: Crowd,
    poses: FloatArray,
    usable_mm: tuple[float, float],
    gap_mm: float,
    *,
    steps: int,
    pull: tuple[float, float] = (0.0, 0.0),
    pulls: int = 0,
    barrier: Barrier | None = None,
    turns: Turns = FREE,
    moving: BoolArray | None = None,
) -> Settled:
    """Move the bodies of a sheet until they keep the gap, or give up.

    Parameters
    ----------
    crowd : Crowd
        N bodies.
    poses : (N, 3) float array
        Where they stand: centroids in millimetres from the corner of the usable area, and angles
        in radians.
    usable_mm : (float, float)
        Width and height of the usable area.
    gap_mm : float
        The least distance.
    steps : int
        How many steps to try.
    pull : (float, float)
        How far free pieces move in each of the first ``pulls`` steps, millimetres.
    pulls : int
        How many steps pull.
    barrier : Barrier, optional
        What bodies keep the gap from besides.
    turns : Turns
        The angles at which bodies may stand; the poses given stand at such.
    moving : (N,) bool array, optional
        The bodies that may move; the others keep the gap from one another, and stay. All may
        move unless said.

    Returns
    -------
    Settled
        What the samples say; for a proof, distances must be checked exactly.
    """
    aim = gap_mm + _SPARE_MM
    moving = np.ones(len(poses), dtype=np.bool_) if moving is None else moving
    usable = np.array(usable_mm)
    drift = np.inf
    history: list[float] = []
    for step in range(steps + pulls):
        stand = stand_at(crowd, poses)
        if drift > _NEAR_MM:
            samples, bodies = near_pairs(crowd, stand, aim + _NEAR_MM, moving)
            drift = 0.0
        push = _push(crowd, stand, samples, bodies, usable, aim, barrier, moving)
        if step >= pulls:
            if push.worst < _DONE_MM:
                if 2.0 * drift <= _NEAR_MM:
                    return Settled(poses, True, step)
                drift = np.inf
                continue
            history.append(push.energy)
            if len(history) > _PATIENCE and history[-1] > _SHARE * history[-1 - _PATIENCE]:
                return Settled(poses, False, step)
        force = push.force.copy()
        matrix = push.matrix.copy()
        stiff = np.diag(matrix)
        if turns.fixed:
            matrix[2::3] = matrix[:, 2::3] = force[:, 2] = 0.0
        damping = _DAMPING * float(stiff.sum()) / max(int((stiff > 0.0).sum()), 1) + 1e-3
        matrix[np.diag_indices(len(matrix))] += damping
        if step < pulls:
            force[:, :2] += damping * np.array(pull)
        move = np.linalg.solve(matrix, force.ravel()).reshape(-1, 3)
        size = np.sqrt((move**2).sum(axis=1))
        move *= np.minimum(1.0, _STEP_MM / np.maximum(size, 1e-9))[:, None]
        drift += float(np.minimum(size, _STEP_MM).max(initial=0.0)) * 1.5
        move[:, 2] /= crowd.radius[moving]
        moved = np.round((poses[moving] + move) * _GRAIN) / _GRAIN
        moved[:, 2] = turns.nearest(moved[:, 2])
        poses = poses.copy()
        poses[moving] = moved
    return Settled(poses, False, steps + pulls)


@frozen_value
class _Push:
    """The normal equations of one step for the M moving bodies, and the overlap.

    A (3 M, 3 M) matrix and an (M, 3) force.
    """

    matrix: FloatArray
    force: FloatArray
    worst: float
    energy: float


def _push(
    crowd: Crowd,
    stand: Stand,
    samples: IntArray,
    bodies: IntArray,
    usable: FloatArray,
    aim: float,
    barrier: Barrier | None,
    moving: BoolArray,
) -> _Push:
    """Return what mends the distances of samples from bodies that are less than the aim."""
    # What does not move shares one more place in the equations, which is dropped.
    count = int(moving.sum())
    place = np.where(moving, np.cumsum(moving) - 1, count)
    distance, normal = distances(crowd, stand, stand.world[samples], bodies)
    hit = distance < aim
    samples, bodies, normal = samples[hit], bodies[hit], normal[hit]
    missing = aim - distance[hit]
    mine = crowd.owner[samples]
    arm, other = stand.arm[samples], stand.world[samples] - stand.poses[bodies, :2]
    rows = np.concatenate(
        [
            normal,
            _turn(arm, normal, crowd.radius[mine]),
            -normal,
            -_turn(other, normal, crowd.radius[bodies]),
        ],
        axis=1,
    )
    # The border: what is outside, or would be with the aim's spare.
    over = np.concatenate([-stand.world, stand.world - usable], axis=1) + _SPARE_MM
    over[~moving[crowd.owner]] = 0.0
    who, side = np.nonzero(over > 0.0)
    inward = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[side]
    out = over[who, side]
    if barrier is not None:
        far, away = barrier.distances(stand.world)
        near = np.flatnonzero((far < aim) & moving[crowd.owner])
        who = np.concatenate([who, near])
        inward = np.concatenate([inward, away[near]])
        out = np.concatenate([out, aim - far[near]])
    owner = crowd.owner[who]
    turn = _turn(stand.arm[who], inward, crowd.radius[owner])
    walls = np.concatenate([inward, turn, np.zeros((len(who), 3))], axis=1) * _BORDER
    rows = np.concatenate([rows, walls])
    wanted = np.concatenate([missing, _BORDER * out])
    column = 3 * place[np.stack([np.append(mine, owner), np.append(bodies, owner)], axis=1)]
    column = (column[:, :, None] + np.arange(3)).reshape(-1, 6)
    size = 3 * (count + 1)
    cell = (column[:, :, None] * size + column[:, None, :]).ravel()
    weight = (rows[:, :, None] * rows[:, None, :]).ravel()
    # Of nothing, bincount returns counts: whole numbers.
    matrix = np.bincount(cell, weight, minlength=size * size).astype(np.float64)
    pushes = (rows * wanted[:, None]).ravel()
    force = np.bincount(column.ravel(), pushes, minlength=size).astype(np.float64)
    return _Push(
        matrix=matrix.reshape(size, size)[:-3, :-3],
        force=force[:-3].reshape(count, 3),
        worst=max(float(missing.max(initial=0.0)), float(out.max(initial=0.0))),
        energy=float((wanted**2).sum()),
    )


def _turn(arm: FloatArray, normal: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how turning a body by one over its radius moves a point along a normal, (K, 1)."""
    return ((arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / radius)[:, None]
