"""Choose where the strands of rings come together, and how many: a harmonic field of whole flux."""

from collections.abc import Collection
from functools import cached_property
from itertools import permutations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import dijkstra
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, lengths
from fabweave.mesh.mirror import Mirror
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.chart import Sheet
from fabweave.mesh.remesh.handle_cuts import Pair

#: No ring has fewer strands: three would have no room between them.
LEAST = 4
#: Places of the surface from which distances are measured to find its tips.
_SEEDS = 48
#: A tip stands out by more than so many quads; and at most so many are looked at, with so many
#: other places, far from all.
_STANDS_OUT, _MOST_TIPS, _MOST_OTHERS = 0.2, 14, 4
#: Poles are so many quads apart.
_APART = 1.5
#: Samples of the surface at which the field is compared with what it should be.
_SAMPLES = 2500
#: Rounds of fitting the fluxes, and of moving single strands.
_ROUNDS, _MOVES = 12, 40
#: A sample costs at most the square of this logarithm; what a pole costs, in quads; and a sample in
#: the fan or the opening at its end.
_MOST_OFF, _POLE, _HOLE = 2.0, 3.0, 0.6
#: How much more a pole costs where the surface is blunt, and an opening, for each strand, where it
#: is pointed; that is seen within so many quads.
_BLUNT, _MOUTH_AT_TIP, _AROUND_TIP = 1.5, 0.2, 1.5
#: What each strand costs beyond so many that come together at a point.
_CROWD, _CROWDED = (1.5, 1.0), (5, 8)
#: Rings end so far from a point, in quads: at least, and for each strand, above and below.
NEAREST, FAN, MOUTH = 0.9, 0.17, 0.14


@frozen_value
class Poles:
    """Places at which strands may come together.

    Parameters
    ----------
    sites : tuple of (K,) int arrays
        The vertices of each: one, or those of a rim.
    must : (P,) int array
        -1 where the height has to be least, 1 where it has to be greatest, 2 where it has to be
        either; 0 where there need be no pole.
    kind : (P,) int array
        Poles of one kind are mirror images, and alike.
    backs : tuple of (K,) int arrays
        Where a handle is cut, the vertices on the other side, from which as many strands go on; the
        two are one pole. Empty elsewhere.
    """

    sites: tuple[IntArray, ...]
    must: IntArray
    kind: IntArray
    backs: tuple[IntArray, ...]

    @property
    def ends(self) -> FloatArray:
        """One where strands end, 0 where a handle is cut, (P,)."""
        return np.array([float(not len(back)) for back in self.backs])


def links_of(sheet: Sheet, cuts: Collection[Pair] = ()) -> sparse.csr_array:
    """Return how far neighbouring vertices are, and those across an edge, as a graph, (V, V).

    Vertices on both sides where a handle is cut are neighbours.
    """
    half, points = sheet.halfedges, sheet.mesh.vertices
    first = half.edge_halfedge
    inner = first[half.twin[first] >= 0]
    pairs = np.concatenate(
        [
            np.column_stack([half.tail[first], half.head[first]]),
            np.column_stack([half.tail[half.prev[inner]], half.tail[half.prev[half.twin[inner]]]]),
            *(np.column_stack(pair) for pair in cuts),
        ]
    )
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    length = np.maximum(np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1), 1e-12)
    count = sheet.mesh.n_vertices
    return sparse.csr_array((length, (pairs[:, 0], pairs[:, 1])), shape=(count, count))


def away_from(links: sparse.csr_array, vertices: IntArray) -> FloatArray:
    """Return how far each vertex is along the surface from the nearest of some, (V,)."""
    return np.asarray(dijkstra(links, directed=False, indices=vertices, min_only=True))


