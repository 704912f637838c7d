import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar
from strategies import at_most

from fabweave.nest.container import Container
from fabweave.nest.item_shape import rotated, shape_of
from fabweave.nest.separate.fewer_sheets import shortfall_mm
from fabweave.nest.separate.separation import (
    distances,
    gradients,
    item_arrays,
    item_field,
    near_samples,
    place_items,
    separate,
)

GAP = 2.0
BAR = item_field(shape_of(bar(40.0, 8.0))[0], GAP)


def random_items(seed, count, size=30.0):
    """Return stars and bars, with vertices at random distances from the middle."""
    rng = np.random.default_rng(seed)
    items = []
    for _ in range(count):
        angle = np.linspace(0, 2 * math.pi, 9, endpoint=False)
        radius = size * rng.uniform(0.4, 1.0, 9)
        star = np.stack([radius * np.cos(angle), 0.5 * radius * np.sin(angle)], axis=1)
        items.append(item_field(shape_of(star)[0], GAP))
    return items


def polygons_of(items, poses):
    return [
        shapely.polygons(rotated(item.outline, np.array([math.degrees(pose[2])]))[0] + pose[:2])
        for item, pose in zip(items, poses, strict=True)
    ]


@at_most(20)
@given(st.integers(0, 10**6), st.integers(2, 6))
def test_field_is_the_distance_of_shapely_and_near_samples_misses_nothing(seed, count):
    rng = np.random.default_rng(seed)
    items = random_items(seed, count)
    poses = np.column_stack([rng.uniform(0, 90, (count, 2)), rng.uniform(0, 7, count)])
    arrays = item_arrays(items)
    placed = place_items(arrays, poses)
    polygons = polygons_of(items, poses)
    moving = rng.random(count) < 0.7
    pairs = zip(*near_samples(placed, 6.0, moving), strict=True)
    near = {(int(sample), int(item)) for sample, item in pairs}
    assert all(moving[item] or moving[arrays.owner[sample]] for sample, item in near)
    for number, polygon in enumerate(polygons):
        inside = shapely.contains_xy(polygon, *placed.points.T)
        points = shapely.points(placed.points)
        exact = np.where(inside, -1.0, 1.0) * shapely.distance(points, polygon.exterior)
        owner = np.full(len(points), number)
        distance = distances(placed, placed.points, owner)
        gradient = gradients(placed, placed.points, owner)
        close = (exact < 12.0) & (arrays.owner != number)
        step = items[number].step_mm
        assert np.abs(distance - exact)[close & (exact > -4.0)].max(initial=0.0) < 0.5 * step
        assert np.hypot(*gradient[close].T).max(initial=0.0) < 1.6
        wanted = (exact < 6.0 - 0.5 * step) & (arrays.owner != number)
        for sample in np.flatnonzero(wanted & (moving[number] | moving[arrays.owner])):
            assert (int(sample), number) in near


@at_most(25)
@given(st.integers(0, 10**6), st.integers(1, 7))
def test_separated_items_keep_the_gap_and_stay_inside(seed, count):
    rng = np.random.default_rng(seed)
    items = random_items(seed, count)
    poses = np.column_stack([rng.uniform(20, 160, (count, 2)), rng.uniform(0, 7, count)])
    separated = separate(item_arrays(items), poses, Container((180.0, 180.0)), GAP, steps=200)
    if separated is not None:
        # What the samples cannot see is small.
        assert shortfall_mm(items, separated, Container((180.0, 180.0)), GAP) < 0.5
    else:
        assert shortfall_mm(items, poses, Container((180.0, 180.0)), GAP) > 0.0


def test_what_does_not_move_stays_and_the_others_make_room():
    poses = np.array([[60.0, 40.0, 0.0], [60.0, 46.0, 0.0], [60.0, 70.0, 0.0]])
    arrays, usable = item_arrays([BAR] * 3), Container((120.0, 90.0))
    for moving in ([True, False, False], [False, True, True]):
        chosen = np.array(moving)
        separated = separate(arrays, poses, usable, GAP, steps=60, moving=chosen)
        assert separated is not None
        assert separated[~chosen] == pytest.approx(poses[~chosen], abs=0.0)
        assert shortfall_mm([BAR] * 3, separated, usable, GAP) < 0.05
    # All together it is what it was without being asked.
    everyone = separate(arrays, poses, usable, GAP, steps=60, moving=np.ones(3, dtype=bool))
    assert everyone == pytest.approx(separate(arrays, poses, usable, GAP, steps=60), abs=0.0)


def test_missing_tells_overlap_gap_and_border_apart():

    def missing(*poses):
        return shortfall_mm([BAR] * len(poses), np.array(poses), Container((100.0, 100.0)), GAP)

    assert missing([50.0, 50.0, 0.0]) == pytest.approx(-30.0)
    assert missing([50.0, 3.0, 0.0]) == pytest.approx(1.0)
    assert missing([50.0, 50.0, 0.0], [50.0, 59.5, 0.0]) == pytest.approx(0.5)
    # 40 × 2 mm are shared, and all of the gap is missing.
    overlap = missing([50.0, 50.0, 0.0], [50.0, 56.0, 0.0])
    assert overlap == pytest.approx(GAP + math.sqrt(80.0))
