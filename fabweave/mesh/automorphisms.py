"""Find the group of motions that map a mesh onto itself, as permutations of its half-edges."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    flags,
    frozen_value,
    offsets_of,
    unit,
)
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import label_links, walk_from
from fabweave.mesh.upright import largest_dimension

#: Every unit vector has a component above this, which is just below 1 / sqrt(3).
_LARGE = 0.577


@frozen_value
class Symmetry:
    """A finite group of motions that map a mesh onto itself, as permutations of its half-edges.

    Element 0 is the identity, and the generators are the next ones in their order; every other is a
    generator after an earlier element. A motion takes a place ``x`` to
    ``centre + matrix @ (x - centre)``.

    A motion that *reverses* turns the surface inside out as seen from itself: what is
    counter-clockwise becomes clockwise. On closed surfaces reflections do, and rotations do not;
    on open ones a half-turn may swap front and back, and reverses as well. The half-edge of an
    image then runs against the image of the half-edge.

    Parameters
    ----------
    centre : (3,) float array
        The point that all motions leave in place: the mean of all corners of faces.
    matrix : (G, 3, 3) float array
        Orthogonal matrices.
    proper : (G,) bool array
        Whether each motion is a rotation; otherwise it is a reflection, perhaps with a turn.
    reverses : (G,) bool array
        Whether each motion reverses the surface.
    after, by : (G,) int arrays
        Each element is generator ``by`` after element ``after``; -1 for the identity.
    generators : (N, H) int array
        Where the generators take each half-edge.
    tolerance : float
        How far a generator may take a corner from its image, as a share of the mesh's size.
    off : float
        How far generators take any corner, and all elements a sample of them, from its image, in
        the same measure.
    """

    centre: FloatArray
    matrix: FloatArray
    proper: BoolArray
    reverses: BoolArray
    after: IntArray
    by: IntArray
    generators: IntArray
    tolerance: float
    off: float

    @property
    def order(self) -> int:
        """Number of motions, the identity among them."""
        return len(self.proper)

    @property
    def n_rotations(self) -> int:
        """Number of rotations, the identity among them."""
        return int(np.count_nonzero(self.proper))

    @property
    def n_reflections(self) -> int:
        """Number of reflections, with a turn or without."""
        return self.order - self.n_rotations

    def images(self, halfedges: IntArray) -> IntArray:
        """Return where every element takes some half-edges, (G, K)."""
        return images_of(self.generators, self.after, self.by, halfedges)

    @cached_property
    def permutations(self) -> IntArray:
        """Where every element takes each half-edge, (G, H); large on large meshes."""
        return self.images(np.arange(self.generators.shape[1]))

    @cached_property
    def axis(self) -> FloatArray:
        """Axis of each motion, (G, 3): of its turn, and the normal of the plane it reflects in.

        Of the two directions, the one whose first large component is positive; zero for the
        identity and for the reflection in a point.
        """
        length = np.linalg.norm(self._turns, axis=1, keepdims=True)
        found = np.where(length > 1e-9, unit(self._turns), 0.0)
        large = found[np.arange(self.order), np.argmax(np.abs(found) > _LARGE, axis=1)]
        return np.asarray(found * np.where(large < 0, -1.0, 1.0)[:, None])

    @cached_property
    def angle_deg(self) -> FloatArray:
        """How far each motion turns about its axis, counter-clockwise, in degrees, (G,).

        Above -180 and up to 180. A plain reflection turns by 0, and one in a point by 180.
        """
        angle = np.degrees(np.einsum("ij,ij->i", self._turns, self.axis))
        angle = np.where(self.proper, angle, angle + 180.0)
        angle = np.round(angle, 9)
        angle = np.where(angle > 180.0, angle - 360.0, angle)
        return np.asarray(np.where(angle <= -180.0, angle + 360.0, angle)) + 0.0

    @cached_property
    def _turns(self) -> FloatArray:
        """The rotations as vectors, and of reflections the rotation that their opposite is."""
        proper = self.matrix * np.where(self.proper, 1.0, -1.0)[:, None, None]
        return np.asarray(Rotation.from_matrix(proper).as_rotvec())


def images_of(generators: IntArray, after: IntArray, by: IntArray, items: IntArray) -> IntArray:
    """Return where every element takes some items, (G, K)."""
    result = np.empty((len(after), len(items)), dtype=np.int64)
    result[0] = items
    for element in range(1, len(after)):
        result[element] = generators[by[element]][result[after[element]]]
    return result


def orbits(permutations: IntArray, count: int) -> IntArray:
    """Return the orbit of each of some items under permutations (N, count), numbered from 0.

    Examples
    --------
    >>> orbits(np.array([[1, 0, 2, 3]]), 4).tolist()
    [0, 0, 1, 2]
    """
    here = np.tile(np.arange(count), len(permutations))
    return label_links(here, permutations.ravel(), count)[1]


def best_motions(here: FloatArray, there: FloatArray, mirrors: BoolArray | bool) -> FloatArray:
    """Return the rotations, or reflections, about the origin that take places nearest to others.

    Parameters
    ----------
    here, there : (..., N, 3) float arrays
        Places and their images.
    mirrors : bool, or array of them
        Whether to return a reflection.

    Returns
    -------
    (..., 3, 3) float array
        Orthogonal matrices.

    References
    ----------
    Kabsch, "A solution for the best rotation to relate two sets of vectors", Acta Cryst. A32
    (1976).
    """
    left, _, right = np.linalg.svd(np.swapaxes(there, -1, -2) @ here)
    sign = np.sign(np.linalg.det(left) * np.linalg.det(right)) * np.where(mirrors, -1.0, 1.0)
    left = left * np.stack((np.ones_like(sign), np.ones_like(sign), sign), axis=-1)[..., None, :]
    return np.asarray(left @ right)


def distances_left(matrix: FloatArray, here: FloatArray, there: FloatArray) -> FloatArray:
    """Return how far motions take places from their images, (..., N)."""
    away = here @ np.swapaxes(matrix, -1, -2)
    away -= there
    return np.sqrt(np.einsum("...i,...i->...", away, away))


@frozen_value
class Walks:
    """The shortest walks from some half-edges to all that they are connected with.

    Parameters
    ----------
    order : (N,) int array
        The half-edges that are reached, by the length of their walk; those at the beginning first.
    before : (N,) int array
        Of which of them the walk comes; itself at the beginning.
    step : (N,) int array
        By which step: 0 to the next of the face, 1 to the twin.
    levels : (L + 1,) int array
        Walks of ``k`` steps are at ``levels[k]:levels[k + 1]``.
    """

    order: IntArray
    before: IntArray
    step: IntArray
    levels: IntArray


def plan_walks(halfedges: Halfedges, roots: IntArray) -> Walks:
    """Plan walks from some half-edges, no two of which are connected.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.polymesh import PolyMesh
    >>> pair = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2], [0, 2, 3]])
    >>> walks = plan_walks(build_halfedges(pair), np.array([0]))
    >>> walks.order.tolist(), walks.levels.tolist()
    ([0, 1, 2, 3, 4, 5], [0, 1, 2, 3, 4, 5, 6])
    """
    count = halfedges.n_halfedges
    inner = halfedges.twin >= 0
    bounds = offsets_of(1 + inner)
    links = np.empty(bounds[-1], dtype=np.int64)
    links[bounds[:-1]] = halfedges.next
    links[bounds[:-1][inner] + 1] = halfedges.twin[inner]
    order, before = walk_from(roots, bounds, links)
    before[: len(roots)] = order[: len(roots)]
    place = np.empty(count, dtype=np.int64)
    place[order] = np.arange(len(order))
    came = place[before]  # does not decrease
    came[: len(roots)] = -1
    levels = [0, len(roots)]
    while levels[-1] < len(order):
        levels.append(int(np.searchsorted(came, levels[-1])))
    step = (halfedges.next[before] != order).astype(np.int64)
    return Walks(order, before, step, np.array(levels, dtype=np.int64))


def step_table(halfedges: Halfedges, *, reverses: bool) -> IntArray:
    """Return where each step leads from each half-edge, (2, H), or leads to in a mirror image.

    A mirror image runs around faces the other way, so what is next comes to lie before.
    """
    return np.stack((halfedges.prev if reverses else halfedges.next, halfedges.twin))


def follow_walks(walks: Walks, table: IntArray, images: IntArray) -> IntArray:
    """Follow the same walks from other half-edges.

    Parameters
    ----------
    walks : Walks
        The walks.
    table : (2, H) int array
        Where steps lead.
    images : int array
        Where the walks begin, in the order of the roots.

    Returns
    -------
    (H,) int array
        Where the walk to each half-edge leads instead; -1 for those not reached, and where a walk
        would leave the mesh at its boundary.
    """
    flat = table.ravel()
    count = table.shape[1]
    result = np.full(count, -1, dtype=np.int64)
    result[walks.order[: len(images)]] = images
    shift = walks.step * count
    bounds = walks.levels.tolist()
    for low, high in pairwise(bounds[1:]):
        came = result[walks.before[low:high]]
        result[walks.order[low:high]] = np.where(came >= 0, flat[shift[low:high] + came], -1)
    return result


def key_of(image: int, reverses: int, mirrors: int) -> int:
    """Return the number under which a motion is remembered."""
    return 4 * image + 2 * reverses + mirrors


@frozen_value
class Elements:
    """Products of generators: where each takes the first half-edge, and how it is made."""

    image: IntArray
    reverses: IntArray
    mirrors: IntArray
    after: IntArray
    by: IntArray

    @property
    def keys(self) -> IntArray:
        """The key of each."""
        return np.asarray(4 * self.image + 2 * self.reverses + self.mirrors)


def reached_from(
    generators: Sequence[IntArray],
    signs: Sequence[tuple[bool, bool]],
    start: tuple[int, int, int],
    count: int,
) -> Elements:
    """Return all that products of generators make of one motion."""
    seen = flags(4 * count, key_of(*start))
    image, reverses, mirrors = (np.array([value], dtype=np.int64) for value in start)
    number = np.zeros(1, dtype=np.int64)
    rows = [np.stack((image, reverses, mirrors, number - 1, number - 1))]
    total = 1
    while len(image):
        fresh = []
        for by, (generator, (turns, flips)) in enumerate(zip(generators, signs, strict=True)):
            there = np.stack((generator[image], reverses ^ turns, mirrors ^ flips))
            key = 4 * there[0] + 2 * there[1] + there[2]
            new = ~seen[key]
            seen[key[new]] = True
            made = np.full(np.count_nonzero(new), by)
            fresh.append(np.concatenate((there[:, new], [number[new], made])))
        step = np.concatenate(fresh, axis=1) if fresh else np.zeros((5, 0), dtype=np.int64)
        rows.append(step)
        image, reverses, mirrors = step[:3]
        number = total + np.arange(step.shape[1])
        total += step.shape[1]
    return Elements(*np.concatenate(rows, axis=1))


#: How far a motion may take a corner from its image, as a share of the mesh's size: above what
#: rounding does to built meshes, and to files with seven digits.
EXACT = 1e-6
#: What floating-point numbers add to any distance, as a share of the size.
_ROUNDING = 1e-12
#: Half-edges around the first one that are compared before a motion is tried on all.
_NEARBY = 32
#: Motions that are fitted together.
_TOGETHER = 10_000
#: Half-edges that every element's matrix is fitted to.
_SAMPLES = 64
#: Motions that fail on the whole mesh, though they fit at its first half-edge, before the search
#: ends: they are many only where the mesh is symmetric but for noise just above the tolerance.
_FAILURES = 30
#: Rounds in which half-edges are told apart by their neighbours.
_ROUNDS = 4


@frozen_value
class _Scene:
    """What is compared: the tail and the head of each half-edge from the centre, and marks."""

    halfedges: Halfedges
    tail: FloatArray
    head: FloatArray
    near: FloatArray
    far: FloatArray
    sides: IntArray
    handed: IntArray
    reach: float

    def tails_at_images(self, reverses: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return what the tail of a half-edge goes to at its image, and the radii of both ends."""
        if reverses:
            return self.head, self.far, self.near
        return self.tail, self.near, self.far


