"""Prepare a surface as the model that coarse meshes are fitted to."""

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    frozen_value,
    places_in_groups,
    unit,
)
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_of_corner, next_corner
from fabweave.mesh.samples import area_samples, plain_triangles
from fabweave.mesh.topology import label_links

#: Samples of the model: for each vertex of the mesh so many, within these bounds.
_SAMPLES_EACH, _LEAST_SAMPLES, _MOST_SAMPLES = 20, 8000, 100_000
#: An edge of the model is sharp where its faces turn by more than this (as in mesh.fair).
_SHARP_DEG = 50.0
#: Sharp edges that hang together make a line if they are together as long as this share of the
#: size; creases of an ear or an eye are shorter.
_LONG = 1.5
#: About so many points are spread along the lines of a model.
_LINE_POINTS = 20_000
#: An edge of a mesh lies along a sharp line if its quarter points are nearer to it than this share
#: of its length.
_ALONG = 0.08


@frozen_value
class Lines:
    """Points along some edges of a model.

    Parameters
    ----------
    points : (N, 3) float array
    """

    points: FloatArray

    def nearest(self, places: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the nearest of the points to each place, (P, 3), and how far it is, (P,)."""
        distance, number = cKDTree(self.points).query(places)
        return self.points[number], np.asarray(distance, dtype=np.float64)


@frozen_value
class Model:
    """What coarse meshes are fitted to.

    Parameters
    ----------
    surface : Surface
        The model.
    places, normals : (S, 3) float arrays
        Samples of it, spread by area, and its unit normals there.
    rim, sharp : Lines
        Its boundary, and its sharp edges.
    """

    surface: Surface
    places: FloatArray
    normals: FloatArray
    rim: Lines
    sharp: Lines


def model_of(mesh: PolyMesh, n_vertices: int) -> Model:
    """Prepare a surface so that meshes can be fitted to it.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold surface.
    n_vertices : int
        About how many vertices the meshes will have.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> model = model_of(cube(), 8)
    >>> len(model.places), len(model.rim.points), len(model.sharp.points) > 10_000
    (8000, 0, True)
    """
    points, triangles = plain_triangles(mesh)
    number = min(max(_LEAST_SAMPLES, _SAMPLES_EACH * n_vertices), _MOST_SAMPLES)
    places, normals = area_samples(points, triangles, number)
    halfedges = build_halfedges(mesh)
    rim = halfedges.twin[halfedges.edge_halfedge] < 0
    sharp = ~rim & (_turning(mesh, halfedges) > np.radians(_SHARP_DEG))
    return Model(
        Surface(points, triangles),
        places,
        normals,
        rim=_along(mesh, halfedges.edge_halfedge[rim], halfedges),
        sharp=_along(mesh, _long_lines(mesh, halfedges.edge_halfedge[sharp], halfedges), halfedges),
    )


def line_edges(model: Model, mesh: PolyMesh, halfedges: Halfedges) -> BoolArray:
    """Return which edges of a mesh lie along the boundary or the sharp edges of its model, (E,).

    Parameters
    ----------
    model : Model
    mesh, halfedges
        A mesh that follows the model.
    """
    first = halfedges.edge_halfedge
    on = halfedges.twin[first] < 0
    if len(model.sharp.points):
        tail, head = (mesh.vertices[ends[first]] for ends in (halfedges.tail, halfedges.head))
        near = _ALONG * np.linalg.norm(head - tail, axis=1)
        for share in (0.25, 0.5, 0.75):
            near = np.where(
                model.sharp.nearest(tail + share * (head - tail))[1] <= near, near, -1.0
            )
        on |= near >= 0
    return on


def face_normals(mesh: PolyMesh) -> FloatArray:
    """Return the unit normal of each face, by its vector area, (F, 3)."""
    centre = face_centres(mesh)[face_of_corner(mesh)]
    here = mesh.vertices[mesh.indices] - centre
    spans = np.cross(here, here[next_corner(mesh)])
    return unit(np.add.reduceat(spans, mesh.offsets[:-1], axis=0))


def _turning(mesh: PolyMesh, halfedges: Halfedges) -> FloatArray:
    """Return by how much faces turn at each edge, in radians, (E,); any number at the boundary."""
    normal = face_normals(mesh)
    first = halfedges.edge_halfedge
    one, two = (normal[halfedges.face[side]] for side in (first, halfedges.twin[first]))
    cosine = np.einsum("nd,nd->n", one, two)
    angle: FloatArray = np.arccos(np.clip(cosine, -1.0, 1.0))
    return angle


def _long_lines(mesh: PolyMesh, side: IntArray, halfedges: Halfedges) -> IntArray:
    """Return those half-edges that hang together with enough others."""
    tail, head = halfedges.tail[side], halfedges.head[side]
    label = label_links(tail, head, mesh.n_vertices)[1][tail]
    length = np.linalg.norm(mesh.vertices[head] - mesh.vertices[tail], axis=1)
    together = np.bincount(label, weights=length, minlength=1)[label]
    return side[together >= _LONG * float(np.ptp(mesh.vertices, axis=0).max())]


def _along(mesh: PolyMesh, side: IntArray, halfedges: Halfedges) -> Lines:
    """Spread points along some half-edges, both ends included."""
    if not len(side):
        return Lines(np.zeros((0, 3)))
    tail, head = mesh.vertices[halfedges.tail[side]], mesh.vertices[halfedges.head[side]]
    length = np.linalg.norm(head - tail, axis=1)
    steps = 1 + np.ceil(_LINE_POINTS * length / length.sum()).astype(np.int64)
    edge = np.repeat(np.arange(len(side)), steps + 1)
    share = places_in_groups(steps + 1) / steps[edge]
    return Lines(tail[edge] + share[:, None] * (head - tail)[edge])
