"""Find the motions and mirrors that map a mesh onto itself, or do so but for noise."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
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
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.nearest import Feet, Surface
from fabweave.mesh.polymesh import PolyMesh, without_loose
from fabweave.mesh.topology import label_links, walk_from
from fabweave.mesh.triangulate import area_samples, plain_triangles
from fabweave.mesh.upright import largest_dimension

#: Samples of the surface; one of so many is used for comparing directions.
_MIRROR_SAMPLES, _EACH = 4000, 4
#: Directions that are tried, beside the three axes and the three principal ones; the best of all
#: are improved.
_DIRECTIONS, _BEST = 60, 8
#: Rounds of improving, and the share of the pairs that are left out of each as too far.
_MIRROR_ROUNDS, _OUTLIERS = 12, 0.1
#: A round must bring the distance below this share of what it was, or it is the last one.
_WORTH = 0.999
#: A surface is symmetric if its mirror image is within this root mean square, in per cent of its
#: size, and 95 % of it within this. Measured: spot, bob and suzanne 0.003, homer and cow 0.1 and
#: 0.2; armadillo and duck 1.5, bunny and fandisk 2.8 and more.
_RMS_PERCENT, _QUANTILE_PERCENT = 0.25, 0.5
#: A vertex is the image of another within this share of the size.
_SAME = 1e-6


@frozen_value
class Mirror:
    """A plane, and how nearly a surface is its own image in it.

    Parameters
    ----------
    point, normal : (3,) float arrays
        The plane; the normal has length one, and its greatest component is positive.
    rms_percent, quantile_percent : float
        Root mean square, and 95 % quantile, of the distances from the mirrored surface to the
        surface, in per cent of its greatest extent.
    """

    point: FloatArray
    normal: FloatArray
    rms_percent: float
    quantile_percent: float

    @property
    def symmetric(self) -> bool:
        """Whether the surface is symmetric for all that a maker can see."""
        return self.rms_percent < _RMS_PERCENT and self.quantile_percent < _QUANTILE_PERCENT

    def image(self, places: FloatArray) -> FloatArray:
        """Return the mirror images of places, (N, 3)."""
        height = (places - self.point) @ self.normal
        return np.asarray(places - 2 * height[:, None] * self.normal)


def find_mirror(mesh: PolyMesh) -> Mirror:
    """Find the plane in which a surface is most nearly its own mirror image.

    Planes through the centre of area are tried in many directions; the best are improved in turns
    of finding the closest points of the mirrored samples, and the plane that mirrors these pairs
    best. It goes by the surface alone, so vertices need not have images.

    Parameters
    ----------
    mesh : PolyMesh
        Faces with an area.

    Returns
    -------
    Mirror
        The same for the same mesh; ask whether it is ``symmetric``.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> mirror = find_mirror(torus(24, 12, 35.0, 15.0))
    >>> mirror.symmetric, round(mirror.rms_percent, 2)
    (True, 0.0)

    References
    ----------
    Podolak, Shilane, Golovinskiy, Rusinkiewicz, Funkhouser, "A planar-reflective symmetry
    transform for 3D shapes", ACM TOG 25(3), 2006. Ecins, Fermüller, Aloimonos, "Detecting
    reflectional symmetries in 3D data through symmetrical fitting", ICCV workshops 2017.
    """
    points, triangles = plain_triangles(mesh)
    surface = Surface(points, triangles)
    places, _ = area_samples(points, triangles, _MIRROR_SAMPLES)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    centre = places.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((places - centre).T))
    directions = np.concatenate([np.eye(3), axes.T, _half_sphere(_DIRECTIONS)])
    few = places[::_EACH]
    score = [_off(surface, few, centre, normal)[0] for normal in directions]
    tried = [
        _improved(surface, few, centre, directions[number])
        for number in np.argsort(score, kind="stable")[:_BEST].tolist()
    ]
    _, point, normal = min(tried, key=lambda plane: plane[0])
    _, point, normal = _improved(surface, places, point, normal)
    normal = normal * np.sign(normal[int(np.argmax(np.abs(normal)))])
    distance = _off(surface, places, point, normal)[1].distances
    return Mirror(
        point,
        normal,
        100.0 * float(np.sqrt(np.mean(distance**2))) / size,
        100.0 * float(np.quantile(distance, 0.95)) / size,
    )


def find_partners(mesh: PolyMesh) -> tuple[Mirror, IntArray] | None:
    """Find the mirror in which each vertex of a mesh has another, or itself, as its image.

    Parameters
    ----------
    mesh : PolyMesh
        Faces with an area.

    Returns
    -------
    mirror : Mirror
    partner : (V,) int array
        The vertex at the image of each; or None if some vertex has none.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> mirror, partner = find_partners(torus(24, 12, 35.0, 15.0))
    >>> bool(np.all(partner[partner] == np.arange(24 * 12)))
    True
    """
    mirror, number = find_mirror(mesh), np.arange(mesh.n_vertices)
    points, size = mesh.vertices, float(np.ptp(mesh.vertices, axis=0).max())
    partner = np.asarray(KDTree(points).query(mirror.image(points))[1], dtype=np.int64)
    if not mirror.symmetric or np.any(partner[partner] != number):
        return None
    # The surface was sampled; its vertices tell the plane exactly.
    across = points - points[partner]
    normal = np.linalg.eigh(across.T @ across)[1][:, -1]
    mirror = replace(
        mirror, point=points.mean(axis=0), normal=normal * np.sign(normal @ mirror.normal)
    )
    away = np.linalg.norm(mirror.image(points) - points[partner], axis=1)
    return (mirror, partner) if away.max() < _SAME * size else None


def _off(
    surface: Surface, places: FloatArray, point: FloatArray, normal: FloatArray
) -> tuple[float, Feet]:
    """Return the root mean square of the distances of mirrored places, and their closest points."""
    feet = surface.feet(places - 2 * ((places - point) @ normal)[:, None] * normal)
    return float(np.sqrt(np.mean(feet.distances**2))), feet


def _improved(
    surface: Surface, places: FloatArray, point: FloatArray, normal: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Bring a plane to where it mirrors the places best; return how far they are off, and it."""
    off, feet = _off(surface, places, point, normal)
    best = off, point, normal
    for _ in range(_MIRROR_ROUNDS):
        near = feet.distances <= np.quantile(feet.distances, 1 - _OUTLIERS)
        here, there = places[near], feet.points[near]
        # The sum of the squares of |image of a place - its partner| is least for the eigenvector
        # of the least eigenvalue of this.
        cross = (here - here.mean(axis=0)).T @ (there - there.mean(axis=0))
        point = (here.mean(axis=0) + there.mean(axis=0)) / 2
        normal = np.linalg.eigh(cross + cross.T)[1][:, 0]
        off, feet = _off(surface, places, point, normal)
        if off >= best[0] * _WORTH:
            break
        best = off, point, normal
    return best


