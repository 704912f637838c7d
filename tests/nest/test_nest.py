import math
from contextlib import nullcontext

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar, fits_some_sheet
from strategies import at_most

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.nest.fits import fits_stock
from fabweave.nest.nesting import nest
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import FREE, parse_rotations
from fabweave.stock.sheet_size import SheetSize


def band(axis, width):
    """Return the outline of a band of constant width along a curve."""
    body = shapely.buffer(shapely.LineString(axis), width / 2, cap_style="flat", quad_segs=2)
    return shapely.get_coordinates(shapely.normalize(body.exterior))[:-1]


def test_result_does_not_depend_on_where_a_piece_was_drawn():
    rng = np.random.default_rng(3)
    pieces = [bar(length, 9.0) for length in rng.uniform(20, 90, 12)]
    drawn = [piece + rng.uniform(-1e3, 1e3, 2) for piece in pieces]
    stock = [SheetSize(120, 100)]
    one = nest(pieces, stock, margin_mm=3, gap_mm=1, effort="quick")
    other = nest(drawn, stock, margin_mm=3, gap_mm=1, effort="quick")
    for a, b, p, q in zip(one.placements, other.placements, pieces, drawn, strict=True):
        assert a.sheet == b.sheet
        np.testing.assert_allclose(a.apply(p), b.apply(q), atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("effort", ["quick", "normal", "best"])
def test_equal_rectangles_use_nearly_the_computed_number_of_sheets(effort):
    # Ten bars of 16 mm and nine gaps of 2 mm are 178 mm: exactly what the margin leaves.
    pieces = [bar(200.0, 16.0)] * 60
    layout = nest(pieces, [SheetSize(220, 198)], margin_mm=10, gap_mm=2, effort=effort)
    assert check_layout(layout, pieces) == []
    # A pitch is rounded up to pixels, so one bar in ten may be lost, at 2 mm two.
    lost = 2 if effort == "quick" else 1
    assert 6 <= len(layout.sheets) <= math.ceil(60 / (10 - lost))


@pytest.mark.slow
@at_most(60)
@given(
    st.floats(20, 300), st.floats(1, 60), st.floats(60, 250), st.floats(60, 250), st.integers(0, 2)
)
def test_fits_some_sheet_agrees_with_nest(length, width, sheet_width, sheet_height, effort):
    piece, stock = bar(length, width), [SheetSize(sheet_width, sheet_height)]
    name = ("quick", "normal", "best")[effort]
    if fits_some_sheet(piece, stock, 5):
        layout = nest([piece], stock, margin_mm=5, gap_mm=2, effort=name)
        assert check_layout(layout, [piece]) == []
    else:
        assert math.hypot(length, width) > min(sheet_width, sheet_height) - 10
        with pytest.raises(CannotMakeError, match=r"fits? on no sheet"):
            nest([piece], stock, margin_mm=5, gap_mm=2, effort=name)


def test_ring_takes_a_small_piece_into_its_opening():
    angle = np.linspace(0.15, 2 * math.pi - 0.15, 120)
    ring = band(70 * np.stack([np.cos(angle), np.sin(angle)], axis=1), 14.0)
    pieces = [ring, bar(70.0, 60.0)]
    # The sheet is hardly larger than the ring, so the opening is the only place left.
    layout = nest(pieces, [SheetSize(160, 160)], margin_mm=1, gap_mm=3, effort="quick")
    assert check_layout(layout, pieces) == []
    assert len(layout.sheets) == 1


def test_large_piece_takes_the_large_sheet_and_the_rest_fills_it_up():
    pieces = [bar(60.0, 10.0)] * 5 + [bar(180.0, 10.0)]
    stock = [SheetSize(80, 80), SheetSize(200, 100, 1)]
    layout = nest(pieces, stock, margin_mm=2, gap_mm=2, effort="quick")
    assert check_layout(layout, pieces) == []
    assert layout.sheets == (SheetSize(200, 100, 1),)
    small = nest(pieces[:5], stock, margin_mm=2, gap_mm=2, effort="quick")
    assert {sheet.width_mm for sheet in small.sheets} == {80}


def test_quantities_are_kept_and_sizes_follow_the_given_order():
    pieces = [bar(70.0, 30.0)] * 6
    stock = [SheetSize(80, 80, 2), SheetSize(90, 80)]
    layout = nest(pieces, stock, margin_mm=2, gap_mm=2, effort="quick")
    assert [sheet.width_mm for sheet in layout.sheets] == [80, 80, 90]


def test_seed_changes_the_order_and_nothing_else():
    rng = np.random.default_rng(1)
    pieces = [bar(*size) for size in rng.uniform([20, 5], [90, 20], (14, 2))]
    found = [
        nest(pieces, [SheetSize(150, 100)], margin_mm=2, gap_mm=1, effort="quick", seed=seed)
        for seed in (0, 1, 2, 0)
    ]
    assert all(check_layout(layout, pieces) == [] for layout in found)
    assert found[0] == found[3]
    assert found[0] != found[1] != found[2]
    assert nest([], [SheetSize(80, 80)], margin_mm=2, gap_mm=2).sheets == ()


@pytest.mark.parametrize(
    "outline",
    [
        np.empty((0, 2)),
        np.array([[0.0, 0.0], [9.0, 9.0], [9.0, 0.0], [0.0, 9.0]]),
        np.array([[0.0, 0.0], [9.0, float("nan")], [9.0, 0.0]]),
        np.zeros((3, 3)),
    ],
)
def test_bad_outline_is_refused_by_its_name(outline):
    with pytest.raises(InputError, match="1 of 2 outlines cannot be nested: B7"):
        nest([bar(5, 5), outline], [SheetSize(80, 80)], margin_mm=2, gap_mm=2, ids=["A1", "B7"])


@pytest.mark.parametrize(
    ("rotations", "fits"),
    [(FREE, [True, True, False]), (parse_rotations("90"), [True, False, False])],
)
def test_what_fits_the_stock_is_what_nesting_takes(rotations, fits):
    # 90 × 55 mm are free, 105.5 mm along the diagonal; beside the defect only 33 × 90 mm.
    knot = ((40.0, 0.0), (200.0, 0.0), (200.0, 100.0), (40.0, 100.0))
    stock = [SheetSize(100.0, 65.0), SheetSize(200.0, 100.0, defects=(knot,))]
    bars = [bar(length, 10.0) for length in (89.9, 90.1, 110.0)]
    rules = {"margin_mm": 5.0, "gap_mm": 2.0, "effort": "quick", "rotations": rotations}
    assert fits_stock(bars, stock, **rules).tolist() == fits
    for outline, fitting in zip(bars, fits, strict=True):
        with nullcontext() if fitting else pytest.raises(CannotMakeError, match="on no sheet"):
            nest([outline], stock, **rules)
