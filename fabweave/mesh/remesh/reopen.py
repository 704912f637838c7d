"""Open again what a remesher filled: the openings of a surface that it took for gaps of its own."""

import numpy as np

from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres, without_loose
from fabweave.mesh.remesh.remeshed import edge_lengths, surface_faults, surface_of
from fabweave.mesh.topology import keep_faces

#: A face is over an opening if its centre is beyond the rim by more than this share of an edge.
_BEYOND = 0.1
#: A point lies on a rim if corners inside have less than this share in it.
_INSIDE = 1e-3


def reopened(given: PolyMesh, result: PolyMesh) -> PolyMesh:
    """Return a result without the faces that fill openings of the given surface.

    It stays as it is where it lacks no opening, or where it is no surface without these faces, or
    has no more openings then.

    Parameters
    ----------
    given : PolyMesh
        An oriented manifold surface.
    result : PolyMesh
        Quads that a remesher made of it, at its place.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> sheet = hypar(9, 9, 1.0, 0.0)
    >>> pierced = keep_faces(sheet, np.arange(81) != 40)
    >>> reopened(pierced, sheet).n_faces, reopened(sheet, sheet).n_faces
    (80, 81)
    """
    before, after = check_mesh(given), check_mesh(result)
    if after.fatal or after.n_boundary_loops >= before.n_boundary_loops:
        return result
    halfedges, surface = build_halfedges(given), surface_of(given)
    inside = np.ones(len(surface.scaled))
    inside[halfedges.head[halfedges.twin < 0]] = 0.0
    feet = surface.feet(face_centres(result))
    beyond = np.einsum("nc,nc->n", feet.shares, inside[feet.corners]) < _INSIDE
    beyond &= feet.distances > _BEYOND * float(np.median(edge_lengths(result)))
    if not beyond.any() or beyond.all():
        return result
    opened = without_loose(keep_faces(result, ~beyond))
    more = check_mesh(opened).n_boundary_loops > after.n_boundary_loops
    return opened if more and not surface_faults(given, opened, simpler=True) else result
