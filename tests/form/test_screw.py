"""Twists and rigid motions are inverse, and twists change as their closed form says."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.form.screw import Frames, adjoint, back_from, exponential, logarithm

ANGLES = [0.0, 1e-9, 1e-3, 0.049, 0.051, 0.3, 0.499, 0.501, 1.5, 2.8]


def twists(angle, count=20, seed=3):
    random = np.random.default_rng(seed)
    twist = random.normal(size=(count, 6))
    twist[:, 3:] *= angle / np.linalg.norm(twist[:, 3:], axis=1)[:, None]
    return twist * ([5.0] * 3 + [1.0] * 3)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_logarithm_is_the_inverse_of_the_exponential(angle):
    twist = twists(angle)
    frames = exponential(twist)
    turned = frames.axes @ np.swapaxes(frames.axes, 1, 2)
    assert np.abs(turned - np.eye(3)).max() < 1e-13
    assert np.linalg.det(frames.axes) == pytest.approx(1.0)
    assert np.abs(logarithm(frames) - twist).max() < 1e-10


@given(st.floats(0.01, 3.0), st.floats(-4.0, 4.0), st.floats(0.1, 50.0))
def test_a_constant_twist_is_a_helix(turn, rise, radius):
    """It winds about z through (0, radius, 0), whatever its turn and its pitch."""
    at = exponential(np.array([[radius * turn, 0.0, rise, 0.0, 0.0, turn]])).origin[0]
    wanted = (radius * np.sin(turn), radius * (1 - np.cos(turn)), rise)
    assert at == pytest.approx(wanted, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_twist_changes_as_its_ends_move(angle):
    twist, step = twists(angle), 1e-6
    frames = exponential(twist)
    for wrong, matrices in enumerate(back_from(twist)):
        for number, unit in enumerate(np.eye(6)):
            way = np.tile(step * unit, (len(twist), 1))
            ahead, behind = (
                frames.moved(move) if wrong else frames.seen_from(exponential(move))
                for move in (way, -way)
            )
            change = (logarithm(ahead) - logarithm(behind)) / (2 * step)
            assert np.abs(change - matrices[:, :, number]).max() < 1e-7


def test_the_adjoint_tells_a_motion_from_elsewhere():
    place, twist = exponential(twists(1.1)), twists(0.7, seed=4)
    seen = exponential(np.einsum("nij,nj->ni", adjoint(place), twist))
    moved, wanted = seen.then(place), place.moved(twist)
    assert np.abs(moved.origin - wanted.origin).max() < 1e-11
    assert np.abs(moved.axes - wanted.axes).max() < 1e-12
    assert isinstance(moved, Frames)
