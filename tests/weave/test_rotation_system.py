"""Extended rotation systems: one permutation traces every mixture of half-twists."""

import re
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import SOLIDS
from weaving_meshes import meshes

from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.weave.link import TwistedThreads, gauss_text, trace_twisted
from fabweave.weave.pattern import over_of_passes
from fabweave.weave.threads import corner_successor, trace_threads, walk_corners


def inner_edges(halfedges: Halfedges) -> np.ndarray:
    return halfedges.twin[halfedges.edge_halfedge] >= 0


@st.composite
def twisted(draw: st.DrawFn, *, closed: bool = False) -> tuple[Halfedges, np.ndarray]:
    """Give a mesh with some half-twists on its inner edges."""
    halfedges = build_halfedges(draw(meshes(closed=closed)))
    seed = draw(st.integers(0, 2**32 - 1))
    most = draw(st.integers(0, 4))
    twists = np.random.default_rng(seed).integers(-most, most + 1, halfedges.n_edges)
    return halfedges, twists * inner_edges(halfedges)


def strands(halfedges: Halfedges, twists: np.ndarray) -> list[list[tuple[int, bool]]]:
    """Follow every strand half-twist by half-twist, drawn on the edge itself, by plain loops.

    Strand ends are (half-edge, "tail" or "head") on the half-edge's left. Returns closed rings
    only: each as (edge, place along the edge, on top) in walking order, each ring once.
    """
    first = halfedges.edge_halfedge.tolist()
    after, before = halfedges.next.tolist(), halfedges.prev.tolist()
    twin, edge = halfedges.twin.tolist(), halfedges.edge.tolist()

    def run(end: tuple[int, str]) -> tuple[list[tuple[int, int, bool]], tuple[int, str]]:
        half, place = end
        own = half == first[edge[half]]
        up = (place == "tail") == own  # along the edge's own half-edge
        left = own  # on the left of the edge's own direction, in space
        count = int(twists[edge[half]])
        met = []
        for nth in range(abs(count)):
            crossing = nth if up else abs(count) - 1 - nth
            # Looking the way it goes, the strand runs from lower left to upper right if it is on
            # its own left.
            rises = left == up
            met.append((edge[half], crossing, rises == (count > 0)))
            left = not left
        out = first[edge[half]] if left else twin[first[edge[half]]]
        at_far_vertex = up == left
        return met, (out, "head" if at_far_vertex else "tail")

    unused = {(h, place) for h in range(len(after)) for place in ("tail", "head")}
    rings = []
    while unused:
        start = end = min(unused)
        ring = []
        while end in unused:
            unused.discard(end)
            met, far = run(end)
            unused.discard(far)
            ring += met
            half, place = far
            end = (after[half], "tail") if place == "head" else (before[half], "head")
        assert end == start
        rings.append(ring)
    return rings


def canonical(ring: list[tuple[int, bool]]) -> tuple:
    """Return the least way to write a ring, from anywhere and either way round."""
    if not ring:
        return ()
    ways = [ring[i:] + ring[:i] for i in range(len(ring))]
    ways += [way[::-1] for way in ways]
    return min(tuple(way) for way in ways)


def rings_of(threads: TwistedThreads) -> list[list[tuple[int, bool]]]:
    passes = list(zip(threads.crossing.tolist(), threads.over.tolist(), strict=True))
    return [passes[start:end] for start, end in pairwise(threads.offsets.tolist())]


def writhe(threads: TwistedThreads) -> int:
    return int(threads.signs.sum())


def self_crossings(threads: TwistedThreads) -> np.ndarray:
    top, below = threads.thread_of_pass[threads.passes].T
    return np.bincount(top[top == below], minlength=threads.n_threads)


@given(twisted(closed=True))
def test_threads_are_the_strands_followed_by_hand(case):
    halfedges, twists = case
    threads = trace_twisted(halfedges, twists)
    assert threads.closed.all()
    by_hand = [
        [(int(threads.crossing_offsets[edge]) + at, top) for edge, at, top in ring]
        for ring in strands(halfedges, twists)
    ]
    assert sorted(map(canonical, rings_of(threads))) == sorted(map(canonical, by_hand))


