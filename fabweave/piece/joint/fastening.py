"""Say which crossings take a fastener: all, those with joints, the rim as well, every so many.

A weave that is tight enough holds itself, as baskets do; then only laps want a fastener. The
looser it is at some place, the more crossings want one there.
"""

import re
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.piece.joint.holes import other_passes
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

#: Where ribbons cover so much of the way from crossing to crossing, a weave holds itself: strands
#: bear on one another nearly all along. Where they cover so little, nothing does: in the middle,
#: half of the crossings want a fastener. A maker's estimate.
TIGHT_COVER, LOOSE_COVER = 0.6, 0.2
#: It does if no material bends tighter than so many thicknesses: felt and leather do, and slip.
STIFF_T = 15.0

_TEXT = re.compile(r"(?P<kind>joints|loose|all|rim|none|every:(?P<count>\d{1,4}))", re.ASCII)


@dataclass(frozen=True)
class Fastening:
    """Which crossings take a fastener: ``kind``, and for ``every`` one of how many."""

    kind: str
    every: int = 1


def parse_fastening(text: str) -> Fastening:
    """Read what is typed for the crossings that take a fastener.

    Raises
    ------
    InputError
        If it is none of the kinds, or counts fewer than two.

    Examples
    --------
    >>> parse_fastening("every:2")
    Fastening(kind='every', every=2)
    >>> parse_fastening("rim").kind
    'rim'
    """
    match = _TEXT.fullmatch(text.strip().lower())
    if match is None or (match["count"] and int(match["count"]) < 2):
        raise InputError(
            f"{text[:40]!r} does not say which crossings take a fastener: write joints, loose, "
            "all, rim, none, or every:2 for one crossing of two"
        )
    return Fastening(match["kind"].partition(":")[0], int(match["count"] or 1))


def fastened_crossings(
    fastening: Fastening, weave: Weave, halfedges: Halfedges, joints: IntArray
) -> BoolArray:
    """Say which crossings are to take a fastener, (X,).

    Of every N crossings one is fastened: the first at which a thread passes over, and every N-th
    after it along that thread. The rim are the crossings of the edges that follow an edge of the
    boundary around its face, or that it follows. Where the weave is loose, the ends of threads are
    fastened whatever their :func:`loose_shares`, which come on top of these.

    Parameters
    ----------
    fastening : Fastening
    weave : Weave
    halfedges : Halfedges
        Of the woven mesh.
    joints : (J,) int array
        The crossings with joints, which are fastened unless none are.
    """
    threads = weave.threads
    count = threads.n_crossings
    if fastening.kind in ("all", "none"):
        return np.full(count, fastening.kind == "all")
    wanted = np.zeros(count, dtype=np.bool_)
    if fastening.kind == "every":
        over = np.flatnonzero(weave.over)
        first = np.searchsorted(over, threads.offsets[threads.thread_of_pass[over]])
        nth = np.arange(len(over)) - first
        wanted[threads.crossing[over]] = nth % fastening.every == 0
    elif fastening.kind == "rim":
        wanted = beside_edges(threads, halfedges, halfedges.twin < 0)
    elif fastening.kind == "loose":
        own = ~threads.closed & threads.woven
        ends = np.concatenate((threads.offsets[:-1][own], threads.offsets[1:][own] - 1))
        wanted[threads.crossing[ends]] = True
    wanted[joints] = True
    return np.asarray(wanted)


def beside_edges(threads: Threads, halfedges: Halfedges, edges: BoolArray) -> BoolArray:
    """Say which crossings are those of edges that follow some edge around its face, or lead to it.

    Parameters
    ----------
    threads : Threads
    halfedges : Halfedges
    edges : (H,) bool array
        Half-edges, such as those of the boundary.

    Returns
    -------
    (X,) bool array
    """
    beside = edges[halfedges.next] | edges[halfedges.prev]
    own = threads.crossing_halfedge
    return np.asarray(beside[own] | beside[halfedges.twin[own]])


def loose_shares(ribbons: Ribbons, threads: Threads, bend_t: float) -> FloatArray:
    """Return which share of crossings like each wants a fastener because the weave is loose there.

    What keeps a strand from moving along the one that it crosses are its neighbours. A crossing
    counts as covered by the width of each strand as a share of the way along the other from
    crossing to crossing, the lesser of both: none wants a fastener where that is ``TIGHT_COVER``
    or more, all do at ``LOOSE_COVER`` and less, and in between as many as is proportional.

    Parameters
    ----------
    ribbons : Ribbons
    threads : Threads
    bend_t : float
        The tightest radius that any of the materials takes, in thicknesses; what is softer than
        ``STIFF_T`` wants fasteners at all crossings.

    Returns
    -------
    (X,) float array
        From 0 to 1.
    """
    count = len(threads.crossing)
    if bend_t < STIFF_T or not count:
        return np.ones(threads.n_crossings)
    entry, centre = ribbons.entry, ribbons.centre[threads.crossing]
    width = np.linalg.norm(ribbons.left - ribbons.right, axis=1)
    width = (width[entry] + width[entry + 1]) / 2.0
    there = threads.woven
    first, last = threads.offsets[:-1][there], threads.offsets[1:][there] - 1
    following = np.arange(1, count + 1)
    following[last] = first
    ahead = np.linalg.norm(centre[following] - centre, axis=1)
    behind = np.empty(count)
    behind[following] = ahead
    # An open thread has a neighbour on one side only at its ends.
    loose = ~threads.closed[there]
    ahead[last[loose]], behind[first[loose]] = behind[last[loose]], ahead[first[loose]]
    cover = width[other_passes(threads)] * 2.0 / np.maximum(ahead + behind, 1e-9)
    least = np.full(threads.n_crossings, np.inf)
    np.minimum.at(least, threads.crossing, cover)
    return np.asarray(np.clip((TIGHT_COVER - least) / (TIGHT_COVER - LOOSE_COVER), 0.0, 1.0))


