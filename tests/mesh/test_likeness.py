"""Likeness: distances with known answers, and lost parts found where they were."""

import numpy as np
import pytest

from fabweave.mesh.likeness import likeness
from fabweave.mesh.shapes import grids


def spiked(at=(20.0, -20.0, 40.0), top=1.8):
    """Return a sphere of radius 50 with one vertex pulled out to ``top`` of its radius."""
    ball = grids.sphere(16, 50.0)
    vertex = int(np.argmin(np.linalg.norm(ball.vertices - np.array(at), axis=1)))
    points = ball.vertices.copy()
    points[vertex] *= top
    return ball, ball.with_vertices(points), points[vertex]


def test_concentric_spheres_are_as_far_apart_as_their_radii():
    ball = grids.sphere(24, 50.0)
    found = likeness(ball, grids.sphere(24, 55.0))
    assert found.size_mm == pytest.approx(100.0, rel=2e-3)
    for length in (found.in_mean_mm, found.in_rms_mm, found.in_greatest_mm,
                   found.out_mean_mm, found.out_rms_mm, found.out_greatest_mm):  # fmt: skip
        assert length == pytest.approx(5.0, rel=0.02)
    assert found.percent(found.in_mean_mm) == pytest.approx(5.0, rel=0.02)


def test_a_lost_spike_is_found_where_it_was_and_how_long():
    ball, model, tip = spiked()
    found = likeness(model, ball)
    # The closest point of the ball to the tip is straight below it.
    assert found.in_greatest_mm == pytest.approx(40.0, rel=0.01)
    assert found.out_greatest_mm < 7.0
    (feature,) = found.lost
    assert np.array_equal(feature.place, tip)
    assert feature.direction @ tip / np.linalg.norm(tip) == pytest.approx(1.0, abs=1e-3)
    assert feature.where == "top front right"
    assert 15.0 < feature.size_mm < 40.0


def test_two_lost_spikes_are_two_features_and_the_greater_comes_first():
    ball, first, _ = spiked((50.0, 0.0, 0.0), 1.6)
    points = first.vertices.copy()
    left = int(np.argmin(points[:, 0]))
    points[left] *= 1.9
    found = likeness(ball.with_vertices(points), ball)
    assert [feature.where for feature in found.lost] == ["left", "right"]
    assert found.lost[0].lost_mm > found.lost[1].lost_mm


# --- samples ------------------------------------------------------------------------------------
