"""Chords of a mesh of quads: rows of quads from side to opposite side, to put in and take out."""

from itertools import pairwise

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, unit
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_areas, without_loose
from fabweave.mesh.remesh.remeshed import edge_lengths
from fabweave.mesh.topology import label_links


def find_chords(halfedges: Halfedges) -> tuple[int, IntArray]:
    """Return how many chords a mesh of quads has, and which one crosses each edge, (E,).

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> find_chords(build_halfedges(torus(7, 5, 3.0, 1.0)))[0]
    12
    """
    across = halfedges.next[halfedges.next]
    return label_links(halfedges.edge, halfedges.edge[across], halfedges.n_edges)


def _lengths(mesh: PolyMesh, halfedges: Halfedges) -> FloatArray:
    """Return the length of each edge, (E,)."""
    return np.maximum(edge_lengths(mesh)[halfedges.edge_halfedge], 1e-12)


def split_chords(mesh: PolyMesh, times: IntArray) -> PolyMesh:
    """Return a mesh of quads with each chord split lengthwise into so many.

    Parameters
    ----------
    mesh : PolyMesh
        Quads.
    times : (C,) int array
        For each chord, 1 or more.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> split_chords(cube(), np.array([1, 2, 3])).n_faces
    22
    """
    halfedges = build_halfedges(mesh)
    parts = times[find_chords(halfedges)[1]]
    first = halfedges.edge_halfedge
    points, begin = [mesh.vertices], mesh.n_vertices + np.cumsum(parts - 1) - (parts - 1)
    tail, head = mesh.vertices[halfedges.tail[first]], mesh.vertices[halfedges.head[first]]
    for edge, count in enumerate(parts.tolist()):
        share = np.arange(1, count)[:, None] / count
        points.append(tail[edge] + share * (head - tail)[edge])
    total = mesh.n_vertices + int(np.sum(parts - 1))

    def along(half: int) -> list[int]:
        edge = halfedges.edge[half]
        inner = list(range(begin[edge], begin[edge] + parts[edge] - 1))
        inner = inner if first[edge] == half else inner[::-1]
        return [int(halfedges.tail[half]), *inner, int(halfedges.head[half])]

    faces = []
    for face in range(mesh.n_faces):
        south, east, north, west = (along(4 * face + side) for side in range(4))
        low, high = (np.concatenate(points)[line[1:-1]] for line in (south, north[::-1]))
        rows = [south]
        for y in range(1, len(east) - 1):
            share = y / (len(east) - 1)
            points.append((1 - share) * low + share * high)
            rows.append([west[::-1][y], *range(total, total + len(low)), east[y]])
            total += len(low)
        rows.append(north[::-1])
        for under, over in pairwise(rows):
            faces += [[*under[x : x + 2], over[x + 1], over[x]] for x in range(len(under) - 1)]
    return PolyMesh.from_faces(np.concatenate(points), np.array(faces))


def without_chord(mesh: PolyMesh, number: int) -> PolyMesh | None:
    """Take a chord out: the ends of each of its edges come together in their middle.

    Returns
    -------
    PolyMesh or None
        None if what is left would not be a surface of quads of the same topology, with at least
        three edges at each vertex.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> without_chord(torus(7, 5, 3.0, 1.0), 0).n_faces in (28, 30)
    True
    """
    halfedges = build_halfedges(mesh)
    on = halfedges.edge_halfedge[find_chords(halfedges)[1] == number]
    _, label = label_links(halfedges.tail[on], halfedges.head[on], mesh.n_vertices)
    size = np.bincount(label)
    points = np.stack([np.bincount(label, axis) / size for axis in mesh.vertices.T], axis=1)
    faces = label[mesh.indices.reshape(-1, 4)]
    kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    result = PolyMesh.from_faces(points, faces[kept])
    if not kept.any() or (faces[kept][:, :2] == faces[kept][:, 2:]).any():
        return None
    result = without_loose(result)
    before, after = check_mesh(mesh), check_mesh(result)
    same = (before.euler, before.n_components, before.n_boundary_loops) == (
        after.euler,
        after.n_components,
        after.n_boundary_loops,
    )
    if not same or after.rules - before.rules:
        return None
    few = interior_valences(build_halfedges(result))[1].min(initial=4) < 3
    return None if few else result


def pillowed(mesh: PolyMesh, inside: BoolArray) -> PolyMesh | None:
    """Put a ring of quads around some faces, between them and the rest.

    Parameters
    ----------
    mesh : PolyMesh
        Quads.
    inside : (F,) bool array
        Faces that make a disc.

    Returns
    -------
    PolyMesh or None
        The same surface, with one quad more for each edge around the faces, which get smaller; None
        if their boundary is not one simple loop.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> pillowed(cube(), np.arange(6) == 0).n_faces
    10
    """
    halfedges = build_halfedges(mesh)
    face, twin = halfedges.face, halfedges.twin
    around = np.flatnonzero(inside[face] & ((twin < 0) | ~inside[face[twin]]))
    tails = halfedges.tail[around]
    if (twin[around] < 0).any() or not len(around) or len(np.unique(tails)) != len(tails):
        return None
    loops, _ = label_links(tails, halfedges.head[around], mesh.n_vertices)
    if mesh.n_vertices - loops != len(around) - 1:
        return None
    number = np.arange(mesh.n_vertices)
    number[tails] = mesh.n_vertices + np.arange(len(tails))
    faces = mesh.indices.reshape(-1, 4).copy()
    corners = faces[inside]
    faces[inside] = number[corners]
    # What moves inwards stays between where it was and the middle of its faces there.
    sums = np.zeros((mesh.n_vertices, 4))
    centres = mesh.vertices[corners].mean(axis=1)
    np.add.at(sums, corners, np.column_stack([centres, np.ones(len(centres))])[:, None])
    new = mesh.vertices[tails] * 2 / 3 + sums[tails, :3] / sums[tails, 3:] / 3
    heads = halfedges.head[around]
    ring = np.column_stack([tails, heads, number[heads], number[tails]])
    return PolyMesh.from_faces(np.concatenate([mesh.vertices, new]), np.concatenate([faces, ring]))


