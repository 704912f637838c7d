"""Smooth ribbons keep their panels, are straight where they leave them, and unfold exactly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_shared import shared_mesh
from unfolding import worst_stretch
from weaving_meshes import meshes

from fabweave.flat.unfold.development import unfold_threads
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons, project_ribbons
from fabweave.ribbon.smooth import smooth_ribbons
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads


def laid(mesh: PolyMesh, *, turn: bool = False) -> Ribbons:
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges, turn=turn))
    return project_ribbons(mesh, halfedges, weave, height_mm=0.3)


@given(meshes(), st.integers(1, 6), st.booleans())
@settings(max_examples=40)
def test_panels_stay_and_the_rest_unfolds_exactly(mesh: PolyMesh, steps: int, turn: bool) -> None:
    mesh = resize_mesh(mesh, size_mm=300.0)[0]
    ribbons = laid(mesh, turn=turn)
    smooth = smooth_ribbons(ribbons, steps)
    for rail, old in ((smooth.right, ribbons.right), (smooth.left, ribbons.left)):
        for shift in (0, 1):
            assert np.array_equal(rail[smooth.entry + shift], old[ribbons.entry + shift])
    # A connector between two panels gets all the steps, and nothing else does.
    gained = (smooth.n_rungs - ribbons.n_rungs) // steps
    following = np.diff(np.sort(ribbons.entry)) == 2
    assert gained * steps == smooth.n_rungs - ribbons.n_rungs
    assert gained >= np.count_nonzero(following) - np.count_nonzero(np.diff(ribbons.offsets))
    assert np.array_equal(smooth.closed, ribbons.closed)
    assert worst_stretch(smooth, unfold_threads(smooth)) < 1e-9


@pytest.mark.parametrize("name", ["dodecahedron", "torus?m=9&n=6", "sphere?n=4", "cube"])
def test_smooth_outlines_have_gentler_corners(name: str) -> None:
    ribbons = laid(resize_mesh(parse_shape(f"shape:{name}"), size_mm=300.0)[0])

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
    ribbons = laid(resize_mesh(parse_shape(f"shape:{name}"), size_mm=400.0)[0])
    vertices, triangles, _ = ribbon_triangles(smooth_ribbons(ribbons, 3))
    assert len(self_intersections(PolyMesh.from_faces(vertices, triangles))) == 0


def test_spot_unfolds_exactly_when_it_is_smooth() -> None:
    mesh = prepare_mesh(read_mesh(shared_mesh("quad/spot_quadrangulated.obj")).mesh)[0]
    smooth = smooth_ribbons(laid(resize_mesh(mesh, size_mm=400.0)[0]), 3)
    assert worst_stretch(smooth, unfold_threads(smooth)) < 1e-9


def test_no_steps_change_nothing() -> None:
    ribbons = laid(parse_shape("shape:cube"))
    assert smooth_ribbons(ribbons, 0) is ribbons
