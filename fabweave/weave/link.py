"""Trace threads round any number of half-twists an edge, and write them as knot theory does."""

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import BoolArray, IntArray, frozen_value, offsets_of, places_in_groups
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.topology import label_links
from fabweave.weave.threads import PassesByThread, corner_successor, thread_labels, walk_corners

#: More crossings than this must be a typing error, and would fill the memory.
_MOST_CROSSINGS = 1 << 28


@frozen_value
class TwistedThreads(PassesByThread):
    """The threads of a mesh whose edges carry any number of half-twists.

    Two strands run along every edge. An edge with ``k`` half-twists has ``|k|`` crossings, one
    after the other; the sense of the helix is that of :func:`fabweave.weave.pattern.over_of_passes`
    for true where ``k > 0``. A *pass* is one visit of a thread to a crossing.

    Parameters
    ----------
    half_twists : (E,) int array
        Half-twists of each edge: 0 is untwisted, positive is counter-clockwise.
    crossing_offsets : (E + 1,) int array
        Edge ``e`` owns the crossings ``crossing_offsets[e]:crossing_offsets[e + 1]``, in order
        along its first half-edge.
    offsets : (T + 1,) int array
        Thread ``t`` owns the passes ``offsets[t]:offsets[t + 1]``, in walking order.
    crossing : (P,) int array
        The crossing of each pass.
    halfedge : (P,) int array
        The half-edge of the pass's edge whose face the thread comes from.
    along : (P,) bool array
        Whether the thread walks the edge from the tail of its first half-edge to its head.
    over : (P,) bool array
        Whether the pass lies on top.
    closed : (T,) bool array
        Whether the thread is a ring.
    """

    half_twists: IntArray
    crossing_offsets: IntArray
    offsets: IntArray
    crossing: IntArray
    halfedge: IntArray
    along: BoolArray
    over: BoolArray
    closed: BoolArray

    @property
    def n_crossings(self) -> int:
        """Number of crossings."""
        return int(self.crossing_offsets[-1])

    @property
    def edge_of_crossing(self) -> IntArray:
        """The edge that each crossing lies along, (X,)."""
        return np.repeat(np.arange(len(self.half_twists)), np.abs(self.half_twists))

    @property
    def passes(self) -> IntArray:
        """The pass on top and the pass below of each crossing, (X, 2)."""
        result = np.empty((self.n_crossings, 2), dtype=np.int64)
        numbers = np.arange(len(self.crossing))
        result[self.crossing[self.over], 0] = numbers[self.over]
        result[self.crossing[~self.over], 1] = numbers[~self.over]
        return result

    @property
    def signs(self) -> IntArray:
        """Sign of each crossing, +1 or -1, if threads are oriented as they are walked, (X,).

        Positive is right-handed: a counter-clockwise edge whose two strands walk the same way.
        The sign of a crossing of a thread with itself does not depend on the orientations.
        """
        top, below = self.passes.T
        same_way = self.along[top] == self.along[below]
        sense = np.sign(self.half_twists[self.edge_of_crossing])
        return np.where(same_way, sense, -sense)


