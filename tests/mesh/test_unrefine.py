"""Undoing refinement: what was refined comes back, and what was not is refused."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_shared import SPOT, real_mesh
from strategies import SOLIDS, shuffled

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import likeness
from fabweave.mesh.remesh.coarse import cages, remesh_coarse, unrefined
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.subdivide import catmull_clark


def as_cycles(mesh):
    """Return the faces as sets of directed edges: the same for any numbering of corners."""
    return {frozenset(zip(face, face[1:] + face[:1], strict=True)) for face in mesh.faces()}


@pytest.mark.parametrize("solid", SOLIDS)
def test_two_steps_are_undone_twice(solid):
    fine = catmull_clark(catmull_clark(solid()))
    found = cages(fine)
    assert len(found) >= 1
    assert as_cycles(found[0]) == as_cycles(catmull_clark(solid()))


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 7), st.integers(2, 7), st.integers(0, 1000))
def test_a_refined_patch_is_undone_however_it_is_numbered(m, n, seed):
    patch = grids.hypar(m, n, 30.0, 20.0)
    parent = unrefined(shuffled(catmull_clark(patch), seed))
    assert parent is not None
    assert check_mesh(parent).n_boundary_loops == 1
    # Its corners are corners of the patch: no vertex was put anywhere else.
    fine = catmull_clark(patch).vertices
    assert set(map(tuple, parent.vertices.tolist())) <= set(map(tuple, fine.tolist()))
    assert parent.n_faces == m * n


def test_files_that_are_refined_have_the_cages_that_are_known():
    expected = {
        "quad/spot_quadrangulated.obj": [732, 180],
        "quad/bob_quad.obj": [1336, 334],
        "quad/bob_controlmesh.obj": [],
    }
    for name, faces in expected.items():
        assert [cage.n_faces for cage in cages(real_mesh(name))] == faces


@pytest.mark.parametrize(
    "mesh",
    [solids.icosahedron(), solids.cube(), solids.dodecahedron(), grids.torus(5, 4, 3.0, 1.0)],
)
def test_what_is_no_refinement_has_no_cage(mesh):
    assert cages(mesh) == []


# --- as --remesh does it -------------------------------------------------------------------------


def test_spot_becomes_its_control_mesh_and_keeps_its_shape():
    mesh = real_mesh(SPOT, 400.0)
    remeshed = remesh_coarse(mesh, 200)
    assert remeshed.method == "unrefining"
    assert remeshed.mesh.n_faces == 180

    assert len(self_intersections(remeshed.mesh)) == 0
    fitted, plain = likeness(mesh, remeshed.mesh), likeness(mesh, cages(mesh)[1])
    assert fitted.in_rms_mm < 0.7 * plain.in_rms_mm
    assert fitted.percent(fitted.in_rms_mm) < 0.8


def test_quads_take_a_cage_of_about_as_many_and_say_so():
    remeshed = remesh_quads(real_mesh(SPOT, 400.0), 700, engines=())
    assert (remeshed.method, remeshed.mesh.n_faces) == ("unrefining", 732)

    # The other cage has other faces than quads, so it is none of quads.
    with pytest.raises(CannotMakeError):
        remesh_quads(real_mesh(SPOT, 400.0), 180, engines=())
