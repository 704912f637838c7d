"""Refine meshes: schemes that split edges, faces or corners, and chains of them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TypeAlias

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    no_progress,
    offsets_of,
    places_in_groups,
)
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import (
    Rim,
    corners_in_turn,
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
    return mesh.with_vertices(with_rim_curve(limit, mesh, rim, valence, 1 / 6))


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
    return [with_rim_curve(vertex, mesh, rim, valence, 1 / 8), edge, face]


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
    return mesh.with_vertices(with_rim_curve(limit, mesh, rim, count, 1 / 6))


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
    return [with_rim_curve(vertex, mesh, rim, count, 1 / 8), edge]


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


def doo_sabin(mesh: PolyMesh) -> PolyMesh:
    """Take one step of Doo–Sabin subdivision on a polygon mesh.

    Every corner becomes a vertex; every face, inner edge and inner vertex becomes a face. The
    centre of each face already lies on the limit surface.

    The boundary stays in its place: its polygon is cut as by Chaikin, and the new corners of a
    boundary vertex are spread evenly along the cut; a boundary vertex that lies in one face only
    is a corner and stays. New vertices next to the boundary and to corners stand half-way, as
    the biquadratic B-spline with threefold end knots has them.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        One vertex for each old corner; the shrunk old faces, then one quad for each inner edge in
        the order of edge numbers, then one polygon for each inner vertex (none where it has only
        two edges, where the quads meet).

    Notes
    -----
    On a closed mesh this is the dual of what Catmull–Clark makes, so it has the same threads and an
    exact 2/2 twill exactly where that has one. Neither repairs a face or a vertex whose size is not
    a multiple of four; grids of quads on tori get a twill from any step.

    References
    ----------
    D. Doo, M. Sabin, "Behaviour of recursive division surfaces near extraordinary points",
    Computer-Aided Design 10 (1978).

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> fine = doo_sabin(cube())
    >>> fine.n_vertices, fine.n_faces, fine.vertices[0].round(9).tolist()
    (24, 26, [-0.5, -0.5, -1.0])
    """
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    offsets, corners = corners_in_turn(half, mesh.n_vertices)
    halfedge = half.edge_halfedge[half.twin[half.edge_halfedge] >= 0]
    twin = half.twin[halfedge]
    quads = np.stack([halfedge, half.next[twin], twin, half.next[halfedge]], axis=1)
    polygon = ~rim.on & (np.diff(offsets) >= 3)
    around = np.repeat(polygon, np.diff(offsets))
    sizes = [mesh.face_sizes, np.full(len(halfedge), 4), np.diff(offsets)[polygon]]
    indices = [np.arange(half.n_halfedges), quads.reshape(-1), corners[around]]
    points = _corner_points(mesh, half, rim, offsets, corners)
    return PolyMesh(points, offsets_of(np.concatenate(sizes)), np.concatenate(indices))


def _corner_points(
    mesh: PolyMesh, half: Halfedges, rim: Rim, offsets: IntArray, corners: IntArray
) -> FloatArray:
    """Return the Doo–Sabin point of each corner, (H, 3)."""
    positions = mesh.vertices
    sizes = mesh.face_sizes[half.face, None]
    # The weights (3 + 2 cos) / 4n, and 1/4 more for the corner itself.
    points = (
        positions[half.tail] / 4
        + 3 / 4 * face_centres(mesh)[half.face]
        + _first_wave(mesh) / (2 * sizes)
    )
    if not rim.on.any():
        return points
    points = _halved_at_rim(points, half, rim)
    count = np.diff(offsets)
    place = places_in_groups(count)
    along = place / np.maximum(np.repeat(count, count) - 1, 1)
    chosen = rim.on[half.tail[corners]]
    corner, along = corners[chosen], along[chosen, None]
    here = half.tail[corner]
    first = _cut(positions, rim, here, rim.after[here])
    last = _cut(positions, rim, here, rim.before[here])
    spread = (1 - along) * first + along * last
    points[corner] = np.where(rim.corner[here, None], positions[here], spread)
    return points


def _cut(positions: FloatArray, rim: Rim, near: IntArray, far: IntArray) -> FloatArray:
    """Return where the boundary polygon is cut next to its vertex `near`."""
    # At a corner that stays, the curve has a threefold end knot.
    share = np.where(rim.corner[far], 1 / 2, 1 / 4)[:, None]
    return (1 - share) * positions[near] + share * positions[far]


def _first_wave(mesh: PolyMesh) -> FloatArray:
    """Return Σ_j p_j cos(2π (j - k) / n) for corner k of each n-gon with corners p, (H, 3).

    The Doo–Sabin weights are made of this, so they cost no more for large faces.
    """
    sizes = mesh.face_sizes
    start = mesh.offsets[:-1]
    number = places_in_groups(sizes)
    angle = (number * np.repeat(2 * np.pi / sizes, sizes))[:, None]
    corners = mesh.vertices[mesh.indices]
    wave = np.zeros_like(corners)
    for part in (np.cos(angle), np.sin(angle)):
        wave += part * np.repeat(np.add.reduceat(part * corners, start, axis=0), sizes, axis=0)
    return wave


def _halved_at_rim(points: FloatArray, half: Halfedges, rim: Rim) -> FloatArray:
    """Move new corners next to a boundary edge of their face half-way to its ends."""
    edge = np.flatnonzero(half.twin < 0)
    inner = np.concatenate([half.prev[edge], half.next[half.next[edge]]])
    outer = np.concatenate([edge, half.next[edge]])
    keep = ~rim.on[half.tail[inner]]
    inner, outer = inner[keep], outer[keep]
    number = np.bincount(inner, minlength=len(points))
    total = sum_at(inner, points[outer], len(points))
    moved = points.copy()
    near = number > 0
    moved[near] = (points[near] + total[near] / number[near, None]) / 2
    # Opposite a quad's corner both directions are halved.
    corner = np.flatnonzero(rim.corner[half.tail])
    ring = [corner, half.next[corner], half.next[half.next[corner]], half.prev[corner]]
    quad = (half.next[ring[2]] == ring[3]) & ~rim.on[half.tail[ring[2]]]
    moved[ring[2][quad]] = sum(points[side[quad]] for side in ring) / 4
    return moved


def simplest(mesh: PolyMesh) -> PolyMesh:
    """Take one step of the simplest subdivision: join the middles of edges.

    Every edge becomes a vertex at its middle; every face and inner vertex becomes a face. Two
    steps do about what one step of Doo–Sabin does. The centre of each face already lies on the
    limit surface.

    The boundary stays in its place, and two steps cut its polygon as Chaikin does: a boundary
    vertex between two faces takes over the middle of the edge between them; one with more faces
    or with triangles stays as the tip of a new face. Boundary vertices that lie in one face only
    are cut off, and the faces at their neighbours are closed straight.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh
        One vertex for each edge in the order of edge numbers, then the boundary vertices that
        stay; the shrunk old faces, then polygons around old vertices.

    Notes
    -----
    Two steps make the connectivity of one Doo–Sabin step on a closed mesh, and so an exact 2/2
    twill exactly where that makes one. A single step need not: on a torus of m × n quads its
    threads have 2m and 2n crossings, so that m and n must both be even.

    References
    ----------
    J. Peters, U. Reif, "The simplest subdivision scheme for smoothing polyhedra", ACM TOG 16
    (1997).

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> cuboctahedron = simplest(cube())
    >>> cuboctahedron.n_vertices, sorted(cuboctahedron.face_sizes.tolist())
    (12, [3, 3, 3, 3, 3, 3, 3, 3, 4, 4, 4, 4, 4, 4])
    """
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    offsets, corners = corners_in_turn(half, mesh.n_vertices)
    count = np.diff(offsets)
    straight = rim.on & (count >= 2) & (rim.corner[rim.before] | rim.corner[rim.after])
    notched, inner_edge = _notches(half, rim, straight, offsets, corners)
    tips = np.flatnonzero(rim.on & ~rim.corner & ~straight & ~notched)
    points = edge_middles(mesh, half)
    points[inner_edge[notched]] = mesh.vertices[notched]

    # Around a vertex: the edges that leave it in turn, at the boundary the last one as well, and
    # the vertex itself where it stays as a tip.
    inner = ~rim.on & (count >= 3)
    closed = inner | straight
    closed[tips] = True
    extra = np.where(rim.on, 1, 0)
    extra[tips] = 2
    sizes = np.where(closed, count + extra, 0)
    starts = offsets_of(sizes)
    around = np.full(starts[-1], -1, dtype=np.int64)
    owner = half.tail[corners]
    place = np.arange(half.n_halfedges) - offsets[owner]
    drawn = closed[owner]
    around[(starts[owner] + place)[drawn]] = half.edge[corners[drawn]]
    ends = np.flatnonzero(closed & rim.on)
    around[starts[ends] + count[ends]] = half.edge[half.prev[corners[offsets[ends + 1] - 1]]]
    around[starts[tips + 1] - 1] = half.n_edges + np.arange(len(tips))
    return PolyMesh(
        np.concatenate([points, mesh.vertices[tips]]),
        offsets_of(np.concatenate([mesh.face_sizes, sizes[closed]])),
        np.concatenate([half.edge, around]),
    )


def _notches(
    half: Halfedges, rim: Rim, straight: BoolArray, offsets: IntArray, corners: IntArray
) -> tuple[BoolArray, IntArray]:
    """Find the boundary vertices that get no face, and the one inner edge of each.

    Those are the ones between two faces that are not triangles, unless the inner edge leads to
    another such: then the two faces would meet in a single point.
    """
    between = rim.on & (np.diff(offsets) == 2) & ~straight
    # A triangle could lose both its inner middles to the boundary, and with them its area.
    between[half.tail[half.next[half.next[half.next]] == np.arange(half.n_halfedges)]] = False
    inward = np.zeros(len(rim.on), dtype=np.int64)
    inward[between] = corners[offsets[:-1][between] + 1]
    notched = between & ~between[half.head[inward]]
    return notched, half.edge[inward]


#: Largest result that is begun, in edges.
MOST_EDGES = 8_000_000
_MOST_STEPS = 100

_Step: TypeAlias = Callable[[PolyMesh], PolyMesh]


@dataclass(frozen=True)
class Scheme:
    """One way to refine a mesh.

    Parameters
    ----------
    name : str
    growth : int
        How many edges come of one in a step, at the boundary perhaps fewer.
    step : callable
        Takes a mesh and returns it after a step.
    limit : callable or None
        Moves the vertices to where endless steps would take them.
    smooth : bool
        Whether it rounds the shape; else the shape stays as it is.
    """

    name: str
    growth: int
    step: _Step
    limit: _Step | None = None
    smooth: bool = True

    def run(self, mesh: PolyMesh, steps: int, *, to_limit: bool, progress: Progress) -> PolyMesh:
        """Return a mesh after some steps, on the limit surface if asked and known."""
        for number in range(steps):
            progress(self.name, number, steps)
            mesh = self.step(mesh)
        return self.limit(mesh) if to_limit and self.limit else mesh


#: All schemes, in the order in which they are listed.
SCHEMES = (
    Scheme("catmull-clark", 4, catmull_clark, catmull_clark_limit),
    Scheme("doo-sabin", 4, doo_sabin),
    Scheme("simplest", 2, simplest),
    Scheme("loop", 4, loop, loop_limit),
    Scheme("mid-edge", 4, mid_edge, smooth=False),
    Scheme("quads", 4, split_to_quads, smooth=False),
)


@dataclass(frozen=True)
class Refinement:
    """Some steps of one scheme.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    steps : int
        Number of steps.

    Raises
    ------
    InputError
        If there is no such scheme, or the number is out of range.
    """

    scheme: str
    steps: int = 1

    def __post_init__(self) -> None:
        """Check both."""
        find_scheme(self.scheme)
        if not 1 <= self.steps <= _MOST_STEPS:
            raise InputError(f"{self.scheme} takes from 1 to {_MOST_STEPS} steps, not {self.steps}")


def find_scheme(name: str) -> Scheme:
    """Return the scheme of a name.

    Raises
    ------
    InputError
        If there is none; the message lists them.

    Examples
    --------
    >>> find_scheme("mid-edge").smooth
    False
    """
    for scheme in SCHEMES:
        if scheme.name == name:
            return scheme
    names = ", ".join(scheme.name for scheme in SCHEMES)
    raise InputError(f"there is no refinement {name[:40]!r}; choose one of {names}")


def parse_refinements(text: str) -> tuple[Refinement, ...]:
    """Read a chain of refinements.

    Parameters
    ----------
    text : str
        Schemes joined by commas, each with a colon and a number of steps, or one step without.

    Returns
    -------
    tuple of Refinement
        In the order in which they are taken; empty for an empty text.

    Raises
    ------
    InputError
        If a scheme or a number is wrong; the message says what is right.

    Examples
    --------
    >>> parse_refinements("simplest,catmull-clark:2")
    (Refinement(scheme='simplest', steps=1), Refinement(scheme='catmull-clark', steps=2))
    """
    result = []
    for part in text.split(",") if text.strip() else ():
        name, colon, number = (piece.strip() for piece in part.partition(":"))
        scheme = find_scheme(name)
        if colon and not (number.isascii() and number.isdigit() and len(number) < 10):
            raise InputError(
                f"{part.strip()[:60]!r} should read {scheme.name}:STEPS, such as {scheme.name}:2"
            )
        result.append(Refinement(scheme.name, int(number) if colon else 1))
    return tuple(result)


def format_refinements(refinements: Sequence[Refinement]) -> str:
    """Return the text that `parse_refinements` reads as these refinements.

    Examples
    --------
    >>> format_refinements([Refinement("simplest"), Refinement("catmull-clark", 2)])
    'simplest:1,catmull-clark:2'
    """
    return ",".join(f"{item.scheme}:{item.steps}" for item in refinements)


def refine_mesh(
    mesh: PolyMesh, refinements: Sequence[Refinement], *, progress: Progress = no_progress
) -> PolyMesh:
    """Refine a mesh, one refinement after the other.

    Smooth schemes that have a limit mask for vertices end on the limit surface. That step is
    left out where another smooth scheme follows, which goes on from the control mesh; steps of
    one scheme that follow each other count as one refinement.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh, as `prepare_mesh` returns it; boundaries are allowed.
    refinements : sequence of Refinement
        What to do.
    progress : callable
        Told of each step.

    Returns
    -------
    PolyMesh
        The refined mesh: oriented, manifold, with the components, the genus and the boundary
        loops of the old one.

    Raises
    ------
    CannotMakeError
        If the result would have more than `MOST_EDGES` edges, or a scheme cannot hold the mesh.
    InputError
        If the mesh is not an oriented manifold.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> ball = refine_mesh(cube(), parse_refinements("catmull-clark:2"))
    >>> ball.n_vertices, ball.n_faces
    (98, 96)
    """
    growth = math.prod(find_scheme(item.scheme).growth ** item.steps for item in refinements)
    if growth * mesh.n_corners // 2 > MOST_EDGES:
        raise CannotMakeError(
            f"refining {mesh.n_faces} faces with {format_refinements(refinements)} would give "
            f"more than {MOST_EDGES} edges; take fewer steps"
        )
    runs = [
        (find_scheme(name), sum(item.steps for item in items))
        for name, items in groupby(refinements, key=lambda item: item.scheme)
    ]
    for number, (scheme, steps) in enumerate(runs):
        followed = number + 1 < len(runs) and runs[number + 1][0].smooth
        mesh = scheme.run(mesh, steps, to_limit=not followed, progress=progress)
    return mesh
