"""Split every n-gon into n quads: linearly, or as Catmull and Clark do."""

import numpy as np

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import Rim, edge_middles, find_rim, sum_at, valences, with_rim_curve
from fabweave.mesh.polymesh import PolyMesh, face_centres


def split_to_quads(mesh: PolyMesh) -> PolyMesh:
    """Split every n-gon into n quads and leave the shape as it is.

    New vertices stand at the middle of each edge and at the mean of the corners of each face.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The old vertices, one for each edge in the order of edge numbers, one for each face; one
        quad for each old corner.

    Examples
    --------
    >>> square = PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], [[0, 1, 2, 3]])
    >>> split_to_quads(square).faces()[0], split_to_quads(square).vertices[8].tolist()
    ([0, 4, 8, 7], [1.0, 1.0, 0.0])
    """
    half = build_halfedges(mesh)
    points = [mesh.vertices, edge_middles(mesh, half), face_centres(mesh)]
    return _with_quads(mesh, half, points)


def catmull_clark(mesh: PolyMesh) -> PolyMesh:
    """Take one step of Catmull–Clark subdivision on a polygon mesh.

    The boundary follows the cubic B-spline curve of its vertices; a boundary vertex that lies in
    one face only is a corner and stays.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The old vertices, one for each edge in the order of edge numbers, one for each face; one
        quad for each old corner.

    Notes
    -----
    A grid of quads on a torus gets an exact 2/2 twill from any step, and keeps it. On other closed
    meshes no step repairs a face or a vertex whose size is not a multiple of four, which prevents
    one.

    References
    ----------
    E. Catmull, J. Clark, "Recursively generated B-spline surfaces on arbitrary topological
    meshes", Computer-Aided Design 10 (1978). Boundaries: A. Nasri, "Polyhedral subdivision
    methods for free-form surfaces", ACM TOG 6 (1987).

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> (catmull_clark(cube()).vertices[0] * 9).round(9).tolist()
    [-5.0, -5.0, -5.0]
    """
    half = build_halfedges(mesh)
    return _with_quads(mesh, half, _new_points(mesh, half, find_rim(half, mesh.n_vertices)))


def catmull_clark_limit(mesh: PolyMesh) -> PolyMesh:
    """Move every vertex to where endless Catmull–Clark steps would take it.

    Among quads the limit of a vertex p is the known mask (n² p + 4 Σ e + Σ f) / (n (n + 5)), over
    its n neighbours e and the opposite corners f. On other meshes the limit is that after one more
    step, which makes quads of all faces. So the result does not depend on how many steps were taken
    before, on any polygon mesh.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The same faces.

    References
    ----------
    M. Halstead, M. Kass, T. DeRose, "Efficient, fair interpolation using Catmull-Clark
    surfaces", SIGGRAPH 1993.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> catmull_clark_limit(cube()).vertices[0].round(9).tolist()
    [-0.5, -0.5, -0.5]
    """
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    if np.all(mesh.face_sizes == 4):
        vertex = mesh.vertices
        corners = vertex[mesh.indices].reshape(-1, 4, 3)
        ring = 4 * np.roll(corners, -1, axis=1) + np.roll(corners, -2, axis=1)
        ring = ring.reshape(-1, 3)
    else:
        vertex, edge, face = _new_points(mesh, half, rim)
        ring = 4 * edge[half.edge] + face[half.face]
    valence = valences(half, rim)
    count = valence[:, None]
    around = sum_at(half.tail, ring, mesh.n_vertices)
    limit = (count**2 * vertex + around) / np.maximum(count * (count + 5), 1)
    return mesh.with_vertices(with_rim_curve(limit, mesh, rim, rim.corner, valence, 1 / 6))


def _new_points(mesh: PolyMesh, half: Halfedges, rim: Rim) -> list[FloatArray]:
    """Return the vertex, edge and face points of one step, (V, 3), (E, 3) and (F, 3)."""
    face = face_centres(mesh)
    middle = edge_middles(mesh, half)
    edge = middle.copy()
    inner = half.twin[half.edge_halfedge] >= 0
    halfedge = half.edge_halfedge[inner]
    sides = face[half.face[halfedge]] + face[half.face[half.twin[halfedge]]]
    edge[inner] = middle[inner] / 2 + sides / 4
    # Every edge at an inner vertex leaves it as one half-edge.
    around = sum_at(half.tail, face[half.face] + 2 * middle[half.edge], mesh.n_vertices)
    valence = np.bincount(half.tail, minlength=mesh.n_vertices)
    count = np.maximum(valence, 1)[:, None]
    vertex = (around / count + (count - 3) * mesh.vertices) / count
    return [with_rim_curve(vertex, mesh, rim, rim.corner, valence, 1 / 8), edge, face]


def _with_quads(mesh: PolyMesh, half: Halfedges, points: list[FloatArray]) -> PolyMesh:
    """Join vertex, edge and face points to one quad for each corner."""
    quads = np.empty((half.n_halfedges, 4), dtype=np.int64)
    quads[:, 0] = half.tail
    quads[:, 1] = mesh.n_vertices + half.edge
    quads[:, 2] = mesh.n_vertices + half.n_edges + half.face
    quads[:, 3] = mesh.n_vertices + half.edge[half.prev]
    offsets = offsets_of(np.full(half.n_halfedges, 4))
    return PolyMesh(np.concatenate(points), offsets, quads.reshape(-1))
