"""Mirror symmetry: found in any position, by the surface alone, and not where there is none."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_shared import real_mesh

from fabweave.mesh.check import check_mesh
from fabweave.mesh.likeness import likeness
from fabweave.mesh.mirror import Mirror, find_mirror, half_of, joined_with_image
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.triangulate import triangulate


def turned(mesh, seed):
    """Return a mesh turned and moved at random, and the turn."""
    rng = np.random.default_rng(seed)
    turn, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    turn = turn * np.sign(np.diag(upper))
    if np.linalg.det(turn) < 0:
        turn[:, 0] *= -1
    return mesh.with_vertices(mesh.vertices @ turn.T + rng.normal(size=3)), turn


def ellipsoid(sides=(50.0, 33.0, 21.0)):
    ball = grids.sphere(12, 1.0)
    return ball.with_vertices(ball.vertices * sides)


def skewed():
    """Return a body without a mirror: an ellipsoid with three bumps of its own."""
    body = ellipsoid()
    points = body.vertices.copy()
    for way, height in (((1, 0.4, 0.3), 1.7), ((-0.3, 1, -0.5), 1.9), ((0.2, -0.5, 1), 2.2)):
        along = points @ np.array(way) / np.linalg.norm(way)
        points = (
            points * (1 + (height - 1) * np.exp(-((along / along.max() - 1) ** 2) / 0.02))[:, None]
        )
    return body.with_vertices(points)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_mirror_of_an_ellipsoid_is_across_an_axis_however_it_is_turned(seed):
    body, turn = turned(ellipsoid(), seed)
    mirror = find_mirror(body)
    assert mirror.symmetric
    assert mirror.rms_percent < 0.05
    assert np.abs(turn.T @ mirror.normal).max() == pytest.approx(1.0, abs=1e-4)
    # It stands in the middle.
    assert abs((body.vertices.mean(axis=0) - mirror.point) @ mirror.normal) < 0.05
    image = mirror.image(body.vertices)
    assert np.allclose(mirror.image(image), body.vertices)


def test_a_body_without_a_mirror_is_not_symmetric():
    mirror = find_mirror(skewed())
    assert not mirror.symmetric
    assert mirror.rms_percent > 1.0


@pytest.mark.parametrize("name", ["quad/spot_quadrangulated.obj", "quad/bob_quad.obj"])
def test_models_that_are_symmetric(name):
    mirror = find_mirror(real_mesh(name))
    assert mirror.symmetric
    assert mirror.rms_percent < 0.02
    assert np.abs(mirror.normal).max() > 0.9999


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
@pytest.mark.parametrize("lean", [0.0, 0.5])
def test_a_flat_sheet_has_no_mirror_in_its_own_plane(lean, seed):
    """A trapezium of 3 by 2, and one that leans: its image in the one mirror left is off."""
    corners = np.array([[0, 0, 0], [3, 0, 0], [2 + lean, 2, 0], [1 + lean, 2, 0]], dtype=float)
    sheet = PolyMesh.from_faces(corners, [[0, 1, 2, 3]])
    sheet, turn = (sheet, np.eye(3)) if seed is None else turned(sheet, seed)
    mirror = find_mirror(sheet)
    assert abs((turn.T @ mirror.normal)[2]) < 0.01
    assert mirror.symmetric == (lean == 0.0)


# --- halves --------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", [(1, 0, 0), (0.3, -0.8, 0.52), (0.6, 0.64, 0.48)])
def test_a_half_and_its_image_are_the_whole(way):
    # Any plane through the middle of a ball mirrors it, wherever it cuts the triangles.
    ball = triangulate(grids.sphere(12, 50.0))
    normal = np.array(way) / np.linalg.norm(way)
    mirror = Mirror(np.zeros(3), normal, 0.0, 0.0)
    half = half_of(ball, mirror)
    report = check_mesh(half)
    assert report.findings == ()
    assert (report.euler, report.n_boundary_loops) == (1, 1)
    assert (half.vertices @ normal).min() > -1e-9
    whole = joined_with_image(half, mirror, 0.5)
    report = check_mesh(whole)
    assert report.findings == ()
    assert (report.euler, report.closed) == (2, True)
    assert likeness(ball, whole).greatest_mm < 0.5
    assert np.allclose(
        sorted(map(tuple, mirror.image(whole.vertices).round(6).tolist())),
        sorted(map(tuple, whole.vertices.round(6).tolist())),
        atol=1e-5,
    )
