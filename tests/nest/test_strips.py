"""Strips in rows: nothing is lost, nothing overlaps, and no row is longer than a sheet."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import CannotMakeError
from fabweave.nest.layout import Placement
from fabweave.nest.strips import fill_rows, nest_strips
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import parse_rotations
from fabweave.stock.sheet_size import SheetSize

LENGTHS = st.lists(st.floats(9.0, 400.0), min_size=1, max_size=40)


def strip(length, width=8.0, turn=0.0):
    corners = np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])
    return Placement(0, 0, turn, 3.0, -2.0).apply(corners)


@given(LENGTHS, st.floats(0.0, 4.0))
def test_each_length_is_in_one_row_that_it_fits(lengths, gap):
    rows = fill_rows(lengths, 400.0, gap)
    assert sorted(at for row in rows for at in row) == list(range(len(lengths)))
    for row in rows:
        assert sum(lengths[at] for at in row) + gap * (len(row) - 1) <= 400.0 + 1e-6
    bound = math.ceil(sum(length + gap for length in lengths) / (400.0 + gap) - 1e-9)
    assert bound <= len(rows)
    # Of two rows, all of one and the longest of the other have no room in one.
    heads = [lengths[row[0]] for row in rows]
    assert heads == sorted(heads, reverse=True)


@given(st.lists(st.lists(st.integers(40, 300), min_size=1, max_size=3), min_size=1, max_size=6))
def test_what_fills_rows_to_the_end_takes_no_more_rows(parts):
    """Each row is parted in two or three at will, the rest of it too: so many rows are enough."""
    lengths = [float(one) for row in parts for one in (*row, 1000 - sum(row)) if one > 0]
    assert len(fill_rows(lengths, 1000.0)) <= len(parts) + 1


@given(LENGTHS, st.sampled_from([0.0, 0.15, 2.0]), st.floats(0.0, 360.0))
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


def test_others_than_strips_of_one_width_are_left_to_nesting():
    how = {"margin_mm": 5.0, "gap_mm": 0.0, "ids": ["A", "B"]}
    sheets = [SheetSize(500.0, 300.0)]
    bent = strip(90.0)
    bent[2] += 1.0
    assert nest_strips([strip(90.0), bent], sheets, **how) is None
    assert nest_strips([strip(90.0), strip(90.0, 9.0)], sheets, **how) is None
    hole = ((1.0, 1.0), (2.0, 1.0), (2.0, 2.0))
    assert nest_strips([strip(90.0)] * 2, [SheetSize(500.0, 300.0, defects=(hole,))], **how) is None


def test_offcuts_go_first_and_what_runs_out_is_told():
    how = {"margin_mm": 0.0, "gap_mm": 0.0}
    offcut, sheet = SheetSize(100.0, 8.0, 1, offcut=True), SheetSize(200.0, 16.0, 1)
    layout = nest_strips([strip(90.0)] * 5, [sheet, offcut], ids=list("ABCDE"), **how)
    assert [one.width_mm for one in layout.sheets] == [100.0, 200.0]
    with pytest.raises(CannotMakeError):
        nest_strips([strip(90.0)] * 6, [sheet, offcut], ids=list("ABCDEF"), **how)