def _half_sphere(count: int) -> FloatArray:
    """Return directions spread over half a sphere, (count, 3), along a spiral."""
    height = (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + 5**0.5) * np.arange(count)
    across = np.sqrt(1 - height**2)
    return unit(np.column_stack([across * np.cos(turn), across * np.sin(turn), height]))


#: Vertices nearer to the mirror than this share of the mean edge are put on it before the cut.
_NEAR = 0.1


def half_of(surface: PolyMesh, mirror: Mirror) -> PolyMesh:
    """Return the part of a surface of triangles on the positive side of a mirror.

    Vertices near the mirror are put on it, and edges that cross it are cut there.

    Parameters
    ----------
    surface : PolyMesh
        An oriented manifold of triangles.
    mirror : Mirror

    Returns
    -------
    PolyMesh
        Triangles, with a boundary on the mirror.

    Examples
    --------
    >>> from fabweave.mesh.symmetry import find_mirror
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> from fabweave.mesh.triangulate import triangulate
    >>> ball = triangulate(sphere(8, 50.0))
    >>> half = half_of(ball, find_mirror(ball))
    >>> half.n_faces == ball.n_faces // 2
    True
    """
    faces = surface.indices.reshape(-1, 3)
    ends = surface.vertices[np.roll(faces, -1, axis=1)] - surface.vertices[faces]
    near = _NEAR * float(np.linalg.norm(ends, axis=2).mean())
    height = (surface.vertices - mirror.point) @ mirror.normal
    on = np.abs(height) <= near
    points = surface.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    height = np.where(on, 0.0, height)
    side = np.sign(height).astype(np.int64)
    corner_side = side[faces]
    whole = faces[(corner_side.min(axis=1) >= 0) & (corner_side.max(axis=1) > 0)]
    crossing = faces[(corner_side.min(axis=1) < 0) & (corner_side.max(axis=1) > 0)]
    cut, points = _cut(crossing, points, height)
    return without_loose(PolyMesh.from_triangles(points, np.concatenate([whole, cut])))


