"""Colour the strands so that the weave can be seen, in hues of a scheme or tones of a material."""

import heapq
import itertools
from itertools import pairwise
from typing import Literal, TypeAlias, get_args

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, offsets_of
from fabweave.core.colour_space import Colours, bytes_of, light_of, light_of_hue, oklab_of
from fabweave.core.errors import InputError
from fabweave.weave.pattern import Weave, strand_passes
from fabweave.weave.threads import Threads
from fabweave.weave.twill.rows import TWISTS

#: With more shades than this, threads may change theirs at every crossing, where few suffice.
_MOST_SHADES = 24
#: Where two shades leave more than this share of what meets alike, three are taken: a kagome weave
#: has three directions.
_MOST_ALIKE = 0.2
#: What a change of shade along a thread costs, where two strands alike at a crossing cost 4.
_CHANGE = 2
#: What a pass at which a shade changes says on the way that a stretch leans.
_CHANGING = 0.25
#: How often all stretches are looked at again.
_SWEEPS = 50


def shade_strands(
    weave: Weave,
    *,
    groups: IntArray | None = None,
    breaks: BoolArray | None = None,
    distinct: bool = False,
) -> IntArray:
    """Give every strand a shade so that at every crossing the strand above differs from the other.

    It differs from the strand below on either side of it. A thread changes its shade only where
    it lies below another one, so that the change is hidden; and as seldom as a greedy search with
    some improvement can bring about. On a mesh of quads that leaves warp and weft, and three
    directions on one of triangles, but for lines between irregular vertices.

    Parameters
    ----------
    weave : Weave
        Threads, and who is on top.
    groups : (T,) int array, optional
        Threads of different groups have different colours, and so may share a shade where they
        cross.
    breaks : (P,) bool array, optional
        The passes at which shades may change; without it, wherever the thread is below. Between
        them a thread that crosses itself changes elsewhere, too: below, and if need be above.
    distinct : bool
        Whether a thread takes another shade at every break.

    Returns
    -------
    (P, 2) int array
        With which shade each pass comes to its crossing, and with which it leaves. The most
        frequent is 0; the same for the same weave.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> ring = trace_threads(build_halfedges(parse_shape("shape:torus?m=9&n=7")))
    >>> shades = shade_strands(plain_weave(ring))
    >>> ring.n_threads, int(shades.max()) + 1
    (2, 2)
    """
    threads = weave.threads
    if len(threads.crossing) == 0:
        return np.zeros((0, 2), dtype=np.int64)
    broken = ~weave.over if breaks is None else np.asarray(breaks, dtype=np.bool_)
    place = strand_passes(weave)
    if groups is not None:
        group = groups[threads.thread_of_pass][place]
        place = place[group[:, 0] == group[:, 1]]
    stretch, conflicts = _parted(weave, place, broken)
    shade = _shaded(stretch, conflicts, distinct)
    if shade.max() >= _MOST_SHADES:
        stretch, conflicts = _parted(weave, place, np.ones(len(broken), dtype=np.bool_))
        shade = _shaded(stretch, conflicts, distinct=False)
    used = np.bincount(shade[stretch].ravel())
    number = np.argsort(np.argsort(-used, kind="stable"))
    return number[shade][stretch]


def lean_shades(weave: Weave, rows: IntArray, breaks: BoolArray | None = None) -> IntArray:
    """Give the strands of a twill in rings one of two shades, by the way they lean.

    Of the two strands of a crossing one goes up to the right, seen from outside, and one to the
    left. A thread leans the other way after a tip, and around a saddle: there its shade changes,
    below another strand if it can.

    Parameters
    ----------
    weave : Weave
        A twill that its rows give.
    rows : (X,) int array
        Of `fabweave.weave.twill.rows.ring_rows`, at each crossing.
    breaks : (P,) bool array, optional
        The passes at which shades may change; between them most passes decide.

    Returns
    -------
    (P, 2) int array
        With which shade each pass comes to its crossing, and with which it leaves: 1 to the right.
    """
    threads, below = weave.threads, ~weave.over
    row = rows[threads.crossing]
    # Of a counter-clockwise edge that strand is on top which leans to the right of the edge; an
    # edge between rows points up, one along a row is a quarter turn from there.
    right = weave.over ^ TWISTS[row] ^ (row % 2 == 0)
    if breaks is None:
        after = np.arange(len(right)) + 1
        filled = np.flatnonzero(threads.woven)
        first, last = threads.offsets[filled], threads.offsets[filled + 1] - 1
        after[last] = np.where(threads.closed[filled], first, last)
        turns = right != right[after]
        breaks = turns & (below | ~below[after])
        breaks[after[turns & ~below & below[after]]] = True
    stretch = _stretches(threads, breaks)
    # A pass at which the shade changes says little on what it changes to.
    vote = np.where(right, 1.0, -1.0) * np.where(breaks, _CHANGING, 1.0)
    votes = np.bincount(stretch.ravel(), weights=np.repeat(vote, 2))
    return (votes > 0).astype(np.int64)[stretch]


