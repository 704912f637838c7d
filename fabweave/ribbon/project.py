"""Project threads to ribbons: the projection method, with real material thickness."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.boundary_turns import RUNGS_A_TURN, turn_rungs
from fabweave.ribbon.portal_windows import meet_strands, portal_middles, portal_windows
from fabweave.ribbon.width import WidthRule, shares_of
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

#: The diagonals of a crossing's quad divide each other in shares not less than this.
_INSIDE = 0.1
#: They are moved apart by no more than this share of the longer one.
_FARTHEST = 0.5


@frozen_value
class Ribbons:
    """Ribbons in space as chains of *rungs*, the cross-lines from the right to the left rail.

    Between neighbouring rungs lies one quad: a planar crossing panel, half of a planar turning
    panel, or a connector that is folded along one of its diagonals. A closed ribbon goes on from
    its last rung to its first.

    Parameters
    ----------
    offsets : (T + 1,) int array
        Thread ``t`` owns the rungs ``offsets[t]:offsets[t + 1]``; none if it has no crossing.
    right, left : (R, 3) float arrays
        End points of each rung; right and left of the walking direction, seen from outside.
    from_right : (R,) bool array
        For the quad that follows each rung: whether its diagonal starts at the right rail.
    pass_offsets : (T + 1,) int array
        Thread ``t`` makes the passes ``pass_offsets[t]:pass_offsets[t + 1]``.
    entry : (P,) int array
        The rung where each pass enters its crossing panel; it leaves by the following rung.
    closed : (T,) bool array
        Whether the ribbon is a ring.
    normal : (X, 3) float array
        Outward unit normal at each crossing.
    centre : (X, 3) float array
        The point on the surface at each crossing, between the two panels.
    """

    offsets: IntArray
    right: FloatArray
    left: FloatArray
    from_right: BoolArray
    pass_offsets: IntArray
    entry: IntArray
    closed: BoolArray
    normal: FloatArray
    centre: FloatArray

    @property
    def n_rungs(self) -> int:
        """Number of rungs."""
        return len(self.right)


@frozen_value
class _CrossingQuads:
    """The quad (tail, right centre, head, left centre) of each crossing, flattened."""

    corners: FloatArray  # (X, 4, 3)
    normal: FloatArray
    centre: FloatArray


def project_ribbons(
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    *,
    height_mm: float | FloatArray,
    length: float = 0.7,
    width: float | WidthRule | FloatArray = 0.65,
    narrowing: FloatArray | None = None,
    portals: FloatArray | None = None,
) -> Ribbons:
    """Project every thread to a ribbon of planar facets that lies over or under the surface.

    Each crossing's edge owns the quad of its end vertices and the centres of its two faces. The
    quad is flattened to the plane through its middle and moved along the normal, outward for the
    strand above and inward for the one below. Each strand takes the bilinear sub-quad of the
    given relative length and width; connectors join consecutive panels. Where a thread turns back
    at a boundary edge, a planar panel leads it round in its face.

    Parameters
    ----------
    mesh, halfedges, weave
        A mesh, its connectivity, and the weave on it.
    height_mm : float or (X,) float array
        Distance of each strand's middle surface from the crossing's plane, at all crossings or at
        each: half a layer and half the clearance.
    length : float
        Relative length of a crossing panel along its strand (c of the paper), in (0, 1).
    width : float, WidthRule or (P,) float array
        Relative width of the ribbon across its strand (w of the paper), in (0, 1), a rule that
        bounds it in millimetres, or the width at each pass, in millimetres. No more than ``length``
        is taken anywhere, so connectors keep clear of the other strand's panel.
    narrowing : (P,) float array, optional
        Factor on the width at each pass, in (0, 1]; a turn has that of the pass before it.
    portals : (H,) float array, optional
        Where the middle of a strand crosses each portal, as a share of the way from the vertex to
        the face's centre: see :mod:`fabweave.mesh.portals`. The room of the strand is then the
        longest piece of the portal with that middle. By default half, and the whole portal.

    Returns
    -------
    Ribbons
        Two rungs for each pass, three for each turn; one more at each end of an open ribbon,
        where it leaves the last crossing's quad.

    Raises
    ------
    InputError
        If a crossing's quad or a turn's triangle has no area, so that it has no normal.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), projection method.
    """
    rule = WidthRule(width) if isinstance(width, float) else width
    relative = rule.relative if isinstance(rule, WidthRule) else length
    if not relative <= length < 1.0:
        raise InputError(
            f"relative width {relative:g} and crossing length {length:g} must satisfy "
            "0 < width <= length < 1: a ribbon wider than its panel is long runs into its neighbour"
        )
    threads = weave.threads
    quads = _crossing_quads(mesh, halfedges, threads.crossing_halfedge)
    corner = _travel_corners(weave)
    height = np.broadcast_to(height_mm, threads.n_crossings)[threads.crossing]
    height = np.where(weave.over, height, -height)
    lift = height[:, None] * quads.normal[threads.crossing]
    placed = np.take_along_axis(quads.corners[threads.crossing], corner[:, :, None], axis=1)
    most: FloatArray = np.full(len(threads.crossing), length)
    met, centre = np.full(len(threads.crossing), 0.5), quads.centre
    if portals is not None:
        middles = portal_middles(portals, halfedges, threads.crossing_halfedge)
        meeting = meet_strands(quads.corners, quads.normal, middles, length)
        most, centre = meeting.most[threads.crossing], meeting.point
        # Side 3 is where a strand enters that arrives forward along the first half-edge.
        first, second = meeting.along[threads.crossing].T
        met = np.where(threads.forward, first, second)
        met = np.where(corner[:, 3] >= 2, met, 1.0 - met)
        placed = portal_windows(
            placed, np.take_along_axis(middles[threads.crossing], corner[:, 1::2], axis=1)
        )
    placed = placed + lift[:, None, :]
    reach = length * np.minimum(met, 1.0 - met)

    factor = np.ones(len(threads.crossing)) if narrowing is None else narrowing
    offsets, entry = number_rungs(threads, 2, RUNGS_A_TURN)
    right, left = np.empty((offsets[-1], 3)), np.empty((offsets[-1], 3))
    every = np.arange(len(threads.crossing))

    def lay(rungs: IntArray, passes: IntArray, u: FloatArray) -> None:
        start, end = _rung_room(placed[passes], u)
        share = shares_of(rule, passes, np.linalg.norm(end - start, axis=1), most[passes])
        side = 0.5 - factor[passes, None] * share[:, None] / 2
        right[rungs], left[rungs] = start + side * (end - start), end + side * (start - end)

    for shift, u in ((0, met - reach), (1, met + reach)):
        lay(entry + shift, every, u)
    open_threads = np.flatnonzero(~threads.closed & threads.woven)
    for passes, rungs, u in (
        (threads.offsets[open_threads], offsets[open_threads], 0.0),
        (threads.offsets[open_threads + 1] - 1, offsets[open_threads + 1] - 1, 1.0),
    ):
        lay(rungs, passes, np.full(len(passes), u))
    if len(threads.turn_pass):
        first_turn = np.searchsorted(threads.turn_pass, threads.turn_pass)
        earlier = np.arange(len(first_turn)) - first_turn
        rungs = entry[threads.turn_pass] + 2 + RUNGS_A_TURN * earlier
        rungs = rungs[:, None] + np.arange(RUNGS_A_TURN)
        right[rungs], left[rungs] = turn_rungs(
            mesh, halfedges, threads, length=length, width=rule, narrowing=factor, portals=portals
        )

    return Ribbons(
        offsets=offsets,
        right=right,
        left=left,
        from_right=better_diagonals(right, left, following_rung(offsets, threads.closed)),
        pass_offsets=threads.offsets,
        entry=entry,
        closed=threads.closed,
        normal=quads.normal,
        centre=centre,
    )


def convex_quads(quads: FloatArray) -> FloatArray:
    """Move the diagonals of planar quads until they cross each other well inside both.

    Beside a sharp edge both face centres may come to lie on one side of it in the plane, and the
    quad would run through itself. Either diagonal moves by half of what is missing, along
    the quad's own directions, so that the quad's middle stays where it is. What is nearly folded
    flat on itself is moved only so far.

    Parameters
    ----------
    quads : (N, 4, 3) float array
        Corners of planar quads with some area; those that are well convex stay as they are.

    Returns
    -------
    (N, 4, 3) float array

    Examples
    --------
    >>> dart = np.array([[[0.0, 0, 0], [-3, 1, 0], [0, 4, 0], [-1, 1, 0]]])
    >>> convex_quads(dart)[0].round(3).tolist()
    [[-0.6, 0.0, 0.0], [-2.4, 1.0, 0.0], [-0.6, 4.0, 0.0], [-0.4, 1.0, 0.0]]
    """
    edge, across = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    area = np.cross(edge, across)
    size = _square(area)
    between = quads[:, 1] - quads[:, 0]
    shift = np.zeros((len(quads), 3))
    for sign, diagonal, other in ((1.0, edge, across), (-1.0, across, edge)):
        # Where along this diagonal's line the other one's line crosses it: 0 to 1 is inside.
        share = np.einsum("ij,ij->i", np.cross(sign * between, other), sign * area) / size
        beyond = share - np.clip(share, _INSIDE, 1 - _INSIDE)
        shift += sign * beyond[:, None] * diagonal
    most = _FARTHEST * np.sqrt(np.maximum(_square(edge), _square(across)))
    shift *= np.minimum(1.0, most / np.maximum(np.sqrt(_square(shift)), 1e-300))[:, None]
    moved = quads.copy()
    moved[:, 0::2] += shift[:, None] / 2
    moved[:, 1::2] -= shift[:, None] / 2
    return moved


def number_rungs(threads: Threads, a_pass: int, a_turn: int) -> tuple[IntArray, IntArray]:
    """Return where each thread's rungs start, (T + 1,), and where each pass enters, (P,).

    A pass has so many of them, and each turn after it so many more.
    """
    turns = np.bincount(threads.turn_pass, minlength=len(threads.crossing))
    pass_starts = offsets_of(a_pass + a_turn * turns)
    # An open thread has one rung more at either end.
    ends = np.where(threads.closed | ~threads.woven, 0, 2)
    offsets = offsets_of(
        pass_starts[threads.offsets[1:]] - pass_starts[threads.offsets[:-1]] + ends
    )
    shift = offsets[:-1] + ends // 2 - pass_starts[threads.offsets[:-1]]
    return offsets, pass_starts[:-1] + shift[threads.thread_of_pass]


def local_entry(ribbons: Ribbons, thread: IntArray, position: IntArray) -> IntArray:
    """Return where passes enter their panels, in rungs from the start of their threads.

    On a ring, a position past the last pass counts on around it, and so does the rung.
    """
    count = np.diff(ribbons.pass_offsets)[thread]
    first = ribbons.offsets[thread]
    size = ribbons.offsets[thread + 1] - first
    entry = ribbons.entry[ribbons.pass_offsets[thread] + position % count]
    return np.asarray(entry - first + size * (position // count))


def following_rung(offsets: IntArray, closed: BoolArray) -> IntArray:
    """Return the rung after each rung: the first again after a ring's last, -1 at an open end."""
    following = np.arange(1, offsets[-1] + 1)
    filled = np.diff(offsets) > 0
    last = offsets[1:][filled] - 1
    following[last] = np.where(closed[filled], offsets[:-1][filled], -1)
    return following


