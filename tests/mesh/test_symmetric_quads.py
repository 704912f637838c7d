"""Quads of a symmetric model are symmetric, all quads, with the topology of the model."""

import numpy as np
import pytest
from meshes_shared import SPOT, real_mesh
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from strategies import volume

from fabweave.core.arrays import no_progress, unit
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.likeness import likeness
from fabweave.mesh.mirror import Mirror, find_mirror
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import ENGINES
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.quads import (
    made_symmetric,
    not_worse,
    remesh_quads,
    symmetric_quads,
    without_doublets,
    without_tabs,
)
from fabweave.mesh.remesh.remeshed import check_remeshed, cut_surface, ready_source
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.subdivide import catmull_clark, split_to_quads
from fabweave.mesh.triangulate import triangulate

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
    source, _ = ready_source(skewed(grids.sphere(10, 50.0)))
    found = symmetric_quads(ENGINES[0], source, cut_surface(source), 100, progress=no_progress)
    assert found == (None, "")


def turned_egg(degrees: float) -> PolyMesh:
    """Return quads of an egg of three axes whose corners lie anywhere, half of them irregular."""
    quads = split_to_quads(triangulate(catmull_clark(solids.icosahedron())))
    turn = Rotation.from_euler("xyz", [degrees, 2 * degrees, 0.5 * degrees], degrees=True)
    return quads.with_vertices(50.0 * unit(quads.vertices) @ turn.as_matrix() * EGG)


EGG = np.array([1.0, 1.4, 1.9])


def symmetric_by(mesh: PolyMesh, mirror: Mirror) -> bool:
    """Tell whether faces are the images of faces, turned over."""
    off, partner = cKDTree(mesh.vertices).query(mirror.image(mesh.vertices))
    faces = {frozenset(face) for face in mesh.faces()}
    return off.max() < 1e-6 and {frozenset(partner[list(face)].tolist()) for face in faces} == faces


@pytest.mark.slow
def test_the_better_half_of_quads_and_its_image_are_symmetric():
    egg = grids.sphere(20, 50.0).with_vertices(grids.sphere(20, 50.0).vertices * EGG)
    made = turned_egg(29.0)
    assert not symmetric_by(made, find_mirror(egg))
    result = made_symmetric(egg, made, model_of(egg, made.n_vertices))
    assert result is not None
    assert symmetric_by(result, find_mirror(egg))
    assert check_remeshed(egg, result) == ()
    assert not_worse(egg, result, made)
    # What has no mirror, or is open, stays.
    assert made_symmetric(skewed(egg), made, model_of(egg, made.n_vertices)) is None


def skewed(mesh: PolyMesh) -> PolyMesh:
    """Return a body without a mirror."""
    x, y, z = mesh.vertices.T
    bent = mesh.vertices + 0.2 * np.stack([np.sin(y / 17), np.cos(z / 13), x], 1) * z[:, None]
    return mesh.with_vertices(bent)


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


@pytest.mark.parametrize("length", [1, 2, 5])
def test_a_row_of_quads_has_no_tabs_to_lose(length):
    """Each end of a row hangs on by a single edge, and so would the next one without it."""
    row = grids.hypar(length, 1, 1.0, 0.0)
    assert without_tabs(row) is row
    sheet = grids.hypar(length, 2, 1.0, 0.0)
    assert without_tabs(sheet).n_faces == 2 * length