def _parted(weave: Weave, place: IntArray, broken: BoolArray) -> tuple[IntArray, IntArray]:
    """Part threads until no stretch crosses itself; return stretches and pairs that must differ.

    These meet at crossings of which ``place`` holds the passes, the one below first.
    """
    broken = broken.copy()
    for may_break in (~weave.over, np.ones(len(broken), dtype=np.bool_)):
        stretch = _stretches(weave.threads, broken)
        pairs = _crossing_pairs(place, stretch)
        own = flags(int(stretch.max()) + 1, pairs[pairs[:, 0] == pairs[:, 1], 0])
        broken |= may_break & own[stretch].any(axis=1)
    stretch = _stretches(weave.threads, broken)
    pairs = _crossing_pairs(place, stretch)
    return stretch, pairs[pairs[:, 0] != pairs[:, 1]]


def _stretches(threads: Threads, broken: BoolArray) -> IntArray:
    """Give each stretch of thread between breaks a number; return it before and after each pass."""
    thread = threads.thread_of_pass
    after = np.cumsum(broken) + thread
    before = after - broken
    # A ring goes on from its last pass to its first.
    filled = np.flatnonzero(threads.woven)
    first, last = threads.offsets[filled], threads.offsets[filled + 1] - 1
    ring = threads.closed[filled]
    name = np.arange(int(after.max()) + 1)
    name[before[first[ring]]] = after[last[ring]]
    both = name[np.stack((before, after), axis=1)]
    return np.unique(both, return_inverse=True)[1].reshape(-1, 2)


def _crossing_pairs(place: IntArray, stretch: IntArray) -> IntArray:
    """Return the stretches that meet at crossings, four pairs for each."""
    below, above = stretch[place[:, 0]], stretch[place[:, 1]]
    pairs = np.stack((np.repeat(above, 2, axis=1), np.tile(below, 2)), axis=2).reshape(-1, 2)
    return np.sort(pairs, axis=1)


def _shaded(stretch: IntArray, conflicts: IntArray, distinct: bool) -> IntArray:
    """Return a shade for each stretch: those in conflict differ, neighbours agree if they can."""
    count = int(stretch.max()) + 1
    along = stretch[stretch[:, 0] != stretch[:, 1]]
    if distinct:
        conflicts, along = np.concatenate((conflicts, along)), along[:0]
    near = _neighbours(conflicts, along, count)
    for few in (2, 3):
        shades = _assigned(near, few)
        alike = conflicts[shades[conflicts[:, 0]] == shades[conflicts[:, 1]]]
        if len(alike) <= _MOST_ALIKE * len(conflicts):
            break
    # Of those still in conflict, some take another shade, that in most conflicts first; and only
    # where both of two cannot take that, a further one.
    often = np.bincount(alike.ravel(), minlength=count)
    order = np.argsort(-often, kind="stable")[: np.count_nonzero(often)].tolist()
    apart = _neighbours(conflicts, along[:0], count)
    for most, here in itertools.product((few + 1, count), order):
        taken = {int(shades[other]) for other, _ in apart[here]}
        free = next(shade for shade in itertools.count() if shade not in taken)
        if shades[here] in taken and free < most:
            shades[here] = free
    return shades


def _neighbours(apart: IntArray, along: IntArray, count: int) -> list[list[tuple[int, int]]]:
    """Return for each stretch those it meets, and what it costs to have the same shade as they."""
    pairs = np.concatenate((apart, along))
    costs = np.repeat((1, -_CHANGE), (len(apart), len(along)))
    both, number = np.unique(np.concatenate((pairs, pairs[:, ::-1])), axis=0, return_inverse=True)
    total = np.bincount(number.ravel(), weights=np.tile(costs, 2)).astype(np.int64)
    bounds = offsets_of(np.bincount(both[:, 0], minlength=count)).tolist()
    listed = list(zip(both[:, 1].tolist(), total.tolist(), strict=True))
    return [listed[low:high] for low, high in pairwise(bounds)]


