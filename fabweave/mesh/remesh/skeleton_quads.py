"""Make quads from the skeleton of a surface: limbs become tubes, with rings around them.

The skeleton is chains of nodes between tips and branches. Chords, rows of quads from side to
opposite side, are then put in and taken out.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    flags,
    frozen_value,
    no_progress,
    unit,
)
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import name_place
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import interior_valences, sum_at
from fabweave.mesh.polymesh import (
    PolyMesh,
    corner_sines,
    face_areas,
    face_normals,
    face_of_corner,
    without_loose,
)
from fabweave.mesh.remesh.engines import (
    EXTRUSION,
    QSLIM,
    SKELETON,
    AttemptFailedError,
    Run,
    lacking,
    run_engine,
)
from fabweave.mesh.remesh.fit import Model, fit, model_of
from fabweave.mesh.remesh.limbs import pillowed
from fabweave.mesh.remesh.quads import made_symmetric
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    check_remeshed,
    cut_surface,
    edge_lengths,
    finished_quads,
    ready_source,
)
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import area_samples, plain_triangles, surface_area


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


#: Samples of the surface that tell how thick it is.
_SAMPLES = 8000
#: A branch that sticks out of a trunk by less than this share of the trunk's radius is a bump.
_BUMP = 0.5
#: A branch that sticks out by less than this share of an edge has no room for a row of faces.
_ROW = 0.8
#: Rings stand so many radii apart.
_APART = 2.0
#: A chain gets no ring of its own where fewer radii are left beside branchings.
_LEAST_FREE = 0.5


@frozen_value
class Skeleton:
    """Places along the middle of a surface, and how thick it is there.

    Parameters
    ----------
    places : (S, 3) float array
    edges : (E, 2) int array
        Which places follow one another.
    radii : (S,) float array
        The mean distance to the surface around.
    """

    places: FloatArray
    edges: IntArray
    radii: FloatArray

    @property
    def valence(self) -> IntArray:
        """How many edges meet at each place, (S,)."""
        return np.bincount(self.edges.reshape(-1), minlength=len(self.places))

    @property
    def n_tips(self) -> int:
        """Number of ends."""
        return int(np.count_nonzero(self.valence == 1))

    def chains(self) -> list[list[int]]:
        """Return the places of each chain, from a tip or branching to the next.

        A ring without any starts and ends at its least place.

        Examples
        --------
        >>> edges = np.array([[0, 1], [1, 2], [1, 3], [3, 4]])
        >>> Skeleton(np.zeros((5, 3)), edges, np.ones(5)).chains()
        [[0, 1], [1, 2], [1, 3, 4]]
        """
        neighbours: list[list[int]] = [[] for _ in self.places]
        for tail, head in self.edges.tolist():
            neighbours[tail].append(head)
            neighbours[head].append(tail)
        left = {(min(edge), max(edge)) for edge in self.edges.tolist()}
        knots = [at for at, around in enumerate(neighbours) if len(around) not in (0, 2)]
        chains = []
        for start in [*knots, *range(len(neighbours))]:
            for first in sorted(neighbours[start]):
                if (min(start, first), max(start, first)) not in left:
                    continue
                chain = [start, first]
                while len(neighbours[chain[-1]]) == 2 and chain[-1] != start:
                    chain.append(next(at for at in neighbours[chain[-1]] if at != chain[-2]))
                left -= {(min(pair), max(pair)) for pair in pairwise(chain)}
                chains.append(chain)
        return chains

    def branches(self) -> list[list[int]]:
        """Return the chains that start at a tip and end at a branching."""
        valence, chains = self.valence, self.chains()
        both = [*chains, *(chain[::-1] for chain in chains)]
        return [chain for chain in both if valence[chain[0]] == 1 and valence[chain[-1]] > 2]


def measured(bones: PolyMesh, surface: PolyMesh) -> Skeleton:
    """Return a skeleton with its radii.

    Parameters
    ----------
    bones : PolyMesh
        Its edges, as faces of two corners.
    surface : PolyMesh
        What it is the skeleton of.
    """
    places, edges = bones.vertices, bones.indices.reshape(-1, 2)
    samples, _ = area_samples(*plain_triangles(surface), _SAMPLES)
    middles = places[edges].mean(axis=1)
    far, nearest = cKDTree(np.concatenate([places, middles])).query(samples)
    ends = np.concatenate([np.repeat(np.arange(len(places))[:, None], 2, axis=1), edges])[nearest]
    number = np.bincount(ends.reshape(-1), minlength=len(places))
    total = np.bincount(ends.reshape(-1), np.repeat(far, 2), minlength=len(places))
    radii = np.where(number > 0, total / np.maximum(number, 1), np.median(far))
    return Skeleton(places, edges, radii)


def pruned(bones: Skeleton, least: float, side: float = 0.0) -> tuple[Skeleton, list[FloatArray]]:
    """Take away branches that are bumps of a trunk, or too small for faces of their own.

    Parameters
    ----------
    bones : Skeleton
    least : float
        The least mean radius of a branch.
    side : float
        How long edges will be: a branch sticks out by more than `_ROW` of that.

    Returns
    -------
    pruned : Skeleton
    small : list of (3,) float arrays
        The tips of those that were no bumps, but too small.
    """
    small: list[FloatArray] = []
    while True:
        worst: tuple[float, list[int], bool] | None = None
        for chain in bones.branches():
            long = np.linalg.norm(np.diff(bones.places[chain], axis=0), axis=1).sum()
            out = float(long + bones.radii[chain[0]] - bones.radii[chain[-1]])
            bump = out / (_BUMP * float(bones.radii[chain[-1]]))
            slim = float(bones.radii[chain[:-1]].mean()) / least
            score = min(bump, slim, out / (_ROW * side) if side > 0 else np.inf)
            if score < 1 and (worst is None or score < worst[0]):
                worst = score, chain, bump >= 1
        if worst is None:
            return bones, small
        _, chain, told = worst
        if told:
            small.append(bones.places[chain[0]])
        bones = _without(bones, chain[:-1])


#: A branch starts at the nearest place of the rest if that is nearer by this factor.
_NEARER = 0.7


def rerouted(bones: Skeleton, surface: Surface) -> Skeleton:
    """Let branches start from the nearest places of the rest, straight through the inside."""
    tried: set[tuple[int, int]] = set()
    while True:
        valence = bones.valence
        for chain in bones.branches():
            start, knot = chain[-2], chain[-1]
            if (start, knot) in tried:
                continue
            tried.add((start, knot))
            here = bones.places[start]
            far = np.linalg.norm(bones.places - here, axis=1)
            far[chain] = np.inf
            far[valence == 1] = np.inf
            best = int(np.argmin(far))
            if far[best] > _NEARER * np.linalg.norm(bones.places[knot] - here):
                continue
            between = here + np.linspace(0, 1, 9)[1:-1, None] * (bones.places[best] - here)
            feet = surface.feet(between)
            if np.any(np.einsum("nd,nd->n", between - feet.points, feet.normals) > 0):
                continue
            edges = [e for e in bones.edges.tolist() if set(e) != {start, knot}]
            bones = Skeleton(bones.places, np.array([*edges, [start, best]]), bones.radii)
            break
        else:
            return bones


def _without(bones: Skeleton, gone: list[int]) -> Skeleton:
    kept = ~flags(len(bones.places), gone)
    number = np.cumsum(kept) - 1
    edges = bones.edges[kept[bones.edges].all(axis=1)]
    return Skeleton(bones.places[kept], number[edges], bones.radii[kept])


def resampled(bones: Skeleton) -> Skeleton:
    """Return a skeleton whose places stand about two radii apart along each chain."""
    valence = bones.valence
    knots = np.flatnonzero((valence != 2) & (valence > 0))
    places, radii = list(bones.places[knots]), list(bones.radii[knots])
    number = {int(knot): at for at, knot in enumerate(knots)}
    edges = []
    for chain in bones.chains():
        at = bones.places[chain]
        way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(at, axis=0), axis=1))])
        thick = bones.radii[chain]
        ring = chain[0] == chain[-1]
        # The way in radii; branchings take as much of it as they are thick.
        count = np.concatenate([[0.0], np.cumsum(np.diff(way) * 2 / (thick[1:] + thick[:-1]))])
        start, end = (int(valence[chain[k]] > 2) for k in (0, -1))
        free = max(float(count[-1]) - start - end, 0.0)
        spans = max(round(free / _APART), 3 if ring else 0 if start and end else 1)
        if start and end:
            share = (np.arange(spans) + 0.5) / max(spans, 1)
        else:  # from the rim of the branching, if there is one, to before the tip
            share = np.arange(spans + 1)[1 - start : spans + end] / spans
        where = np.interp(start + share * free, count, way) if free > _LEAST_FREE else ()
        ids = [number.setdefault(chain[0], len(places))]
        if ids[0] == len(places):
            places.append(at[0])
            radii.append(thick[0])
        for along in where:
            ids.append(len(places))
            places.append(np.array([np.interp(along, way, axis) for axis in at.T]))
            radii.append(float(np.interp(along, way, thick)))
        ids.append(ids[0] if ring else number[chain[-1]])
        edges += list(pairwise(ids))
    return Skeleton(np.array(places), np.array(edges), np.array(radii))


#: Triangles that the skeleton is made from: more of them take much longer, and add little.
_ENOUGH = 2000
#: A limb of four quads around with a smaller radius (mm) has ribbons of less than some 5 mm.
_LEAST_RADIUS_MM = 4.0
#: Rounds of growing from the skeleton, and after each change.
_GROW, _REGROW = 25, 6
#: A sample draws a vertex whose normal has at least this cosine with its own.
_ALIKE = 0.3
#: Few samples are less than this share of the usual. How strongly what is in a pleat rises out of
#: it, at first and where that spoils the surface.
_FEW, _RISES = 0.3, (0.2, 0.0)
#: Rounds of fitting at the end, and how even vertices stand.
_FIT, _EVEN = 3, 3.0
#: A corner is flat where the sine of its angle is below this; rounds of mending it.
_FLAT, _UNFOLDINGS = 0.25, 30
#: At most so many rings are put around wide parts.
_MOST_RINGS = 8


def remesh_tubes(mesh: PolyMesh, n_quads: int, *, progress: Progress = no_progress) -> Remeshed:
    """Turn a mesh into quads that run along its limbs and around them.

    1. The skeleton of the surface is found (local separators). Branches that are bumps, or too
       thin for ribbons, are left out; rings are placed about two radii apart.
    2. Quads are extruded along it, and grow to the surface. At a boundary the tube is opened.
    3. Rows of quads are taken out where they are too narrow, rings are put around what is too
       wide, and rows are split where they are too long, until faces have the size wanted.
    4. Of a mirror-symmetric model, one half is taken and joined to its image, if that is not worse.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_quads : int
        About how many quads.
    progress : callable

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If PyGEL cannot run here, or nothing sound came of it; the message says why.

    References
    ----------
    Bærentzen, Rotenberg, "Skeletonization via local separators", ACM TOG 40(5), 2021. Pandey,
    Bærentzen, Singh, "Face extrusion quad meshes", SIGGRAPH 2022.
    """
    checked_count("tubes", n_quads)
    if lack := lacking("tubes"):
        raise CannotMakeError(lack)
    source, notes = ready_source(mesh)
    model, side = model_of(source, n_quads), float(np.sqrt(surface_area(source) / n_quads))
    try:
        progress("finding the skeleton", 0, 2)
        bones, small = _skeleton(source, model, side)
        progress("laying tubes around the skeleton", 1, 2)
        graph = PolyMesh.from_faces(bones.places, bones.edges)
        tubes = run_engine(EXTRUSION, graph, Run(0, 0, rim=False), radii=bones.radii)
    except AttemptFailedError as error:
        raise _failed(str(error)) from error
    found = None
    faults: tuple[str, ...] = ()
    for made in _sized(model, tubes, source, n_quads, side):
        faults = check_remeshed(source, made)
        clashes = len(self_intersections(made))
        if not faults and (found is None or clashes < found[0]):
            found = clashes, made
        if found is not None and not found[0]:
            break
    told = []
    if small:
        where = few_of(sorted({name_place(place, source) for place in small}), 5)
        told.append(
            agree(len(small), "{n} [branch is|branches are] too small for ribbons and [is|are] ")
            + f"left out ({where}); more quads, and a larger size, would keep more"
        )
    if found is None:
        raise _failed("; ".join([*faults, *told]))
    symmetric = made_symmetric(source, found[1], model)
    made = found[1] if symmetric is None else symmetric
    notes.append(
        f"PyGEL found a skeleton with {agree(bones.n_tips, '{n} tip[|s]')}; tubes around it have "
        f"{made.n_faces} quads ({n_quads} were wanted)"
        + ("" if symmetric is None else ", mirror-symmetric as the model is")
    )
    notes += told
    return finished_quads(made, "tubes", notes)


def _failed(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"no tubes could be laid around the skeleton of the mesh: {why}. What may help: another "
        "number of quads; --remesh quads or --remesh triangles; or --bodies wrap, if the mesh runs "
        "through itself"
    )


def _skeleton(source: PolyMesh, model: Model, side: float) -> tuple[Skeleton, list[FloatArray]]:
    """Return where rings are to stand, and the tips of branches that are too small."""
    surface = cut_surface(source)
    fewer = surface
    if surface.n_faces > _ENOUGH:
        fewer = run_engine(QSLIM, surface, Run(_ENOUGH, 0, rim=False))
    bones = measured(run_engine(SKELETON, fewer, Run(0, 0, rim=False)), surface)
    bones, small = pruned(rerouted(bones, model.surface), _LEAST_RADIUS_MM, side)
    return resampled(bones), small


def grown(model: Model, mesh: PolyMesh, rounds: int, rise: float) -> PolyMesh:
    """Let a mesh grow smoothly from inside a model to it.

    Each round draws each vertex to the samples that are nearest to it, of those that look its way,
    and to the middle of its neighbours.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
    rounds : int
    rise : float
        How strongly what is in a pleat between limbs rises out of it.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> ball = grown(model_of(sphere(24, 50.0), 98), sphere(4, 20.0), 8, 0.0)
    >>> bool(np.linalg.norm(ball.vertices, axis=1).min() > 45)
    True
    """
    count, half = mesh.n_vertices, build_halfedges(mesh)
    near = sparse.csr_array((np.ones(half.n_halfedges), (half.tail, half.head)), (count, count))
    near = near.maximum(near.T)
    umbrella = sparse.diags_array(1 / near.sum(axis=1)) @ near - sparse.eye_array(count)
    smooth, face = umbrella.T @ umbrella, face_of_corner(mesh)
    for _ in range(rounds):
        normal = unit(sum_at(mesh.indices, face_normals(mesh)[face], count))
        nearest: IntArray = np.asarray(cKDTree(mesh.vertices).query(model.places)[1])
        alike = np.einsum("nd,nd->n", normal[nearest], model.normals) - _ALIKE
        samples = alike > 0
        if not samples.any():  # all is turned over, which is refused later
            break
        with_one = np.column_stack([model.places, np.ones(len(alike))])
        total = sum_at(nearest[samples], (alike[:, None] * with_one)[samples], count)
        # What few samples draw is in a pleat between limbs, and rises out of it.
        drawn = np.minimum(total[:, 3:] / (_FEW * total[:, 3].mean()), 1.0)
        middle = total[:, :3] / np.maximum(total[:, 3:], 1e-12)
        feet = model.surface.feet(mesh.vertices)
        inside = np.einsum("vd,vd->v", mesh.vertices - feet.points, feet.normals) < 0
        risen = mesh.vertices + np.where(inside, feet.distances, 0.0)[:, None] * normal
        rising = rise * (1.0 - drawn)
        matrix = smooth + sparse.diags_array((drawn + rising)[:, 0])
        mesh = mesh.with_vertices(
            splu(sparse.csc_array(matrix)).solve(drawn * middle + rising * risen)
        )
    return mesh


def _opened(tubes: PolyMesh, source: PolyMesh) -> PolyMesh:
    """Leave out the faces of tubes around the vertex that is nearest to each boundary loop."""
    half = build_halfedges(source)
    rim = np.flatnonzero(half.twin < 0)
    _, loop = label_links(half.tail[rim], half.head[rim], source.n_vertices)
    gone = [
        np.linalg.norm(tubes.vertices - source.vertices[loop == name].mean(axis=0), axis=1).argmin()
        for name in np.unique(loop[half.tail[rim]])
    ]
    kept = ~np.isin(tubes.indices.reshape(-1, 4), gone).any(axis=1)
    return without_loose(PolyMesh.from_faces(tubes.vertices, tubes.indices.reshape(-1, 4)[kept]))


def _sized(
    model: Model, raw: PolyMesh, source: PolyMesh, n_quads: int, side: float
) -> Iterator[PolyMesh]:
    """Yield tubes whose faces are about as large as wanted, in the order of preference."""
    for rise in _RISES:
        tubes = _opened(grown(model, raw, _GROW, rise), source)
        tubes = grown(model, thinned(tubes, side, n_quads), _REGROW, rise)
        wide = tubes
        for _ in range(_MOST_RINGS):
            part = wide_part(wide, side)
            ringed = None if part is None else pillowed(wide, part)
            if ringed is None:
                break
            wide = grown(model, ringed, _REGROW, rise)
        for one in (wide, tubes) if wide is not tubes else (tubes,):
            smooth = grown(model, lengthened(one, n_quads), _REGROW, rise)
            fitted = fit(model, smooth, _FIT, _EVEN)
            unfolded = _unfolded(model, fitted)
            worse = len(self_intersections(unfolded)) > len(self_intersections(fitted))
            yield fitted if worse else unfolded


def _unfolded(model: Model, mesh: PolyMesh) -> PolyMesh:
    """Move corners of quads that are nearly flat or turned in to the middle of their neighbours."""
    half, face = build_halfedges(mesh), face_of_corner(mesh)
    rim = flags(mesh.n_vertices, mesh.indices[(half.twin < 0) | (half.twin[half.prev] < 0)])
    for _ in range(_UNFOLDINGS):
        flat = corner_sines(mesh) < _FLAT
        if not flat.any():
            break
        moved = flags(mesh.n_vertices, mesh.indices[np.isin(face, face[flat])])
        moved &= ~rim
        total = sum_at(half.tail, mesh.vertices[half.head], mesh.n_vertices)
        number = np.bincount(half.tail, minlength=mesh.n_vertices)[:, None]
        middle = model.surface.feet(total / number).points
        mesh = mesh.with_vertices(
            np.where(moved[:, None], (mesh.vertices + middle) / 2, mesh.vertices)
        )
    return mesh
