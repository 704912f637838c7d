"""Threads that turn back at the boundary: mirror drawings, and the same crossings as ever."""

import math
from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import meshes, walked

from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.weave.threads import Threads, corner_successor, trace_threads


def billiard(m: int, n: int) -> list[list[tuple[int, int]]]:
    """Follow light at 45 degrees in a box of 2 m by 2 n, through the middles of edges.

    Edges of the unit squares have their middles where one coordinate is odd and the other even.
    Returns for each path its places inside the box, once a visit.
    """
    paths, seen = [], set()
    for x, y in [(x, y) for x in range(2 * m + 1) for y in range(2 * n + 1) if (x + y) % 2]:
        for dx, dy in ((1, 1), (1, -1)):
            state = (x, y, -dx if x == 2 * m else dx, 1 if y == 0 else -1 if y == 2 * n else dy)
            path = []
            while state not in seen:
                x1, y1, dx1, dy1 = state
                seen.add(state)
                if 0 < x1 < 2 * m and 0 < y1 < 2 * n:
                    path.append((x1, y1))
                    seen.add((x1, y1, -dx1, -dy1))  # the same path the other way
                x1, y1 = x1 + dx1, y1 + dy1
                dx1 = -dx1 if x1 in (0, 2 * m) else dx1
                dy1 = -dy1 if y1 in (0, 2 * n) else dy1
                state = (x1, y1, dx1, dy1)
            if path:
                paths.append(path)
    return paths


def middles(columns: int, halfedges: Halfedges, threads: Threads) -> list[list[tuple[int, ...]]]:
    """Return for each thread the middles of its crossings' edges, doubled, in order."""
    first = threads.crossing_halfedge
    i0, j0 = np.divmod(halfedges.tail[first], columns)
    i1, j1 = np.divmod(halfedges.head[first], columns)
    places = np.column_stack((i0 + i1, j0 + j1))[threads.crossing]
    return [sorted(map(tuple, places[a:b].tolist())) for a, b in pairwise(threads.offsets.tolist())]


@given(st.integers(1, 9), st.integers(1, 9))
def test_a_mat_is_a_mirror_drawing_of_the_greatest_common_divisor(m, n):
    halfedges, threads = walked(grids.hypar(m, n, 1.0, 0.0), turn=True)
    assert threads.n_threads == math.gcd(m, n)
    drawn = [sorted(path) for path in billiard(m, n)]
    if m * n > 1:
        assert sorted(middles(n + 1, halfedges, threads)) == sorted(drawn)


