"""A ring around an opening is part of a cone: unrolled, its holes keep their places on it."""

import numpy as np
import pytest
import shapely

from fabweave.core.errors import CannotMakeError
from fabweave.piece.rim_ring import MOST_OFF_MM, plan_ring

SIZES = {"edge_mm": 6.0, "thickness_mm": 0.8, "clearance_mm": 0.2}
#: From the middle of the strands to that of the band.
ABOVE = 1.5 * 0.8 + 0.1


def crossings(slope, *, count=16, seed=3):
    """Return places on a cone about (10, -5), two rows of them."""
    rng = np.random.default_rng(seed)
    turn = (np.arange(count) + 0.3 * rng.random(count)) * 2 * np.pi / count
    away = np.where(np.arange(count) % 2, 58.0, 70.0) + rng.random(count)
    place = np.column_stack((10 + away * np.cos(turn), -5 + away * np.sin(turn), slope * away + 99))
    return place[rng.permutation(count)]


def planned(points, side="top", **options):
    names = np.arange(len(points)) + 100
    hole = np.full(len(points), 3.0)
    given = {"count": 2, "first": 1, "hole_mm": hole, **SIZES, **options}
    return plan_ring(side, names, points, (10.0, -5.0), 80.0, **given)


@pytest.mark.parametrize("slope", [0.0, -0.2, -0.6, -1.5, 0.4])
@pytest.mark.parametrize("side", ["top", "bottom"])
def test_holes_are_as_far_apart_as_on_the_cone(slope, side):
    points = crossings(slope)
    ring = planned(points, side)
    assert ring.off_mm == 0.0
    assert ring.slope_deg == pytest.approx(np.degrees(np.arctan(abs(slope))), abs=1e-3)
    normal = np.array([-slope, 1.0]) / np.hypot(1.0, slope) * (1.0 if side == "top" else -1.0)
    for piece in ring.pieces:
        here = points[piece.crossings - 100] - (10.0, -5.0, 0.0)
        away, turn = (
            np.hypot(*here[:, :2].T) + ABOVE * normal[0],
            np.arctan2(here[:, 1], here[:, 0]),
        )
        for one, two in zip(range(len(turn) - 1), range(1, len(turn)), strict=True):
            # Lengths on a cone: those of its flat sector, by the law of cosines.
            a, b = away[[one, two]] * np.hypot(1.0, slope)
            sweep = ((turn[two] - turn[one]) % (2 * np.pi)) / np.hypot(1.0, slope)
            wanted = np.sqrt(a * a + b * b - 2 * a * b * np.cos(sweep))
            assert np.hypot(*(piece.holes[two] - piece.holes[one])[:2]) == pytest.approx(wanted)


@pytest.mark.parametrize("count", [2, 3, 5])
def test_pieces_go_all_round_lap_at_a_hole_and_keep_holes_off_their_edges(count):
    ring = planned(crossings(-0.4), count=count, first=4)
    assert [piece.id for piece in ring.pieces] == [f"R{4 + number}" for number in range(count)]
    for piece, after in zip(ring.pieces, [*ring.pieces[1:], ring.pieces[0]], strict=True):
        assert piece.crossings[-1] == after.crossings[0]
        outline = shapely.Polygon(piece.path.flattened(0.005))
        assert outline.is_valid
        assert piece.path.area == pytest.approx(outline.area, rel=1e-3)
        holes = shapely.points(piece.holes[:, :2])
        assert shapely.distance(holes, outline.exterior).min() > 6.0 - 0.02
        # The id is where the piece before covers it, and clear of the hole.
        x, y, _, height = piece.label
        assert outline.contains(shapely.Point(x, y).buffer(height / 2))
        assert 1.5 + height / 2 < np.hypot(x - piece.holes[0, 0], y - piece.holes[0, 1])
        assert min(np.hypot(*(piece.holes[0, :2] - other)) for other in piece.holes[1:, :2]) > 9.0
    assert len(set(ring.crossings.tolist())) == 16 == len(ring.crossings) - count
    assert ring.opening_mm == pytest.approx(80.0)


def test_where_holes_are_near_the_rim_the_opening_gets_smaller():
    points = crossings(0.0)
    points[:, :2] = (points[:, :2] - (10.0, -5.0)) * 0.75 + (10.0, -5.0)
    ring = planned(points)
    nearest = np.hypot(*(points[:, :2] - (10.0, -5.0)).T).min()
    assert ring.opening_mm == pytest.approx(2 * (nearest - 6.0), abs=1e-3)


def test_what_cannot_be_fastened_is_refused():
    points = crossings(-0.4)
    points[3, 2] += 2.5 * MOST_OFF_MM
    with pytest.raises(CannotMakeError, match=r"would be up to \d+\.\d mm off the strands"):
        planned(points)
    with pytest.raises(CannotMakeError, match="held by 3 fasteners only"):
        planned(crossings(0.0)[:3])
    with pytest.raises(CannotMakeError, match="at 80° to the level"):
        planned(crossings(-np.tan(np.radians(80.0))))
    with pytest.raises(CannotMakeError, match="too near to one another for laps"):
        planned(crossings(0.0, count=60), count=3)