@given(twisted(), st.booleans())
def test_the_successor_and_its_reverse_are_inverse(case, turn):
    halfedges, twists = case
    swaps = (twists % 2 == 1)[halfedges.edge]
    successor = corner_successor(halfedges, turn=turn, swaps=swaps)
    goes_on = np.flatnonzero(successor >= 0)
    size = len(successor)
    reverse = (np.arange(size) + halfedges.n_halfedges) % size
    assert len(np.unique(successor[goes_on])) == len(goes_on)
    assert np.array_equal(successor[reverse[successor[goes_on]]], reverse[goes_on])
    # No walk is its own reverse, so every corner is passed once by the threads.
    walks = walk_corners(halfedges, successor)
    assert len(walks.thread) == halfedges.n_halfedges
    if turn or halfedges.twin.min() >= 0:
        assert walks.closed.all()
        assert len(goes_on) == size


@given(meshes(), st.integers(0, 2**32 - 1), st.booleans())
def test_single_twists_give_the_threads_of_the_weave(mesh, seed, turn):
    halfedges = build_halfedges(mesh)
    plain = trace_threads(halfedges, turn=turn)
    inner = inner_edges(halfedges)
    sense = np.random.default_rng(seed).integers(0, 2, plain.n_crossings).astype(bool)
    twists = np.zeros(halfedges.n_edges, dtype=np.int64)
    twists[inner] = np.where(sense, 1, -1)
    threads = trace_twisted(halfedges, twists, turn=turn)
    assert np.array_equal(threads.offsets, plain.offsets)
    assert np.array_equal(threads.crossing, plain.crossing)
    assert np.array_equal(threads.halfedge, plain.halfedge)
    assert np.array_equal(threads.closed, plain.closed)
    assert np.array_equal(threads.over, over_of_passes(plain, sense))


@given(twisted())
def test_every_crossing_has_one_pass_on_top_and_one_below(case):
    threads = trace_twisted(*case)
    assert threads.n_crossings == np.abs(threads.half_twists).sum()
    for top in (True, False):
        own = np.sort(threads.crossing[threads.over == top])
        assert np.array_equal(own, np.arange(threads.n_crossings))
    edge = threads.edge_of_crossing
    assert np.array_equal(np.bincount(edge, minlength=len(threads.half_twists)),
                          np.abs(threads.half_twists))  # fmt: skip


@given(twisted())
def test_a_helix_alternates_along_each_strand(case):
    threads = trace_twisted(*case)
    edge = threads.edge_of_crossing[threads.crossing]
    same = (
        (edge[1:] == edge[:-1])
        & (threads.thread_of_pass[1:] == threads.thread_of_pass[:-1])
        & (np.abs(np.diff(threads.crossing)) == 1)
        & (threads.halfedge[1:] == threads.halfedge[:-1])
    )
    assert (threads.over[1:] != threads.over[:-1])[same].all()
    assert (np.diff(threads.crossing)[same] == np.where(threads.along[1:][same], 1, -1)).all()


@given(meshes(closed=True), st.integers(1, 4), st.booleans())
def test_equal_odd_twists_alternate_on_every_mesh(mesh, half, left):
    halfedges = build_halfedges(mesh)
    count = (2 * half - 1) * (-1 if left else 1)
    threads = trace_twisted(halfedges, np.full(halfedges.n_edges, count))
    for code in rings_of(threads):
        tops = [top for _, top in code]
        assert all(a != b for a, b in zip(tops, tops[1:] + tops[:1], strict=True))


@given(twisted(closed=True))
def test_twists_by_two_change_no_thread_and_mirrors_change_no_walk(case):
    halfedges, twists = case
    threads = trace_twisted(halfedges, twists)
    more = trace_twisted(halfedges, twists + 2)
    assert np.array_equal(threads.closed, more.closed)
    mirrored = trace_twisted(halfedges, -twists)
    assert np.array_equal(mirrored.crossing, threads.crossing)
    assert np.array_equal(mirrored.over, ~threads.over)
    assert np.array_equal(mirrored.signs, -threads.signs)
    assert writhe(mirrored) == -writhe(threads)


