"""Foretell how a woven object springs while it is built, and what brings its pieces home.

A half-built object is not at rest where it is drawn: strips that are there want to go flat, and
those that hold them are not there yet. Both are foretold to first order about the form that is
wished for, at a few steps.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.form.body import ElasticBody, off_places
from fabweave.form.net import Local, Net, NetState
from fabweave.form.relax import Solver, factor
from fabweave.form.settle import STANDS
from fabweave.mesh.likeness import name_place
from fabweave.piece.development import Runs
from fabweave.ribbon.project import following_rung
from fabweave.weave.threads import Threads

#: So many steps are looked at, of the last third; where rings close in these, of those.
_STEPS, _LATE = 3, 2 / 3
#: Damping, as a share of a strip's own bending: rigid motions are free.
_DAMPING = 1e-5
#: Up to so many newtons each, in words: a finger's push, and what two hands give without a tool.
_FORCES = ((5.0, "by hand"), (40.0, "with two hands"), (np.inf, "with a clamp"))


class Homing(NamedTuple):
    """What a half-built object wants, and the force that brings its next piece home.

    Parameters
    ----------
    step : int
        Which piece of the order comes next, from 0.
    closes : bool
        Whether it closes a ring.
    springs_mm : float
        How far crossings that are there want to go from where they are to be, at most.
    where : str
        Where they go farthest.
    force_n : float
        The largest that strands of the piece and of the object press on one another with, once it
        is there: a moment as a force at a span's end.
    """

    step: int
    closes: bool
    springs_mm: float
    where: str
    force_n: float

    @property
    def hands(self) -> str:
        """What brings the piece home, in words."""
        return next(words for most, words in _FORCES if self.force_n <= most)


def homings(
    body: ElasticBody, pins: FloatArray, threads: Threads, runs: Runs, order: IntArray
) -> tuple[Homing, ...]:
    """Return what a few late steps ask for, in the order of these.

    Parameters
    ----------
    body : ElasticBody
    pins : (X,) float array
        How crossings resist turning when all is there, N mm per radian.
    threads : Threads
    runs : Runs
        The passes of each piece.
    order : (N,) int array
        Pieces as they are placed.
    """
    step_of = np.empty(len(order), dtype=np.int64)
    step_of[order] = np.arange(len(order))
    placed = _placed(threads, runs, step_of)
    last = np.zeros(len(threads.lengths), dtype=np.int64)
    np.maximum.at(last, runs.thread, step_of)
    closing = np.unique(last[threads.closed & threads.woven])
    with threadpool_limits(limits=1, user_api="blas"):
        return tuple(
            _homing(body, pins, placed, step, closes=step in closing)
            for step in _late(closing, len(order))
        )


def _late(closing: IntArray, count: int) -> list[int]:
    """Return a few late steps, evenly chosen, the last included."""
    late = closing[closing >= _LATE * count]
    some = late if len(late) else np.arange(int(_LATE * count), count)
    at = np.linspace(0, len(some) - 1, min(_STEPS, len(some))).round().astype(np.int64)
    return [step for step in np.unique(some[at]).tolist() if step > 0]


def _placed(threads: Threads, runs: Runs, step_of: IntArray) -> IntArray:
    """Return by which step each span of the net is there, (S,), spans as the net has them."""
    placed = np.full(len(threads.crossing), len(step_of))
    length = runs.last - runs.first
    piece = np.repeat(np.arange(len(length)), length)
    along = np.arange(len(piece)) - np.repeat(np.cumsum(length) - length, length)
    thread = runs.thread[piece]
    at = threads.offsets[thread] + (runs.first[piece] + along) % threads.lengths[thread]
    # Where pieces lap, the first of them is there.
    np.minimum.at(placed, at, step_of[piece])
    return placed[following_rung(threads.offsets, threads.closed) >= 0]


def _homing(
    body: ElasticBody, pins: FloatArray, placed: IntArray, step: int, *, closes: bool
) -> Homing:
    """Return what a step asks for."""
    before, after, own = placed < step, placed <= step, placed == step
    moves, _, _ = _rest(body, pins, before)
    bound = _bound(body.net, before)
    there = np.flatnonzero(bound if bound.sum() >= 3 else np.ones_like(bound))
    away = np.linalg.norm(off_places(body.places[there] + moves[there], body.places[there]), axis=1)
    _, pulls, length = _rest(body, pins, after)
    force = np.zeros((body.net.n_bodies + 1, 6))
    mine = own[after]
    for side in (0, 1):
        at = body.net.ends[own, side]
        np.add.at(force, at, pulls[mine, 7 * side : 7 * side + 6])
    force = force[:-1][_bound(body.net, after)]
    each = np.maximum(
        np.linalg.norm(force[:, :3], axis=1), np.linalg.norm(force[:, 3:], axis=1) / length
    )
    where = name_place(body.places[there[int(away.argmax())]], body.mesh)
    # A first step tells no more than that it hangs slack.
    springs_mm = min(float(away.max()), STANDS * body.size_mm)
    return Homing(step, closes, springs_mm, where, float(each.max(initial=0.0)))


def _bound(net: Net, spans: BoolArray) -> BoolArray:
    """Return the crossings of which both strands are there, (X,)."""
    turned = np.zeros((2, net.n_bodies), dtype=np.bool_)
    for side in (0, 1):
        at, below = net.ends[spans, side], net.turns[spans, side] >= 0
        turned[0, at[below]], turned[1, at[~below]] = True, True
    return np.asarray(turned.all(axis=0))


def _rest(
    body: ElasticBody, pins: FloatArray, spans: BoolArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return how crossings go where only some spans are there, what these pull with, and a span.

    To first order: moves in space, (X, 3), and forces and moments on each span's ends, (S, 14).
    """
    net, wished = body.net, body.wished
    twice = np.flatnonzero(np.tile(spans, 2))
    inner = np.flatnonzero(np.repeat(spans, net.rest.shape[1] - 1))
    some = replace(
        net,
        ends=net.ends[spans],
        at=net.at[twice],
        turns=net.turns[spans],
        rest=net.rest[spans],
        stiffness=net.stiffness[spans],
        weight=0 * net.weight,
        # What is not crossed yet turns as it likes, and is not there to turn.
        pins=np.where(_bound(net, spans), pins, 0.0),
    )
    state = NetState(wished.bodies, wished.angles, wished.inner[inner])
    solver = Solver(some)
    force, matrix, local = solver.system(state, _DAMPING)
    step = solver.solve(factor(matrix), -force)
    turned = step[: 6 * net.n_bodies].reshape(-1, 6)[:, :3]
    moves = np.einsum("nij,nj->ni", wished.bodies.axes, turned)
    return moves, _pulls(local, np.append(step, 0.0)[solver.rows]), solver.length


def _pulls(local: Local, steps: FloatArray) -> FloatArray:
    """Return what spans pull with after steps of their ends, (S, 14)."""
    return np.asarray(local.force + np.einsum("sij,sj->si", local.matrix, steps))


def homing_note(found: Sequence[Homing]) -> str:
    """Return in words what is hardest while an object is built; empty where nothing is known.

    Examples
    --------
    >>> homing_note([Homing(40, True, 12.0, "top", 0.3)]).partition(": ")[0]
    'Before step 41, which closes a ring'
    """
    if not found:
        return ""
    hard = max(found, key=lambda one: (one.force_n, one.springs_mm))
    ring = ", which closes a ring" if hard.closes else ""
    return (
        f"Before step {hard.step + 1}{ring}: strips that lie there want to spring by up to "
        f"{hard.springs_mm:.0f} mm, most at the {hard.where}; clip them there. Push the new strip "
        f"into its place {hard.hands} (up to {max(hard.force_n, 0.1):.1f} N)"
    )
