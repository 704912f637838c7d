"""Let an elastic net go: it moves until its forces are in balance."""

from typing import Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from fabweave.core.arrays import FloatArray, IntArray, Progress, frozen_value, no_progress
from fabweave.form.net import Local, Net, NetState, energy, inner_steps, local_system
from fabweave.form.screw import skew

#: Steps at most; and what is left of the forces at rest, as a share of what a span of strip resists
#: a millimetre with.
_STEPS, _REST = 200, 1e-5
#: The first damping, as a share of a strip's own bending; its change after a step that was good, or
#: none; and how small and how large it may become.
_DAMPING, _EASE, _STIFFEN, _LEAST, _MOST = 1e-2, 0.1, 8.0, 1e-8, 1e6
#: A step that is too long is made so many times shorter, so often; after a whole one with so little
#: damping that gained no more than such a share of the energy, stress counts.
_SHORTER, _HALVINGS, _CALM, _SLOW = 3.0, 4, 1e-3, 0.1
#: No body turns by more radians in a step.
_TURN = 0.4
#: A step that gains less than this share of the energy gains nothing; then forces may be so many
#: times larger.
_GAIN, _ROUGH = 1e-14, 1e3
#: So many steps are looked at together; one of Newton's, which leaves far less than it gains, is to
#: gain no more than this share of what is asked for.
_LOOK, _NEWTON = 6, 0.1
#: What is as good as fixed, N/mm.
_FIXED = 1e12


class Pace(NamedTuple):
    """How a net goes on: after so many steps, with such damping, and whether stress counts."""

    steps: int = 0
    damping: float = _DAMPING
    stressed: bool = False


@frozen_value
class Relaxed:
    """Where a net comes to rest.

    Parameters
    ----------
    state : NetState
    energy_nmm : float
        What it has in store, N mm.
    residual : float
        The largest force on a body that is not balanced, N.
    history : tuple of float
        The energy at first, and after each step that was taken.
    settled : bool
        Whether it is at rest; else this is as far as it came.
    pace : Pace
        How it goes on from there, if it is to come nearer to rest.
    """

    state: NetState
    energy_nmm: float
    residual: float
    history: tuple[float, ...]
    settled: bool
    pace: Pace = Pace()


