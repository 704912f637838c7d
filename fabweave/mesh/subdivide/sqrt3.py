"""Subdivide by the root of three: a vertex in every face, and old edges flipped."""

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
    offsets_of,
)
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges, build_halfedges, pair_corners
from fabweave.mesh.one_rings import Rim, find_rim, name_some, sum_at, valences, with_rim_curve
from fabweave.mesh.polymesh import PolyMesh, face_centres


def sqrt3(
    mesh: PolyMesh, steps: int, *, limit: bool = True, progress: Progress = no_progress
) -> PolyMesh:
    """Subdivide a polygon mesh by √3.

    Each step puts a vertex into every face, joins those across old edges, and relaxes the old
    vertices. All faces become triangles, two for each inner edge. As in Kobbelt's scheme the
    boundary is left alone in odd steps, and cut in three in even ones, along the cubic B-spline
    curve of its vertices; a boundary vertex that lies in one face only is a corner and stays.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.
    steps : int
        Number of steps, from 1 on.
    limit : bool
        Whether vertices end where endless steps would take them.
    progress : callable
        Told of each step.

    Returns
    -------
    PolyMesh
        The old vertices first; triangles only.

    Raises
    ------
    CannotMakeError
        If two faces share more than one edge: their new vertices would be joined twice.

    Notes
    -----
    A closed triangle mesh keeps its exact 2/2 twill, or stays without one: the twists of the old
    edges go over to the new edges that cross them. A mesh in which two faces meet whose sizes are
    not multiples of three, such as any mesh of quads, does not get one. On an open triangle mesh
    the faces along the boundary prevent one after odd steps; after even steps regular meshes have
    theirs again.

    References
    ----------
    L. Kobbelt, "√3-subdivision", SIGGRAPH 2000.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> fine = sqrt3(octahedron(), 1)
    >>> fine.n_faces, (fine.vertices[0] * 7).round(9).tolist()
    (24, [3.0, 0.0, 0.0])
    """
    half = build_halfedges(mesh)
    _refuse_double(mesh, half)
    corner = find_rim(half, mesh.n_vertices).corner
    for step in range(steps):
        progress("sqrt3", step, steps)
        mesh = _split(_take(mesh, corner, cuts_rim=step % 2 == 1), mesh)
        corner = np.concatenate((corner, np.zeros(mesh.n_vertices - len(corner), dtype=bool)))
    return _limit(_take(mesh, corner, cuts_rim=steps % 2 == 1), mesh) if limit else mesh


@frozen_value
class _Step:
    """One step: where vertices go, and the new vertex that each half-edge is joined to.

    Parameters
    ----------
    half : Halfedges
    rim : Rim
        The mesh before.
    corner : (V,) bool array
        Boundary vertices that stay for good.
    vertices : (V, 3) float array
        Old vertices, moved.
    points : (N, 3) float array
        New vertices.
    side : (H,) int array
        The new vertex on the face's side of each half-edge, counted from 0 among the new.
    cut : (C,) int array
        Boundary half-edges that are cut in three.
    """

    half: Halfedges
    rim: Rim
    corner: BoolArray
    vertices: FloatArray
    points: FloatArray
    side: IntArray
    cut: IntArray


def _take(mesh: PolyMesh, corner: BoolArray, *, cuts_rim: bool) -> _Step:
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    count = valences(half, rim)
    alpha = _alpha(count)[:, None]
    around = sum_at(half.tail, mesh.vertices[half.head], mesh.n_vertices)
    vertices = (1 - alpha) * mesh.vertices + alpha * around / np.maximum(count, 1)[:, None]
    vertices = with_rim_curve(vertices, mesh, rim, corner, count, 4 / 27 if cuts_rim else 0.0)
    centres = face_centres(mesh)
    if not cuts_rim or not rim.on.any():
        cut = np.zeros(0, dtype=np.int64)
        return _Step(half, rim, corner, vertices, centres, half.face, cut)
    # A triangle at the boundary gets no vertex inside, but two on its boundary edge; after an
    # odd step every such face is a triangle and has one such edge.
    cut = np.flatnonzero(half.twin < 0)
    at_rim = np.zeros(mesh.n_faces, dtype=bool)
    at_rim[half.face[cut]] = True
    inner = ~at_rim
    side = (np.cumsum(inner) - 1)[half.face]
    first = int(inner.sum()) + np.arange(len(cut))
    side[half.prev[cut]] = first
    side[half.next[cut]] = first + len(cut)
    a, b = half.tail[cut], half.head[cut]
    thirds = [
        _third(mesh.vertices, rim.before[a], a, b, corner),
        _third(mesh.vertices, rim.after[b], b, a, corner),
    ]
    return _Step(half, rim, corner, vertices, np.concatenate([centres[inner], *thirds]), side, cut)


