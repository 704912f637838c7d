"""Strips in rows: one-dimensional cutting stock, on sheets and on rolls."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar

from fabweave.core.errors import CannotMakeError
from fabweave.nest.layout import Placement
from fabweave.nest.strips import fill_rows, nest_strips
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import SheetSize, parse_roll

#: What lengths are rounded up by, each.
STEP_MM = 0.05
LENGTHS = st.lists(st.floats(1.0, 100.0), min_size=1, max_size=40)


@given(LENGTHS, st.floats(100.0, 300.0), st.sampled_from([0.0, 0.2, 3.0]))
def test_rows_hold_each_length_once_and_no_more_than_they_can(lengths, row, gap):
    rows = fill_rows(lengths, row, gap)
    assert sorted(at for one in rows for at in one) == list(range(len(lengths)))
    for one in rows:
        assert sum(lengths[at] for at in one) + gap * (len(one) - 1) <= row + 1e-6
        assert one == sorted(one, key=lambda at: -lengths[at])
    assert len(rows) >= math.ceil(sum(length + gap for length in lengths) / (row + gap) - 1e-9)
    # Of two rows, the second would not have gone into the first: none is half empty twice.
    used = sorted(sum(lengths[at] + gap + STEP_MM for at in one) for one in rows)
    assert len(rows) < 2 or used[0] + used[1] > row + gap


def fewest(lengths, row):
    """Return how few rows could do, of all dealings."""
    return min(
        len(set(dealing))
        for dealing in product(range(len(lengths)), repeat=len(lengths))
        if all(
            sum(length for length, at in zip(lengths, dealing, strict=True) if at == one) <= row
            for one in set(dealing)
        )
    )


@given(st.lists(st.integers(1, 10), min_size=1, max_size=5))
def test_a_few_lengths_take_as_few_rows_as_any_dealing_has(lengths):
    assert len(fill_rows([float(one) for one in lengths], 10.0)) == fewest(lengths, 10)


ROLL = st.builds(
    lambda length, quantity: parse_roll(f"roll:9mm:{length}mm{quantity}"),
    st.integers(100, 400),
    st.sampled_from(["", ":50"]),
)


@given(st.lists(st.floats(10.0, 100.0), min_size=1, max_size=30), ROLL)
def test_a_roll_has_one_row_that_begins_at_its_end(lengths, roll):
    outlines = [bar(length, 9.0) for length in lengths]
    layout = nest_strips(outlines, [roll], margin_mm=0.0, gap_mm=0.0)
    assert check_layout(layout, outlines) == []
    for number, sheet in enumerate(layout.sheets):
        own = [at for at, place in enumerate(layout.placements) if place.sheet == number]
        used = sum(lengths[at] for at in own)
        assert (sheet.roll_mm, sheet.height_mm) == (roll.width_mm, 9.0)
        assert used - 1e-6 <= sheet.width_mm <= min(used + 0.01, roll.width_mm) + 1e-6
        placed = np.concatenate([layout.placements[at].apply(outlines[at]) for at in own])
        assert placed[:, 0].min() == pytest.approx(0.0, abs=1e-9)
        assert np.ptp(placed[:, 0]) == pytest.approx(used)


@pytest.mark.parametrize("stock", [["roll:9mm:70mm"], ["roll:9mm:90mm:1"]])
def test_what_rolls_do_not_hold_is_refused(stock):
    rolls = [parse_roll(text) for text in stock]
    with pytest.raises(CannotMakeError):
        nest_strips([bar(80.0, 9.0)] * 2, rolls, margin_mm=0.0, gap_mm=0.0)


def strip(length, width=8.0, turn=0.0):
    corners = np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])
    return Placement(0, 0, turn, 3.0, -2.0).apply(corners)


@given(
    st.lists(st.floats(9.0, 400.0), min_size=1, max_size=40),
    st.sampled_from([0.0, 0.15, 2.0]),
    st.floats(0.0, 360.0),
)
def test_strips_keep_margin_and_gap_at_allowed_angles(lengths, gap, turn):
    names = [str(at) for at in range(len(lengths))]
    for size, rule, own in (((430.0, 90.0), "free", turn), ((90.0, 430.0), "grain:5deg", 0.0)):
        outlines = [strip(length, turn=own * at) for at, length in enumerate(lengths)]
        grained = SheetSize(*size, grain_deg=90.0)
        layout = nest_strips(
            outlines, [grained], margin_mm=10.0, gap_mm=gap, ids=names,
            rotations=parse_rotations(rule),
        )  # fmt: skip
        assert layout is not None
        assert check_layout(layout, outlines) == []
