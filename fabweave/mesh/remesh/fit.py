"""Move the vertices of a coarse mesh so that its surface follows a model, both ways."""

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
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
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import edge_middles, sparse_rows, sum_at
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_normals, face_of_corner
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import area_samples, plain_triangles

#: Samples of the model: for each vertex of the mesh so many, within these bounds.
_SAMPLES_EACH, _LEAST_SAMPLES, _MOST_SAMPLES = 20, 8000, 100_000
#: Sharp edges that hang together make a line if they are together as long as this share of the
#: size; creases of an ear or an eye are shorter.
_LONG = 1.5
#: About so many points are spread along the lines of a model.
_LINE_POINTS = 20_000
#: An edge is sharp where its faces turn by more than this: a regular octagon's are not, a
#: hexagon's are.
_SHARP_DEG = 50.0
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

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.points)

    def nearest(self, places: FloatArray) -> FloatArray:
        """Return the nearest of the points to each place, (P, 3)."""
        return self.points[self._tree.query(places)[1]]

    def within(self, places: FloatArray, reach: FloatArray) -> BoolArray:
        """Return whether some point is as near to each place as it may be at most, (P,)."""
        # The tree takes one bound for all, and leaves out what is as far as that: a little more.
        bound = 1.001 * float(reach.max(initial=0.0))
        return np.asarray(self._tree.query(places, distance_upper_bound=bound)[0] <= reach)


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
    first, normal = halfedges.edge_halfedge, face_normals(mesh)[halfedges.face]
    cosine = np.einsum("ed,ed->e", normal[first], normal[halfedges.twin[first]])
    sharp = ~rim & (cosine < np.cos(np.radians(_SHARP_DEG)) - 1e-9)
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
        along = np.ones(len(near), dtype=bool)
        for share in (0.25, 0.5, 0.75):
            places = (tail + share * (head - tail))[along]
            along[along] = model.sharp.within(places, near[along])
        on |= along
    return on


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


#: Weights of the parts of the sum of squares, each for a vertex's share of it. Model to mesh has 1;
#: then mesh to model (without it the mesh bulges), evenness along the surface, staying, and lines
#: (the boundary, sharp edges) that stay lines.
_BACK, _EVEN, _STAY, _LINE = 0.6, 0.2, 0.02, 2.0
#: A sample as far off as is usual weighs so much more than one on the mesh, and at most so much.
_FAR, _MOST_FAR = 2.0, 10.0
#: A line of the mesh that turns by more than this has a corner there, which stays.
_CORNER_DEG = 50.0
#: How often vertices are put back before the whole round is.
_MOST_BACK = 8


def fit(model: Model, mesh: PolyMesh, rounds: int, even: float = _EVEN) -> PolyMesh:
    """Move the vertices of a mesh so that it follows a model in both directions.

    Each round is one linear least-squares problem. Samples of the model are to lie on the faces
    (at the closest point that they have now), and vertices, edge middles and face centres on the
    model; each vertex is to be in the middle of its neighbours as seen along the surface; vertices
    on the boundary and on sharp edges of the model stay on these lines. Faces stay as they are.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        A mesh near it, oriented as it is.
    rounds : int
        How often.
    even : float
        Weight of the third part.

    Returns
    -------
    PolyMesh
        The same faces. No two of them run through one another that did not before, and none is
        turned over by a round: vertices stay behind where that would be.

    Examples
    --------
    >>> from fabweave.mesh.remesh.fit import model_of
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> model = model_of(sphere(24, 50.0), 26)
    >>> cube = fit(model, sphere(2, 50.0), 6)  # corners on the sphere come to be outside of it
    >>> radius = np.linalg.norm(cube.vertices, axis=1)
    >>> bool(np.all((radius > 51) & (radius < 56)))
    True
    """
    halfedges = build_halfedges(mesh)
    lines, points = line_edges(model, mesh, halfedges), _with_centres(mesh)
    known = self_intersections(mesh)
    for _ in range(rounds):
        moved = mesh.with_vertices(_solved(model, mesh, halfedges, lines, points, even))
        mesh = _unspoilt(mesh, moved, known)
    return mesh