def find_symmetry(
    mesh: PolyMesh,
    halfedges: Halfedges,
    *,
    handed: IntArray | None = None,
    tolerance: float = EXACT,
    reflections: bool = True,
) -> Symmetry:
    """Find the rotations and reflections that map a mesh onto itself.

    A motion that maps a connected mesh onto itself is known from where it takes one half-edge:
    all others follow by walking. So

    1. half-edges are told apart by what no motion changes (lengths, distances from the centre,
       numbers of sides, and those of their neighbours), and one of the rarest sort is the first;
    2. all of its sort are compared with it over the same short walk: first those distances, then
       how well a motion takes one neighbourhood to the other;
    3. what is left is walked from in full, unless a product of motions that are known (or of one
       that is known and one that failed) leads there. The motion that fits best must take every
       corner to its image within the tolerance. Each that does is a generator, and at least
       doubles the group, so there are few.

    Other bodies follow by where the motion takes them. Only so many motions may fail in step 3,
    so where the tolerance is just below the noise of a mesh, some may be missed. Each step is
    linear in the half-edges, but for sorting.

    Parameters
    ----------
    mesh : PolyMesh
        Any faces; several bodies, and boundaries, are allowed.
    halfedges : Halfedges
        Its connectivity.
    handed : (H,) int array, optional
        Marks of a handedness, such as of a screw, which a rotation must keep and a reflection
        must negate.
    tolerance : float
        How far a corner may be from its image, as a share of the largest dimension. It is held by
        the generators; of products of many it may be exceeded so many times.
    reflections : bool
        Whether to look for reflections, too.

    Returns
    -------
    Symmetry
        With the identity alone where there is nothing else. What is planar is reflected in its
        plane, too.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.grids import torus
    >>> mesh = torus(24, 12, 35.0, 15.0)
    >>> found = find_symmetry(mesh, build_halfedges(mesh))
    >>> found.n_rotations, found.n_reflections
    (48, 48)

    References
    ----------
    Brass, Knauer, "Testing congruence and symmetry for general 3-dimensional objects",
    Computational Geometry 27 (2004). Butler, "Fundamental algorithms for permutation groups",
    LNCS 559 (1991): orbits and generators.
    """
    count = halfedges.n_halfedges
    corners = mesh.vertices[halfedges.tail]
    centre = corners.mean(axis=0) if count else np.zeros(3)
    size = largest_dimension(mesh.with_vertices(corners)) if count else 0.0
    scene = _scene(halfedges, corners - centre, handed, (tolerance + _ROUNDING) * size)
    generators: list[IntArray] = []
    signs: list[tuple[bool, bool]] = []
    furthest, failures = 0.0, 0
    if not count:
        known = Elements(*np.array([[0], [0], [0], [-1], [-1]]))
    else:
        seed, sort = _rarest(scene)
        known = reached_from(generators, signs, (seed, 0, 0), count)
        done = flags(4 * count, known.keys)
        search = _MotionSearch(scene, seed)
        for image, reverses, mirrors in search.candidates(sort, reflections=reflections):
            if done[key_of(image, reverses, mirrors)]:
                continue
            found, away = search.motion(image, reverses=bool(reverses), mirrors=bool(mirrors))
            if found is None:
                failures += 1
                if failures == _FAILURES:
                    break
                failed = reached_from(generators, signs, (image, reverses, mirrors), count)
                done[failed.keys] = True
                continue
            furthest = max(furthest, away)
            generators.append(found)
            signs.append((bool(reverses), bool(mirrors)))
            known = reached_from(generators, signs, (seed, 0, 0), count)
            done[known.keys] = True
    perms = np.array(generators, dtype=np.int64).reshape(len(generators), count)
    matrix, off = _fitted(scene, perms, known)
    return Symmetry(
        centre=centre,
        matrix=matrix,
        proper=known.mirrors == 0,
        reverses=known.reverses == 1,
        after=known.after,
        by=known.by,
        generators=perms,
        tolerance=tolerance,
        off=max(off, furthest) / size if size else 0.0,
    )