def _cut(crossing: IntArray, points: FloatArray, height: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the parts above of triangles that cross the mirror, and the points with new ones."""
    count = len(points)
    head = np.roll(crossing, -1, axis=1)
    across = height[crossing] * height[head] < 0
    low, high = np.minimum(crossing, head)[across], np.maximum(crossing, head)[across]
    code, number = np.unique(low * count + high, return_inverse=True)
    low, high = np.divmod(code, count)
    share = (height[low] / (height[low] - height[high]))[:, None]
    new = points[low] + share * (points[high] - points[low])
    middle = np.full(crossing.shape, -1)
    middle[across] = count + number.reshape(-1)
    pieces: list[list[int]] = []
    for face, between in zip(crossing.tolist(), middle.tolist(), strict=True):
        ring = []
        for corner, new_corner in zip(face, between, strict=True):
            ring += [corner] if height[corner] >= 0 else []
            ring += [new_corner] if new_corner >= 0 else []
        pieces += [[ring[0], ring[k], ring[k + 1]] for k in range(1, len(ring) - 1)]
    faces = np.array(pieces, dtype=np.int64).reshape(-1, 3)
    return faces, np.concatenate([points, new])


def sound_half(surface: PolyMesh, mirror: Mirror) -> PolyMesh | None:
    """Return the half of a surface of triangles; None if that is no open surface."""
    half = half_of(surface, mirror)
    report = check_mesh(half)
    return None if not half.n_faces or report.fatal or report.closed else half


def joined_with_image(half: PolyMesh, mirror: Mirror, reach: float) -> PolyMesh:
    """Return a half and its mirror image, joined along the boundary that is on the mirror.

    Parameters
    ----------
    half : PolyMesh
        A surface on the positive side.
    mirror : Mirror
    reach : float
        Boundary vertices nearer to the mirror than this are put on it.

    Returns
    -------
    PolyMesh
        Exactly symmetric.
    """
    halfedges = build_halfedges(half)
    height = (half.vertices - mirror.point) @ mirror.normal
    on = flags(half.n_vertices, halfedges.tail[halfedges.twin < 0])
    on &= np.abs(height) <= reach
    points = half.vertices - np.where(on, height, 0.0)[:, None] * mirror.normal
    number = np.where(on, np.arange(len(points)), len(points) + np.cumsum(~on) - 1)
    faces = half.indices.reshape(half.n_faces, -1)
    return PolyMesh.from_faces(
        np.concatenate([points, mirror.image(points[~on])]),
        np.concatenate([faces, number[faces[:, ::-1]]]),
    )


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
        search = _Search(scene, seed)
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


class _Search:
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


#: Noise is looked for up to these shares of the mesh's largest dimension, the least first.
_NOISE = (EXACT, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 2e-2)
#: Motions and places are fitted to one another until no place moves by more than this share.
_SETTLED, _MOST_ROUNDS = 1e-13, 100


@frozen_value
class Symmetrised:
    """A mesh that was made symmetric.

    Parameters
    ----------
    mesh : PolyMesh
    symmetry : Symmetry
        The motions that it was made for.
    moved : (V,) float array
        How far each vertex was moved, in the unit of the mesh.
    """

    mesh: PolyMesh
    symmetry: Symmetry
    moved: FloatArray

    @property
    def note(self) -> str:
        """What was done, in words."""
        group = self.symmetry
        kinds = [agree(group.n_rotations, "{n} [rotation|rotations]")]
        if group.n_reflections:
            kinds.append(agree(group.n_reflections, "{n} [reflection|reflections]"))
        return (
            f"symmetrised: {' and '.join(kinds)} map the mesh onto itself; for that, vertices "
            f"were moved by {self.moved.mean():.3g} mm in the mean and {self.moved.max():.3g} mm "
            "at most"
        )


def symmetrise(mesh: PolyMesh) -> Symmetrised:
    """Move the vertices of a mesh as little as need be, so that it is exactly symmetric.

    The largest group of motions is taken that maps the faces onto one another and corners to
    within 2 % of the mesh's size; of two of one order, that of the lesser noise. Each vertex then
    gets to the mean of where all motions would have it.

    Parameters
    ----------
    mesh : PolyMesh
        In millimetres.

    Raises
    ------
    CannotMakeError
        If no motion maps it onto itself.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> noise = np.random.default_rng(1).normal(scale=0.001, size=(8, 3))
    >>> rough = cube().with_vertices(cube().vertices + noise)
    >>> made = symmetrise(rough)
    >>> made.symmetry.n_rotations, made.symmetry.n_reflections, bool(made.moved.max() < 0.004)
    (24, 24, True)
    >>> find_symmetry(made.mesh, build_halfedges(made.mesh)).order
    48
    """
    halfedges = build_halfedges(mesh)
    groups = [find_symmetry(mesh, halfedges, tolerance=noise) for noise in _NOISE]
    group = max(groups, key=lambda one: one.order)  # the first of the largest
    if group.order == 1:
        raise CannotMakeError(
            "no rotation or reflection maps the mesh onto itself, to within "
            f"{_NOISE[-1]:.0%} of its size and face on face; leave out --symmetrise, or remesh it "
            "(--remesh keeps the mirror symmetry of a model)"
        )
    images = _vertex_images(group, halfedges, mesh.n_vertices)
    size, places = largest_dimension(mesh), mesh.vertices - group.centre
    used = np.unique(halfedges.tail)
    for _ in range(_MOST_ROUNDS):
        matrix = best_motions(places[used], places[images[:, used]], ~group.proper)
        # Where a motion takes a vertex, seen from before the motion: x M as a row is M^T x.
        settled = np.mean(places[images] @ matrix, axis=0)
        settled[used] -= settled[used].mean(axis=0) - places[used].mean(axis=0)
        change = float(np.abs(settled - places).max())
        places = settled
        if change <= _SETTLED * size:
            break
    vertices = places + group.centre
    moved = np.linalg.norm(vertices - mesh.vertices, axis=1)
    return Symmetrised(mesh.with_vertices(vertices), group, moved)


def _vertex_images(group: Symmetry, halfedges: Halfedges, n_vertices: int) -> IntArray:
    """Return where every motion takes each vertex, (G, V); those of no face stay."""
    images = np.tile(np.arange(n_vertices), (group.order, 1))
    count = halfedges.n_halfedges
    _, first = np.unique(halfedges.tail, return_index=True)
    there = group.images(np.arange(count)[first])
    head = halfedges.tail[halfedges.next]
    # A motion that reverses the surface lets the image run the other way.
    taken = np.where(group.reverses[:, None], head[there], halfedges.tail[there])
    images[:, halfedges.tail[first]] = taken
    return images