class Solver:
    """Forces of a net and their change, factored in an order that keeps factors sparse."""

    def __init__(self, net: Net) -> None:
        """Find the order."""
        self.net = net
        #: A typical span, mm, and what it resists motions and turns with, N/mm and N mm.
        self.length = float(np.median(net.rest[..., 0].sum(axis=1)))
        bending = float(np.median(net.stiffness[..., 4])) / net.rest.shape[1]
        self.scale = np.array([12 * bending / self.length**2] * 3 + [bending] * 3)
        self.unit = np.concatenate(
            [np.tile(self.scale, net.n_bodies), np.full(len(net.pins), bending)]
        )
        turn = np.where(net.turns >= 0, 6 * net.n_bodies + net.turns, net.n_freedoms)
        own = 6 * net.ends[:, :, None] + np.arange(6)
        #: The freedoms of each span's ends, (S, 14); one past all for none.
        self.rows = np.concatenate([own, turn[:, :, None]], axis=2).reshape(-1, 14)
        self.order = self._freedoms_in_order(sparse_order(net.ends, net.n_bodies))
        self._fixed = np.zeros(net.n_freedoms)
        self._fixed[: 6 * net.n_bodies] = np.repeat(net.fixed * _FIXED, 6)
        self._plan_matrix()

    def _plan_matrix(self) -> None:
        """Find where in the sparse matrix each of the values goes that are added up there."""
        rows, count, bodies = self.rows, self.net.n_freedoms, 6 * self.net.n_bodies
        block = np.arange(bodies).reshape(-1, 6)
        alone = np.append(np.arange(bodies, count), np.arange(count))
        pairs = [np.broadcast_arrays(of[:, :, None], of[:, None, :]) for of in (rows, block)]
        ranks = np.append(np.argsort(self.order), count)
        down, across = (
            ranks[np.concatenate([*(pair[side].ravel() for pair in pairs), alone])]
            for side in (0, 1)
        )
        self._inside = np.flatnonzero((down < count) & (across < count))
        # Short numbers are sorted digit by digit.
        short = np.uint16 if count <= np.iinfo(np.uint16).max else np.int64
        down, across = (each[self._inside].astype(short) for each in (down, across))
        order = np.lexsort((down, across))
        down, across = down[order], across[order]
        fresh = np.append(True, (np.diff(down) != 0) | (np.diff(across) != 0))
        self._cell = np.empty_like(order)
        self._cell[order] = np.cumsum(fresh) - 1
        ends = np.searchsorted(across[fresh], np.arange(count + 1))
        self._pattern = down[fresh].astype(np.int32), ends.astype(np.int32)

    def _freedoms_in_order(self, place: IntArray) -> IntArray:
        """Return all freedoms by the places of bodies, each body's with the angles there."""
        net = self.net
        key = np.full(net.n_freedoms, np.inf)
        key[: 6 * net.n_bodies] = np.repeat(place, 6)
        used = net.turns >= 0
        key[6 * net.n_bodies + net.turns[used]] = place[net.ends[used]]
        return np.argsort(key, kind="stable")

    def system(
        self, state: NetState, damping: float, *, stressed: bool = False
    ) -> tuple[FloatArray, sp.csc_array, Local]:
        """Return the forces on all freedoms, (F,), how they change, and what spans want."""
        net, rows = self.net, self.rows
        local = local_system(net, state, damping * self.scale, stressed=stressed)
        count, bodies = net.n_freedoms, net.n_bodies
        # Of nothing, bincount returns counts: whole numbers.
        force = np.bincount(rows.ravel(), local.force.ravel(), count + 1)[:count].astype(np.float64)
        axes, origin = state.bodies.axes, state.bodies.origin
        # Weight and supports, as bodies feel them; and as they feel them when they turn.
        pull = net.held * (origin - net.place) - net.weight
        felt = np.einsum("nji,nj->ni", axes, pull)
        force[: 6 * bodies].reshape(bodies, 6)[:, :3] += felt
        force[6 * bodies :] += net.pins * (state.angles - net.rest_angles)
        force[self._fixed > 0] = 0.0
        own = np.zeros((bodies, 6, 6))
        own[:, :3, :3] = np.einsum("nki,nk,nkj->nij", axes, net.held, axes)
        if stressed:
            own[:, :3, 3:] = skew(felt) / 2
            own[:, 3:, :3] = -own[:, :3, 3:]
        values = [local.matrix.ravel(), own.ravel(), net.pins, damping * self.unit + self._fixed]
        data = np.bincount(self._cell, np.concatenate(values)[self._inside])
        return force, sp.csc_array((data, *self._pattern), shape=(count, count)), local

    def solve(self, factors: SuperLU, force: FloatArray) -> FloatArray:
        """Return how far forces move all freedoms."""
        result = np.empty_like(force)
        result[self.order] = factors.solve(force[self.order])
        return result

    def moved(
        self, state: NetState, local: Local, step: FloatArray, share: float = 1.0
    ) -> NetState:
        """Return a state after a share of a step of bodies and angles, inner frames following."""
        bodies = share * step[: 6 * self.net.n_bodies].reshape(-1, 6)
        inner = share * inner_steps(local, np.append(step, 0.0)[self.rows])
        angles = state.angles + share * step[6 * self.net.n_bodies :]
        return NetState(state.bodies.moved(bodies), angles, state.inner.moved(inner))

    def residual(self, force: FloatArray, local: Local) -> float:
        """Return the largest force that is not balanced, a moment as a force at a span's end, N."""
        inner = [np.abs(pull).reshape(-1, 6).max(axis=0) for *_, pull in local.levels]
        bodies = np.abs(force[: 6 * self.net.n_bodies]).reshape(-1, 6).max(axis=0, initial=0.0)
        most = np.max([bodies, *inner], axis=0)
        turn = float(np.abs(force[6 * self.net.n_bodies :]).max(initial=0.0))
        return float(max(most[:3].max(), max(most[3:].max(), turn) / self.length))

    def share(self, step: FloatArray) -> float:
        """Return the share of a step after which no body turns too far."""
        bodies = np.abs(step[: 6 * self.net.n_bodies]).reshape(-1, 6)
        turn = max(bodies[:, 3:].max(), np.abs(step[6 * self.net.n_bodies :]).max(initial=0.0))
        return float(min(1.0, _TURN / max(turn, 1e-300)))


def factor(matrix: sp.csc_array, order: Literal["NATURAL", "MMD_AT_PLUS_A"] = "NATURAL") -> SuperLU:
    """Return the factors of a symmetric matrix, which is in order unless SuperLU is to find one."""
    return splu(matrix, permc_spec=order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})