def _scene(halfedges: Halfedges, tail: FloatArray, handed: IntArray | None, reach: float) -> _Scene:
    head = tail[halfedges.next]
    radius = np.linalg.norm(tail, axis=1)
    sides = np.bincount(halfedges.face)[halfedges.face] if len(tail) else halfedges.face
    if handed is None:
        handed = np.zeros(len(tail), dtype=np.int64)
    return _Scene(halfedges, tail, head, radius, radius[halfedges.next], sides, handed, reach)


def _classes(values: FloatArray, reach: float) -> IntArray:
    """Give each value a number; those that are no further apart than this share one."""
    order = np.argsort(values, kind="stable")
    steps = np.concatenate(([0], np.cumsum(np.diff(values[order]) > reach)))
    result = np.empty(len(values), dtype=np.int64)
    result[order] = steps
    return result


def _paired(one: IntArray, other: IntArray) -> IntArray:
    """Give each pair of numbers a number."""
    _, result = np.unique(one * (int(other.max()) + 1) + other, return_inverse=True)
    return np.asarray(result, dtype=np.int64)


def _both(one: IntArray, other: IntArray) -> IntArray:
    """Give each unordered pair of numbers a number."""
    return _paired(np.minimum(one, other), np.maximum(one, other))


def _rarest(scene: _Scene) -> tuple[int, IntArray]:
    """Return a half-edge of the rarest sort, and all of its sort."""
    half = scene.halfedges
    length = np.linalg.norm(scene.head - scene.tail, axis=1)
    # The mirror image of a half-edge runs the other way, so no sort depends on that.
    radius = _classes(scene.near, 2 * scene.reach)
    sort = _both(radius, radius[half.next])
    sort = _paired(sort, _classes(length, 2 * scene.reach))
    sort = _paired(sort, scene.sides)
    sort = _paired(sort, np.abs(scene.handed))
    count = 0
    for _ in range(_ROUNDS):
        if sort.max() + 1 == count:
            break
        count = int(sort.max()) + 1
        across = np.where(half.twin >= 0, sort[half.twin], count)
        beside = _both(sort[half.next], sort[half.prev])
        sort = _paired(_paired(sort, across), beside)
    number = np.bincount(sort)
    seed = int(np.argmin(number[sort]))
    return seed, np.flatnonzero(sort == sort[seed])


