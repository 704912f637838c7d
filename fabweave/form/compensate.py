"""Move the mesh of an object so that what is cut settles onto the mesh that was wished for.

Strips that are cut as they lie on a mesh settle beside it, as they rest where their forces are in
balance, under their weight and their load. So each vertex is moved by minus what its crossings go,
time and again. Where it rests then is found from where it rested before, in a few steps,
and in the end so closely as at first. Ribbons keep the rules that they kept: where one would be
broken, the motion is evened out, and taken back where that does not help.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import cast

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen,
    no_progress,
)
from fabweave.form.body import ElasticBody, body_of, off_places
from fabweave.form.hold import Foresight, Foretold, foretell, pins_of
from fabweave.form.settle import BOUND, STANDS, Closely, Rests, let_go
from fabweave.mesh.automorphisms import Symmetry
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.symmetrise import vertex_images
from fabweave.piece.brief import Brief
from fabweave.piece.joined_object import JoinedObject, recut, relaid
from fabweave.piece.pieces import PieceSet
from fabweave.ribbon.aim import Aim
from fabweave.ribbon.lay import WovenObject, lay_ribbons
from fabweave.ribbon.project import following_rung
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.weave.symmetry import nearest_symmetry
from fabweave.weave.weave_mesh import WovenMesh

#: So often it is let go, at most; so often vertices are moved then. It is enough after so many
#: steps that take less than this share of what is left off.
_ROUNDS, _STEPS, _LITTLE, _IDLE = 3, 12, 0.05, 3
#: So many steps are mixed; what they did is alike to less than this share.
_PAST, _ALIKE = 6, 0.03
#: What is off by no more than this share of the size in the mean is near enough.
_NEAR = 0.0025
#: What is left is to be less than this share of what there was in the mean, and no more at most;
#: else nothing is moved.
_WORTH = 0.8
#: To know about where it rests, this is near enough; and from where it rested before, steps of
#: Newton's at least, and such a share of what it took as drawn.
_ABOUT_REST = Closely(gain=1e-3, sag_gain=1e-6, steps=80)
_FEW, _FEWER = 3, 1 / 6
#: Objects of more crossings are left as they are drawn: to let them go once more takes a minute.
MOST_CROSSINGS = 3000
#: Where a rule would be broken, so much is tried; at first the motion is evened out, so often, by
#: such a share of what tells a vertex from its neighbours; about these places by less and less.
_TRIES, _EVENED, _EVEN, _TIMES, _ABOUT, _BACK = 8, 3, 0.7, 3, 0.7, 0.5
#: The ends of no edge move apart by more, as a share of its length: a box would become flat.
_PULLED = 0.3
#: How far crossings may be from where they are wished in their quads: a share of how far they are
#: from the middles, and millimetres.
_BESIDE, _BESIDE_MM = 0.4, 5e-4
#: A place is worse than it was from such a share of what is needed on.
_WORSE = 0.02

#: An object whose ribbons are laid anew, how its vertices are moved, and where it rests; and with
#: its strips, and what is left.
_Moved = tuple[JoinedObject, FloatArray, list[Rests]]
_Nearer = tuple[JoinedObject, FloatArray, list[Rests], FloatArray]
#: Checks ribbons against the rules of their material.
Check = Callable[[WovenObject, Depth], RibbonCheck]


def compensated(
    joined: JoinedObject,
    pieces: PieceSet,
    brief: Brief,
    check: Check,
    progress: Progress = no_progress,
) -> list[JoinedObject]:
    """Return objects that settle onto the mesh of another, the nearest first.

    There are none where little is gained.

    Parameters
    ----------
    joined : JoinedObject
        As it is drawn.
    pieces : PieceSet
        Its pieces, for how its crossings are fastened.
    brief : Brief
    check : callable
    progress : callable
    """
    body = body_of(joined.woven, brief) if _may_move(joined.woven, brief) else None
    if body is None:
        return []
    with threadpool_limits(limits=1, user_api="blas"):
        pins = pins_of(body, pieces)
        woven, moves = joined.woven, Foresight(body).moves(pins)
        if not _is_worth_it(woven, brief, moves):
            return []
        none = np.zeros(len(body.places))
        aim = Aim(woven.mesh, body.places, none, none, 0.0)
        aimed = replace(joined, woven=replace(woven, aim=aim))
        return _Compensation(aimed, aim, pins, brief, check, progress).found[::-1]


def foretell_end(woven: WovenObject, brief: Brief, pieces: PieceSet) -> Foretold | None:
    """Return how far an object goes, to first order, and is off in the end as it will be cut."""
    found = foretell(woven, brief, pieces)
    if found is None or found.moves is None:
        return found
    return found._replace(left_mm=_foretold_left(woven, brief, found.moves))


def _foretold_left(woven: WovenObject, brief: Brief, moves: FloatArray) -> float | None:
    """Return what is left of how crossings go; None of what is cut as it is drawn.

    Vertices cannot take back all of it.
    """
    if woven.aim is not None:
        return float(woven.aim.left_mm.max())
    if not _may_move(woven, brief) or not _is_worth_it(woven, brief, moves):
        return None
    means, left = vertex_means(woven), moves
    for _ in range(_STEPS):
        left = left - _crossings_between(woven) @ (means @ left)
    return float(np.linalg.norm(left, axis=1).max())


def _may_move(woven: WovenObject, brief: Brief) -> bool:
    """Return whether an object may be cut otherwise than it is drawn."""
    asked, count = brief.pieces, woven.weave.threads.n_crossings
    # A ring holds a rim where it is drawn.
    drawn = asked.as_drawn != "on" or asked.former is not None or woven.source.rim != "none"
    return not (drawn or woven.straight or count > MOST_CROSSINGS)


def _is_worth_it(woven: WovenObject, brief: Brief, moves: FloatArray) -> bool:
    """Return whether crossings go by more than strips are thick, and the object stands."""
    most = float(np.linalg.norm(moves, axis=1).max())
    thickness = min(one.thickness_mm for one in brief.supplies.materials)
    return thickness < most < STANDS * woven.size_mm


def _crossings_between(woven: WovenMesh) -> sp.csr_array:
    """Return what takes crossings from vertices, (X, V): each lies in the middle of its quad."""
    mesh, (tail, head) = woven.mesh, _ends(woven)
    halfedges, own = woven.halfedges, woven.weave.threads.crossing_halfedge
    shape = mesh.n_faces, mesh.n_vertices
    corners = np.ones(len(mesh.indices)), mesh.indices, mesh.offsets
    faces = _rows_of_one(sp.csr_array(corners, shape=shape))
    each = sp.csr_array(sp.eye_array(mesh.n_vertices))
    left, right = (faces[halfedges.face[side]] for side in (own, halfedges.twin[own]))
    return sp.csr_array((each[tail] + each[head] + left + right) / 4.0)


def off_in_parts(body: ElasticBody, places: FloatArray) -> FloatArray:
    """Return how crossings are off where they are wished, (X, 3), each body where it fits best."""
    off = np.zeros_like(places)
    for own in body.bodies:
        off[own] = off_places(places[own], body.target[own])
    return off


def vertex_means(woven: WovenMesh) -> sp.csr_array:
    """Return what takes means of the crossings about each vertex, (V, X)."""
    ends, count = _ends(woven), woven.weave.threads.n_crossings
    at = np.concatenate(ends), np.tile(np.arange(count), 2)
    shape = woven.mesh.n_vertices, count
    mean = _rows_of_one(sp.coo_array((np.ones(2 * count), at), shape=shape).tocsr())
    # A corner of one face only goes with its neighbours.
    alone = sp.diags_array((mean.sum(axis=1) == 0).astype(np.float64))
    return sp.csr_array(mean + alone @ _neighbours(woven) @ mean)


def _ends(woven: WovenMesh) -> tuple[IntArray, IntArray]:
    """Return the ends of each crossing's edge."""
    halfedges, own = woven.halfedges, woven.weave.threads.crossing_halfedge
    return halfedges.tail[own], halfedges.head[own]


