"""Say where the middles of strands cross the portals of a mesh, and where they go from there."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres

#: Of the way from the vertex to the centre: no strand's middle comes nearer to either.
_LEAST = 0.2
_QUAD = 4
#: In fans and polygons among quads: strands keep nearly all of their room, and turn a little less.
_AMONG_QUADS = 1 / 3


def portals_of(course: str, mesh: PolyMesh, halfedges: Halfedges) -> FloatArray | None:
    """Return where strands on a course cross each portal, (H,); None for the middle of all.

    Parameters
    ----------
    course : str
        ``straight``: where the medial line does. ``projection``: in the middle. ``auto``: straight
        in faces that are not quads; a third as much if most are.
    mesh, halfedges
        A mesh and its connectivity.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube, tetrahedron
    >>> mesh = tetrahedron()
    >>> portals_of("auto", mesh, build_halfedges(mesh)).round(9).tolist() == [0.75] * 12
    True
    >>> portals_of("auto", cube(), build_halfedges(cube())) is None
    True
    """
    quads = mesh.face_sizes == _QUAD
    share = _straightness(course, mesh)
    if not share or (course == "auto" and quads.all()):
        return None
    portals = (1.0 - share) * 0.5 + share * medial_portals(mesh, halfedges)
    return np.where(quads[halfedges.face], 0.5, portals) if course == "auto" else portals


def _straightness(course: str, mesh: PolyMesh) -> float:
    """Return how far strands move from the middle of portals to where the medial line is, 0 to 1.

    At an edge between a triangle and a quad they have but 0.4 of their room where the one is
    crossed straight and the other in the middle.
    """
    if course != "auto":
        return float(course == "straight")
    return _AMONG_QUADS if 2 * np.count_nonzero(mesh.face_sizes == _QUAD) > mesh.n_faces else 1.0


def medial_portals(mesh: PolyMesh, halfedges: Halfedges) -> FloatArray:
    """Return where the line through the middles of edges crosses each portal, (H,).

    The middles a and b of the two edges of a corner and its vertex v span a plane. If the centre of
    the face, seen in it, is v + x (a - v) + y (b - v), the line from a to b is crossed at the share
    1 / (x + y) of the way from v to the centre.

    Parameters
    ----------
    mesh, halfedges
        A mesh and its connectivity.

    Returns
    -------
    (H,) float array
        Shares of the way from the vertex to the centre, from 0.2 to 0.8.

    Examples
    --------
    Half way in a square, three quarters of it in any triangle, a quarter in a regular hexagon:

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> turns = np.exp(1j * np.pi * np.arange(6) / 3)
    >>> hexagon = np.column_stack([turns.real, turns.imag, np.zeros(6)]).tolist()
    >>> for corners in (square, [[0, 0, 0], [5, 0, 0], [1, 2, 0]], hexagon):
    ...     mesh = PolyMesh.from_faces(corners, [list(range(len(corners)))])
    ...     print(set(medial_portals(mesh, build_halfedges(mesh)).round(9).tolist()))
    {0.5}
    {0.75}
    {0.25}
    """
    vertex = mesh.vertices[halfedges.head]
    before = mesh.vertices[halfedges.tail] - vertex
    after = mesh.vertices[halfedges.head[halfedges.next]] - vertex
    inward = face_centres(mesh)[halfedges.face] - vertex
    # x and y for whole edges; for half of them they are twice as large.
    aa, bb, ab = (_dots(p, q) for p, q in ((before, before), (after, after), (before, after)))
    ac, bc = _dots(before, inward), _dots(after, inward)
    area = aa * bb - ab * ab
    total = ac * bb - bc * ab + bc * aa - ac * ab
    flat = area <= 1e-9 * aa * bb
    share = np.divide(area, 2.0 * total, out=np.full(len(aa), 0.5), where=~flat & (total > 0))
    return np.clip(share, _LEAST, 1.0 - _LEAST)


def _dots(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", first, second))


def crossing_shares(mesh: PolyMesh, halfedges: Halfedges, course: str) -> FloatArray:
    """Return where strands would cross each portal if its face were regular, (H,).

    In a regular face with n corners, the line between the middles of two edges lies cos²(π/n) of
    the way from the centre to the corner, so that it crosses the portal at sin²(π/n).
    """
    share = _straightness(course, mesh)
    straight = np.sin(np.pi / mesh.face_sizes[halfedges.face]) ** 2
    return np.asarray((1.0 - share) * 0.5 + share * straight)


def walks(halfedges: Halfedges, passed: BoolArray, length: int) -> tuple[IntArray, FloatArray]:
    """Return so many portals in a row along each strand, from every one on, walked both ways.

    Parameters
    ----------
    halfedges : Halfedges
        The portal of half-edge ``h`` runs from its head to the centre of its face; the strand that
        passes that corner comes over the edge of ``h`` and goes on over the next one.
    passed : (H,) bool array
        Which portals count.
    length : int

    Returns
    -------
    portals : (N, length) int array
    left : (N, length) float array
        1 where the walk has the vertex on its left, so that the face is on its right; else -1.
    """
    half, count = halfedges, halfedges.n_halfedges
    # As threads are traced: a forward pass of a corner goes on over the next edge, backward.
    ahead, behind = half.twin[half.next], half.twin
    after = np.concatenate(
        [np.where(ahead >= 0, count + half.prev[ahead], -1), np.where(behind >= 0, behind, -1)]
    )
    either_way = np.tile(passed, 2)
    walk = [np.flatnonzero(either_way)]
    for _ in range(length - 1):
        onward = after[walk[-1]]
        goes_on = (onward >= 0) & either_way[onward]
        walk = [states[goes_on] for states in [*walk, onward]]
    states = np.stack(walk, axis=1)
    return states % count, np.where(states >= count, -1.0, 1.0)