class _MotionSearch:
    """Candidates for motions, and the trial of one."""

    def __init__(self, scene: _Scene, seed: int) -> None:
        """Plan the walks: through the body of the first half-edge, and through all others."""
        self.scene = scene
        self.body = plan_walks(scene.halfedges, np.array([seed]))
        self.tables = [step_table(scene.halfedges, reverses=way) for way in (False, True)]
        self.others: Walks | None = None
        self.edges: KDTree | None = None
        rest = ~flags(scene.halfedges.n_halfedges, self.body.order)
        roots = np.unique(_bodies(scene.halfedges), return_index=True)[1]
        roots = np.sort(roots[rest[roots]])
        if len(roots):
            self.others = plan_walks(scene.halfedges, roots)
            self.edges = KDTree(np.concatenate((scene.tail, scene.head), axis=1))

    def candidates(self, sort: IntArray, *, reflections: bool) -> Iterator[tuple[int, int, int]]:
        """Yield where the first half-edge may go, and whether that reverses and reflects."""
        for reverses in (False, True):
            images, plain, mirrored = self._alike(sort, reverses=reverses)
            for mirrors, fits in ((0, plain), (1, mirrored)):
                if mirrors and not reflections:
                    continue
                for image in images[fits].tolist():
                    yield image, int(reverses), mirrors

    def _alike(self, images: IntArray, *, reverses: bool) -> tuple[IntArray, BoolArray, BoolArray]:
        """Return around which half-edges it looks as around the first: turned, and reflected."""
        scene, walks, table = self.scene, self.body, self.tables[reverses]
        source, near, far = scene.tails_at_images(reverses)
        words = walks.order[:_NEARBY]
        place = {int(half): number for number, half in enumerate(words.tolist())}
        met = np.empty((len(images), len(words)), dtype=np.int64)
        signs = np.ones((2, len(images)), dtype=bool)
        for number, half in enumerate(words.tolist()):
            if number:
                came = met[:, place[int(walks.before[number])]]
                met[:, number] = table[walks.step[number], came]
            else:
                met[:, 0] = images
            at = met[:, number]
            keeps = scene.handed[at] == scene.handed[half]
            signs &= np.stack((keeps, scene.handed[at] == -scene.handed[half]))
            fits = (
                (at >= 0)
                & ((scene.halfedges.twin[at] >= 0) == (scene.halfedges.twin[half] >= 0))
                & (scene.sides[at] == scene.sides[half])
                & (np.abs(near[at] - scene.near[half]) <= 2 * scene.reach)
                & (np.abs(far[at] - scene.far[half]) <= 2 * scene.reach)
                & signs.any(axis=0)
            )
            met, signs = met[fits], signs[:, fits]
        for number, mirrors in enumerate((False, True)):
            which = np.flatnonzero(signs[number])
            for some in np.array_split(which, 1 + len(which) // _TOGETHER):
                here, there = scene.tail[words], source[met[some]]
                away = distances_left(best_motions(here, there, mirrors), here, there)
                # The motion that fits all fits these a little worse than their own.
                signs[number, some] = np.sqrt(np.mean(away**2, axis=1)) <= scene.reach
        return met[:, 0], signs[0], signs[1]

    def motion(self, image: int, *, reverses: bool, mirrors: bool) -> tuple[IntArray | None, float]:
        """Return where the motion takes each half-edge that takes the first one to an image.

        None if there is no such motion. Also return how far it takes corners from their images.
        """
        scene, table = self.scene, self.tables[reverses]
        source, *_ = scene.tails_at_images(reverses)
        found = follow_walks(self.body, table, np.array([image]))
        body = self.body.order
        if found[body].min() < 0:
            return None, np.inf
        if self.others is not None and self.edges is not None:
            matrix = best_motions(scene.tail[body], source[found[body]], mirrors)
            roots = self.others.order[: self.others.levels[1]]
            ends = scene.tail[roots] @ matrix.T, scene.head[roots] @ matrix.T
            _, images = self.edges.query(np.concatenate(ends[::-1] if reverses else ends, axis=1))
            rest = follow_walks(self.others, table, np.asarray(images, dtype=np.int64))
            found = np.maximum(found, rest)
        if not self._keeps_mesh(found, table, mirrors=mirrors):
            return None, np.inf
        there = source[found]
        matrix = best_motions(scene.tail, there, mirrors)
        away = float(distances_left(matrix, scene.tail, there).max())
        return (found, away) if away <= scene.reach else (None, away)

    def _keeps_mesh(self, found: IntArray, table: IntArray, *, mirrors: bool) -> bool:
        """Say whether a map is a permutation that keeps faces, edges and handedness."""
        half, handed = self.scene.halfedges, self.scene.handed
        if found.min() < 0 or np.bincount(found, minlength=len(found)).max() > 1:
            return False
        across = np.where(half.twin >= 0, found[half.twin], -1)
        return bool(
            np.array_equal(found[half.next], table[0, found])
            and np.array_equal(across, half.twin[found])
            and np.array_equal(handed[found], -handed if mirrors else handed)
        )


def _bodies(halfedges: Halfedges) -> IntArray:
    """Return to which body each half-edge belongs: all that hang together across edges."""
    inner = np.flatnonzero(halfedges.twin >= 0)
    first, second = halfedges.face[inner], halfedges.face[halfedges.twin[inner]]
    _, label = label_links(first, second, int(halfedges.face.max()) + 1)
    return label[halfedges.face]


def _fitted(scene: _Scene, generators: IntArray, known: Elements) -> tuple[FloatArray, float]:
    """Return the matrix of each element, and how far elements take corners from their images."""
    count, order = len(scene.tail), len(known.image)
    sample = np.arange(count)
    if count > _SAMPLES:
        sample = np.sort(np.random.default_rng(0).choice(count, _SAMPLES, replace=False))
    matrix = np.tile(np.eye(3), (order, 1, 1))
    furthest = 0.0
    here = scene.tail[sample]
    images = images_of(generators, known.after, known.by, sample)
    for some in np.array_split(np.arange(1, order), 1 + order // _TOGETHER):
        if not len(some):
            continue
        turned = (known.reverses[some] == 1)[:, None, None]
        there = np.where(turned, scene.head[images[some]], scene.tail[images[some]])
        matrix[some] = best_motions(here, there, known.mirrors[some] == 1)
        furthest = max(furthest, float(distances_left(matrix[some], here, there).max()))
    return matrix, furthest
