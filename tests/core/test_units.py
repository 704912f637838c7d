import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.core.units import format_length, parse_length


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
