"""Colour the strands so that the weave can be seen, in hues of a scheme or tones of a material."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.colour_space import Colours, bytes_of, light_of, light_of_hue, oklab_of
from fabweave.core.errors import InputError
from fabweave.picture.thread_colours import SAFE_PALETTE, thread_colours
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.shades import shade_strands
from fabweave.weave.tones import strand_tones

#: Ways to choose colours. With ``safe``, ``direction`` and ``piece`` the strands of a crossing
#: always differ, with ``material`` and ``bunch`` nearly always; ``hue-circle`` and ``hue-range``
#: give each thread one colour, as the paper's figures do.
Strategy: TypeAlias = Literal[
    "material", "safe", "direction", "piece", "bunch", "hue-circle", "hue-range"
]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
#: What differs at every crossing differs by no less, in OKLab, where 0.02 is just seen.
LEAST_DIFFERENCE = 0.06

#: The light tone of a colour is so much lighter, and the dark one so much darker than the light, in
#: OKLab; white and black leave no room on one side, and use it on the other.
_LIGHTER, _APART = 0.04, 0.15
_LIGHTEST, _DARKEST = 0.985, 0.22
#: Shade is richer than light, as where light comes back from a neighbour: chroma of both tones.
_CHROMAS = (0.9, 1.5)
#: Hues of bunches begin here and have this lightness and chroma.
_HUE_DEG, _LIGHTNESS, _CHROMA = 45.0, 0.64, 0.13


def strand_colours(
    weave: Weave,
    bunches: IntArray,
    strategy: Strategy = "material",
    *,
    breaks: BoolArray | None = None,
    materials: Colours | None = None,
) -> Colours:
    """Choose the colours with which every strand comes to each crossing, and leaves it.

    ``material`` keeps to the colour of each material, in tones of it by direction where threads of
    one colour cross. ``safe`` gives every thread the colour of its bunch, if no thread crosses
    itself; else threads change their colour where they lie below, or where their pieces meet.
    ``direction`` does so on every mesh: colours tell warp from weft, or three directions, wherever
    that can be told. ``piece`` gives each piece one colour, and its neighbours others. ``bunch``
    keeps to a hue for each bunch, in tones of it where a bunch crosses itself. The others are
    those of ``thread_colours``.

    Parameters
    ----------
    weave : Weave
    bunches : (T,) int array
        The bunch of each thread, 0 upwards.
    strategy : str
        One of ``STRATEGIES``.
    breaks : (P,) bool array, optional
        The passes at which two pieces of a thread meet, where pieces are known.
    materials : (T, 3) uint8 array, optional
        The colour of each thread's material, for ``material``.

    Returns
    -------
    (P, 2, 3) uint8 array
        sRGB of each pass, as it comes and as it leaves; a pass leaves as the next one comes. Only
        where a thread lies below another does it leave in another colour than it came in, but for
        stretches that cross themselves in ``safe``, ``direction`` and ``piece``.

    Raises
    ------
    InputError
        If there is no such strategy, or pieces or materials are not known.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(parse_shape("shape:octahedron"))))
    >>> colours = strand_colours(weave, np.arange(4), "safe")
    >>> np.unique(colours.reshape(-1, 3), axis=0).tolist()
    [[0, 114, 178], [86, 180, 233], [99, 30, 0], [213, 94, 0]]
    """
    if strategy not in STRATEGIES:
        raise InputError(
            f"there are no colours called {str(strategy)[:40]!r}; choose {', '.join(STRATEGIES)}"
        )
    threads = weave.threads
    owner = threads.thread_of_pass
    if strategy == "piece" and breaks is None:
        raise InputError(
            "colours by piece are those of a finished job: where no pieces are cut, choose "
            "--colours direction"
        )
    if strategy in ("hue-circle", "hue-range") or (
        strategy == "safe" and _told_by_bunch(weave, bunches)
    ):
        return _of_threads(weave, thread_colours(bunches, strategy))
    if strategy in ("safe", "direction", "piece"):
        shades = shade_strands(
            weave,
            breaks=None if strategy == "direction" else breaks,
            distinct=strategy == "piece",
        )
        return np.asarray(SAFE_PALETTE[shades.shade % len(SAFE_PALETTE)])
    if strategy == "bunch":
        base = _bunch_hues(int(bunches.max(initial=-1)) + 1)
        kind = bunches
    else:
        if materials is None:
            raise InputError("colours of materials are asked for, and no material is known")
        base, kind = np.unique(materials, axis=0, return_inverse=True)
        kind = kind.reshape(-1)
    tone = strand_tones(weave, kind)
    shown = base[kind[owner]][:, None].repeat(2, axis=1)
    for each, colour in enumerate(base):
        own = kind[owner] == each
        # A material that crosses others only has its very colour.
        if np.any(tone[own]):
            shown[own] = tones_of(colour, int(tone.max()) + 1)[tone[own]]
    return np.asarray(shown)


def tones_of(colour: Colours, count: int) -> Colours:
    """Return two or more tones of a colour, from light to dark, (count, 3).

    Examples
    --------
    >>> tones_of(np.array([0, 0, 128], dtype=np.uint8), 2).tolist()
    [[13, 50, 151], [0, 11, 85]]
    """
    lightness, *ab = oklab_of(light_of(colour)).tolist()
    light = min(max(lightness + _LIGHTER, _DARKEST + _APART), _LIGHTEST)
    chroma = np.hypot(*ab) * np.linspace(*_CHROMAS, count)
    hue = np.full(count, np.degrees(np.arctan2(ab[1], ab[0])))
    return bytes_of(light_of_hue(np.linspace(light, light - _APART, count), chroma, hue))


def _told_by_bunch(weave: Weave, bunches: IntArray) -> bool:
    """Return whether the colours of bunches tell the strands of every crossing apart."""
    below, above = bunches[weave.threads.thread_of_pass][strand_passes(weave)].T
    few = int(bunches.max(initial=-1)) < len(SAFE_PALETTE)
    return few and bool(np.all(below != above))


def _of_threads(weave: Weave, colours: Colours) -> Colours:
    """Return the colours of threads for each pass, as it comes and as it leaves."""
    return np.asarray(np.repeat(colours[weave.threads.thread_of_pass, None], 2, axis=1))


def _bunch_hues(count: int) -> Colours:
    """Return a colour for each bunch, evenly round the circle of hues."""
    hue: FloatArray = _HUE_DEG + 360.0 / max(count, 1) * np.arange(count, dtype=np.float64)
    return bytes_of(light_of_hue(np.full(count, _LIGHTNESS), np.full(count, _CHROMA), hue))


def crossing_colours(weave: Weave, strands: Colours) -> Colours:
    """Return the colours of each crossing's strands, the one below and the one above.

    Parameters
    ----------
    weave : Weave
    strands : (P, 2, 3) uint8 array
        As ``strand_colours`` gives them.

    Returns
    -------
    (X, 2, 2, 3) uint8 array
        Of the strand below and of that above, as it comes and as it leaves.
    """
    return np.asarray(strands[strand_passes(weave)])


def least_difference(weave: Weave, strands: Colours) -> float:
    """Return by how much the strands of a crossing differ at least, in OKLab.

    The strand below is compared on both sides of the one above.
    """
    lab = oklab_of(light_of(crossing_colours(weave, strands)))
    away = np.linalg.norm(lab[:, 0, :, None] - lab[:, 1, None, :], axis=-1)
    return float(away.min(initial=np.inf))
