"""Pair triangles back into the quads that they were split from."""

from heapq import heappop, heappush

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh

#: What each re-paired pair on the way costs beside the change of its quad, in radians: of two
#: ways the shorter one is better.
_STEP_COST = 0.1
#: Triangles looked at for one lonely triangle, and for all of them.
_LOOKS = 3000
_LOOKS_IN_ALL = 300_000


def complete_partners(
    face: IntArray, twin: IntArray, partner: IntArray, cost: FloatArray, lonely: IntArray
) -> IntArray:
    """Pair lonely triangles along the cheapest alternating paths.

    A path leads from a lonely triangle over an edge to a paired one, goes on from that one's
    partner, and ends at another lonely triangle; each triangle on it changes its partner. Paths
    are found by best-first search. That is not an exact minimum (a general graph needs blossoms for
    it), but recovers the quads of every real mesh that it was tried on.

    Parameters
    ----------
    face, twin : (H,) int arrays
        Face and opposite of each half-edge; triangles own three half-edges that follow one
        another.
    partner : (H,) int array
        For half-edges inside a pair, the opposite one; else -1.
    cost : (H,) float array
        What pairing across a half-edge costs; infinite where it is impossible.
    lonely : (L,) int array
        Triangles without a partner.

    Returns
    -------
    (H,) int array
        Partners; some triangles may stay lonely.
    """
    result = partner.copy()
    waiting = set(lonely.tolist())
    looks = _LOOKS_IN_ALL
    search = _AlternatingPaths(face, twin, result, cost)
    for triangle in lonely.tolist():
        if triangle not in waiting or looks <= 0:
            continue
        path, used = search.path(triangle, waiting, min(looks, _LOOKS))
        looks -= used
        if not path:
            continue
        for halfedge in path:
            search.part(halfedge)
        for halfedge in path:
            search.join(halfedge)
        waiting.discard(triangle)
        waiting.discard(int(face[twin[path[-1]]]))
    return result


class _AlternatingPaths:
    """The searching of alternating paths over shared arrays."""

    def __init__(self, face: IntArray, twin: IntArray, partner: IntArray, cost: FloatArray) -> None:
        """Keep the arrays; partners change as paths are applied."""
        self.face = face
        self.twin = twin
        self.partner = partner
        self.cost = cost
        self.first = np.full(int(face.max()) + 1, len(face), dtype=np.int64)
        np.minimum.at(self.first, face, np.arange(len(face)))

    def inner(self, triangle: int) -> int:
        """Return the half-edge of a triangle towards its partner, or -1."""
        start = int(self.first[triangle])
        return next((h for h in range(start, start + 3) if self.partner[h] >= 0), -1)

    def part(self, halfedge: int) -> None:
        """Part the two triangles at a half-edge from their partners."""
        for side in (halfedge, int(self.twin[halfedge])):
            old = self.inner(int(self.face[side]))
            if old >= 0:
                self.partner[self.partner[old]] = -1
                self.partner[old] = -1

    def join(self, halfedge: int) -> None:
        """Make the two triangles at a half-edge partners."""
        opposite = int(self.twin[halfedge])
        self.partner[halfedge], self.partner[opposite] = opposite, halfedge

    def path(self, start: int, waiting: set[int], looks: int) -> tuple[list[int], int]:
        """Return the half-edges to pair across, from a lonely triangle to another one."""
        # Each entry: cost so far, a running number that settles ties, the triangle that now
        # wants a partner (or is the lonely one at the end), and the half-edge that led there.
        heap: list[tuple[float, int, int, int]] = [(0.0, 0, start, -1)]
        came: dict[int, int] = {}
        number = used = 0
        while heap and used < looks:
            spent, _, triangle, through = heappop(heap)
            if triangle in came:
                continue
            came[triangle] = through
            used += 1
            chain, inside = self._chain(triangle, came)
            if triangle in waiting and triangle != start:
                return chain[::-1], used
            begin = int(self.first[triangle])
            for halfedge in range(begin, begin + 3):
                price = float(self.cost[halfedge])
                if not np.isfinite(price):
                    continue
                other = int(self.face[self.twin[halfedge]])
                if other in inside:
                    continue
                number += 1
                if other in waiting:
                    heappush(heap, (spent + price, number, other, halfedge))
                    continue
                link = self.inner(other)
                if link < 0:
                    continue
                behind = int(self.face[self.partner[link]])
                if behind not in inside:
                    change = price - float(self.cost[link]) + _STEP_COST
                    heappush(heap, (spent + change, number, behind, halfedge))
        return [], used

    def _chain(self, triangle: int, came: dict[int, int]) -> tuple[list[int], set[int]]:
        """Return the half-edges of the path to a triangle, last first, and its triangles."""
        chain: list[int] = []
        inside = {triangle}
        while came[triangle] >= 0:
            halfedge = came[triangle]
            chain.append(halfedge)
            inside.add(int(self.face[self.twin[halfedge]]))
            triangle = int(self.face[halfedge])
            inside.add(triangle)
        return chain, inside