def _crossing_quads(mesh: PolyMesh, halfedges: Halfedges, crossing: IntArray) -> _CrossingQuads:
    """Flatten the quad of each crossing to the plane through its middle."""
    centres = face_centres(mesh)
    tail = mesh.vertices[halfedges.tail[crossing]]
    head = mesh.vertices[halfedges.head[crossing]]
    left = centres[halfedges.face[crossing]]
    right = centres[halfedges.face[halfedges.twin[crossing]]]
    area = np.cross(head - tail, left - right)
    size = np.linalg.norm(area, axis=1)
    reach = np.linalg.norm(head - tail, axis=1) ** 2 + np.linalg.norm(left - right, axis=1) ** 2
    flat = np.flatnonzero(~(size > 1e-9 * reach))
    if len(flat):
        pairs = ", ".join(
            f"{a}-{b}"
            for a, b in zip(
                halfedges.tail[crossing[flat[:4]]], halfedges.head[crossing[flat[:4]]], strict=True
            )
        )
        raise InputError(
            agree(len(flat), "{n} [edge has|edges have] no room for a crossing (between vertices ")
            + f"{pairs}): the faces on either side are folded flat onto each other or have no "
            "area; move their vertices apart"
        )
    normal = area / size[:, None]
    corners = np.stack((tail, right, head, left), axis=1)
    centre = corners.mean(axis=1)
    above = np.einsum("xcd,xd->xc", corners - centre[:, None, :], normal)
    flattened = corners - above[:, :, None] * normal[:, None, :]
    return _CrossingQuads(convex_quads(flattened), normal, centre)


