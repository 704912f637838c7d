"""Decide how wide ribbons are: one width, by the room they have, or between bounds."""

import math
import re
from dataclasses import dataclass, replace

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length

#: No machine cuts narrower ribbons, and no sheet is wider, in millimetres.
_THINNEST_MM, _WIDEST_MM = 0.001, 20_000.0
_RELATIVE = re.compile(r"\d*\.?\d+", re.ASCII)
_OPEN = re.compile(r"open:0?\.\d{1,6}", re.ASCII)
#: An even width is so much of the median of what its share of the room would give: measured on
#: twelve models, ribbons are then as wide as asked nearly everywhere, and cover enough.
_EVEN_SHARE = 0.8
#: The share of the room that even ribbons take at most, where there is no more room: panels at
#: crossings are as long.
_EVEN_ROOM = 0.7
#: From one crossing to the next a ribbon gets narrower by this factor at most: less would carry a
#: pinch far into places with room, more is seen as a notch.
_TAPER = 0.75


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
    even : bool
        Whether all ribbons have one width, narrower only where the share of the room is less, and
        there by degrees: see :meth:`even_widths`. It is ``most_mm`` if that is finite.

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
    even: bool = False

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

    def even_widths(self, room_mm: FloatArray, following: IntArray) -> FloatArray:
        """Return one width for all passes of a weave, (P,), less where there is no room for it.

        Parameters
        ----------
        room_mm : (P,) float array
            What the share of the room comes to at each pass.
        following : (P,) int array
            The pass after each along its thread; -1 at an open end.

        Examples
        --------
        >>> rule, ring = parse_width("even,10mm"), np.roll(np.arange(5), -1)
        >>> rule.even_widths(np.array([14.0, 14, 4, 14, 14]), ring).round(2).tolist()
        [7.11, 5.33, 4.0, 5.33, 7.11]
        """
        one = self.most_mm
        if one == math.inf:
            one = _EVEN_SHARE * float(np.median(room_mm)) if len(room_mm) else 0.0
        return tapered(np.minimum(room_mm, one), following)

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
        if self.even:
            share = "" if self.relative == _EVEN_ROOM else f",{self.relative:g}"
            return f"even{share}" + ("" if self.most_mm == math.inf else f",{_exact(self.most_mm)}")
        if self == PROPORTIONAL:
            return "proportional"
        if self.auto:
            return f"auto,{replace(self, auto=False)}"
        if self.constant:
            return _exact(self.least_mm)
        text = f"{self.relative:g}"
        if self.least_mm == 0.0 and self.most_mm == math.inf:
            return text
        most = "" if self.most_mm == math.inf else _exact(self.most_mm)
        least = "" if self.least_mm == 0.0 else _exact(self.least_mm)
        return f"{text},{least}..{most}"


#: One width that suits the object.
EVEN = WidthRule(_EVEN_ROOM, auto=True, even=True)
#: The paper's way: a share of the room at each cross-line.
PROPORTIONAL = WidthRule(auto=True)


def tapered(width: FloatArray, following: IntArray) -> FloatArray:
    """Lower widths, (P,), so that none is much larger than its neighbours along the thread.

    ``following`` is the pass after each, (P,); -1 at an open end.
    """
    here = np.flatnonzero(following >= 0)
    after = following[here]
    while True:
        lower = width.copy()
        np.minimum.at(lower, here, width[after] / _TAPER)
        np.minimum.at(lower, after, width[here] / _TAPER)
        if np.array_equal(lower, width):
            return width
        width = lower


def shares_of(
    width: WidthRule | FloatArray, passes: IntArray, room_mm: FloatArray, most: float | FloatArray
) -> FloatArray:
    """Return the share of its room that a ribbon takes at some passes, (N,).

    ``width`` is a rule, or the width at every pass in millimetres, (P,); the rest is as for
    :meth:`WidthRule.shares`.
    """
    if isinstance(width, WidthRule):
        return width.shares(room_mm, most=most)
    return np.minimum(width[passes] / np.maximum(room_mm, 1e-300), most)


def parse_width(text: str) -> WidthRule:
    """Read a width, as ``--width`` takes it.

    ``0.65`` is relative, ``12mm`` constant, ``0.65,6mm..14mm`` between bounds, of which either may
    be left out, and so may the relative width. ``auto`` before any of these lets ribbons be
    narrower where they would be too near to others; ``proportional`` is ``auto,0.65``, and
    ``open:0.3``, which leaves 0.3 of the way across an opening free, is ``auto,0.7``. ``even`` is
    one width for all, chosen; ``even,12mm`` that width, ``even,0.5`` a chosen narrower one.

    Raises
    ------
    InputError
        If the text is something else.

    Examples
    --------
    >>> parse_width("12mm")
    WidthRule(relative=0.65, least_mm=12.0, most_mm=12.0, auto=False, even=False)
    >>> str(parse_width("6mm..1.4cm")), str(parse_width("auto,0.5,..9mm"))
    ('0.65,6mm..14mm', 'auto,0.5,..9mm')
    >>> str(parse_width("even")), str(parse_width("even,12mm")), str(parse_width("auto,0.65"))
    ('even', 'even,12mm', 'proportional')
    """
    text = text.strip()
    if text == "proportional":
        return PROPORTIONAL
    if _OPEN.fullmatch(text):
        text = f"auto,{round(1.0 - float(text.partition(':')[2]), 9):g}"
    first, comma, rest = text.partition(",")
    if first.strip() == "even":
        return _even(rest, text) if comma else EVEN
    if first.strip() == "auto":
        rule = parse_width(rest)
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


def _even(rest: str, text: str) -> WidthRule:
    """Read what follows ``even``: a share, a width, or both."""
    share, comma, width = rest.partition(",")
    if not comma and rest.strip() and not _RELATIVE.fullmatch(rest.strip()):
        share, width = f"{_EVEN_ROOM}", rest
    if not _RELATIVE.fullmatch(share.strip()) or ".." in width or (comma and not width.strip()):
        raise InputError(_usage(text))
    most = _bound(width, "width") if width.strip() else math.inf
    return replace(EVEN, relative=float(share), most_mm=most)


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
        f"{text[:40]!r} is not a width; write even, even,12mm, proportional, a share of the room "
        "such as 0.65, a length such as 12mm, bounds such as 6mm..14mm or 0.65,6mm..14mm, or auto "
        "before any of the last three"
    )
