"""Move the mesh of an object so that what is cut settles onto the mesh that was wished for.

Strips that are cut as they lie on a mesh settle beside it, as they rest where their forces are in
balance, under their weight and their load. So each vertex is moved by minus what its crossings go,
time and again. How far they go is foretold to first order, which takes a moment, and what that
leaves out is taken from where the object really comes to rest at first. Ribbons keep the rules that
they kept: where one would be broken, the motion is corrected as little as may be.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, cast

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import FloatArray, IntArray, Progress, frozen, no_progress
from fabweave.form.body import ElasticBody, body_of, off_by
from fabweave.form.hold import Foresight, Foretold, foretell, pins_of
from fabweave.form.keep_rules import Broken, RuleKeeper
from fabweave.form.relax import Relaxed
from fabweave.form.settle import BOUND, STANDS, Closely, in_the_end, let_go
from fabweave.mesh.automorphisms import Symmetry
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.symmetrise import vertex_images
from fabweave.piece.brief import Brief
from fabweave.piece.joined_object import JoinedObject, recut, relaid
from fabweave.piece.pieces import PieceSet
from fabweave.ribbon.aim import Aim
from fabweave.ribbon.lay import WovenObject, lay_ribbons
from fabweave.ribbon.rules.remedy import Depth
from fabweave.ribbon.rules.ribbon_check import RibbonCheck
from fabweave.weave.symmetry import nearest_symmetry
from fabweave.weave.weave_mesh import WovenMesh

#: So often it is let go, at most, and what that shows is used; so often vertices are moved then.
#: A step that takes less than this share of what is left off is the last; and by as much may what
#: is off at most grow from one time to the next.
_ROUNDS, _STEPS, _LITTLE = 3, 2, 0.05
#: What is off by no more than this share of the size in the mean is near enough.
_NEAR = 0.0025
#: What is left is to be less than this share, in the mean, of what there was as it was drawn; and
#: what takes less from one time to the next is the last.
_WORTH = 0.8
#: To know about where it rests, this is near enough.
_ABOUT_REST = Closely(gain=1e-3, sag_gain=1e-6, steps=40)
#: Objects of more crossings are left as they are drawn: to let them go once more takes a minute.
MOST_CROSSINGS = 3000
#: Where a rule would be broken, the motion is corrected, so often; where that does not help, it is
#: made shorter, to such a share.
_TRIES, _SHORTER = 6, 0.5
#: No vertex moves farther, as a share of the size: a box of six faces would become flat.
_MOVED = 0.05
#: How far crossings may be from where they are wished in their quads: a share of how far they are
#: from the middles, and millimetres.
_BESIDE, _BESIDE_MM = 0.4, 5e-4

#: An object whose ribbons are laid anew, and how its vertices are moved.
_Moved = tuple[JoinedObject, FloatArray]
#: Checks ribbons against the rules of their material.
Check = Callable[[WovenObject, Depth], RibbonCheck]


class Begun(NamedTuple):
    """How far each body of an object came when it was let go, with such pins."""

    pins: FloatArray
    each: tuple[Relaxed, ...]

    def by(self, pins: FloatArray) -> tuple[Relaxed, ...]:
        """Return how far each came; nothing where other pins hold it."""
        return self.each if np.array_equal(self.pins, pins) else ()


def compensated(
    joined: JoinedObject,
    pieces: PieceSet,
    brief: Brief,
    check: Check,
    progress: Progress = no_progress,
) -> list[tuple[JoinedObject, Begun]]:
    """Return objects that settle onto the mesh of another, the nearest first.

    And how far each came to rest. There are none where little is gained.

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

    Vertices cannot take back all of it; half of what would move them too far.
    """
    if woven.aim is not None:
        return float(woven.aim.left_mm.max())
    if not _may_move(woven, brief) or not _is_worth_it(woven, brief, moves):
        return None
    means, between = vertex_means(woven), _crossings_between(woven)
    moved = np.zeros_like(woven.mesh.vertices)
    for _ in range(_STEPS):
        moved = moved + means @ (moves - between @ moved)
    for step in (moved, moved / 2.0):
        if _most(step) <= _MOVED * woven.size_mm:
            # What a first step leaves out goes with its square; as measured, what goes so far that
            # it nearly collapses is off by all of that.
            return _most(moves - between @ step) + _most(moves) ** 2 / (STANDS * woven.size_mm)
    return None


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

    @property
    def found(self) -> list[tuple[JoinedObject, Begun]]:
        """What comes nearer and nearer to its aim in the end, and how far that came to rest."""
        drawn = left = self.off(self.joined)[0]
        off, tried = self.foretold(self.joined), []
        moved = np.zeros_like(self.joined.woven.mesh.vertices)
        for _ in range(_ROUNDS):
            # What is left out to first order is as it was when it came to rest last.
            found = self.stepped(moved, left, left - off)
            cut = found and self.cut(found)
            if found is not None and cut is None:
                # Where a whole step goes too far, half of it may do.
                half = self.kept(moved, (found[1] - moved) / 2.0)
                found = half and (half[0], moved + half[1])
                cut = found and self.cut(found)
            if found is None or cut is None:
                break
            before, (left, came) = left, self.off(cut)
            gained = _mean(left) < min(_mean(before), _WORTH * _mean(drawn))
            if not gained or _most(left) > (1.0 + _LITTLE) * _most(before):
                break
            laid, moved = found
            tried.append((self.aimed(cut, moved, drawn, left), Begun(self.pins, came)))
            if self.is_near(left) or _mean(left) > _WORTH * _mean(before):
                break
            off = self.foretold(laid)
        return tried

    def cut(self, found: _Moved) -> JoinedObject | None:
        """Return an object as it is cut; None if it cannot be.

        No vertex goes far, and crossings stay beside the middles of their quads.
        """
        laid, moved = found
        cut = recut(laid, self.brief) if self.near(moved) else None
        return cut if cut is not None and self.at_edges(cut) else None

    def near(self, moved: FloatArray) -> bool:
        """Return whether no vertex is moved far."""
        return _most(moved) <= _MOVED * self.joined.woven.size_mm

    def is_near(self, off: FloatArray) -> bool:
        """Return whether an object is as near to its aim as it need be."""
        size_mm = self.joined.woven.size_mm
        return _most(off) <= BOUND * size_mm and _mean(off) <= _NEAR * size_mm

    def stepped(self, moved: FloatArray, off: FloatArray, missed: FloatArray) -> _Moved | None:
        """Return an object that is off less and less, as foretold, and how its vertices moved."""
        best = None
        for number in range(_STEPS):
            self.progress("form", number, _STEPS)
            step = self.kept(moved, -self.at_vertices(off))
            if step is None:
                break
            moved = moved + step[1]
            before, off = off, self.foretold(step[0]) + missed
            if _mean(off) > (1.0 - _LITTLE) * _mean(before):
                break
            best = step[0], moved
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

    def off(self, joined: JoinedObject) -> tuple[FloatArray, tuple[Relaxed, ...]]:
        """Return how far crossings rest from where they are wished, (X, 3), and how bodies came."""
        body = self.body(joined)
        places, came = np.zeros_like(body.places), []
        for part, own in zip(body.parts, body.bodies, strict=True):
            rests = let_go(part, self.pins[own], _ABOUT_REST)
            end = in_the_end(part, rests, _ABOUT_REST)
            places[own] = end.state.bodies.origin
            came.append(rests.came)
        return off_by(body, places), tuple(came)

    def foretold(self, joined: JoinedObject) -> FloatArray:
        """Return the same to first order."""
        body = self.body(joined)
        places = body.places + Foresight(body).moves(self.pins)
        return off_by(body, places)

    @cached_property
    def drawn(self) -> Broken:
        """Where rules are broken as it is drawn."""
        return Broken(self.check(self.joined.woven, Depth.NEAR), self.joined.woven)

    @cached_property
    def keeper(self) -> RuleKeeper:
        """What makes up for places that would be worse than they were."""
        woven = self.joined.woven
        beside = _crossings_between(woven)
        return RuleKeeper(woven, self.drawn, self.along, beside, self.symmetric)

    def kept(self, moved: FloatArray, step: FloatArray) -> _Moved | None:
        """Return an object whose vertices are moved on by a step, and how far they are, (V, 3).

        The step is corrected where places would be worse than they were, and made shorter at last,
        or where that does not help; None if neither does.
        """
        for number in range(_TRIES):
            there = self.moved(moved + step)
            broken = self.along(there)
            if broken.no_more_than(self.drawn):
                laid = relaid(self.joined, there, self.brief)
                broken = Broken(self.check(laid.woven, Depth.NEAR), laid.woven)
                if broken.no_more_than(self.drawn):
                    return laid, step
            correction = self.keeper.correction(there, broken)
            step = step + correction
            if number >= _TRIES // 2 or not correction.any():
                step = _SHORTER * step
        return None

    def moved(self, moved: FloatArray) -> PolyMesh:
        """Return the mesh with its vertices moved."""
        mesh = self.joined.woven.mesh
        return mesh.with_vertices(mesh.vertices + moved)

    def along(self, mesh: PolyMesh) -> Broken:
        """Return where rules of each ribbon by itself are broken, if it is laid on a mesh."""
        woven, supplies = self.joined.woven, self.brief.supplies
        source = replace(woven.source, mesh=mesh)
        factor = None if woven.narrowed is None else woven.narrowed.factor
        thickness = supplies.thickness_mm(woven.bunches)
        ribbons = lay_ribbons(
            source, woven.weave, self.brief.ribbons, thickness, woven.laps, factor
        )
        laid = replace(woven, source=source, ribbons=ribbons, narrowed=None)
        return Broken(self.check(laid, Depth.ALONG), laid)

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


def _most(off: FloatArray) -> float:
    """Return the length of the longest of vectors."""
    return float(np.linalg.norm(off, axis=1).max())


def _mean(off: FloatArray) -> float:
    """Return the root mean square of vectors."""
    return float(np.sqrt((off**2).sum(axis=1).mean()))
