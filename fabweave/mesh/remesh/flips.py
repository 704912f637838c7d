"""Turn edges of a mesh of triangles, so that more vertices have six of them."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.model import Model, line_edges

#: Edges at a regular vertex inside, and on the boundary.
REGULAR, REGULAR_RIM = 6, 4
#: What a flip must gain at least, ...
_LEAST_GAIN = 0.5
#: ... where the sum of (valence - 6)² counts 1, a new edge that is off the model by a tenth of the
#: edge's length more than the old one -_OFF/10, one that is longer by half -_LONGER/2, and the
#: quality of the worse triangle (from 0 to 1) _SHAPE.
_OFF, _LONGER, _SHAPE = 20.0, 2.0, 8.0
#: New triangles look the way of the old ones up to this angle (degrees) unless those differed more,
#: and never farther than this cosine; they are no flatter than this unless the old ones were.
_TURN_DEG, _SIDEWAYS, _FLAT = 60.0, 0.1, 0.35
#: Rounds of flips that are made at once.
_MOST_ROUNDS = 50


def flip_edges(model: Model, mesh: PolyMesh) -> PolyMesh:
    """Flip edges between two triangles, while that brings the valences nearer to six.

    A flip must gain more than it costs: it is dearer the farther the new edge is from the model
    and the longer it is. Edges on the boundary and along sharp edges of the model stay, no vertex
    gets fewer than four edges (three on the boundary), and no normal is turned over. In each round
    the best flips are made that share no vertex.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        An oriented manifold of triangles near it.

    Returns
    -------
    PolyMesh
        As many triangles, on the same vertices.

    Examples
    --------
    >>> from fabweave.mesh.remesh.model import model_of
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> from fabweave.mesh.triangulate import triangulate
    >>> flat = triangulate(hypar(4, 4, 40.0, 0.0))
    >>> flip_edges(model_of(flat, 25), flat).n_faces
    32
    """
    for _ in range(_MOST_ROUNDS):
        halfedges = build_halfedges(mesh)
        gain, quads = _gains(model, mesh, halfedges)
        chosen = _best_apart(gain, quads, mesh.n_vertices)
        flipped = _flipped(mesh, halfedges, chosen, quads[chosen])
        # Flips after which the surface would run through itself are left out.
        spoilt = np.isin(np.arange(mesh.n_faces), self_intersections(flipped))
        first = halfedges.edge_halfedge[chosen]
        sound = ~spoilt[halfedges.face[first]] & ~spoilt[halfedges.face[halfedges.twin[first]]]
        if not sound.any():
            break
        mesh = _flipped(mesh, halfedges, chosen[sound], quads[chosen[sound]])
    return mesh


def _gains(model: Model, mesh: PolyMesh, halfedges: Halfedges) -> tuple[FloatArray, IntArray]:
    """Return what flipping each edge gains, (E,), and the corners around it, (E, 4)."""
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    # From a to b, with c on the left and d on the right.
    quads = np.column_stack(
        [
            halfedges.tail[first],
            halfedges.head[first],
            halfedges.tail[halfedges.prev[first]],
            halfedges.tail[halfedges.prev[twin]],
        ]
    )
    a, b, c, d = (mesh.vertices[quads[:, k]] for k in range(4))
    edge = np.linalg.norm(b - a, axis=1)
    new = np.linalg.norm(d - c, axis=1)
    gain = _valence_gain(mesh, halfedges, quads)
    off = model.surface.feet(np.concatenate([(a + b) / 2, (c + d) / 2])).distances
    before, after = off[: len(quads)], off[len(quads) :]
    gain -= _OFF * (after - before) / edge + _LONGER * np.maximum(new / edge - 1.0, 0.0)
    once, then = (
        np.minimum(quality(a, b, c), quality(b, a, d)),
        np.minimum(quality(c, d, b), quality(d, c, a)),
    )
    gain += _SHAPE * (then - once)
    gain[(then < np.minimum(_FLAT, once)) | ~_keeps_side(a, b, c, d)] = -np.inf
    # Another edge between c and d would make two faces lie on one another.
    low, high = np.sort(quads[:, :2], axis=1).T, np.sort(quads[:, 2:], axis=1).T
    taken = np.isin(high[0] * mesh.n_vertices + high[1], low[0] * mesh.n_vertices + low[1])
    gain[taken | line_edges(model, mesh, halfedges)] = -np.inf
    return gain, quads


def _valence_gain(mesh: PolyMesh, halfedges: Halfedges, quads: IntArray) -> FloatArray:
    """Return by how much each flip lowers the sum of squares; -inf where too few edges remain."""
    count = mesh.n_vertices
    rim = np.zeros(count, dtype=bool)
    rim[halfedges.tail[halfedges.twin < 0]] = True
    valence = np.bincount(halfedges.tail, minlength=count) + rim
    excess = valence - np.where(rim, REGULAR_RIM, REGULAR)
    change = np.array([-1, -1, 1, 1])
    now = excess[quads]
    gain = np.sum(now**2 - (now + change) ** 2, axis=1).astype(np.float64)
    least = np.where(rim, 3, 4)[quads[:, :2]]
    gain[np.any(valence[quads[:, :2]] - 1 < least, axis=1)] = -np.inf
    return gain


def _keeps_side(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> BoolArray:
    """Return which flips turn no normal away from the mean of the old ones."""
    old = [np.cross(b - a, c - a), np.cross(a - b, d - b)]
    new = [np.cross(d - c, b - c), np.cross(c - d, a - d)]
    mean = unit(old[0] + old[1])
    once, then = (
        np.minimum(*(np.einsum("nd,nd->n", unit(normal), mean) for normal in normals))
        for normals in (old, new)
    )
    result: BoolArray = (then > np.minimum(np.cos(np.radians(_TURN_DEG)), once)) & (
        then > _SIDEWAYS
    )
    return result


def quality(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return how good triangles are: 1 where equilateral, 0 without area, (N,).

    Examples
    --------
    >>> corners = np.eye(3)[:, None]
    >>> float(round(quality(*corners)[0], 12))
    1.0
    """
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    sides = sum(np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a)))
    result: FloatArray = 2 * np.sqrt(3.0) * area / np.where(sides > 0, sides, 1.0)
    return result


def _best_apart(gain: FloatArray, quads: IntArray, n_vertices: int) -> IntArray:
    """Return flips that gain enough, each the best of all that share a vertex with it."""
    good = np.flatnonzero(gain > _LEAST_GAIN)
    order = good[np.lexsort((good, -gain[good]))]
    rank = np.arange(len(order))
    best = np.full(n_vertices, len(order))
    np.minimum.at(best, quads[order].reshape(-1), np.repeat(rank, 4))
    return np.sort(order[np.all(best[quads[order]] == rank[:, None], axis=1)])


def _flipped(mesh: PolyMesh, halfedges: Halfedges, edges: IntArray, quads: IntArray) -> PolyMesh:
    """Return the mesh in which some edges are flipped."""
    first = halfedges.edge_halfedge[edges]
    a, b, c, d = quads.T
    faces = mesh.indices.reshape(-1, 3).copy()
    faces[halfedges.face[first]] = np.column_stack([d, b, c])
    faces[halfedges.face[halfedges.twin[first]]] = np.column_stack([c, a, d])
    return PolyMesh(mesh.vertices, mesh.offsets, faces.reshape(-1))
