from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.sheet.targets import target_named
from fabweave.stock.sheet_size import (
    SheetSize,
    check_stock,
    format_stock,
    parse_roll,
    parse_stock,
)


@pytest.mark.parametrize(
    ("text", "sheet"),
    [
        ("600X400", SheetSize(600, 400)),
        ("600 × 400 mm : 3", SheetSize(600, 400, 3)),
        ("600x400*2", SheetSize(600, 400, 2)),
        ("60x40cm", SheetSize(600, 400)),
        ("60cmx400mm", SheetSize(600, 400)),
        ('10"x20":1', SheetSize(254, 508, 1)),
        ("1.5x.5m", SheetSize(1500, 500)),
    ],
)
def test_known_stock(text, sheet):
    assert parse_stock(text) == sheet


@given(st.integers(1, 10**6), st.integers(1, 10**6), st.none() | st.integers(1, 99))
def test_format_is_read_back(width, height, quantity):
    sheet = SheetSize(width / 100, height / 100, quantity)
    assert parse_stock(format_stock(sheet)) == sheet


@pytest.mark.parametrize(
    "text",
    ["", "600", "600x", "600x400x3", "600x400:0", "600x400:", "0x400", "600x400m", "600x400mm:1.5"],
)
def test_what_is_no_stock_is_refused(text):
    with pytest.raises(InputError):
        parse_stock(text)


@given(st.integers(1, 29_999), st.integers(30_000, 5 * 10**7), st.none() | st.integers(1, 99))
def test_a_roll_is_read_back(width, length, quantity):
    text = f"roll:{width / 100}mm:{length / 100}mm" + f":{quantity}" * (quantity is not None)
    roll = parse_roll(text)
    assert (roll.height_mm, roll.width_mm, roll.quantity) == (width / 100, length / 100, quantity)
    assert roll.is_roll
    assert roll.plain
    assert parse_roll(format_stock(roll)) == roll
    check_stock([roll], 0.0)


@pytest.mark.parametrize(
    "text",
    [
        "roll:", "roll:12mm", "roll:12mm:", "roll::5m", "roll:0mm:5m", "roll:12mm:5m:0",
        "roll:12mm:5m:1.5", "roll:12mm:5m:1:1", "roll:12mm:501m", "roll:301mm:50m", "roll:5m:12mm",
        "roll:12mm:-5m", "roll:12mm:1e400m", "roll:nanmm:5m", "roll:12x5m",
    ],
)  # fmt: skip
def test_what_is_no_roll_is_refused(text):
    with pytest.raises(InputError):
        parse_roll(text)


@pytest.mark.parametrize(
    "sheets",
    [[], [SheetSize(0, 5)], [SheetSize(5, float("nan"))], [SheetSize(50, 50, 0)]],
)
def test_impossible_stock_is_refused(sheets):
    with pytest.raises(InputError):
        check_stock(sheets, 1)


@pytest.mark.parametrize("name", ["mat-12x12", "mat-12x24"])
def test_a_mat_is_a_sheet_within_its_inches_that_its_target_takes(name):
    sheet = parse_stock(name)
    assert parse_stock(f"warp={name.upper()} :2") == replace(sheet, quantity=2, bunch="warp")
    inches = [float(side) for side in name.removeprefix("mat-").split("x")]
    # Half an inch is left, and no more than an inch.
    for side, inch in zip((sheet.width_mm, sheet.height_mm), inches, strict=True):
        assert 25.4 * (inch - 1.0) < side <= 25.4 * (inch - 0.5)
    target = target_named(name)
    assert sorted(target.sheet_mm) == sorted((sheet.width_mm, sheet.height_mm))
    assert target.hole_mm == 6.0
