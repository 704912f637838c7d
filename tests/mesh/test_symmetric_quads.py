"""Quads of a symmetric model are symmetric, all quads, with the topology of the model."""

import numpy as np
import pytest
from meshes_shared import SPOT, real_mesh
from scipy.spatial import cKDTree
from strategies import volume

from fabweave.core.arrays import no_progress
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.likeness import likeness
from fabweave.mesh.mirror import find_mirror
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import ENGINES
from fabweave.mesh.remesh.quads import not_worse, remesh_quads, symmetric_quads, without_doublets
from fabweave.mesh.remesh.remeshed import cut_surface, ready_source
from fabweave.mesh.shapes import grids, solids

quadriflow = pytest.mark.skipif(ENGINES[0].lack != "", reason="QuadriFlow is not installed")


@quadriflow
@pytest.mark.slow
def test_quads_of_spot_are_symmetric_and_as_like_as_others():
    mesh = real_mesh(SPOT, 400.0)
    remeshed = remesh_quads(mesh, 300)
    result = remeshed.mesh
    assert any("mirror-symmetric, and so are they" in note for note in remeshed.notes)
    assert set(result.face_sizes.tolist()) == {4}
    report = check_mesh(result)
    assert (report.closed, report.genus, report.n_components, report.fatal) == (True, 0, 1, ())
    off, partner = cKDTree(result.vertices).query(find_mirror(mesh).image(result.vertices))
    assert off.max() < 0.2
    assert np.array_equal(np.sort(partner), np.arange(result.n_vertices))
    # Faces go to faces, turned over, and there is a line of edges on the mirror.
    faces = {frozenset(face) for face in result.indices.reshape(-1, 4).tolist()}
    assert {frozenset(partner[list(face)].tolist()) for face in faces} == faces
    assert np.count_nonzero(partner == np.arange(len(partner))) > 10
    assert likeness(mesh, result).percent(likeness(mesh, result).in_rms_mm) < 0.6


def test_a_body_without_a_mirror_has_no_symmetric_quads_and_no_reason():
    ball = grids.sphere(10, 50.0)
    skew = ball.vertices + 0.2 * np.stack(
        [np.sin(ball.vertices[:, 1] / 17), np.cos(ball.vertices[:, 2] / 13), ball.vertices[:, 0]], 1
    ) * ball.vertices[:, [2]]  # fmt: skip
    source, _ = ready_source(ball.with_vertices(skew))
    found = symmetric_quads(ENGINES[0], source, cut_surface(source), 100, progress=no_progress)
    assert found == (None, "")


def test_a_worse_result_is_not_taken():
    ball, smaller = grids.sphere(24, 50.0), grids.sphere(6, 45.0)
    assert not_worse(ball, grids.sphere(8, 50.0), grids.sphere(8, 50.0))
    assert not not_worse(ball, smaller, grids.sphere(6, 50.0))


@pytest.mark.parametrize("times", [1, 2, 3])
def test_doublets_go_and_nothing_else(times):
    """Faces that are cut in two along a path of two edges come back, one in another."""
    cube = solids.cube()
    faces, points = cube.indices.reshape(-1, 4).tolist(), cube.vertices
    for _ in range(times):
        a, p, c, q = faces[0]
        new = len(points)
        points = np.concatenate([points, points[[a, p, c, q]].mean(axis=0)[None]])
        faces = [[new, a, p, c], [new, c, q, a], *faces[1:]]
    doubled = PolyMesh.from_faces(points, faces)
    assert 2 in interior_valences(build_halfedges(doubled))[1]
    back = without_doublets(doubled)
    assert (back.n_vertices, back.n_faces) == (8, 6)
    assert check_mesh(back).closed
    assert volume(back) == pytest.approx(volume(cube))
