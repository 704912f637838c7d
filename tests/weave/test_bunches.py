"""Bunches: no thread crosses another of its own, and how few there can be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import meshes, walked

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.bunches import colour_graph, find_bunches
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


small_graphs = st.builds(
    random_graph, st.integers(1, 9), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1)
)


@given(small_graphs)
def test_neighbours_differ_and_there_cannot_be_fewer_than_said(rows):
    colours, at_least = colour_graph(rows)
    assert proper(rows, colours)
    assert at_least <= chromatic_number(rows) <= max(colours) + 1
    # No number is left out, and the check that found them right objects to two made one.
    assert set(colours) == set(range(max(colours) + 1))
    if max(colours):
        assert not proper(rows, np.minimum(colours, max(colours) - 1))


def test_few_colours_where_the_fewest_are_known():
    # DSATUR is exact on rings, wheels and graphs in two parts.
    ring = [(k, (k + 1) % 9) for k in range(9)]
    wheel = [*ring, *((k, 9) for k in range(9))]
    grid = [(a, 6 + b) for a in range(6) for b in range(6) if a != b]
    for pairs, size, colours in ((ring, 9, 3), (wheel, 10, 4), (grid, 12, 2)):
        assert max(colour_graph(graph(size, pairs))[0]) + 1 == colours


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
