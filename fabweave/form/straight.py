"""Lay ribbons that unfold to straight strips of one width, as near to a mesh as they come.

A straight strip in space is what a hand weaver has: it bends and twists, and does not turn in its
own plane. Where strips cross is left to them. So a net is let go whose strips resist turning most
and whose spans may be as long as they like, while its crossings are drawn to the mesh. What it
comes to is nearly straight, and the nearest ribbons that unfold exactly are then found by Newton's
method.
"""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    flags,
    frozen,
    frozen_value,
    no_progress,
    unit,
)
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.form.body import MOST_CROSSINGS, elastic_threads
from fabweave.form.net import Net, NetState, cut_inner, end_frames, strains
from fabweave.form.products import Products
from fabweave.form.relax import relax
from fabweave.form.screw import Frames
from fabweave.form.woven_net import woven_net
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import face_centres
from fabweave.mesh.triangulate import plain_triangles
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.measures import panel_widths
from fabweave.ribbon.project import Ribbons, better_diagonals, crossing_heights, following_rung
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.ribbon.settings import RibbonSettings
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.supplies import Supplies
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.symmetry import WeaveSymmetry, find_weave_symmetry
from fabweave.weave.weave_mesh import WovenMesh

#: What strips resist stretch and turning in their plane with, as shares of what they do; and how
#: crossings are drawn to the mesh, as a share of what a span resists being bent with.
_STRETCH, _TURN, _DRAWN = 1e-3, 100.0, 12.0
#: Where a strip would miss the edge that it crosses, it is drawn so many times as much, so often.
_HARDER, _PULLS = 8.0, 3
#: Beside that, so much of the way along the mesh to where a crossing was.
_ALONG = 0.05
#: Rounds at most in which closest points are found anew, and motion that is none, of the size.
_ROUNDS, _STILL = 15, 2e-4
_GAIN = 1e-5
#: No span gets longer or shorter than so many times what it was on the mesh.
_SLIDE = 1.3
#: Spans have so much of the room that their panels want, or push; so many times more than others
#: pull.
_ROOM, _PUSH = 0.9, 10.0
#: Crossings open to this angle, with so many times what a span resists being bent with.
_SHARP, _OPEN = np.pi / 3, 5.0
#: Panels resist so many times more.
_RIGID = 4.0
#: A panel reaches so far beyond what it crosses, and over so much of the shorter span at most.
_BEYOND, _REACH = 1.05, 0.36
#: Strips are as wide as this share of all crossings have room for, if nobody says.
_ROOMY = 0.05
#: Where they come too near to one another, narrower ones are tried, so often at most.
_NARROWER, _TRIES = 0.93, 8
#: Ribbons are exact to this share of their width; in so many steps at most.
_EXACT, _STEPS = 1e-11, 25
#: Crossings lie no farther from the middle of their quad than this share of its size.
_PLACE = 0.2


def straightened(
    woven: WovenObject,
    settings: RibbonSettings,
    supplies: Supplies,
    progress: Progress = no_progress,
) -> WovenObject:
    """Return an object whose ribbons unfold to straight strips of one width.

    Parameters
    ----------
    woven : WovenObject
        As it would be cut from wavy strips.
    settings : RibbonSettings
        The width that is asked for in millimetres is that of all strips; else it is what all but a
        few crossings have room for.
    supplies : Supplies
    progress : callable

    Raises
    ------
    CannotMakeError
        If threads turn back at a boundary, or no straight strips are found near the mesh.
    """
    weave, threads = woven.weave, woven.weave.threads
    if len(threads.turn_pass):
        raise CannotMakeError(
            "straight strips cannot turn back at a boundary: use --boundary end, or --strips wavy"
        )
    if threads.n_crossings > MOST_CROSSINGS:
        raise CannotMakeError(
            f"straight strips are found for at most {MOST_CROSSINGS:,} crossings, and here are "
            f"{threads.n_crossings:,}: use a coarser mesh (--remesh triangles:N), or --strips wavy"
        )
    thickness = supplies.thickness_mm(woven.bunches)
    height = crossing_heights(weave, thickness, settings.clearance_mm)
    width, tries = settings.width_rule.most_mm, 1
    if not np.isfinite(width):
        width, tries = float(np.quantile(panel_widths(woven.ribbons).min(axis=1), _ROOMY)), _TRIES
    limits = thread_limits(supplies, woven.bunches, settings.clearance_mm)
    following = following_rung(threads.offsets, threads.closed)
    first = np.flatnonzero(following >= 0)
    if not len(first):
        raise CannotMakeError(
            "each strip crosses one other only: a finer mesh would help, or --strips wavy"
        )
    spans = _Spans(first, following[first], width)
    surface = Surface(*plain_triangles(woven.mesh))
    motions = find_weave_symmetry(woven.mesh, woven.halfedges, weave)
    with threadpool_limits(limits=1, user_api="blas"):
        materials, bare = elastic_threads(supplies, woven.bunches), np.zeros(threads.n_crossings)
        net, state = woven_net(woven.ribbons, weave, thickness, materials, bare)
        net, pull = _straight(net, height), np.full(threads.n_crossings, _DRAWN)
        for _ in range(_PULLS):
            drawn = _drawn(net, state, spans, pull, weave, surface, motions, progress)
            for number in range(tries):
                wide = width * _NARROWER**number
                ribbons = _laid(woven.ribbons, weave, spans, *drawn, wide)
                ribbons = _exact(ribbons, weave, wide, height)
                if not len(measure_clearance(ribbons, weave, limits)[0].value):
                    break
            astray = _astray(woven, ribbons)
            if not astray.any():
                return replace(woven, ribbons=ribbons, straight=True)
            pull[astray] *= _HARDER
    raise CannotMakeError(
        "straight strips miss the edges of the mesh at "
        f"{agree(int(np.count_nonzero(astray)), '{n} crossing[|s]')}: a finer mesh, a smoother one "
        "(--fair) or triangles would help, or --strips wavy"
    )