def _unspoilt(mesh: PolyMesh, moved: PolyMesh, known: IntArray) -> PolyMesh:
    """Put vertices back around faces that turned over, or that now run through one another."""
    before, after = face_normals(mesh), face_normals(moved)
    turned = np.flatnonzero(np.einsum("nd,nd->n", before, after) < 0)
    for _ in range(_MOST_BACK):
        through = self_intersections(moved)
        new = ~np.isin(through @ [mesh.n_faces, 1], known @ [mesh.n_faces, 1])
        bad = np.isin(face_of_corner(mesh), np.concatenate([through[new].reshape(-1), turned]))
        if not bad.any():
            return moved
        points = moved.vertices.copy()
        back = np.unique(mesh.indices[bad])
        points[back] = mesh.vertices[back]
        moved = moved.with_vertices(points)
        # Where one face went back, its neighbour may have turned over.
        turned = np.flatnonzero(np.einsum("nd,nd->n", before, face_normals(moved)) < 0)
    return mesh


def _solved(
    model: Model, mesh: PolyMesh, halfedges: Halfedges, lines: BoolArray,
    points: sparse.csr_array, even: float,
) -> FloatArray:  # fmt: skip
    """Return where the vertices are after one round; points are vertices and centres of faces."""
    count = mesh.n_vertices
    there, wanted_there, lost = _model_on_mesh(model, mesh, points)
    back, wanted_back, added = _mesh_on_model(model, mesh, halfedges, points)
    ring, wanted_ring, ring_weight = _evenness(mesh, halfedges, lines)
    line, wanted_line = _line_rows(model, mesh, halfedges, lines)
    parts = [
        (there, wanted_there, lost * (count / max(len(lost), 1))),
        (back, wanted_back, added * (_BACK * count / len(added))),
        (ring, wanted_ring, even * ring_weight),
        (sparse.eye_array(count, format="csr"), mesh.vertices, np.full(count, _STAY)),
        (line, wanted_line, np.full(len(wanted_line), _LINE)),
    ]
    matrix = sum(rows.T @ _weighted(rows, weight) for rows, _, weight in parts)
    right = sum(rows.T @ (weight[:, None] * wanted) for rows, wanted, weight in parts)
    return np.asarray(splu(sparse.csc_array(matrix)).solve(np.asarray(right)))


def _weighted(rows: sparse.csr_array, weight: FloatArray) -> sparse.csr_array:
    """Return rows times their weights."""
    values = rows.data * np.repeat(weight, np.diff(rows.indptr))
    return sparse.csr_array((values, rows.indices, rows.indptr), shape=rows.shape)


def _model_on_mesh(
    model: Model, mesh: PolyMesh, points: sparse.csr_array
) -> tuple[sparse.csr_array, FloatArray, FloatArray]:
    """Return rows that give the points of the mesh closest to the samples, these, and weights.

    Samples that are far off weigh more, so that tips come out.
    """
    places, triangles = plain_triangles(mesh)
    feet = Surface(places, triangles).feet(model.places)
    # The closest point of a sheet that looks the other way is on the far side of a thin limb.
    fits = np.einsum("nd,nd->n", feet.normals, model.normals) > 0
    rows = sparse_rows(feet.corners[fits], feet.shares[fits], len(places))
    if len(places) > mesh.n_vertices:
        rows = rows @ points
    return rows, model.places[fits], _weights(feet.distances[fits])


def _mesh_on_model(
    model: Model, mesh: PolyMesh, halfedges: Halfedges, points: sparse.csr_array
) -> tuple[sparse.csr_array, FloatArray, FloatArray]:
    """Return rows for vertices, face centres and edge middles, where they belong, and weights."""
    first = halfedges.edge_halfedge
    ends = np.column_stack([halfedges.tail[first], halfedges.head[first]])
    rows = sparse.vstack(
        [points, sparse_rows(ends, np.full(2, 0.5), mesh.n_vertices)], format="csr"
    )
    places = np.concatenate([mesh.vertices, face_centres(mesh), edge_middles(mesh, halfedges)])
    feet = model.surface.feet(places)
    return rows, feet.points, _weights(feet.distances)


