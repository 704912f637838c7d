"""Say where strands cross their portals: at the middle, or where the medial line does.

A *portal* is the segment from a vertex to the centre of a face at it: one for each corner, numbered
by the half-edge that ends there. Each portal is crossed by one strand only, on its way from the
edge before the corner to the edge after it.
"""

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres

#: Of the way from the vertex to the centre: no strand's middle comes nearer to either.
_LEAST = 0.2
_QUAD = 4


def portals_of(course: str, mesh: PolyMesh, halfedges: Halfedges) -> FloatArray | None:
    """Return where strands on a course cross each portal, (H,); None for the middle of all.

    Parameters
    ----------
    course : str
        ``straight``: where the medial line does. ``projection``: in the middle. ``auto``: straight
        in faces that are not quads.
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
    if course == "projection" or (course == "auto" and quads.all()):
        return None
    portals = medial_portals(mesh, halfedges)
    return np.where(quads[halfedges.face], 0.5, portals) if course == "auto" else portals


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
    aa, bb, ab = (_dot(p, q) for p, q in ((before, before), (after, after), (before, after)))
    ac, bc = _dot(before, inward), _dot(after, inward)
    area = aa * bb - ab * ab
    total = ac * bb - bc * ab + bc * aa - ac * ab
    flat = area <= 1e-9 * aa * bb
    share = np.divide(area, 2.0 * total, out=np.full(len(aa), 0.5), where=~flat & (total > 0))
    return np.clip(share, _LEAST, 1.0 - _LEAST)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", first, second))