def _astray(woven: WovenMesh, ribbons: Ribbons) -> BoolArray:
    """Return at which crossings a ribbon does not run as its thread does, there and outside, (X,).

    It comes from the face that its thread comes from and goes to the one beyond, from the left or
    from the right, and looks outward; and both lie near the middle of the crossing's quad.
    """
    threads, halfedges = woven.weave.threads, woven.halfedges
    vertices, centres = woven.mesh.vertices, face_centres(woven.mesh)
    other = halfedges.twin[threads.halfedge]
    tail, head = vertices[halfedges.tail[threads.halfedge]], vertices[halfedges.tail[other]]
    here, there = centres[halfedges.face[threads.halfedge]], centres[halfedges.face[other]]
    edge, beyond = head - tail, there - here
    inward = np.cross(edge, beyond)
    middle = (ribbons.right + ribbons.left) / 2.0
    way = middle[ribbons.entry + 1] - middle[ribbons.entry]

    def turn(first: FloatArray, second: FloatArray) -> FloatArray:
        return np.einsum("pd,pd->p", np.cross(first, second), inward)

    sides = [ribbons.left[at] - ribbons.right[at] for at in (ribbons.entry, ribbons.entry + 1)]
    kept = turn(edge, way) > 0.0
    kept &= (turn(way, beyond) > 0.0) == threads.forward
    kept &= np.all([turn(way, side) < 0.0 for side in sides], axis=0)
    corners = np.stack([tail, here, head, there])
    size = np.linalg.norm(corners - corners.mean(axis=0), axis=2).sum(axis=0)
    off = np.linalg.norm(ribbons.centre[threads.crossing] - corners.mean(axis=0), axis=1)
    kept &= off <= _PLACE * size
    return flags(threads.n_crossings, threads.crossing[~kept])


@frozen_value
class _Spans:
    """Spans of straight strips: from the middle of one panel to its end, and on to the next one.

    Parameters
    ----------
    first, second : (S,) int arrays
        The passes between which each leads.
    width : float
    """

    first: IntArray
    second: IntArray
    width: float

    def reach(self, angle: FloatArray, length: FloatArray) -> FloatArray:
        """Return how far panels reach from their middles, (P,), which lie on one another.

        ``angle``, (P,), is that between the strands at each pass; ``length``, (S,), of spans.
        """
        shorter = np.full(len(angle), np.inf)
        np.minimum.at(shorter, np.concatenate([self.first, self.second]), np.tile(length, 2))
        return np.minimum(self._shared(angle), _REACH * shorter)

    def room(self, angle: FloatArray) -> FloatArray:
        """Return how long spans must be, (S,), for both of the panels on them."""
        shared = self._shared(angle)
        return np.asarray(_ROOM * np.maximum(shared[self.first], shared[self.second]) / _REACH)

    def _shared(self, angle: FloatArray) -> FloatArray:
        """Return how far from their middles panels lie on one another, and a little more, (P,)."""
        sine = np.maximum(np.abs(np.sin(angle)), 1e-3)
        return np.asarray(self.width / 2 * (_BEYOND + np.abs(np.cos(angle))) / sine)

    def rest(self, reach: FloatArray, between: FloatArray) -> FloatArray:
        """Return the twists of straight spans, (S, 4, 6): panel, half of what is between, twice."""
        rest = np.zeros((len(between), 4, 6))
        rest[..., 0] = np.stack(
            [reach[self.first], between / 2, between / 2, reach[self.second]], 1
        )
        return rest


