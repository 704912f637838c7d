"""Rows and rings are cut at the least cost that there is."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.piece.split.shortest_path import (
    cheapest_mirrored,
    cheapest_repeats,
    cheapest_ring,
    cheapest_row,
)


@st.composite
def costs(draw: st.DrawFn) -> np.ndarray:
    """Give costs with gaps, many ties among them."""
    count, width = draw(st.integers(1, 8)), draw(st.integers(1, 8))
    one = st.one_of(st.integers(0, 3).map(float), st.floats(0, 9), st.just(np.inf))
    return np.array(draw(st.lists(one, min_size=count * width, max_size=count * width))).reshape(
        count, width
    )


def total_of(cost: np.ndarray, cuts: list[int], end: int) -> float:
    """Sum the cost of the pieces that begin at the cuts, the last one reaching to the end."""
    total = 0.0
    for a, b in zip(cuts, [*cuts[1:], end], strict=True):
        total += cost[a, b - a - 1] if b - a <= cost.shape[1] else np.inf
    return total


def every_cut(sites: range) -> list[list[int]]:
    return [list(some) for k in range(len(sites) + 1) for some in combinations(sites, k)]


@given(costs())
def test_no_way_to_cut_a_row_is_cheaper(cost):
    count = len(cost)
    total, cuts = cheapest_row(cost)
    if count == 1:
        assert len(cuts) == 0
        return
    ways = [total_of(cost, [0, *some], count - 1) for some in every_cut(range(1, count - 1))]
    assert total == pytest.approx(min(ways))
    if np.isfinite(total):
        assert total_of(cost, cuts.tolist(), count - 1) == pytest.approx(total)
    else:
        assert len(cuts) == 0


@given(costs())
def test_no_way_to_cut_a_ring_is_cheaper(cost):
    count = len(cost)
    total, cuts = cheapest_ring(cost)
    ways = [total_of(cost, some, some[0] + count) for some in every_cut(range(count)) if some]
    assert total == pytest.approx(min(ways))
    if np.isfinite(total):
        assert total_of(cost, cuts.tolist(), int(cuts[0]) + count) == pytest.approx(total)
    else:
        assert len(cuts) == 0


def test_a_long_ring_of_equal_pieces_is_cut_into_the_longest():
    cost = np.ones((1000, 10))
    total, cuts = cheapest_ring(cost)
    assert total == 100.0
    assert set(np.diff(cuts)) == {10}


def mirrored(some: list[int], turn: int, count: int) -> bool:
    return sorted((turn - at) % count for at in some) == sorted(some)


@given(costs(), st.integers(0, 7))
def test_no_way_to_cut_a_ring_that_is_its_own_mirror_image_is_cheaper(cost, turn):
    count = len(cost)
    turn %= count
    total, cuts = cheapest_mirrored(cost, turn, ring=True)
    ways = [
        total_of(cost, some, some[0] + count)
        for some in every_cut(range(count))
        if some and mirrored(some, turn, count)
    ]
    assert total == pytest.approx(min(ways, default=np.inf))
    if np.isfinite(total):
        assert mirrored(cuts.tolist(), turn, count)
        assert total_of(cost, cuts.tolist(), int(cuts[0]) + count) == pytest.approx(total)


@given(costs())
def test_no_way_to_cut_a_row_that_is_its_own_mirror_image_is_cheaper(cost):
    count = len(cost)
    if count == 1:
        return
    total, cuts = cheapest_mirrored(cost, count - 1, ring=False)
    ways = [
        total_of(cost, [0, *some], count - 1)
        for some in every_cut(range(1, count - 1))
        if mirrored(some, count - 1, count)
    ]
    assert total == pytest.approx(min(ways))
    if np.isfinite(total):
        assert cuts[0] == 0
        assert mirrored(cuts[1:].tolist(), count - 1, count)
        assert total_of(cost, cuts.tolist(), count - 1) == pytest.approx(total)


@given(costs(), st.integers(1, 4))
def test_no_way_to_cut_a_ring_into_two_lengths_of_whole_periods_is_cheaper(cost, times):
    period = min(len(cost), 8 // times)
    ring = np.tile(cost[:period], (times, 1))
    count = len(ring)
    total, cuts = cheapest_repeats(ring, period)
    ways = {}
    for some in filter(None, every_cut(range(count))):
        steps = set(np.diff([*some, some[0] + count]).tolist())
        if len(steps) <= 2 and not any(step % period for step in steps):
            ways[tuple(some)] = total_of(ring, some, some[0] + count)
    assert total == pytest.approx(min(ways.values()), abs=1e-3)
    if np.isfinite(total):
        assert ways[tuple(cuts.tolist())] == pytest.approx(total, abs=1e-3)
        # What is dearer in one period alone counts in all.
        dear = ring.copy()
        dear[cuts[0]] += 1.0
        every = np.tile(dear.reshape(times, period, -1).max(axis=0), (times, 1))
        assert cheapest_repeats(dear, period)[0] == cheapest_repeats(every, period)[0]
