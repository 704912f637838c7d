"""A woven object as an elastic body: what its strips resist, where it stands, what it carries."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value, offsets_of
from fabweave.form.net import Net, NetState
from fabweave.form.screw import Frames
from fabweave.form.woven_net import GRAVITY, Elastic, woven_net
from fabweave.mesh.automorphisms import best_motions
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import label_links
from fabweave.piece.brief import Brief
from fabweave.piece.joint.fastening import (
    foot_crossings,
    hanging_crossings,
    parse_hanging,
    parse_load,
)
from fabweave.ribbon.aim import Aim
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import following_rung
from fabweave.stock.material import Material, min_bend_radius_mm
from fabweave.stock.supplies import Supplies

#: How a crossing resists turning, N mm per radian: strips that only lie on one another, one
#: fastener, and two or more of them. Estimates: friction scatters by as much as these differ.
BARE, PINNED, RIVETED = 1.0, 25.0, 10_000.0
#: Young's modulus of what it is not known of, N/mm², that of card; and Poisson's ratio.
YOUNG, POISSON = 3000.0, 0.3
#: Objects of more crossings are not let go: it would take more than three minutes.
MOST_CROSSINGS = 10_000
#: An object stands on what is no higher than this share of its size, three crossings at least.
_FOOT = 0.02
#: How stiff is what an object stands on or hangs from, N/mm at each crossing.
HELD_N_MM = 1000.0


@frozen_value
class ElasticBody:
    """A woven object as an elastic net, as it is wished for.

    Parameters
    ----------
    mesh : PolyMesh
        As it is to be in the end; z points up.
    materials : sequence of Elastic
        Of each thread.
    thickness_mm : (T,) float array
    net : Net
        Of bare crossings, and with its own weight.
    wished : NetState
        In which it is as it is drawn.
    strain : (S,) float array
        How far the material of each span is stretched where it bends as tightly as it may.
    turning_nmm : (float, float)
        How a crossing resists turning, bare and with one fastener, N mm per radian.
    load : (X, 3) float array
        What it carries, N.
    hung : (X,) bool array
        The crossings that it hangs from or stands on; all false where that is not asked for.
    faces : (X, 2) int array
        The faces of the mesh on both sides of each crossing.
    straight : bool
        Whether its strips are straight, so that it is wished for beside the mesh, not on it.
    air_mm : float or None
        How high above all that stands its lowest place is, if it is one of several bodies and
        stands on nothing.
    aim : Aim or None
        What it is to settle onto, where that is not what is woven.
    based : bool
        Whether it is fastened to a base at the crossings that it stands on: these stay where they
        are wished.
    """

    mesh: PolyMesh
    materials: Sequence[Elastic]
    thickness_mm: FloatArray
    net: Net
    wished: NetState
    strain: FloatArray
    turning_nmm: tuple[float, float]
    load: FloatArray
    hung: BoolArray
    faces: IntArray
    straight: bool = False
    air_mm: float | None = None
    aim: Aim | None = None
    based: bool = False

    @property
    def size_mm(self) -> float:
        """The largest extent of what it is wished to be."""
        return float(np.ptp(self.mesh.vertices, axis=0).max())

    @property
    def places(self) -> FloatArray:
        """Where its crossings are drawn, (X, 3)."""
        return self.wished.bodies.origin

    @property
    def target(self) -> FloatArray:
        """Where its crossings are wished to be when it has settled, (X, 3)."""
        return self.places if self.aim is None else self.aim.places

    def pins(self, fastened: BoolArray, riveted: IntArray) -> FloatArray:
        """Return how crossings resist turning, (X,): ``riveted`` have two fasteners or more."""
        bare, one = self.turning_nmm
        pins = np.where(fastened, one, bare)
        pins[riveted] = RIVETED
        return pins

    def held(self, places: FloatArray) -> BoolArray:
        """Return at which crossings it is held, (X,): those it is to hang from, or the lowest.

        Of several bodies, each is held by itself.
        """
        at = self.hung.copy()
        for own in self.bodies:
            if not at[own].any():
                height = places[own, 2] - places[own, 2].min()
                size_mm = float(np.ptp(self._own_mesh(own).vertices, axis=0).max())
                low = int(np.count_nonzero(height <= _FOOT * size_mm))
                at[own[np.argsort(height, kind="stable")[: max(3, low)]]] = True
        return at

    @cached_property
    def bodies(self) -> tuple[IntArray, ...]:
        """The crossings of each body that is joined by strips; those that none joins are of all."""
        count = len(self.places)
        label = label_links(self.net.ends[:, 0], self.net.ends[:, 1], count)[1]
        numbers = np.unique(label[self.net.ends[:, 0]])
        if len(numbers) < 2:
            return (np.arange(count),)
        return tuple(np.flatnonzero(label == number) for number in numbers)

    @property
    def loose(self) -> tuple[IntArray, ...]:
        """The crossings of each body that is not fastened to a base."""
        return tuple(own for own in self.bodies if not (self.based and self.hung[own].any()))

    def _own_mesh(self, own: IntArray) -> PolyMesh:
        """Return the part of the mesh beside the crossings of a body."""
        mesh = self.mesh
        if len(self.bodies) == 1:
            return mesh
        faces = flags(mesh.n_faces, self.faces[own].ravel())
        corners = mesh.indices[np.repeat(faces, mesh.face_sizes)]
        used, indices = np.unique(corners, return_inverse=True)
        return PolyMesh(mesh.vertices[used], offsets_of(mesh.face_sizes[faces]), indices)

    @property
    def parts(self) -> "tuple[ElasticBody, ...]":
        """Each of its bodies by itself; it alone where it is one."""
        return (self,) if len(self.bodies) == 1 else tuple(map(self._part, self.bodies))

    def _part(self, own: IntArray) -> "ElasticBody":
        """Return the body of some crossings by itself."""
        net, wished, aim = self.net, self.wished, self.aim
        place = np.full(len(self.places), -1)
        place[own] = np.arange(len(own))
        spans = self.spans_of(own)
        inner = self.inner_of(own)
        turns = net.turns[spans]
        mesh = self._own_mesh(own)
        air_mm = float(mesh.vertices[:, 2].min() - self.mesh.vertices[:, 2].min())
        hangs = bool(self.hung[own].any()) or air_mm <= _FOOT * self.size_mm
        return replace(
            self,
            mesh=mesh,
            net=Net(
                ends=place[net.ends[spans]],
                at=net.at[np.concatenate([spans, len(net.ends) + spans])],
                turns=np.where(turns >= 0, place[turns], -1),
                rest=net.rest[spans],
                stiffness=net.stiffness[spans],
                **{
                    name: getattr(net, name)[own]
                    for name in ("pins", "rest_angles", "weight", "held", "place", "fixed")
                },
            ),
            wished=NetState(wished.bodies[own], wished.angles[own], wished.inner[inner]),
            strain=self.strain[spans],
            load=self.load[own],
            hung=self.hung[own],
            based=self.based and bool(self.hung[own].any()),
            faces=np.zeros((len(own), 2), dtype=np.int64),
            air_mm=None if hangs else air_mm,
            aim=None if aim is None else aim.part(own, mesh),
        )

    def spans_of(self, own: IntArray) -> IntArray:
        """Return the spans of a body's crossings."""
        return np.flatnonzero(flags(len(self.places), own)[self.net.ends[:, 0]])

    def inner_of(self, own: IntArray) -> IntArray:
        """Return which frames between the pieces of spans are of a body's crossings."""
        inner = self.net.rest.shape[1] - 1
        return np.asarray((inner * self.spans_of(own)[:, None] + np.arange(inner)).ravel())


