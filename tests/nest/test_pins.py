"""Pieces that are pinned stay where they are put, and the others keep clear of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.nest.nesting import nest
from fabweave.nest.pins import Pin, nest_around, parse_pins
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.sheet_size import SheetSize

BAR = np.array([[0.0, 0.0], [120.0, 0.0], [120.0, 15.0], [0.0, 15.0]])
IDS = [f"A{number}" for number in range(1, 17)]
HOW = {"margin_mm": 5.0, "gap_mm": 2.0, "effort": "quick"}
SHEETS = (SheetSize(200.0, 150.0),)


@given(
    st.floats(30.0, 60.0), st.floats(40.0, 100.0), st.floats(-30.0, 30.0), st.integers(0, 1),
    st.sampled_from(IDS),
)  # fmt: skip
def test_the_rest_is_nested_around_what_is_pinned(x, y, turn, sheet, name):
    pin = Pin(name, sheet, x, y, turn)
    outlines = [BAR] * len(IDS)
    layout = nest_around([pin], outlines, SHEETS, ids=IDS, **HOW)
    place = layout.placements[IDS.index(name)]
    assert (place.x_mm, place.y_mm, place.rotation_deg) == (x, y, turn)
    assert place.sheet == sheet
    assert [one.piece for one in layout.placements] == list(range(len(IDS)))
    assert {sheet.name for sheet in layout.sheets} == {""}
    assert not any(sheet.defects or sheet.offcut for sheet in layout.sheets)
    faults = check_layout(layout, outlines, ids=IDS)
    # Only the pin itself may stand too near to the border.
    assert all(f"piece {name} " in fault and "border" in fault for fault in faults)


def test_without_pins_and_with_those_of_others_nothing_changes():
    outlines = [BAR] * len(IDS)
    plain = nest(outlines, SHEETS, ids=IDS, **HOW)
    for pins in ((), (Pin("B1", 0, 50.0, 50.0, 0.0),)):
        assert nest_around(pins, outlines, SHEETS, ids=IDS, **HOW) == plain


def test_sheets_are_counted_through_and_those_that_are_not_there_are_refused():
    outlines, pin = [BAR] * len(IDS), Pin("A1", 2, 40.0, 50.0, 0.0)
    assert len(nest(outlines, SHEETS, ids=IDS, **HOW).sheets) == 2
    for before, sheet in ((1, 1), (2, 0)):
        layout = nest_around([pin], outlines, SHEETS, ids=IDS, before=before, **HOW)
        assert layout.placements[0].sheet == sheet
    for before in (0, 3):
        with pytest.raises(InputError, match="A1"):
            nest_around([pin], outlines, SHEETS, ids=IDS, before=before, **HOW)


@pytest.mark.parametrize(
    "text",
    ["", "A1", "A1@0:1,2,3", "A1@1:1,2", "A1@1:1,2,x", "A1@1:1,2,3/A1@1:4,5,6", "/", "A1@1:1,2,3/"],
)
def test_what_pins_nothing_is_refused(text):
    with pytest.raises(InputError):
        parse_pins(text)
