import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.core.units import format_length, parse_length

UNITS = {"": 1, "mm": 1, "cm": 10, "m": 1000, "in": 25.4, '"': 25.4, "ft": 304.8, "'": 304.8}


@given(st.floats(1e-3, 1e6), st.sampled_from(sorted(UNITS)), st.sampled_from(["", " "]))
def test_number_times_unit(value, unit, space):
    assert parse_length(f"{value!r}{space}{unit}") == pytest.approx(value * UNITS[unit])


@given(st.integers(1, 10**7))
def test_format_is_read_back_exactly(micrometres):
    value = micrometres / 1000
    assert parse_length(format_length(value)) == value


@given(st.text(max_size=12))
def test_any_text_is_a_positive_length_or_an_input_error(text):
    try:
        value = parse_length(text)
    except InputError:
        return
    assert math.isfinite(value)
    assert value > 0


@pytest.mark.parametrize(
    "text",
    ["", "mm", "-3mm", "0", "nan", "inf", "1e999", "2,5mm", "3 furlongs", "3mm 4mm", "0x10"],
)
def test_what_is_no_length_is_refused(text):
    with pytest.raises(InputError):
        parse_length(text)


def test_zero_only_where_it_is_allowed():
    assert parse_length("0mm", zero_ok=True) == 0
    with pytest.raises(InputError, match="kerf '0' must be positive"):
        parse_length("0", what="kerf")


def test_decimal_comma_gets_a_hint():
    with pytest.raises(InputError, match="decimals after a point"):
        parse_length("2,5mm")
