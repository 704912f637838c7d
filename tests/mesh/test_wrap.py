"""One closed surface is laid around whatever a mesh encloses, however broken it is."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import merged, volume, with_flips

from fabweave.job.stations import Stations
from fabweave.mesh import bodies
from fabweave.mesh.bodies import bodies_of, wrap_bodies
from fabweave.mesh.check import check_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import AttemptFailedError
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.solids import cube
from fabweave.mesh.topology import keep_faces
from fabweave.mesh.triangulate import triangulate
from fabweave.options.settings import Settings

#: A step of the lattice, as a share of the size.
STEP = 0.01
#: So many steps a wrap may be off what the lattice gives.
OFF = 0.25


def moved(mesh, by, scale=1.0):
    return mesh.with_vertices(mesh.vertices * scale + np.array(by))


def turned(mesh):
    return with_flips(mesh, [True] * mesh.n_faces)


def apart(surface, mesh):
    """Return how far the vertices of a mesh are from a surface at most."""
    flat = triangulate(surface)
    feet = Surface(flat.vertices, flat.indices.reshape(-1, 3)).feet(mesh.vertices)
    return feet.distances.max()


def failing():
    raise AttemptFailedError("it ended")


def assert_clean(mesh, genus):
    """Assert that a mesh is closed, runs through itself nowhere, and has bodies of some genus."""
    report = check_mesh(mesh)
    assert not report.fatal
    assert (report.closed, report.oriented, report.component_genus) == (True, True, genus)
    assert len(self_intersections(mesh)) == 0
    assert volume(mesh) > 0.0


@pytest.mark.slow
def test_a_sound_mesh_keeps_its_place_and_its_genus():
    torus = parse_shape("shape:torus?m=32&n=16")
    wrapped = wrap_bodies(torus)
    assert_clean(wrapped.mesh, (1,))
    size = np.ptp(torus.vertices, axis=0).max()
    assert apart(torus, wrapped.mesh) < (0.1 + OFF) * STEP * size
    assert wrapped.left_out == 0.0


@pytest.mark.slow
def test_a_wrap_has_no_more_triangles_than_it_must_and_says_how_far_off_they_are(monkeypatch):
    torus = parse_shape("shape:torus?m=32&n=16")
    wrapped = wrap_bodies(torus)
    monkeypatch.setattr(bodies, "_COUNTS", ())
    dense = wrap_bodies(torus).mesh
    few, many, off = re.search(
        r"of (\d+) triangles .* stand for (\d+), and are at most ([\d.]+)%", wrapped.notes[0]
    ).groups()
    assert (int(few), int(many)) == (wrapped.mesh.n_faces, dense.n_faces)
    assert wrapped.mesh.n_faces <= 6000
    assert dense.n_faces > 12_000
    size = np.ptp(dense.vertices, axis=0).max()
    farthest = max(apart(dense, wrapped.mesh), apart(wrapped.mesh, dense))
    assert farthest <= size * min(OFF * STEP, (float(off) + 0.005) / 100.0)
    assert volume(wrapped.mesh) == pytest.approx(volume(dense), rel=2e-3)


@pytest.mark.slow
def test_what_cannot_be_thinned_soundly_stays_dense(monkeypatch):
    # A remesher that gives another surface, or none at all.
    torus = parse_shape("shape:torus?m=32&n=16")
    for fails in (lambda *_, **__: cube(), lambda *_, **__: failing()):
        monkeypatch.setattr(bodies, "run_engine", fails)
        dense = wrap_bodies(torus)
        assert dense.mesh.n_faces > 12_000
        assert "at most 0.00% of the size" in dense.notes[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "look", [pytest.param(lambda box: box, marks=pytest.mark.slow), turned], ids=["out", "in"]
)
def test_cubes_that_share_an_eighth_become_what_both_enclose(look):
    one = cube()
    side = np.ptp(one.vertices[:, 0])
    wrapped = wrap_bodies(merged(one, look(moved(one, [side / 2.0] * 3)))).mesh
    assert_clean(wrapped, (0,))
    # Known: two cubes less an eighth. Faces are kept, edges are cut off by a step at most.
    known = (2.0 - 1.0 / 8.0) * side**3
    assert known * (1.0 - 5e-3) < volume(wrapped) <= known * (1.0 + 1e-9)


@pytest.mark.slow
def test_open_loose_and_unturned_faces_enclose_what_they_nearly_do():
    box = moved(cube(), (3.0, -2.0, 1.0))
    whole = volume(wrap_bodies(box).mesh)
    lidless = wrap_bodies(keep_faces(box, np.arange(box.n_faces) > 0)).mesh
    assert_clean(lidless, (0,))
    assert 0.8 * whole < volume(lidless) < 1.1 * whole
    loose = PolyMesh(box.vertices[box.indices], box.offsets, np.arange(box.n_corners))
    seamed = wrap_bodies(loose).mesh
    assert_clean(seamed, (0,))
    assert volume(seamed) == pytest.approx(whole, rel=1e-9)


@pytest.mark.slow
def test_walls_inside_cavities_and_debris_go():
    box = cube()
    side = float(np.ptp(box.vertices[:, 0]))
    middle = box.vertices.mean(axis=0)
    hollow = merged(box, turned(moved(moved(box, -middle, 1.0), middle, 0.5)))
    crumb = moved(box, [2.0 * side] * 3, 0.03)
    for mesh in (hollow, merged(box, crumb)):
        wrapped = wrap_bodies(mesh).mesh
        assert len(bodies_of(wrapped)[1]) == 1
        assert_clean(wrapped, (0,))
        assert volume(wrapped) == pytest.approx(side**3, rel=2e-2)


@pytest.mark.slow
def test_a_wedge_that_is_open_is_closed_at_the_bounds_of_the_mesh():
    wedge = PolyMesh.from_faces(
        [[0, 0, 0], [0, 1, 0], [1, 0, 0.3], [1, 1, 0.3], [1, 0, -0.3], [1, 1, -0.3]],
        [[0, 1, 3, 2], [1, 0, 4, 5]],
    )
    wrapped = wrap_bodies(wedge).mesh
    assert check_mesh(wrapped).closed
    assert np.all(wrapped.vertices.max(axis=0) < wedge.vertices.max(axis=0) + 1.01 * STEP)
    assert np.all(wrapped.vertices.min(axis=0) > wedge.vertices.min(axis=0) - 1.01 * STEP)


@pytest.mark.slow
@given(st.integers(0, 10**6), st.integers(1, 3))
@settings(max_examples=8, deadline=None)
def test_soups_of_boxes_are_wrapped_clean(seed, count):
    dice = np.random.default_rng(seed)
    boxes = []
    for _ in range(count):
        box = cube()
        points = box.vertices * dice.uniform(0.4, 1.0, 3)
        turn = np.linalg.qr(dice.normal(size=(3, 3)))[0]
        boxes.append(PolyMesh(points @ turn + dice.normal(size=3) * 20.0, box.offsets, box.indices))
    wrapped = wrap_bodies(merged(*boxes)).mesh
    report = check_mesh(wrapped)
    assert report.closed
    assert not report.fatal
    assert len(self_intersections(wrapped)) == 0
    most = sum(abs(volume(box)) for box in boxes)
    assert 0.0 < volume(wrapped) <= most * (1.0 + 1e-6)


@pytest.mark.slow
def test_a_bag_around_a_bowl_is_as_far_from_it_as_its_lid():
    """Half a ball of radius 100 is closed by a disc, whose points are far from the bowl."""
    ball = parse_shape("shape:sphere?n=12&radius=100")
    bowl = keep_faces(ball, ball.vertices[ball.indices.reshape(-1, 4)].mean(axis=1)[:, 2] < 0.0)
    asked = Settings.of("bowl.obj", bodies="wrap", remesh="quads:150", walls="both")
    bag = Stations(asked, bowl).loaded
    # The lid is a third of the bag, and its points are a third of the radius from the bowl.
    assert bag.likeness.out_mean_mm > 0.05 * bag.likeness.size_mm
    assert bag.likeness.in_mean_mm < 0.02 * bag.likeness.size_mm
