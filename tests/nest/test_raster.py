import math

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import at_most

from fabweave.nest.item_shape import rotated, shapes_of
from fabweave.nest.place.raster import closed_sides, filled_pixels, region_sides


def star(seed, count):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * math.pi, count))
    radius = rng.uniform(2, 12, count)
    return 15.0 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


@at_most(40)
@given(st.integers(0, 10**6), st.integers(5, 30), st.floats(0.4, 2.0))
def test_filled_pixels_are_the_centres_that_shapely_contains(seed, count, pixel):
    outline = star(seed, count)
    sides = closed_sides(outline)
    turned = rotated(sides.reshape(-1, 2) - 15, np.array([0.0, 33.0, 200.0])) + 15
    got = filled_pixels(turned.reshape(3, -1, 2, 2), (40, 50), pixel)
    x, y = np.meshgrid((np.arange(50) + 0.5) * pixel, (np.arange(40) + 0.5) * pixel)
    for k in range(3):
        # The even-odd rule, also where a star whose centre lies outside crosses itself.
        parity = np.zeros(x.shape, dtype=bool)
        for (x0, y0), (x1, y1) in turned[k].reshape(-1, 2, 2):
            if y0 == y1:
                continue
            hit = (min(y0, y1) <= y) & (y < max(y0, y1))
            parity ^= hit & (x >= x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        assert (got[k] == parity).all()
        polygon = shapely.polygons(turned[k].reshape(-1, 2, 2)[:, 0])
        if shapely.is_valid(polygon):
            shapely.prepare(polygon)
            assert (got[k] == shapely.contains_xy(polygon, x, y)).all()


@at_most(40)
@given(st.integers(0, 10**6), st.floats(0.3, 6.0))
def test_inflation_holds_every_point_within_the_radius(seed, radius):
    polygon = shapely.convex_hull(shapely.polygons(star(seed, 12)))
    outline = shapely.get_coordinates(polygon)[:-1]
    ring = region_sides(shapely.Polygon(outline), radius)[:, 0]
    border = shapely.LineString(np.vstack([ring, ring[:1]]))
    assert shapely.distance(border, polygon) >= radius - 1e-9
    assert shapely.hausdorff_distance(border, polygon.exterior, 0.05) <= 1.2 * radius + 1e-9


@given(st.integers(0, 10**6), st.floats(-180, 180), st.floats(-500, 500))
@at_most(40)
def test_congruent_outlines_share_a_shape_and_mirror_images_do_not(seed, angle, shift):
    outline = star(seed, 9)
    moved = rotated(outline, np.array([angle]))[0] + shift
    shapes, poses = shapes_of([outline, moved, outline * [-1, 1]])
    assert [pose.shape for pose in poses] == [0, 0, 1]
    for pose, points in zip(poses, (outline, moved), strict=False):
        placed = rotated(points, np.array([pose.angle_deg]))[0] + [pose.x_mm, pose.y_mm]
        np.testing.assert_allclose(placed, shapes[0].outline, atol=1e-5)
