"""Read lengths that people type, and write them back."""

import math
import re

from fabweave.core.errors import InputError
from fabweave.core.messages import shown

_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_FRACTION = r"(?:(?P<whole>\d+)[\s-]+)?(?P<part>\d+)/(?P<of>[1-9]\d*)"
_LENGTH = re.compile(rf"\s*(?:{_FRACTION}|(?P<number>{_NUMBER}))\s*(?P<unit>[^\d\s./+-]*)\s*")


def unit_mm(unit: str) -> float:
    """Return how many millimetres a unit is long; no unit means millimetres.

    Parameters
    ----------
    unit : str
        ``mm``, ``cm``, ``m``, ``um``, ``in`` (also ``"``), ``ft`` (also ``'``), or nothing.

    Returns
    -------
    float
        Millimetres in one unit.

    Raises
    ------
    InputError
        If there is no such unit.

    Examples
    --------
    >>> unit_mm("in"), unit_mm("")
    (25.4, 1.0)
    """
    # Written out where it is used: a table at module level would be shared mutable state.
    known = {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "µm": 0.001}
    known |= dict.fromkeys(("in", "inch", '"', "″"), 25.4) | dict.fromkeys(("ft", "'", "′"), 304.8)
    factor = known.get(unit.strip().lower())
    if factor is None:
        raise InputError(f"unknown unit {unit.strip()!r}: use mm, cm, m, um, in (or \"), ft (or ')")
    return factor


def parse_length(text: str, *, what: str = "length", zero_ok: bool = False) -> float:
    """Return a length that a person typed, in millimetres.

    Parameters
    ----------
    text : str
        A number and a unit, such as ``"40cm"`` or ``"5 1/2in"``; a bare number is in millimetres.
    what : str
        What the length is, for the message.
    zero_ok : bool
        Whether zero is a length here (a kerf may be zero, a width may not).

    Returns
    -------
    float
        Millimetres, finite and positive (or zero, where that is allowed).

    Raises
    ------
    InputError
        If the text is no number with a known unit, or the length is out of range.

    Examples
    --------
    >>> parse_length("40cm"), parse_length("2.5"), parse_length('24"'), parse_length("5 1/2in")
    (400.0, 2.5, 609.5999999999999, 139.7)
    >>> parse_length("two")
    Traceback (most recent call last):
        ...
    fabweave.core.errors.InputError: length 'two' is not a number with a unit, such as 40cm or 2.5mm
    """
    match = _LENGTH.fullmatch(text)
    if match is None:
        hint = "; write the decimals after a point" if re.search(r"\d,\d", text) else ""
        raise InputError(
            f"{what} {shown(text)} is not a number with a unit, such as 40cm or 2.5mm{hint}"
        )
    if match["part"] is None:
        number = float(match["number"])
    else:
        number = int(match["whole"] or 0) + int(match["part"]) / int(match["of"])
    value = number * unit_mm(match["unit"])
    if not math.isfinite(value):
        raise InputError(f"{what} {shown(text)} is too large to be a length")
    if value < 0.0 or (value == 0.0 and not zero_ok):
        raise InputError(
            f"{what} {shown(text)} must be {'zero or more' if zero_ok else 'positive'}"
        )
    return value


def format_length(value_mm: float) -> str:
    """Return a length in millimetres as people write it, with a micrometre's resolution.

    Examples
    --------
    >>> format_length(600.0), format_length(609.6)
    ('600mm', '609.6mm')
    """
    return f"{round(value_mm, 3):.10g}mm"
