"""What the strands above cover of a piece is what the projection method says."""

import numpy as np
import pytest
import shapely

import fabweave as fw
from fabweave.piece.piece import Piece

pytestmark = pytest.mark.usefixtures("quick_jobs")


def pieces_of(shape: str, **options: object) -> list[Piece]:
    return list(fw.weave(shape, size="200mm", force=True, **options).ribbons(width=0.5).pieces())


@pytest.mark.parametrize(
    "shape", ["shape:octahedron", "shape:torus?m=6&n=4", "shape:hypar?m=3&n=3"]
)
def test_there_is_one_cover_inside_the_piece_wherever_it_goes_under(shape):
    for piece in pieces_of(shape):
        covers = [shapely.Polygon(cover) for cover in piece.covers]
        assert len(covers) == np.count_nonzero(~piece.over)
        for cover, point in zip(covers, piece.points[~piece.over], strict=True):
            assert cover.is_valid
            assert cover.contains(shapely.Point(point))


def test_covers_are_the_middle_of_each_quad():
    # The quad of an edge has the edge as one diagonal and the way between the centres of its faces
    # as the other: in an octahedron with edges a, √2 a / 3. A strand of half the relative width
    # covers half of it each way.
    edge = 200.0 / np.sqrt(2.0)
    quad = edge * (np.sqrt(2.0) / 3.0 * edge) / 2.0
    pieces = pieces_of("shape:octahedron", course="projection", as_drawn="off")
    areas = [shapely.Polygon(cover).area for piece in pieces for cover in piece.covers]
    np.testing.assert_allclose(areas, 0.25 * quad, rtol=1e-6)
