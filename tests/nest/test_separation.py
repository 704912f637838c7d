import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from fabweave.nest.item_shape import rotated, shape_of
from fabweave.nest.separate.clearance_proof import missing_mm
from fabweave.nest.separate.item_field import body_of
from fabweave.nest.separate.overlap import crowd_of, distances, near_pairs, stand_at
from fabweave.nest.separate.separation import settle

GAP = 2.0


def bodies_of(seed, count, size=30.0):
    """Return stars and bars, with vertices at random distances from the middle."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(count):
        angle = np.linspace(0, 2 * math.pi, 9, endpoint=False)
        radius = size * rng.uniform(0.4, 1.0, 9)
        star = np.stack([radius * np.cos(angle), 0.5 * radius * np.sin(angle)], axis=1)
        found.append(body_of(shape_of(star)[0], GAP))
    return found


def placed(bodies, poses):
    return [
        shapely.polygons(rotated(body.outline, np.array([math.degrees(pose[2])]))[0] + pose[:2])
        for body, pose in zip(bodies, poses, strict=True)
    ]


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 6))
def test_field_is_the_distance_of_shapely_and_near_pairs_misses_nothing(seed, count):
    rng = np.random.default_rng(seed)
    bodies = bodies_of(seed, count)
    poses = np.column_stack([rng.uniform(0, 90, (count, 2)), rng.uniform(0, 7, count)])
    crowd = crowd_of(bodies)
    stand = stand_at(crowd, poses)
    polygons = placed(bodies, poses)
    moving = rng.random(count) < 0.7
    pairs = zip(*near_pairs(crowd, stand, 6.0, moving), strict=True)
    near = {(int(sample), int(body)) for sample, body in pairs}
    assert all(moving[body] or moving[crowd.owner[sample]] for sample, body in near)
    for number, polygon in enumerate(polygons):
        inside = shapely.contains_xy(polygon, *stand.world.T)
        points = shapely.points(stand.world)
        exact = np.where(inside, -1.0, 1.0) * shapely.distance(points, polygon.exterior)
        found, gradient = distances(crowd, stand, stand.world, np.full(len(points), number))
        close = (exact < 12.0) & (crowd.owner != number)
        step = bodies[number].step_mm
        assert np.abs(found - exact)[close & (exact > -4.0)].max(initial=0.0) < 0.5 * step
        assert np.hypot(*gradient[close].T).max(initial=0.0) < 1.6
        wanted = (exact < 6.0 - 0.5 * step) & (crowd.owner != number)
        for sample in np.flatnonzero(wanted & (moving[number] | moving[crowd.owner])):
            assert (int(sample), number) in near


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 7))
def test_settled_bodies_keep_the_gap_and_stay_inside(seed, count):
    rng = np.random.default_rng(seed)
    bodies = bodies_of(seed, count)
    poses = np.column_stack([rng.uniform(20, 160, (count, 2)), rng.uniform(0, 7, count)])
    found = settle(crowd_of(bodies), poses, (180.0, 180.0), GAP, steps=200)
    if found.ok:
        # What the samples cannot see is small.
        assert missing_mm(bodies, found.poses, (180.0, 180.0), GAP) < 0.5
    else:
        assert missing_mm(bodies, poses, (180.0, 180.0), GAP) > 0.0


def test_what_does_not_move_stays_and_the_others_make_room():
    bar = body_of(shape_of(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 8.0], [0.0, 8.0]]))[0], GAP)
    poses = np.array([[60.0, 40.0, 0.0], [60.0, 46.0, 0.0], [60.0, 70.0, 0.0]])
    crowd, usable = crowd_of([bar] * 3), (120.0, 90.0)
    for moving in ([True, False, False], [False, True, True]):
        chosen = np.array(moving)
        found = settle(crowd, poses, usable, GAP, steps=60, moving=chosen)
        assert found.ok
        assert found.poses[~chosen] == pytest.approx(poses[~chosen], abs=0.0)
        assert missing_mm([bar] * 3, found.poses, usable, GAP) < 0.05
    # All together it is what it was without being asked.
    everyone = settle(crowd, poses, usable, GAP, steps=60, moving=np.ones(3, dtype=bool))
    assert everyone.poses == pytest.approx(
        settle(crowd, poses, usable, GAP, steps=60).poses, abs=0.0
    )


def test_two_bars_that_overlap_part_by_the_least_motion():
    bar = body_of(shape_of(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 8.0], [0.0, 8.0]]))[0], GAP)
    poses = np.array([[50.0, 50.0, 0.0], [50.0, 55.0, 0.0]])
    found = settle(crowd_of([bar, bar]), poses, (100.0, 100.0), GAP, steps=60)
    assert found.ok
    # They are 8 mm high and 5 mm apart: each moves half of the 5 mm that are missing.
    np.testing.assert_allclose(found.poses[:, 1], [47.5, 57.5], atol=0.1)
    np.testing.assert_allclose(found.poses[:, 0], 50.0, atol=0.1)
    np.testing.assert_allclose(found.poses[:, 2], 0.0, atol=0.01)


def test_pull_takes_a_free_body_to_the_border():
    bar = body_of(shape_of(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 8.0], [0.0, 8.0]]))[0], GAP)
    start = np.array([[50.0, 50.0, 0.0]])
    found = settle(
        crowd_of([bar]), start, (100.0, 100.0), GAP, steps=40, pull=(0.0, -3.0), pulls=25
    )
    assert found.ok
    assert found.poses[0, 1] == pytest.approx(4.0, abs=0.1)


def test_too_many_bodies_are_given_up():
    bodies = bodies_of(1, 9)
    poses = np.tile([30.0, 30.0, 0.0], (9, 1)) + np.arange(9)[:, None]
    assert not settle(crowd_of(bodies), poses, (60.0, 60.0), GAP, steps=60).ok


def test_missing_tells_overlap_gap_and_border_apart():
    bar = body_of(shape_of(np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 8.0], [0.0, 8.0]]))[0], GAP)

    def missing(*poses):
        return missing_mm([bar] * len(poses), np.array(poses), (100.0, 100.0), GAP)

    assert missing([50.0, 50.0, 0.0]) == pytest.approx(-30.0)
    assert missing([50.0, 3.0, 0.0]) == pytest.approx(1.0)
    assert missing([50.0, 50.0, 0.0], [50.0, 59.5, 0.0]) == pytest.approx(0.5)
    # 40 × 2 mm are shared, and all of the gap is missing.
    overlap = missing([50.0, 50.0, 0.0], [50.0, 56.0, 0.0])
    assert overlap == pytest.approx(GAP + math.sqrt(80.0))
