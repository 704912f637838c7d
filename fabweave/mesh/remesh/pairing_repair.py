"""Match triangles that found no partner, by re-pairing those between them."""

from heapq import heappop, heappush

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray

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
    search = _Search(face, twin, result, cost)
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


class _Search:
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