def spread_fasteners(
    shares: FloatArray, alike: IntArray, weave: Weave, fastened: BoolArray
) -> BoolArray:
    """Fasten a share of the crossings, spread evenly along the threads, (X,).

    Each crossing has a number between 0 and 1, far from those of its neighbours on the thread that
    lies on top, and is fastened if its share is larger: what is fastened at some shares is so at
    larger ones. Crossings that are alike are fastened together.

    Parameters
    ----------
    shares : (X,) float array
    alike : (X,) int array
        Numbers of crossings, which alike ones share.
    weave : Weave
    fastened : (X,) bool array
        What is fastened whatever its share.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> from fabweave.weave.pattern import plain_weave
    >>> from fabweave.weave.threads import trace_threads
    >>> weave = plain_weave(trace_threads(build_halfedges(parse_shape("shape:torus?m=8&n=4"))))
    >>> none, each = np.zeros(64, dtype=bool), np.arange(64)
    >>> [int(spread_fasteners(np.full(64, s), each, weave, none).sum()) for s in (0, 0.25, 0.5, 1)]
    [0, 16, 32, 64]
    """
    own = alike[weave.threads.crossing[weave.over]]
    groups, seen = np.unique(own, return_index=True)
    # Bits in reverse order: any run of numbers is spread over the whole range.
    bits = max(len(groups) - 1, 1).bit_length()
    rank = np.argsort(np.argsort(seen))
    turned = sum((rank >> bit & 1) << (bits - 1 - bit) for bit in range(bits))
    level = np.zeros(int(alike.max(initial=0)) + 1)
    level[groups] = (np.argsort(np.argsort(turned)) + 0.5) / max(len(groups), 1)
    share = np.zeros(len(level))
    np.maximum.at(share, alike[~fastened], shares[~fastened])
    return np.asarray(fastened | (share > level)[alike])


_HUNG = re.compile(r"(?P<side>top|bottom)(?::(?P<count>\d{1,2}))?|(?P<number>\d{1,9})", re.ASCII)
#: Of several at one side, none is nearer to the middle than the farthest crossing by this factor.
_SPREAD = 3.0
#: Heights that differ by less are the same, millimetres; and directions, as shares of a turn.
_LEVEL_MM, _SAME_TURN = 1e-3, 1e-6


@dataclass(frozen=True)
class Hanging:
    """Which crossings are wanted: numbers, and how many at the top and at the bottom."""

    numbers: tuple[int, ...]
    top: int = 0
    bottom: int = 0


def parse_hanging(text: str) -> Hanging:
    """Read what is typed for crossings that carry something.

    Raises
    ------
    InputError
        If it reads otherwise, or asks for none of a side.

    Examples
    --------
    >>> parse_hanging("top, bottom:3, 17")
    Hanging(numbers=(17,), top=1, bottom=3)
    """
    numbers, sides = set(), {"top": 0, "bottom": 0}
    for part in "".join(text.lower().split()).split(","):
        match = _HUNG.fullmatch(part)
        if match is None or match["count"] in ("0", "00"):
            raise InputError(
                f"{part[:40]!r} does not say which crossings carry something: write top, "
                "bottom:3 for three feet, or numbers of crossings, with commas between them"
            )
        if match["number"]:
            numbers.add(int(match["number"]))
        else:
            sides[match["side"]] = int(match["count"] or 1)
    return Hanging(tuple(sorted(numbers)), **sides)


def hanging_crossings(hanging: Hanging, centre: FloatArray) -> BoolArray:
    """Say which crossings carry something, (X,).

    One at a side is the topmost or lowest crossing. Of several, each is that of its own sector
    around the middle of the object, of those that stand a third of the farthest out or more.

    Parameters
    ----------
    hanging : Hanging
    centre : (X, 3) float array
        Where the crossings are.

    Raises
    ------
    InputError
        If there is no crossing of a number, or none in a sector.

    Examples
    --------
    >>> places = np.array([[0.0, 0, 9], [3, 0, 5], [3, 1, 4], [-3, 1, 5], [-3, 0, 4]])
    >>> hanging_crossings(parse_hanging("top,bottom:2"), places).tolist()
    [True, False, True, False, True]
    """
    chosen = np.zeros(len(centre), dtype=np.bool_)
    if hanging.numbers and hanging.numbers[-1] >= len(centre):
        raise InputError(
            f"there is no crossing {hanging.numbers[-1]} to carry something; they are numbered "
            f"from 0 to {len(centre) - 1}"
        )
    chosen[list(hanging.numbers)] = True
    offset = centre[:, :2] - (centre[:, :2].min(axis=0) + centre[:, :2].max(axis=0)) / 2.0
    away = np.hypot(*offset.T)
    turns = np.arctan2(offset[:, 1], offset[:, 0]) / (2.0 * np.pi) + _SAME_TURN
    for count, up in ((hanging.top, 1.0), (hanging.bottom, -1.0)):
        height = np.rint(up * centre[:, 2] / _LEVEL_MM)
        sector = np.floor((turns % 1.0) * max(count, 1)).astype(np.int64)
        for number in range(count):
            there = np.ones(len(centre), dtype=np.bool_)
            if count > 1:
                there = (sector == number) & (away >= away.max() / _SPREAD)
            if not there.any():
                raise InputError(
                    f"there are not {count} crossings around the middle to carry something; name "
                    "them by number"
                )
            chosen[np.flatnonzero(there)[np.argmax(height[there])]] = True
    return chosen
