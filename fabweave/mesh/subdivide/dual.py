"""Subdivide by cutting corners: Doo–Sabin, and the simplest scheme of Peters and Reif."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, offsets_of, places_in_groups
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import Rim, corners_in_turn, edge_middles, find_rim, sum_at
from fabweave.mesh.polymesh import PolyMesh, face_centres


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
