"""Turn a mesh into few triangles that keep its shape."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, Progress, flags, no_progress, unit
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import nearly_as_like
from fabweave.mesh.mirror import find_mirror, joined_with_image, sound_half
from fabweave.mesh.one_rings import find_irregular, interior_valences
from fabweave.mesh.polymesh import PolyMesh, triangle_normals
from fabweave.mesh.remesh.engines import QSLIM, AttemptFailedError, Engine, Run, run_engine
from fabweave.mesh.remesh.fit import Model, fit, line_edges, model_of
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    cut_surface,
    edge_lengths,
    ready_source,
    sound_faults,
    surface_faults,
)
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.triangulate import surface_area

#: Edges shorter than this share of an even mesh's edges vanish.
_SHORT = 0.4
#: Rounds of edges that vanish at once.
_ROUNDS_AT_ONCE = 50
#: No face turns farther than this cosine when an edge beside it vanishes, ...
_TURN = 0.5
#: ... and no vertex inside, or on the boundary, is left with fewer edges.
_LEAST, _LEAST_RIM = 3, 2


def even_edges(model: Model, mesh: PolyMesh, n_triangles: int) -> PolyMesh:
    """Bring a mesh to a number of triangles whose edges are neither very long nor very short.

    Parameters
    ----------
    model : Model
        Its sharp edges and its boundary stay lines.
    mesh : PolyMesh
        An oriented manifold of triangles near it, with no more of them than are wanted.
    n_triangles : int
        How many are wanted.

    Returns
    -------
    PolyMesh
        As many triangles, or one more.

    Examples
    --------
    >>> from fabweave.mesh.remesh.fit import model_of
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> few = parse_shape("shape:octahedron")
    >>> even_edges(model_of(few, 6), few, 32).n_faces
    32
    """
    least = _SHORT * np.sqrt(4.0 * surface_area(mesh) / (np.sqrt(3.0) * n_triangles))
    return split_long(collapse_short(model, mesh, float(least)), n_triangles)


def split_long(mesh: PolyMesh, n_triangles: int) -> PolyMesh:
    """Split edges that are the longest of the triangles on both sides, until there are enough.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold of triangles.
    n_triangles : int
        How many triangles there should be at least.

    Returns
    -------
    PolyMesh
        The same surface, with one triangle more than asked for at the most.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> square = PolyMesh.from_faces(corners, [[0, 1, 2], [0, 2, 3]])
    >>> split_long(square, 4).vertices[4].tolist()
    [0.5, 0.5, 0.0]
    """
    while mesh.n_faces < n_triangles:
        halfedges = build_halfedges(mesh)
        length = edge_lengths(mesh)[halfedges.edge_halfedge]
        longest = _longest_of_both(halfedges, length)
        order = longest[np.lexsort((longest, -length[longest]))]
        added = np.cumsum(1 + (halfedges.twin[halfedges.edge_halfedge[order]] >= 0))
        missing = n_triangles - mesh.n_faces
        chosen = order[: np.searchsorted(added, missing) + 1]
        mesh = _split(mesh, halfedges, np.sort(chosen))
    return mesh


def split_longer(mesh: PolyMesh, most_mm: float) -> PolyMesh:
    """Split the edges of triangles until none is longer than a length.

    Between flat triangles, edges are flipped too, so that long thin ones do not become many.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold of triangles.
    most_mm : float

    Returns
    -------
    PolyMesh
        The same surface.

    Examples
    --------
    >>> corners = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> square = PolyMesh.from_faces(corners, [[0, 1, 2], [0, 2, 3]])
    >>> split_longer(square, 1.0).n_faces
    4
    """
    while True:
        mesh = _flip_flat(mesh)
        halfedges = build_halfedges(mesh)
        # Rounded, so that a turned copy is split in the same places.
        length = np.round(edge_lengths(mesh)[halfedges.edge_halfedge] / most_mm, 9)
        longest = _longest_of_both(halfedges, length)
        long = longest[length[longest] > 1.0]
        if not len(long):
            return mesh
        mesh = _split(mesh, halfedges, long)


#: Two triangles are flat if they turn by less than this.
_FLAT_DEG = 0.1


def _flip_flat(mesh: PolyMesh) -> PolyMesh:
    """Flip edges between flat pairs of triangles where the angles across are over half a turn."""
    for _ in range(_MOST_ROUNDS):
        halfedges = build_halfedges(mesh)
        first = halfedges.edge_halfedge
        normal, twin = unit(triangle_normals(mesh)), halfedges.twin[first]
        turn = np.einsum("ed,ed->e", normal[halfedges.face[first]], normal[halfedges.face[twin]])
        flat = np.flatnonzero((turn > np.cos(np.radians(_FLAT_DEG))) & (twin >= 0))
        quads = _corners_around(halfedges)
        a, b, c, d = (mesh.vertices[quads[flat, k]] for k in range(4))
        across = [
            np.degrees(np.arccos(np.clip(np.einsum("ed,ed->e", unit(a - t), unit(b - t)), -1, 1)))
            for t in (c, d)
        ]
        gain = np.full(len(quads), -np.inf)
        gain[flat] = np.round(across[0] + across[1] - 180.0, 6)
        chosen = _best_apart(mesh, gain, quads)
        if not len(chosen):
            break
        mesh = _flipped(mesh, halfedges, chosen, quads[chosen])
    return mesh


def _longest_of_both(halfedges: Halfedges, length: FloatArray) -> IntArray:
    """Return the edges that are the longest of their triangles; the first of equal ones."""
    edges = halfedges.edge.reshape(-1, 3)
    rank = np.argsort(np.lexsort((np.arange(len(length)), -length)))
    best = edges[np.arange(len(edges)), np.argmin(rank[edges], axis=1)]
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    here = best[halfedges.face[first]]
    there = np.where(twin >= 0, best[halfedges.face[twin]], here)
    number = np.arange(len(length))
    return np.flatnonzero((here == number) & (there == number))


def _split(mesh: PolyMesh, halfedges: Halfedges, edges: IntArray) -> PolyMesh:
    """Put a vertex in the middle of edges, no two of which share a triangle."""
    first = halfedges.edge_halfedge[edges]
    middle = mesh.n_vertices + np.arange(len(edges))
    ends = mesh.vertices[halfedges.tail[first]] + mesh.vertices[halfedges.head[first]]
    twin = halfedges.twin[first]
    sides = np.concatenate([first, twin[twin >= 0]])
    middle = np.concatenate([middle, middle[twin >= 0]])
    tail, head = halfedges.tail[sides], halfedges.head[sides]
    tip = halfedges.tail[halfedges.prev[sides]]
    faces = mesh.indices.reshape(-1, 3).copy()
    faces[halfedges.face[sides]] = np.column_stack([tail, middle, tip])
    faces = np.concatenate([faces, np.column_stack([middle, head, tip])])
    return PolyMesh.from_triangles(np.concatenate([mesh.vertices, ends / 2.0]), faces)


def collapse_short(model: Model, mesh: PolyMesh, least_mm: float) -> PolyMesh:
    """Let edges vanish that are shorter than a length, where that leaves a sound surface.

    The ends of an edge come together in its middle; where one of them lies on a sharp edge of the
    model or on the boundary, or on more of them, there. In each round edges vanish that are the
    shortest of all near them.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        An oriented manifold of triangles near it.
    least_mm : float

    Returns
    -------
    PolyMesh
        A surface of the same kind, with no more triangles.
    """
    barred: BoolArray = np.zeros(mesh.n_vertices, dtype=bool)  # where it was tried in vain
    for _ in range(_ROUNDS_AT_ONCE):
        halfedges = build_halfedges(mesh)
        places, sound = _meeting_places(model, mesh, halfedges)
        length = edge_lengths(mesh)[halfedges.edge_halfedge]
        first = halfedges.edge_halfedge
        ends = np.column_stack([halfedges.tail[first], halfedges.head[first]])
        sound &= (length < least_mm) & ~barred[ends].any(axis=1)
        chosen = _shortest_apart(mesh, halfedges, ends, np.where(sound, length, np.inf))
        if not len(chosen):
            break
        faces = _faces_after(mesh, ends[chosen])
        moved = mesh.vertices.copy()
        moved[ends[chosen, 0]] = moved[ends[chosen, 1]] = places[chosen]
        spoilt = _spoilt(mesh, moved, faces)
        good = chosen[~spoilt[ends[chosen]].any(axis=1)]
        bad = np.setdiff1d(chosen, good)
        barred[ends[bad]] = True
        vertices = mesh.vertices.copy()
        vertices[ends[good, 0]] = places[good]
        faces = _faces_after(mesh, ends[good])
        used = np.unique(faces)
        barred = barred[used]
        mesh = PolyMesh.from_triangles(vertices[used], np.searchsorted(used, faces))
    return mesh


def _meeting_places(
    model: Model, mesh: PolyMesh, halfedges: Halfedges
) -> tuple[FloatArray, BoolArray]:
    """Return where the ends of each edge would meet, (E, 3), and whether they may at all, (E,)."""
    first = halfedges.edge_halfedge
    u, v = halfedges.tail[first], halfedges.head[first]
    twin = halfedges.twin[first]
    line = line_edges(model, mesh, halfedges)
    count = mesh.n_vertices
    lines = np.bincount(np.concatenate([u[line], v[line]]), minlength=count)
    beside = sparse.coo_matrix((np.ones(len(u), dtype=np.int64), (u, v)), (count, count))
    near = (beside + beside.T).tocsr()
    shared = np.asarray(near[u].multiply(near[v]).sum(axis=1)).reshape(-1)
    valence = np.diff(near.indptr)
    tips = np.column_stack(
        [
            halfedges.tail[halfedges.prev[first]],
            np.where(twin >= 0, halfedges.tail[halfedges.prev[twin]], -1),
        ]
    )
    rim = flags(count, [u[twin < 0], v[twin < 0]])
    spare = valence > np.where(rim, _LEAST_RIM, _LEAST)
    enough = np.where(tips >= 0, spare[tips], True).all(axis=1)
    # Two points of lines would tie these together, unless the edge is of one line.
    may = (shared == 1 + (twin >= 0)) & enough & (line | (lines[u] == 0) | (lines[v] == 0))
    weight = np.where(lines[u] == lines[v], 0.5, (lines[u] > lines[v]).astype(np.float64))[:, None]
    return weight * mesh.vertices[u] + (1 - weight) * mesh.vertices[v], may


def _shortest_apart(
    mesh: PolyMesh, halfedges: Halfedges, ends: IntArray, length: FloatArray
) -> IntArray:
    """Return edges of finite length, each the shortest of all that change the same triangles."""
    some = np.flatnonzero(np.isfinite(length))
    order = some[np.lexsort((some, length[some]))]
    rank = np.full(mesh.n_vertices, len(order), dtype=np.int64)
    np.minimum.at(rank, ends[order].reshape(-1), np.repeat(np.arange(len(order)), 2))
    own = rank
    for _ in range(2):
        spread = own.copy()
        np.minimum.at(spread, halfedges.tail, own[halfedges.head])
        np.minimum.at(spread, halfedges.head, own[halfedges.tail])
        own = spread
    return np.sort(order[np.all(own[ends[order]] == np.arange(len(order))[:, None], axis=1)])


def _faces_after(mesh: PolyMesh, ends: IntArray) -> IntArray:
    """Return the triangles that are left, (T, 3), when the second end becomes the first."""
    now = np.arange(mesh.n_vertices)
    now[ends[:, 1]] = ends[:, 0]
    faces = now[mesh.indices.reshape(-1, 3)]
    whole = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return faces[whole]


def _spoilt(mesh: PolyMesh, moved: FloatArray, faces: IntArray) -> BoolArray:
    """Return at which vertices, (V,), triangles turn over or run through others."""
    old, new = triangle_normals(mesh), triangle_normals(mesh.with_vertices(moved))
    turned = np.einsum("nd,nd->n", unit(old), unit(new)) < _TURN
    turned &= np.linalg.norm(new, axis=1) > 0
    bad = flags(mesh.n_vertices, mesh.indices.reshape(-1, 3)[turned])
    left = PolyMesh.from_triangles(moved, faces)
    through = self_intersections(left)
    if len(through) and not len(self_intersections(mesh)):
        bad[faces[through.reshape(-1)]] = True
    return bad


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
    >>> from fabweave.mesh.remesh.fit import model_of
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> from fabweave.mesh.triangulate import triangulate
    >>> flat = triangulate(hypar(4, 4, 40.0, 0.0))
    >>> flip_edges(model_of(flat, 25), flat).n_faces
    32
    """
    for _ in range(_MOST_ROUNDS):
        halfedges = build_halfedges(mesh)
        gain, quads = _gains(model, mesh, halfedges)
        chosen = _best_apart(mesh, gain, quads)
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
    quads = _corners_around(halfedges)
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
    gain[line_edges(model, mesh, halfedges)] = -np.inf
    return gain, quads