@pytest.mark.parametrize("solid", SOLIDS)
def test_each_first_twist_joins_two_faces_and_the_next_parts_or_keeps(solid):
    halfedges = build_halfedges(solid())
    edges = halfedges.n_edges
    for edge in range(edges):
        twists = np.zeros(edges, dtype=np.int64)
        twists[edge] = 1
        threads = trace_twisted(halfedges, twists)
        assert threads.n_threads == halfedges.face.max()
        assert self_crossings(threads).sum() == 1
        twists[edge] = 2  # two faces, linked as in a chain
        linked = trace_twisted(halfedges, twists)
        assert linked.n_threads == halfedges.face.max() + 1
        assert self_crossings(linked).sum() == 0
        assert abs(writhe(linked)) == 2


def test_signs_do_not_depend_on_orientation_within_one_thread():
    # A ring of bands with an odd number of half-twists has one border, with as many crossings.
    lens = PolyMesh.from_faces(np.zeros((5, 3)), [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0]])
    halfedges = build_halfedges(lens)
    for twists in ([1, 1, 1, 0, 0], [1, 2, -1, 3, 0], [5, 0, 0, 0, 0], [-1, -1, -1, -1, -1]):
        threads = trace_twisted(halfedges, twists)
        assert threads.n_threads == 1
        assert writhe(threads) == sum(twists)
        assert self_crossings(threads).tolist() == [sum(map(abs, twists))]


def test_right_handed_is_left_over_right():
    # Two squares side by side, twisted at the edge between them, seen from above.
    mesh = PolyMesh.from_faces(
        [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]],
        [[0, 1, 4, 3], [1, 2, 5, 4]],
    )
    halfedges = build_halfedges(mesh)
    twists = np.where(inner_edges(halfedges), 1, 0)
    threads = trace_twisted(halfedges, twists)
    half = halfedges.edge_halfedge[int(np.flatnonzero(twists)[0])]
    assert (halfedges.tail[half], halfedges.head[half]) == (1, 4)
    # The strand that leaves vertex 1 on the left, walked either way.
    left = (threads.halfedge == half) == threads.along
    assert left.sum() == 1
    assert np.array_equal(threads.over, left)


def test_gauss_codes_of_known_links():
    lens = build_halfedges(PolyMesh.from_faces(np.zeros((3, 3)), [[0, 1, 2], [2, 1, 0]]))
    trefoil = trace_twisted(lens, [1, 1, 1])
    words = re.findall(r"([OU])(\d)([+])", gauss_text(trefoil))
    assert [level for level, *_ in words] in (["O", "U"] * 3, ["U", "O"] * 3)
    # A trefoil's two passes of a crossing are three passes apart.
    crossings = [crossing for _, crossing, _ in words]
    assert sorted(crossings[:3]) == ["1", "2", "3"]
    assert crossings[:3] == crossings[3:]
    assert gauss_text(trace_twisted(lens, [-1, -1, -1])).count("-") == 6
    assert gauss_text(trace_twisted(lens, [0, 0, 0])) == "A:\nB:\n"


@given(twisted())
def test_the_gauss_text_says_level_crossing_and_sign_of_every_pass(case):
    threads = trace_twisted(*case)
    lines = gauss_text(threads).splitlines()
    assert len(lines) == threads.n_threads
    for line, ring in zip(lines, rings_of(threads), strict=True):
        words = [
            f"{'O' if top else 'U'}{crossing + 1}{'+' if threads.signs[crossing] > 0 else '-'}"
            for crossing, top in ring
        ]
        assert line.partition(":")[2].strip() == "".join(words)


@pytest.mark.parametrize(
    "twists", [np.ones(12, dtype=int), np.zeros(11, dtype=int), np.zeros(12), np.full(12, 1 << 40)]
)
def test_wrong_half_twists_are_refused(twists):
    # Twists of boundary edges, too few, no whole numbers, and more crossings than there is memory.
    with pytest.raises(InputError):
        trace_twisted(build_halfedges(grids.hypar(2, 2, 10.0, 1.0)), twists)


def test_a_boundary_edge_turns_as_an_untwisted_edge_does():
    mesh = grids.hypar(4, 3, 10.0, 1.0)
    halfedges = build_halfedges(mesh)
    zeros = np.zeros(halfedges.n_edges, dtype=np.int64)
    assert trace_twisted(halfedges, zeros, turn=True).n_threads == mesh.n_faces