def find_poles(
    sheet: Sheet,
    links: sparse.csr_array,
    rims: list[IntArray],
    must: list[int],
    pairs: list[Pair],
    side: float,
    mirror: Mirror | None,
) -> Poles:
    """Find the tips of a surface, and other places far from all.

    A tip is where the mean distance to all of the surface is greatest; it counts if that is
    greater, by more than about a quad, than where one comes to a higher one (persistence).

    Parameters
    ----------
    sheet : Sheet
        One body.
    links : (V, V) sparse array
        Of `links_of`.
    rims : list of (K,) int arrays
        The vertices of its rims, which are poles too.
    must : list of int
        What each rim has to be, as in `Poles`.
    pairs : list of two (K,) int arrays
        The vertices on both sides where a handle is cut.
    side : float
        The side of a quad.
    """
    count = sheet.mesh.n_vertices
    near = np.full(count, np.inf)
    total = np.zeros(count)
    at = int(np.argmax(np.linalg.norm(sheet.mesh.vertices - sheet.mesh.vertices.mean(0), axis=1)))
    for _ in range(_SEEDS):
        away = away_from(links, np.array([at]))
        near, total = np.minimum(near, away), total + away
        at = int(np.argmax(near))
    mean = total / _SEEDS
    taken = np.full(count, np.inf)
    sites = [*rims, *(one for one, _ in pairs)]
    wanted = [*must, *(2 for _ in pairs)]
    kind = [*_kinds_of_rims(sheet, rims, mirror), *range(len(rims), len(sites))]
    for site in sites:
        taken = np.minimum(taken, away_from(links, site))

    def take(tip: int, apart: float) -> None:
        """Add a pole and its mirror image; or one on the mirror."""
        nonlocal taken
        name = max(kind, default=-1) + 1
        both = [tip]
        if mirror is not None:
            points = sheet.mesh.vertices
            ends = np.stack([points[tip], mirror.image(points[tip][None])[0]])
            alone = np.linalg.norm(ends[1] - ends[0]) < apart
            goals = ends.mean(axis=0)[None] if alone else ends
            both = np.asarray(cKDTree(points).query(goals)[1]).tolist()
        for one in both:
            sites.append(np.array([one]))
            wanted.append(0)
            kind.append(name)
            taken = np.minimum(taken, away_from(links, sites[-1]))

    for tip in _tips(sheet, mean, _STANDS_OUT * side):
        if taken[tip] > _APART * side and len(sites) < _MOST_TIPS:
            take(tip, _APART * side)
    for _ in range(_MOST_OTHERS):
        other = int(np.argmin(mean)) if not sites else int(np.argmax(taken))
        if sites and taken[other] < 2.0 * _APART * side:
            break
        take(other, 2.0 * _APART * side)
    backs = [np.zeros(0, dtype=np.int64)] * len(sites)
    backs[len(rims) : len(rims) + len(pairs)] = [other for _, other in pairs]
    return Poles(
        tuple(sites),
        np.array(wanted, dtype=np.int64),
        np.array(kind, dtype=np.int64),
        tuple(backs),
    )


def _kinds_of_rims(sheet: Sheet, rims: list[IntArray], mirror: Mirror | None) -> list[int]:
    """Return a number for each rim, the same for two that are mirror images."""
    if mirror is None or not rims:
        return list(range(len(rims)))
    middles = np.array([sheet.mesh.vertices[rim].mean(axis=0) for rim in rims])
    near: list[int] = np.asarray(cKDTree(middles).query(mirror.image(middles))[1]).tolist()
    return [min(pair) for pair in enumerate(near)]


def _tips(sheet: Sheet, height: FloatArray, least: float) -> list[int]:
    """Return the maxima of a function that stand out by more than a bound, the most so first."""
    half = sheet.halfedges
    order = np.argsort(-height, kind="stable")
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    near: list[list[int]] = [[] for _ in range(len(order))]
    for a, b in zip(half.tail.tolist(), half.head.tolist(), strict=True):
        if rank[b] < rank[a]:
            near[a].append(b)
        else:
            near[b].append(a)
    root = list(range(len(order)))

    def top(here: int) -> int:
        while root[here] != here:
            root[here] = root[root[here]]
            here = root[here]
        return here

    found: list[tuple[float, int]] = []
    for here in order.tolist():
        tops = sorted({top(other) for other in near[here]}, key=lambda one: rank[one])
        if tops:
            root[here] = tops[0]
            for lower in tops[1:]:
                found.append((float(height[lower] - height[here]), lower))
                root[lower] = tops[0]
    found += [(np.inf, here) for here in range(len(order)) if root[here] == here]
    return [
        tip for stands, tip in sorted(found, key=lambda one: (-one[0], one[1])) if stands > least
    ]