def _corners_around(halfedges: Halfedges) -> IntArray:
    """Return the corners around each edge, (E, 4): from a to b, c on the left, d on the right."""
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    return np.column_stack(
        [
            halfedges.tail[first],
            halfedges.head[first],
            halfedges.tail[halfedges.prev[first]],
            halfedges.tail[halfedges.prev[twin]],
        ]
    )


def _valence_gain(mesh: PolyMesh, halfedges: Halfedges, quads: IntArray) -> FloatArray:
    """Return by how much each flip lowers the sum of squares; -inf where too few edges remain."""
    count = mesh.n_vertices
    rim = flags(count, halfedges.tail[halfedges.twin < 0])
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


def _best_apart(mesh: PolyMesh, gain: FloatArray, quads: IntArray) -> IntArray:
    """Return flips that gain enough, each the best of all that share a vertex with it.

    Where there is another edge from c to d, two faces would lie on one another.
    """
    good = np.flatnonzero(gain > _LEAST_GAIN)
    if not len(good):
        return good
    ends = [np.sort(pairs, axis=1).T for pairs in (quads[good, 2:], quads[:, :2])]
    new, old = (low * mesh.n_vertices + high for low, high in ends)
    good = good[~np.isin(new, old)]
    order = good[np.lexsort((good, -gain[good]))]
    rank = np.arange(len(order))
    best = np.full(mesh.n_vertices, len(order))
    np.minimum.at(best, quads[order].reshape(-1), np.repeat(rank, 4))
    return np.sort(order[np.all(best[quads[order]] == rank[:, None], axis=1)])


