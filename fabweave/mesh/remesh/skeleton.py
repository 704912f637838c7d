"""The skeleton of a surface, as chains of nodes between tips and branches."""

from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import area_samples, plain_triangles

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
        near: list[list[int]] = [[] for _ in self.places]
        for one, two in self.edges.tolist():
            near[one].append(two)
            near[two].append(one)
        left = {(min(edge), max(edge)) for edge in self.edges.tolist()}
        knots = [at for at, around in enumerate(near) if len(around) not in (0, 2)]
        chains = []
        for start in [*knots, *range(len(near))]:
            for first in sorted(near[start]):
                if (min(start, first), max(start, first)) not in left:
                    continue
                chain = [start, first]
                while len(near[chain[-1]]) == 2 and chain[-1] != start:
                    chain.append(next(at for at in near[chain[-1]] if at != chain[-2]))
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
    kept = np.ones(len(bones.places), dtype=bool)
    kept[gone] = False
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
