"""Letter texts with a single-stroke font, as a laser engraves them.

The font is fabweave's own. It stands on an integer grid with capitals of twelve units, so that
no stroke segment is shorter than an eighth of the height (of the disc, a twelfth), and no line is
drawn twice. What may be
confused on a loose piece is told apart: zero is slashed and O is not; one carries a flag and I has
bars; 6 and 9 are underlined, so they read upside-down; M stands on uprights and W leans. A disc ●
says that a piece passes over, a ring ○ that it passes under: one stroke each, and the same however
the piece is turned.
"""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple
from unicodedata import normalize

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, frozen
from fabweave.core.errors import InputError

#: Grid units from the baseline to the top of a capital, and between glyphs.
CAP_UNITS = 12
GAP_UNITS = 3

# A character, its width, and its strokes; a stroke is a run of grid points.
_DATA = """
A 8  0,0 4,12 8,0 | 1,3 7,3
B 8  0,6 5,6 7,7 8,9 7,11 5,12 0,12 0,0 5,0 7,1 8,3 7,5 5,6
C 8  8,9 7,11 5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3
D 8  0,0 0,12 4,12 7,10 8,7 8,5 7,2 4,0 0,0
E 8  8,12 0,12 0,0 8,0 | 0,6 6,6
F 8  8,12 0,12 0,0 | 0,6 6,6
G 8  8,9 7,11 5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,6 5,6
H 8  0,12 0,0 | 0,6 8,6 | 8,12 8,0
I 6  0,12 6,12 | 3,12 3,0 | 0,0 6,0
J 6  2,12 6,12 6,3 5,1 3,0 1,1 0,3
K 8  0,12 0,0 | 8,12 0,4 | 3,7 8,0
L 7  0,12 0,0 7,0
M 8  0,0 0,12 4,5 8,12 8,0
N 8  0,0 0,12 8,0 8,12
O 8  5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,9 7,11 5,12
P 8  0,0 0,12 5,12 7,11 8,9 7,7 5,6 0,6
Q 8  5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,9 7,11 5,12 | 4,4 8,0
R 8  0,0 0,12 5,12 7,11 8,9 7,7 5,6 0,6 | 4,6 8,0
S 8  8,9 7,11 5,12 3,12 1,11 0,9 1,7 3,6 5,6 7,5 8,3 7,1 5,0 3,0 1,1 0,3
T 8  0,12 8,12 | 4,12 4,0
U 8  0,12 0,3 1,1 3,0 5,0 7,1 8,3 8,12
V 8  0,12 4,0 8,12
W 10 0,12 2,0 5,8 8,0 10,12
X 8  0,12 8,0 | 0,0 8,12
Y 8  0,12 4,6 8,12 | 4,6 4,0
Z 8  0,12 8,12 0,0 8,0
0 8  5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,9 7,11 5,12 | 2,3 6,9
1 3  0,9 3,12 3,0
2 8  0,9 1,11 3,12 5,12 7,11 8,9 7,7 0,0 8,0
3 8  0,9 1,11 3,12 5,12 7,11 8,9 7,7 5,6 7,5 8,3 7,1 5,0 3,0 1,1 0,3 | 3,6 5,6
4 8  6,0 6,12 0,4 8,4
5 8  7,12 1,12 1,7 3,8 5,8 7,7 8,5 8,3 7,1 5,0 3,0 1,1 0,3
6 8  7,11 5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,5 7,7 5,8 3,8 1,7 0,5 | 0,-3 8,-3
7 8  0,12 8,12 3,0
8 8  5,6 7,7 8,9 7,11 5,12 3,12 1,11 0,9 1,7 3,6 1,5 0,3 1,1 3,0 5,0 7,1 8,3 7,5 5,6 3,6
9 8  1,1 3,0 5,0 7,1 8,3 8,9 7,11 5,12 3,12 1,11 0,9 0,7 1,5 3,4 5,4 7,5 8,7 | 0,-3 8,-3
- 6  0,6 6,6
. 2  1,0 1,2
, 2  2,2 0,-2
/ 6  0,0 6,12
+ 6  0,6 6,6 | 3,9 3,3
± 6  0,7 6,7 | 3,10 3,4 | 0,2 6,2
: 2  1,8 1,10 | 1,2 1,4
× 6  0,9 6,3 | 0,3 6,9
= 6  0,8 6,8 | 0,4 6,4
> 6  0,10 6,6 0,2
< 6  6,10 0,6 6,2
( 3  3,12 1,10 0,7 0,5 1,2 3,0
) 3  0,12 2,10 3,7 3,5 2,2 0,0
[ 3  3,12 0,12 0,0 3,0
] 3  0,12 3,12 3,0 0,0
# 8  3,11 1,1 | 7,11 5,1 | 0,4 7,4 | 1,8 8,8
* 6  3,9 3,3 | 0,8 6,4 | 0,4 6,8
^ 6  0,8 3,12 6,8
↑ 6  3,0 3,12 | 0,8 3,12 6,8
↓ 6  3,12 3,0 | 0,4 3,0 6,4
→ 10 0,6 10,6 | 6,9 10,6 6,3
← 10 10,6 0,6 | 4,9 0,6 4,3
_ 8  0,-3 8,-3
! 2  1,12 1,4 | 1,2 1,0
? 8  0,9 1,11 3,12 5,12 7,11 8,9 7,7 4,6 4,4 | 4,2 4,0
' 2  1,12 1,9
" 4  0,12 0,9 | 4,12 4,9
% 8  2,12 0,10 2,8 4,10 2,12 | 8,12 0,0 | 6,4 4,2 6,0 8,2 6,4
& 8  8,0 2,8 2,10 4,12 6,10 6,8 0,4 0,2 2,0 4,0 8,5
Ø 8  5,12 3,12 1,11 0,9 0,3 1,1 3,0 5,0 7,1 8,3 8,9 7,11 5,12 | 0,0 8,12
° 4  2,12 0,10 2,8 4,10 2,12
"""

