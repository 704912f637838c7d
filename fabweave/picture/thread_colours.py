"""Give every thread a colour that tells its bunch, and itself, from others."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.colour_space import (
    COLOUR_BLINDNESS,
    Colours,
    as_seen_with,
    bytes_of,
    light_of,
    light_of_hue,
    oklab_of,
)
from fabweave.core.errors import InputError

#: Ways to choose colours.
Strategy: TypeAlias = Literal["safe", "hue-circle", "hue-range"]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)

# Vermilion, blue and sky blue of Okabe and Ito's palette. The others of it are nearer to these,
# for the colour-blind, than colours of other lightness can be.
_SAFE = ((213, 94, 0), (0, 114, 178), (86, 180, 233))
#: Hue circle: where it begins, lightness and chroma.
_FIRST_HUE_DEG, _LIGHTNESS, _CHROMA = 45.0, 0.66, 0.16
#: How far members of a bunch go in lightness and hue, to each side.
_MEMBER_LIGHTNESS, _MEMBER_HUE_DEG = 0.075, 14.0
#: Hue range: lightness of the darkest and the lightest bunch, and the chroma.
_DARK, _BRIGHT, _RANGE_CHROMA = 0.38, 0.86, 0.13
#: Safe colours: members differ in lightness only, and little, so that bunches stay apart.
_SAFE_LIGHTNESS = 0.022
_GOLDEN = (5**0.5 - 1) / 2


def thread_colours(
    bunches: IntArray,
    strategy: Strategy = "safe",
    *,
    hue_deg: float = 250.0,
    range_deg: float = 50.0,
) -> Colours:
    """Choose a colour for each thread.

    ``hue-circle`` spreads the bunches evenly round the circle of hues; members of a bunch have
    nearby hues and differ in lightness. ``hue-range`` stays in a small range of hues, where
    bunches differ in lightness and members in hue. ``safe`` keeps the bunches as far apart as
    can be for everybody, the colour-blind included; members differ a little in lightness.

    Parameters
    ----------
    bunches : (T,) int array
        The bunch of each thread, 0 upwards.
    strategy : {"safe", "hue-circle", "hue-range"}
        How to choose.
    hue_deg, range_deg : float
        For ``hue-range``: the middle of the range of hues (0 pink, 45 orange, 110 yellow,
        145 green, 250 blue, 320 violet) and its whole width.

    Returns
    -------
    (T, 3) uint8 array
        sRGB.

    Raises
    ------
    InputError
        If there is no such strategy, or a hue is not a number.

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
    if strategy not in STRATEGIES:
        raise InputError(
            f"there are no colours called {str(strategy)[:40]!r}; choose {', '.join(STRATEGIES)}"
        )
    if not (np.isfinite(hue_deg) and 0.0 <= range_deg <= 360.0):
        raise InputError(
            f"hues of {range_deg} degrees around {hue_deg} make no sense; "
            "the range must be from 0 to 360 degrees"
        )
    bunches = np.asarray(bunches, dtype=np.int64)
    count = int(bunches.max(initial=-1)) + 1
    apart = _members_apart(bunches)
    if strategy == "safe":
        palette = safe_palette(count)
        lab = oklab_of(light_of(palette))[bunches]
        hue = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]))
        # Members keep to an eighth of the way to the next bunch.
        room = min(_SAFE_LIGHTNESS, _least_difference(palette) / 800.0)
        lightness = lab[:, 0] + room * apart
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
    around = np.asarray(hue_deg + range_deg / 2 * apart, dtype=np.float64)
    return bytes_of(light_of_hue(lightness, np.full(len(around), _RANGE_CHROMA), around))


def safe_palette(count: int) -> Colours:
    """Return colours that differ for everybody, the colour-blind included.

    Three colours of Okabe and Ito's palette come first. More are added one by one, each as far
    as can be from all before, in the least favourable of four views: full colour vision,
    protanopia, deuteranopia and tritanopia. So, by ``colour_differences``, the first 6 are at
    least 16 apart, the first 10 at least 9, the first 24 at least 5.

    Parameters
    ----------
    count : int
        How many colours.

    Returns
    -------
    (count, 3) uint8 array
        sRGB; the first few do not depend on how many follow.

    Examples
    --------
    >>> safe_palette(2).tolist()
    [[213, 94, 0], [0, 114, 178]]
    """
    chosen = np.array(_SAFE[:count], dtype=np.uint8).reshape(-1, 3)
    if count <= len(_SAFE):
        return chosen
    candidates = _candidates()
    near = colour_differences(candidates, chosen).min(axis=1)
    for _ in range(count - len(_SAFE)):
        best = candidates[[int(np.argmax(near))]]
        chosen = np.concatenate((chosen, best))
        near = np.minimum(near, colour_differences(candidates, best)[:, 0])
    return chosen


def colour_differences(first: Colours, second: Colours) -> FloatArray:
    """Return how much colours differ at least, for people with any colour vision.

    Distances are those of OKLab in hundredths: 2 is just seen beside one another, 10 is clear.

    Parameters
    ----------
    first, second : (A, 3) and (B, 3) uint8 arrays
        sRGB.

    Returns
    -------
    (A, B) float array
        The least of the distances under full colour vision and three kinds of blindness.

    Examples
    --------
    >>> red, green = np.array([[200, 60, 40]]), np.array([[110, 120, 30]])
    >>> colour_differences(red, green).round().tolist()  # alike with deuteranopia
    [[2.0]]
    """
    least = np.full((len(first), len(second)), np.inf)
    light_a, light_b = light_of(first), light_of(second)
    for blindness in (None, *COLOUR_BLINDNESS):
        if blindness is None:
            lab_a, lab_b = oklab_of(light_a), oklab_of(light_b)
        else:
            lab_a = oklab_of(as_seen_with(light_a, blindness))
            lab_b = oklab_of(as_seen_with(light_b, blindness))
        away = np.linalg.norm(lab_a[:, None, :] - lab_b[None, :, :], axis=2)
        least = np.minimum(least, 100.0 * away)
    return least


def _least_difference(palette: Colours) -> float:
    """Return the least difference between two colours; infinity for a single one."""
    away = colour_differences(palette, palette)
    np.fill_diagonal(away, np.inf)
    return float(away.min(initial=np.inf))


def _candidates() -> Colours:
    """Return colours to choose from: neither too dark for shadows nor too light for paper."""
    lightness, chroma, hue = np.meshgrid(
        np.linspace(0.34, 0.90, 15), (0.05, 0.09, 0.13, 0.19), np.arange(0.0, 360.0, 10.0)
    )
    return bytes_of(light_of_hue(lightness.ravel(), chroma.ravel(), hue.ravel()))


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
