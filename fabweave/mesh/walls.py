"""See where a solid is a thin wall, and take the outer side of it alone."""

import itertools

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, dijkstra, maximum_flow
from scipy.sparse.linalg import eigsh
from scipy.spatial import KDTree

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, any_normals, flags, frozen_value
from fabweave.mesh.bodies import bodies_of, winding
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_areas,
    face_centres,
    face_normals,
    face_of_corner,
    without_loose,
)
from fabweave.mesh.rim_cut import part_along_rim
from fabweave.mesh.topology import keep_faces, label_links
from fabweave.mesh.triangulate import plain_triangles

#: A wall is thinner than this share of the greatest side of its body: of a sheet that is seen alike
#: from both sides; and of a vessel, whose inner side is seen at most so much as this share of its
#: outer one. Where a wall is insisted on, it may be thicker.
_SHEET, _VESSEL, _HIDDEN, _THICKEST = 0.05, 0.1, 0.7, 0.25
#: It has so much of the body's area at least, as a sheet and as a vessel, which may have a stem or
#: a handle; it is as thick as the median within this factor, and so much of it keeps one side.
_MOSTLY, _HALF, _ALIKE, _KEPT = 0.8, 0.55, 4.0, 0.9
#: What has longer rims than this, by the area of a side over the thickness, is a lattice.
_LATTICE = 0.3
#: Its sides look away from one another: the cosine of their normals is below this.
_APART = -0.7
#: In a wall one can go so many times its thickness in half of so many directions at least; in a
#: rod only along it.
_WAYS, _FAR = 8, 1.5
#: An edge turns out sharply if the cosine of its normals is below this (50°); it is cut the more
#: readily, by this factor.
_SHARP, _READILY = 0.6428, 0.1
#: Of a rim up to so many thicknesses from the inner side, this share is no part of the outer one.
_RIM, _PULL = 3.0, 0.3
#: Directions in which a side is looked at from afar, and faces that are looked at.
_VIEWS, _LOOKED_AT = 64, 1000
#: How far under the face a ray begins, as a share of the size.
_UNDER = 1e-6
_WHOLE = 2.0**20


@frozen_value
class Walled:
    """A mesh whose thin walls have their outer side alone.

    Parameters
    ----------
    mesh : PolyMesh
    thickness : float or None
        The median of the thickest wall, in the unit of the mesh; None where there is none.
    ragged : int
        Along how many rims faces were cut.
    hidden : int
        How many bodies were left out that lie inside others.
    """

    mesh: PolyMesh
    thickness: float | None = None
    ragged: int = 0
    hidden: int = 0


@frozen_value
class Wall:
    """A thin wall: its median thickness, and the faces of its outer side, (F,)."""

    thickness: float
    outer: BoolArray


#: Bodies smaller than this share of the largest, by the diagonal, are parts and no vessels.
_LARGE = 0.25


def outer_walls(mesh: PolyMesh, inward: BoolArray, *, insist: bool = False) -> Walled:
    """Return a mesh without what lies inside, and with the outer side of each thin wall alone.

    Parameters
    ----------
    mesh : PolyMesh
        Oriented, and closed bodies outward.
    inward : (F,) bool array
        Faces of bodies that looked inward as they were given, as those of cavities do.
    insist : bool
        Whether walls may be thicker, and have less of the area.
    """
    body, diagonals = bodies_of(mesh)
    shown = np.ones(mesh.n_faces, dtype=bool)
    kept, thickness, hidden = shown.copy(), None, _inside(mesh, body, len(diagonals), inward)
    for one in np.flatnonzero(diagonals >= _LARGE * diagonals.max()).tolist():
        faces = np.flatnonzero(body == one)
        if one in hidden:
            continue
        wall = find_wall(without_loose(keep_faces(mesh, body == one)), insist=insist)
        if wall is not None:
            kept[faces] = wall.outer
            thickness = max(thickness or 0.0, wall.thickness)
    for one in hidden:
        kept[body == one] = shown[body == one] = False
    if hidden:
        mesh, kept = without_loose(keep_faces(mesh, shown)), kept[shown]
    if thickness is None:
        return Walled(mesh, hidden=len(hidden))
    parted, ragged = part_along_rim(mesh, kept)
    return Walled(parted, thickness, ragged, len(hidden))


