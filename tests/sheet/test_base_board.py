"""The board of a base has two holes about each foot, names beside them, and room for all."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import CannotMakeError
from fabweave.sheet.base_board import base_board
from fabweave.sheet.drawing import Circle, Layer


def ring(count: int, radius: float) -> np.ndarray:
    turn = 2.0 * np.pi * np.arange(count) / count
    places = [radius * np.cos(turn), radius * np.sin(turn), np.linspace(2.0, 9.0, count)]
    return np.column_stack(places)


@given(
    count=st.integers(3, 24),
    radius=st.floats(60.0, 300.0),
    rise=st.floats(-1.0, 1.0),
    hole=st.sampled_from([1.0, 2.0, 3.3]),
)
def test_feet_are_amid_their_holes_and_nothing_runs_into_anything(count, radius, rise, hole):
    places = ring(count, radius)
    normals = places * (1.0, 1.0, 0.0) / radius + (0.0, 0.0, rise)
    names = [f"A{at} B{at}" for at in range(count)]
    board = base_board(names, places, normals, hole)
    drawn = board.drawing.pieces[0].entities
    circles = [one for one in drawn if isinstance(one, Circle)]
    at = np.array([(one.x, one.y) for one in circles]).reshape(count, 2, 2)
    off = at.mean(axis=1) - places[:, :2]
    np.testing.assert_allclose(off, np.broadcast_to(off[0], off.shape), atol=1e-9)
    # Across the strips, as far on each side.
    apart = at[:, 0] - at[:, 1]
    across = apart[:, 0] * normals[:, 1] - apart[:, 1] * normals[:, 0]
    assert across == pytest.approx(np.zeros(count), abs=1e-6)
    holes = [shapely.Point(one.x, one.y).buffer(one.radius) for one in circles]
    letters = [shapely.LineString(one.points) for one in drawn if one.layer is Layer.ENGRAVE_LABEL]
    edge = shapely.box(0.0, 0.0, board.drawing.width_mm, board.drawing.height_mm).buffer(-1.0)
    assert all(edge.contains(shape) for shape in (*holes, *letters))
    tree = shapely.STRtree(holes)
    assert all(len(tree.query(shape, predicate="intersects")) == 0 for shape in letters)
    assert all(len(tree.query(shape, predicate="intersects")) == 1 for shape in holes)
    np.testing.assert_allclose(board.high_mm, places[:, 2])


def test_holes_that_would_run_into_one_another_are_refused():
    with pytest.raises(CannotMakeError) as refused:
        base_board(["A1 B1"] * 12, ring(12, 8.0), ring(12, 1.0), 3.0)
    assert "--size" in str(refused.value.cure)