# Of the signs for over and under, in grid units: the diameter of the ring and the number of its
# sides; the diameter of the disc, how far its turns are apart, and the length of its chords. After
# either sign there is more room than between letters, as its partner's id is no part of it.
_RING, _RING_SIDES = 11.4, 22
_DISC, _PITCH, _CHORD = 7.2, 1.2, 1.0
_SIGN_SPACE = 2.0

# Other signs that mean one of ours.
_ALIASES = MappingProxyType({"−": "-", "–": "-", "⌀": "Ø"})


class _Glyph(NamedTuple):
    """A glyph: its width, its grid points in one array, and how many belong to each stroke."""

    width: float
    points: FloatArray
    counts: IntArray
    bottom: float


class TextBox(NamedTuple):
    """The box of a text in millimetres: its width, and from where to where it goes in y."""

    width: float
    bottom: float
    top: float


def _glyph(width: int, drawn: str) -> _Glyph:
    runs = [[point.split(",") for point in run.split()] for run in drawn.split("|") if run.strip()]
    points = np.array([point for run in runs for point in run], dtype=np.float64).reshape(-1, 2)
    counts = np.array([len(run) for run in runs], dtype=np.int64)
    bottom = int(points[:, 1].min(initial=0.0))
    return _Glyph(width, frozen(points), frozen(counts), bottom)


def _ring(diameter: float) -> _Glyph:
    """Return a ring that stands in the middle of the capitals' height."""
    turn = np.linspace(0.0, 2.0 * np.pi, _RING_SIDES + 1)
    return _round(np.column_stack((np.cos(turn), np.sin(turn))) * (diameter / 2.0), diameter)


def _disc(diameter: float) -> _Glyph:
    """Return a disc: a spiral from the middle that ends in a circle."""
    radius, growth = diameter / 2.0, _PITCH / (2.0 * np.pi)
    turns, angle = [], _CHORD / growth / 2.0
    while growth * angle < radius:
        turns.append(angle)
        angle += _CHORD / (growth * angle)
    spiral = np.array(turns)
    sides = int(2.0 * np.pi * radius / _CHORD)
    # The circle begins where the spiral comes to it, one chord on.
    circle = radius / growth + np.arange(sides + 1) * (2.0 * np.pi / sides)
    turn = np.concatenate((spiral[: -1 if radius / growth - turns[-1] < 0.3 else None], circle))
    reach = np.minimum(growth * turn, radius)[:, None]
    return _round(np.column_stack((np.cos(turn), np.sin(turn))) * reach, diameter)


def _round(points: FloatArray, diameter: float) -> _Glyph:
    """Return the glyph of one stroke around a middle, brought to the letters' grid."""
    placed = points + np.array([diameter / 2.0, CAP_UNITS / 2.0])
    return _Glyph(diameter + _SIGN_SPACE, frozen(placed), frozen(np.array([len(placed)])), 0)


def _font() -> Mapping[str, _Glyph]:
    glyphs = {" ": _glyph(6, "")}
    for line in _DATA.strip().splitlines():
        character, width, drawn = line.split(maxsplit=2)
        glyphs[character] = _glyph(int(width), drawn)
    glyphs["●"], glyphs["○"] = _disc(_DISC), _ring(_RING)
    return MappingProxyType(glyphs)