def _weights(off: FloatArray) -> FloatArray:
    """Return a weight for each distance, one in the mean."""
    if not len(off):
        return off
    usual = float(np.sqrt(np.mean(off**2))) or 1.0
    weight = 1.0 + np.minimum(_FAR * off / usual, _MOST_FAR)
    return np.asarray(weight / weight.mean())


def _evenness(
    mesh: PolyMesh, halfedges: Halfedges, lines: BoolArray
) -> tuple[sparse.csr_array, FloatArray, FloatArray]:
    """Return rows for the way from each vertex to the middle of its neighbours, and what it may be.

    That is its normal part. On a line only the neighbours along it count, and corners of lines
    have no such row.
    """
    count = mesh.n_vertices
    first = halfedges.edge_halfedge
    tail, head = halfedges.tail[first], halfedges.head[first]
    on = np.bincount(np.concatenate([tail[lines], head[lines]]), minlength=count)
    # Off the lines every edge counts, on them those of the line.
    pairs = np.concatenate(
        [np.column_stack([a, b])[(on[a] == 0) | lines] for a, b in ((tail, head), (head, tail))]
    )
    degree = np.bincount(pairs[:, 0], minlength=count)
    near = sparse.coo_array(
        (1.0 / degree[pairs[:, 0]], (pairs[:, 0], pairs[:, 1])), shape=(count, count)
    )
    rows = sparse.csr_array(near - sparse.eye_array(count))
    way = rows @ mesh.vertices
    normal = unit(sum_at(mesh.indices, face_normals(mesh)[face_of_corner(mesh)], count))
    wanted = np.einsum("nd,nd->n", normal, way)[:, None] * normal
    weight = (on == 0).astype(np.float64)
    two = np.flatnonzero((on == 2) & (degree == 2))
    if len(two):
        order = np.argsort(pairs[:, 0], kind="stable")
        start = np.searchsorted(pairs[order, 0], two)
        sides = [
            unit(mesh.vertices[pairs[order[start + k], 1]] - mesh.vertices[two]) for k in (0, 1)
        ]
        along = unit(sides[1] - sides[0])
        wanted[two] = way[two] - np.einsum("nd,nd->n", along, way[two])[:, None] * along
        bend = np.einsum("nd,nd->n", *sides)
        weight[two] = bend < -np.cos(np.radians(_CORNER_DEG))
    return rows, wanted, weight


def _line_rows(
    model: Model, mesh: PolyMesh, halfedges: Halfedges, lines: BoolArray
) -> tuple[sparse.csr_array, FloatArray]:
    """Return rows for vertices and middles of edges on lines, and the nearest points of those."""
    first = halfedges.edge_halfedge
    rim = halfedges.twin[first] < 0
    rows, wanted = [], []
    for which, line in ((rim, model.rim), (lines & ~rim, model.sharp)):
        if not which.any() or not len(line.points):
            continue
        ends = np.column_stack([halfedges.tail[first[which]], halfedges.head[first[which]]])
        vertex = np.unique(ends)
        middle = sparse_rows(ends, np.full(2, 0.5), mesh.n_vertices)
        rows += [sparse_rows(vertex[:, None], np.ones(1), mesh.n_vertices), middle]
        wanted += [line.nearest(mesh.vertices[vertex]), line.nearest(middle @ mesh.vertices)]
    if not rows:
        return sparse.csr_array((0, mesh.n_vertices)), np.zeros((0, 3))
    return sparse.csr_array(sparse.vstack(rows)), np.concatenate(wanted)


def _with_centres(mesh: PolyMesh) -> sparse.csr_array:
    """Return rows that give the vertices and the centres of the faces."""
    share = 1.0 / mesh.face_sizes[face_of_corner(mesh)]
    centres = sparse.csr_array(
        (share, mesh.indices, mesh.offsets), shape=(mesh.n_faces, mesh.n_vertices)
    )
    return sparse.csr_array(
        sparse.vstack([sparse.eye_array(mesh.n_vertices), centres], format="csr")
    )