@frozen_value
class Field:
    """What heights are possible: sums of potentials by whole fluxes.

    Parameters
    ----------
    poles : Poles
    potentials : (P, V) float array
        Of a source at each pole, against the first.
    slopes : (P, K, 3) float array
        Their gradients at samples of the surface.
    away : (P, K) float array
        How far the samples are from the poles, in quads.
    area : float
        Of the surface, in quads.
    """

    poles: Poles
    potentials: FloatArray
    slopes: FloatArray
    away: FloatArray
    area: float

    @cached_property
    def _flat(self) -> FloatArray:
        """The slopes of each pole in a row, (P, 3 K)."""
        return self.slopes.reshape(len(self.slopes), -1)

    @cached_property
    def blunt(self) -> FloatArray:
        """How blunt the surface is at each pole, (P,): from 0 at a needle to 1 on a plain."""
        share = np.mean(self.away < _AROUND_TIP, axis=1) * self.area / (np.pi * _AROUND_TIP**2)
        return np.clip(2.0 * share - 0.8, 0.0, 1.0)

    def height(self, flux: IntArray) -> FloatArray:
        """Return the height whose lines n strands cross at a pole of flux n, (V,)."""
        return np.asarray(flux @ self.potentials)

    def cost(self, flux: FloatArray) -> float:
        """Return how uneven quads would be, all over, and what poles cost, in quads."""
        speed = lengths((flux @ self._flat).reshape(-1, 3))
        off = np.minimum(np.log(np.maximum(speed, 1e-12)) ** 2, _MOST_OFF**2)
        ends = np.where(flux > 0, FAN, MOUTH) * np.abs(flux)
        ends = np.where(flux != 0, np.maximum(ends, NEAREST), 0.0)
        ends[[len(site) > 1 for site in self.poles.sites]] = 0.0
        covered = np.any(self.away < ends[:, None], axis=0)
        off = np.where(covered, np.minimum(off, _HOLE), off)
        hole = float(np.pi * np.sum(np.maximum(ends - 1.0, 0.0) ** 2)) * _HOLE
        free = (self.poles.must == 0) & (flux != 0)
        strands = np.abs(flux[free])
        up = flux[free] > 0
        crowd = np.maximum(strands - np.where(up, _CROWDED[0], _CROWDED[1]), 0.0) @ np.where(
            up, *_CROWD
        )
        blunt = self.blunt[free]
        pointed = float((strands * ~up) @ (1.0 - blunt)) * _MOUTH_AT_TIP
        poles = float(np.sum(1.0 + _BLUNT * blunt)) * _POLE
        return float(off.mean()) * self.area + hole + float(crowd) + pointed + poles

    @cached_property
    def _fits(self) -> dict[tuple[int, ...], tuple[FloatArray, float]]:
        return {}

    def fit(self, signs: tuple[int, ...]) -> tuple[FloatArray, float]:
        """Return the fluxes of :meth:`fitted`, and their cost; infinite where there are none."""
        if signs not in self._fits:
            flux = self.fitted(np.array(signs))
            self._fits[signs] = flux, self.cost(flux) if np.any(flux) else np.inf
        return self._fits[signs]

    def fitted(self, signs: IntArray) -> FloatArray:
        """Return real fluxes of some signs for which quads are most nearly even, (P,)."""
        on = np.flatnonzero(signs)
        up, down = on[signs[on] > 0], on[signs[on] < 0]
        flux = np.zeros(len(signs))
        ends = self.poles.ends
        if not len(on) or (ends[up].any() != ends[down].any()):
            return flux
        many = LEAST * max(len(up), len(down), 2)
        flux[up], flux[down] = many / max(len(up), 1), -many / max(len(down), 1)
        inside = np.any(self.away[on] < 1.5, axis=0)
        slopes = self._flat[on] * np.repeat(~inside, 3)
        matrix = slopes @ slopes.T
        ones = ends[on][:, None]
        system = np.block([[matrix, ones], [ones.T, np.zeros((1, 1))]])
        inverse = np.linalg.pinv(system)
        for _ in range(_ROUNDS):
            way = (flux[on] @ slopes).reshape(-1, 3)
            way /= np.maximum(lengths(way), 1e-9)[:, None]
            right = np.append(slopes @ way.reshape(-1), 0.0)
            flux[on] = (inverse @ right)[:-1]
            flux = self.alike(flux)
            flux = np.where(signs != 0, signs * np.maximum(signs * flux, LEAST), 0.0)
            flux = balanced(flux, ends)
        return flux

    def alike(self, flux: FloatArray) -> FloatArray:
        """Return fluxes that are the same at mirror images, (P,)."""
        kind = self.poles.kind
        return np.asarray((np.bincount(kind, flux) / np.maximum(np.bincount(kind), 1))[kind])

    def rounded(self, flux: FloatArray) -> IntArray:
        """Return whole fluxes near some real ones, improved strand by strand, (P,)."""
        whole = np.sign(flux) * np.maximum(np.rint(np.abs(flux)), LEAST * (flux != 0))
        kind = self.poles.kind
        groups = [kind == name for name in np.unique(kind[flux != 0])]
        ends = self.poles.ends
        size, cut = [int(group.sum()) for group in groups], [not ends[g].any() for g in groups]
        for _ in range(_MOVES):
            if not (left := whole @ ends):
                break
            # What is left over goes where it changes the flux by the least share.
            may = [k for k, n in enumerate(size) if n <= abs(left) and not cut[k]]
            if not may:
                return np.zeros(len(flux), dtype=np.int64)
            most = groups[max(may, key=lambda k: float(np.abs(whole[groups[k]][0])))]
            whole[most] -= np.sign(left)
        best = self.cost(whole)
        for _ in range(_MOVES):
            tried = []
            pairs = [*permutations([k for k, is_cut in enumerate(cut) if not is_cut], 2)]
            alone = [(k, k) for k, is_cut in enumerate(cut) if is_cut]
            for by, (a, b) in [(1, p) for p in [*pairs, *alone]] + [(-1, p) for p in alone]:
                other = whole.copy()
                many = by * int(np.lcm(size[a], size[b]))
                other[groups[a]] += many // size[a]
                if a != b:
                    other[groups[b]] -= many // size[b]
                if np.all(np.abs(other[flux != 0]) >= LEAST) and np.all(other * flux >= 0):
                    tried.append((self.cost(other), by, a, b, other))
            least = min(tried, key=lambda one: one[:4], default=None)
            if least is None or least[0] >= best - 1e-9:
                break
            best, whole = least[0], least[4]
        if whole @ ends or np.any(np.abs(whole[flux != 0]) < LEAST):
            return np.zeros(len(flux), dtype=np.int64)
        return np.asarray(whole, dtype=np.int64)