#: Costs closer than this (radians) are a tie.
_TIE = 1e-6
#: What a pair costs more if its quad has a corner that is straight or points inwards.
_REFLEX_COST = 5.0
_STRAIGHT = np.radians(178.0)
#: Triangles are split quads if for so many of them the partner that greed finds is by so much
#: (radians) better than any other. On quad meshes cut by random diagonals it is so for 83 % to
#: 100 %, on meshes that were triangles from the start for 76 % at most.
_CLEAR = 0.80
_CLEARLY = np.radians(5.0)


@frozen_value
class Pairing:
    """Which triangles of a mesh make quads together.

    Parameters
    ----------
    partner : (H,) int array
        For each half-edge between two triangles that become a quad, its twin; else -1.
    cost : (H,) float array
        What merging across each half-edge costs, in radians; infinite where it is impossible.
    lonely : (L,) int array
        Triangles without a partner.
    clear : float
        Share of the triangles for which the partner that greed found is better than the other
        two by more than 5°.
    split : bool
        Whether the triangles look like split quads: most have such a partner.
    """

    partner: IntArray
    cost: FloatArray
    lonely: IntArray
    clear: float
    split: bool

    @property
    def n_pairs(self) -> int:
        """Number of pairs."""
        return int(np.count_nonzero(self.partner >= 0)) // 2


def pair_triangles(mesh: PolyMesh, *, repair: bool | None = None) -> Pairing:
    """Pair the triangles of a mesh, the best quads first.

    A pair costs the largest departure of its quad's corners from 90°, plus the fold along its
    diagonal. Pairs are taken in the order of cost, each triangle once: the same as going through
    the sorted list, but many at a time, for a pair that both of its triangles like best is in
    the list before all others of either.

    Triangles that stay without a partner are then matched by re-pairing those between them: the
    cheapest alternating path, over a bounded number of steps.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh; faces that are not triangles are left out.
    repair : bool, optional
        Whether to match the lonely triangles; by default only where the mesh looks like split
        quads.

    Returns
    -------
    Pairing
        The pairs; independent of the order of anything but exact ties.

    Examples
    --------
    >>> square = PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> pairing = pair_triangles(square)
    >>> pairing.n_pairs, pairing.split, merge_pairs(square, pairing).faces()
    (1, True, [[2, 3, 0, 1]])
    """
    halfedges = build_halfedges(mesh)
    triangle = mesh.face_sizes == 3
    halfedge = halfedges.edge_halfedge[halfedges.twin[halfedges.edge_halfedge] >= 0]
    twin = halfedges.twin[halfedge]
    between = triangle[halfedges.face[halfedge]] & triangle[halfedges.face[twin]]
    halfedge, twin = halfedge[between], twin[between]
    price = _costs(mesh, halfedges, halfedge)
    possible = np.isfinite(price)
    halfedge, twin, price = halfedge[possible], twin[possible], price[possible]
    cost = np.full(mesh.n_corners, np.inf)
    cost[halfedge] = cost[twin] = price
    chosen = _take_best(halfedges.face[halfedge], halfedges.face[twin], price, mesh.n_faces)
    partner = np.full(mesh.n_corners, -1, dtype=np.int64)
    partner[halfedge[chosen]], partner[twin[chosen]] = twin[chosen], halfedge[chosen]
    clear = _clear_share(mesh.offsets[:-1][triangle], partner, cost)
    split = clear >= _CLEAR
    lonely = _lonely(triangle, halfedges.face, partner)
    if (split if repair is None else repair) and len(lonely):
        partner = complete_partners(halfedges.face, halfedges.twin, partner, cost, lonely)
        lonely = _lonely(triangle, halfedges.face, partner)
    return Pairing(partner, cost, lonely, clear, split)


