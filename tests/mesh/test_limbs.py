"""Limbs that a remesher left out get rings of their own, and no spike stays."""

from functools import partial

import numpy as np
import pytest

from fabweave.job.stations import Stations
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import likeness
from fabweave.mesh.one_rings import find_irregular
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.fit import fit, model_of
from fabweave.mesh.remesh.limbs import pillowed, stretch, with_limbs
from fabweave.mesh.remesh.remeshed import Remeshed, check_remeshed
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import sphere, torus
from fabweave.options.settings import Settings

#: Quads of a ball, as a remesher makes them that leaves limbs out.
BALL = sphere(8, 50.0)


def with_horn(reach: float, thick: float) -> PolyMesh:
    """Return a ball of 50 mm with a horn along x."""
    ball = sphere(40, 50.0)
    x, aside = ball.vertices[:, 0], np.linalg.norm(ball.vertices[:, 1:], axis=1)
    out = np.clip(1.0 - aside / thick, 0.0, 1.0) * (x > 0)
    points = ball.vertices.copy()
    points[:, 0] += reach * np.minimum(2.0 * out, 1.0)
    return ball.with_vertices(points)


@pytest.fixture(scope="module")
def grown():
    model = with_horn(110.0, 30.0)
    refit = partial(fit, model_of(model, 200), rounds=4)
    drawn = refit(refit(sphere(5, 50.0)))
    return model, drawn, *with_limbs(model, drawn, refit, 200)


def test_a_limb_is_there_in_rings_and_no_edge_is_long(grown):
    model, drawn, result, faults = grown
    assert faults == ()
    assert stretch(drawn) > 7.0
    assert stretch(result) < 3.5
    before, after = likeness(model, drawn), likeness(model, result)
    assert after.in_greatest_mm < 1.05 * before.in_greatest_mm
    assert after.in_rms_mm < before.in_rms_mm
    assert drawn.n_faces < result.n_faces <= 250
    assert check_mesh(result).euler == 2
    assert not len(self_intersections(result))
    assert set(result.face_sizes.tolist()) == {4}
    # A ring around a limb is regular.
    assert len(find_irregular(result)) <= len(find_irregular(drawn)) + 8


def test_a_spike_that_nothing_calls_for_goes_back():
    points = BALL.vertices.copy()
    points[np.argmax(points[:, 0])] *= 4.0
    spiked = BALL.with_vertices(points)
    assert stretch(spiked) > 4.0
    result, faults = with_limbs(BALL, spiked, lambda mesh: mesh, 0)
    assert faults == ()
    assert stretch(result) <= 4.0
    rest = np.linalg.norm(points, axis=1) < 51
    assert np.linalg.norm(result.vertices - BALL.vertices, axis=1)[rest].max() < 20


def test_a_spike_that_must_stay_is_a_fault():
    """Where drawing it back would lose more than may be lost, the mesh is not given as good."""
    model = with_horn(300.0, 12.0)
    points = BALL.vertices.copy()
    points[np.argmax(points[:, 0])] *= 7.0
    spiked = BALL.with_vertices(points)
    assert not check_remeshed(model, spiked)
    result, faults = with_limbs(model, spiked, lambda mesh: mesh, 0)
    assert np.array_equal(result.vertices, spiked.vertices)
    assert "times as long" in faults[0]


def test_a_mesh_of_even_edges_stays_as_it_is():
    for mesh in (BALL, torus(12, 8, 35.0, 15.0)):
        assert with_limbs(mesh, mesh, lambda _: pytest.fail("no need"), 10_000) == (mesh, ())


def test_a_ring_around_a_limb_adds_no_irregular_vertex():
    """Pillowing what is beyond a loop of a tube makes the tube longer by a row."""
    tube = sphere(6, 50.0)
    beyond = tube.vertices[tube.indices.reshape(-1, 4)].mean(axis=1)[:, 2] > 34
    ringed = pillowed(tube, beyond)
    assert ringed is not None
    around = ringed.n_faces - tube.n_faces
    assert around == np.count_nonzero(
        beyond[build_halfedges(tube).face]
        & ~beyond[build_halfedges(tube).face[build_halfedges(tube).twin]]
    )
    assert check_mesh(ringed).euler == 2


@pytest.mark.parametrize(("height", "told"), [(4.0, False), (30.0, True)])
def test_a_limb_that_is_cut_short_is_told_with_what_keeps_it(height, told):
    """A ball with a spike, remeshed to a ball: three per cent of its size are an ear."""
    ball = parse_shape("shape:sphere?n=16&radius=100")
    spiked = ball.vertices.copy()
    spiked[np.argmax(spiked[:, 2])] *= 1.0 + height / 100.0
    asked = Settings.of("ball.obj", remesh="quads:150", fair=0)
    plain = Remeshed(ball, "quadriflow", (), find_irregular(ball))
    loaded = Stations(asked, ball.with_vertices(spiked), remeshed=plain).loaded
    notes = [note for note in loaded.notes if note.rule == "limbs"]
    assert len(notes) == told
    assert all("--remesh quads:300" in note.text for note in notes)
