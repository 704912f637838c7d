"""Cut the faces of a mesh into triangles."""

from collections.abc import Sequence

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, IntArray, any_normals, places_in_groups, unit
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_centres,
    face_of_corner,
    next_corner,
    triangle_normals,
)


def triangulate(mesh: PolyMesh) -> PolyMesh:
    """Cut every face into triangles that follow its shape.

    Quads are cut along their shorter diagonal; faces with more corners get a vertex at the mean
    of their corners and one triangle for each edge.

    Parameters
    ----------
    mesh : PolyMesh
        Faces with three or more corners.

    Returns
    -------
    PolyMesh
        Triangles only: those of triangular faces first, then of quads, then of others; the
        vertices of the mesh come first.

    Examples
    --------
    >>> kite = PolyMesh.from_faces(
    ...     [[0, 0, 0], [2, -1, 0], [3, 0, 0], [2, 1, 0]], [[0, 1, 2, 3]])
    >>> triangulate(kite).faces()
    [[1, 2, 3], [1, 3, 0]]
    """
    if np.all(mesh.face_sizes == 3):
        return mesh
    triangles = mesh.indices[_corners(mesh, 3)]
    quads = mesh.indices[_corners(mesh, 4)]
    a, b, c, d = (mesh.vertices[quads[:, k]] for k in range(4))
    turn = np.sum((c - a) ** 2, axis=1) > np.sum((d - b) ** 2, axis=1)
    quads = np.where(turn[:, None], np.roll(quads, -1, axis=1), quads)
    large = np.flatnonzero(mesh.face_sizes > 4)
    sizes = mesh.face_sizes[large]
    face = np.repeat(np.arange(len(large)), sizes)
    place = places_in_groups(sizes)
    start = mesh.offsets[:-1][large][face]
    fans = np.column_stack(
        [
            mesh.indices[start + place],
            mesh.indices[start + (place + 1) % sizes[face]],
            mesh.n_vertices + face,
        ]
    )
    vertices = np.concatenate([mesh.vertices, face_centres(mesh)[large]])
    halves = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return PolyMesh.from_faces(vertices, np.concatenate([triangles, halves, fans]))


def polygon_triangles(
    vertices: FloatArray, loop: Sequence[int], holes: Sequence[Sequence[int]] = ()
) -> list[list[int]]:
    """Cut a polygon, which may be concave and have holes, into triangles between its corners.

    They are those of a constrained Delaunay triangulation in the plane that fits it best.

    Parameters
    ----------
    vertices : (V, 3) float array
    loop : sequence of int
        The corners around it.
    holes : sequence of sequence of int
        The corners around each hole, either way.

    Returns
    -------
    list of list of int
        They run around as the loop does; empty where the loops cross in that plane.

    Examples
    --------
    >>> dart = np.array([[0.0, 0, 0], [4, 0, 0], [1, 1, 0], [0, 4, 0]])
    >>> sorted(map(sorted, polygon_triangles(dart, [0, 1, 2, 3])))
    [[0, 1, 2], [0, 2, 3]]
    """
    corners = [*loop, *(corner for hole in holes for corner in hole)]
    flat = _in_plane(vertices[list(loop)], vertices[corners])
    bounds = np.cumsum([len(loop), *map(len, holes)])
    outer, *inner = np.split(flat, bounds[:-1])
    polygon = shapely.Polygon(outer, inner)
    if not polygon.is_valid:
        return []
    number = {tuple(place): corner for place, corner in zip(flat.tolist(), corners, strict=True)}
    return [
        [number[tuple(place)] for place in triangle.exterior.coords[:3]]
        for triangle in map(
            shapely.geometry.polygon.orient,
            shapely.constrained_delaunay_triangles(polygon).geoms,
        )
    ]


def _in_plane(polygon: FloatArray, points: FloatArray) -> FloatArray:
    """Return points in the plane of a polygon, (N, 2), in which it runs counter-clockwise."""
    arms = polygon - polygon[0]
    normal = unit(np.cross(arms, np.roll(arms, -1, axis=0)).sum(axis=0))
    (across,) = any_normals(normal[None])
    return (points - polygon[0]) @ np.column_stack([across, np.cross(normal, across)])


def simple_faces(vertices: FloatArray, face: Sequence[int]) -> list[list[int]]:
    """Part a face that passes a vertex twice into faces that do not.

    Its loops are faces of their own. One inside another, at the far end of a bridge that is passed
    twice, is a hole, and what is around it is cut into triangles.

    Parameters
    ----------
    vertices : (V, 3) float array
    face : sequence of int

    Returns
    -------
    list of list of int
        Empty where the loops make no polygons.

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [1, 1, 0], [1, 2, 0], [2, 1, 0]])
    >>> parts = simple_faces(corners, [0, 1, 2, 0, 3, 4, 5, 3])
    >>> len(parts), sorted({corner for part in parts for corner in part})
    (6, [0, 1, 2, 3, 4, 5])
    """
    loops, way = list[list[int]](), list[int]()
    for vertex in face:
        if vertex in way:
            at = way.index(vertex)
            loops.append(way[at:])
            del way[at:]
        way.append(vertex)
    loops = [loop for loop in (*loops, way) if len(loop) > 2]
    flat = [_in_plane(vertices[list(face)], vertices[loop]) for loop in loops]
    areas = [shapely.Polygon(ring) for ring in flat]
    if not all(area.is_valid for area in areas):
        return []
    around = [
        [k for k, other in enumerate(areas) if other is not area and other.contains(area)]
        for area in areas
    ]
    parts = []
    for number, loop in enumerate(loops):
        if around[number]:
            continue
        holes = [loops[k] for k, outer in enumerate(around) if number in outer]
        cut = polygon_triangles(vertices, loop, holes) if holes else [loop]
        if not cut:
            return []
        parts += cut
    return parts