def _neighbours(woven: WovenMesh) -> sp.csr_array:
    """Return what takes means of the neighbours of each vertex, (V, V)."""
    halfedges, count = woven.halfedges, woven.mesh.n_vertices
    pairs = halfedges.tail, halfedges.head
    ends = np.concatenate(pairs), np.concatenate(pairs[::-1])
    return _rows_of_one(sp.coo_array((np.ones(len(ends[0])), ends), shape=(count, count)).tocsr())


def _rows_of_one(matrix: sp.csr_array) -> sp.csr_array:
    """Return a matrix whose rows add up to 1, or are empty."""
    return sp.csr_array(sp.diags_array(1.0 / np.maximum(matrix.sum(axis=1), 1.0)) @ matrix)


@dataclass
class _Compensation:
    """An object whose mesh is moved, vertex by vertex."""

    joined: JoinedObject
    aim: Aim
    pins: FloatArray
    brief: Brief
    check: Check
    progress: Progress
    roughly: Closely = _ABOUT_REST

    @property
    def found(self) -> list[JoinedObject]:
        """What comes nearer and nearer to its aim in the end."""
        rests = self.rests(self.joined, _ABOUT_REST)
        took = max(len(at.history) for one in rests for at in (one.free, one.end))
        self.roughly = _ABOUT_REST._replace(steps=max(_FEW, round(_FEWER * took)))
        drawn = left = self.off(rests)
        tried = []
        moved = np.zeros_like(self.joined.woven.mesh.vertices)
        for _ in range(_ROUNDS):
            found = self.stepped(moved, rests)
            nearer = None if found is None else self.nearer(found, left)
            if nearer is None and found is not None:
                # Where a whole step goes too far, as what snaps over then, half of it may do.
                half = self.kept(moved, (found[1] - moved) / 2.0)
                nearer = half and self.nearer((half[0], moved + half[1], rests), left)
            if nearer is None:
                break
            cut, moved, rests, left = nearer
            tried.append(self.aimed(cut, moved, drawn, left))
            if self.is_near(left):
                break
        return tried

    def nearer(self, found: _Moved, before: FloatArray) -> _Nearer | None:
        """Return an object as it is cut that comes nearer than before; None if it does not.

        Crossings stay beside the middles of their quads.
        """
        laid, moved, _ = found
        cut = recut(laid, self.brief)
        if cut is None or not self.at_edges(cut):
            return None
        # What can rest in several ways is let go as it is in the end: from where it is drawn.
        rests = self.rests(cut, _ABOUT_REST)
        left = self.off(rests)
        gained = _mean(left) <= _WORTH * _mean(before) and _most(left) <= _most(before)
        return (cut, moved, rests, left) if gained else None

    def pulled(self, mesh: PolyMesh) -> BoolArray:
        """Return which crossings' edges are drawn out, pressed or turned too much, (X,)."""
        tail, head = _ends(self.joined.woven)
        was, now = (one.vertices[head] - one.vertices[tail] for one in (self.aim.mesh, mesh))
        most = _PULLED * np.linalg.norm(was, axis=1)
        return np.asarray(np.linalg.norm(now - was, axis=1) > most)

    def is_near(self, off: FloatArray) -> bool:
        """Return whether an object is as near to its aim as it need be."""
        size_mm = self.joined.woven.size_mm
        return _most(off) <= BOUND * size_mm and _mean(off) <= _NEAR * size_mm

    def stepped(self, moved: FloatArray, rests: list[Rests]) -> _Moved | None:
        """Return an object that is off less than others, how its vertices moved, and how it rests.

        Vertices are moved by minus what is off about them, and what earlier motions did to that is
        made the most of first (Anderson, "Iterative procedures for nonlinear integral equations",
        J. ACM 12, 1965).
        """
        off = self.off(rests)
        best, least, share, idle = None, _mean(off), 1.0, 0
        past = [(moved, off)]
        for number in range(_STEPS):
            self.progress("form", number, _STEPS)
            step = self.kept(moved, share * (_mixed(past, self.at_vertices) - moved))
            if step is None:
                break
            laid, there = step[0], moved + step[1]
            rested = self.rests(laid, self.roughly, rests)
            off = self.off(rested)
            idle = 0 if _mean(off) < (1.0 - _LITTLE) * least else idle + 1
            if _mean(off) < least:
                moved, rests, least, share = there, rested, _mean(off), min(1.0, 2.0 * share)
                best = laid, moved, rests
                past.append((moved, off))
            else:
                # What is learnt there serves all the same.
                past.insert(-1, (there, off))
                share /= 2.0
            if idle == (1 if self.is_near(off) else _IDLE):
                break
        return best

    def aimed(
        self, cut: JoinedObject, moved: FloatArray, drawn: FloatArray, left: FloatArray
    ) -> JoinedObject:
        """Return an object with what it settles onto, and how near it comes."""
        aim = replace(
            self.aim,
            drawn_mm=frozen(np.linalg.norm(drawn, axis=1)),
            left_mm=frozen(np.linalg.norm(left, axis=1)),
            moved_mm=float(np.linalg.norm(moved, axis=1).max()),
        )
        return replace(cut, woven=replace(cut.woven, aim=aim))

    def body(self, joined: JoinedObject) -> ElasticBody:
        """Return an object as an elastic body."""
        # It has as many crossings as before.
        return cast(ElasticBody, body_of(joined.woven, self.brief))

    def rests(
        self, joined: JoinedObject, how: Closely, like: list[Rests] | None = None
    ) -> list[Rests]:
        """Return where each body of an object comes to rest."""
        body = self.body(joined)
        alike: Sequence[Rests | None] = like or [None] * len(body.bodies)
        return [
            let_go(part, self.pins[own], how, one)
            for part, own, one in zip(body.parts, body.bodies, alike, strict=True)
        ]

    def off(self, rests: list[Rests]) -> FloatArray:
        """Return how far crossings are off in the end, (X, 3), each body where it fits best."""
        off = np.zeros_like(self.aim.places)
        for own, one in zip(self.bodies, rests, strict=True):
            off[own] = off_places(one.end.state.bodies.origin, self.aim.places[own])
        return off

    @cached_property
    def bodies(self) -> tuple[IntArray, ...]:
        """The crossings of each body."""
        return self.body(self.joined).bodies

    @cached_property
    def drawn(self) -> "_Broken":
        """Where rules are broken as it is drawn."""
        return _Broken(self.check(self.joined.woven, Depth.NEAR), self.joined.woven)

    def kept(self, moved: FloatArray, step: FloatArray) -> tuple[JoinedObject, FloatArray] | None:
        """Return an object whose vertices are moved on by a step, and how far they are, (V, 3).

        The step is evened out about places that would be worse than they were, more and more; what
        does not help is taken back there, more and more. None if that does not help.
        """
        about = np.zeros(len(step))
        for number in range(_TRIES):
            there = self.moved(moved + step)
            broken, pulled = self.along(there), self.pulled(there)
            if not pulled.any() and broken.no_more_than(self.drawn):
                laid = relaid(self.joined, there, self.brief)
                broken = _Broken(self.check(laid.woven, Depth.NEAR), laid.woven)
                if broken.no_more_than(self.drawn):
                    return laid, step
            at = pulled[self.joined.woven.weave.threads.crossing]
            self.spread(about, at | broken.worse_than(self.drawn))
            if number >= _EVENED:
                step = self.symmetric(step * (1.0 - _BACK * about)[:, None])
            for _ in range(_TIMES * (number + 1)):
                uneven = moved + step - self.neighbours @ (moved + step)
                step = self.symmetric(step - _EVEN * about[:, None] * uneven)
        return None

    def moved(self, moved: FloatArray) -> PolyMesh:
        """Return the mesh with its vertices moved."""
        mesh = self.joined.woven.mesh
        return mesh.with_vertices(mesh.vertices + moved)

    def along(self, mesh: PolyMesh) -> "_Broken":
        """Return where rules of each ribbon by itself are broken, if it is laid on a mesh."""
        woven, supplies = self.joined.woven, self.brief.supplies
        source = replace(woven.source, mesh=mesh)
        factor = None if woven.narrowed is None else woven.narrowed.factor
        thickness = supplies.thickness_mm(woven.bunches)
        ribbons = lay_ribbons(
            source, woven.weave, self.brief.ribbons, thickness, woven.laps, factor
        )
        laid = replace(woven, source=source, ribbons=ribbons, narrowed=None)
        return _Broken(self.check(laid, Depth.ALONG), laid)

    def at_vertices(self, off: FloatArray) -> FloatArray:
        """Return the mean of what crossings about each vertex are off, (V, 3)."""
        return self.symmetric(self.means @ off)

    def at_edges(self, cut: JoinedObject) -> bool:
        """Return whether crossings lie beside the middles of their quads much as they are wished.

        On coarse meshes, where they lie far from these, they may not.
        """
        between = _crossings_between(self.joined.woven)
        beside = cut.woven.ribbons.centre - between @ cut.woven.mesh.vertices
        off = self.aim.places - between @ self.aim.mesh.vertices - beside
        most = _BESIDE * np.linalg.norm(beside, axis=1) + _BESIDE_MM
        return bool(np.all(np.linalg.norm(off, axis=1) <= most))

    @cached_property
    def means(self) -> sp.csr_array:
        """See :func:`vertex_means`."""
        return vertex_means(self.joined.woven)

    @cached_property
    def neighbours(self) -> sp.csr_array:
        """What means are taken with of each vertex's neighbours, (V, V)."""
        return _neighbours(self.joined.woven)

    def spread(self, about: FloatArray, passes: BoolArray) -> None:
        """Mark vertices beside some passes and those that follow, and farther about those marked.

        The marks, (V,), are from 0 to 1.
        """
        threads = self.joined.woven.weave.threads
        after = following_rung(threads.offsets, threads.closed)[passes]
        at = threads.crossing[np.concatenate([np.flatnonzero(passes), after[after >= 0]])]
        tail, head = _ends(self.joined.woven)
        for ends in (tail, head):
            about[ends[at]] = 1.0
        near = _ABOUT * about
        np.maximum.at(about, tail, near[head])
        np.maximum.at(about, head, near[tail])

    @cached_property
    def symmetry(self) -> tuple[Symmetry, IntArray]:
        """The motions that map the mesh onto itself, and where they take vertices."""
        woven = self.joined.woven
        group = nearest_symmetry(woven.mesh, woven.halfedges)
        return group, vertex_images(group, woven.halfedges, woven.mesh.n_vertices)

    def symmetric(self, step: FloatArray) -> FloatArray:
        """Return the mean of how vertices move as seen by all motions of the mesh onto itself.

        So pieces that are alike stay so.
        """
        group, images = self.symmetry
        return np.asarray(np.mean(step[images] @ group.matrix, axis=0))