_FONT = _font()


def characters() -> str:
    """Return every character that the font has, in the order of their code points."""
    return "".join(sorted(_FONT))


def lettered(text: str) -> str:
    """Return what can be lettered of a text: letters lose their accents, other signs are left out.

    Examples
    --------
    >>> lettered("Löwe, weiß"), lettered("兔子 2")
    ('LOWE, WEISS', '2')
    """
    signs = normalize("NFKD", text.upper())
    return " ".join("".join(sign for sign in signs if sign in _FONT).split())


def _glyphs(text: str) -> list[_Glyph]:
    """Return the glyphs of a text; lower case is lettered as capitals."""
    signs = [_ALIASES.get(sign, sign) for sign in text.upper()]
    try:
        return [_FONT[sign] for sign in signs]
    except KeyError:
        missing = sorted({sign for sign in signs if sign not in _FONT})
        names = ", ".join(f"{sign!r} (U+{ord(sign):04X})" for sign in missing)
        raise InputError(
            f"{len(missing)} character(s) of the text {text!r} cannot be engraved: {names}; "
            f"use only {characters().strip()} and spaces"
        ) from None


def _check_height(height_mm: float) -> None:
    if not (math.isfinite(height_mm) and height_mm > 0.0):
        raise InputError(f"the letter height is {height_mm} mm; it must be a positive length")


def _box(glyphs: Sequence[_Glyph], height_mm: float) -> TextBox:
    unit = height_mm / CAP_UNITS
    width = sum(glyph.width for glyph in glyphs) + GAP_UNITS * max(len(glyphs) - 1, 0)
    bottom = min((glyph.bottom for glyph in glyphs), default=0)
    return TextBox(width * unit, bottom * unit, float(height_mm))


def text_box(text: str, height_mm: float) -> TextBox:
    """Return the box of a text: its width and its vertical extent.

    The baseline stands at 0 and the top at ``height_mm``; the bottom is below the baseline
    (at most a quarter of the height) only where a glyph goes there, such as the line under a 6.

    Examples
    --------
    >>> text_box("A3", 12.0)
    TextBox(width=19.0, bottom=0.0, top=12.0)
    >>> text_box("A6", 12.0).bottom
    -3.0
    """
    _check_height(height_mm)
    return _box(_glyphs(text), height_mm)


def place_text(
    text: str,
    height_mm: float,
    centre: FloatArray | tuple[float, float],
    angle_deg: float,
    *,
    mirrored: bool = False,
) -> list[FloatArray]:
    """Return the strokes of a text whose box is centred on a point and turned.

    Parameters
    ----------
    text : str
        What to letter.
    height_mm : float
        Height of a capital.
    centre : (2,) floats
        Where the middle of ``text_box(text, height_mm)`` comes to stand, millimetres.
    angle_deg : float
        Reading direction, counter-clockwise from the x axis.
    mirrored : bool
        Whether the text is to be read from the back: what was above the line of its middle comes
        to stand below it.

    Returns
    -------
    list of (N, 2) float arrays
        Polylines in millimetres.

    Examples
    --------
    >>> place_text("-", 12.0, (100.0, 50.0), 90.0)[0].round(9).tolist()
    [[100.0, 47.0], [100.0, 53.0]]
    """
    _check_height(height_mm)
    glyphs = _glyphs(text)
    box = _box(glyphs, height_mm)
    points, ends = _typeset(glyphs)
    angle = math.radians(angle_deg)
    cosine, sine = math.cos(angle), math.sin(angle)
    middle = np.array([box.width / 2.0, (box.bottom + box.top) / 2.0])
    up = -1.0 if mirrored else 1.0
    turned = (points * (height_mm / CAP_UNITS) - middle) @ np.array(
        [[cosine, sine], [-up * sine, up * cosine]]
    )
    return np.split(turned + np.asarray(centre, dtype=np.float64), ends[:-1]) if ends else []


def _typeset(glyphs: list[_Glyph]) -> tuple[FloatArray, list[int]]:
    """Set glyphs side by side; return all points in grid units and where each stroke ends."""
    if not glyphs:
        return np.empty((0, 2)), []
    points = np.concatenate([glyph.points for glyph in glyphs])
    advance = np.cumsum([0] + [glyph.width + GAP_UNITS for glyph in glyphs[:-1]])
    points[:, 0] += np.repeat(advance, [len(glyph.points) for glyph in glyphs])
    ends: list[int] = np.cumsum(np.concatenate([glyph.counts for glyph in glyphs])).tolist()
    return points, ends
