"""The map of losses covers the model, and its distances have known answers."""

import numpy as np
import pytest

from fabweave.mesh.loss import loss_map
from fabweave.mesh.shapes import grids, solids


def areas(points, triangles):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_the_parts_are_small_and_cover_the_model():
    cube = solids.cube()
    loss = loss_map(cube, cube)
    side = np.ptp(cube.vertices, axis=0).max()
    assert loss.size_mm == pytest.approx(side)
    assert areas(loss.points, loss.triangles).sum() == pytest.approx(6 * side**2)
    corners = loss.points[loss.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= side / 50
    assert loss.lost_mm.max() < 1e-6 * side
    # They are turned as the faces of the model are: the volume is that of the cube.
    a, b, c = (corners[:, k] for k in range(3))
    assert np.einsum("nd,nd->n", a, np.cross(b, c)).sum() / 6 == pytest.approx(side**3)


def test_concentric_spheres_are_everywhere_as_far_apart_as_their_radii():
    loss = loss_map(grids.sphere(24, 55.0), grids.sphere(24, 50.0))
    assert loss.lost_mm == pytest.approx(np.full(len(loss.lost_mm), 5.0), rel=0.03)


def test_a_lost_spike_is_lost_where_it_was_and_nowhere_else():
    ball = grids.sphere(16, 50.0)
    points = ball.vertices.copy()
    tip = int(np.argmax(points[:, 0]))
    points[tip] *= 1.8
    loss = loss_map(ball.with_vertices(points), ball)
    centres = loss.points[loss.triangles].mean(axis=1)
    assert np.linalg.norm(centres[np.argmax(loss.lost_mm)] - points[tip]) < 3.0
    assert loss.lost_mm.max() == pytest.approx(40.0, rel=0.05)
    around = np.linalg.norm(centres / 50.0 - [1, 0, 0], axis=1) < 1.0
    assert loss.lost_mm[~around].max() < 1e-6