def _flipped(mesh: PolyMesh, halfedges: Halfedges, edges: IntArray, quads: IntArray) -> PolyMesh:
    """Return the mesh in which some edges are flipped."""
    first = halfedges.edge_halfedge[edges]
    a, b, c, d = quads.T
    faces = mesh.indices.reshape(-1, 3).copy()
    faces[halfedges.face[first]] = np.column_stack([d, b, c])
    faces[halfedges.face[halfedges.twin[first]]] = np.column_stack([c, a, d])
    return PolyMesh.from_triangles(mesh.vertices, faces)


#: Rounds of flips, each with one of fitting, and rounds of fitting after them; and how much
#: evenness weighs in either.
_FLIPPING, _FITTING = 6, 6
_EVEN_FLIPPING, _EVEN_FITTING = 0.4, 0.1
#: A symmetric result is not worse than another up to this factor.
_WORSE = 1.2
#: Boundary vertices of a half nearer to the mirror than this share of the size belong on it.
_REACH = 0.01


def remesh_triangles(
    mesh: PolyMesh,
    n_triangles: int,
    *,
    progress: Progress = no_progress,
    engine: Engine = QSLIM,
) -> Remeshed:
    """Turn a mesh into few triangles that keep its shape, fit for a kagome weave.

    1. Vertices at the same place are joined, and faces are turned to agree.
    2. Edges are collapsed in the order of the error that this makes (quadric error metric), in a
       process of its own; limbs and horns stay.
    3. Again and again, edges that are very short vanish, and long ones are split in their place,
       or where there are fewer triangles than asked for; edges are flipped so that more vertices
       have six; and vertices are moved so that the surface follows the model. Sharp edges of the
       model stay edges.
    4. Where the model is mirror-symmetric, the same is done to one half, which is joined to its
       mirror image. That is taken if it is sound, and its root mean square and its greatest
       distance are no more, and its 5 % quantile of quality is no less, than those of the whole
       by more than a fifth.
    5. The result has the topology of the model, every vertex inside has three edges or more, and
       it does not run through itself if the model does not; else it is refused.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_triangles : int
        About how many triangles.
    progress : callable
        Told about each step.
    engine : Engine
        What takes triangles away.

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If the result is not the surface that was given.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> remeshed = remesh_triangles(torus(24, 12, 35.0, 15.0), 200)
    >>> remeshed.mesh.n_faces, set(remeshed.mesh.face_sizes.tolist())
    (200, {3})

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
    """
    checked_count("triangles", n_triangles)
    source, notes = ready_source(mesh)
    surface = cut_surface(source)
    if surface.n_faces <= n_triangles:
        coarse = surface
        notes.append(
            f"the mesh has {surface.n_faces} triangles, no more than the {n_triangles} asked for: "
            "long edges were split"
        )
    else:
        progress("taking triangles away", 0, 1)
        try:
            coarse = run_engine(engine, surface, Run(n_triangles, 0, rim=False))
        except AttemptFailedError as error:
            raise _refused(f"{engine.title}: {error}") from error
    model = model_of(source, coarse.n_vertices)
    whole = even_triangles(model, coarse, n_triangles, progress)
    faults = sound_faults(source, whole, 3)
    symmetric = symmetric_triangles(surface, n_triangles, engine, progress)
    result = whole
    if symmetric is not None and (faults or _not_worse(source, symmetric, whole)):
        result = symmetric
        notes.append("the model is mirror-symmetric, and so are the triangles: half was remeshed")
    elif faults:
        raise _refused("; ".join(faults))
    irregular = find_irregular(result, REGULAR)
    made = f"{engine.title} and flips of edges made {result.n_faces} triangles"
    return Remeshed(result, engine.name, (*notes, made, _valence_note(result)), irregular)


