"""Ribbons keep clear at 400 mm in card, or at the size proposed, or the mesh hits itself."""

import numpy as np
import pytest
from clear_ribbons import laid
from meshes_shared import shared_mesh

from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh

#: Those that keep clear at 400 mm; those at the size that is proposed; and those that run through
#: themselves, where none is promised.
CLEAR = (
    "ngon/dodecahedron_poly.obj",
    "ngon/hexaSphere.off",
    "ngon/platonic_shelf.obj",
    "open/hemisphere.obj",
    "open/hypar.obj",
    "open/tubemesh.off",
    "quad/catmark_toroidal_tet.obj",
    "quad/catmark_torus.obj",
    "tri/csaszar.obj",
)
LARGER = ("tri/polyhedraexplorer_genus49.stl",)
CLASHING = ("quad/bob_controlmesh.obj", "ngon/spot_control_mesh.obj")


def clearance(found) -> list:
    return [one for one in found.check.findings if one.rule == "clearance"]


@pytest.mark.parametrize("name", CLEAR)
def test_clear_at_400_mm(name: str) -> None:
    found = laid(str(shared_mesh(name)), 400.0)
    assert (found.n_near, found.n_through) == (0, 0)
    assert not clearance(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", LARGER)
def test_clear_at_the_size_proposed(name: str) -> None:
    mesh = str(shared_mesh(name))
    assert not len(self_intersections(read_mesh(mesh).mesh))
    before = laid(mesh, 400.0, course="projection")
    (one,) = clearance(before)
    assert one.count == before.n_near > 0
    # The size of the finding, and the size at which all rules hold together.
    for size in sorted({one.size_mm, before.check.smallest_mm}):
        after = laid(mesh, float(size), course="projection")
        assert (after.n_near, after.n_through) == (0, 0)
    assert {found.rule for found in after.check.findings} <= {"twist"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "material", "size_mm"),
    [
        ("tube", "card", 60.0),
        pytest.param("hemisphere", "card", 60.0, marks=pytest.mark.slow),
        pytest.param("hemisphere", "birch-veneer", 260.0, marks=pytest.mark.slow),
        pytest.param("torus?m=8&n=4", "birch-veneer", 200.0, marks=pytest.mark.slow),
    ],
)
def test_the_sizes_proposed_hold_when_they_are_made(shape, material, size_mm) -> None:
    mesh = f"shape:{shape}"
    before = laid(mesh, size_mm, material=material).check
    sizes = {found.rule: found.size_mm for found in before.findings if found.size_mm is not None}
    assert sizes
    for rule, size in sizes.items():
        assert size > size_mm
        after = laid(mesh, float(size), material=material).check
        assert rule not in {found.rule for found in after.findings}
    after = laid(mesh, float(before.smallest_mm), material=material).check
    assert {found.rule for found in after.findings} == set(before.still)


@pytest.mark.slow
@pytest.mark.parametrize("name", CLASHING)
def test_a_mesh_that_runs_through_itself_is_told_as_such(name: str) -> None:
    mesh = str(shared_mesh(name))
    faces = self_intersections(read_mesh(mesh).mesh)
    assert len(faces)
    found = laid(mesh, 400.0)
    (one,) = clearance(found)
    assert "repair the mesh" in one.cause
    # At so many of the places either ribbon crosses an edge of a face that hits another one.
    told = int(one.cause.split("in ")[1].split(" of")[0])
    halfedges = found.woven.halfedges
    threads = found.woven.weave.threads
    here = threads.crossing_halfedge
    sides = np.column_stack((halfedges.face[here], halfedges.face[halfedges.twin[here]]))
    hit = np.isin(sides, faces).any(axis=1)
    near = found.check.measured["clearance"]
    both = hit[threads.crossing[near.passes]] & hit[threads.crossing[near.others]]
    assert 0 < told == np.count_nonzero(both)