def _straight(net: Net, height: FloatArray) -> Net:
    """Return a net whose strips are straight, weigh nothing, and lie flat on one another."""
    offset = np.zeros_like(net.at.origin)
    offset[:, 2] = np.where(net.turns.T.ravel() >= 0, -1.0, 1.0) * height[net.ends.T.ravel()]
    stiffness = net.stiffness * [_STRETCH, _TURN, 1.0, 1.0, 1.0, _TURN]
    stiffness[:, [0, 3]] = net.stiffness[:, [0, 3]] * _RIGID
    at = Frames(offset, net.at.axes)
    return replace(net, at=at, stiffness=stiffness, weight=np.zeros_like(net.weight))


def _drawn(
    net: Net,
    state: NetState,
    spans: _Spans,
    pull: FloatArray,
    weave: Weave,
    surface: Surface,
    motions: WeaveSymmetry,
    progress: Progress,
) -> tuple[Net, NetState]:
    """Return the net, its spans as long as they came to be, and its state when drawn to the mesh.

    Strips that resist no stretch are taken to be as long as they are, time and again: so crossings
    go along them to where nothing pulls. Only where strips would be in each other's way, spans push
    and sharp crossings open.
    """
    start, crossing = state.bodies.origin, weave.threads.crossing
    size = float(np.ptp(start, axis=0).max())
    group, images = motions.group, motions.crossing_images(np.arange(len(start)))
    length = first = np.linalg.norm(net.rest[..., :3], axis=2).sum(axis=1)
    bending = float(np.median(net.stiffness[:, 1, 4]))
    held = np.tile(pull[:, None] * bending / np.median(length) ** 2, 3)
    push = net.stiffness * [_PUSH, 1.0, 1.0, 1.0, 1.0, 1.0]
    tight = np.zeros(len(length), dtype=np.bool_)
    for number in range(_ROUNDS):
        progress("straight strips", number, _ROUNDS)
        reach = spans.reach(state.angles[crossing], length)
        between = length - reach[spans.first] - reach[spans.second]
        before = state.bodies.origin
        foot = surface.feet(before)
        back = start - foot.points
        back -= np.einsum("nd,nd->n", back, foot.normals)[:, None] * foot.normals
        # On either side of a hollow edge a foot is as near: of all that are alike, the mean counts.
        place = (foot.points + _ALONG * back)[images] - group.centre
        place = np.einsum("gni,gij->nj", place, group.matrix) / group.order + group.centre
        sharp = state.angles % np.pi
        opened = np.clip(sharp, _SHARP, np.pi - _SHARP) - sharp
        net = replace(
            net,
            rest=spans.rest(reach, between),
            stiffness=np.where(tight[:, None, None], push, net.stiffness),
            pins=np.where(opened == 0.0, 0.0, _OPEN * bending),
            rest_angles=state.angles + opened,
            held=held,
            place=place,
        )
        if not number:
            state = cut_inner(net, state.bodies, state.angles)
        state = relax(net, state, gain=_GAIN).state
        length = np.linalg.norm(strains(net, state)[0][..., :3], axis=2).sum(axis=1)
        room = spans.room(state.angles[crossing])
        tight |= length < room
        length = np.clip(np.maximum(length, room), first / _SLIDE, first * _SLIDE)
        moved = np.linalg.norm(state.bodies.origin - before, axis=1)
        if moved.max() <= _STILL * size:
            break
    return net, state