def _corners(mesh: PolyMesh, size: int) -> IntArray:
    """Return the corner numbers of all faces of one size, (N, size)."""
    corners: IntArray = mesh.offsets[:-1][mesh.face_sizes == size, None] + np.arange(size)
    return corners


def surface_area(mesh: PolyMesh) -> float:
    """Return the area of a mesh, its faces cut into triangles.

    Examples
    --------
    >>> corners = [[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0]]
    >>> surface_area(PolyMesh.from_faces(corners, [[0, 1, 2, 3]]))
    2.0
    """
    return float(np.linalg.norm(triangle_normals(triangulate(mesh)), axis=1).sum()) / 2.0


#: Steps of the sequence that fills a square most evenly (Roberts, "The unreasonable effectiveness
#: of quasirandom sequences", 2018): the inverse of the plastic number, and its square.
_STEPS = (0.7548776662466927, 0.5698402909980532)


def plain_triangles(mesh: PolyMesh) -> tuple[FloatArray, IntArray]:
    """Return a mesh as points and triangles; faces with more corners are cut around their centres.

    Parameters
    ----------
    mesh : PolyMesh

    Returns
    -------
    points : (V, 3) or (V + F, 3) float array
        The vertices, and the centres of the faces where some have more than three corners.
    triangles : (T, 3) int array

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube, octahedron
    >>> [len(plain_triangles(solid())[1]) for solid in (octahedron, cube)]
    [8, 24]
    """
    if np.all(mesh.face_sizes == 3):
        return mesh.vertices, mesh.indices.reshape(-1, 3)
    return fans(mesh)


def fans(mesh: PolyMesh) -> tuple[FloatArray, IntArray]:
    """Cut every face into triangles around its centre, which favours no corner.

    Returns
    -------
    points : (V + F, 3) float array
        The vertices, and the centres of the faces.
    triangles : (H, 3) int array
        One for each corner: its face's centre, the corner and the next one.
    """
    triangles = np.column_stack(
        [mesh.n_vertices + face_of_corner(mesh), mesh.indices, mesh.indices[next_corner(mesh)]]
    )
    return np.concatenate([mesh.vertices, face_centres(mesh)]), triangles


def area_samples(
    points: FloatArray, triangles: IntArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """Spread points over triangles, as many on each as its area has a share in all.

    There is no chance in it: the same surface has the same samples.

    Parameters
    ----------
    points : (N, 3) float array
    triangles : (T, 3) int array
        At least one with an area.
    count : int
        How many samples.

    Returns
    -------
    places : (count, 3) float array
    normals : (count, 3) float array
        Unit normals of their triangles.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> solid = octahedron()
    >>> places, normals = area_samples(solid.vertices, solid.indices.reshape(-1, 3), 800)
    >>> np.allclose(np.abs(places).sum(axis=1), np.abs(solid.vertices).max())
    True
    >>> np.unique(np.sign(normals), axis=0, return_counts=True)[1].tolist()
    [100, 100, 100, 100, 100, 100, 100, 100]
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    span = np.cross(b - a, c - a)
    until = np.cumsum(np.linalg.norm(span, axis=1))
    number = np.arange(count)
    # The middles of equal shares: none is on a bound between two triangles.
    chosen = np.searchsorted(until, (number + 0.5) / count * until[-1], side="right")
    chosen = np.minimum(chosen, len(triangles) - 1)
    one, two = ((0.5 + step * number) % 1.0 for step in _STEPS)
    beyond = one + two > 1.0
    one, two = np.where(beyond, 1.0 - one, one), np.where(beyond, 1.0 - two, two)
    start = a[chosen]
    places = start + one[:, None] * (b[chosen] - start) + two[:, None] * (c[chosen] - start)
    return places, unit(span[chosen])


def triangles_above(
    points: FloatArray, triangles: IntArray, level: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Return what is left of triangles where a level is above zero; edges are cut where it is zero.

    Parameters
    ----------
    points : (V, 3) float array
    triangles : (T, 3) int array
    level : (V,) float array
        Of each point, and linear between them.

    Returns
    -------
    points : (V + N, 3) float array
        Those that were given, and one on each edge that is cut.
    triangles : (U, 3) int array
        First those that are whole, then the parts of others.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    >>> cut, left = triangles_above(points, np.array([[0, 1, 2]]), np.array([-1.0, 1.0, 1.0]))
    >>> cut[3:].tolist(), left.tolist()
    ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[3, 1, 2], [3, 2, 4]])
    """
    side = np.sign(level).astype(np.int64)[triangles]
    reaches, below = side.max(axis=1) > 0, side.min(axis=1) < 0
    crossing = triangles[reaches & below]
    head = np.roll(crossing, -1, axis=1)
    across = level[crossing] * level[head] < 0.0
    low, high = np.minimum(crossing, head)[across], np.maximum(crossing, head)[across]
    code, number = np.unique(low * len(points) + high, return_inverse=True)
    low, high = np.divmod(code, len(points))
    share = (level[low] / (level[low] - level[high]))[:, None]
    middle = np.full(crossing.shape, -1)
    middle[across] = len(points) + number.reshape(-1)
    # Around each, what is kept and what is new in turn; nothing is last.
    ring = np.stack([np.where(level[crossing] >= 0.0, crossing, -1), middle], axis=2).reshape(-1, 6)
    ring = np.take_along_axis(ring, np.argsort(ring < 0, axis=1, kind="stable"), axis=1)
    parts = ring[:, [[0, 1, 2], [0, 2, 3]]]
    made = parts[parts[:, :, 2] >= 0]
    every = np.concatenate([points, points[low] + share * (points[high] - points[low])])
    return every, np.concatenate([triangles[reaches & ~below], made])
