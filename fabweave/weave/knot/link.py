"""Write the link that a weave on a sphere makes as a planar diagram."""

import numpy as np

from fabweave.core.arrays import IntArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.topology import label_links
from fabweave.weave.knot.rotation_system import TwistedThreads
from fabweave.weave.thread_labels import thread_labels


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
    >>> from fabweave.weave.knot.rotation_system import trace_twisted
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
    >>> from fabweave.weave.knot.rotation_system import trace_twisted
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
