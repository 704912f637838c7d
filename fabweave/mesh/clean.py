"""Clean a mesh as programs write them: each change is counted, and said."""

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    offsets_of,
    unit,
)
from fabweave.core.messages import agree, few_of
from fabweave.mesh.bodies import DEBRIS, bodies_of
from fabweave.mesh.check import FLAT
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_areas,
    face_normals,
    face_of_corner,
    next_corner,
    previous_corner,
    used_vertices,
    without_loose,
)
from fabweave.mesh.topology import (
    face_patches,
    first_alike,
    keep_faces,
    label_links,
    orient_faces,
    sound_faces,
    split_corners,
)
from fabweave.mesh.triangulate import simple_faces
from fabweave.mesh.weld import NEAR, same_position_groups, weld_seams

#: Squares of coordinates, and of their products, are numbers.
_MOST = 1e75
#: A mesh is far away if its middle is so many times its size from the origin.
_FAR = 10.0
#: Of a far coordinate so many units in its last place are no part of the shape.
_ROUNDED = 8.0


@frozen_value
class Cleaned:
    """A mesh that was cleaned.

    Parameters
    ----------
    mesh : PolyMesh
        The middle of its bounding box is the origin.
    origin : (3,) float array
        What was subtracted from each position.
    notes : tuple of str
        What was changed.
    """

    mesh: PolyMesh
    origin: FloatArray
    notes: tuple[str, ...]


def clean_mesh(
    mesh: PolyMesh, weld: str | None = None, size_mm: float | None = None, unit_mm: float = 1.0
) -> Cleaned:
    """Clean a mesh: put it at the origin, weld it, and mend or leave out what cannot be woven.

    Vertices that no face uses go, whatever their coordinates; so do corners that repeat the one
    before, faces of fewer than three corners, faces that lie on others, and lone crumbs. Seams are
    welded, vertices in the middle of an edge are put into the face across, faces around a hole are
    parted, and so are faces at edges of more than two. What names vertices that do
    not exist, or numbers that are none, stays as it is: the check of the mesh says where.

    Parameters
    ----------
    mesh : PolyMesh
        As it was read.
    weld : str, optional
        As ``--weld`` says it.
    size_mm : float, optional
        The largest dimension that the object will have.
    unit_mm : float
        How many millimetres a unit of the mesh is, where that is not given.

    Returns
    -------
    Cleaned

    Examples
    --------
    >>> box = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [np.nan, 0, 0]]
    >>> cleaned = clean_mesh(PolyMesh.from_faces(box, [[0, 1, 1, 2], [0, 2, 3], [2, 3, 0], [1, 2]]))
    >>> cleaned.mesh.faces(), cleaned.origin.tolist(), len(cleaned.notes)
    ([[0, 1, 2], [0, 2, 3]], [1.0, 1.0, 0.0], 4)
    """
    if not mesh.n_faces or np.any((mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)):
        return Cleaned(mesh, np.zeros(3), ())
    used = used_vertices(mesh)
    if not np.all(np.abs(mesh.vertices[used]) < _MOST):
        return Cleaned(mesh, np.zeros(3), ())
    notes = [] if used.all() else [_told(~used, "{n} [vertex belongs|vertices belong] to no face")]
    mesh, origin, moved = _centred(without_loose(mesh))
    notes += moved
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    scale_mm = unit_mm if size_mm is None or not extent else size_mm / extent
    steps: tuple[Callable[[PolyMesh], tuple[PolyMesh, tuple[str, ...]]], ...] = (
        _without_repeats,
        _parted_holes,
        _without_doubles,
        lambda one: weld_seams(one, weld, scale_mm),
        _without_repeats,
        _without_slivers,
        _joined_across,
        _parted_edges,
        _without_crumbs,
    )
    for step in steps:
        if mesh.n_faces:
            mesh, said = step(mesh)
            notes += said
    return Cleaned(mesh, origin, tuple(notes))


def _told(gone: BoolArray, text: str) -> str:
    """Say what was left out, and which."""
    count = int(np.count_nonzero(gone))
    some = few_of(np.flatnonzero(gone).tolist(), 5)
    return f"{agree(count, text + ' and [was|were] left out')} ({some}, counted from 0)"


