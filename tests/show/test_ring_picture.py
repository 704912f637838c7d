"""A ring in the manual is drawn flat in one scale, with a number beyond its border at each hole."""

import numpy as np
import pytest
import shapely
from rims import ring_of

from fabweave.show.manual.steps import lay_ring

POINTS_MM = 72 / 25.4


@pytest.mark.parametrize("tall", [np.inf, 600.0])
@pytest.mark.parametrize(("radius", "count"), [(60.0, 2), (20.0, 2), (200.0, 5)])
def test_pieces_of_a_ring_are_similar_to_what_is_cut_and_keep_apart(radius, count, tall):
    ring = ring_of(
        (radius, 0.0), (radius + 8.0, -3.0), 12, hole_mm=np.full(12, 2.0), edge_mm=4.0,
        double=True, fits=lambda pieces: len(pieces) >= count,
    )  # fmt: skip
    wide = 250.0
    pieces, high, ratio = lay_ring(ring, wide, tall)
    assert ratio >= 1.0
    assert high <= tall
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
