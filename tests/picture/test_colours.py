"""Colours tell bunches apart, to the colour-blind too, and threads of a bunch from one another."""

import numpy as np
import pytest
from colour_vision import least_differences
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.colour_space import bytes_of, light_of, light_of_hue, oklab_of
from fabweave.weave.strand_colours import PALETTES, SAFE_PALETTE, thread_colours


def least_between(colours, bunches):
    """How much threads of different bunches differ at least, to people with any colour vision."""
    return least_differences(colours)[bunches[:, None] != bunches].min()


@pytest.mark.parametrize(
    ("colour", "lab"),
    [
        ((255, 0, 0), (0.6280, 0.2249, 0.1258)),
        ((0, 255, 0), (0.8664, -0.2339, 0.1795)),
        ((0, 0, 255), (0.4520, -0.0325, -0.3115)),
    ],
)
def test_oklab_has_its_known_primaries(colour, lab):
    assert np.allclose(oklab_of(light_of(colour)), lab, atol=2e-4)


@given(st.lists(st.tuples(*[st.integers(0, 255)] * 3), min_size=1, max_size=20))
def test_conversions_turn_back(rows):
    colours = np.array(rows, dtype=np.uint8)
    assert np.array_equal(bytes_of(light_of(colours)), colours)
    lab = oklab_of(light_of(colours))
    hue = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]))
    again = light_of_hue(lab[:, 0], np.hypot(lab[:, 1], lab[:, 2]), hue)
    assert np.abs(bytes_of(again).astype(int) - colours).max() <= 1


@given(st.floats(0.05, 0.98), st.floats(0.0, 0.5), st.floats(-720, 720))
def test_colours_out_of_range_keep_lightness_and_hue(lightness, chroma, hue):
    light = light_of_hue(np.array([lightness]), np.array([chroma]), np.array([hue]))
    assert np.all((light >= 0) & (light <= 1))
    lab = oklab_of(light)[0]
    assert abs(lab[0] - lightness) < 2e-3
    away = np.radians(hue)
    assert abs(-np.sin(away) * lab[1] + np.cos(away) * lab[2]) < 2e-3
    assert np.cos(away) * lab[1] + np.sin(away) * lab[2] > -2e-3


def test_the_colour_blind_confuse_what_they_are_known_to_confuse():
    red_and_green = np.array([[200, 60, 40], [110, 120, 30]])
    one, other = oklab_of(light_of(red_and_green))
    assert 100.0 * np.linalg.norm(one - other) > 20.0
    for alike in (red_and_green, np.array([[0, 130, 150], [0, 140, 110]])):
        assert least_between(alike, np.array([0, 1])) < 2.5


# What the strategy "safe" keeps to for this many bunches of nine threads each.
@pytest.mark.parametrize(("count", "least"), [(2, 21), (3, 15), (4, 15), (6, 14), (10, 9), (18, 7)])
def test_safe_colours_tell_bunches_apart_for_everybody(count, least):
    bunches = np.repeat(np.arange(count), 9)
    colours = thread_colours(bunches, "safe")
    assert least_between(colours, bunches) > least
    # The same measure objects when two bunches get one palette colour.
    merged = colours.copy()
    merged[bunches == 1] = merged[bunches == 0]
    assert least_between(merged, bunches) < 1e-9


@pytest.mark.parametrize(
    ("count", "least"), [(2, 21.8), (4, 18.9), (6, 18.3), (10, 11.4), (24, 6.5)]
)
def test_the_palette_keeps_the_distance_it_promises(count, least):
    away = least_differences(SAFE_PALETTE[:count])[~np.eye(count, dtype=bool)].min()
    assert least < away < least + 0.1
    # Members of a bunch stay within an eighth of the way to another bunch.
    lightness = oklab_of(light_of(thread_colours(np.repeat(np.arange(count), 9))))[:, 0]
    assert 50.0 * np.ptp(lightness.reshape(count, 9), axis=1).max() < away / 8.0 + 0.3


@given(st.integers(1, 14), st.integers(1, 12), st.sampled_from(PALETTES), st.randoms())
def test_members_of_a_bunch_differ_and_order_does_not_matter_to_bunches(
    count, members, strategy, random
):
    bunches = np.repeat(np.arange(count), members).tolist()
    random.shuffle(bunches)
    colours = thread_colours(np.array(bunches), strategy)
    assert colours.shape == (count * members, 3)
    assert colours.dtype == np.uint8
    few = min(members, 3)
    for bunch in range(count):
        own = colours[np.array(bunches) == bunch]
        assert len(np.unique(own, axis=0)) >= few
    # Alike numbered bunches have the same colours in turn, wherever their threads stand.
    sorted_colours = thread_colours(np.sort(bunches), strategy)
    assert np.array_equal(colours[np.argsort(bunches, kind="stable")], sorted_colours)


def hues(colours):
    lab = oklab_of(light_of(colours))
    return np.degrees(np.arctan2(lab[:, 2], lab[:, 1])) % 360


@pytest.mark.parametrize("count", [1, 2, 4, 7])
def test_the_hue_range_is_kept_and_bunches_differ_in_lightness(count):
    bunches = np.repeat(np.arange(count), 6)
    colours = thread_colours(bunches, "hue-range")
    aside = hues(colours) - 250.0
    assert np.abs(aside).max() < 27.0
    assert np.ptp(aside) > 25.0
    lightness = oklab_of(light_of(colours))[:, 0].reshape(count, 6)
    assert np.all(lightness[1:].min(axis=1) - lightness[:-1].max(axis=1) > 0.03)