def _assigned(near: list[list[tuple[int, int]]], count: int) -> IntArray:
    """Return a shade for each stretch: that first whose choice is clearest, then improved."""
    shades = [-1] * len(near)
    costs = [[0] * count for _ in near]
    for start in range(len(near)):
        heap = [(0, start)]
        while heap:
            _, here = heapq.heappop(heap)
            if shades[here] >= 0:
                continue
            shades[here] = costs[here].index(min(costs[here]))
            for other, cost in near[here]:
                costs[other][shades[here]] += cost
                if shades[other] < 0:
                    ranked = sorted(costs[other])
                    heapq.heappush(heap, (ranked[0] - ranked[1], other))
    for _ in range(_SWEEPS):
        moved = False
        for here, own in enumerate(costs):
            best = own.index(min(own))
            if own[best] < own[shades[here]]:
                for other, cost in near[here]:
                    costs[other][shades[here]] -= cost
                    costs[other][best] += cost
                shades[here], moved = best, True
        if not moved:
            break
    return np.array(shades, dtype=np.int64)


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


#: Ways to choose colours. With ``safe``, ``direction`` and ``piece`` the strands of a crossing
#: always differ, with ``material`` and ``bunch`` nearly always; ``hue-circle`` and ``hue-range``
#: give each thread one colour, as the paper's figures do.
Strategy: TypeAlias = Literal[
    "material", "safe", "direction", "piece", "bunch", "hue-circle", "hue-range"
]
STRATEGIES: tuple[Strategy, ...] = get_args(Strategy)
#: The light tone of a colour is so much lighter, and the dark one so much darker than the light, in
#: OKLab; white and black leave no room on one side, and use it on the other.
_LIGHTER, _APART = 0.04, 0.15
_LIGHTEST, _DARKEST = 0.985, 0.22
#: Shade is richer than light, as where light comes back from a neighbour: chroma of both tones.
_CHROMAS = (0.9, 1.5)
#: Hues of bunches begin here and have this lightness and chroma.
_HUE_DEG, _BUNCH_LIGHTNESS, _BUNCH_CHROMA = 45.0, 0.64, 0.13


def strand_colours(
    weave: Weave,
    bunches: IntArray,
    strategy: Strategy = "material",
    *,
    breaks: BoolArray | None = None,
    materials: Colours | None = None,
    rows: IntArray | None = None,
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
    rows : (X,) int array, optional
        Of a twill in rings, the row of each crossing: directions are then those of `lean_shades`.

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
        colours = thread_colours(bunches, strategy)
        return np.asarray(np.repeat(colours[owner, None], 2, axis=1))
    if strategy in ("safe", "direction", "piece"):
        may_change = None if strategy == "direction" else breaks
        if rows is not None and strategy != "piece":
            shades = lean_shades(weave, rows, may_change)
        else:
            shades = shade_strands(weave, breaks=may_change, distinct=strategy == "piece")
        return np.asarray(SAFE_PALETTE[shades % len(SAFE_PALETTE)])
    if strategy == "bunch":
        base = _bunch_hues(int(bunches.max(initial=-1)) + 1)
        kind = bunches
    else:
        if materials is None:
            raise InputError("colours of materials are asked for, and no material is known")
        base, kind = np.unique(materials, axis=0, return_inverse=True)
        kind = kind.reshape(-1)
    shade = shade_strands(weave, groups=kind) if rows is None else lean_shades(weave, rows)
    shown = base[kind[owner]][:, None].repeat(2, axis=1)
    for each, colour in enumerate(base):
        own = kind[owner] == each
        used, tone = np.unique(shade[own], return_inverse=True)
        # A material that crosses others only has its very colour.
        if len(used) > 1:
            # The two most frequent are farthest apart, and a third tone lies between them.
            tones = tones_of(colour, min(len(used), 3))[[0, -1, 1]]
            shown[own] = tones[np.minimum(tone.reshape(-1, 2), 2)]
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


def _bunch_hues(count: int) -> Colours:
    """Return a colour for each bunch, evenly round the circle of hues."""
    hue: FloatArray = _HUE_DEG + 360.0 / max(count, 1) * np.arange(count, dtype=np.float64)
    return bytes_of(
        light_of_hue(np.full(count, _BUNCH_LIGHTNESS), np.full(count, _BUNCH_CHROMA), hue)
    )


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
