"""Smooth ribbons keep their panels, are straight where they leave them, and unfold exactly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from unfolding import plain_ribbons, shape_at, worst_stretch
from weaving_meshes import meshes

from fabweave.mesh.fair.portals import portals_of
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.upright import resize_mesh
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.piece.development import unfold_threads
from fabweave.ribbon.project import smooth_ribbons


@given(meshes(), st.integers(0, 6), st.booleans(), st.sampled_from(["projection", "straight"]))
@settings(max_examples=60)
def test_panels_stay_and_the_rest_unfolds_exactly(mesh, steps, turn, course) -> None:
    mesh = resize_mesh(mesh, size_mm=300.0)[0]
    portals = None if turn else portals_of(course, mesh, build_halfedges(mesh))
    _, ribbons = plain_ribbons(mesh, turn=turn, portals=portals)
    smooth = smooth_ribbons(ribbons, steps)
    for rail, old in ((smooth.right, ribbons.right), (smooth.left, ribbons.left)):
        for shift in (0, 1):
            assert np.array_equal(rail[smooth.entry + shift], old[ribbons.entry + shift])
    # A connector between two panels gets all the steps, and nothing else does.
    gained = (smooth.n_rungs - ribbons.n_rungs) // max(steps, 1)
    following = np.diff(np.sort(ribbons.entry)) == 2
    assert gained * steps == smooth.n_rungs - ribbons.n_rungs
    fewest = np.count_nonzero(following) - np.count_nonzero(np.diff(ribbons.offsets))
    assert gained >= fewest or not steps
    assert np.array_equal(smooth.closed, ribbons.closed)
    assert worst_stretch(smooth, unfold_threads(smooth)) < 1e-9


@pytest.mark.parametrize("name", ["dodecahedron", "torus?m=9&n=6", "sphere?n=4", "cube"])
def test_smooth_outlines_have_gentler_corners(name: str) -> None:
    ribbons = plain_ribbons(shape_at(name))[1]

    def sharpest(steps: int) -> float:
        strips = unfold_threads(smooth_ribbons(ribbons, steps))
        worst = 0.0
        for a, b in zip(strips.offsets[:-1], strips.offsets[1:], strict=True):
            for rail in (strips.right[a:b], strips.left[a:b]):
                step = np.diff(rail, axis=0)
                angle = np.angle(step[:, 0] + 1j * step[:, 1])
                turns = np.abs((np.diff(angle) + np.pi) % (2 * np.pi) - np.pi)
                worst = max(worst, float(turns.max(initial=0.0)))
        return worst

    corners = [sharpest(steps) for steps in (0, 3, 7, 15)]
    assert corners == sorted(corners, reverse=True)
    # A curve without kinks turns half as much at each vertex when there are twice as many.
    assert corners[3] < 0.65 * corners[2] < 0.65 * 0.8 * corners[1]


@pytest.mark.parametrize("name", ["torus?m=12&n=6", "sphere?n=4", "dodecahedron", "slit?genus=2"])
def test_smooth_ribbons_do_not_run_into_one_another(name: str) -> None:
    ribbons = plain_ribbons(shape_at(name, 400.0))[1]
    vertices, triangles, _ = ribbon_triangles(smooth_ribbons(ribbons, 3))
    assert len(self_intersections(PolyMesh.from_faces(vertices, triangles))) == 0
