"""Outlines moved by half the kerf are true offsets, arcs as arcs."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.arc_path import Path, straight_path
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.sheet.drawing import (
    MIN_SEGMENT_MM,
    Circle,
    Layer,
    PieceDrawing,
    Polyline,
    SheetDrawing,
    check_drawing,
)
from fabweave.sheet.kerf import TOLERANCE_MM, check_kerf, compensated, offset_path


@st.composite
def arc_polygons(draw):
    """Return a star-shaped path of sides and gentle arcs, counter-clockwise, 10 mm or larger.

    None of its corners is so sharp that moving it by half a millimetre cuts it off.
    """
    n = draw(st.integers(4, 14))
    radii = np.array(draw(st.lists(st.floats(10.0, 16.0), min_size=n, max_size=n)))
    bulges = np.array(draw(st.lists(st.floats(-0.12, 0.2), min_size=n, max_size=n)))
    angles = 2.0 * np.pi * np.arange(n) / n
    turn = draw(st.floats(0.0, 6.28))
    points = radii[:, None] * np.stack((np.cos(angles + turn), np.sin(angles + turn)), axis=1)
    return Path(points, np.where(np.abs(bulges) < 0.01, 0.0, bulges))


@given(arc_polygons(), st.floats(0.02, 0.4))
def test_a_moved_path_is_the_offset_that_buffers_make(path, off):
    outside, inside = offset_path(path, off), offset_path(path, -off)
    nominal = shapely.Polygon(path.flattened(1e-4))
    for moved, by in ((outside, off), (inside, -off)):
        assert moved is not None
        assert len(moved.points) == len(path.points)
        buffered = nominal.buffer(by, join_style="mitre", mitre_limit=12.0)
        # The flattening of arcs is all that is between them.
        assert shapely.Polygon(moved.flattened(1e-4)).symmetric_difference(buffered).area < 0.05
        # Arcs keep their middles: curvature changes as 1 / (1/k + d) says.
        before, after = _curvature(path), _curvature(moved)
        assert after == pytest.approx(before / (1.0 + by * before), abs=1e-9)


@given(arc_polygons(), st.floats(0.02, 0.3))
def test_there_and_back_is_nowhere(path, off):
    back = offset_path(offset_path(path, off), -off)
    assert back.points == pytest.approx(path.points, abs=1e-4)
    assert back.bulges == pytest.approx(path.bulges, abs=1e-4)


def _curvature(path):
    chords = np.hypot(*(np.roll(path.points, -1, axis=0) - path.points).T)
    return 4.0 * path.bulges / (chords * (1.0 + path.bulges**2))


@pytest.mark.parametrize("n", [3, 4, 7])
def test_a_regular_polygon_grows_by_its_perimeter_and_its_corners(n):
    angles = 2.0 * np.pi * np.arange(n) / n
    path = straight_path(20.0 * np.stack((np.cos(angles), np.sin(angles)), axis=1))
    moved = offset_path(path, 0.1)
    # Steiner's formula with mitred corners: A + p d + n tan(pi/n) d².
    expected = path.area + path.length * 0.1 + n * np.tan(np.pi / n) * 0.01
    assert moved.area == pytest.approx(expected, abs=1e-9)


def test_sides_that_vanish_in_a_hollow_are_left_out():
    # A nick of 0.12 mm between two slopes of 45°: at 0.2 mm its bottom is gone.
    nick = [[10.56, 10], [10.06, 9.5], [9.94, 9.5], [9.44, 10]]
    points = np.array([[0.0, 0], [20, 0], [20, 10], *nick, [0, 10]])
    moved = offset_path(straight_path(points), 0.2)
    assert len(moved.points) == 7
    lengths = np.hypot(*(np.roll(moved.points, -1, axis=0) - moved.points).T)
    assert lengths.min() >= MIN_SEGMENT_MM
    true = shapely.Polygon(points).buffer(0.2, join_style="mitre")
    drawn = shapely.Polygon(moved.points)
    assert drawn.boundary.hausdorff_distance(true.boundary) < TOLERANCE_MM


def test_a_sharp_corner_is_cut_off_square_at_the_right_distance():
    # A corner of 10°: its mitre would reach 11.5 times as far as its sides move.
    needle = np.array([[0.0, 0.0], [40.0, -3.5], [40.0, 3.5]])
    moved = offset_path(straight_path(needle), 0.2)
    assert len(moved.points) == 4
    assert moved.points[:, 0].min() == pytest.approx(-0.2)
    near = shapely.Polygon(needle).buffer(0.2 - 1e-9)
    assert shapely.Polygon(moved.points).covers(near)


def sheet(*entities):
    return SheetDrawing("sheet_01", 60.0, 40.0, (PieceDrawing("A1", entities),), ())


def square(side, layer=Layer.CUT_OUTER, at=0.0):
    corners = at + side * np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    return Polyline(layer, corners, closed=True)


def test_marks_stay_holes_shrink_outlines_grow():
    mark = Polyline(Layer.ENGRAVE_MARK, np.array([[2.0, 2.0], [2.0, 4.0]]))
    slot = square(2.0, Layer.CUT_INNER, at=10.0)
    drawing = sheet(mark, Circle(Layer.CUT_INNER, 5.0, 5.0, 1.65), slot, square(20.0))
    moved = compensated(drawing, 0.3)
    check_drawing(moved)
    same, hole, smaller, larger = moved.pieces[0].entities
    assert same is mark
    assert (hole.x, hole.y, hole.radius) == (5.0, 5.0, pytest.approx(1.5))
    assert np.ptp(smaller.points, axis=0) == pytest.approx([1.7, 1.7])
    assert np.ptp(larger.points, axis=0) == pytest.approx([20.3, 20.3])
    assert compensated(drawing, 0.0) is drawing


@pytest.mark.parametrize(
    "inner", [Circle(Layer.CUT_INNER, 5.0, 5.0, 0.15), square(0.25, Layer.CUT_INNER, at=5.0)]
)
def test_what_is_narrower_than_the_kerf_is_named(inner):
    with pytest.raises(CannotMakeError, match=r"1 piece\(s\) of sheet_01: A1; .* narrower"):
        compensated(sheet(inner, square(20.0)), 0.3)


def test_pieces_must_be_two_kerfs_apart():
    check_kerf(0.25, 0.5)
    with pytest.raises(InputError, match=r"use --gap 0\.6mm or more"):
        check_kerf(0.3, 0.5)