#: More bodies are no vessel and its inside; a place is inside where a surface winds around it so.
_MOST_BODIES, _INSIDE = 50, 0.5


def _inside(mesh: PolyMesh, body: IntArray, count: int, inward: BoolArray) -> list[int]:
    """Return the closed bodies that lie in another: cavities, and the inner sides of walls."""
    if not 1 < count <= _MOST_BODIES:
        return []
    parts = [without_loose(keep_faces(mesh, body == one)) for one in range(count)]
    closed = [not len(group_edges(part).rim) for part in parts]
    looks = [bool(inward[body == one].all()) for one in range(count)]
    low, high = (np.array([f(part.vertices, axis=0) for part in parts]) for f in (np.min, np.max))
    found = []
    for one, other in itertools.permutations(range(count), 2):
        if not (closed[one] and closed[other]):
            continue
        within = (low[other] < low[one]).all() and (high[one] < high[other]).all()
        if not within or winding(parts[other], parts[one].vertices[:1])[0] < _INSIDE:
            continue
        away = Surface(*plain_triangles(parts[other])).feet(parts[one].vertices).distances
        size = float((high[other] - low[other]).max())
        if looks[one] != looks[other] or np.median(away) < _SHEET * size:
            found.append(one)
    return sorted(set(found))


@frozen_value
class _Faces:
    """What is known of each face: its size, where it is, where it looks, and its surface."""

    mesh: PolyMesh
    edges: EdgeGroups
    areas: FloatArray
    centres: FloatArray
    normals: FloatArray
    surface: Surface
    owner: IntArray


def _faces(mesh: PolyMesh) -> _Faces:
    points, triangles = plain_triangles(mesh)
    areas = 0.5 * np.linalg.norm(face_areas(mesh), axis=1)
    whole = len(triangles) == mesh.n_faces
    return _Faces(
        mesh,
        group_edges(mesh),
        areas,
        face_centres(mesh),
        face_normals(mesh),
        Surface(points, triangles),
        np.arange(mesh.n_faces) if whole else face_of_corner(mesh),
    )


def find_wall(mesh: PolyMesh, *, insist: bool = False) -> Wall | None:
    """Return the outer side of a body that is a thin wall; None where it is none.

    From each face the wall is as thick as a ray goes inward. The two sides are told apart by a
    function that is smooth over the surface, and takes opposite values on opposite faces: the
    lowest mode of a signed Laplacian. The outer side is the one that is seen more from afar; where
    both are seen alike, the larger, or the upper one. It ends along the rim where the cut is short,
    and at sharp edges.

    Parameters
    ----------
    mesh : PolyMesh
        One body.
    insist : bool
        As for :func:`outer_walls`.

    References
    ----------
    Shapira, Shamir, Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
    diameter function", 2008; Kunegis et al., "Spectral analysis of signed graphs", 2010.
    """
    size = float(np.ptp(mesh.vertices, axis=0).max())
    if not size > 0.0:
        return None
    # As large as one, so that no square is too small or too large.
    mesh = mesh.with_vertices((mesh.vertices - mesh.vertices.mean(axis=0)) / size)
    if not np.linalg.norm(face_areas(mesh), axis=1).any():
        return None
    one = _faces(mesh)
    thick, across = _opposite(one)
    order = np.argsort(thick, kind="stable")
    until = np.cumsum(one.areas[order])
    median = float(thick[order][np.searchsorted(until, 0.5 * until[-1])])
    if not 0.0 < median < (_THICKEST if insist else _VESSEL):
        return None
    walled = (thick < _ALIKE * median) & (
        np.einsum("ij,ij->i", one.normals, one.normals[across]) < _APART
    )
    walled[walled] = _wide(one, np.flatnonzero(walled), thick[walled])
    share = float(one.areas[walled].sum() / until[-1])
    if share < _HALF:
        return None
    sheet = insist or (median < _SHEET and share > _MOSTLY)
    sides = _outer_first(one, walled, across, median, sheet=sheet)
    if sides is None:
        return None
    kept = _cut(one, *sides, median)
    # Where walls branch there are more than two sides, and a lattice is mostly rim.
    once = one.areas[(sides[0] | sides[1]) & (kept != kept[across])].sum()
    first, second, length, _ = _links(one)
    rim = length[kept[first] != kept[second]].sum() * median
    lattice = rim > _LATTICE * one.areas[kept].sum() and not insist
    whole = once > _KEPT * one.areas[walled].sum() and not lattice
    return Wall(median * size, kept) if whole else None


