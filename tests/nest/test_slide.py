"""Slides are exact: they end at the gap, never nearer, and only where pieces may stand."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from fabweave.nest.area import Area
from fabweave.nest.item_shape import Spot, rotated
from fabweave.nest.place.slide import Standing, slid
from fabweave.stock.rotations import Turns

BAR = np.array([[0.0, 0.0], [60.0, 0.0], [60.0, 8.0], [0.0, 8.0]])
GAP = 2.0


def at(outline, x, y):
    return outline + np.array([x, y])


def standing_with(*outlines, area=None, gap=GAP):
    standing = Standing(area or Area((200.0, 120.0)), gap)
    for outline in outlines:
        standing.add(outline)
    return standing


def crescent(seed):
    """Return a bent strip, about 60 by 8 mm."""
    rng = np.random.default_rng(seed)
    radius, width = rng.uniform(30.0, 90.0), rng.uniform(5.0, 10.0)
    angle = np.linspace(0.0, 60.0 / radius, 24)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([radius * arc, (radius + width) * arc[::-1]])


def apart(one, other):
    return shapely.distance(shapely.polygons(one), shapely.polygons(other))


def test_a_slanted_bar_comes_to_lie_along_another_at_the_gap():
    below = at(BAR, 20.0, 20.0)
    spot = slid(Spot(2.0, 21.0, 31.0), BAR, standing_with(below))
    placed = spot.apply(BAR)
    assert abs(spot.angle_deg) < 0.02
    assert apart(placed, below) == pytest.approx(GAP, abs=0.01)
    assert apart(placed, below) >= GAP


def test_a_bar_in_a_corner_ends_at_the_border():
    spot = slid(Spot(0.5, 1.5, 1.2), BAR, standing_with())
    placed = spot.apply(BAR)
    assert (placed.min(axis=0) >= 0.0).all()
    assert (placed.min(axis=0) < 0.01).all()
    assert abs(spot.angle_deg) < 0.01


def test_a_piece_that_stands_too_near_makes_room():
    below = at(BAR, 20.0, 20.0)
    start = Spot(0.0, 20.0, 28.5)
    assert not standing_with(below).has_room(start.apply(BAR))
    spot = slid(start, BAR, standing_with(below))
    assert GAP <= apart(spot.apply(BAR), below) < GAP + 0.01


def test_where_a_slot_is_too_narrow_there_is_no_room():
    around = standing_with(at(BAR, 20.0, 20.0), at(BAR, 20.0, 20.0 + 8.0 + 11.8))
    assert slid(Spot(0.0, 20.0, 20.0 + 8.0 + 1.9), BAR, around) is None
    wider = standing_with(at(BAR, 20.0, 20.0), at(BAR, 20.0, 20.0 + 8.0 + 12.1))
    assert slid(Spot(0.0, 20.0, 20.0 + 8.0 + 1.9), BAR, wider) is not None


def test_a_piece_that_fits_its_sheet_exactly_stays():
    area = Area((60.0, 8.0))
    assert slid(Spot(0.0, 0.0, 0.0), BAR, standing_with(area=area)) == Spot(0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("turns", "most"), [(Turns(90.0), 0.0), (Turns(180.0, 1.0), 1.0), (Turns(180.0, 5.0), 3.0)]
)
def test_a_rule_for_turns_holds(turns, most):
    slanted = at(rotated(BAR, np.array([3.0]))[0], 20.0, 20.0)
    spot = slid(
        Spot(0.0, 19.0, 32.5), BAR, standing_with(slanted, area=Area((200, 120), None, turns))
    )
    assert float(turns.off_deg(np.array([spot.angle_deg]))[0]) < 1e-9
    assert spot.angle_deg == pytest.approx(most, abs=0.05)


def test_what_is_barred_is_kept_the_gap_from():
    knot = shapely.Point(60.0, 60.0).buffer(20.0).difference(shapely.Point(60.0, 60.0).buffer(5.0))
    standing = standing_with(area=Area((200.0, 120.0), knot))
    spot = slid(Spot(0.0, 30.0, 83.5), BAR, standing)
    assert GAP <= shapely.distance(shapely.polygons(spot.apply(BAR)), knot) < GAP + 0.01
    assert not standing.has_room(at(BAR, 30.0, 81.5))


@pytest.mark.parametrize(
    "outline",
    [
        at(rotated(BAR, np.array([90.0]))[0], 50.0, 0.0),  # crosses it, with no corner near
        at(BAR, 20.0, 28.0),  # touches
        at(BAR, 20.0, 29.999),  # is a little too near
        at(0.1 * BAR, 40.0, 23.0),  # is inside
        at(BAR, 141.0, 60.0),  # leaves the sheet
    ],
)
def test_has_room_objects(outline):
    standing = standing_with(at(BAR, 20.0, 20.0))
    assert standing.has_room(at(BAR, 20.0, 30.0))
    assert not standing.has_room(outline)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.3, 2.0, 6.0]))
def test_no_slide_breaks_the_gap_or_goes_far(seed, gap):
    rng = np.random.default_rng(seed)
    area = Area((160.0, 120.0))
    standing = Standing(area, gap)
    placed = []
    for number in range(12):
        outline = crescent(seed + number)
        outline -= outline.min(axis=0)
        start = Spot(float(rng.uniform(0, 360)), *rng.uniform(0, 150, 2).tolist())
        meets = any(apart(start.apply(outline), other) == 0.0 for other in placed)
        if meets:
            continue
        spot = slid(start, outline, standing)
        if spot is None:
            continue
        there = spot.apply(outline)
        moved = np.hypot(*(there - start.apply(outline)).T).max()
        assert moved < 8.1
        assert there.min() >= -1e-9
        assert (there.max(axis=0) <= np.array(area.size_mm) + 1e-9).all()
        assert all(apart(there, other) >= gap - 1e-9 for other in placed)
        assert all(
            shapely.disjoint(shapely.polygons(there), shapely.polygons(other)) for other in placed
        )
        standing.add(there)
        placed.append(there)


def test_an_arc_nests_into_a_congruent_one():
    arc = crescent(3)
    one = at(arc - arc.min(axis=0), 14.0, 30.0)
    thick = float(np.hypot(*(arc[-1] - arc[0])))
    middle = (np.arctan2(*arc[0][::-1]) + np.arctan2(*arc[23][::-1])) / 2.0
    away = (thick + GAP + 1.5) * np.array([math.cos(middle), math.sin(middle)])
    start = Spot(1.0, *(away + 0.2).tolist())
    standing = standing_with(one)
    placed = slid(start, one, standing).apply(one)
    assert GAP <= apart(placed, one) < GAP + 0.02
    # The inner side of one is bent more than the outer side of the other: they meet at both ends.
    near = shapely.polygons(placed).buffer(GAP + 0.05).intersection(shapely.polygons(one))
    assert shapely.length(shapely.minimum_rotated_rectangle(near)) > 2 * 50.0
