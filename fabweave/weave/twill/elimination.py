"""Find what a part of a mesh must break, by eliminating one crossing after the other."""

import heapq
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.weave.twill.anneal import Couplings

#: How many conditions are broken, for all twists of a few crossings: one axis for each.
_Table = npt.NDArray[np.int32]

#: Tables of a region usually have at most this many axes: 2**18 numbers.
REGION_WIDTH = 18
#: A condition as near to several regions is split into so many parts; 12 is divided by 2, 3, 4, 6.
PARTS = 12
#: Work is counted in numbers of tables that are computed; to look up a condition or a table takes
#: as long as so many.
_LOOK_UP = 10_000

_PAIR = np.eye(2, dtype=np.int32)
_WINDOW = np.einsum("ab,cd->abcd", 1 - _PAIR, 1 - _PAIR)


@dataclass
class Work:
    """How much may still be computed."""

    left: float

    def spend(self, amount: float) -> None:
        """Take off what something cost."""
        self.left -= amount

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return self.left <= 0


@frozen_value
class Region:
    """Conditions that count for one part of the mesh, as rows, and how many parts of each do."""

    pairs: IntArray
    windows: IntArray
    pair_parts: IntArray
    window_parts: IntArray

    def some(self, pairs: BoolArray, windows: BoolArray) -> "Region":
        """Return a region of some of the conditions."""
        return Region(
            self.pairs[pairs],
            self.windows[windows],
            self.pair_parts[pairs],
            self.window_parts[windows],
        )

    def and_also(self, other: "Region") -> "Region":
        """Return a region of the parts of both."""
        pairs, pair_parts = _together(self.pairs, self.pair_parts, other.pairs, other.pair_parts)
        windows, window_parts = _together(
            self.windows, self.window_parts, other.windows, other.window_parts
        )
        return Region(pairs, windows, pair_parts, window_parts)


def _together(
    rows: IntArray, parts: IntArray, more: IntArray, more_parts: IntArray
) -> tuple[IntArray, IntArray]:
    """Add parts of conditions up: each row once, with all its parts."""
    every, place = np.unique(np.concatenate((rows, more)), return_inverse=True)
    added = np.bincount(place, np.concatenate((parts, more_parts)), minlength=len(every))
    return every, added.astype(np.int64)


def crossings_of(couplings: Couplings, region: Region) -> IntArray:
    """Return the crossings that a region's conditions touch."""
    return np.unique(
        np.concatenate(
            (couplings.pairs[region.pairs].ravel(), couplings.windows[region.windows].ravel())
        )
    )


def shared_tables(
    couplings: Couplings, region: Region
) -> tuple[list[tuple[tuple[int, ...], _Table]], list[set[int]]]:
    """Return a region's costs as tables over its own crossings, and who shares a table."""
    crossings = crossings_of(couplings, region)
    tables: list[tuple[tuple[int, ...], _Table]] = []
    pair_weight = couplings.pair_weight[region.pairs] * region.pair_parts
    window_weight = couplings.window_weight[region.windows] * region.window_parts
    for rows, weights, table in (
        (couplings.pairs[region.pairs], pair_weight, _PAIR),
        (couplings.windows[region.windows], window_weight, _WINDOW),
    ):
        local = np.searchsorted(crossings, rows).tolist()
        for scope, weight in zip(local, weights.tolist(), strict=True):
            # A condition that meets a crossing twice is left out, which keeps the bound a bound.
            if len(set(scope)) == len(scope):
                tables.append((tuple(scope), table * weight))
    sharing: list[set[int]] = [set() for _ in crossings]
    for scope, _ in tables:
        for crossing in scope:
            sharing[crossing].update(scope)
    for crossing, others in enumerate(sharing):
        others.discard(crossing)
    return tables, sharing


def elimination_order(
    sharing: list[set[int]], width: int, most: float = math.inf
) -> list[int] | None:
    """Order the crossings for elimination, the least connected first.

    None if tables have more axes than the width, or come to more numbers than the most.
    """
    around = [set(others) for others in sharing]
    waiting = [(len(others), crossing) for crossing, others in enumerate(around)]
    heapq.heapify(waiting)
    order: list[int] = []
    gone = [False] * len(around)
    while waiting:
        degree, crossing = heapq.heappop(waiting)
        if gone[crossing] or degree != len(around[crossing]):
            continue
        most -= 1 << degree + 1
        if degree > width or most < 0:
            return None
        for other in around[crossing]:
            around[other] |= around[crossing]
            around[other] -= {other, crossing}
            heapq.heappush(waiting, (len(around[other]), other))
        gone[crossing] = True
        order.append(crossing)
    return order


def least_parts(
    couplings: Couplings, region: Region, width: int, work: Work | None = None
) -> int | None:
    """Return how many parts of a region's conditions must break; None if that is too much work."""
    tables, sharing = shared_tables(couplings, region)
    if work is not None:
        work.spend(_LOOK_UP * len(tables))
    # Larger tables than usual are begun only if there is work left for all of them.
    most = work.left if work is not None and width > REGION_WIDTH else math.inf
    order = elimination_order(sharing, width, most)
    if order is None:
        return None
    least = 0
    held: list[dict[int, tuple[tuple[int, ...], _Table]]] = [{} for _ in sharing]
    for number, (scope, table) in enumerate(tables):
        for crossing in scope:
            held[crossing][number] = (scope, table)
    for step, crossing in enumerate(order, start=len(tables)):
        gathered = held[crossing]
        joint = sorted({other for scope, _ in gathered.values() for other in scope} - {crossing})
        axis = {other: place for place, other in enumerate([crossing, *joint])}
        total: _Table = np.zeros((2,) * len(axis), dtype=np.int32)
        if work is not None:
            work.spend((total.size + _LOOK_UP) * len(gathered))
        for number, (scope, table) in gathered.items():
            places = [axis[other] for other in scope]
            shape = [1] * len(axis)
            for place in places:
                shape[place] = 2
            total += table.transpose(np.argsort(places)).reshape(shape)
            for other in scope:
                if other != crossing:
                    del held[other][number]
        rest = total.min(axis=0)
        if not joint:
            least += int(rest)
        for other in joint:
            held[other][step] = (tuple(joint), rest)
    return least
