"""The verifier's own reader of QR codes reads what a library makes, and misses no wrong dot."""

import numpy as np
import pytest
import segno
from hypothesis import given, settings
from hypothesis import strategies as st

from fabweave.verify.drawing import ReadError
from fabweave.verify.read.qr_code import read_code


def dots_of(text, **options):
    options = {"error": "l", "mode": "byte", "boost_error": False, "micro": False} | options
    return np.array([list(row) for row in segno.make(text, **options).matrix], dtype=bool)


@given(st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=1, max_size=230))
@settings(max_examples=60)
def test_it_reads_what_was_made(text) -> None:
    assert read_code(dots_of(text)) == text


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cs"]), min_size=1, max_size=50))
@settings(max_examples=30)
def test_it_reads_other_alphabets(text) -> None:
    assert read_code(dots_of(text, encoding="utf-8", eci=True)) == text


@pytest.mark.parametrize("mask", range(8))
@pytest.mark.parametrize("length", [17, 32, 53, 78, 106, 134, 154, 192, 230])
def test_it_reads_every_version_and_mask(length, mask) -> None:
    text = "".join(chr(33 + 7 * k * k % 90) for k in range(length))
    assert read_code(dots_of(text, mask=mask)) == text


# Versions 2 to 6 have seven dots that mean nothing, 1 and 7 to 9 none.
@pytest.mark.slow
@pytest.mark.parametrize("length", [17, 150])
def test_no_wrong_dot_is_missed(length) -> None:
    dots = dots_of("x" * length)
    for at in np.ndindex(*dots.shape):
        spoilt = dots.copy()
        spoilt[at] = not dots[at]
        with pytest.raises(ReadError):
            read_code(spoilt)


@pytest.mark.parametrize(
    ("dots", "words"),
    [
        (np.zeros((0, 0), dtype=bool), "no code"),
        (np.zeros((22, 22), dtype=bool), "no code"),
        (np.zeros((21, 25), dtype=bool), "no code"),
        (dots_of("x" * 300), "no code"),
        (dots_of("x", error="h"), "level L"),
        (dots_of("123", mode="numeric"), "bytes"),
        (dots_of("ü", encoding="latin-1"), "no text"),
        (dots_of("ü", encoding="latin-1", eci=True), "alphabet"),
        (dots_of("x")[:, ::-1], "patterns"),
    ],
)
def test_other_codes_are_refused(dots, words) -> None:
    with pytest.raises(ReadError, match=words):
        read_code(dots)
