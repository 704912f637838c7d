"""Gather what lies around each vertex, and find vertices that are irregular: their rings differ."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value, offsets_of
from fabweave.core.errors import InputError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh

#: How many places a note names.
_NAMED = 5


@frozen_value
class Irregular:
    """The irregular vertices of a mesh.

    Parameters
    ----------
    vertex, valence : (K,) int arrays
        Vertices, and the number of edges at each.
    position : (K, 3) float array
        Where they are, in the mesh's unit.
    boundary : (K,) bool array
        Whether they lie on the boundary.
    """

    vertex: IntArray
    valence: IntArray
    position: FloatArray
    boundary: BoolArray

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.vertex)


def interior_valences(halfedges: Halfedges) -> tuple[IntArray, IntArray]:
    """Return the vertices inside the surface and their valences.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> interior_valences(build_halfedges(octahedron()))[1].tolist()
    [4, 4, 4, 4, 4, 4]
    """
    n_vertices = int(halfedges.tail.max(initial=-1)) + 1
    valence = np.bincount(halfedges.tail, minlength=n_vertices)
    rim = halfedges.twin < 0
    valence[halfedges.tail[rim]] = 0
    valence[halfedges.head[rim]] = 0
    inside = np.flatnonzero(valence)
    return inside, valence[inside]


def find_irregular(mesh: PolyMesh, regular: int = 4) -> Irregular:
    """Find the vertices at which a mesh is not a regular grid of quads, or of triangles.

    Inside, a regular vertex has four edges among quads; on the boundary it has three, or two at a
    corner. Among triangles it has six, and on the boundary up to four.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.
    regular : int
        The edges of a regular vertex inside: 4 for quads, 6 for triangles.

    Returns
    -------
    Irregular
        In the order of vertices; vertices without faces are passed over.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar, sphere
    >>> len(find_irregular(hypar(3, 2, 1.0, 1.0))), find_irregular(sphere(4, 1.0)).valence.tolist()
    (0, [3, 3, 3, 3, 3, 3, 3, 3])
    """
    halfedges = build_halfedges(mesh)
    rim = halfedges.twin < 0
    faces = np.bincount(mesh.indices, minlength=mesh.n_vertices)
    boundary = flags(mesh.n_vertices, halfedges.tail[rim])
    valence = faces + boundary
    fits = np.where(boundary, (valence >= 2) & (valence <= regular // 2 + 1), valence == regular)
    vertex = np.flatnonzero(~fits & (faces > 0))
    return Irregular(vertex, valence[vertex], mesh.vertices[vertex], boundary[vertex])


#: How many edges meet at a vertex, by the corners of the faces, where a mesh is a regular grid.
_GRIDS = {3: 6, 4: 4, 6: 3}


def irregular_share(mesh: PolyMesh) -> float:
    """Return which share of a mesh is irregular beyond what its surface asks for.

    A grid is of triangles, of quads or of hexagons, whichever most of the faces are. Irregular are
    vertices of another valence than such a grid has, and faces of another kind. A closed surface,
    or one that branches, cannot do without: their curvatures, by index, add up to its Euler
    characteristic, so quads need 4 |chi| of valence 3 or 5, triangles 6 |chi|. Discs and annuli
    need none.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    float
        Of vertices, or of hexagons; from 0 for a regular grid.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar, sphere, torus
    >>> irregular_share(torus(7, 5, 3.0, 1.0)), irregular_share(hypar(4, 4, 1.0, 1.0))
    (0.0, 0.0)
    >>> irregular_share(sphere(4, 1.0))  # eight corners of a cube, as it must have
    0.0
    """
    size = max(_GRIDS, key=lambda one: np.count_nonzero(mesh.face_sizes == one))
    halfedges = build_halfedges(mesh)
    vertices, valence = interior_valences(halfedges)
    odd_face = mesh.face_sizes != size
    if size == 4:
        # A fan of triangles is one place, and so is a face whose corners all have three edges.
        three = flags(mesh.n_vertices, vertices[valence == 3])
        ringed = np.logical_and.reduceat(three[mesh.indices], mesh.offsets[:-1])
        within = flags(mesh.n_vertices, mesh.indices[ringed[halfedges.face]])
        tips = _fan_tips(mesh, halfedges, vertices)
        fan = np.logical_or.reduceat(tips[mesh.indices], mesh.offsets[:-1])
        odd_face = (odd_face & ~fan) | ringed
        odd_vertex = ((valence != 4) & ~within[vertices]) | tips[vertices]
        odd = int(odd_vertex.sum()) + int(odd_face.sum())
    else:
        odd = len(find_irregular(mesh, _GRIDS[size])) + int(odd_face.sum())
    n_vertices = np.count_nonzero(np.bincount(mesh.indices, minlength=mesh.n_vertices))
    euler = int(n_vertices - halfedges.n_edges + mesh.n_faces)
    closed = bool((halfedges.twin >= 0).all())
    needed = abs(euler) * (4 if size == 4 else 6) if closed or euler < 0 else 0
    return max(odd - needed, 0) / max(mesh.n_faces if size == 6 else int(n_vertices), 1)


def _fan_tips(mesh: PolyMesh, halfedges: Halfedges, inner: IntArray) -> BoolArray:
    """Return which vertices are tips of fans: four triangles or more, and no other faces, (V,)."""
    triangle = mesh.face_sizes[halfedges.face] == 3
    around = np.bincount(halfedges.tail, minlength=mesh.n_vertices)
    of_three = np.bincount(halfedges.tail, weights=triangle, minlength=mesh.n_vertices)
    return flags(mesh.n_vertices, inner) & (around >= 4) & (of_three == around)


def irregular_note(irregular: Irregular) -> Note:
    """Say how many irregular vertices there are, of which valences, and where.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere, torus
    >>> irregular_note(find_irregular(torus(4, 4, 2.0, 1.0)))
    'no irregular vertices: every vertex inside has four edges'
    >>> irregular_note(find_irregular(sphere(1, 3**0.5)))[:62]
    '8 irregular vertices (8 of valence 3): vertex 0 (valence 3) at'
    """
    if not len(irregular):
        text = "no irregular vertices: every vertex inside has four edges"
        return Note("irregular", text, detail=True)
    valences, numbers = np.unique(irregular.valence, return_counts=True)
    kinds = ", ".join(
        f"{number} of valence {valence}"
        for valence, number in zip(valences.tolist(), numbers.tolist(), strict=True)
    )
    places = "; ".join(
        f"vertex {vertex} (valence {valence}) at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
        for vertex, valence, (x, y, z) in zip(
            irregular.vertex[:_NAMED].tolist(),
            irregular.valence[:_NAMED].tolist(),
            irregular.position[:_NAMED].tolist(),
            strict=True,
        )
    )
    more = "; …" if len(irregular) > _NAMED else ""
    number = agree(len(irregular), "{n} irregular [vertex|vertices]")
    return Note("irregular", f"{number} ({kinds}): {places}{more}", detail=True)


@frozen_value
class Rim:
    """The boundary of a mesh as seen from its vertices.

    Parameters
    ----------
    on : (V,) bool array
        Whether the vertex lies on the boundary.
    corner : (V,) bool array
        Whether it lies on the boundary and in one face only.
    before, after : (V,) int arrays
        Its neighbours along the boundary, face on the left; the vertex itself elsewhere.
    """

    on: BoolArray
    corner: BoolArray
    before: IntArray
    after: IntArray


def find_rim(halfedges: Halfedges, n_vertices: int) -> Rim:
    """Find the boundary neighbours of every vertex.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity.
    n_vertices : int
        Number of vertices, loose ones included.

    Returns
    -------
    Rim
        The boundary.

    Raises
    ------
    InputError
        If boundaries touch in a vertex: it would have more than two neighbours there.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> square = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2, 3]])
    >>> find_rim(build_halfedges(square), 4).after.tolist()
    [1, 2, 3, 0]
    """
    open_side = np.flatnonzero(halfedges.twin < 0)
    tail, head = halfedges.tail[open_side], halfedges.head[open_side]
    touching = np.flatnonzero(np.bincount(tail, minlength=n_vertices) > 1)
    if len(touching):
        raise InputError(
            f"boundaries touch at {len(touching)} vertices ({name_some(touching)}); give each "
            "boundary a vertex of its own"
        )
    before = np.arange(n_vertices)
    after = before.copy()
    after[tail] = head
    before[head] = tail
    on = flags(n_vertices, tail)
    faces = np.bincount(halfedges.tail, minlength=n_vertices)
    return Rim(on=on, corner=on & (faces == 1), before=before, after=after)


def with_rim_curve(
    points: FloatArray,
    mesh: PolyMesh,
    rim: Rim,
    valence: IntArray,
    weight: float,
) -> FloatArray:
    """Return new points of vertices, where the boundary follows its curve and the rest stays.

    Parameters
    ----------
    points : (V, 3) float array
        Where inner vertices go.
    mesh : PolyMesh
        The mesh before: vertices without edges, and corners, stay where they are.
    rim : Rim
        Its boundary, where corners stay.
    valence : (V,) int array
        Number of edges at each vertex.
    weight : float
        Weight of each of the two boundary neighbours: 1/8 for a step of the cubic B-spline curve,
        1/6 for its limit.
    """
    result = np.where((rim.on | (valence == 0))[:, None], mesh.vertices, points)
    moving = np.flatnonzero(rim.on & ~rim.corner)
    sides = mesh.vertices[rim.before[moving]] + mesh.vertices[rim.after[moving]]
    result[moving] = (1 - 2 * weight) * mesh.vertices[moving] + weight * sides
    return result


def sum_at(groups: IntArray, values: FloatArray, count: int) -> FloatArray:
    """Add up rows by group.

    Examples
    --------
    >>> import numpy as np
    >>> sum_at(np.array([1, 1]), np.array([[1.0, 2.0], [3.0, 4.0]]), 2).tolist()
    [[0.0, 0.0], [4.0, 6.0]]
    """
    columns = [np.bincount(groups, weights=column, minlength=count) for column in values.T]
    return np.stack(columns, axis=1)


def mean_at(groups: IntArray, values: FloatArray) -> FloatArray:
    """Return the mean of the rows of each group, none of which is empty."""
    shares = np.bincount(groups)
    return sum_at(groups, values, len(shares)) / shares[:, None]


def sparse_rows(columns: IntArray, values: FloatArray, width: int) -> sparse.csr_array:
    """Return a sparse map whose rows hold values, the same or their own, at columns (N, K)."""
    count, size = columns.shape
    entries = np.broadcast_to(values, columns.shape).reshape(-1)
    starts = np.arange(0, count * size + 1, size)
    return sparse.csr_array((entries, columns.reshape(-1), starts), shape=(count, width))


def valences(halfedges: Halfedges, rim: Rim) -> IntArray:
    """Return the number of edges at each vertex, (V,)."""
    return np.bincount(halfedges.tail, minlength=len(rim.on)) + rim.on


def edge_middles(mesh: PolyMesh, half: Halfedges) -> FloatArray:
    """Return the middle of each edge, (E, 3)."""
    first = half.edge_halfedge
    return (mesh.vertices[half.tail[first]] + mesh.vertices[half.head[first]]) / 2


def face_sums(mesh: PolyMesh) -> FloatArray:
    """Return the sum of the corners of each face, (F, 3)."""
    return np.add.reduceat(mesh.vertices[mesh.indices], mesh.offsets[:-1], axis=0)


def corners_in_turn(halfedges: Halfedges, n_vertices: int) -> tuple[IntArray, IntArray]:
    """List the corners at each vertex counter-clockwise.

    Parameters
    ----------
    halfedges : Halfedges
        Connectivity.
    n_vertices : int
        Number of vertices.

    Returns
    -------
    offsets : (V + 1,) int array
        Vertex ``v`` owns the entries ``offsets[v]:offsets[v + 1]``.
    corners : (H,) int array
        Half-edges that leave the vertex. At a boundary vertex the first one is the boundary's;
        elsewhere it is the smallest.

    Raises
    ------
    InputError
        If faces meet in a vertex without being connected through edges there.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> pair = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2], [0, 2, 3]])
    >>> offsets, corners = corners_in_turn(build_halfedges(pair), 4)
    >>> corners[offsets[0] : offsets[1]].tolist()
    [0, 3]
    """
    half = halfedges
    counts = np.bincount(half.tail, minlength=n_vertices)
    offsets = offsets_of(counts)
    start = np.full(n_vertices, -1, dtype=np.int64)
    start[half.tail[::-1]] = np.arange(half.n_halfedges)[::-1]
    rim = np.flatnonzero(half.twin < 0)
    start[half.tail[rim]] = rim
    corners = np.full(half.n_halfedges, -1, dtype=np.int64)
    vertex = np.flatnonzero(start >= 0)
    here = start[vertex]
    place = offsets[vertex]
    # One round for each corner of the busiest vertex; every corner is touched once in all.
    while len(vertex):
        corners[place] = here
        here = half.twin[half.prev[here]]
        goes_on = (here >= 0) & (here != start[vertex])
        vertex, here, place = vertex[goes_on], here[goes_on], place[goes_on] + 1
    missed = np.unique(np.repeat(np.arange(n_vertices), counts)[corners < 0])
    if len(missed):
        raise InputError(
            f"separate fans of faces touch at {len(missed)} vertices ({name_some(missed)}); give "
            "each fan a vertex of its own"
        )
    return offsets, corners


def name_some(vertices: IntArray) -> str:
    """Name the first few vertices of a list."""
    return f"vertex {few_of(vertices.tolist(), 5)}"