@given(st.integers(3, 9), st.integers(1, 9))
def test_a_tube_is_half_a_torus_twice_as_long(m, n):
    _, threads = walked(grids.tube(m, n, 1.0, 1.0), turn=True)
    assert threads.n_threads == math.gcd(m, 2 * n)
    assert set(threads.lengths.tolist()) == {threads.offsets[-1] // threads.n_threads}


@given(meshes(), st.booleans())
def test_the_successor_and_its_reverse_are_inverse(mesh, turn):
    halfedges = build_halfedges(mesh)
    successor = corner_successor(halfedges, turn=turn)
    goes_on = np.flatnonzero(successor >= 0)
    size = len(successor)
    reverse = (np.arange(size) + halfedges.n_halfedges) % size
    assert len(np.unique(successor[goes_on])) == len(goes_on)
    assert np.array_equal(successor[reverse[successor[goes_on]]], reverse[goes_on])
    if turn or halfedges.twin.min() >= 0:
        assert len(goes_on) == size


@given(meshes())
def test_every_thread_is_closed_and_crosses_every_inner_edge_twice(mesh):
    halfedges, threads = walked(mesh, turn=True)
    assert threads.closed.all()
    assert threads.n_crossings == np.count_nonzero(halfedges.twin >= 0) // 2
    for forward in (True, False):
        passed = np.sort(threads.crossing[threads.forward == forward])
        assert np.array_equal(passed, np.arange(threads.n_crossings))


@given(meshes())
def test_turns_lead_from_each_pass_to_the_next(mesh):
    halfedges, threads = walked(mesh, turn=True)
    turns: dict[int, list[tuple[int, bool]]] = {}
    rows = zip(threads.turn_pass, threads.turn_halfedge, threads.turn_forward, strict=True)
    for place, edge, way in rows:
        turns.setdefault(int(place), []).append((int(edge), bool(way)))
    for a, b in pairwise(threads.offsets.tolist()):
        for place in range(a, b):
            after = place + 1 if place + 1 < b else a
            beyond = halfedges.twin[threads.halfedge[place]]
            step = halfedges.prev if threads.forward[place] else halfedges.next
            expected, edge = [], step[beyond]
            while halfedges.twin[edge] < 0:
                expected.append((int(edge), not threads.forward[place]))
                edge = step[edge]
            assert turns.get(place, []) == expected
            assert threads.halfedge[after] == edge
    assert sorted(threads.turn_halfedge.tolist()) == np.flatnonzero(halfedges.twin < 0).tolist()


@given(meshes(closed=True))
def test_on_a_closed_mesh_turning_changes_nothing(mesh):
    halfedges = build_halfedges(mesh)
    ends, turns = trace_threads(halfedges), trace_threads(halfedges, turn=True)
    for name in ("offsets", "crossing", "halfedge", "forward", "closed", "turn_pass"):
        assert np.array_equal(getattr(ends, name), getattr(turns, name))
    assert len(turns.turn_pass) == 0


def joined_corners(mesh: PolyMesh) -> int:
    """Count threads by joining corners at the middles of edges, whatever the direction."""
    parent = {
        (face, vertex): (face, vertex) for face, ring in enumerate(mesh.faces()) for vertex in ring
    }

    def find(corner: tuple[int, int]) -> tuple[int, int]:
        while parent[corner] != corner:
            parent[corner] = parent[parent[corner]]
            corner = parent[corner]
        return corner

    owner = {
        (a, b): face
        for face, ring in enumerate(mesh.faces())
        for a, b in zip(ring, ring[1:] + ring[:1], strict=True)
    }
    for (a, b), face in owner.items():
        # Opposite around the middle: the other end of the edge, in the face beyond if there is one.
        beyond = owner.get((b, a), face)
        parent[find((face, a))] = find((beyond, b))
        parent[find((face, b))] = find((beyond, a))
    return len({find(corner) for corner in parent})


@given(meshes())
def test_there_are_as_many_threads_as_joined_corners(mesh):
    assert walked(mesh, turn=True)[1].n_threads == joined_corners(mesh)


def test_round_one_quad_runs_one_thread_without_a_crossing():
    _, threads = walked(grids.hypar(1, 1, 1.0, 0.0), turn=True)
    assert (threads.lengths.tolist(), threads.closed.tolist()) == ([0], [True])
    assert len(threads.turn_pass) == 0


@given(meshes())
def test_cut_at_their_turns_rings_are_the_threads_that_end(mesh):
    (_, ends), (_, rings) = walked(mesh), walked(mesh, turn=True)

    def rows(threads: Threads) -> list[list[int]]:
        return [threads.crossing[a:b].tolist() for a, b in pairwise(threads.offsets.tolist())]

    def either_way(row: list[int]) -> list[int]:
        return min(row, row[::-1])

    cut, whole = [], 0
    for row, first in zip(rows(rings), rings.offsets.tolist(), strict=False):
        own = rings.turn_pass - first
        places = np.unique(own[(own >= 0) & (own < len(row))]).tolist()
        whole += not places
        for place, end in pairwise([*places, *[at + len(row) for at in places[:1]]]):
            cut.append(either_way([row[k % len(row)] for k in range(place + 1, end + 1)]))
    open_rows = [either_way(row) for row, ring in zip(rows(ends), ends.closed, strict=True)
                 if row and not ring]  # fmt: skip
    assert sorted(cut) == sorted(open_rows)
    assert whole == np.count_nonzero(ends.closed)