def _laid(
    ribbons: Ribbons, weave: Weave, spans: _Spans, net: Net, state: NetState, width: float
) -> Ribbons:
    """Return ribbons of one width along the strips of a net, with the rungs of others."""
    threads = weave.threads
    count = len(threads.crossing)
    _, ends = end_frames(net, state.bodies, state.angles)
    passes = np.concatenate([spans.first, spans.second])
    # Each pass has the frame of a span that ends there.
    of_pass, reach = np.zeros(count, dtype=np.int64), np.zeros(count)
    of_pass[passes] = np.arange(len(passes))
    reach[passes] = net.rest[:, [0, 3], 0].T.ravel()
    frames = ends[of_pass]
    right, left = np.zeros_like(ribbons.right), np.zeros_like(ribbons.left)

    def lay(rungs: IntArray, at: Frames, along: FloatArray) -> None:
        middle = at.origin + along[:, None] * at.axes[..., 0]
        half = width / 2 * at.axes[..., 1]
        right[rungs], left[rungs] = middle - half, middle + half

    lay(ribbons.entry, frames, -reach)
    lay(ribbons.entry + 1, frames, reach)
    twist = strains(net, state)[0]
    size = np.diff(ribbons.offsets)[threads.thread_of_pass[spans.first]]
    rungs = (ribbons.entry[spans.second] - ribbons.entry[spans.first] - 2) % size
    steps = int(rungs.max(initial=0))
    inner = 3 * np.arange(len(spans.first))
    for number in range(1, steps + 1):
        share = 2.0 * number / (steps + 1)
        half = int(share >= 1.0)
        part = state.inner[inner + half].moved((share - half) * twist[:, 1 + half])
        lay(ribbons.entry[spans.first] + 1 + number, part, np.zeros(len(inner)))

    # The ends of open strips go on straight, as far as they did.
    middle = (ribbons.right + ribbons.left) / 2
    open_threads = np.flatnonzero(~threads.closed & threads.woven)
    for passed, rungs, way in (
        (threads.offsets[open_threads], ribbons.offsets[open_threads], -1.0),
        (threads.offsets[open_threads + 1] - 1, ribbons.offsets[open_threads + 1] - 1, 1.0),
    ):
        panel = ribbons.entry[passed]
        far = np.linalg.norm((middle[panel] + middle[panel + 1]) / 2 - middle[rungs], axis=1)
        lay(rungs, frames[passed], way * np.maximum(far, _BEYOND * reach[passed]))
    after = following_rung(ribbons.offsets, ribbons.closed)
    return replace(
        ribbons,
        right=right,
        left=left,
        from_right=better_diagonals(right, left, after),
        normal=frozen(np.ascontiguousarray(state.bodies.axes[:, :, 2])),
        centre=frozen(state.bodies.origin),
    )


def _exact_conditions(ribbons: Ribbons, weave: Weave, width: float, height: FloatArray) -> Products:
    """Return the conditions under which ribbons unfold to straight strips that lie on each other.

    Between two rungs both rails are as long, and the diagonal at which the quad folds is that of a
    rectangle; at a crossing, the middles of both panels are apart along the normal of both.
    """
    following = following_rung(ribbons.offsets, ribbons.closed)
    here = np.flatnonzero(following >= 0)
    after = following[here]
    points = sp.csr_array(sp.eye_array(2 * ribbons.n_rungs))
    right, left = points[: ribbons.n_rungs], points[ribbons.n_rungs :]
    rung = sp.csr_array(left - right)
    ahead, beside = right[after] - right[here], left[after] - left[here]
    # The side of each quad at which its diagonal begins, and that at whose rail it ends.
    start = sp.diags_array(ribbons.from_right[here].astype(np.float64))
    other = sp.eye_array(len(here)) - start
    across = start @ rung[after] - other @ rung[after]
    beyond = right[after] + left[after] - 2.0 * (start @ right[here] + other @ left[here])

    upper, lower = (ribbons.entry[at] for at in strand_passes(weave).T[::-1])
    middle = sp.csr_array((right + left) / 2.0)
    apart = middle[upper] + middle[upper + 1] - middle[lower] - middle[lower + 1]
    flat = [
        one
        for at in (upper, lower)
        for one in (rung[at], rung[at + 1], middle[at + 1] - middle[at])
    ]
    wide, level, high = (
        np.full(len(here), width**2), np.tile(height * width, len(flat)), 16.0 * height**2,
    )  # fmt: skip
    rungs = np.full(ribbons.n_rungs, width**2)
    return Products(
        first=sp.csr_array(sp.vstack([ahead - beside, across, rung, *[apart] * len(flat), apart])),
        second=sp.csr_array(sp.vstack([ahead + beside, beyond, rung, *flat, apart])),
        wanted=np.concatenate([0.0 * wide, wide, rungs, 0.0 * level, high]),
        scale=np.concatenate([wide, wide, rungs, level, high]),
    )


def _exact(ribbons: Ribbons, weave: Weave, width: float, height: FloatArray) -> Ribbons:
    """Return the nearest ribbons that unfold exactly to straight strips of a width."""
    conditions = _exact_conditions(ribbons, weave, width, height)
    points = np.concatenate([ribbons.right, ribbons.left])
    points, off = conditions.nearest(points, exact=_EXACT, steps=_STEPS)
    if not off <= _EXACT:
        raise CannotMakeError(
            "no straight strips are found near this mesh: a finer mesh, a smaller --width or a "
            "smoother mesh (--fair) would help, or --strips wavy"
        )
    right, left = (side.copy() for side in np.split(points, 2))
    upper, lower = (ribbons.entry[at] for at in strand_passes(weave).T[::-1])
    middle = (right + left) / 2.0
    above, below = ((middle[at] + middle[at + 1]) / 2.0 for at in (upper, lower))
    return replace(
        ribbons,
        right=frozen(right),
        left=frozen(left),
        centre=frozen((above + below) / 2.0),
        normal=frozen(unit(above - below)),
    )