def balanced(flux: FloatArray, ends: FloatArray) -> FloatArray:
    """Return fluxes that add up to nothing where strands end: the smaller side grows."""
    up, down = ends @ np.maximum(flux, 0.0), ends @ np.maximum(-flux, 0.0)
    most = max(up, down)
    if not most:
        return flux
    return np.where(ends == 0, flux, np.where(flux > 0, flux * most / up, flux * most / down))


def field_of(sheet: Sheet, links: sparse.csr_array, poles: Poles, side: float) -> Field:
    """Solve for the potentials of poles on one body."""
    count, half = sheet.mesh.n_vertices, sheet.halfedges
    node = np.arange(count)
    for site in (site for site in [*poles.sites, *poles.backs] if len(site)):
        node[site] = site[0]
    used, node = np.unique(node, return_inverse=True)
    first, rows = half.edge_halfedge, np.arange(half.n_edges)
    growth = sparse.csr_array(
        (
            np.repeat([1.0, -1.0], half.n_edges),
            (np.tile(rows, 2), np.concatenate([node[half.head[first]], node[half.tail[first]]])),
        ),
        shape=(half.n_edges, len(used)),
    )
    stiff = sparse.csc_array(growth.T @ (sheet.weights[:, None] * growth))
    cut = np.flatnonzero(poles.ends == 0)
    at = node[[*(site[0] for site in poles.sites), *(poles.backs[p][0] for p in cut)]]
    kept = np.delete(np.arange(len(used)), at[0])
    factors = splu(
        sparse.csc_array(stiff[kept][:, kept]),
        permc_spec="MMD_AT_PLUS_A",
        options={"SymmetricMode": True},
    )
    sources = np.zeros((len(used), len(at)))
    sources[at, np.arange(len(at))] = 1.0
    found = np.zeros((len(used), len(at)))
    found[kept] = factors.solve(sources[kept])
    found[:, 0] = 0.0
    # What comes together on one side of a cut leaves the other.
    found[:, cut] -= found[:, len(poles.sites) :]
    potentials = found[node][:, : len(poles.sites)].T
    corners = sheet.corners
    sample = _samples(sheet.mesh)
    a, b, c = (sheet.mesh.vertices[corners[sample, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    double = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    normal /= double
    ways = np.stack([np.cross(normal, c - b), np.cross(normal, a - c), np.cross(normal, b - a)], 1)
    slopes = np.einsum("pkc,kcd->pkd", potentials[:, corners[sample]], ways / double[:, None])
    away = np.stack([away_from(links, site)[corners[sample]].mean(axis=1) for site in poles.sites])
    away[cut] = np.inf
    area = float(np.linalg.norm(np.cross(*_sides(sheet.mesh)), axis=1).sum()) / 2.0
    return Field(poles, potentials, slopes * side, away / side, area / side**2)


def _sides(mesh: PolyMesh) -> tuple[FloatArray, FloatArray]:
    corner = mesh.vertices[mesh.indices.reshape(-1, 3)]
    return corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]


def _samples(mesh: PolyMesh) -> IntArray:
    """Return triangles spread over a surface by area, (K,)."""
    area = np.linalg.norm(np.cross(*_sides(mesh)), axis=1)
    way = np.cumsum(area) / area.sum()
    return np.minimum(np.searchsorted(way, (np.arange(_SAMPLES) + 0.5) / _SAMPLES), len(area) - 1)


def choose_fluxes(field: Field, count: int, without: Collection[int] = ()) -> list[IntArray]:
    """Return the best whole fluxes of the poles, a few, the best first.

    Signs are changed one by one, from several beginnings, while that makes quads more even.
    """
    must = field.poles.must
    seen: dict[tuple[int, ...], float] = {}

    def value(signs: tuple[int, ...]) -> float:
        return seen.setdefault(signs, field.fit(signs)[1])

    kinds = field.poles.kind

    def whole_kinds(signs: IntArray) -> tuple[int, ...]:
        return tuple(
            signs[np.unique(kinds, return_index=True)[1]][
                np.unique(kinds, return_inverse=True)[1]
            ].tolist()
        )

    gone = np.isin(kinds, list(without))

    def starts() -> list[tuple[int, ...]]:
        base = np.where(np.isin(must, [-1, 1]), must, 0)
        either = np.flatnonzero(must == 2)
        free = [*either.tolist(), *np.flatnonzero((must == 0) & ~gone).tolist()]
        cut = np.flatnonzero(field.poles.ends == 0)
        found = [whole_kinds(np.where(field.poles.ends == 0, 1, base))] if len(cut) else []
        for low in [one for one in free if one not in cut][:6]:
            signs = base.copy()
            signs[either] = 1
            signs[free[: len(free) - _MOST_OTHERS] or free] = 1
            signs[field.poles.kind == field.poles.kind[low]] = -1
            found.append(whole_kinds(signs))
        if (must == -1).any():
            signs = base.copy()
            signs[free[:3]] = 1
            found.append(whole_kinds(signs))
        return found

    for start in starts():
        here = start
        while True:
            near = []
            for name in np.unique(kinds).tolist():
                p = kinds.tolist().index(name)
                if gone[p]:
                    continue
                for other in (-1, 0, 1):
                    allowed = must[p] == 0 or (must[p] == 2 and other)
                    if other != here[p] and allowed:
                        near.append(
                            tuple(
                                other if k == name else s
                                for s, k in zip(here, kinds.tolist(), strict=True)
                            )
                        )
            best = min(near, key=lambda one: (value(one), one), default=here)
            if value(best) >= value(here) - 1e-9:
                break
            here = best
    ranked = sorted(
        (one for one in seen if np.isfinite(seen[one])), key=lambda one: (seen[one], one)
    )
    whole = {tuple(field.rounded(field.fit(one)[0]).tolist()) for one in ranked[: 2 * count]}
    whole.discard((0,) * len(must))
    best_of = sorted(whole, key=lambda one: (round(field.cost(np.array(one)), 6), one))
    return [np.array(one) for one in best_of[:count]]
