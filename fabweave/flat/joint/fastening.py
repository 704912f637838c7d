"""Say which crossings take a fastener: all, those with joints, the rim as well, or every so many.

A weave that is tight enough holds itself, as baskets do; then only laps want a fastener.
"""

import re
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.ribbon.project import Ribbons
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

#: A weave holds itself if half of its ribbons are at least so wide, as a share of the way from
#: crossing to crossing: strands then bear on one another nearly all along. A maker's estimate.
TIGHT_SHARE = 0.5
#: And if no material bends tighter than so many thicknesses: felt and leather do, and slip.
STIFF_T = 15.0

_TEXT = re.compile(r"(?P<kind>joints|all|rim|none|every:(?P<count>\d{1,4}))", re.ASCII)


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
            f"{text[:40]!r} does not say which crossings take a fastener: write joints, all, rim, "
            "none, or every:2 for one crossing of two"
        )
    return Fastening(match["kind"].partition(":")[0], int(match["count"] or 1))


def fastened_crossings(
    fastening: Fastening, weave: Weave, halfedges: Halfedges, joints: IntArray
) -> BoolArray:
    """Say which crossings are to take a fastener, (X,).

    Of every N crossings one is fastened: the first at which a thread passes over, and every N-th
    after it along that thread. The rim are the crossings of the edges that follow an edge of the
    boundary around its face, or that it follows.

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


def holds_itself(ribbons: Ribbons, threads: Threads, bend_t: float) -> bool:
    """Say whether a weave is so tight and so stiff that only its joints want fasteners.

    Parameters
    ----------
    ribbons : Ribbons
    threads : Threads
    bend_t : float
        The tightest radius that any of its materials takes, in thicknesses.
    """
    if bend_t < STIFF_T or not len(threads.crossing):
        return False
    entry = ribbons.entry
    middle = (ribbons.right[entry] + ribbons.left[entry]) / 2.0
    width = np.linalg.norm(ribbons.left[entry] - ribbons.right[entry], axis=1)
    same = threads.thread_of_pass[1:] == threads.thread_of_pass[:-1]
    way = np.linalg.norm(np.diff(middle, axis=0), axis=1)[same]
    return bool(len(way) and np.median(width) >= TIGHT_SHARE * np.median(way))
