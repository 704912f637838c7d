"""Crossings that carry something: the topmost, feet around the middle, or those named."""

import numpy as np
import pytest

from fabweave.piece.joint.fastening import hanging_crossings, parse_hanging

pytestmark = pytest.mark.usefixtures("quick_jobs")


def ball(count=400, seed=1):
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 3))
    return 100 * points / np.linalg.norm(points, axis=1)[:, None]


@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_feet_stand_apart_around_the_middle_and_low(count):
    points = ball()
    feet = points[hanging_crossings(parse_hanging(f"bottom:{count}"), points)]
    assert len(feet) == count
    # Around the middle of what the places span, which is not quite that of the ball.
    middle = (points[:, :2].min(axis=0) + points[:, :2].max(axis=0)) / 2
    x, y = (feet[:, :2] - middle).T
    sectors = np.floor(np.arctan2(y, x) / (2 * np.pi) % 1.0 * count)
    assert sorted(sectors) == list(range(count))
    away = np.hypot(*(points[:, :2] - middle).T)
    assert np.hypot(x, y).min() >= away.max() / 3
    # On a ball those a third of the radius out are this high; of 400 places some are near.
    assert np.abs(feet[:, 2] + 100 * np.sqrt(8 / 9)).max() < 8.0


def test_one_is_the_topmost_or_lowest_and_numbers_are_taken():
    points = ball()
    chosen = np.flatnonzero(hanging_crossings(parse_hanging("7,top,bottom,399"), points))
    assert set(chosen) == {7, 399, points[:, 2].argmax(), points[:, 2].argmin()}