def trace_twisted(
    halfedges: Halfedges, half_twists: npt.ArrayLike, *, turn: bool = False
) -> TwistedThreads:
    """Trace the threads of a mesh whose edges carry any number of half-twists.

    All are cycles (on an open mesh, cycles and paths) of one permutation of the directed corners.
    With no edge twisted they are the boundaries of the faces; with every edge twisted once they
    are those of :func:`fabweave.weave.threads.trace_threads`, pass for pass. In a helix of several
    half-twists the strand that is on top at one crossing goes under at the next.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of an oriented manifold mesh; boundaries are allowed.
    half_twists : (E,) int array
        Half-twists of each edge, 0 on boundary edges: 0 is untwisted, positive is
        counter-clockwise, negative is clockwise.
    turn : bool
        Whether threads turn back at the boundary; otherwise they end there.

    Returns
    -------
    TwistedThreads
        Closed threads start at their smallest corner, open ones at the end that comes first.

    Raises
    ------
    InputError
        If there is not one whole number for each edge, or a boundary edge is to be twisted.

    Examples
    --------
    The faces of a cube are six rings; one twisted edge joins two of them:

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube
    >>> halfedges = build_halfedges(cube())
    >>> trace_twisted(halfedges, [0] * 12).n_threads
    6
    >>> joined = trace_twisted(halfedges, [1] + [0] * 11)
    >>> joined.n_threads, joined.thread_of_pass.tolist()
    (5, [0, 0])

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 3: extended graph rotation systems.
    """
    twists = _checked(halfedges, half_twists)
    swaps = (twists % 2 == 1)[halfedges.edge]
    arrival, backward, thread, closed = walk_corners(
        halfedges, corner_successor(halfedges, turn=turn, swaps=swaps)
    )
    edge = halfedges.edge[arrival]
    turns = np.abs(twists[edge])
    crossing_offsets = offsets_of(np.abs(twists))

    # One pass for every half-twist on the way.
    step = np.repeat(np.arange(len(arrival)), turns)
    nth = places_in_groups(turns)
    is_first = halfedges.edge_halfedge[edge] == arrival
    along = (is_first != backward)[step]
    at = np.where(along, nth, turns[step] - 1 - nth)
    from_left = (nth % 2 == 0) != backward[step]
    edge = edge[step]
    return TwistedThreads(
        half_twists=twists,
        crossing_offsets=crossing_offsets,
        offsets=offsets_of(np.bincount(thread[step], minlength=len(closed))),
        crossing=crossing_offsets[edge] + at,
        halfedge=arrival[step],
        along=along,
        over=from_left == (twists[edge] > 0),
        closed=closed,
    )


def _checked(halfedges: Halfedges, half_twists: npt.ArrayLike) -> IntArray:
    """Return half-twists as an array that fits the mesh."""
    given = np.asarray(half_twists)
    if given.shape != (halfedges.n_edges,):
        raise InputError(
            f"half-twists need one number for each of {halfedges.n_edges} edges, but have the "
            f"shape {given.shape}"
        )
    if given.size and not np.issubdtype(given.dtype, np.integer):
        raise InputError("half-twists must be whole numbers")
    twists = given.astype(np.int64)
    if np.abs(twists.astype(np.float64)).sum() > _MOST_CROSSINGS:
        raise InputError(f"these half-twists make more than {_MOST_CROSSINGS} crossings")
    wrong = np.flatnonzero((halfedges.twin[halfedges.edge_halfedge] < 0) & (twists != 0))
    if len(wrong):
        raise InputError(
            f"{len(wrong)} boundary edges have half-twists ({few_of(wrong.tolist(), 5)}); only "
            "one strand runs along a boundary edge, so give it none"
        )
    return twists


def gauss_text(threads: TwistedThreads) -> str:
    """Write the signed Gauss code of all threads, one line a thread.

    Each pass is ``O`` (over) or ``U`` (under), the crossing number plus one, and the sign of the
    crossing (``+`` is right-handed, threads oriented as they are walked). This is the notation of
    the tables of virtual knots, which also holds for weaves of any genus.

    Returns
    -------
    str
        Lines such as ``A: O1+U2+O3+U1+O2+U3+``; nothing after the colon for a thread without
        crossings.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> from fabweave.weave.link import trace_twisted
    >>> lens = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]])
    >>> print(gauss_text(trace_twisted(build_halfedges(lens), [-2, 0, 0])), end="")
    A: U1+O2+
    B: U2+O1+
    """
    level = np.where(threads.over, "O", "U").tolist()
    number = (threads.crossing + 1).tolist()
    sign = np.where(threads.signs[threads.crossing] > 0, "+", "-").tolist()
    words = [f"{o}{x}{s}" for o, x, s in zip(level, number, sign, strict=True)]
    bounds = threads.offsets.tolist()
    lines = [
        f"{label}: {''.join(words[bounds[t] : bounds[t + 1]])}".rstrip() + "\n"
        for t, label in enumerate(thread_labels(threads.n_threads))
    ]
    return "".join(lines)


@frozen_value
class PlanarDiagram:
    """The planar diagram of an oriented link, as knot theory's programs want it.

    Parameters
    ----------
    crossings : (X, 4) int array
        The arcs at each crossing: first the one that comes in below, then the others
        counter-clockwise. Arcs are numbered from 1 along each component in turn.
    loops : (L,) int array
        The threads without any crossing, which are rings apart from all the rest.
    n_components : int
        Number of components, these rings included.
    """

    crossings: IntArray
    loops: IntArray
    n_components: int