def sparse_order(pairs: IntArray, count: int) -> IntArray:
    """Return the place of each point in an order that keeps factors sparse.

    The point with the fewest neighbours is eliminated first (Liu, "Modification of the minimum-
    degree algorithm by multiple elimination", ACM TOMS 11, 1985), as SuperLU does it.

    Parameters
    ----------
    pairs : (N, 2) int array
        Which points are joined.
    count : int
        Number of points.
    """
    one, two, own = *pairs.T, np.arange(count)
    rows, columns = np.concatenate([own, one, two]), np.concatenate([own, two, one])
    # No sum of a row is as large as what stands on its diagonal.
    values = np.concatenate([np.full(count, 1.0 + 2.0 * len(pairs)), np.ones(2 * len(pairs))])
    graph = sp.coo_array((values, (rows, columns)), shape=(count, count)).tocsc()
    return factor(graph, "MMD_AT_PLUS_A").perm_c


def relax(
    net: Net,
    state: NetState,
    *,
    gain: float = 0.0,
    most: int = _STEPS,
    begun: Relaxed | None = None,
    progress: Progress = no_progress,
) -> Relaxed:
    """Return where a net comes to rest; its energy never rises on the way.

    Gauss and Newton's method, damped as Levenberg and Marquardt do; Newton's, with what stress adds
    to stiffness, once steps are good. A step that would raise the energy is not taken.

    Parameters
    ----------
    net : Net
    state : NetState
        Where it is let go.
    gain : float
        It is at rest, too, when the last few steps gain no more than this share of the energy, or
        one of Newton's a tenth of it.
    most : int
        Steps at most.
    begun : Relaxed, optional
        How far the same net came from there, where less was asked for: it goes on as it would have.
    progress : callable
    """
    solver = Solver(net)
    enough = _REST * float(solver.scale[0])
    if begun is None:
        at_first = energy(net, state)
        begun = Relaxed(state, at_first, np.inf, (at_first,), settled=False)
    state, history, rough = begun.state, [*begun.history], False
    steps, damping, stressed = begun.pace
    while True:
        force, matrix, local = solver.system(state, damping, stressed=stressed)
        residual = solver.residual(force, local)
        if rough or residual <= enough or steps == most or damping > _MOST:
            break
        progress("form", steps, most)
        steps += 1
        step = -solver.solve(factor(matrix), force)
        whole, least = solver.share(step), history[-1]
        share = whole
        for _ in range(_HALVINGS):
            moved = solver.moved(state, local, step, share)
            there = energy(net, moved)
            if there < least:
                break
            share /= _SHORTER
        if there < least:
            state = moved
            history.append(there)
            gained = least - there
            # What is left is rounding, or less than is asked for.
            rough = gained <= _GAIN * abs(least) and residual <= _ROUGH * enough
            rough |= history[-_LOOK:][0] - there <= gain * there and len(history) > _LOOK
            if stressed and share == 1.0:
                expected = -0.5 * float(force @ step)
                rough |= max(gained, expected) <= _NEWTON * gain * there
            stressed = share == 1.0 and damping <= _CALM and gained <= _SLOW * abs(there)
            damping = max(damping * _EASE, _LEAST) if share == whole else damping
        elif stressed:
            stressed = False
        else:
            damping *= _STIFFEN
    settled = rough or residual <= _ROUGH * enough
    pace = Pace(steps, damping, stressed)
    return Relaxed(state, history[-1], residual, tuple(history), settled, pace)


def soft_modes(net: Net, state: NetState, count: int) -> tuple[FloatArray, FloatArray]:
    """Return in which ways a net at rest moves most easily, the softest first.

    Parameters
    ----------
    net : Net
    state : NetState
        At rest.
    count : int

    Returns
    -------
    stiffness : (N,) float array
        What resists each, N/mm: its energy is half of that times the sum of all bodies' squared
        displacements.
    motion : (N, B, 3) float array
        How bodies move, their squares summing up to 1.
    """
    solver = Solver(net)
    _, matrix, _ = solver.system(state, 0.0, stressed=True)
    bodies = net.n_bodies
    # Turns weigh little: they follow.
    mass = np.ones(net.n_freedoms)
    mass[: 6 * bodies].reshape(bodies, 6)[:, 3:] = 1e-6 * solver.length**2
    mass[6 * bodies :] = 1e-6 * solver.length**2
    weight = sp.diags_array(mass[solver.order], format="csc")
    shift = -1e-6 * float(solver.scale[0])
    factors = factor((matrix - shift * weight).tocsc())
    inverse = LinearOperator(matrix.shape, matvec=factors.solve, dtype=np.float64)
    start = np.cos(np.arange(net.n_freedoms))
    values, vectors = eigsh(
        matrix, k=count, M=weight, sigma=shift, which="LM", OPinv=inverse, v0=start
    )
    order = np.argsort(values)
    motion = np.empty((count, net.n_freedoms))
    motion[:, solver.order] = vectors.T[order]
    body = motion[:, : 6 * bodies].reshape(count, bodies, 6)[..., :3]
    return values[order], np.einsum("bij,nbj->nbi", state.bodies.axes, body)