def _outer_first(
    one: _Faces, walled: BoolArray, across: IntArray, median: float, *, sheet: bool
) -> tuple[BoolArray, BoolArray] | None:
    """Return the faces of the outer side for sure, and of the inner; None where it has no two.

    If it is no ``sheet``, the inner side is to be hidden.
    """
    side = _sides(one, walled, across, median)
    known = walled & (side != side[across])
    first, second = known & side, known & ~side
    if not (first.any() and second.any()):
        return None
    seen, other = _seen(one, first), _seen(one, second)
    if not (sheet or min(seen, other) < _HIDDEN * max(seen, other)):
        return None
    inner = _is_inner(one, first, seen, second, other)
    return (second, first) if inner else (first, second)


def _opposite(one: _Faces) -> tuple[FloatArray, IntArray]:
    """Return how far a ray goes inward from each face, and the face where it ends, (F,)."""
    begin = one.centres - _UNDER * one.normals
    hit, far = one.surface.hits(begin, -one.normals)
    return far, np.where(hit < 0, 0, one.owner[hit])


#: Of more faces, so many are looked at, and the others are as the nearest of them.
_MOST = 10_000


def _wide(one: _Faces, faces: IntArray, thick: FloatArray) -> BoolArray:
    """Tell where the body goes on beside its middle under some faces, as a wall does."""
    if len(faces) > _MOST:
        some = np.linspace(0, len(faces) - 1, _MOST).astype(np.int64)
        nearest = KDTree(one.centres[faces[some]]).query(one.centres[faces])[1]
        return _wide(one, faces[some], thick[some])[nearest]
    normals = one.normals[faces]
    middle = one.centres[faces] - 0.5 * thick[:, None] * normals
    first = any_normals(normals)
    second = np.cross(normals, first)
    ways = np.zeros(len(faces))
    for turn in 2.0 * np.pi * np.arange(_WAYS) / _WAYS:
        far = one.surface.hits(middle, np.cos(turn) * first + np.sin(turn) * second)[1]
        ways += far > _FAR * thick
    return 2 * ways >= _WAYS


def _sides(one: _Faces, walled: BoolArray, across: IntArray, median: float) -> BoolArray:
    """Tell apart the two sides, (F,): alike along the surface, different across the wall."""
    first, second, length, sharp = _links(one)
    a, _ = one.edges.pairs
    middle = 0.5 * (one.mesh.vertices[one.edges.tail[a]] + one.mesh.vertices[one.edges.head[a]])
    apart = sum(np.linalg.norm(one.centres[each] - middle, axis=1) for each in (first, second))
    alike = length / np.maximum(apart, _UNDER) * np.where(sharp, _READILY, 1.0)
    count = one.mesh.n_faces
    # Lengths are counted in thicknesses, so that the modes have no unit.
    mass = np.maximum(one.areas, (_UNDER) ** 2) / median**2
    here = np.flatnonzero(walled)
    there, unlike = across[here], mass[here]
    rows = np.concatenate([first, second, first, second, here, there, here, there])
    columns = np.concatenate([first, second, second, first, here, there, there, here])
    values = np.concatenate([alike, alike, -alike, -alike, *[unlike] * 4])
    root = 1.0 / np.sqrt(mass)
    matrix = csr_array((values * root[rows] * root[columns], (rows, columns)), (count, count))
    if count < 4 * _WAYS:
        modes = np.linalg.eigh(matrix.toarray())[1]
    else:
        start = np.sqrt(one.areas) * (1.0 + np.linspace(0.0, 1.0, count))
        # Only signs matter.
        modes = eigsh(matrix.tocsc(), 1, sigma=-1e-4, v0=start, tol=1e-2, ncv=6)[1]
    return np.asarray(modes[:, 0] > 0.0)


