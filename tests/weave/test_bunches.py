"""Bunches: no thread crosses another of its own, and how few there can be."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import meshes, walked

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.bunches import colour_graph, find_bunches, find_clique
from fabweave.weave.threads import Threads, trace_threads


def graph(size: int, pairs) -> list[list[int]]:
    rows: list[list[int]] = [[] for _ in range(size)]
    for a, b in {(min(p), max(p)) for p in pairs}:
        rows[a].append(b)
        rows[b].append(a)
    return [sorted(row) for row in rows]


def random_graph(size: int, share: float, seed: int) -> list[list[int]]:
    chosen = np.triu(np.random.default_rng(seed).random((size, size)) < share, 1)
    return graph(size, np.argwhere(chosen).tolist())


def mycielski(rows: list[list[int]]) -> list[list[int]]:
    """One colour more, and no larger clique."""
    n = len(rows)
    pairs = [(a, b) for a in range(n) for b in rows[a]]
    pairs += [(n + a, b) for a in range(n) for b in rows[a]]
    return graph(2 * n + 1, pairs + [(n + a, 2 * n) for a in range(n)])


def proper(rows, colours) -> bool:
    return all(colours[a] != colours[b] for a, row in enumerate(rows) for b in row)


def chromatic_number(rows) -> int:
    """Try all partitions of a small graph, vertex by vertex."""
    for count in range(1, len(rows) + 1):
        stack = [()]
        while stack:
            colours = stack.pop()
            if len(colours) == len(rows):
                return count
            used = max(colours, default=-1) + 1
            stack += [
                (*colours, colour)
                for colour in range(min(used + 1, count))
                if all(colours[b] != colour for b in rows[len(colours)] if b < len(colours))
            ]
    return 0


def largest_clique(rows) -> int:
    sizes = range(len(rows), 0, -1)
    return next(
        size
        for size in sizes
        for members in itertools.combinations(range(len(rows)), size)
        if all(b in rows[a] for a, b in itertools.combinations(members, 2))
    )


small_graphs = st.builds(
    random_graph, st.integers(1, 9), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1)
)


@given(small_graphs)
def test_small_graphs_get_the_fewest_colours_and_a_proof(rows):
    found = colour_graph(rows)
    fewest = chromatic_number(rows)
    assert proper(rows, found.colours)
    assert set(found.colours) == set(range(fewest))
    assert found.at_least == fewest


@given(small_graphs)
def test_the_largest_clique_is_found(rows):
    clique = find_clique(rows, effort=10**6)
    assert all(b in rows[a] for a, b in itertools.combinations(clique, 2))
    assert len(clique) == largest_clique(rows)


@given(small_graphs, st.integers(0, 40))
def test_with_little_effort_colours_are_right_and_bounds_true(rows, effort):
    found = colour_graph(rows, effort=effort)
    assert proper(rows, found.colours)
    assert found.at_least <= chromatic_number(rows) <= max(found.colours) + 1


def test_graphs_without_triangles_may_need_many_colours():
    pentagon = graph(5, [(k, (k + 1) % 5) for k in range(5)])
    grotzsch = mycielski(pentagon)
    for rows, colours in ((pentagon, 3), (grotzsch, 4), (mycielski(grotzsch), 5)):
        assert len(find_clique(rows, effort=10**6)) == 2
        found = colour_graph(rows)
        assert proper(rows, found.colours)
        assert max(found.colours) + 1 == found.at_least == colours


def test_a_hidden_colouring_is_found():
    # Sixty vertices in six classes, most pairs of different classes joined.
    rng = np.random.default_rng(4)
    classes = rng.permutation(np.repeat(np.arange(6), 10))
    joined = np.triu((classes[:, None] != classes) & (rng.random((60, 60)) < 0.8), 1)
    rows = graph(60, np.argwhere(joined).tolist())
    found = colour_graph(rows)
    assert proper(rows, found.colours)
    assert max(found.colours) + 1 == 6


def test_a_large_dense_graph_ends_with_the_effort_and_the_same_each_time():
    rows = random_graph(300, 0.5, 3)
    one, other = (colour_graph(rows, effort=100_000) for _ in range(2))
    assert one == other
    assert proper(rows, one.colours)
    assert one.at_least <= max(one.colours) + 1 <= 50


def naive_bunches_are_right(threads: Threads, bunch) -> bool:
    """Look at the two passes of each crossing."""
    thread = threads.thread_of_pass
    meet: dict[int, list[int]] = {}
    for crossing, number in zip(threads.crossing.tolist(), thread.tolist(), strict=True):
        meet.setdefault(crossing, []).append(number)
    return all(a == b or bunch[a] != bunch[b] for a, b in meet.values())


@given(meshes())
def test_bunches_of_meshes_are_right_and_bounded(mesh):
    threads = walked(mesh)[1]
    found = find_bunches(threads)
    assert naive_bunches_are_right(threads, found.bunch)
    assert set(found.bunch.tolist()) == set(range(found.n_bunches))
    assert 1 <= found.at_least <= found.n_bunches
    if found.n_bunches > 2:
        passes = np.bincount(found.bunch, weights=threads.lengths)
        assert np.all(np.diff(passes) <= 0)
    thread = threads.thread_of_pass
    for number in range(threads.n_threads):
        own = threads.crossing[thread == number]
        assert found.crosses_itself[number] == (len(set(own.tolist())) < len(own))
    if found.fewest and found.n_bunches > 1:
        # The check that found them right objects to two bunches made one.
        assert not naive_bunches_are_right(threads, np.minimum(found.bunch, found.n_bunches - 2))


@pytest.mark.parametrize(
    ("shape", "bunches"),
    [("tetrahedron", 3), ("octahedron", 4), ("dodecahedron", 6), ("torus?m=5&n=3", 2)],
)
def test_known_numbers_are_proved(shape, bunches):
    # On a Platonic solid every thread crosses every other; on a grid there is warp and weft.
    found = find_bunches(trace_threads(build_halfedges(parse_shape(f"shape:{shape}"))))
    assert (found.n_bunches, found.at_least, found.fewest) == (bunches, bunches, True)
    assert found.warp_and_weft == (bunches == 2)


def test_a_single_thread_that_crosses_itself_is_one_bunch_and_no_warp():
    # A figure of eight, made by hand: its numbers of half-edges do not matter here.
    threads = trace_threads(build_halfedges(parse_shape("shape:tetrahedron")))
    knot = Threads(
        offsets=np.array([0, 2]),
        crossing=np.array([0, 0]),
        halfedge=threads.halfedge[:2],
        forward=np.array([True, False]),
        closed=np.array([True]),
        crossing_halfedge=threads.crossing_halfedge[:1],
    )
    found = find_bunches(knot)
    assert (found.n_bunches, found.at_least, found.fewest) == (1, 1, True)
    assert found.crosses_itself.tolist() == [True]
    assert not found.warp_and_weft
