"""Bends, twists and widths of strips whose answers are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from ribbon_strips import strip

from fabweave.piece.development import wave_turns
from fabweave.ribbon.rules.bends import measure_bends, measure_spans

RADII = st.floats(5.0, 500.0)


def cylinder(radius: float, count: int, *, width: float = 10.0, slope: float = 0.0):
    """A strip round a cylinder, rungs along its axis; with a slope it winds as a screw does."""
    angle = 2 * np.pi * np.arange(count) / count
    right = np.column_stack((radius * np.cos(angle), radius * np.sin(angle), slope * angle))
    return right, right + np.array([0.0, 0.0, width])


@given(RADII, st.integers(24, 200), st.floats(1.0, 20.0), st.floats(-1.0, 1.0))
def test_a_strip_round_a_cylinder_bends_to_its_radius_to_second_order(
    radius, count, width, slope
) -> None:
    right, left = cylinder(radius, count, width=width, slope=slope * radius)
    bends = measure_bends(strip(right, left))
    chord = 2 * radius * np.sin(np.pi / count)
    inner = slice(1, -1)
    # Exactly the chord over the angle, whichever way the strip winds.
    assert bends.radius_mm[inner] == pytest.approx(chord / (2 * np.pi / count), rel=1e-9)
    assert bends.radius_mm[inner] == pytest.approx(radius, rel=(chord / radius) ** 2 / 20)
    assert np.all(bends.bend_rad_mm[inner] != 0)
    assert bends.fold_deg[inner] == pytest.approx(360 / count, rel=1e-6)
    assert np.nanmax(bends.diagonal_deg) < 1e-6
    assert np.nanmax(np.abs(bends.twist_rad_mm)) < 1e-9
    winding = np.hypot(chord, slope * radius * 2 * np.pi / count)
    second_order = (chord / radius) ** 2
    assert bends.width_mm[inner] == pytest.approx(width * chord / winding, rel=second_order)


def test_convex_and_concave_bends_have_opposite_signs() -> None:
    right, left = cylinder(50.0, 60)
    out = measure_bends(strip(right, left)).bend_rad_mm[1:-1]
    # Right and left exchanged, the outward side looks to the axis.
    inward = measure_bends(strip(left, right)).bend_rad_mm[1:-1]
    assert out == pytest.approx(-inward)
    assert np.all(out > 0)


@given(RADII, st.floats(0.1, 1.3), st.floats(2.0, 8.0))
def test_a_strip_round_a_cone_bends_to_the_radius_at_its_middle(base, slant, width) -> None:
    # Rulings meet the cone's axis at `slant`; the middle line is a circle of radius `base`.
    angle = 2 * np.pi * np.arange(180) / 180
    out = np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
    up = np.array([0.0, 0.0, 1.0])
    along = np.cos(slant) * up - np.sin(slant) * out
    middle = base * out
    width = min(width, base)
    ribbons = strip(middle - along * width / 2, middle + along * width / 2)
    bends = measure_bends(ribbons)
    # Across a ruling the normal curvature of a cone is cos(slant) / distance from the axis.
    assert bends.radius_mm[1:-1] == pytest.approx(base / np.cos(slant), rel=1e-3)
    # Unfolded it is a sector: the middle line turns by sin(slant) of a full turn.
    assert abs(np.sum(wave_turns(ribbons))) == pytest.approx(
        360 * np.sin(slant) * 178 / 180, rel=1e-3
    )


@given(st.floats(0.001, 0.05), st.floats(2.0, 20.0), st.booleans())
def test_a_helicoid_twists_by_its_pitch_and_does_not_bend(rate, width, right_handed) -> None:
    way = np.linspace(0, 100, 81)
    turn = rate * way * (1 if right_handed else -1)
    rung = np.column_stack((0 * way, np.cos(turn), np.sin(turn))) * width / 2
    middle = np.column_stack((way, 0 * way, 0 * way))
    bends = measure_bends(strip(middle - rung, middle + rung))
    sign = 1 if right_handed else -1
    assert bends.twist_rad_mm[:-1] == pytest.approx(sign * rate, rel=1e-9)
    assert np.nanmax(np.abs(bends.bend_rad_mm)) < 1e-9
    assert bends.width_mm == pytest.approx(width, rel=1e-9)
    spans = measure_spans(strip(middle - rung, middle + rung, entry=[10, 60]), bends)
    # Panels are flat by design: of the 50 steps between their middles, 49 twist.
    assert spans.twist_deg[0] == pytest.approx(np.degrees(rate) * width * 49 / 50, rel=1e-6)


@given(st.lists(st.floats(-0.3, 0.3), min_size=4, max_size=30), st.floats(1.0, 9.0))
def test_a_plane_strip_has_no_creases_however_it_waves(turns, width) -> None:
    heading = np.cumsum(turns)
    middle = np.cumsum(np.column_stack((np.cos(heading), np.sin(heading), 0 * heading)) * 10, 0)
    across = np.column_stack((-np.sin(heading), np.cos(heading), 0 * heading)) * width / 2
    ribbons = strip(middle - across, middle + across)
    bends = measure_bends(ribbons)
    for crease in (bends.fold_deg, bends.diagonal_deg):
        assert np.nanmax(crease, initial=0.0) < 1e-6
    assert np.nanmax(np.abs(bends.bend_rad_mm)) < 1e-9
    # In the plane the middle line turns as it was laid.
    way = np.diff(middle @ np.array([1, 1j, 0]))
    expected = np.degrees(np.angle(way[1:] / way[:-1]))
    assert wave_turns(ribbons)[1:-1] == pytest.approx(expected, abs=1e-6)


def test_a_ring_is_measured_where_it_closes_too() -> None:
    right, left = cylinder(40.0, 48)
    ring = measure_bends(strip(right, left, closed=True, entry=[0, 24]))
    assert ring.bend_rad_mm == pytest.approx(np.full(48, ring.bend_rad_mm[5]))
    # A flat ring turns once round, by equal turns.
    angle = 2 * np.pi * np.arange(48) / 48
    circle = np.column_stack((np.cos(angle), np.sin(angle), 0 * angle))
    turns = wave_turns(strip(50 * circle, 40 * circle, closed=True, entry=[0]))
    assert turns == pytest.approx(np.full(48, 360 / 48))


@given(RADII, st.integers(2, 8))
def test_the_softest_ribbon_on_a_cylinder_has_its_radius(radius, facets) -> None:
    # One fine ring; panels stand a good way apart.
    right, left = cylinder(radius, 96)
    ribbons = strip(right, left, closed=True, entry=np.arange(0, 96, 96 // facets)[:facets])
    spans = measure_spans(ribbons, measure_bends(ribbons))
    arc = 2 * np.pi * radius * (96 // facets) / 96
    assert spans.length_mm[0] == pytest.approx(arc, rel=1e-3)
    assert spans.radius_mm[0] == pytest.approx(radius, rel=1e-3)


@given(st.floats(0.1, 2.0), st.floats(30.0, 80.0))
def test_over_and_under_on_flat_ground_need_two_arcs(height, pitch) -> None:
    # Two level panels, one `height` above and one below: slopes 2 h / s, so k = 8 h / s.
    x = np.array([0.0, 1.0, 2.0, pitch + 1, pitch + 2, pitch + 3])
    z = np.array([1, 1, 1, -1, -1, -1]) * height
    middle = np.column_stack((x, 0 * x, z))
    across = np.array([0.0, 5.0, 0.0])
    ribbons = strip(middle - across, middle + across, entry=[1, 3])
    spans = measure_spans(ribbons, measure_bends(ribbons))
    run = pitch
    slope = 2 * height / run
    assert spans.radius_mm[0] == pytest.approx(run / (4 * slope), rel=0.02)
    assert np.isnan(spans.radius_mm[1])
