"""Which sheets are taken, what is left of the last one, and what is said when stock runs out."""

import itertools

import numpy as np
import pytest
import shapely
from sheet_fit import bar

from fabweave.core.errors import CannotMakeError
from fabweave.nest.container import Container, clear_rectangle
from fabweave.nest.layout import Layout, Placement
from fabweave.nest.nesting import nest
from fabweave.nest.offcut import KEPT_SIDE_MM, offcut_of, usable_offcuts
from fabweave.nest.place.raster import largest_rectangle
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.sheet_size import SheetSize


def nested(pieces, stock, **options):
    layout = nest(pieces, stock, margin_mm=5, gap_mm=2, effort="quick", **options)
    assert check_layout(layout, pieces) == []
    return layout


def names(layout):
    return [sheet.name for sheet in layout.sheets]


def test_offcuts_are_used_first_then_what_costs_least_for_its_area():
    dear = SheetSize(200, 100, name="dear", price=9.0)
    fair = SheetSize(200, 100, 1, name="fair", price=2.0)
    rest = SheetSize(120, 60, 1, name="rest", offcut=True)
    layout = nested([bar(90, 20)] * 12, [dear, fair, rest])
    assert names(layout) == ["rest", "fair", "dear"]


def test_the_last_sheet_is_exchanged_for_the_cheapest_that_takes_its_pieces():
    large = SheetSize(400, 300, name="large", price=10.0)
    small = SheetSize(150, 80, name="small", price=2.0)
    tiny = SheetSize(60, 60, name="tiny", price=0.9)
    # For its area the large one is cheaper; for two bars the small one will do.
    assert names(nested([bar(100, 20)] * 2, [large, small, tiny])) == ["small"]
    assert names(nested([bar(100, 20)] * 50, [large, small, tiny]))[0] == "large"
    gone = SheetSize(150, 80, 1, name="small", price=2.0)
    pieces = [bar(300, 200), bar(100, 20), bar(100, 20)]
    assert sorted(names(nested(pieces, [large, gone]))) == ["large"]


def test_stock_that_runs_out_says_how_many_of_which():
    small, large = SheetSize(80, 80, 2, name="small"), SheetSize(120, 120, 1, name="large")
    with pytest.raises(CannotMakeError) as stop:
        nested([bar(110, 100)] * 3 + [bar(70, 60)] * 5, [small, large])
    told = str(stop.value)
    assert "2 more of large (120x120mm)" in told
    assert "3 more of small (80x80mm)" in told
    # So many more are enough, and one less is not.
    enough = [SheetSize(80, 80, 5), SheetSize(120, 120, 3)]
    pieces = [bar(110, 100)] * 3 + [bar(70, 60)] * 5
    assert len(nested(pieces, enough).sheets) == 8
    for scarce in ([SheetSize(80, 80, 4), enough[1]], [enough[0], SheetSize(120, 120, 2)]):
        with pytest.raises(CannotMakeError, match="run out"):
            nested(pieces, scarce)


def brute(size, barred, step=10):
    """Return the area of the largest rectangle on a grid that has nothing barred inside."""
    best = 0.0
    xs, ys = (range(0, int(side) + 1, step) for side in size)
    for x0, x1 in itertools.combinations(xs, 2):
        for y0, y1 in itertools.combinations(ys, 2):
            if shapely.box(x0, y0, x1, y1).intersection(barred).area < 1e-9:
                best = max(best, float((x1 - x0) * (y1 - y0)))
    return best


@pytest.mark.parametrize("seed", range(6))
def test_the_largest_rectangle_is_free_and_as_large_as_any_on_a_grid(seed):
    rng = np.random.default_rng(seed)
    size = (100.0, 70.0)
    corners = 10.0 * rng.integers(0, [10, 7], (4, 2))
    barred = shapely.union_all([shapely.box(x, y, x + 10, y + 10) for x, y in corners])
    (x0, y0), (x1, y1) = largest_rectangle(size, barred).tolist()
    assert shapely.box(x0, y0, x1, y1).intersection(barred).area < 1e-6
    assert (x1 - x0) * (y1 - y0) >= brute(size, barred) - 1e-6
    assert largest_rectangle(size, shapely.box(-1, -1, 101, 71)) is None


def test_what_fits_the_clear_rectangle_can_be_nested_there():
    knot = ((90.0, 60.0), (110.0, 60.0), (110.0, 80.0), (90.0, 80.0))
    sheet = SheetSize(220, 160, defects=(knot,))
    area = Container((210.0, 150.0), shapely.box(85.0, 55.0, 105.0, 75.0))
    wide, high = clear_rectangle(area, 2.0)
    assert wide > 80.0
    assert nested([bar(wide, high)], [sheet]).placements


