"""Project threads to ribbons: the projection method, with real material thickness."""

from dataclasses import replace
from itertools import product

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    lengths,
    offsets_of,
    unit,
)
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.width import WidthRule, shares_of
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.threads import Threads

#: Rungs of a turn: where it begins, its middle, and where it ends.
RUNGS_A_TURN = 3

#: At the rim a ribbon keeps this share of the distance that it keeps from vertices and centres.
_RIM_SHARE = 0.25


def turn_rungs(
    mesh: PolyMesh,
    halfedges: Halfedges,
    threads: Threads,
    *,
    length: float,
    width: WidthRule | FloatArray,
    narrowing: FloatArray,
    portals: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the rungs of every turn: a planar panel in the half-quad of its boundary edge.

    A boundary edge owns the triangle of its end vertices and the centre of its face. Between its
    two portals, the segments from a vertex to the centre, no other strand passes. The panel lies
    in the triangle's plane, midway between over and under; its rails run along the edge, and its
    rungs point to the centre. Towards the centre it keeps the distance that all ribbons keep;
    towards the edge it is as wide as the ribbon that arrives, or as the triangle has room for.

    Parameters
    ----------
    mesh, halfedges, threads
        A mesh, its connectivity, and threads with turns.
    length : float
        Relative length of crossing panels, as in
        :func:`~fabweave.ribbon.project.project_ribbons`.
    width : WidthRule or (P,) float array
        How wide ribbons are.
    narrowing : (P,) float array
        Factor on the width at each pass; a turn has that of the pass before it.
    portals : (H,) float array, optional
        Where the middle of the strand crosses each portal, from the vertex to the centre.

    Returns
    -------
    right, left : (B, 3, 3) float arrays
        For each turn the ends of its three rungs, in walking order.

    Raises
    ------
    InputError
        If a half-quad has no area.
    """
    edge, forward = threads.turn_halfedge, threads.turn_forward[:, None]
    centre = face_centres(mesh)[halfedges.face[edge]]
    tail = mesh.vertices[halfedges.tail[edge]]
    head = mesh.vertices[halfedges.head[edge]]
    start, end = np.where(forward, tail, head), np.where(forward, head, tail)
    base = np.linalg.norm(head - tail, axis=1)
    arms = np.linalg.norm(tail - centre, axis=1) + np.linalg.norm(head - centre, axis=1)
    area = np.linalg.norm(np.cross(tail - centre, head - centre), axis=1)
    _require_area(
        halfedges,
        edge,
        area > 1e-9 * (base + arms) ** 2,
        "{n} turn[ has|s have] no room at the boundary (edge[|s] between vertices {pairs}): the "
        "centre of the face lies on the edge; move its vertices apart, or use --boundary end",
    )

    # The room across a turn is that of the portals by which the strand comes and goes.
    before = threads.turn_pass
    share = narrowing[before] * shares_of(width, before, arms / 2, most=length)
    middle = np.full(len(edge), 0.5)
    if portals is not None:
        middle = 1.0 - (portals[edge] + portals[halfedges.prev[edge]]) / 2
    share *= 2 * np.minimum(middle, 1.0 - middle)
    inner = middle - share / 2
    # As wide across the edge as the arriving ribbon is along its portals.
    outer = np.minimum(inner + share * arms * base / (2 * area), 1 - _RIM_SHARE * inner)
    rungs = []
    for u in (0.5 - length / 2, 0.5, 0.5 + length / 2):
        ray = (1 - u) * start + u * end - centre
        rungs.append((centre + outer[:, None] * ray, centre + inner[:, None] * ray))
    rim, inside = (np.stack(side, axis=1) for side in zip(*rungs, strict=True))
    # Forward along its half-edge, a strand has the edge to its right.
    outward = forward[:, :, None]
    return np.where(outward, rim, inside), np.where(outward, inside, rim)


def _require_area(halfedges: Halfedges, edge: IntArray, enough: BoolArray, told: str) -> None:
    """Raise InputError unless there is area enough beside every edge.

    ``told`` says what is wrong, with ``{pairs}`` for vertices at the ends of the first few.
    """
    flat = edge[np.flatnonzero(~enough)]
    if len(flat):
        ends = zip(halfedges.tail[flat[:4]], halfedges.head[flat[:4]], strict=True)
        raise InputError(
            agree(len(flat), told).format(pairs=", ".join(f"{a}-{b}" for a, b in ends))
        )


def require_no_loop(threads: Threads, halfedges: Halfedges) -> None:
    """Raise CannotMakeError where a thread turns right round a face and meets itself at once.

    A face that hangs by one edge only is such a place: the ribbon comes in across that edge and
    goes out across it, and in the plane its two ends lie on one another.
    """
    following = following_rung(threads.offsets, threads.closed)
    before = np.unique(threads.turn_pass)
    loops = before[threads.crossing[before] == threads.crossing[following[before]]]
    if len(loops):
        faces = np.sort(halfedges.face[halfedges.twin[threads.halfedge[loops]]])
        raise CannotMakeError(
            f"{agree(len(faces), '{n} [face hangs|faces hang]')} on by a single edge "
            f"({agree(len(faces), '[face|faces]')} {few_of(faces.tolist())}); a ribbon that turns "
            "around such a face overlaps itself and cannot be cut flat: remove or refine these "
            "faces, or use --boundary end"
        )


def crossing_threads(weave: Weave) -> tuple[IntArray, IntArray]:
    """Return the thread that goes over and the one that goes under at each crossing, (X,) each."""
    lower, upper = weave.threads.thread_of_pass[strand_passes(weave)].T
    return upper, lower


def crossing_heights(
    weave: Weave,
    thickness_mm: FloatArray,
    clearance_mm: float,
    laps: IntArray | None = None,
) -> FloatArray:
    """Return how far either strand's middle surface lies from the plane of each crossing, (X,).

    Let the strand above be a mm thick, the one below b, and the air between them c. Above its
    lower face the upper strand has half of itself, a/2, up to its middle surface; below its upper
    face the lower one has b/2. So the middle surfaces are a/2 + c + b/2 apart. Where two pieces
    of the lower strand lap, it is 2 b thick, and what is laid is the middle of both layers: then
    they are a/2 + c + b apart, b/2 more. (Joints lie where their own thread goes under.)

    Both strands take half of the distance, the upper one outward and the lower one inward, so that
    the crossing stays midway between them on the surface, and a thick strand need not climb more
    than the thin one that it crosses.

    Parameters
    ----------
    weave : Weave
    thickness_mm : (T,) float array
        Of each thread.
    clearance_mm : float
    laps : (N,) int array, optional
        The crossings at which the strand below laps; by default any may.

    Examples
    --------
    A warp of 0.5 mm and a weft of 0.8 mm with 0.1 mm between: 0.75 mm from middle to middle; under
    the warp a lap of the weft makes that 1.15 mm, under the weft one of the warp 1 mm.

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.bunches import part_bunches
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(parse_shape("shape:torus?m=4&n=4"))))
    >>> thickness = np.array([0.5, 0.8])[part_bunches(weave.threads)]
    >>> none = np.zeros(0, dtype=np.int64)
    >>> np.unique((2 * crossing_heights(weave, thickness, 0.1, none)).round(9)).tolist()
    [0.75]
    >>> np.unique((2 * crossing_heights(weave, thickness, 0.1)).round(9)).tolist()
    [1.0, 1.15]
    """
    upper, lower = crossing_threads(weave)
    height = ((thickness_mm[upper] + thickness_mm[lower]) / 2 + clearance_mm) / 2
    lapped = slice(None) if laps is None else laps
    height[lapped] += thickness_mm[lower[lapped]] / 4
    return np.asarray(height)


#: Rounds in which the share that keeps strands flat on one another is found.
_ROUNDS = 6
#: What is no larger than this many times something else is as large.
_SAME = 1.0 + 1e-9


def portal_middles(
    portals: FloatArray, halfedges: Halfedges, crossing_halfedge: IntArray
) -> FloatArray:
    """Return where strands cross the sides of each crossing's quad, (X, 4).

    The quad's corners are the tail of the crossing's half-edge, the centre on its right, its head,
    and the centre on its left; side k runs from corner k to the next, and has a share of that way.
    """
    left, right = crossing_halfedge, halfedges.twin[crossing_halfedge]
    corners = np.stack([right, halfedges.prev[right], left, halfedges.prev[left]], axis=1)
    middles = portals[corners]
    middles[:, 1::2] = 1.0 - middles[:, 1::2]
    return middles


def portal_windows(quads: FloatArray, middles: FloatArray) -> FloatArray:
    """Return the room that each pass has: the part of its quad about its own middle line.

    Parameters
    ----------
    quads : (P, 4, D) float array
        Right entry, right exit, left exit and left entry of each pass.
    middles : (P, 2) float array
        Where its middle crosses the exit, as a share of the way from right to left, and the entry,
        of the way from left to right.

    Returns
    -------
    (P, 4, D) float array
        Each portal's longest piece with that middle, at the same corners.
    """
    half = np.minimum(middles, 1.0 - middles)
    low, high = (middles - half)[:, :, None], (middles + half)[:, :, None]
    exits, entry = (quads[:, 1], quads[:, 2]), (quads[:, 3], quads[:, 0])
    (right_exit, left_exit), (left_entry, right_entry) = (
        tuple((1.0 - share[:, k]) * start + share[:, k] * end for share in (low, high))
        for k, (start, end) in enumerate((exits, entry))
    )
    return np.stack([right_entry, right_exit, left_exit, left_entry], axis=1)


@frozen_value
class Meeting:
    """Where the middles of the two strands meet at each crossing, and how wide they may be there.

    Parameters
    ----------
    point : (X, 3) float array
    along : (X, 2) float array
        How far along its middle line, from 0 to 1, each strand meets the other: the one from side
        3 of the quad to side 1, and the one from side 2 to side 0.
    most : (X,) float array
        The greatest share of their room that both may take.
    """

    point: FloatArray
    along: FloatArray
    most: FloatArray


def meet_strands(
    quads: FloatArray, normal: FloatArray, middles: FloatArray, length: float
) -> Meeting:
    """Find where strands meet, and the greatest share of their room that both may take.

    Where two strands lie on one another, both must be flat: the corners of that place lie within
    both crossing panels, which are so long relative to the room. As the corners move almost in
    proportion to the widths, some rounds of that rule find the share.

    Parameters
    ----------
    quads : (X, 4, 3) float array
        The planar quad of each crossing.
    normal : (X, 3) float array
    middles : (X, 4) float array
        As from :func:`portal_middles`.
    length : float
        Relative length of crossing panels, the greatest share of all.

    Examples
    --------
    In a square that is crossed in the middles of its sides, strands may be as wide as panels are
    long, and so they may in the rhombus of two regular triangles:

    >>> square = np.array([[[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]]])
    >>> up = np.array([[0.0, 0, 1]])
    >>> meeting = meet_strands(square, up, np.full((1, 4), 0.5), 0.7)
    >>> meeting.point.tolist(), meeting.along.tolist(), meeting.most.tolist()
    ([[0.0, 0.0, 0.0]], [[0.5, 0.5]], [0.7])
    >>> rhombus = square * [np.sqrt(3), 1, 1]
    >>> meet_strands(rhombus, up, np.array([[0.75, 0.25, 0.75, 0.25]]), 0.7).most.round(9).tolist()
    [0.7]
    """
    along = unit(quads[:, 2] - quads[:, 0])
    plane = np.stack([along, np.cross(normal, along)], axis=2)
    flat = np.einsum("xkd,xdc->xkc", quads - quads[:, :1], plane)
    first = portal_windows(flat, middles[:, [1, 3]])
    second = portal_windows(np.roll(flat, 1, axis=1), middles[:, [0, 2]])
    u, v = _crossing_of(_line(first, 0.5), _line(second, 0.5))
    share = np.full(len(quads), length)
    for _ in range(_ROUNDS):
        reach = _reach(first, second, share, (u, v))
        wide = reach > length * _SAME
        if not wide.any():
            break
        share = np.where(wide, share * length / reach, share)
    (start, way), here = _line(portal_windows(quads, middles[:, [1, 3]]), 0.5), u[:, None]
    return Meeting(start + here * way, np.stack([u, v], axis=1), share)


def _line(quad: FloatArray, side: float | FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return start and way of the line at a share of the way from the right rail to the left."""
    s = np.broadcast_to(side, len(quad))[:, None]
    start = (1 - s) * quad[:, 0] + s * quad[:, 3]
    return start, (1 - s) * quad[:, 1] + s * quad[:, 2] - start


