"""Colour the strands so that the weave can be seen: two that cross differ, on every mesh."""

from typing import Literal, TypeAlias, get_args

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.colour_space import Colours, bytes_of, light_of, light_of_hue, oklab_of
from fabweave.core.errors import InputError
from fabweave.picture.thread_colours import SAFE_PALETTE, thread_colours
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.shades import shade_strands

#: Ways to choose colours. With all but ``hue-circle`` and ``hue-range`` the strands of a crossing
#: differ; those give each thread one colour, as the paper's figures do.
Strategy: TypeAlias = Literal[
    "safe", "direction", "piece", "bunch", "material", "hue-circle", "hue-range"
]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
#: What differs at every crossing differs by no less, in OKLab, where 0.02 is just seen.
LEAST_DIFFERENCE = 0.06

#: Near colours of one hue: how much lighter or darker than their mean each shade is, and how far
#: aside its hue. Of shades with lower numbers there is more: the first two are far apart.
_LIGHTER = np.array([0.09, -0.09, 0.0, 0.18, -0.18])
_ASIDE_DEG = np.array([8.0, -8.0, 0.0, -8.0, 8.0])
#: The mean lightness of a hue leaves room for its shades; hues begin here and have this chroma.
_LIGHTEST, _DARKEST = 0.76, 0.42
_HUE_DEG, _LIGHTNESS, _CHROMA = 45.0, 0.64, 0.13


def strand_colours(
    weave: Weave,
    bunches: IntArray,
    strategy: Strategy = "safe",
    *,
    breaks: BoolArray | None = None,
    materials: Colours | None = None,
) -> Colours:
    """Choose the colours with which every strand comes to each crossing, and leaves it.

    ``safe`` gives every thread the colour of its bunch, if no thread crosses itself; else threads
    change their colour where they lie below, or where their pieces meet. ``direction`` does so on
    every mesh: colours tell warp from weft, or three directions, wherever that can be told.
    ``piece`` gives each piece one colour, and its neighbours others. ``bunch`` keeps to a hue for
    each bunch, and ``material`` to the colour of each material, and there to near colours where a
    thread crosses one of its own kind. The others are those of ``thread_colours``.

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
        stretches that cross themselves.

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
    >>> np.unique(strand_colours(weave, np.arange(4)).reshape(-1, 3), axis=0).tolist()
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
    shades = shade_strands(weave, breaks=breaks, groups=kind)
    near = _near_colours(base, shades.n_shades)
    return np.asarray(near[kind[owner][:, None], shades.shade])


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


def _near_colours(base: Colours, count: int) -> Colours:
    """Return for each colour as many near it, that can be told apart, (N, count, 3)."""
    if count == 1:
        return base[:, None]
    lab = oklab_of(light_of(base))
    shade = np.arange(count) % len(_LIGHTER)
    # With two shades of three the lightness stays near; what is nearly black or white moves off.
    lightness = np.clip(lab[:, 0], _DARKEST, _LIGHTEST)[:, None] + _LIGHTER[shade]
    chroma = np.repeat(np.hypot(lab[:, 1], lab[:, 2])[:, None], count, axis=1)
    hue = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]))[:, None] + _ASIDE_DEG[shade]
    light: FloatArray = light_of_hue(lightness.ravel(), chroma.ravel(), hue.ravel())
    return bytes_of(light).reshape(len(base), count, 3)


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
