"""Threads are the straight-ahead walks of the medial graph: theory and known answers."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes_shared import mesh_params
from strategies import shuffled
from weaving_meshes import dual, meshes, walked

from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.threads import Threads


def threads_of(mesh: PolyMesh) -> Threads:
    return walked(mesh)[1]


def naive_walks(mesh: PolyMesh) -> list[frozenset[frozenset[int]]]:
    """Walk zigzags by dictionaries: turn left, then right, and so on, until home or at an edge."""
    face_at: dict[tuple[int, int], tuple[int, int]] = {}
    for face in mesh.faces():
        for a, b, c in zip(face, face[1:] + face[:1], face[2:] + face[:2], strict=True):
            face_at[a, b] = (b, c)
    before = {second: first for first, second in face_at.items()}
    walks, used = [], set()
    for start in list(face_at):
        for direction in (1, -1):
            if (start, direction) in used:
                continue
            state, visited = (start, direction), []
            while state not in used:
                used.add(state)
                (a, b), way = state
                # A state is a directed edge and the side on which the zigzag goes on.
                visited.append(frozenset((a, b)))
                following = face_at.get((a, b)) if way == 1 else None
                if way == 1:
                    state = (following, -1) if following else None
                else:
                    other = before.get((b, a))
                    state = ((other[1], other[0]), 1) if other else None
                if state is None:
                    break
            walks.append(frozenset(visited))
    return walks


@pytest.mark.parametrize(
    ("shape", "count", "length"),
    [
        ("tetrahedron", 3, 4),
        ("cube", 4, 6),
        ("octahedron", 4, 6),
        ("icosahedron", 6, 10),
        ("dodecahedron", 6, 10),
    ],
)
def test_platonic_solids_have_their_petrie_polygons(shape, count, length):
    threads = threads_of(parse_shape(f"shape:{shape}"))
    assert threads.lengths.tolist() == [length] * count
    assert threads.closed.all()


@given(st.integers(3, 14), st.integers(3, 14))
def test_a_quad_torus_has_twice_the_greatest_common_divisor(m, n):
    threads = threads_of(parse_shape(f"shape:torus?m={m}&n={n}"))
    assert threads.n_threads == 2 * math.gcd(m, n)
    assert threads.lengths.tolist() == [2 * m * n // math.gcd(m, n)] * threads.n_threads


@given(meshes())
def test_threads_turn_left_and_right_in_turn(mesh):
    halfedges, threads = walked(mesh)
    for thread in range(threads.n_threads):
        own = slice(threads.offsets[thread], threads.offsets[thread + 1])
        arrivals, forward = threads.halfedge[own], threads.forward[own]
        pairs = list(zip(range(len(arrivals)), range(1, len(arrivals)), strict=False))
        if threads.closed[thread]:
            pairs.append((len(arrivals) - 1, 0))
        for a, b in pairs:
            assert forward[a] != forward[b]
            # Both crossings lie on edges of the face between them, next to one another.
            left = halfedges.twin[arrivals[a]]
            neighbour = halfedges.prev[left] if forward[a] else halfedges.next[left]
            assert arrivals[b] == neighbour


@given(meshes())
def test_threads_are_the_naive_zigzags(mesh):
    halfedges, threads = walked(mesh)
    if not threads.closed.all():
        return
    ends = np.column_stack((halfedges.tail, halfedges.head))[threads.halfedge].tolist()
    ours = {
        frozenset(map(frozenset, ends[start:end]))
        for start, end in pairwise(threads.offsets.tolist())
    }
    # The naive walker finds every walk in both directions.
    assert ours == set(naive_walks(mesh))


@given(meshes(closed=True))
def test_the_dual_has_as_many_threads_as_long(mesh):
    ours = np.sort(threads_of(mesh).lengths)
    assert np.array_equal(ours, np.sort(threads_of(dual(mesh)).lengths))


@given(meshes(), st.integers(0, 2**32 - 1))
def test_threads_do_not_depend_on_how_the_mesh_is_numbered(mesh, seed):
    one, other = (
        sorted(zip(threads.lengths.tolist(), threads.closed.tolist(), strict=True))
        for threads in (threads_of(mesh), threads_of(shuffled(mesh, seed)))
    )
    assert one == other


@pytest.mark.parametrize("row", mesh_params(bad=False))
def test_real_meshes_have_the_counted_strands(row):
    mesh, _, _ = prepare_mesh(read_mesh(row.path).mesh)
    assert threads_of(mesh).n_threads == row.strands


def test_one_quad_has_four_threads_without_a_crossing():
    threads = threads_of(grids.hypar(1, 1, 1.0, 0.0))
    assert threads.lengths.tolist() == [0, 0, 0, 0]
    assert not threads.closed.any()
