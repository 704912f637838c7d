"""Pairing against meshes whose quads are known: cut them, forget them, get them back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes_shared import real_mesh
from strategies import closed_surfaces, open_surfaces, shuffled
from weaving_meshes import cut_faces

from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.one_rings import find_irregular
from fabweave.mesh.polymesh import PolyMesh, face_of_corner
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.shapes import grids
from fabweave.mesh.triangulate import triangulate


def split_quads(mesh, seed):
    """Cut every quad by a random one of its diagonals."""
    choices = np.random.default_rng(seed).integers(1, 3, mesh.n_faces)
    return cut_faces(mesh, np.where(mesh.face_sizes == 4, choices, 0).tolist())


def rings(mesh):
    """Return the faces without where they start, as a set."""
    found = set()
    for face in mesh.faces():
        start = face.index(min(face))
        found.add(tuple(face[start:] + face[:start]))
    assert len(found) == mesh.n_faces
    return found


def by_place(mesh):
    """Return the faces by positions, independent of numbering."""
    place = {tuple(p): k for k, p in enumerate(sorted(map(tuple, mesh.vertices.tolist())))}
    number = np.array([place[tuple(p)] for p in mesh.vertices.tolist()])
    return rings(PolyMesh(mesh.vertices, mesh.offsets, number[mesh.indices]))


def paired(mesh, **options):
    return merge_pairs(mesh, pair_triangles(mesh, **options))


@given(
    m=st.integers(4, 40),
    n=st.integers(4, 20),
    seed=st.integers(0, 2**32 - 1),
    tube=st.floats(5, 25),
)
def test_torus_cut_by_random_diagonals_comes_back(m, n, seed, tube):
    torus = grids.torus(m, n, 35.0, tube)
    triangles = shuffled(split_quads(torus, seed), seed)
    assert triangles.n_faces == 2 * m * n
    pairing = pair_triangles(triangles)
    assert pairing.split
    assert pairing.n_pairs == m * n
    assert len(pairing.lonely) == 0
    assert by_place(merge_pairs(triangles, pairing)) == by_place(torus)


@pytest.mark.parametrize(
    "name", ["quad/bob_quad.obj", "quad/catmark_toroidal_tet.obj", "open/tubemesh.off"]
)
def test_real_quad_mesh_comes_back(name):
    mesh = real_mesh(name)
    assert rings(paired(split_quads(mesh, 0))) == rings(mesh)


@pytest.mark.parametrize("name", ["tri/csaszar.obj", "tri/polyhedraexplorer_genus49.stl"])
def test_repair_pairs_all_triangles_of_odd_meshes(name):
    mesh = real_mesh(name)
    assert not pair_triangles(mesh).split
    report = check_mesh(paired(mesh, repair=True))
    assert report.face_sizes == ((4, mesh.n_faces // 2),)
    assert report.findings == ()
    assert report.euler == check_mesh(mesh).euler


@given(st.one_of(closed_surfaces(), open_surfaces()), st.integers(0, 2**32 - 1), st.booleans())
def test_merging_keeps_the_surface(surface, seed, repair):
    mesh = surface[0]
    mesh = cut_faces(mesh, np.random.default_rng(seed).integers(0, 5, mesh.n_faces).tolist())
    pairing = pair_triangles(mesh, repair=repair)
    # Every triangle is in one pair or lonely, and partners are mutual.
    inner = np.flatnonzero(pairing.partner >= 0)
    assert np.array_equal(pairing.partner[pairing.partner[inner]], inner)
    assert np.array_equal(build_halfedges(mesh).twin[inner], pairing.partner[inner])
    used = np.concatenate([face_of_corner(mesh)[inner], pairing.lonely])
    assert sorted(used.tolist()) == np.flatnonzero(mesh.face_sizes == 3).tolist()
    before, after = check_mesh(mesh), check_mesh(merge_pairs(mesh, pairing))
    assert after.n_faces == mesh.n_faces - pairing.n_pairs
    assert after.n_edges == before.n_edges - pairing.n_pairs
    assert (after.euler, after.n_boundary_loops) == (before.euler, before.n_boundary_loops)
    assert after.manifold
    assert after.oriented


def test_lonely_triangles_far_apart_find_each_other():
    # A strip sheared so far that each triangle fits the neighbour of the next quad better: greed
    # leaves one triangle at each end, and only shifting every pair by one brings them together.
    n = 9
    x = np.arange(n + 1)
    bottom, top = np.column_stack([x, 0 * x, 0 * x]), np.column_stack([x + 1, 0 * x + 1, 0 * x])
    faces = []
    for k in range(n):
        faces += [[k, k + 1, n + 1 + k], [k + 1, n + 2 + k, n + 1 + k]]
    strip = PolyMesh.from_faces(np.concatenate([bottom, top]), faces)
    assert len(pair_triangles(strip, repair=False).lonely) == 2
    complete = pair_triangles(strip, repair=True)
    assert len(complete.lonely) == 0
    assert complete.n_pairs == n


@given(st.one_of(closed_surfaces(), open_surfaces()))
def test_triangulating_keeps_the_surface_and_its_vertices(surface):
    mesh = surface[0]
    triangles = triangulate(mesh)
    assert set(triangles.face_sizes.tolist()) == {3}
    assert np.array_equal(triangles.vertices[: mesh.n_vertices], mesh.vertices)
    before, after = check_mesh(mesh), check_mesh(triangles)
    assert (after.euler, after.n_boundary_loops) == (before.euler, before.n_boundary_loops)
    assert after.oriented


@given(st.one_of(closed_surfaces(), open_surfaces()))
def test_irregular_vertices_obey_euler(surface):
    mesh = surface[0]
    irregular = find_irregular(mesh)
    report = check_mesh(mesh)
    halfedges = build_halfedges(mesh)
    assert np.array_equal(mesh.vertices[irregular.vertex], irregular.position)
    inside = irregular.valence[~irregular.boundary]
    assert np.all(inside != 4)
    if report.closed:
        total = int((inside - 4).sum())
        assert total == 2 * halfedges.n_edges - 4 * mesh.n_vertices
        assert len(irregular) == np.count_nonzero(np.bincount(mesh.indices) != 4)


def test_grid_with_corners_is_regular_and_a_star_has_one_irregular_vertex():
    assert len(find_irregular(grids.hypar(4, 3, 10.0, 1.0))) == 0
    # Sixteen quads in two rings around one vertex of valence eight.
    angle = np.arange(16) * np.pi / 8
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    faces = [[0, 1 + 2 * k, 2 + 2 * k, 1 + (2 * k + 2) % 16] for k in range(8)]
    star = PolyMesh.from_faces(np.concatenate([[[0, 0, 0]], ring]), faces)
    found = find_irregular(star)
    assert (found.vertex.tolist(), found.valence.tolist()) == ([0], [8])
