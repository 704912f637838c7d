"""A ring in the manual is drawn flat in one scale, with a number beyond its border at each hole."""

import numpy as np
import pytest
import shapely

from fabweave.piece.rim_ring import plan_ring
from fabweave.show.manual.steps import lay_ring

POINTS_MM = 72 / 25.4


@pytest.mark.parametrize(("radius", "count"), [(60.0, 2), (20.0, 2), (200.0, 5)])
def test_pieces_of_a_ring_are_similar_to_what_is_cut_and_keep_apart(radius, count):
    turn = np.arange(12) * np.pi / 6
    places = np.column_stack((radius * np.cos(turn), radius * np.sin(turn), -0.3 * np.ones(12)))
    ring = plan_ring(
        "top", np.arange(12), places, (0.0, 0.0), 2 * radius - 12, count=count, first=1,
        hole_mm=np.full(12, 2.0), edge_mm=4.0, thickness_mm=0.4,
    )  # fmt: skip
    wide = 250.0
    pieces, high, ratio = lay_ring(ring, wide)
    assert ratio >= 1.0
    low = 0.0
    for piece, drawn in zip(ring.pieces, pieces, strict=True):
        assert drawn.id == piece.id
        apart = np.linalg.norm(np.diff(piece.holes[:, :2], axis=0), axis=1)
        shown = np.linalg.norm(np.diff(drawn.holes, axis=0), axis=1)
        np.testing.assert_allclose(shown, apart * POINTS_MM / ratio)
        shape = shapely.Polygon(drawn.outline)
        area = piece.path.area * (POINTS_MM / ratio) ** 2
        assert shape.area == pytest.approx(area, rel=0.01)
        assert shapely.contains(shape, shapely.points(drawn.holes)).all()
        assert shape.contains(shapely.Point(drawn.middle))
        assert (shapely.distance(shape, shapely.points(drawn.numbers)) > 5.0).all()
        everything = np.concatenate((drawn.outline, drawn.numbers))
        assert everything[:, 0].min() > 0.0
        assert everything[:, 0].max() < wide
        assert everything[:, 1].max() < low
        low = everything[:, 1].min()
    assert -low < high