#: A chord is too narrow where two fifths of its edges are shorter than this share of the side that
#: is wanted, and nine tenths are not longer than so many of these; the share grows until there are
#: few enough quads, up to a limit.
_SHORT, _LONG, _NARROW, _TIMES, _FASTER, _NARROWEST = 0.4, 0.9, 0.55, 2.0, 1.15, 1.0
#: Room is left for what is put in later, but no more than that.
_ROOM, _LEAST_ROOM = 0.85, 0.55


def thinned(mesh: PolyMesh, side: float, n_quads: int) -> PolyMesh:
    """Take out chords that are too narrow, the narrowest first, where that leaves a surface.

    Parameters
    ----------
    mesh : PolyMesh
        Quads.
    side : float
        How long edges are to be.
    n_quads : int
        About how many there are to be.
    """
    narrow = _NARROW
    while narrow <= _NARROWEST:
        halfedges = build_halfedges(mesh)
        number, chord = find_chords(halfedges)
        length = _lengths(mesh, halfedges)
        wide, most = np.array(
            [np.quantile(length[chord == one], (_SHORT, _LONG)) for one in range(number)]
        ).T
        thin = (wide < narrow * side) & (most < _TIMES * narrow * side)
        for one in np.argsort(wide, kind="stable").tolist():
            fewer = without_chord(mesh, one) if thin[one] else None
            if fewer is not None and fewer.n_faces >= _LEAST_ROOM * n_quads:
                mesh = fewer
                break
        else:
            if mesh.n_faces <= _ROOM * n_quads:
                break
            narrow *= _FASTER
    return mesh


def lengthened(mesh: PolyMesh, n_quads: int) -> PolyMesh:
    """Split chords that are wide until there are about so many quads, as square as may be."""
    halfedges = build_halfedges(mesh)
    _, chord = find_chords(halfedges)
    wide = np.exp(np.bincount(chord, np.log(_lengths(mesh, halfedges))) / np.bincount(chord))
    sides = chord[halfedges.edge.reshape(-1, 4)[:, :2]]
    best = np.ones(len(wide), dtype=np.int64)
    # Between two of these widths, no chord changes.
    for width in np.sort(np.concatenate([wide / (k + 0.5) for k in range(1, 9)]))[::-1]:
        times = np.maximum(np.rint(wide / width * (1 + 1e-9)), 1).astype(np.int64)
        if times[sides].prod(axis=1).sum() > n_quads:
            break
        best = times
    return split_chords(mesh, best)


#: A face is too large beyond this share of the area wanted; smaller ones, down to that, fill
#: corners; a ring goes around no fewer than so many.
_LARGE, _FILLS, _LEAST_PART = 2.2, 0.7, 4
#: Turns of looking from where most of a part looks.
_LOOKS = 5


def wide_part(mesh: PolyMesh, side: float) -> BoolArray | None:
    """Find a disc of faces that are too large, with straight sides, (F,); None if there is none.

    Parameters
    ----------
    mesh : PolyMesh
        Quads.
    side : float
        How long edges are to be.
    """
    twice, half = face_areas(mesh), build_halfedges(mesh)
    size = np.linalg.norm(twice, axis=1) / 2 / side**2
    inner = half.twin >= 0
    one, two = half.face[inner], half.face[half.twin[inner]]
    large = size > _LARGE

    def around(face: int, of: BoolArray) -> BoolArray:
        both = of[one] & of[two]
        label = label_links(one[both], two[both], mesh.n_faces)[1]
        return of & (label == label[face])

    while large.any():
        largest = int(np.argmax(size * large))
        part = around(largest, large)
        # Of a part that goes around a limb, what is seen from where most of it looks; if that has
        # a hole, from where its largest face looks.
        for looks in (_LOOKS, 0):
            way = unit(twice[[largest]])[0]
            for _ in range(looks):
                way = unit(twice[part & (twice @ way > 0)].sum(axis=0)[None])[0]
            before = twice @ way > 0
            seen = around(int(np.argmax(size * (part & before))), part & before)
            seen = _straightened(half, seen, (size > _FILLS) & before)
            if np.count_nonzero(seen) >= _LEAST_PART and pillowed(mesh, seen) is not None:
                return seen
        large &= ~part
    return None


def _straightened(half: Halfedges, part: BoolArray, may: BoolArray) -> BoolArray:
    """Fill the corners that some faces leave, and take away those that stick out."""
    inner = half.twin >= 0
    while True:
        beside = np.zeros(half.n_halfedges, dtype=bool)
        beside[inner] = part[half.face[half.twin[inner]]]
        new = np.zeros_like(part)
        new[half.face[beside & beside[half.next]]] = True
        new &= may & ~part
        if new.any():
            part = part | new
            continue
        weak = part & (np.bincount(half.face, beside, minlength=len(part)) < 2)
        if not weak.any():
            return part
        part, may = part & ~weak, may & ~weak
