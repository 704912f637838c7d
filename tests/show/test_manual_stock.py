"""Sheets of irregular stock are drawn in the manual as they are."""

import numpy as np
import pytest
import shapely
from crossing_maps import points, sheet_record

from fabweave.plan.crossing_map import RestRecord
from fabweave.show.manual.sheets import draw_stock

EL = [[0.0, 0.0], [260.0, 0.0], [260.0, 70.0], [110.0, 90.0], [80.0, 180.0], [0.0, 180.0]]
KNOT = [[150.0, 20.0], [190.0, 20.0], [190.0, 50.0], [150.0, 50.0]]
REST = [[0.0, 100.0], [70.0, 100.0], [70.0, 180.0], [0.0, 180.0]]
SHEET = sheet_record(
    stock="left of the vase",
    offcut=True,
    outline=points(EL),
    defects=(points(KNOT),),
    rest=RestRecord(name="offcut_02", outline=points(REST)),
)
MARGIN = 6.0


class Recorder:
    """Keeps what is drawn instead of drawing it."""

    def __init__(self):
        self.drawn = []

    def line(self, points, *, width=0.5, closed=False, dash=(), **_):
        run = np.asarray(points)
        self.drawn.append((np.vstack((run, run[:1])) if closed else run, width, dash))

    def of(self, width):
        return shapely.union_all(
            [shapely.linestrings(run) for run, w, _ in self.drawn if w == width]
        )


def test_edge_margin_defects_and_rest_are_drawn_where_they_are():
    book = Recorder()
    scale, shift = 2.0, np.array([30.0, 40.0])
    draw_stock(book, SHEET, MARGIN, lambda points: points * scale + shift)
    book.drawn = [((run - shift) / scale, *how) for run, *how in book.drawn]
    whole = shapely.Polygon(EL)
    edge = shapely.polygonize([book.of(1.0)]).geoms
    assert shapely.union_all(edge).symmetric_difference(whole).area < 1e-6
    # The margin is dotted at its distance from the edge, all along it.
    dotted = [run for run, _, dash in book.drawn if dash == (1.0, 2.0)]
    for dots in dotted:
        places = shapely.points(dots)
        away = shapely.distance(places, whole.exterior)
        assert np.all(shapely.covers(whole, places))
        assert away == pytest.approx(MARGIN)
    drawn = shapely.union_all([shapely.linestrings(run) for run in dotted])
    wanted = whole.buffer(-MARGIN, quad_segs=64).exterior
    assert drawn.length == pytest.approx(wanted.length, rel=1e-3)
    # Hatching fills the defect: no place in it is farther than its step from a line.
    lines, knot = book.of(0.3), shapely.Polygon(KNOT)
    assert knot.buffer(1e-6).covers(lines)
    assert lines.buffer(2.9).covers(knot)
    rest = [run for run, _, dash in book.drawn if dash == (6.0, 3.0)]
    assert shapely.LineString(rest[0]).equals(shapely.Polygon(REST).exterior)
