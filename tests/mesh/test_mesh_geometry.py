"""Size, self-intersections, and the arrays under all of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import (
    closed_surfaces,
    merged,
    moebius_strip,
    open_surfaces,
    shuffled,
)

from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh, face_of_corner, next_corner
from fabweave.mesh.shapes import solids
from fabweave.mesh.upright import largest_dimension, resize_mesh


@given(closed_surfaces(), st.floats(0.01, 1e6))
def test_resized_mesh_has_the_size(surface, size):
    mesh, factor = resize_mesh(surface[0], size_mm=size)
    assert largest_dimension(mesh) == pytest.approx(size, rel=1e-12)
    assert np.array_equal(mesh.vertices, surface[0].vertices * factor)
    assert resize_mesh(surface[0], scale=factor)[1] == factor


FLAT = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("points", "options"),
    [
        (FLAT, {"size_mm": 100.0, "scale": 2.0}),
        (FLAT, {"size_mm": 0.0}),
        (FLAT, {"size_mm": float("nan")}),
        (FLAT, {"scale": float("inf")}),
        ([[1.0, 1, 1]] * 3, {"size_mm": 100.0}),
        ([*FLAT[:2], [np.nan, 0, 0]], {"size_mm": 100.0}),
        ([[-1e308, 0, 0], [1e308, 0, 0], [0, 1, 0]], {"size_mm": 100.0}),
        ([[0.0, 0, 0], [5e-324, 0, 0], [0, 0, 0]], {"size_mm": 100.0}),
        ([[0.0, 0, 0], [1e300, 0, 0], [0, 0, 0]], {"scale": 1e100}),
    ],
)
def test_wrong_sizes(points, options):
    mesh = PolyMesh.from_faces(points, [[0, 1, 2]])
    with pytest.raises(InputError):
        resize_mesh(mesh, **options)


@given(st.one_of(closed_surfaces(), open_surfaces()))
def test_embedded_surfaces_do_not_cross_themselves(surface):
    assert self_intersections(surface[0]).shape == (0, 2)


@given(st.floats(0.2, 1.8), st.sampled_from([1e-200, 1.0, 1e200]))
def test_two_cubes_that_overlap_cross_in_known_faces(shift, scale):
    cube = solids.cube()
    other = cube.with_vertices(cube.vertices + np.array([shift, 0.3, 0.4]))
    both = merged(cube, other)
    pairs = self_intersections(both.with_vertices(both.vertices * scale))
    assert np.all(pairs[:, 0] < 6)
    assert np.all(pairs[:, 1] >= 6)
    assert set(map(tuple, pairs.tolist())) == slow_box_crossings(cube, other)
    far = merged(cube, cube.with_vertices(cube.vertices + np.array([2 + shift, 0.3, 0.4])))
    assert len(self_intersections(far)) == 0


def slow_box_crossings(one, two):
    """Return which sides of two upright boxes cross, from their intervals on each axis."""
    found = set()
    for i, a in enumerate(one.faces()):
        for j, b in enumerate(two.faces()):
            low_a, high_a = one.vertices[a].min(axis=0), one.vertices[a].max(axis=0)
            low_b, high_b = two.vertices[b].min(axis=0), two.vertices[b].max(axis=0)
            if np.all(low_a <= high_b) and np.all(low_b <= high_a):
                found.add((i, j + one.n_faces))
    return found


def test_neighbours_that_fold_through_one_another_are_found():
    crossed = PolyMesh.from_faces(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0.5, 1], [1, 0.6, -1]], [[0, 1, 2], [0, 3, 4]]
    )
    assert self_intersections(crossed).tolist() == [[0, 1]]
    beside = crossed.vertices.copy()
    beside[3:, 0] = -1
    assert len(self_intersections(crossed.with_vertices(beside))) == 0


def test_spoiled_faces_are_passed_over_and_numbers_stay():
    points = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [0.6, 0.4, 1]]
    faces = [[0, 1], [0, 1, 2], [0, 0, 1], [3, 4, 9], [0, 1, 6], [3, 4, 5]]
    mesh = PolyMesh.from_faces([*points, [np.nan] * 3], faces)
    assert self_intersections(mesh).tolist() == [[1, 5]]


@given(st.one_of(closed_surfaces(), open_surfaces()), st.integers(0, 2**32))
def test_halfedges_keep_their_laws(surface, seed):
    mesh = shuffled(surface[0], seed)
    half = build_halfedges(mesh)
    number = np.arange(half.n_halfedges)
    assert np.array_equal(half.prev[half.next], number)
    assert np.array_equal(half.next[half.prev], number)
    assert np.array_equal(half.face[half.next], half.face)
    inner = half.twin >= 0
    assert np.array_equal(half.twin[half.twin[inner]], number[inner])
    assert np.array_equal(half.tail[half.twin[inner]], half.head[inner])
    assert np.array_equal(half.edge[half.twin[inner]], half.edge[inner])
    assert np.array_equal(half.edge[half.edge_halfedge], np.arange(half.n_edges))
    pairs = {frozenset(p) for p in zip(half.tail.tolist(), half.head.tolist(), strict=True)}
    assert half.n_edges == len(pairs)


def test_halfedges_refuse_what_they_cannot_hold():
    fin = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [1, 0, 3], [0, 1, 4]])
    with pytest.raises(InputError, match="1 edges have more than two faces"):
        build_halfedges(fin)
    with pytest.raises(InputError, match="in the same direction"):
        build_halfedges(moebius_strip(5))


def test_polymesh_is_read_only_and_whole():
    mesh = PolyMesh.from_faces(np.zeros((4, 3)), [[0, 1, 2, 3], [], [0, 2, 1]])
    assert mesh.face_sizes.tolist() == [4, 0, 3]
    assert mesh.faces() == [[0, 1, 2, 3], [], [0, 2, 1]]
    assert face_of_corner(mesh).tolist() == [0, 0, 0, 0, 2, 2, 2]
    assert next_corner(mesh).tolist() == [1, 2, 3, 0, 5, 6, 4]
    for array in (mesh.vertices, mesh.offsets, mesh.indices):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1
