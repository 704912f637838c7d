"""Paths keep to their polygons, both ways, with as few sides as vertices allow."""

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import at_most

from fabweave.core.arc_path import Path
from fabweave.piece.outline import CORNER_DEG, FIT_MM, INSCRIBED_MM, fit_paths, inscribed_polygon


def wavy(length, width, amplitude, waves, count, phase):
    """A band along a sine, with sides far shorter than its waves: smooth, with four corners."""
    x = np.linspace(0.0, length, count)
    k = 2.0 * np.pi * waves / length
    middle = np.stack([x, amplitude * np.sin(k * x + phase)], axis=1)
    way = np.stack([np.ones(count), amplitude * k * np.cos(k * x + phase)], axis=1)
    way /= np.hypot(*way.T)[:, None]
    across = width / 2.0 * np.stack([-way[:, 1], way[:, 0]], axis=1)
    return np.concatenate([middle - across, (middle + across)[::-1]])


def arc_points(start, end, bulge, count=60):
    """Points of one arc by its centre, found from scratch."""
    share = np.linspace(0.0, 1.0, count)
    a, b = complex(*start), complex(*end)
    if abs(bulge) < 1e-12:
        z = a + share * (b - a)
    else:
        turn = 4.0 * np.arctan(bulge)
        centre = a + (b - a) / (1.0 - np.exp(1j * turn))
        z = centre + (a - centre) * np.exp(1j * turn * share)
    return np.stack([z.real, z.imag], axis=1)


def traced(path, count):
    ends = np.roll(path.points, -1, axis=0)
    counts = np.broadcast_to(count, len(ends)).tolist()
    sides = zip(path.points, ends, path.bulges, counts, strict=True)
    return np.concatenate([arc_points(*side)[:-1] for side in sides])


def finely_traced(path, off):
    """A path by chords that are off its arcs by no more than so much."""
    chords = np.hypot(*(np.roll(path.points, -1, axis=0) - path.points).T)
    # A chord of an arc that sweeps 4 a is off by bulge * chord / 2, and n of them by 1 / n² of
    # that; not quite, where arcs are not shallow, so half as many more.
    parts = np.sqrt(np.abs(path.bulges) * chords / 2.0 / off)
    return traced(path, np.ceil(1.5 * parts).astype(int) + 2)


def apart(path, ring):
    """How far path and polygon are apart, looked at densely, both ways."""
    drawn, wanted = finely_traced(path, 1e-5), shapely.LinearRing(ring)
    dense = shapely.get_coordinates(shapely.segmentize(wanted, 0.2))
    return max(farthest(drawn, wanted), farthest(dense, shapely.LinearRing(drawn)))


def farthest(points, line):
    shapely.prepare(line)
    return shapely.distance(shapely.points(points), line).max()


def turns_deg(ring):
    steps = np.roll(ring, -1, axis=0) - ring
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    return np.degrees((heading - np.roll(heading, 1) + np.pi) % (2.0 * np.pi) - np.pi)


bands = st.builds(
    wavy,
    st.floats(20.0, 300.0),
    st.floats(2.0, 15.0),
    st.floats(0.0, 12.0),
    st.floats(0.3, 2.0),
    st.integers(12, 140),
    st.floats(0.0, 6.0),
).filter(lambda ring: shapely.Polygon(ring).is_valid)


@at_most(30)
@given(bands, st.sampled_from([0.005, 0.02, 0.1]))
@example(wavy(259.0, 15.0, 10.25, 0.875, 62, 0.0), 0.02)
def test_paths_and_polygons_are_within_the_tolerance_both_ways(ring, tolerance):
    (path,) = fit_paths([ring], tolerance)
    assert apart(path, ring) <= tolerance
    assert len(path.points) <= len(ring)
    # Points are vertices, in their order; corners are among them.
    places = [int(np.flatnonzero(np.all(ring == point, axis=1))[0]) for point in path.points]
    first = places.index(min(places))
    assert places[first:] + places[:first] == sorted(places)
    assert set(np.flatnonzero(np.abs(turns_deg(ring)) > CORNER_DEG)) <= set(places)
    assert np.all(np.abs(path.bulges) <= np.tan(np.deg2rad(40.0)) + 1e-12)
    chords = np.hypot(*(np.roll(path.points, -1, axis=0) - path.points).T)
    bent = path.bulges != 0.0
    radii = chords[bent] * (1.0 + path.bulges[bent] ** 2) / (4.0 * np.abs(path.bulges[bent]))
    assert np.all(radii <= 10_000.0 * (1.0 + 1e-9))