def body_of(woven: WovenObject, brief: Brief) -> ElasticBody | None:
    """Return a woven object as an elastic body; None where it would take minutes to let it go.

    Parameters
    ----------
    woven : WovenObject
    brief : Brief
        Complete: with what it is cut from, hangs from and carries.
    """
    count = woven.weave.threads.n_crossings
    if not 3 <= count <= MOST_CROSSINGS:
        return None
    supplies, asked = brief.supplies, brief.pieces
    materials = elastic_threads(supplies, woven.bunches)
    thickness = supplies.thickness_mm(woven.bunches)
    bare = np.full(count, BARE)
    net, wished = woven_net(woven.ribbons, woven.weave, thickness, materials, bare)
    radius = np.array([min_bend_radius_mm(one.material) for one in supplies.each])
    threads = woven.weave.threads
    spans = threads.thread_of_pass[following_rung(threads.offsets, threads.closed) >= 0]
    strain = thickness / (2 * radius[supplies.of(woven.bunches)])
    # The more slippery of two counts.
    each = [one.material.turning_nmm or (BARE, PINNED) for one in supplies.each]
    turning = min(bare for bare, _ in each), min(one for _, one in each)
    edge = threads.crossing_halfedge
    beside = np.stack([edge, woven.halfedges.twin[edge]], axis=1)
    faces = woven.halfedges.face[beside]
    hung, load = np.zeros(count, dtype=np.bool_), np.zeros((count, 3))
    if asked.hang is not None:
        hung = hanging_crossings(parse_hanging(asked.hang), wished.bodies.origin)
    based = asked.base == "on"
    if based:
        hung = foot_crossings(threads, woven.halfedges, woven.wished)
    if asked.load is not None:
        mass_kg, where = parse_load(asked.load)
        at = hanging_crossings(where, wished.bodies.origin)
        load[at, 2] = -GRAVITY * mass_kg / np.count_nonzero(at)
    return ElasticBody(
        woven.wished, materials, thickness, net, wished, strain[spans], turning, load, hung, faces,
        woven.straight, aim=woven.aim, based=based,
    )  # fmt: skip


