"""Equations between pairs: solved as brute force solves them, or a ring that contradicts itself."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fabweave.mesh.topology import solve_parity

equations = st.lists(st.tuples(st.integers(0, 6), st.integers(0, 6), st.booleans()), max_size=12)


def arrays(rows: list[tuple[int, int, bool]]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    first = np.array([a for a, _, _ in rows], dtype=np.int64)
    second = np.array([b for _, b, _ in rows], dtype=np.int64)
    return first, second, np.array([d for _, _, d in rows], dtype=bool)


@given(equations)
def test_solutions_are_all_solutions(rows):
    solution = solve_parity(7, *arrays(rows))
    by_force = {
        values
        for values in itertools.product((False, True), repeat=7)
        if all((values[a] != values[b]) == differ for a, b, differ in rows)
    }
    if not by_force:
        assert solution.odd_ring
        return
    assert not solution.odd_ring
    free = itertools.product((False, True), repeat=solution.n_classes)
    ours = {tuple((np.array(f)[solution.classes] != solution.opposite).tolist()) for f in free}
    assert ours == by_force


@given(equations)
def test_a_contradiction_comes_with_a_ring_that_shows_it(rows):
    ring = solve_parity(7, *arrays(rows)).odd_ring
    if not ring:
        return
    assert len(set(ring)) == len(ring)
    # Along each link of the ring there is an equation, and some choice of them adds up to odd.
    links = [
        {differ for a, b, differ in rows if {a, b} == {x, y}}
        for x, y in zip(ring, ring[1:] + ring[:1], strict=True)
    ]
    if len(ring) == 2:
        assert links[0] == {False, True}
        return
    assert all(links)
    assert any(sum(choice) % 2 for choice in itertools.product(*links))