def best_bulge_exists(points, tolerance):
    """Whether some arc from the first to the last of points keeps to them: tried one by one."""
    line = shapely.LineString(points)
    dense = shapely.get_coordinates(shapely.segmentize(line, 0.1))
    for half in np.linspace(-1.0, 1.0, 1001):
        drawn = arc_points(points[0], points[-1], np.tan(half / 2.0))
        # The middle first: it tells nearly all.
        if shapely.distance(shapely.Point(drawn[30]), line) > tolerance:
            continue
        if farthest(drawn, line) <= tolerance and (
            farthest(dense, shapely.LineString(drawn)) <= tolerance
        ):
            return True
    return False


def fewest(ring, tolerance):
    """The fewest arcs around a ring with a corner at 0, by trying all pairs of vertices."""
    corners = np.abs(turns_deg(ring)) > CORNER_DEG
    count = len(ring)
    closed = np.concatenate([ring, ring[:1]])
    cost = [0.0] + [np.inf] * count
    for end in range(1, count + 1):
        for start in range(end - 1, -1, -1):
            if end - start == 1 or best_bulge_exists(closed[start : end + 1], tolerance):
                cost[end] = min(cost[end], cost[start] + 1)
            if corners[start]:
                break
    return cost[count]


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_no_path_has_fewer_sides(seed):
    rng = np.random.default_rng(seed)
    ring = wavy(30.0, 8.0, rng.uniform(0.5, 3.0), rng.uniform(0.4, 1.2), 8, rng.uniform(0.0, 6.0))
    (path,) = fit_paths([ring], 0.05)
    # Brute force has a coarser grid of arcs, and not the reserve for rounding.
    assert fewest(ring, 0.0505) <= len(path.points) <= fewest(ring, 0.048)


def test_known_shapes_have_known_paths():
    square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]])
    halves = np.concatenate([square, (square + np.roll(square, -1, axis=0)) / 2.0])
    halved = halves[[0, 4, 1, 5, 2, 6, 3, 7]]
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, 46)
    cap = 5.0 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    stadium = np.concatenate([cap + np.array([30.0, 0.0]), -cap])
    ring_turn = np.linspace(0.0, np.pi / 2.0, 31)
    circle = np.stack([np.cos(ring_turn), np.sin(ring_turn)], axis=1)
    quarter = np.concatenate([50.0 * circle, 40.0 * circle[::-1]])
    paths = fit_paths([square, halved, stadium, quarter], 0.02)
    assert [np.count_nonzero(path.bulges) for path in paths] == [0, 0, 4, 2]
    assert [len(path.points) for path in paths] == [4, 4, 6, 4]
    assert paths[3].bulges[paths[3].bulges != 0.0] == pytest.approx(
        [np.tan(np.pi / 8.0), -np.tan(np.pi / 8.0)], abs=2e-3
    )
    assert paths[2].area == pytest.approx(300.0 + 25.0 * np.pi, rel=1e-3)


@at_most(15)
@given(bands)
def test_inscribed_polygons_keep_to_their_paths(ring):
    (path,) = fit_paths([ring], FIT_MM)
    polygon = inscribed_polygon(path)
    assert apart(path, polygon) <= INSCRIBED_MM + 1e-9
    sides = np.hypot(*(np.roll(polygon, -1, axis=0) - polygon).T)
    least = min(0.1, np.hypot(*(np.roll(ring, -1, axis=0) - ring).T).min())
    assert sides.min() >= least


@at_most(60)
@given(
    st.lists(st.floats(-0.95, 0.95), min_size=2, max_size=7),
    st.floats(1.0, 500.0),
    st.floats(-1e4, 1e4),
)
def test_length_and_area_are_those_of_dense_polygons(bulges, radius, shift):
    turn = 2.0 * np.pi * np.arange(len(bulges)) / len(bulges)
    path = Path(radius * np.stack([np.cos(turn), np.sin(turn)], axis=1) + shift, np.array(bulges))
    dense = traced(path, 400)
    x, y = (dense - dense[0]).T
    area = np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2.0
    assert path.area == pytest.approx(area, abs=2e-4 * radius**2)
    length = np.hypot(*(np.roll(dense, -1, axis=0) - dense).T).sum()
    assert path.length == pytest.approx(length, rel=1e-5)
