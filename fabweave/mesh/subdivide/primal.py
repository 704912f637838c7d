"""Split every n-gon into n corner triangles and an n-gon: linearly, or smoothly as Loop does."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, offsets_of
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import (
    Rim,
    edge_middles,
    face_sums,
    find_rim,
    name_some,
    sum_at,
    valences,
    with_rim_curve,
)
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
    return _with_quads(mesh, half, _catmull_points(mesh, half, find_rim(half, mesh.n_vertices)))


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
        vertex, edge, face = _catmull_points(mesh, half, rim)
        ring = 4 * edge[half.edge] + face[half.face]
    valence = valences(half, rim)
    count = valence[:, None]
    around = sum_at(half.tail, ring, mesh.n_vertices)
    limit = (count**2 * vertex + around) / np.maximum(count * (count + 5), 1)
    return mesh.with_vertices(with_rim_curve(limit, mesh, rim, rim.corner, valence, 1 / 6))


def _catmull_points(mesh: PolyMesh, half: Halfedges, rim: Rim) -> list[FloatArray]:
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


def mid_edge(mesh: PolyMesh) -> PolyMesh:
    """Cut the corners off every n-gon through the middles of its edges.

    Every n-gon becomes n corner triangles and an n-gon in the middle, a triangle four triangles.
    The shape stays as it is.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The old vertices, then one for each edge in the order of edge numbers; one triangle for
        each old corner, then one polygon for each old face.

    Raises
    ------
    CannotMakeError
        If an inner vertex has only two edges: its two corner triangles would fall on each other.

    Notes
    -----
    The result always has an exact twill: see `mid_edge_twist`.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 7.

    Examples
    --------
    >>> triangle = PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> mid_edge(triangle).faces()
    [[0, 3, 5], [1, 4, 3], [2, 5, 4], [3, 4, 5]]
    """
    half = build_halfedges(mesh)
    _refuse_two_edges(half, find_rim(half, mesh.n_vertices))
    return _with_middles(mesh, half, [mesh.vertices, edge_middles(mesh, half)])


def mid_edge_twist(halfedges: Halfedges, n_old_vertices: int) -> BoolArray:
    """Return the twist senses that make an exact twill of a mid-edge subdivision.

    Halves of old edges twist one way, the sides of the inner polygons the other way.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity of a mesh that `mid_edge` or `loop` made.
    n_old_vertices : int
        Number of vertices of the mesh before that step.

    Returns
    -------
    (E,) bool array
        Twist sense of each edge.

    References
    ----------
    Akleman et al. (2011), theorem 7.1.

    Examples
    --------
    >>> triangle = PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 2, 0]], [[0, 1, 2]])
    >>> fine = build_halfedges(mid_edge(triangle))
    >>> int(mid_edge_twist(fine, 3).sum()), fine.n_edges
    (6, 9)
    """
    first = halfedges.edge_halfedge
    # Every half of an old edge has one old end; the sides of inner polygons have none.
    return (halfedges.tail[first] < n_old_vertices) | (halfedges.head[first] < n_old_vertices)


def loop(mesh: PolyMesh) -> PolyMesh:
    """Take one step of Loop subdivision, carried over to polygon meshes.

    Triangles get Loop's masks. At larger faces the mean of the face's other corners takes the
    place of the triangle's other corners: an inner edge takes 3/8 of each end and 1/8 of that
    mean on either side, an inner vertex Loop's share of its faces' means. Around the n-gons that
    stay, each step shrinks to 0.5 (triangles), 0.63 (quads) or 0.75 (hexagons), alike in both
    directions, and anything else faster: so the surface has a tangent plane there.

    The boundary follows the cubic B-spline curve of its vertices; a boundary vertex that lies in
    one face only is a corner and stays.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The connectivity of `mid_edge`, smooth.

    Raises
    ------
    CannotMakeError
        As `mid_edge`.

    Notes
    -----
    The result always has an exact twill: see `mid_edge_twist`.

    References
    ----------
    C. Loop, "Smooth subdivision surfaces based on triangles", master's thesis, University of
    Utah (1987).

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> (loop(octahedron()).vertices[[0, 6]] * 64).round(9).tolist()
    [[33.0, 0.0, 0.0], [24.0, 24.0, 0.0]]
    """
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    _refuse_two_edges(half, rim)
    return _with_middles(mesh, half, _new_points(mesh, half, rim))


def loop_limit(mesh: PolyMesh) -> PolyMesh:
    """Move every vertex to where endless Loop steps would take it.

    Among triangles the limit of a vertex is a known mask over its neighbours. On other meshes the
    limit is that after one more step, which leaves only triangles around every old vertex. So the
    result does not depend on how many steps were taken before, on any polygon mesh.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        The same faces.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> (loop_limit(octahedron()).vertices[0] * 55).round(9).tolist()
    [24.0, 0.0, 0.0]
    """
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    if np.all(mesh.face_sizes == 3):
        vertex, ring = mesh.vertices, mesh.vertices[half.head]
    else:
        vertex, edge = _new_points(mesh, half, rim)
        ring = edge[half.edge]
    count = valences(half, rim)
    around = sum_at(half.tail, ring, mesh.n_vertices)
    weight = (1 / (count + 3 / (8 * _beta(count))))[:, None]
    limit = (1 - count[:, None] * weight) * vertex + weight * around
    return mesh.with_vertices(with_rim_curve(limit, mesh, rim, rim.corner, count, 1 / 6))


def _beta(valence: IntArray) -> FloatArray:
    """Return the weight of each neighbour of an inner vertex in a step of Loop subdivision."""
    n = np.maximum(valence, 2)
    return (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n


def _new_points(mesh: PolyMesh, half: Halfedges, rim: Rim) -> list[FloatArray]:
    """Return the vertex and edge points of one step, (V, 3) and (E, 3)."""
    positions = mesh.vertices
    first = half.edge_halfedge
    edge = edge_middles(mesh, half)
    inner = half.twin[first] >= 0
    halfedge = first[inner]
    sizes = mesh.face_sizes[half.face, None]
    sums = face_sums(mesh)[half.face]
    tail = positions[half.tail]
    ends = tail + positions[half.head]
    side = 3 / 16 * ends + (sums - ends) / (8 * (sizes - 2))
    edge[inner] = side[halfedge] + side[half.twin[halfedge]]
    count = valences(half, rim)
    beta = _beta(count)[:, None]
    around = sum_at(half.tail, (sums - tail) / (sizes - 1), mesh.n_vertices)
    vertex = (1 - count[:, None] * beta) * positions + beta * around
    return [with_rim_curve(vertex, mesh, rim, rim.corner, count, 1 / 8), edge]


def _with_middles(mesh: PolyMesh, half: Halfedges, points: list[FloatArray]) -> PolyMesh:
    """Join vertex and edge points to corner triangles and inner polygons."""
    middle = mesh.n_vertices + half.edge
    triangles = np.empty((half.n_halfedges, 3), dtype=np.int64)
    triangles[:, 0] = half.tail
    triangles[:, 1] = middle
    triangles[:, 2] = middle[half.prev]
    sizes = np.concatenate((np.full(half.n_halfedges, 3), mesh.face_sizes))
    indices = np.concatenate((triangles.reshape(-1), middle))
    return PolyMesh(np.concatenate(points), offsets_of(sizes), indices)


def _refuse_two_edges(half: Halfedges, rim: Rim) -> None:
    thin = np.flatnonzero(~rim.on & (valences(half, rim) == 2))
    if len(thin):
        raise CannotMakeError(
            f"{len(thin)} inner vertices have only two edges ({name_some(thin)}), and cutting "
            "corners there would put two triangles on top of each other; join the two edges at "
            "each, or refine with catmull-clark or quads"
        )
