from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import bar

from fabweave.nest.layout import Layout, Placement
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.sheet_size import SheetSize

SQUARE = bar(10.0, 10.0)
ANGLE = np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 5.0], [5.0, 5.0], [5.0, 30.0], [0.0, 30.0]])
PIECES = [SQUARE, SQUARE, ANGLE]
GOOD = Layout(
    sheets=(SheetSize(100, 60), SheetSize(50, 50)),
    placements=(
        Placement(0, 0, 0.0, 5.0, 5.0),
        Placement(1, 0, 90.0, 27.0, 5.0),
        Placement(2, 1, 0.0, 5.0, 5.0),
    ),
    margin_mm=5.0,
    gap_mm=2.0,
)


def spoiled(number, **changes):
    placements = list(GOOD.placements)
    placements[number] = replace(placements[number], **changes)
    return replace(GOOD, placements=tuple(placements))


@pytest.mark.parametrize(
    ("layout", "fault"),
    [
        (spoiled(1, x_mm=26.9), "pieces A and B on sheet 1 are 1.900 mm apart; the gap is 2.000"),
        (spoiled(1, x_mm=22.0), "pieces A and B on sheet 1 overlap by 30.000 mm²"),
        (spoiled(0, x_mm=4.999), "piece A is 4.999 mm from the border of sheet 1"),
        (spoiled(2, x_mm=15.001), "piece C is 4.999 mm from the border of sheet 2"),
        (spoiled(2, x_mm=55.0), "piece C reaches over the border of sheet 2"),
        (spoiled(1, piece=0), "piece A is placed 2 times"),
        (spoiled(1, piece=0), "piece B is placed 0 times"),
        (replace(GOOD, placements=GOOD.placements[:2]), "piece C is placed 0 times"),
        (replace(GOOD, gap_mm=2.1), "the gap is 2.100 mm"),
        (replace(GOOD, margin_mm=5.1), "the margin is 5.100 mm"),
    ],
)
def test_spoiled_layout_is_named(layout, fault):
    assert check_layout(GOOD, PIECES) == []  # although it uses gap and margin up
    assert any(fault in said for said in check_layout(layout, PIECES, ids=["A", "B", "C"]))


def test_piece_in_the_notch_of_another_is_no_overlap():
    layout = replace(
        GOOD,
        placements=(*GOOD.placements[:1], Placement(1, 1, 0.0, 12.0, 12.0), GOOD.placements[2]),
    )
    assert check_layout(layout, PIECES) == []


@given(st.floats(0, 40), st.floats(0, 40), st.floats(0, 5))
def test_two_squares_are_judged_by_their_distance(x, y, gap):
    apart = float(np.hypot(max(x - 10, 0), max(y - 10, 0)))
    layout = Layout(
        (SheetSize(99, 99),),
        (Placement(0, 0, 0.0, 1.0, 1.0), Placement(1, 0, 0.0, 1.0 + x, 1.0 + y)),
        1.0,
        gap,
    )
    overlap = max(10 - x, 0) * max(10 - y, 0)
    faults = check_layout(layout, [SQUARE, SQUARE])
    if overlap > 1e-5 or apart < gap - 1e-5:
        assert len(faults) == 1
    elif overlap == 0 and apart > gap + 1e-5:
        assert faults == []
