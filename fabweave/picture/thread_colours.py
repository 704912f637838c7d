"""Give every thread a colour that tells its bunch, and itself, from others."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.colour_space import Colours, bytes_of, light_of, light_of_hue, oklab_of
from fabweave.core.errors import InputError

#: Ways to choose the colours of threads.
Palette: TypeAlias = Literal["safe", "hue-circle", "hue-range"]
PALETTES: tuple[Palette, ...] = get_args(Palette)

#: Safe colours, (24, 3) bytes of sRGB. Vermilion, blue and sky blue are of Okabe and Ito's palette;
#: of a grid of colours, each later one is the farthest from all before, to whoever of four tells
#: them apart worst: with full colour vision, protanopia, deuteranopia or tritanopia. Least OKLab
#: differences of the first n to them, in hundredths (2 is just seen), and of other palettes:
#:
#: ======================  =====  =====  =====  =====
#: n                           4      6     10     24
#: this one                 18.9   18.4   11.5    6.5
#: Okabe and Ito            13.1    8.6      -      -
#: Tol, "muted"             13.5   12.1      -      -
#: evenly spaced hues        1.2    1.2    0.6    0.2
#: ======================  =====  =====  =====  =====
SAFE_PALETTE: Colours = np.frombuffer(
    bytes.fromhex(
        "d55e00 0072b2 56b4e9 631e00 f2e075 053279 61f7ff 8e4c57"
        "c0a689 9477fc a27b7a ea9600 472e44 0044a8 a2cfc5 0095b5"
        "b71c0e e3be80 b4efbf 6fd2ff 67497d 7d5ee0 7ca6b4 763638"
    ),
    dtype=np.uint8,
).reshape(-1, 3)
#: How far members of a safe bunch go in lightness, to each side, at most, and together with those
#: of all bunches: less than an eighth of the way to another bunch.
_SAFE_LIGHTNESS, _SHARED_LIGHTNESS = 0.022, 0.14
#: Hue circle: where it begins, lightness and chroma.
_FIRST_HUE_DEG, _LIGHTNESS, _CHROMA = 45.0, 0.66, 0.16
#: How far members of a bunch go in lightness and hue, to each side.
_MEMBER_LIGHTNESS, _MEMBER_HUE_DEG = 0.075, 14.0
#: Hue range: its middle, a blue, and its whole width;
_RANGE_HUE_DEG, _RANGE_WIDTH_DEG = 250.0, 50.0
#: lightness of the darkest and the lightest bunch, and the chroma.
_DARK, _BRIGHT, _RANGE_CHROMA = 0.38, 0.86, 0.13
_GOLDEN = (5**0.5 - 1) / 2


def thread_colours(bunches: IntArray, strategy: Palette = "safe") -> Colours:
    """Choose a colour for each thread.

    ``hue-circle`` spreads the bunches evenly round the circle of hues; members of a bunch have
    nearby hues and differ in lightness. ``hue-range`` stays in a small range of hues, where
    bunches differ in lightness and members in hue. ``safe`` takes the colours of `SAFE_PALETTE`,
    which everybody can tell apart, the colour-blind included; members differ a little in lightness.
    The 25th bunch has the palette's first colour again.

    Parameters
    ----------
    bunches : (T,) int array
        The bunch of each thread, 0 upwards.
    strategy : {"safe", "hue-circle", "hue-range"}
        How to choose.

    Returns
    -------
    (T, 3) uint8 array
        sRGB.

    Raises
    ------
    InputError
        If there is no such strategy.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), section 9: colours
    from the whole hue circle, and from a small range of hues. Okabe, Ito, "Color universal
    design" (2008).

    Examples
    --------
    >>> thread_colours(np.array([0, 1])).tolist()
    [[213, 94, 0], [0, 114, 178]]
    """
    if strategy not in PALETTES:
        raise InputError(
            f"there are no colours called {str(strategy)[:40]!r}; choose {', '.join(PALETTES)}"
        )
    bunches = np.asarray(bunches, dtype=np.int64)
    count = int(bunches.max(initial=-1)) + 1
    apart = _members_apart(bunches)
    if strategy == "safe":
        lab = oklab_of(light_of(SAFE_PALETTE[bunches % len(SAFE_PALETTE)]))
        hue = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]))
        lightness = lab[:, 0] + min(_SAFE_LIGHTNESS, _SHARED_LIGHTNESS / max(count, 1)) * apart
        return bytes_of(light_of_hue(lightness, np.hypot(lab[:, 1], lab[:, 2]), hue))
    if strategy == "hue-circle":
        spacing = 360.0 / max(count, 1)
        spread = min(_MEMBER_HUE_DEG, spacing / 5.0)
        hue = np.asarray(_FIRST_HUE_DEG + spacing * bunches + spread * apart, dtype=np.float64)
        # Lightness goes its own way, so that not both are alike.
        lightness = _LIGHTNESS + _MEMBER_LIGHTNESS * _shuffled(apart)
        return bytes_of(light_of_hue(lightness, np.full(len(hue), _CHROMA), hue))
    step = (_BRIGHT - _DARK) / max(count - 1, 1)
    # A single bunch has the lightness in the middle; several end at both ends.
    middle = _DARK + step * np.arange(count) if count > 1 else np.full(count, _LIGHTNESS)
    lightness = middle[bunches] + min(0.02, step / 6) * _shuffled(apart)
    around = np.asarray(_RANGE_HUE_DEG + _RANGE_WIDTH_DEG / 2 * apart, dtype=np.float64)
    return bytes_of(light_of_hue(lightness, np.full(len(around), _RANGE_CHROMA), around))


def _members_apart(bunches: IntArray) -> FloatArray:
    """Return a number from -1 to 1 for each thread that differs among members of a bunch.

    Steps of the golden ratio keep members apart however many there are, and neighbours most; a
    bunch of one has 0, and so has the first of several.
    """
    order = np.argsort(bunches, kind="stable")
    starts = np.searchsorted(bunches[order], bunches[order])
    rank = np.empty(len(bunches), dtype=np.int64)
    rank[order] = np.arange(len(bunches)) - starts
    return np.asarray(2.0 * ((0.5 + rank * _GOLDEN) % 1.0) - 1.0, dtype=np.float64)


def _shuffled(apart: FloatArray) -> FloatArray:
    """Return numbers from -1 to 1 that go with the given ones in no order; 0 stays 0."""
    return 2.0 * ((0.5 + 3.5 * apart) % 1.0) - 1.0