def _square(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", vectors, vectors))


# Corners of a crossing's quad are numbered 0 tail, 1 right centre, 2 head, 3 left centre as its
# first half-edge sees them. Rows: a pass in travel order (right entry, right exit, left exit,
# left entry), for an arrival forward and backward along the first half-edge.
_FORWARD = np.array([0, 1, 2, 3])
_BACKWARD = np.array([3, 0, 1, 2])


def _travel_corners(weave: Weave) -> IntArray:
    """Return the quad's corners as each pass meets them, (P, 4): from its right entry round."""
    threads = weave.threads
    corner = np.where(threads.forward[:, None], _FORWARD, _BACKWARD)
    first = threads.crossing_halfedge[threads.crossing] == threads.halfedge
    return np.where(first[:, None], corner, (corner + 2) % 4)


def _rung_room(placed: FloatArray, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the right and left end of the room at fraction u along each pass's quad."""
    here = u[:, None]
    return (
        (1 - here) * placed[:, 0] + here * placed[:, 1],
        (1 - here) * placed[:, 3] + here * placed[:, 2],
    )


def better_diagonals(right: FloatArray, left: FloatArray, following: IntArray) -> BoolArray:
    """Choose for the quad after each rung the diagonal that folds less; ties go to the right.

    Returns
    -------
    (R,) bool array
        Whether it starts at the right rail.
    """
    after = np.where(following >= 0, following, np.arange(len(following)))
    a, b, c, d = right, right[after], left[after], left
    fold_ac = _cosine(np.cross(b - a, c - a), np.cross(c - a, d - a))
    fold_bd = _cosine(np.cross(b - a, d - a), np.cross(c - b, d - b))
    return np.asarray(fold_ac >= fold_bd - 1e-12)


def _cosine(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the cosine of the angle between two bundles of vectors; 1 where one vanishes."""
    size = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    dot = np.einsum("ij,ij->i", first, second)
    return np.asarray(np.where(size > 0, dot / np.where(size > 0, size, 1.0), 1.0))
