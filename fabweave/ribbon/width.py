"""Decide how wide ribbons are: by the room they have, in millimetres, or between bounds."""

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length

#: No machine cuts narrower ribbons, and no sheet is wider, in millimetres.
_THINNEST_MM, _WIDEST_MM = 0.001, 20_000.0
_RELATIVE = re.compile(r"\d*\.?\d+", re.ASCII)


@dataclass(frozen=True)
class WidthRule:
    """How wide a ribbon is at each cross-line.

    Parameters
    ----------
    relative : float
        Share of the room between the neighbours' portals that the ribbon takes, in (0, 1).
    least_mm, most_mm : float
        Bounds in millimetres; equal ones make the width constant. Where there is no room for the
        least width, the ribbon is as wide as the room allows.
    auto : bool
        Whether ribbons may be narrowed where they would be too near to others.

    Examples
    --------
    >>> rule = WidthRule(0.5, 6.0, 14.0)
    >>> rule.shares(np.array([10.0, 20.0, 40.0]), most=0.7).tolist()
    [0.6, 0.5, 0.35]
    """

    relative: float = 0.65
    least_mm: float = 0.0
    most_mm: float = math.inf
    auto: bool = False

    def __post_init__(self) -> None:
        """Refuse widths that make no sense."""
        if not 0.0 < self.relative < 1.0:
            raise InputError(
                f"the relative width is {self.relative:g}, but must be between 0 and 1; "
                "a width in millimetres needs its unit, such as 12mm"
            )
        if not 0.0 <= self.least_mm <= self.most_mm or self.most_mm <= 0.0:
            raise InputError(
                f"ribbons cannot be at least {self.least_mm:g} mm and at most "
                f"{self.most_mm:g} mm wide"
            )

    @property
    def constant(self) -> bool:
        """Whether the ribbon has one width everywhere (where it has room)."""
        return self.least_mm == self.most_mm

    def times(self, factor: float) -> "WidthRule":
        """Return the rule for ribbons that are so much wider."""
        return replace(
            self,
            relative=self.relative * factor,
            least_mm=self.least_mm * factor,
            most_mm=self.most_mm * factor,
        )

    def shares(self, room_mm: FloatArray, *, most: float | FloatArray) -> FloatArray:
        """Return the share of its room that a ribbon takes at each cross-line.

        Parameters
        ----------
        room_mm : float array
            Length of the cross-line from one portal's end to the other.
        most : float or float array
            No share is larger, so that connectors keep clear of the strand that is crossed.
        """
        wanted = np.clip(self.relative * room_mm, self.least_mm, self.most_mm)
        safe = np.where(room_mm > 0, room_mm, 1.0)
        return np.minimum(np.where(room_mm > 0, wanted / safe, self.relative), most)

    def __str__(self) -> str:
        """Write the rule as `parse_width` reads it."""
        if self.auto:
            rest = replace(self, auto=False)
            return "auto" if rest == WidthRule() else f"auto,{rest}"
        if self.constant:
            return _exact(self.least_mm)
        text = f"{self.relative:g}"
        if self.least_mm == 0.0 and self.most_mm == math.inf:
            return text
        most = "" if self.most_mm == math.inf else _exact(self.most_mm)
        least = "" if self.least_mm == 0.0 else _exact(self.least_mm)
        return f"{text},{least}..{most}"


def parse_width(text: str) -> WidthRule:
    """Read a width: ``0.65`` (relative), ``12mm`` (constant) or ``0.65,6mm..14mm`` (between).

    Either bound may be left out, and so may the relative width. ``auto`` before any of them, or
    alone, lets ribbons be narrower where they would be too near to others.

    Raises
    ------
    InputError
        If the text is something else.

    Examples
    --------
    >>> parse_width("12mm")
    WidthRule(relative=0.65, least_mm=12.0, most_mm=12.0, auto=False)
    >>> str(parse_width("6mm..1.4cm")), str(parse_width("auto,0.5,..9mm"))
    ('0.65,6mm..14mm', 'auto,0.5,..9mm')
    """
    text = text.strip()
    first, _, rest = text.partition(",")
    if first.strip() == "auto":
        rule = WidthRule() if first == text else parse_width(rest)
        if rule.auto:
            raise InputError(_usage(text))
        return replace(rule, auto=True)
    if _RELATIVE.fullmatch(text):
        return WidthRule(float(text))
    head, comma, bounds = text.partition(",")
    if not comma:
        head, bounds = "", text
    relative = WidthRule.relative
    if head.strip():
        if not _RELATIVE.fullmatch(head.strip()):
            raise InputError(_usage(text))
        relative = float(head)
    least, dots, most = bounds.partition("..")
    if not dots:
        if comma:
            raise InputError(_usage(text))
        constant = _bound(bounds, "width")
        return WidthRule(relative, constant, constant)
    return WidthRule(
        relative,
        _bound(least, "least width") if least.strip() else 0.0,
        _bound(most, "greatest width") if most.strip() else math.inf,
    )


def _bound(text: str, what: str) -> float:
    """Read a width in millimetres.

    Raises
    ------
    InputError
        If it is none, or wider than any sheet.
    """
    width = parse_length(text, what=what)
    if not _THINNEST_MM <= width <= _WIDEST_MM:
        raise InputError(
            f"{what} {text.strip()[:40]!r} is not a length from {_THINNEST_MM:g} to "
            f"{_WIDEST_MM:g} mm; check the unit"
        )
    return width


def _exact(value_mm: float) -> str:
    """Write a length so that reading it gives the same job again."""
    return f"{value_mm:.10g}mm"


def _usage(text: str) -> str:
    return (
        f"{text[:40]!r} is not a width; write auto, a share of the room such as 0.65, a length "
        "such as 12mm, bounds such as 6mm..14mm or 0.65,6mm..14mm, or auto before any of them"
    )