def symmetric_triangles(
    surface: PolyMesh, n_triangles: int, engine: Engine, progress: Progress
) -> PolyMesh | None:
    """Remesh half of a mirror-symmetric surface, and join it to its image.

    Parameters
    ----------
    surface : PolyMesh
        Triangles.
    n_triangles : int
        About how many triangles both halves have.
    engine : Engine
        What takes triangles away.
    progress : callable
        Told about each round.

    Returns
    -------
    PolyMesh or None
        None if the surface is not symmetric, or what came of it is not sound.
    """
    mirror = find_mirror(surface)
    if not mirror.symmetric or surface.n_faces <= n_triangles:
        return None
    half = sound_half(surface, mirror)
    if half is None:
        return None
    try:
        coarse = run_engine(engine, half, Run(n_triangles // 2, 0, rim=True))
    except AttemptFailedError:
        return None
    if surface_faults(half, coarse, 3):
        return None
    model = model_of(half, coarse.n_vertices)
    coarse = even_triangles(model, coarse, n_triangles // 2, progress)
    reach = _REACH * float(np.ptp(surface.vertices, axis=0).max())
    result = joined_with_image(coarse, mirror, reach)
    return None if sound_faults(surface, result, 3) else result


def _not_worse(source: PolyMesh, symmetric: PolyMesh, whole: PolyMesh) -> bool:
    """Whether a symmetric result is as near to the model as another, and as even (see above)."""
    return (
        nearly_as_like(source, symmetric, whole, _WORSE)
        and _evenness(symmetric) >= _evenness(whole) / _WORSE
    )


def _evenness(mesh: PolyMesh) -> float:
    """Return the quality that all but the worst twentieth of the triangles have."""
    return float(np.quantile(quality(*(mesh.vertices[mesh.indices[k::3]] for k in range(3))), 0.05))


def even_triangles(
    model: Model, mesh: PolyMesh, n_triangles: int, progress: Progress = no_progress
) -> PolyMesh:
    """Make triangles more even and their valences more regular, and fit them to a model.

    Short edges vanish and long ones are split, edges are flipped, and vertices move.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        An oriented manifold of triangles near it.
    n_triangles : int
        How many there should be.
    progress : callable
        Told about each round.
    """
    for number in range(_FLIPPING):
        progress("evening triangles", number, _FLIPPING)
        mesh = even_edges(model, mesh, n_triangles)
        mesh = fit(model, flip_edges(model, mesh), 1, _EVEN_FLIPPING)
    return fit(model, mesh, _FITTING, _EVEN_FITTING)


def _refused(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"the mesh could not be turned into triangles: {why}\nWhat may help: more triangles; "
        "smoothing the scan first; closing small holes; or --remesh quads:N"
    )


def _valence_note(mesh: PolyMesh) -> str:
    """Say how many edges meet in the vertices."""
    valence = interior_valences(build_halfedges(mesh))[1]
    if not len(valence):
        return "no vertex is inside the surface"
    share = float(np.mean(valence == REGULAR))
    return (
        f"{share:.0%} of the vertices inside have six edges, as in a regular kagome weave; the "
        f"others have from {valence.min()} to {valence.max()}"
    )