def _links(one: _Faces) -> tuple[IntArray, IntArray, FloatArray, BoolArray]:
    """Return pairs of neighbours, how long their edges are, and which of these turn out sharply."""
    a, b = one.edges.pairs
    first, second = one.edges.face[a], one.edges.face[b]
    ends = one.mesh.vertices[one.edges.tail[a]], one.mesh.vertices[one.edges.head[a]]
    length = np.linalg.norm(ends[0] - ends[1], axis=1)
    normals, way = one.normals[first], one.centres[second] - one.centres[first]
    sharp = np.einsum("ij,ij->i", normals, one.normals[second]) < _SHARP
    return first, second, length, sharp & (np.einsum("ij,ij->i", normals, way) < 0.0)


def _seen(one: _Faces, side: BoolArray) -> float:
    """Return how much of a side is seen from afar, as a share."""
    faces = np.flatnonzero(side)
    until = np.cumsum(one.areas[faces])
    share = (np.arange(_LOOKED_AT) + 0.5) / _LOOKED_AT
    looked = faces[np.minimum(np.searchsorted(until, share * until[-1]), len(faces) - 1)]
    begin = one.centres[looked] + _UNDER * one.normals[looked]
    free = total = 0.0
    for way in _around(_VIEWS):
        cosine = one.normals[looked] @ way
        front = cosine > 0.0
        hit, _ = one.surface.hits(begin[front], np.broadcast_to(way, (int(front.sum()), 3)))
        free += float(cosine[front][hit < 0].sum())
        total += float(cosine[front].sum())
    return free / total


#: What differs by less than this share is alike.
_LIKE = 0.02


def _is_inner(one: _Faces, first: BoolArray, seen: float, second: BoolArray, other: float) -> bool:
    """Tell whether of two sides the first is the inner one: seen less, smaller, or looking down."""
    areas = float(one.areas[first].sum()), float(one.areas[second].sum())
    for a, b in ((seen, other), areas):
        if abs(a - b) > _LIKE * max(a, b):
            return a < b
    return float(one.areas[first] @ one.normals[first, 2]) < 0.0


def _around(count: int) -> FloatArray:
    """Return directions spread evenly over the sphere, (N, 3)."""
    number = np.arange(count) + 0.5
    height, turn = 1.0 - 2.0 * number / count, np.pi * (1.0 + 5.0**0.5) * number
    flat = np.sqrt(1.0 - height**2)
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), height])


def _cut(one: _Faces, outer: BoolArray, inner: BoolArray, median: float) -> BoolArray:
    """Part what is neither side for sure, with the shortest cut, and return the outer side."""
    first, second, length, sharp = _links(one)
    price = length / median * np.where(sharp, _READILY, 1.0)
    count, source, sink = one.mesh.n_faces, one.mesh.n_faces, one.mesh.n_faces + 1
    name = np.arange(count)
    name[outer], name[inner] = source, sink
    away = np.linalg.norm(one.centres[first] - one.centres[second], axis=1)
    # The way to the inner side, along the surface and not through the outer side.
    open_ = ~(outer[first] | outer[second])
    ways = csr_array(
        (np.maximum(away[open_], 1e-12), (name[first[open_]], name[second[open_]])),
        (count + 2, count + 2),
    )
    near = dijkstra(ways, directed=False, indices=[sink], limit=_RIM * median)[0, :count]
    beside = flags(count, np.where(inner[first], second, first)[inner[first] | inner[second]])
    rim = np.flatnonzero((np.isfinite(near) | beside) & ~inner & ~outer)
    pull = _PULL * one.areas[rim] / median**2
    begin = np.concatenate([name[first], name[second], rim])
    end = np.concatenate([name[second], name[first], np.full(len(rim), sink)])
    cost = np.concatenate([price, price, pull])
    apart = begin != end
    cost = np.ceil(cost[apart] * min(_WHOLE, 2.0**29 / cost[apart].sum())).astype(np.int32)
    graph = csr_array((cost, (begin[apart], end[apart])), (count + 2, count + 2))
    graph.sum_duplicates()
    flow = maximum_flow(graph, source, sink).flow
    left = (graph - flow).tocsr()
    left.data = np.maximum(left.data, 0)
    left.eliminate_zeros()
    reached = breadth_first_order(left, source, return_predecessors=False)
    found = flags(count + 2, reached)[:count] | outer
    # Of what hangs together, the largest.
    a, b = first[found[first] & found[second]], second[found[first] & found[second]]
    group = label_links(a, b, count)[1]
    largest = np.argmax(np.bincount(group, np.where(found, one.areas, 0.0)))
    return found & (group == largest)