def _third(
    positions: FloatArray, before: IntArray, near: IntArray, far: IntArray, corner: BoolArray
) -> FloatArray:
    """Return the new curve point one third of the way from `near` to `far`."""
    # Beyond a corner the curve goes on straight.
    beyond = 2 * positions[near] - positions[far]
    beyond = np.where(corner[near, None], beyond, positions[before])
    return (beyond + 16 * positions[near] + 10 * positions[far]) / 27


def _split(step: _Step, mesh: PolyMesh) -> PolyMesh:
    """Make the triangles of a step."""
    half, count = step.half, mesh.n_vertices
    side = count + step.side
    halfedge = half.edge_halfedge[half.twin[half.edge_halfedge] >= 0]
    twin = half.twin[halfedge]
    pairs = np.empty((len(halfedge), 2, 3), dtype=np.int64)
    pairs[:, 0] = np.stack([half.tail[halfedge], side[twin], side[halfedge]], axis=1)
    pairs[:, 1] = np.stack([half.head[halfedge], side[halfedge], side[twin]], axis=1)
    if len(step.cut):
        cut = step.cut
        left, right = side[half.prev[cut]], side[half.next[cut]]
        rest = np.stack([left, right, half.tail[half.prev[cut]]], axis=1)
    else:
        rim = np.flatnonzero(half.twin < 0)
        rest = np.stack([half.tail[rim], half.head[rim], side[rim]], axis=1)
    faces = np.concatenate([pairs.reshape(-1, 3), rest])
    vertices = np.concatenate([step.vertices, step.points])
    return PolyMesh(vertices, offsets_of(np.full(len(faces), 3)), faces.reshape(-1))


def _limit(step: _Step, mesh: PolyMesh) -> PolyMesh:
    """Move the vertices to where endless steps would take them, given the next step.

    After that step an inner vertex has ordinary triangles only around it, where the limit is
    Kobbelt's mask over the vertex and its new ring.
    """
    half, count = step.half, mesh.n_vertices
    before = step.side[half.prev]
    # In a triangle whose boundary edge is cut, the corner opposite sees two new vertices.
    double = np.flatnonzero((before != step.side) & (half.twin >= 0) & (half.twin[half.prev] >= 0))
    tail = np.concatenate([half.tail, half.tail[double]])
    seen = np.concatenate([step.side, before[double]])
    number = np.bincount(tail, minlength=count)
    ring = sum_at(tail, step.points[seen], count) / np.maximum(number, 1)[:, None]
    weight = 3 * _alpha(number)[:, None]
    limit = (step.vertices + weight * ring) / (1 + weight)
    limit = with_rim_curve(limit, mesh, step.rim, step.corner, number, 1 / 6)
    return mesh.with_vertices(limit)


def _alpha(valence: IntArray) -> FloatArray:
    """Return how far an inner vertex goes towards the mean of its neighbours in one step."""
    return (4 - 2 * np.cos(2 * np.pi / np.maximum(valence, 2))) / 9


def _refuse_double(mesh: PolyMesh, half: Halfedges) -> None:
    """Refuse meshes in which two faces share several edges."""
    halfedge = half.edge_halfedge[half.twin[half.edge_halfedge] >= 0]
    order, starts = pair_corners(half.face[halfedge], half.face[half.twin[halfedge]], mesh.n_faces)
    crowded = np.flatnonzero(np.diff(starts) > 1)
    if len(crowded):
        ends = np.unique(half.tail[halfedge[order[starts[crowded]]]])
        raise CannotMakeError(
            f"{len(crowded)} pairs of faces share more than one edge (at {name_some(ends)}), and "
            "√3 subdivision would join their middles twice; merge the common edges, or refine with "
            "catmull-clark first"
        )
