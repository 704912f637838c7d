"""Choose the crossings whose fasteners keep a woven object's form, as few as do."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import SuperLU
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.form.body import HELD_N_MM, RIVETED, ElasticBody, body_of, rigid_motions
from fabweave.form.relax import Solver, factor
from fabweave.form.settle import BOUND, let_go
from fabweave.piece.brief import Brief
from fabweave.piece.joined_object import JoinedObject
from fabweave.piece.joint.fastening import parse_fastening
from fabweave.piece.pieces import PieceSet
from fabweave.ribbon.lay import WovenObject

#: The largest distance is taken for a mean of such powers, which tells whose turning adds to it.
_POWER = 8
#: So many crossings are fastened at first, as a share of all; each time as many again.
_FIRST = 1 / 64
#: Where all of them cannot bring it within the bound, none are worth it if it goes as far as this
#: share of what it does without them.
_WORTH = 0.75
#: What fasteners cannot bring within the bound, they are to bring so near to what all of them do,
#: as a share of what all gain; a gain of less than such a share of the bound is none.
_MOST_OF_IT, _A_GAIN = 0.75, 0.1
#: What keeps within this share of the bound to first order does so in the end; else it is let go,
#: and the bound to first order is corrected, so often, and to a little less than what is missed.
_SURELY, _TRIES, _NEARER = 0.4, 4, 0.97
#: Shares of all crossings that are tried where a first step tells little.
_SHARES = (1 / 8, 1 / 4, 0.45)
#: Objects of more crossings are not let go only to find their fasteners.
_MOST_CLOSELY = 3000
#: Damping, as a share of a strip's own bending: rigid motions are free.
_DAMPING = 1e-7


class Foretold(NamedTuple):
    """How far an object goes if it is let go, to first order.

    Parameters
    ----------
    settles_mm, sags_mm : float
        By what its strips want, and by what weighs on it.
    whole : float
        A mean of high powers of all distances, as shares of the bound: about the largest.
    gains : (X,) float array
        How that falls with each crossing's resistance to turning, by N mm per radian.
    moves : (X, 3) float array, optional
        How crossings go in all.
    left_mm : float or None
        How far they are off in the end, where the mesh is moved so that it settles onto itself.
    """

    settles_mm: float
    sags_mm: float
    whole: float
    gains: FloatArray
    moves: FloatArray | None = None
    left_mm: float | None = None

    @property
    def most_mm(self) -> float:
        """The larger of both."""
        return max(self.settles_mm, self.sags_mm)

    @property
    def off_mm(self) -> float:
        """How far it is off in the end."""
        return self.most_mm if self.left_mm is None else self.left_mm


class Foresight:
    """What becomes of an object for any pins, to first order about the form that is wished for.

    Strips are thin: as far as they go is small to how they are bent, and a first step of Newton's
    is near to all of them, at a hundredth of their time.
    """

    def __init__(self, body: ElasticBody) -> None:
        """Find forces and stiffness, but for those of pins."""
        free = replace(body.net, weight=0 * body.net.weight, pins=0 * body.net.pins)
        self._solver = Solver(free)
        self._bodies = free.n_bodies
        self._axes = body.wished.bodies.axes
        self._force, self._matrix, _ = self._solver.system(body.wished, _DAMPING)
        # It is held as stiffly in all directions, however its bodies are turned.
        self._held = np.zeros_like(self._force)
        each = self._held[: 6 * self._bodies].reshape(-1, 6)
        each[body.held(body.places), :3] = HELD_N_MM
        #: What holds it when it is let go, too.
        self._base = self._held * body.based
        back = (body.target - body.places) * (body.hung & body.based)[:, None]
        self._back = np.zeros_like(self._force)
        self._back[: 6 * self._bodies] = self._own(HELD_N_MM * back)
        self._pull = np.zeros_like(self._force)
        self._pull[: 6 * self._bodies] = self._own(body.net.weight + body.load)
        #: How each of its bodies moves as one.
        self._rigid = [(own, rigid_motions(body.places[own])) for own in body.loose]

    def _own(self, push: FloatArray) -> FloatArray:
        """Return pushes in space, (B, 3), on the freedoms of bodies, (6 B,)."""
        own = np.zeros((self._bodies, 6))
        own[:, :3] = np.einsum("nji,nj->ni", self._axes, push)
        return own.ravel()

    def _moves(self, step: FloatArray) -> FloatArray:
        """Return the motion of bodies in space, (B, 3)."""
        own = step[: 6 * self._bodies].reshape(-1, 6)[:, :3]
        return np.asarray(np.einsum("nij,nj->ni", self._axes, own))

    def _without_rigid(self, moves: FloatArray) -> FloatArray:
        left = moves.copy()
        for own, rigid in self._rigid:
            flat = moves[own].ravel()
            left[own] = (flat - rigid @ (rigid.T @ flat)).reshape(-1, 3)
        return left

    def _cases(self, pins: FloatArray) -> list[tuple[SuperLU, FloatArray, FloatArray]]:
        """Return factors, step and motion when it is let go, and under what weighs on it."""
        freedoms = np.zeros(len(self._force))
        freedoms[6 * self._bodies :] = pins
        cases: list[tuple[SuperLU, FloatArray, FloatArray]] = []
        for held, load in ((self._base, self._back - self._force), (self._held, self._pull)):
            more = sp.diags_array((freedoms + held)[self._solver.order], format="csc")
            factors = factor((self._matrix + more).tocsc())
            step = self._solver.solve(factors, load)
            moves = self._moves(step)
            cases.append((factors, step, moves if cases else self._without_rigid(moves)))
        return cases

    def moves(self, pins: FloatArray) -> FloatArray:
        """Return how crossings go in all, (X, 3), when it stands or hangs and bears its load."""
        (_, _, settling), (_, _, sagging) = self._cases(pins)
        return settling + sagging

    def __call__(self, pins: FloatArray, bound_mm: float) -> Foretold:
        """Return what becomes of it.

        Parameters
        ----------
        pins : (X,) float array
            How each crossing resists turning, N mm per radian.
        bound_mm : float
            Gains are of the largest distances as a share of that.
        """
        cases = self._cases(pins)
        (_, _, settling), (_, _, sagging) = cases
        away = [np.linalg.norm(moves, axis=1) for moves in (settling, sagging)]
        share = np.stack(away) / bound_mm
        whole = float((share**_POWER).sum()) ** (1 / _POWER)
        gains = np.zeros(len(pins))
        for (factors, step, _), moves, own in zip(cases, (settling, sagging), share, strict=True):
            steep = (own / max(whole, 1e-300)) ** (_POWER - 1) / np.maximum(own, 1e-300)
            push = steep[:, None] * moves / bound_mm**2
            if moves is settling:
                push = self._without_rigid(push)
            asked = np.zeros_like(self._force)
            asked[: 6 * self._bodies] = self._own(push)
            answer = self._solver.solve(factors, asked)
            gains += (answer * step)[6 * self._bodies :]
        most = float(away[0].max()), float(away[1].max())
        return Foretold(*most, whole, gains, settling + sagging)


def pins_of(body: ElasticBody, pieces: PieceSet) -> FloatArray:
    """Return how crossings resist turning, (X,), as they are fastened: N mm per radian."""
    riveted = [joint.crossing for joint in pieces.joints if len(joint.holes) > 1]
    if pieces.glued:
        return np.full(len(pieces.fastened), RIVETED)
    return body.pins(pieces.fastened, np.array(riveted, dtype=np.int64))


def foretell(woven: WovenObject, brief: Brief, pieces: PieceSet) -> Foretold | None:
    """Return how far an object goes, to first order; None where that would take minutes."""
    body = body_of(woven, brief)
    return None if body is None else Foresight(body)(pins_of(body, pieces), body.size_mm)


def form_hold(joined: JoinedObject, brief: Brief, *, closely: bool = True) -> "FormHold | None":
    """Return what fastens an object as :class:`FormHold` does; None where that is not asked for.

    Parameters
    ----------
    joined : JoinedObject
    brief : Brief
    closely : bool
        Whether to let it go, if it has not too many crossings, and not only to foretell.
    """
    fastening = parse_fastening(brief.fasten)
    body = body_of(joined.woven, brief) if fastening.kind == "form" and brief.rules else None
    if body is None:
        return None
    joints = joined.joints
    riveted = joints.crossing if joints.rule.fasteners > 1 else joints.crossing[:0]
    bound_mm = fastening.bound_mm or BOUND * body.size_mm
    closely = closely and len(body.places) <= _MOST_CLOSELY
    return FormHold(body, riveted, bound_mm, closely, strict=fastening.bound_mm is not None)


@frozen_value
class FormHold:
    """Fasten as few crossings as keep the form of an object: see :meth:`__call__`.

    Parameters
    ----------
    body : ElasticBody
    riveted : (R,) int array
        The crossings of two fasteners or more.
    bound_mm : float
        The object is to go no farther.
    closely : bool
        Whether to let it go, and not only to foretell what it does.
    strict : bool
        Whether the bound was asked for; else most of the way is enough where the rest costs dear.
    """

    body: ElasticBody
    riveted: IntArray
    bound_mm: float
    closely: bool = True
    strict: bool = True

    def __call__(self, fastened: BoolArray, alike: IntArray, roomy: BoolArray) -> BoolArray:
        """Return which crossings to fasten, (X,).

        Those are fastened first whose turning adds most to how far the object goes, and which are
        worth least are let off again; alike ones together. Where all of them are not enough, most
        of what they gain is.

        Parameters
        ----------
        fastened : (X,) bool array
            What is fastened in any case.
        alike : (X,) int array
            Numbers of crossings, which alike ones share.
        roomy : (X,) bool array
            Where there is room for a fastener.
        """
        with threadpool_limits(limits=1, user_api="blas"):
            choices = _Choices(self, fastened, alike, roomy | fastened)
            return choices.fastened(self._chosen(choices))

    def _chosen(self, choices: "_Choices") -> BoolArray:
        """Return which groups of crossings to fasten."""
        bound, none, every = self.bound_mm, choices.none, ~choices.none
        most, least = choices.foretold(none)[0], choices.foretold(every)[0]
        # What is foretold takes a moment; to let it go takes long.
        if least > bound:
            if least > _WORTH * most:
                return none
            bound = max(bound, least + (1 - _MOST_OF_IT) * (most - least))
            if most - bound < _A_GAIN * self.bound_mm:
                return none
        began = choices.reached(none)
        if began <= self.bound_mm:
            return none
        aim, tried = bound * min(1.0, most / began), []
        for _ in range(_TRIES):
            found = choices.fewest(aim)
            really = choices.reached(found)
            tried.append((choices.count(found), really, found))
            if really <= bound or choices.all_in(found):
                break
            aim *= _NEARER * bound / really
        if self.strict or not self.closely:
            return found
        enough = began - _MOST_OF_IT * (began - really)
        # Where a first step tells little, some shares of all are tried.
        for share in _SHARES if choices.all_in(found) else ():
            some = choices.best(share)
            reached = choices.reached(some, surely=True)
            tried.insert(0, (choices.count(some), reached, some))
            if reached <= enough:
                break
        # What does most of it with less than half of the fasteners is worth more than the last bit.
        fewer = [one for one in tried if one[1] <= enough and 2 * one[0] < tried[-1][0]]
        return min(fewer, key=lambda one: one[0], default=tried[-1])[2]


class _Choices:
    """Groups of alike crossings that may be fastened, and what becomes of any choice of them."""

    def __init__(
        self, hold: FormHold, fastened: BoolArray, alike: IntArray, roomy: BoolArray
    ) -> None:
        self._hold, self._foresee = hold, Foresight(hold.body)
        self._fastened, self._alike, self._roomy = fastened, alike, roomy
        self._more = roomy & ~fastened
        self.none = np.zeros(int(alike.max(initial=-1)) + 1, dtype=np.bool_)
        #: How many fasteners each group takes, beside those that are there in any case.
        self._free = np.bincount(alike[self._more], minlength=len(self.none))
        self._known: dict[bytes, tuple[float, FloatArray]] = {}

    def fastened(self, groups: BoolArray) -> BoolArray:
        """Return which crossings are fastened, (X,)."""
        return np.asarray(self._fastened | (groups[self._alike] & self._roomy))

    def count(self, groups: BoolArray) -> int:
        """Return how many crossings are fastened."""
        return int(self._fastened.sum() + self._free[groups].sum())

    def all_in(self, groups: BoolArray) -> bool:
        """Return whether nothing is left to fasten."""
        return bool(np.all(groups | (self._free == 0)))

    def _pins(self, groups: BoolArray) -> FloatArray:
        return self._hold.body.pins(self.fastened(groups), self._hold.riveted)

    def foretold(self, groups: BoolArray) -> tuple[float, FloatArray]:
        """Return how far it goes to first order, and what each group gains for a fastener."""
        key = groups.tobytes()
        if key not in self._known:
            found = self._foresee(self._pins(groups), self._hold.bound_mm)
            gains = np.bincount(
                self._alike, np.where(self._more, found.gains, 0.0), minlength=len(groups)
            )
            self._known[key] = found.most_mm, gains / np.maximum(self._free, 1)
        return self._known[key]

    def reached(self, groups: BoolArray, *, surely: bool = False) -> float:
        """Return how far it goes; as foretold where that is little, or must do."""
        foretold_mm = self.foretold(groups)[0]
        little = foretold_mm <= _SURELY * self._hold.bound_mm and not surely
        if little or not self._hold.closely:
            return foretold_mm
        body, pins = self._hold.body, self._pins(groups)
        each = zip(body.parts, body.bodies, strict=True)
        return max(let_go(part, pins[own]).most_mm for part, own in each)

    def _first(self, order: IntArray, step: int) -> IntArray:
        """Return the first groups of an order, of which all but the last take fewer fasteners."""
        return order[np.cumsum(self._free[order]) - self._free[order] < step]

    def best(self, share: float) -> BoolArray:
        """Return the groups that are worth most, for at most a share of all fasteners."""
        order = np.argsort(-self.foretold(self.none)[1], kind="stable")
        chosen = self.none.copy()
        chosen[order[np.cumsum(self._free[order]) <= share * self._free.sum()]] = True
        return chosen

    def fewest(self, aim_mm: float) -> BoolArray:
        """Return few groups that bring an object within a distance, as foretold.

        As many fasteners as at first are set at once, and then as many again, until that is enough.
        Of these, what is worth least is let off, fewer and fewer at once, if the rest is enough.
        """
        chosen = self.none.copy()
        away, gains = self.foretold(chosen)
        step = least = max(1, round(_FIRST * self._free.sum()))
        while away > aim_mm and not self.all_in(chosen):
            left = np.flatnonzero(~chosen & (self._free > 0))
            chosen[self._first(left[np.argsort(-gains[left], kind="stable")], step)] = True
            away, gains = self.foretold(chosen)
            step *= 2
        while step >= least and away <= aim_mm and chosen.any():
            kept = np.flatnonzero(chosen)
            fewer = chosen.copy()
            fewer[self._first(kept[np.argsort(gains[kept], kind="stable")], step)] = False
            found, instead = self.foretold(fewer)
            if found <= aim_mm:
                chosen, gains = fewer, instead
            else:
                step //= 2
        return chosen
