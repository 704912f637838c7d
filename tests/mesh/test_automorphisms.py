"""The motions that map a mesh onto itself: known groups, found in any position, and no others."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import merged, shuffled
from symmetry_oracle import all_motions
from weaving_meshes import meshes

from fabweave.mesh.automorphisms import Symmetry, find_symmetry
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar, torus, tube
from fabweave.mesh.upright import largest_dimension


def symmetry_of(mesh: PolyMesh, **options) -> Symmetry:
    return find_symmetry(mesh, build_halfedges(mesh), **options)


def turned(mesh: PolyMesh, seed: int) -> PolyMesh:
    rng = np.random.default_rng(seed)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn[:, 0] *= np.sign(np.linalg.det(turn))
    return mesh.with_vertices(100 * mesh.vertices @ turn.T + rng.normal(size=3))


def assert_group(mesh: PolyMesh, found: Symmetry) -> None:
    """Check each element by the mesh alone, and that they are a group."""
    half = build_halfedges(mesh)
    tail, head = mesh.vertices[half.tail], mesh.vertices[half.head]
    size = largest_dimension(mesh)
    assert np.array_equal(found.permutations[0], np.arange(half.n_halfedges))
    assert np.allclose(found.matrix[0], np.eye(3))
    for image, matrix, proper, reverses in zip(
        found.permutations, found.matrix, found.proper, found.reverses, strict=True
    ):
        assert np.array_equal(np.sort(image), np.arange(half.n_halfedges))
        assert np.allclose(matrix @ matrix.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(matrix) == pytest.approx(1.0 if proper else -1.0)
        # Faces go to faces, and edges to edges, where a motion of space takes them.
        assert len(np.unique(np.stack((half.face, half.face[image])), axis=1).T) == mesh.n_faces
        across = half.twin >= 0
        assert np.array_equal(half.twin[image][across], image[half.twin[across]])
        ends = (head, tail) if reverses else (tail, head)
        for here, there in zip((tail, head), ends, strict=True):
            moved = found.centre + (here - found.centre) @ matrix.T
            assert np.abs(moved - there[image]).max() <= 1e-6 * size
    # Products of any two are elements, and none is there twice.
    keys = {
        (*p.tolist(), bool(proper))
        for p, proper in zip(found.permutations, found.proper, strict=True)
    }
    assert len(keys) == found.order
    rng = np.random.default_rng(0)
    for one, other in rng.integers(0, found.order, (50, 2)):
        product = found.permutations[one][found.permutations[other]]
        assert (*product.tolist(), bool(found.proper[one] == found.proper[other])) in keys


@pytest.mark.parametrize(
    ("shape", "rotations"),
    [
        ("tetrahedron", 12),
        ("cube", 24),
        ("dodecahedron", 60),
        ("sphere", 24),
        ("torus?m=9&n=7", 18),
    ],
)
def test_regular_bodies_have_the_groups_that_geometry_gives_them(shape, rotations):
    mesh = parse_shape(f"shape:{shape}")
    found = symmetry_of(mesh)
    assert (found.n_rotations, found.n_reflections) == (rotations, rotations)
    # On a closed surface what is outside stays outside.
    assert np.array_equal(found.reverses, ~found.proper)
    if shape == "cube":
        # Besides, nine planes, a point, and turns with a reflection: six by 90° and eight by 60°.
        for own, angles in (
            (found.proper, {0: 1, 90: 6, 120: 8, 180: 9}),
            (~found.proper, {0: 9, 60: 8, 90: 6, 180: 1}),
        ):
            told, often = np.unique(np.abs(np.round(found.angle_deg[own])), return_counts=True)
            assert dict(zip(told.tolist(), often.tolist(), strict=True)) == angles
    assert_group(mesh, found)
    alone = symmetry_of(mesh, reflections=False)
    assert (alone.n_rotations, alone.n_reflections) == (rotations, 0)


@pytest.mark.parametrize("shape", ["cube", "icosahedron", "torus?m=7&n=4", "hypar?m=4&n=4"])
def test_a_motion_turns_about_its_axis_by_its_angle(shape):
    found = symmetry_of(turned(parse_shape(f"shape:{shape}"), 3))
    for matrix, axis, angle, proper in zip(
        found.matrix, found.axis, np.radians(found.angle_deg), found.proper, strict=True
    ):
        x, y, z = axis
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        along = np.outer(axis, axis)
        turn = np.cos(angle) * (np.eye(3) - along) + np.sin(angle) * cross
        if proper and not axis.any():
            turn = np.eye(3)
        expected = turn + (along if proper else -along)
        assert np.allclose(matrix, expected, atol=1e-9)


def test_bodies_may_change_places():
    pair = [parse_shape("shape:cube") for _ in range(2)]
    apart = merged(pair[0], pair[1].with_vertices(pair[1].vertices + np.array([300.0, 0.0, 0.0])))
    found = symmetry_of(shuffled(apart, 5))
    assert (found.n_rotations, found.n_reflections) == (8, 8)
    assert_group(shuffled(apart, 5), found)
    # A third of another sort stays, and takes away what does not go through its place.
    ball = parse_shape("shape:octahedron")
    three = merged(apart, ball.with_vertices(ball.vertices + np.array([900.0, 0.0, 0.0])))
    found = symmetry_of(three)
    assert (found.n_rotations, found.n_reflections) == (4, 4)
    assert_group(three, found)


@pytest.mark.parametrize(
    "mesh",
    [
        parse_shape("shape:tetrahedron"),
        parse_shape("shape:cube"),
        torus(4, 4, 35.0, 15.0),
        torus(6, 3, 35.0, 15.0),
        tube(5, 2, 10.0, 17.0),
        hypar(2, 3, 10.0, 4.0),
        hypar(2, 2, 10.0, 0.0),
        merged(hypar(2, 2, 10.0, 0.0), tube(4, 1, 3.0, 5.0)),
    ],
    ids=["tetrahedron", "cube", "torus", "torus-3", "tube", "saddle", "sheet", "two"],
)
def test_trying_all_motions_finds_the_same_ones(mesh):
    found = symmetry_of(mesh)
    expected = all_motions(mesh)
    assert len(expected) == found.order
    for matrix in expected:
        assert np.abs(found.matrix - matrix).max(axis=(1, 2)).min() < 1e-9


@given(meshes(), st.integers(0, 2**32 - 1))
def test_turning_and_numbering_change_nothing(mesh, seed):
    found = symmetry_of(mesh)
    other = shuffled(turned(mesh, seed), seed)
    again = symmetry_of(other)
    assert (again.n_rotations, again.n_reflections) == (found.n_rotations, found.n_reflections)
    assert_group(other, again)


@given(st.integers(3, 9), st.integers(3, 9), st.integers(0, 2**32 - 1))
def test_noise_takes_the_symmetry_away(m, n, seed):
    mesh = torus(m, n, 35.0, 15.0)
    rng = np.random.default_rng(seed)
    rough = mesh.with_vertices(mesh.vertices + 0.01 * rng.normal(size=mesh.vertices.shape))
    assert symmetry_of(rough).order == 1
    # Within ten times as much as any vertex may move, it is the torus again.
    near = symmetry_of(rough, tolerance=1e-2)
    assert near.order == symmetry_of(mesh).order
    assert 1e-5 < near.off < 1e-2
