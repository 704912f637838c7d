"""Say which crossings take a fastener, and which carry something."""

import re
from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray
from fabweave.core.errors import InputError
from fabweave.core.units import parse_length
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.piece.congruence import DECIMALS
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads

_TEXT = re.compile(
    r"((?P<kind>joints|form|all|rim|glue|none)|form:(?P<bound>[^,]{1,20})|every:(?P<count>\d{1,4}))"
    r"(?P<also>(,\d{1,9})*)",
    re.ASCII,
)


@dataclass(frozen=True)
class Fastening:
    """Which crossings take a fastener: ``kind``; of how many one; and how far an object may go.

    Parameters
    ----------
    kind : "joints", "form", "all", "rim", "glue", "none" or "every"
        ``glue`` is glue at all crossings, and fasteners at joints.
    every : int
        For ``every``.
    bound_mm : float or None
        For ``form``; None for what is usual.
    also : tuple of int
        Crossings that take one besides.
    """

    kind: str
    every: int = 1
    bound_mm: float | None = None
    also: tuple[int, ...] = ()


def parse_fastening(text: str) -> Fastening:
    """Read what is typed for the crossings that take a fastener.

    Raises
    ------
    InputError
        If it is none of the kinds, or counts fewer than two.

    Examples
    --------
    >>> parse_fastening("every:2")
    Fastening(kind='every', every=2, bound_mm=None, also=())
    >>> parse_fastening("rim, 17,4").also
    (4, 17)
    """
    match = _TEXT.fullmatch("".join(text.lower().split()))
    if match is None or (match["count"] and int(match["count"]) < 2):
        raise InputError(
            f"{text[:40]!r} does not say which crossings take a fastener: write joints, form, "
            "form:3mm to go no farther than that, all, rim, glue, none, or every:2 for one "
            "crossing of two; numbers of crossings may follow, as in form,12,40"
        )
    also = tuple(sorted({int(number) for number in match["also"].split(",")[1:]}))
    if match["bound"]:
        return Fastening("form", bound_mm=parse_length(match["bound"]), also=also)
    return Fastening(match["kind"] or "every", int(match["count"] or 1), also=also)


def fastened_crossings(
    fastening: Fastening, weave: Weave, halfedges: Halfedges, joints: IntArray
) -> BoolArray:
    """Say which crossings are to take a fastener, (X,).

    Of every N crossings one is fastened: the first at which a thread passes over, and every N-th
    after it along that thread. The rim are the crossings of the edges that follow an edge of the
    boundary around its face, or that it follows. To keep the form, the ends of threads are
    fastened, and on top of these what :class:`fabweave.form.hold.Hold` says.

    Parameters
    ----------
    fastening : Fastening
    weave : Weave
    halfedges : Halfedges
        Of the woven mesh.
    joints : (J,) int array
        The crossings with joints, which are fastened unless none are.

    Raises
    ------
    InputError
        If there is no crossing of a number.
    """
    threads = weave.threads
    count = threads.n_crossings
    if fastening.also and fastening.also[-1] >= count:
        raise InputError(
            f"there is no crossing {fastening.also[-1]} to fasten; they are numbered from 0 to "
            f"{count - 1}"
        )
    wanted = np.full(count, fastening.kind == "all")
    wanted[list(fastening.also)] = True
    if fastening.kind in ("all", "none"):
        return wanted
    if fastening.kind == "every":
        over = np.flatnonzero(weave.over)
        first = np.searchsorted(over, threads.offsets[threads.thread_of_pass[over]])
        nth = np.arange(len(over)) - first
        wanted[threads.crossing[over]] |= nth % fastening.every == 0
    elif fastening.kind == "rim":
        wanted |= beside_edges(threads, halfedges, halfedges.twin < 0)
    elif fastening.kind == "form":
        own = ~threads.closed & threads.woven
        ends = np.concatenate((threads.offsets[:-1][own], threads.offsets[1:][own] - 1))
        wanted[threads.crossing[ends]] = True
    wanted[joints] = True
    return np.asarray(wanted)


def foot_crossings(threads: Threads, halfedges: Halfedges, mesh: PolyMesh) -> BoolArray:
    """Say at which crossings an object is tied to a base, (X,): those beside rims at the ground.

    They are no higher above the lowest of these than half of what edges measure in the mean.

    Parameters
    ----------
    threads : Threads
    halfedges : Halfedges
    mesh : PolyMesh
        As it is to be in the end; z points up.

    Raises
    ------
    InputError
        If the mesh has no rim, or reaches below it.
    """
    rim = beside_edges(threads, halfedges, halfedges.twin < 0)
    if not rim.any():
        raise InputError(
            "--base ties the rim of an open object to a board, and this object has none; leave "
            "--base out"
        )
    ends = mesh.vertices[np.stack([halfedges.tail, halfedges.head])]
    pitch_mm = float(np.linalg.norm(ends[1] - ends[0], axis=1).mean())
    height = ends[:, threads.crossing_halfedge, 2].mean(axis=0) - mesh.vertices[:, 2].min()
    if height[rim].min() > pitch_mm:
        raise InputError(
            f"--base ties a rim to a board, and this object reaches {height[rim].min():.0f} mm "
            "below its rim; leave --base out, or turn it (--up)"
        )
    return np.asarray(rim & (height <= height[rim].min() + pitch_mm / 2.0))


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


_HUNG = re.compile(r"(?P<side>top|bottom)(?::(?P<count>\d{1,2}))?|(?P<number>\d{1,9})", re.ASCII)
_LOAD = re.compile(r"(?P<mass>\d{1,9}(?:\.\d{1,6})?)(?P<unit>kg|g|oz|lb)(?:@(?P<where>.+))?", re.A)
#: Kilograms.
_MASSES = {"g": 1e-3, "kg": 1.0, "oz": 0.028349523125, "lb": 0.45359237}
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


def parse_load(text: str) -> tuple[float, Hanging]:
    """Read what is typed for a load: kilograms, and which crossings bear it, by default the top.

    Raises
    ------
    InputError
        If it reads otherwise, or is nothing.

    Examples
    --------
    >>> parse_load("200 g @ top")
    (0.2, Hanging(numbers=(), top=1, bottom=0))
    """
    match = _LOAD.fullmatch("".join(text.lower().split()))
    if match is None or float(match["mass"]) == 0.0:
        raise InputError(
            f"{text[:40]!r} is no load: write a mass in g, kg, oz or lb, and where it hangs, such "
            "as 200g@top or 1.5kg@bottom:3"
        )
    mass_kg = float(match["mass"]) * _MASSES[match["unit"]]
    return mass_kg, parse_hanging(match["where"] or "top")


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
    # As the map tells where they are: of two that are as high, all choose the same.
    centre = centre.round(DECIMALS)
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