def elastic(material: Material, *, grain: bool) -> Elastic:
    """Return what a material resists with: as card does, where that is not known of it.

    Parameters
    ----------
    material : Material
    grain : bool
        Whether strips lie along its grain, or across where it is laid so; else every way.
    """
    along, across = material.young_mpa or (YOUNG, YOUNG)
    own = across if material.laid_across else along
    young = own if grain else float(np.sqrt(along * across))
    poisson = POISSON if material.poisson is None else material.poisson
    return Elastic(young, poisson, material.density_kg_m3)


def elastic_threads(supplies: Supplies, bunches: IntArray) -> Sequence[Elastic]:
    """Return what each thread resists with, as :func:`elastic` says it of its material."""
    grain = supplies.rotations.startswith(("grain", "across"))
    each = [elastic(supply.material, grain=grain) for supply in supplies.each]
    return [each[at] for at in supplies.of(bunches).tolist()]


def rigid_motions(places: FloatArray) -> FloatArray:
    """Return how places go if all of them move as one, a column each, (3 N, 6), orthonormal.

    Examples
    --------
    >>> rigid_motions(np.eye(3)).shape
    (9, 6)
    """
    motions = np.zeros((len(places), 3, 6))
    motions[:, :, :3] = np.eye(3)
    middle = places - places.mean(axis=0)
    motions[:, :, 3:] = np.swapaxes(np.cross(np.eye(3)[None], middle[:, None]), 1, 2)
    return np.linalg.qr(motions.reshape(-1, 6))[0]


def fitted(state: NetState, to: FloatArray) -> NetState:
    """Return a state after the rigid motion that brings its bodies nearest to places, (B, 3)."""
    middle, there, turn = _nearest_motion(state.bodies.origin, to)

    def moved(frames: Frames) -> Frames:
        return Frames((frames.origin - middle) @ turn.T + there, turn @ frames.axes)

    return NetState(moved(state.bodies), state.angles, moved(state.inner))


def off_places(places: FloatArray, to: FloatArray) -> FloatArray:
    """Return how places are off others, (N, 3), after the motion that brings them nearest."""
    middle, there, turn = _nearest_motion(places, to)
    return np.asarray((places - middle) @ turn.T + there - to)


def _nearest_motion(places: FloatArray, to: FloatArray) -> tuple[FloatArray, ...]:
    """Return the middles of places and of others, and the turn that brings those to these."""
    middle, there = places.mean(axis=0), to.mean(axis=0)
    return middle, there, best_motions(places - middle, to - there, mirrors=False)


def off_by(body: ElasticBody, places: FloatArray) -> FloatArray:
    """Return how places are off those wished, (X, 3), each body where it fits best, or is based."""
    off = places - body.target
    for own in body.loose:
        off[own] = off_places(places[own], body.target[own])
    return off


def standing(net: Net, held: BoolArray, places: FloatArray) -> Net:
    """Return a net that is held at some of its bodies, (B,), where they are, (B, 3)."""
    return replace(net, held=np.repeat(held[:, None] * HELD_N_MM, 3, axis=1), place=places)
