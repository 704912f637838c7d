"""Crossings that carry something: the topmost, feet around the middle, or those named."""

import numpy as np
import pytest

from fabweave.core.errors import InputError
from fabweave.flat.joint.fastening import hanging_crossings, parse_hanging


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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("400", "there is no crossing 400 to carry something; they are numbered from 0 to 399"),
        ("left", "'left' does not say which crossings carry something"),
        ("top:0", "'top:0' does not say"),
        ("", "'' does not say"),
    ],
)
def test_what_cannot_be_is_said_in_words(text, words):
    with pytest.raises(InputError, match=words):
        hanging_crossings(parse_hanging(text), ball())


def test_too_many_feet_are_refused():
    with pytest.raises(InputError, match="there are not 5 crossings around the middle"):
        hanging_crossings(parse_hanging("bottom:5"), ball(4))