class _Broken:
    """Where ribbons break rules.

    Parameters
    ----------
    check : RibbonCheck
    woven : WovenObject
        Whose ribbons they are.
    """

    def __init__(self, check: RibbonCheck, woven: WovenObject) -> None:
        count = len(woven.weave.threads.crossing)
        self._counts = {one.rule: (one.count, one.far) for one in check.findings}
        #: By rule, what there is over what is needed at each pass, at the least.
        self._margins = {rule: np.full(count, np.inf) for rule in check.measured}
        for rule, measured in check.measured.items():
            for at in (measured.passes, measured.others):
                known = at >= 0
                np.minimum.at(self._margins[rule], at[known], measured.margins[known])

    def no_more_than(self, other: "_Broken") -> bool:
        """Return whether no rule is broken oftener than elsewhere, and its worst place is no worse.

        One that is kept there is kept; and no more places are far from what is needed.
        """
        for rule, (count, far) in self._counts.items():
            often, far_there = other._counts.get(rule, (0, 0))
            worst = other._margins[rule].min() - _WORSE if often else 1.0
            if count > often or far > far_there:
                return False
            if self._margins[rule].min() < worst:
                return False
        return True

    def worse_than(self, other: "_Broken") -> BoolArray:
        """Return at which passes a rule is broken, and was not, or less so, (P,)."""
        worse = [
            (margins < 1.0)
            & ((margins < other._margins[rule] - _WORSE) | (other._margins[rule] >= 1.0))
            for rule, margins in self._margins.items()
            if rule in other._margins
        ]
        return np.asarray(np.any(worse, axis=0))


def _mixed(
    past: list[tuple[FloatArray, FloatArray]], at: Callable[[FloatArray], FloatArray]
) -> FloatArray:
    """Return how to move vertices, (V, 3), by how they were moved, and what was off then."""
    moved, off = past[-1]
    earlier = past[-_PAST:-1]
    if earlier:
        moves = np.stack([moved - one for one, _ in earlier])
        gains = np.stack([off - one for _, one in earlier])
        flat = gains.reshape(len(gains), -1).T
        share = np.linalg.lstsq(flat, off.ravel(), rcond=_ALIKE)[0]
        moved = moved - np.tensordot(share, moves, 1)
        off = off - np.tensordot(share, gains, 1)
    return moved - at(off)


def _most(off: FloatArray) -> float:
    """Return the length of the longest of vectors."""
    return float(np.linalg.norm(off, axis=1).max())


def _mean(off: FloatArray) -> float:
    """Return the root mean square of vectors."""
    return float(np.sqrt((off**2).sum(axis=1).mean()))