def genus_of_bodies(halfedges: Halfedges) -> IntArray:
    """Return the genus of each connected component of a closed oriented mesh.

    Vertices are counted as fans of faces, so a vertex where two fans touch counts twice.

    Raises
    ------
    CannotMakeError
        If the mesh has a boundary.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> genus_of_bodies(build_halfedges(torus(4, 3, 35.0, 15.0))).tolist()
    [1]
    """
    open_edges = int(np.count_nonzero(halfedges.twin < 0))
    if open_edges:
        raise CannotMakeError(
            f"the mesh is open ({open_edges} boundary edges), and only a weave on a closed surface "
            "makes a link; close the mesh"
        )
    every = np.arange(halfedges.n_halfedges)
    n_bodies, body_of_face = label_links(
        halfedges.face, halfedges.face[halfedges.twin], int(halfedges.face.max(initial=-1)) + 1
    )
    n_fans, fan = label_links(every, halfedges.twin[halfedges.prev], halfedges.n_halfedges)
    fan_halfedge = np.empty(n_fans, dtype=np.int64)
    fan_halfedge[fan] = every
    body = body_of_face[halfedges.face]
    vertices = np.bincount(body[fan_halfedge], minlength=n_bodies)
    edges = np.bincount(body[halfedges.edge_halfedge], minlength=n_bodies)
    faces = np.bincount(body_of_face, minlength=n_bodies)
    return np.asarray((2 - vertices + edges - faces) // 2)


def planar_diagram(halfedges: Halfedges, threads: TwistedThreads) -> PlanarDiagram:
    """Return the planar diagram of the link that a weave makes in space.

    Seen from outside, a weave on a sphere is a link diagram on a sphere: every thread is a
    component. Several bodies lie apart.

    Parameters
    ----------
    halfedges : Halfedges
        A closed mesh, each component of genus 0.
    threads : TwistedThreads
        Its threads.

    Returns
    -------
    PlanarDiagram
        The diagram; components are oriented as the threads are walked.

    Raises
    ------
    CannotMakeError
        If the mesh has a boundary or a handle.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import tetrahedron
    >>> from fabweave.weave.link import trace_twisted
    >>> halfedges = build_halfedges(tetrahedron())
    >>> diagram = planar_diagram(halfedges, trace_twisted(halfedges, [1] * 6))
    >>> diagram.crossings.shape, diagram.n_components
    ((6, 4), 3)

    References
    ----------
    D. Bar-Natan and others, the Knot Atlas: "Planar Diagrams" (the convention of KnotTheory).
    """
    genus = genus_of_bodies(halfedges)
    if genus.any():
        which = ", ".join(map(str, genus[genus > 0][:5].tolist()))
        raise CannotMakeError(
            f"a planar diagram needs a weave on a sphere, but this mesh has genus {which}: it "
            "cannot be drawn in the plane without adding crossings; write the Gauss code "
            "(inspect --gauss), which holds for any genus"
        )
    following = np.arange(1, len(threads.crossing) + 1)
    filled = threads.woven
    following[threads.offsets[1:][filled] - 1] = threads.offsets[:-1][filled]
    top, below = threads.passes.T
    # Looking along the strand below: the one on top of a positive crossing goes from left to
    # right, so counter-clockwise from the way in the next arc is where it leaves.
    positive = threads.signs > 0
    right = np.where(positive, following[top], top)
    left = np.where(positive, top, following[top])
    return PlanarDiagram(
        crossings=np.column_stack((below, right, following[below], left)) + 1,
        loops=np.flatnonzero(~filled),
        n_components=threads.n_threads,
    )


def pd_text(diagram: PlanarDiagram) -> str:
    """Write a planar diagram in the notation of KnotTheory.

    Returns
    -------
    str
        ``PD[X[i,j,k,l], …]``; a ring without crossings is a ``Loop[n]`` with an arc of its own.

    Examples
    --------
    >>> import numpy as np
    >>> trefoil = np.array([[1, 4, 2, 5], [3, 6, 4, 1], [5, 2, 6, 3]])
    >>> pd_text(PlanarDiagram(trefoil, np.array([1]), 2))
    'PD[X[1,4,2,5], X[3,6,4,1], X[5,2,6,3], Loop[7]]'
    """
    items = [f"X[{','.join(map(str, arcs))}]" for arcs in diagram.crossings.tolist()]
    first = 2 * len(items) + 1
    items += [f"Loop[{first + n}]" for n in range(len(diagram.loops))]
    return f"PD[{', '.join(items)}]"
