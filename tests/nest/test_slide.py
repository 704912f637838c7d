"""Slides are exact: they end at the gap, never nearer, and only where pieces may stand."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar
from strategies import at_most

from fabweave.nest.container import Container
from fabweave.nest.item_shape import Spot, rotated
from fabweave.nest.place.spectral_packing import PlacedOutlines, slide
from fabweave.stock.rotations import Rotations

BAR = bar(60.0, 8.0)
GAP = 2.0


def at(outline, x, y):
    return outline + np.array([x, y])


def placed_with(*outlines, container=None, gap=GAP):
    placed = PlacedOutlines(container or Container((200.0, 120.0)), gap)
    for outline in outlines:
        placed.add(outline)
    return placed


def crescent(seed):
    """Return a bent strip, about 60 by 8 mm."""
    rng = np.random.default_rng(seed)
    radius, width = rng.uniform(30.0, 90.0), rng.uniform(5.0, 10.0)
    angle = np.linspace(0.0, 60.0 / radius, 24)
    arc = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.concatenate([radius * arc, (radius + width) * arc[::-1]])


def apart(one, other):
    return shapely.distance(shapely.polygons(one), shapely.polygons(other))


def test_a_piece_that_stands_too_near_makes_room():
    below = at(BAR, 20.0, 20.0)
    start = Spot(0.0, 20.0, 28.5)
    assert not placed_with(below).has_room(start.apply(BAR))
    spot = slide(start, BAR, placed_with(below))
    assert GAP <= apart(spot.apply(BAR), below) < GAP + 0.01


def test_where_a_slot_is_too_narrow_there_is_no_room():
    around = placed_with(at(BAR, 20.0, 20.0), at(BAR, 20.0, 20.0 + 8.0 + 11.8))
    assert slide(Spot(0.0, 20.0, 20.0 + 8.0 + 1.9), BAR, around) is None
    wider = placed_with(at(BAR, 20.0, 20.0), at(BAR, 20.0, 20.0 + 8.0 + 12.1))
    assert slide(Spot(0.0, 20.0, 20.0 + 8.0 + 1.9), BAR, wider) is not None


@pytest.mark.parametrize(
    ("rotations", "most"),
    [(Rotations(90.0), 0.0), (Rotations(180.0, 1.0), 1.0), (Rotations(180.0, 5.0), 3.0)],
)
def test_a_rule_for_rotations_holds(rotations, most):
    slanted = at(rotated(BAR, np.array([3.0]))[0], 20.0, 20.0)
    spot = slide(
        Spot(0.0, 19.0, 32.5),
        BAR,
        placed_with(slanted, container=Container((200, 120), None, rotations)),
    )
    assert float(rotations.off_deg(np.array([spot.angle_deg]))[0]) < 1e-9
    assert spot.angle_deg == pytest.approx(most, abs=0.05)


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
    placed = placed_with(at(BAR, 20.0, 20.0))
    assert placed.has_room(at(BAR, 20.0, 30.0))
    assert not placed.has_room(outline)


@at_most(40)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.3, 2.0, 6.0]))
def test_no_slide_breaks_the_gap_or_goes_far(seed, gap):
    rng = np.random.default_rng(seed)
    container = Container((160.0, 120.0))
    placed = PlacedOutlines(container, gap)
    outlines = []
    for number in range(12):
        outline = crescent(seed + number)
        outline -= outline.min(axis=0)
        start = Spot(float(rng.uniform(0, 360)), *rng.uniform(0, 150, 2).tolist())
        meets = any(apart(start.apply(outline), other) == 0.0 for other in outlines)
        if meets:
            continue
        spot = slide(start, outline, placed)
        if spot is None:
            continue
        there = spot.apply(outline)
        moved = np.hypot(*(there - start.apply(outline)).T).max()
        assert moved < 8.1
        assert there.min() >= -1e-9
        assert (there.max(axis=0) <= np.array(container.size_mm) + 1e-9).all()
        assert all(apart(there, other) >= gap - 1e-9 for other in outlines)
        assert all(
            shapely.disjoint(shapely.polygons(there), shapely.polygons(other)) for other in outlines
        )
        placed.add(there)
        outlines.append(there)