@pytest.mark.parametrize("seed", range(8))
def test_an_offcut_keeps_off_pieces_and_within_its_sheet(seed):
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 6.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    placed = [bar(90, 14) @ turn.T + rng.uniform([80, 60], [300, 200]) for _ in range(4)]
    outline = ((0.0, 0.0), (400.0, 0.0), (400.0, 200.0), (300.0, 260.0), (0.0, 300.0))
    knot = ((200.0, 100.0), (230.0, 100.0), (215.0, 120.0))
    sheet = SheetSize(400, 300, outline=outline if seed % 2 else (), defects=(knot,))
    rest = offcut_of(sheet, 0, placed, 2.0)
    body = shapely.Polygon(rest.outline, rest.holes)
    assert body.is_valid
    assert shapely.Polygon(sheet.ring).buffer(1e-6).covers(body)
    for piece in placed:
        assert body.distance(shapely.Polygon(piece)) >= 2.0
    assert not body.intersects(shapely.Polygon(knot))
    rectangle = shapely.box(*rest.rectangle.ravel())
    assert body.buffer(1e-6).covers(rectangle)
    for ring in (rest.outline, *rest.holes):
        assert np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).min() >= 0.1
    # It misses little of what is free: what is farther than its roundings and arms from anything.
    free = shapely.Polygon(sheet.ring).difference(
        shapely.union_all([shapely.Polygon(piece) for piece in (*placed, knot)]).buffer(9.0)
    )
    largest = max(shapely.get_parts(free.buffer(-8.0)), key=lambda part: part.area)
    assert body.covers(largest.buffer(-1.0))
    # Seen from the back it is the same one.
    back = rest.mirrored(400.0)
    assert back.area_mm2 == pytest.approx(rest.area_mm2)
    assert back.mirrored(400.0).outline == pytest.approx(rest.outline)


def test_every_sheet_with_a_rest_worth_keeping_has_an_offcut():
    sheets = (SheetSize(300.0, 200.0),) * 3
    pieces = [bar(280, 30), bar(280, 180), bar(280, 20)]
    placements = tuple(Placement(at, at, 0.0, 10.0, 10.0) for at in range(3))
    found = usable_offcuts(Layout(sheets, placements, 10.0, 2.0), pieces)
    assert [(one.sheet, one.name) for one in found] == [(0, "offcut_01"), (2, "offcut_02")]
    for one, free in zip(found, (160.0, 170.0), strict=True):
        # What lies above a bar is free but for the gap and less than a millimetre.
        wide, high = one.rectangle_mm
        assert wide == 300.0
        assert free - 3.0 < high <= free - 2.0
        assert min(one.rectangle_mm) >= KEPT_SIDE_MM
    full = Layout(sheets[1:2], (Placement(0, 0, 0.0, 10.0, 10.0),), 10.0, 2.0)
    assert usable_offcuts(full, pieces[1:2]) == ()
    assert usable_offcuts(Layout((), (), 10.0, 2.0), []) == ()


def test_the_last_sheet_is_packed_to_one_side(piece_sets):
    pieces = [0.4 * piece for piece in piece_sets["measured_set"](14, seed=6)]
    layout = nested(pieces, [SheetSize(400, 300)])
    assert len(layout.sheets) == 1
    placed = [p.apply(pieces[p.piece]) for p in layout.placements]
    rest = offcut_of(layout.sheets[0], 0, placed, 2.0)
    # A rectangle over the whole height, right of all pieces, or more.
    right = max(float(points[:, 0].max()) for points in placed)
    assert np.prod(rest.rectangle_mm) >= 0.9 * (400.0 - right - 3.0) * 300.0


def test_beyond_quick_effort_the_rest_of_the_last_sheet_is_no_smaller(piece_sets):
    pieces = [0.35 * piece for piece in piece_sets["measured_set"](9, seed=4)]
    rests = []
    for effort in ("quick", "normal"):
        layout = nest(pieces, [SheetSize(250, 180)], margin_mm=5, gap_mm=2, effort=effort)
        assert check_layout(layout, pieces) == []
        assert len(layout.sheets) == 1
        placed = [p.apply(pieces[p.piece]) for p in layout.placements]
        rests.append(np.prod(offcut_of(layout.sheets[0], 0, placed, 2.0).rectangle_mm))
    assert rests[1] >= rests[0]