def _crossing_of(
    first: tuple[FloatArray, FloatArray], second: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return how far along each of two lines they cross."""
    (one, way), (other, across) = first, second
    size = _cross(way, across)
    safe = np.where(size != 0, size, 1.0)
    return (
        np.where(size != 0, _cross(other - one, across) / safe, 0.5),
        np.where(size != 0, _cross(other - one, way) / safe, 0.5),
    )


def _reach(
    first: FloatArray, second: FloatArray, share: FloatArray, met: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Return how much of their panels' room strands of a width need to cross each other, (X,)."""
    reach, sides = np.zeros(len(first)), (0.5 - share / 2, 0.5 + share / 2)
    rooms = [np.maximum(np.minimum(middle, 1.0 - middle), 1e-9) for middle in met]
    lines = ([_line(strand, side) for side in sides] for strand in (first, second))
    for one, other in product(*lines):
        corner = _crossing_of(one, other)
        for here, middle, room in zip(corner, met, rooms, strict=True):
            reach = np.maximum(reach, np.abs(here - middle) / room)
    return reach


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


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
    given relative length and width, or one at right angles to itself where that would run through
    itself; connectors join consecutive panels. Where a thread turns back
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
        the face's centre: see :mod:`fabweave.mesh.fair.portals`. The room of the strand is then the
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
    straighten_panels(right, left, entry, quads.normal[threads.crossing])
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


def straighten_panels(
    right: FloatArray, left: FloatArray, entry: IntArray, normal: FloatArray
) -> None:
    """Turn both rungs of panels that run through themselves, in place, square to their strands.

    Where two faces are nearly folded onto each other, their quad stays a dart, and of a panel at
    its reflex corner right and left may be exchanged at one end. Rungs keep middles and lengths.

    Parameters
    ----------
    right, left : (R, 3) float arrays
        Ends of rungs.
    entry : (P,) int array
        The rung where each planar panel begins; it ends at the following one.
    normal : (P, 3) float array
        Outward unit normals of the panels.

    Examples
    --------
    On its way along y, this ribbon has exchanged its rails:

    >>> right, left = np.array([[[1.0, 0, 0], [-1, 5, 0]], [[-1, 0, 0], [1, 5, 0]]])
    >>> straighten_panels(right, left, np.array([0]), np.array([[0.0, 0, 1]]))
    >>> right.tolist(), left.tolist()
    ([[1.0, 0.0, 0.0], [1.0, 5.0, 0.0]], [[-1.0, 0.0, 0.0], [-1.0, 5.0, 0.0]])
    """
    panel = np.stack((right[entry], right[entry + 1], left[entry + 1], left[entry]), axis=1)
    side = np.roll(panel, -1, axis=1) - panel
    turn = np.einsum("pkd,pd->pk", np.cross(np.roll(side, 1, axis=1), side), normal)
    folded = (turn <= 0.0).any(axis=1)
    middles = (panel[folded] + panel[folded][:, ::-1]) / 2.0
    leftward = unit(np.cross(normal[folded], middles[:, 1] - middles[:, 0]))
    for shift in (0, 1):
        rung, middle = entry[folded] + shift, middles[:, shift]
        half = np.linalg.norm(left[rung] - right[rung], axis=1, keepdims=True) / 2.0 * leftward
        right[rung], left[rung] = middle - half, middle + half


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


def preceding_rung(following: IntArray) -> IntArray:
    """Return what each rung, or pass, follows, as `following_rung` says it; -1 at an open end."""
    preceding = np.full(len(following), -1, dtype=np.int64)
    goes_on = np.flatnonzero(following >= 0)
    preceding[following[goes_on]] = goes_on
    return preceding


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
    _require_area(
        halfedges,
        crossing,
        size > 1e-9 * reach,
        "{n} [edge has|edges have] no room for a crossing (between vertices {pairs}): the faces on "
        "either side are folded flat onto each other or have no area; move their vertices apart",
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
    size = lengths(first) * lengths(second)
    dot = np.einsum("ij,ij->i", first, second)
    return np.asarray(np.where(size > 0, dot / np.where(size > 0, size, 1.0), 1.0))


def smooth_ribbons(ribbons: Ribbons, steps: int) -> Ribbons:
    """Replace the connector between two crossing panels by a finer chain of facets.

    Both rails go on from one panel to the next along cubic curves that leave and arrive in the
    direction of the panels' sides, so that the development's outline has no kink there. The
    chain is still one of planar facets: it unfolds exactly. Crossing panels stay as they are, and
    so do turns at the boundary and the ends of open ribbons.

    Parameters
    ----------
    ribbons : Ribbons
        As projected.
    steps : int
        Cross-lines between two panels; 0 leaves the ribbons as they are.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.ribbon.project import project_ribbons
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> mesh = torus(8, 4, 35.0, 15.0)
    >>> halfedges = build_halfedges(mesh)
    >>> weave = plain_weave(trace_threads(halfedges))
    >>> ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.25)
    >>> ribbons.n_rungs, smooth_ribbons(ribbons, 3).n_rungs
    (256, 640)
    """
    if steps < 1:
        return ribbons
    following = following_rung(ribbons.offsets, ribbons.closed)
    leaves, arrives = _connectors(ribbons, following)
    inserted = np.zeros(ribbons.n_rungs + 1, dtype=np.int64)
    inserted[leaves + 1] = steps
    number = np.arange(ribbons.n_rungs + 1) + np.cumsum(inserted)

    rails = []
    share = np.arange(1, steps + 1) / (steps + 1)
    between = number[leaves][:, None] + np.arange(1, steps + 1)
    for rail in (ribbons.right, ribbons.left):
        longer = np.empty((number[-1], 3))
        longer[number[:-1]] = rail
        longer[between] = _curve(rail, leaves, arrives, share)
        rails.append(longer)
    right, left = rails
    offsets = number[ribbons.offsets]
    # Rungs put in after the last one of a ring belong to it, not to the next thread.
    return replace(
        ribbons,
        offsets=offsets,
        right=right,
        left=left,
        from_right=better_diagonals(right, left, following_rung(offsets, ribbons.closed)),
        entry=number[ribbons.entry],
    )


def _connectors(ribbons: Ribbons, following: IntArray) -> tuple[IntArray, IntArray]:
    """Return the rungs at which ribbons leave a panel and arrive at the next one without a turn."""
    enters = flags(ribbons.n_rungs, ribbons.entry)
    leaves = ribbons.entry + 1
    arrives = following[leaves]
    direct = (arrives >= 0) & enters[arrives]
    return leaves[direct], arrives[direct]


def _curve(rail: FloatArray, leaves: IntArray, arrives: IntArray, share: FloatArray) -> FloatArray:
    """Return points on cubic curves between rungs, (C, K, 3), by Hermite's formula."""
    start, end = rail[leaves], rail[arrives]
    chord = end - start
    away = _pull(start - rail[leaves - 1], chord)
    onwards = _pull(rail[arrives + 1] - end, chord)
    t = share[None, :, None]
    return np.asarray(
        (1 + 2 * t) * (1 - t) ** 2 * start[:, None]
        + t * (1 - t) ** 2 * away[:, None]
        + t**2 * (3 - 2 * t) * end[:, None]
        - t**2 * (1 - t) * onwards[:, None]
    )


def _pull(side: FloatArray, chord: FloatArray) -> FloatArray:
    """Return how a curve goes on along a panel's side: as far as its chord is long.

    Where it turns by more than 60 degrees that is less, down to nothing at a right angle; else
    the ribbon would often run through itself there.
    """
    length = np.linalg.norm(chord, axis=1, keepdims=True)
    way = unit(side)
    ahead = np.einsum("ij,ij->i", way, unit(chord))[:, None]
    return np.asarray(np.clip(2.0 * ahead, 0.0, 1.0) * length * way)