def merge_pairs(mesh: PolyMesh, pairing: Pairing) -> PolyMesh:
    """Return the mesh in which each pair of triangles is one quad; all else stays.

    A quad takes the place of the first of its two triangles.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh that was paired.
    pairing : Pairing
        Its pairs.

    Returns
    -------
    PolyMesh
        The same vertices.

    Examples
    --------
    >>> cube_side = PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    >>> merge_pairs(cube_side, pair_triangles(cube_side)).n_faces
    1
    """
    halfedges = build_halfedges(mesh)
    halfedge = np.flatnonzero(pairing.partner > np.arange(mesh.n_corners))
    twin = pairing.partner[halfedge]
    quads = _quads(halfedges, halfedge, twin)
    into, gone = halfedges.face[halfedge], halfedges.face[twin]
    sizes = mesh.face_sizes.copy()
    sizes[into], sizes[gone] = 4, 0
    offsets = offsets_of(sizes)
    indices = np.empty(offsets[-1], dtype=np.int64)
    alone = np.ones(mesh.n_faces, dtype=bool)
    alone[into] = alone[gone] = False
    kept = alone[halfedges.face]
    place = np.arange(mesh.n_corners) - mesh.offsets[:-1][halfedges.face]
    indices[(offsets[:-1][halfedges.face] + place)[kept]] = mesh.indices[kept]
    indices[offsets[:-1][into][:, None] + np.arange(4)] = quads
    stays = sizes > 0
    return PolyMesh(mesh.vertices, offsets_of(sizes[stays]), indices)


def _quads(halfedges: Halfedges, one: IntArray, two: IntArray) -> IntArray:
    """Return the corners of the quads around some half-edges, counter-clockwise, (N, 4)."""
    tail, before = halfedges.tail, halfedges.prev
    corners = [tail[one], tail[before[two]], tail[two], tail[before[one]]]
    return np.column_stack(corners)


def _costs(mesh: PolyMesh, halfedges: Halfedges, one: IntArray) -> FloatArray:
    """Return what merging across each half-edge costs, (N,)."""
    quad = _quads(halfedges, one, halfedges.twin[one])
    size = float(np.abs(mesh.vertices).max(initial=0.0))
    points = mesh.vertices / (size or 1.0)
    a, d, b, c = (points[quad[:, k]] for k in range(4))
    left = np.cross(b - a, c - a)
    right = np.cross(d - a, b - a)
    corners = np.column_stack(
        [
            _angle(b - a, c - a) + _angle(d - a, b - a),
            _angle(a - d, b - d),
            _angle(c - b, a - b) + _angle(a - b, d - b),
            _angle(b - c, a - c),
        ]
    )
    cost = np.abs(corners - np.pi / 2).max(axis=1, initial=0.0) + _angle(left, right)
    cost += np.where(corners.max(axis=1, initial=0.0) > _STRAIGHT, _REFLEX_COST, 0.0)
    # Two triangles on the same three vertices enclose nothing.
    cost[quad[:, 1] == quad[:, 3]] = np.inf
    return cost


def _angle(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the angles between vectors, in radians; 0 where a vector has no length."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    angle: FloatArray = np.arctan2(across, np.einsum("ij,ij->i", first, second))
    return angle


def _take_best(first: IntArray, second: IntArray, cost: FloatArray, n_faces: int) -> IntArray:
    """Take pairs in the order of cost, each face once; return which."""
    count = len(cost)
    # Ties in a scrambled order: along a row of equal triangles an orderly one would take one
    # pair a round.
    scrambled = np.arange(count, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    scrambled ^= scrambled >> np.uint64(31)
    scrambled *= np.uint64(0xBF58476D1CE4E5B9)
    rank = np.argsort(np.lexsort((scrambled, np.round(cost / _TIE))))
    live = np.arange(count)
    free = np.ones(n_faces, dtype=bool)
    taken: list[IntArray] = []
    while len(live):
        best = np.full(n_faces, count, dtype=np.int64)
        np.minimum.at(best, first[live], rank[live])
        np.minimum.at(best, second[live], rank[live])
        now = live[(best[first[live]] == rank[live]) & (best[second[live]] == rank[live])]
        taken.append(now)
        free[first[now]] = free[second[now]] = False
        live = live[free[first[live]] & free[second[live]]]
    return np.concatenate(taken) if taken else np.zeros(0, dtype=np.int64)


def _clear_share(first: IntArray, partner: IntArray, cost: FloatArray) -> float:
    """Return the share of triangles, given by their first half-edges, with a clear partner."""
    if not len(first):
        return 0.0
    sides = first[:, None] + np.arange(3)
    paired = partner[sides] >= 0
    price = np.where(paired, cost[sides], np.inf).min(axis=1)
    next_best = np.where(paired, np.inf, cost[sides]).min(axis=1)
    with np.errstate(invalid="ignore"):  # no partner and no choice: inf - inf
        return float(np.mean(next_best - price > _CLEARLY))


def _lonely(triangle: BoolArray, face: IntArray, partner: IntArray) -> IntArray:
    """Return the triangles of which no half-edge has a partner."""
    alone = triangle.copy()
    alone[face[partner >= 0]] = False
    return np.flatnonzero(alone)