def _centred(mesh: PolyMesh) -> tuple[PolyMesh, FloatArray, list[str]]:
    """Move the middle of the bounding box to the origin.

    Decimals that a coordinate far from the origin has lost are rounded, so that the same shape has
    the same coordinates wherever it was.
    """
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    origin = low + 0.5 * (high - low)
    lost = _ROUNDED * np.spacing(np.abs(mesh.vertices).max())
    decimals = int(np.floor(-np.log10(lost)))
    places = mesh.vertices - origin
    if 0 <= decimals <= 300:
        places = np.round(places, decimals)
    notes = []
    size = float((high - low).max())
    if np.abs(origin).max() > _FAR * size:
        x, y, z = origin.tolist()
        notes.append(
            f"the mesh is far from the origin, and was moved there: {x:.6g}, {y:.6g}, {z:.6g} "
            "(in its own unit) was subtracted"
        )
    return mesh.with_vertices(places + 0.0), origin, notes


def _without_repeats(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Leave out corners that repeat the one before, and faces of fewer than three corners."""
    keep = mesh.indices != mesh.indices[previous_corner(mesh)]
    face = face_of_corner(mesh)
    sizes = np.bincount(face[keep], minlength=mesh.n_faces)
    small = sizes < 3
    if keep.all() and not small.any():
        return mesh, ()
    notes = []
    repeated = np.bincount(face[~keep & ~small[face]], minlength=mesh.n_faces)
    if repeated.any():
        count, faces = int(repeated.sum()), few_of(np.flatnonzero(repeated).tolist(), 5)
        notes.append(
            agree(count, "{n} [corner repeats|corners repeat] the one before ")
            + agree(count, f"and [was|were] left out (face {faces}, counted from 0)")
        )
    if small.any():
        notes.append(_told(small, "{n} [face has|faces have] fewer than three corners"))
    keep &= ~small[face]
    kept = PolyMesh(mesh.vertices, offsets_of(sizes[~small]), mesh.indices[keep])
    return without_loose(kept), tuple(notes)


def _without_doubles(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Leave out faces that lie on another, and both faces of a wall inside.

    Two faces back to back with the same edges, and nothing else at them, are the two sides of a
    closed surface, and stay.
    """
    place = same_position_groups(mesh.vertices)[mesh.indices]
    placed = PolyMesh(mesh.vertices, mesh.offsets, place)
    first = first_alike(placed)
    doubled = first != np.arange(mesh.n_faces)
    if not doubled.any():
        return mesh, ()
    areas = face_areas(mesh)
    back = doubled & (np.einsum("ij,ij->i", areas, areas[first]) < 0.0)
    edges = group_edges(mesh)
    patch = face_patches(edges, mesh.n_faces)
    lone = flags(int(patch.max()) + 1, patch[edges.face[edges.first[edges.sizes == 1]]])[patch]
    crowded = np.repeat(edges.sizes > 2, edges.sizes)
    back &= lone | flags(mesh.n_faces, edges.face[edges.order[crowded]])
    walls = _walls(placed, first, back)
    gone = (doubled & (np.einsum("ij,ij->i", areas, areas[first]) >= 0.0)) | back | walls
    if not gone.any():
        return mesh, ()
    note = _told(gone, "{n} [face lies|faces lie] on another")
    return without_loose(keep_faces(mesh, ~gone)), (note,)


def _walls(mesh: PolyMesh, first: IntArray, back: BoolArray) -> BoolArray:
    """Return the first faces of walls inside, of faces that lie back to back on a first one, (F,).

    All around a wall there are other faces; a leaf of two sides has a rim of its own.
    """
    wall = back.copy()
    wall[first[back]] = True
    edges = group_edges(mesh)
    starts, face = edges.starts[:-1], edges.face[edges.order]
    alone = np.logical_and.reduceat(wall[face], starts)
    low, high = (ufunc.reduceat(first[face], starts) for ufunc in (np.minimum, np.maximum))
    inside = np.repeat(alone, edges.sizes)[1:] & ~flags(len(face), starts)[1:]
    group = label_links(first[face][:-1][inside], first[face][1:][inside], mesh.n_faces)[1]
    leaves = flags(mesh.n_faces, group[low[alone & (low == high)]])
    return wall & ~back & ~leaves[group]


def _without_slivers(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Leave out faces without area, where what is around them closes."""
    arms = mesh.vertices[mesh.indices] - mesh.vertices[mesh.indices[next_corner(mesh)]]
    lengths = np.bincount(face_of_corner(mesh), np.einsum("ij,ij->i", arms, arms))
    flat = np.linalg.norm(face_areas(mesh), axis=1) <= FLAT * lengths
    if not flat.any():
        return mesh, ()
    kept = without_loose(keep_faces(mesh, ~flat))
    if not kept.n_faces or _n_open(_joined_across(kept)[0]) > _n_open(mesh):
        return mesh, ()
    return kept, (_told(flat, "{n} [face has|faces have] no area"),)


def _n_open(mesh: PolyMesh) -> int:
    """Return how many edges are at the boundary."""
    return int(np.count_nonzero(group_edges(mesh).sizes == 1))


def _joined_across(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Put the vertex of a T-junction into the face across, where that closes the boundary."""
    edges = group_edges(mesh)
    half = edges.first[edges.sizes == 1]
    if not len(half):
        return mesh, ()
    tail, head = edges.tail[half], edges.head[half]
    rim = edges.rim
    start, along = mesh.vertices[tail], mesh.vertices[head] - mesh.vertices[tail]
    length = np.linalg.norm(along, axis=1)
    near = NEAR * float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    found = KDTree(mesh.vertices[rim]).query_ball_point(
        start + 0.5 * along, 0.5 * length + near, return_sorted=True
    )
    side = np.repeat(np.arange(len(half)), [len(some) for some in found])
    vertex = rim[np.concatenate([np.asarray(some, dtype=np.int64) for some in found])]
    way = mesh.vertices[vertex] - start[side]
    at = np.einsum("ij,ij->i", way, unit(along)[side])
    off = np.linalg.norm(way - at[:, None] * unit(along)[side], axis=1)
    inside = (off <= near) & (at > near) & (at < length[side] - near)
    inside &= (vertex != tail[side]) & (vertex != head[side])
    side, vertex, at = side[inside], vertex[inside], at[inside]
    order = np.lexsort((at, side))
    side, vertex = side[order], vertex[order]
    # Only what meets a boundary along its whole length is split; fewer are, until that holds.
    while len(side):
        met = _sides_met(tail, head, side, vertex, mesh.n_vertices)
        if met[side].all():
            break
        side, vertex = side[met[side]], vertex[met[side]]
    if not len(side):
        return mesh, ()
    indices = np.insert(mesh.indices, half[side] + 1, vertex)
    sizes = mesh.face_sizes + np.bincount(edges.face[half[side]], minlength=mesh.n_faces)
    places = few_of(np.unique(vertex).tolist(), 5)
    note = agree(len(side), "{n} [vertex|vertices] in the middle of an edge ") + agree(
        len(side), f"[was|were] put into the face across (vertex {places})"
    )
    return PolyMesh(mesh.vertices, offsets_of(sizes), indices), (note,)


def _sides_met(
    tail: IntArray, head: IntArray, side: IntArray, vertex: IntArray, count: int
) -> BoolArray:
    """Tell which boundary sides, split at vertices, have another at each of their parts, (N,)."""
    owner = np.concatenate([np.arange(len(tail)), side])
    begin = np.concatenate([tail, vertex])
    order = np.argsort(owner, kind="stable")
    owner, begin = owner[order], begin[order]
    last = np.append(owner[1:] != owner[:-1], [True])
    end = np.where(last, head[owner], np.roll(begin, -1))
    key = np.minimum(begin, end) * count + np.maximum(begin, end)
    _, number, copies = np.unique(key, return_inverse=True, return_counts=True)
    return np.bincount(owner, weights=copies[number] != 2, minlength=len(tail)) == 0


def _parted_holes(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Part faces that pass a vertex twice, as around a hole that a bridge leads to."""
    repeating = np.flatnonzero(sound_faces(mesh)[2])
    if not len(repeating):
        return mesh, ()
    faces = mesh.faces()
    cut = {face: simple_faces(mesh.vertices, faces[face]) for face in repeating.tolist()}
    cut = {face: parts for face, parts in cut.items() if parts}
    if not cut:
        return mesh, ()
    every = [part for number, face in enumerate(faces) for part in cut.get(number, [face])]
    note = (
        agree(len(cut), "{n} [face passes a vertex|faces pass vertices] twice, as around a hole, ")
        + agree(len(cut), "and [was|were] parted ")
        + f"(face {few_of(list(cut), 5)})"
    )
    return PolyMesh.from_faces(mesh.vertices, every), (note,)


def _parted_edges(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Part the faces at edges of more than two: those that bound one solid stay together."""
    edges = group_edges(mesh)
    crowded = np.flatnonzero(edges.sizes > 2)
    if not len(crowded):
        return mesh, ()
    patch = face_patches(edges, mesh.n_faces)
    # What has a boundary of its own is a fin, and gives way to what has none.
    fin = flags(int(patch.max()) + 1, patch[edges.face[edges.first[edges.sizes == 1]]])[patch]
    normals = face_normals(mesh)
    pairs = [
        pair for edge in crowded.tolist() for pair in _pairs_around(mesh, edges, edge, normals, fin)
    ]
    parted = _parted_but(mesh, edges, pairs)
    one_sided = orient_faces(group_edges(parted), mesh.n_faces)[1]
    if one_sided.any():
        # Faces of such a mesh look in and out at random: what would be one-sided stays open.
        pairs = [pair for pair in pairs if not one_sided[edges.face[pair[0]]]]
        parted = _parted_but(mesh, edges, pairs)
    ends = [f"{a}–{b}" for a, b in edges.ends(crowded[:5]).tolist()]
    more = ", …" if len(crowded) > 5 else ""
    note = (
        agree(len(crowded), "{n} [edge has|edges have] more than two faces; ")
        + agree(len(crowded), "they were parted there")
        + f" (edge {', '.join(ends)}{more})"
    )
    return parted, (note,)


def _parted_but(mesh: PolyMesh, edges: EdgeGroups, pairs: list[tuple[int, int]]) -> PolyMesh:
    """Part faces at edges of more than two, but where pairs of half-edges stay together."""
    first, second = edges.pairs
    chosen = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    one, two = np.append(first, chosen[:, 0]), np.append(second, chosen[:, 1])
    parted, _ = split_corners(mesh, edges, one, two)
    return _with_middles(parted, dict([*pairs, *(pair[::-1] for pair in pairs)]))


def _with_middles(mesh: PolyMesh, partner: dict[int, int]) -> PolyMesh:
    """Part edges whose faces hang together around both ends: each side gets a vertex in the middle.

    Half-edges stay together with their partners.
    """
    edges = group_edges(mesh)
    at, vertex, points = list[int](), list[int](), list[FloatArray]()
    for edge in np.flatnonzero(edges.sizes > 2).tolist():
        half = edges.order[edges.starts[edge] : edges.starts[edge + 1]].tolist()
        sides = sorted({tuple(sorted({one, partner.get(one, one)})) for one in half})
        for side in sides[1:]:
            at += [one + 1 for one in side]
            vertex += [mesh.n_vertices + len(points)] * len(side)
            points.append(mesh.vertices[edges.ends(np.array([edge]))[0]].mean(axis=0))
    if not points:
        return mesh
    sizes = mesh.face_sizes + np.bincount(edges.face[np.array(at) - 1], minlength=mesh.n_faces)
    indices = np.insert(mesh.indices, at, vertex)
    return PolyMesh(np.concatenate([mesh.vertices, points]), offsets_of(sizes), indices)


def _pairs_around(
    mesh: PolyMesh, edges: EdgeGroups, edge: int, normals: FloatArray, fin: BoolArray
) -> list[tuple[int, int]]:
    """Return which half-edges of a crowded edge stay together: those that bound a solid there.

    Around the edge, in the order of their angles, a solid lies between a face that runs back along
    it and the next that runs forth. Where there are more of one kind, the inner of two neighbours
    is left alone, so that the outer shell stays whole.
    """
    half = edges.order[edges.starts[edge] : edges.starts[edge + 1]]
    if len(whole := half[~fin[edges.face[half]]]) >= 2:
        half = whole
    low, high = edges.ends(np.array([edge]))[0]
    axis = unit(mesh.vertices[high] - mesh.vertices[low])
    forth = edges.tail[half] == low
    normal = normals[edges.face[half]]
    inward = np.cross(normal, np.where(forth[:, None], axis, -axis))
    aside = np.cross(axis, inward[0])
    angle = np.arctan2(inward @ aside, inward @ inward[0])
    turn = np.argsort(angle, kind="stable")
    ring = [(int(half[k]), bool(forth[k])) for k in turn]
    while (surplus := 2 * sum(way for _, way in ring) - len(ring)) != 0:
        many = surplus > 0
        inner = [
            # Of two that run forth the first is the inner one, of two that run back the second.
            k if many else (k + 1) % len(ring)
            for k in range(len(ring))
            if ring[k][1] == many == ring[(k + 1) % len(ring)][1]
        ]
        if not inner:
            return []
        del ring[inner[0]]
    # As brackets match: from the first at which none is open before.
    depth = np.cumsum([-1 if way else 1 for _, way in ring])
    begin = (int(np.argmin(depth)) + 1) % len(ring) if ring else 0
    open_, pairs = list[int](), list[tuple[int, int]]()
    for one, way in ring[begin:] + ring[:begin]:
        if way:
            pairs.append((open_.pop(), one))
        else:
            open_.append(one)
    return pairs


def _without_crumbs(mesh: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Leave out single faces that hang on nothing, and are small beside the rest."""
    body, diagonals = bodies_of(mesh)
    lone = np.bincount(body, minlength=len(diagonals)) == 1
    gone = (lone & (diagonals < DEBRIS * diagonals.max()))[body]
    if not gone.any():
        return mesh, ()
    note = _told(gone, "{n} small [face hangs|faces hang] on nothing")
    return without_loose(keep_faces(mesh, ~gone)), (note,)
