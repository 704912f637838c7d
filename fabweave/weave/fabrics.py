"""Weave twills over a and under b, and satins, where warp and weft exist and the labels close."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.messages import few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.topology import ParityClasses, label_links, solve_parity
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave
from fabweave.weave.threads import Threads, thread_labels
from fabweave.weave.twill.decide import Obstruction

#: Longest repeat; a window of passes fits a 64-bit integer.
_LONGEST = 60


@dataclass(frozen=True)
class Fabric:
    """A fabric whose every thread repeats one sequence, shifted from thread to thread.

    Crossings carry labels modulo ``repeat``, which step by 1 from crossing to crossing along the
    weft and by ``shift`` along the warp; the warp lies on top where the label is less than
    ``over``.

    Parameters
    ----------
    over : int
        How many weft threads the warp passes over in a repeat.
    under : int
        How many it passes under.
    shift : int
        Steps from one weft thread to the next. 1 makes a twill: then the warp goes over ``over``
        in succession and under ``under``. A shift and its negative are one fabric in two hands:
        the smaller of both is kept.
    hand : {"", "S", "Z"}
        Which of the two is wanted; "" if either will do. Seen from outside with the warp upright,
        the diagonal of Z rises to the right and that of S to the left.

    Examples
    --------
    >>> fabric = Fabric(3, 1)
    >>> fabric.repeat, str(fabric), str(Fabric(4, 1, 2))
    (4, '3/1', 'satin:5/2')
    """

    over: int
    under: int
    shift: int = 1
    hand: str = ""

    def __post_init__(self) -> None:
        """Refuse what is not a fabric, and write the shift as the smaller of the two ways round."""
        if self.over < 1 or self.under < 1:
            raise InputError(
                f"a fabric goes over 1 or more and under 1 or more, not {self.over}/{self.under}"
            )
        if self.repeat > _LONGEST:
            raise InputError(f"a fabric repeats after at most {_LONGEST}, not {self.repeat}")
        if math.gcd(self.shift, self.repeat) > min(self.over, self.under):
            raise InputError(
                f"with the shift {self.shift} some threads of a {self.over}/{self.under} fabric "
                "would always lie on one side and fall off; a shift without a common divisor with "
                f"{self.repeat} works, such as 1"
            )
        shift = self.shift % self.repeat
        object.__setattr__(self, "shift", min(shift, self.repeat - shift))

    @property
    def repeat(self) -> int:
        """Number of crossings after which a thread's sequence repeats."""
        return self.over + self.under

    @property
    def handed(self) -> bool:
        """Whether the fabric differs from its mirror image."""
        return 2 * self.shift != self.repeat

    def __str__(self) -> str:
        """Write the fabric as :func:`parse_fabric` reads it."""
        if self.hand:
            return f"{self.over}/{self.under}/{'-' if self.hand == 'S' else ''}{self.shift}"
        if self.shift != 1:
            if self.under == 1:
                return f"satin:{self.repeat}/{self.shift}"
            if self.over == 1:
                return f"sateen:{self.repeat}/{self.shift}"
        return f"{self.over}/{self.under}" + (f"/{self.shift}" if self.shift != 1 else "")


def parse_fabric(text: str) -> Fabric:
    """Read a fabric: ``a/b``, ``a/b/shift``, ``satin:n/shift`` or ``sateen:n/shift``.

    Parameters
    ----------
    text : str
        How many weft threads the warp passes over and under, and the shift from one weft thread
        to the next. A positive shift leads the diagonal to the right, a negative one to the left;
        where it is left out, it is 1 to either side. A satin shows the warp: over n - 1, under 1.
        A sateen shows the weft. Both have either hand.

    Returns
    -------
    Fabric

    Raises
    ------
    InputError
        If the text is something else, or the fabric would fall apart.

    Examples
    --------
    >>> parse_fabric("3/1"), parse_fabric("2/2/-1")
    (Fabric(over=3, under=1, shift=1, hand=''), Fabric(over=2, under=2, shift=1, hand='S'))
    >>> parse_fabric("satin:5/2")
    Fabric(over=4, under=1, shift=2, hand='')
    """
    twill = re.fullmatch(r"(\d{1,3})/(\d{1,3})(?:/(-?\d{1,3}))?", text.strip(), re.ASCII)
    if twill:
        fabric = Fabric(int(twill[1]), int(twill[2]), int(twill[3] or 1))
        if twill[3] is None or not fabric.handed:
            return fabric
        right = int(twill[3]) % fabric.repeat == fabric.shift
        return replace(fabric, hand="Z" if right else "S")
    satin = re.fullmatch(r"(satin|sateen):(\d{1,3})/(-?\d{1,3})", text.strip(), re.ASCII)
    if not satin or int(satin[2]) < 3:
        raise InputError(
            f"{text[:40]!r} is not a fabric; write a/b such as 3/1 or 2/2, a/b/shift such as "
            "2/2/1, or satin:n/shift such as satin:5/2"
        )
    ends, shift = int(satin[2]), int(satin[3])
    return Fabric(ends - 1, 1, shift) if satin[1] == "satin" else Fabric(1, ends - 1, shift)


#: So many irregular gaps and threads are named.
_NAMED = 4


@frozen_value
class Strands:
    """Warp and weft, with directions.

    Parameters
    ----------
    warp : (T,) bool array
        Whether each thread belongs to the warp (which of two bunches that is, is a free choice in
        each body of the weave).
    group : (T,) int array
        Threads of one group have directions relative to one another; threads whose direction does
        not matter are one group together.
    reversed : (T,) bool array
        Whether a thread runs against the way it is walked, if the first thread of its group does
        not.
    """

    warp: BoolArray
    group: IntArray
    reversed: BoolArray


def part_strands(
    halfedges: Halfedges,
    threads: Threads,
    labels: Sequence[str],
    *,
    warp_runs: bool = True,
    weft_runs: bool = True,
) -> Strands | Obstruction:
    """Part the threads into warp and weft, and give neighbours the same direction.

    Every thread of the one crosses only threads of the other. Two threads are neighbours where
    they run along opposite sides of a gap of four crossings. The parting is a two-colouring, the
    directions are another; both are solved exactly.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    labels : sequence of str
        Names of the threads, for the words.
    warp_runs, weft_runs : bool
        Whether directions matter in the warp and in the weft.

    Returns
    -------
    Strands or Obstruction
        The obstruction names gaps that an odd number of threads surround, a thread that crosses
        itself, threads that cross one another in an odd ring, or such as cannot all run the same
        way.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids, solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(6, 4, 35.0, 15.0))
    >>> part_strands(halfedges, trace_threads(halfedges), "ABCD").warp.tolist()
    [True, False, True, False]
    >>> halfedges = build_halfedges(solids.cube())
    >>> part_strands(halfedges, trace_threads(halfedges), "ABCD").text
    'warp and weft do not exist: an odd number of strands cross in a ring around vertex 0, \
vertex 1, vertex 2, vertex 3 and 4 more'
    """
    bunches = _two_bunches(halfedges, threads, labels)
    if isinstance(bunches, Obstruction):
        return bunches
    warp = ~bunches.opposite
    runs = np.where(warp, warp_runs, weft_runs)
    passed, ways = _corner_walks(halfedges, threads)
    side, other = _opposite_sides(halfedges)
    first, second = passed[side], passed[other]
    matters = runs[first]
    # Round a gap, opposite sides are passed in opposite senses by threads that run the same way.
    turned = ways[side] == ways[other]
    solution = solve_parity(threads.n_threads, first[matters], second[matters], turned[matters])
    if solution.odd_ring:
        why, ring = "strands side by side cannot all run the same way", solution.odd_ring
        uneven = f"{why}; not a multiple of 4 cross in a ring around "
        return _irregular(halfedges, 4, uneven) or Obstruction(
            f"{why}, on {_named(ring, labels)}", threads=ring
        )
    group = np.where(runs, solution.classes, solution.n_classes)
    return Strands(warp, group, solution.opposite & runs)


def _two_bunches(
    halfedges: Halfedges, threads: Threads, labels: Sequence[str]
) -> ParityClasses | Obstruction:
    """Two-colour the threads, or say why not."""
    # An odd gap tells a person more than the threads do: it is a place that can be remeshed.
    none = "warp and weft do not exist: "
    odd = _irregular(halfedges, 2, f"{none}an odd number of strands cross in a ring around ")
    if odd is not None:
        return odd
    thread = threads.thread_of_pass
    pairs = np.unique(thread[np.argsort(threads.crossing, kind="stable")].reshape(-1, 2), axis=0)
    ring = tuple(pairs[pairs[:, 0] == pairs[:, 1], 0][:1].tolist())
    if not ring:
        crosses = np.ones(len(pairs), dtype=bool)
        solution = solve_parity(threads.n_threads, pairs[:, 0], pairs[:, 1], crosses)
        if not solution.odd_ring:
            return solution
        ring = solution.odd_ring
    how = "cross in a ring" if len(ring) > 1 else "crosses itself"
    return Obstruction(f"{none}{_named(ring, labels)} {how}", threads=ring)


def _named(ring: Sequence[int], labels: Sequence[str]) -> str:
    return f"thread{'s' * (len(ring) > 1)} {few_of([labels[thread] for thread in ring], _NAMED)}"


def _irregular(halfedges: Halfedges, multiple: int, why: str) -> Obstruction | None:
    """Name the gaps whose number of crossings is no multiple of a number, vertices first."""
    sides = np.bincount(halfedges.face)
    sides[halfedges.face[halfedges.twin < 0]] = 0
    vertices, valences = interior_valences(halfedges)
    vertex = tuple(vertices[valences % multiple != 0].tolist())
    face = tuple(np.flatnonzero(sides % multiple).tolist())
    gaps = [*(f"vertex {at}" for at in vertex), *(f"face {at}" for at in face)]
    if not gaps:
        return None
    return Obstruction(why + few_of(gaps, _NAMED), vertices=vertex[:_NAMED], faces=face[:_NAMED])


def _corner_walks(halfedges: Halfedges, threads: Threads) -> tuple[IntArray, BoolArray]:
    """Return the thread through each corner, -1 where no pass leads there, and which way."""
    twin = halfedges.twin[threads.halfedge]
    # After its crossing a thread that arrived forward passes a corner backward.
    corner = np.where(threads.forward, halfedges.prev[twin], twin)
    passed = np.full(halfedges.n_halfedges, -1, dtype=np.int64)
    ways = np.zeros(halfedges.n_halfedges, dtype=bool)
    passed[corner] = threads.thread_of_pass
    ways[corner] = ~threads.forward
    return passed, ways


def _opposite_sides(halfedges: Halfedges) -> tuple[IntArray, IntArray]:
    """Return the pairs of corners that are opposite sides of a gap of four crossings."""
    around_vertex = halfedges.twin[halfedges.next]
    pairs = []
    for turn in (halfedges.next, around_vertex):
        inner = halfedges.twin >= 0
        corner = np.flatnonzero(inner)
        at = [corner]
        good = np.ones(len(corner), dtype=bool)
        for _ in range(4):
            following = turn[at[-1]]
            good &= (following >= 0) & inner[following]
            at.append(following)
        good &= (at[4] == corner) & (at[2] > corner)
        pairs.append((corner[good], at[2][good]))
    return (
        np.concatenate([first for first, _ in pairs]),
        np.concatenate([second for _, second in pairs]),
    )


#: So many free directions are tried out in all combinations.
_MOST_GROUPS = 14


@frozen_value
class Crossings:
    """Some crossings, each as a pass of the warp and one of the weft.

    Parameters
    ----------
    warp, weft : (N,) int arrays
        The threads.
    warp_at, weft_at : (N,) int arrays
        How many passes come before on each.
    right : (N,) bool array
        Whether the weft runs to the right as one looks along the warp, seen from outside, both as
        they are walked.
    """

    warp: IntArray
    weft: IntArray
    warp_at: IntArray
    weft_at: IntArray
    right: BoolArray

    def swapped(self) -> "Crossings":
        """Return the same crossings with warp and weft exchanged."""
        return Crossings(self.weft, self.warp, self.weft_at, self.warp_at, ~self.right)

    def some(self, which: IntArray) -> "Crossings":
        """Return some of the crossings."""
        return Crossings(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


def sort_crossings(threads: Threads, warp: BoolArray) -> Crossings:
    """Sort the two passes of every crossing into warp and weft.

    Parameters
    ----------
    threads : Threads
        The walks.
    warp : (T,) bool array
        Whether each thread belongs to the warp; none may cross its own kind.

    Returns
    -------
    Crossings
        All crossings in order.
    """
    thread = threads.thread_of_pass
    at = np.arange(len(thread)) - threads.offsets[thread]
    first, second = np.argsort(threads.crossing * 2 + ~warp[thread], kind="stable").reshape(-1, 2).T
    # Along the crossing's half-edge, a forward pass lies on the diagonal that rises to the right
    # and a backward one on that which rises to the left; each may be walked up or down.
    up = (threads.halfedge == threads.crossing_halfedge[threads.crossing]) == threads.forward
    return Crossings(
        thread[first],
        thread[second],
        at[first],
        at[second],
        (up[first] == up[second]) != threads.forward[first],
    )


def part_bodies(crossings: Crossings) -> list[IntArray]:
    """Return the crossings of each connected body of a weave."""
    if not len(crossings.warp):
        return []
    count = int(max(crossings.warp.max(), crossings.weft.max())) + 1
    body_of_crossing = label_links(crossings.warp, crossings.weft, count)[1][crossings.warp]
    order = np.argsort(body_of_crossing, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(body_of_crossing[order])) + 1)


def label_body(
    threads: Threads,
    strands: Strands,
    crossings: Crossings,
    fabric: Fabric,
    names: Sequence[str],
) -> tuple[IntArray, str] | Obstruction:
    """Label the crossings of one body, or say why no labels close.

    The unknowns are the labels of the threads' first passes; each crossing says that both of its
    passes have one label. How labels step along a thread depends on the direction of its group, so
    all equations are kept linear in the groups' directions: a spanning tree of the threads solves
    for the unknowns, what remains are a few conditions on the directions, and those are tried out.

    Parameters
    ----------
    threads, strands
        The walks and their directions.
    crossings : Crossings
        The crossings of one body.
    fabric : Fabric
        Repeat, shift, and the hand that is wanted, or any, one throughout if possible.
    names : sequence of str
        Names of the threads, for the words.

    Returns
    -------
    label : (N,) int array
        The label of each crossing modulo the repeat.
    hand : str
        "S" or "Z", "mixed", or "" for a fabric without hands.
    Or an Obstruction in place of both.
    """
    off = _rings_off(threads, crossings, fabric, names)
    if off is not None:
        return off
    size, hand = fabric.repeat, fabric.hand or None
    known, local = np.unique(np.concatenate((crossings.warp, crossings.weft)), return_inverse=True)
    warp, weft = local.reshape(2, -1)
    # Along a thread of one crossing no label steps, so its direction does not matter.
    steps = np.bincount(local.reshape(-1), minlength=len(known)) > 1
    groups, group = np.unique(np.where(steps, strands.group[known], -1), return_inverse=True)
    group = group.reshape(-1)
    if np.count_nonzero(groups >= 0) > _MOST_GROUPS:
        return Obstruction(
            f"the threads fall into {len(groups)} groups that share no direction, too many to try "
            f"all, so it remains open whether this mesh can carry the fabric {fabric}"
        )
    sense = np.where(strands.reversed[known], -1, 1)
    rows = np.arange(len(warp))
    step = np.zeros((len(warp), len(groups)), dtype=np.int64)
    step[rows, group[weft]] += sense[weft] * crossings.weft_at
    step[rows, group[warp]] -= sense[warp] * crossings.warp_at * fabric.shift
    step %= size
    start = _add_up(len(known), weft, warp, step) % size
    unlike, example = np.unique(
        (start[weft] + step - start[warp]) % size, axis=0, return_index=True
    )
    lines = sense[warp] * sense[weft] * np.where(crossings.right, 1, -1)
    both = steps[warp] & steps[weft]
    pairs = np.unique(np.column_stack((group[warp], group[weft], lines))[both], axis=0)

    chosen: tuple[IntArray, str] | None = None
    for signs in product((1, -1), repeat=len(groups) - 1):
        way = np.array((*signs, 1))
        if (unlike @ way % size).any():
            continue
        line_hand = _hand(way, pairs) if fabric.handed else ""
        if (
            chosen is None
            or line_hand == hand
            or (hand is None and chosen[1] == "mixed" != line_hand)
        ):
            chosen = way, line_hand
        if line_hand in (hand, "") or (hand is None and line_hand != "mixed"):
            break
    if chosen is None:
        # All directions alike are one of the choices that fail.
        at = example[np.flatnonzero(unlike.sum(axis=1) % size)[0]]
        pair = known[warp[at]].item(), known[weft[at]].item()
        return Obstruction(
            "whichever way the threads run, the pattern does not match up everywhere, as where "
            f"{_named(pair, names)} cross",
            threads=pair,
        )
    if hand is not None and chosen[1] not in (hand, ""):
        return Obstruction(f"the pattern closes, but not with the hand {hand} everywhere")
    way = chosen[0]
    label = (start @ way)[weft] + (way[group] * sense)[weft] * crossings.weft_at
    return label % size, chosen[1]


def _hand(way: IntArray, pairs: IntArray) -> str:
    """Return how the lines of equal labels rise, the warp upright."""
    # Steps of one sign to the right and upwards: equal labels lie to the left and up.
    line = way[pairs[:, 0]] * way[pairs[:, 1]] * pairs[:, 2]
    if not len(line):
        return ""
    if (line != line[0]).any():
        return "mixed"
    return "S" if line[0] > 0 else "Z"


def _rings_off(
    threads: Threads, crossings: Crossings, fabric: Fabric, names: Sequence[str]
) -> Obstruction | None:
    """Find rings round which the labels do not come back to themselves."""
    thread = np.concatenate((np.unique(crossings.warp), np.unique(crossings.weft)))
    step = np.where(np.isin(thread, crossings.warp), fabric.shift, 1)
    off = threads.closed[thread] & (threads.lengths[thread] * step % fabric.repeat != 0)
    if not off.any():
        return None
    first = int(np.argmax(off))
    multiple = fabric.repeat // math.gcd(int(step[first]), fabric.repeat)
    wrong = tuple(thread[off].tolist())
    return Obstruction(
        f"the pattern does not close round {_named(wrong, names)}: the number of crossings, "
        f"{threads.lengths[thread[first]]} for the first, must be a multiple of {multiple}",
        threads=tuple(sorted(wrong)[:_NAMED]),
    )


def _add_up(count: int, first: IntArray, second: IntArray, step: IntArray) -> IntArray:
    """Return how far each thread is from thread 0 along a spanning tree of the crossings.

    Parameters
    ----------
    count : int
        Number of threads, all connected.
    first, second : (N,) int arrays
        The threads of each crossing.
    step : (N, K) int array
        How far it is from the first to the second, in columns that are added up apart.

    Returns
    -------
    (count, K) int array
    """
    # One crossing for each pair of threads, numbered from one as a zero would not be a link.
    pair, number = np.unique(first * count + second, return_index=True)
    a, b = pair // count, pair % count
    links = sparse.coo_array(
        (
            np.concatenate((number + 1, -(number + 1))),
            (np.concatenate((a, b)), np.concatenate((b, a))),
        ),
        shape=(count, count),
    ).tocsr()
    _, before = csgraph.breadth_first_order(links, 0, directed=True, return_predecessors=True)
    parent = np.where(before < 0, np.arange(count), before).astype(np.int64)
    far = np.zeros((count, step.shape[1]), dtype=np.int64)
    child = np.flatnonzero(before >= 0)
    entry = np.asarray(links[parent[child], child]).reshape(-1).astype(np.int64)
    far[child] = np.sign(entry)[:, None] * step[np.abs(entry) - 1]
    # Each round doubles how many links of the tree are added up.
    while (parent != parent[parent]).any():
        far, parent = far + far[parent], parent[parent]
    return far


@frozen_value
class FabricWeave:
    """A fabric on a mesh, exact everywhere, or what keeps the mesh from it.

    Parameters
    ----------
    weave : Weave or None
        The weave.
    obstruction : Obstruction or None
        Why there is none, in words.
    warp : (T,) bool array or None
        Which threads are the warp; None for plain weave, which needs none.
    label : (X,) int array or None
        The label of each crossing modulo the repeat.
    hand : str
        "S" or "Z" as the twill line rises seen from outside, the warp upright; "mixed"; or ""
        where there is no hand.
    """

    weave: Weave | None = None
    obstruction: Obstruction | None = None
    warp: BoolArray | None = None
    label: IntArray | None = None
    hand: str = ""


def weave_fabric(
    halfedges: Halfedges,
    threads: Threads,
    fabric: Fabric,
    labels: Sequence[str] | None = None,
) -> FabricWeave:
    """Weave a fabric exactly, or say what obstructs it.

    Crossings get labels modulo the repeat that step by one along every weft thread and by the
    shift along every warp thread. Neighbouring threads run the same way; what directions that
    leaves free, and which bunch is the warp, are tried out in all combinations. For each, the
    equations at all crossings either have a solution or not, so the answer is a decision.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    fabric : Fabric
        The fabric; 1/1 is plain weave, which exists on every mesh. Where it has no hand, any will
        do, in each body one hand throughout if possible. A cloth turned by a quarter has the other
        hand, as its weft has become its warp: a closed weave often allows both by the choice of
        the warp.
    labels : sequence of str, optional
        Names of the threads, for the words.

    Returns
    -------
    FabricWeave
        With a weave or an obstruction.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(torus(8, 4, 35.0, 15.0))
    >>> result = weave_fabric(halfedges, trace_threads(halfedges), Fabric(3, 1))
    >>> result.weave.pattern, int(result.weave.over.sum())
    ('3/1', 64)
    >>> halfedges = build_halfedges(torus(7, 5, 35.0, 15.0))
    >>> weave_fabric(halfedges, trace_threads(halfedges), Fabric(3, 1)).obstruction.text
    'the pattern does not close round threads A, B: the number of crossings, 70 for the first, \
must be a multiple of 4'

    References
    ----------
    B. Grünbaum, G. C. Shephard, "Satins and twills: an introduction to the geometry of fabrics",
    Mathematics Magazine 53(3), 1980.
    """
    if fabric.repeat == 2:
        return FabricWeave(plain_weave(threads))
    names = thread_labels(threads.n_threads) if labels is None else labels
    candidates = _candidates(halfedges, threads, fabric, names)
    if isinstance(candidates, Obstruction):
        return FabricWeave(obstruction=candidates)
    return _weave_bodies(threads, candidates, fabric, names)


def _candidates(
    halfedges: Halfedges, threads: Threads, fabric: Fabric, names: Sequence[str]
) -> list[tuple[Strands, Crossings]] | Obstruction:
    """Return the ways to choose a warp and what runs where, in the order in which to try them."""
    if fabric.handed:
        strands = part_strands(halfedges, threads, names)
        if isinstance(strands, Obstruction):
            return strands
        crossings = sort_crossings(threads, strands.warp)
        return [(strands, crossings), (strands, crossings.swapped())]
    # Half the repeat one way is half the repeat the other way: the warp may run as it likes.
    candidates: list[tuple[Strands, Crossings]] = []
    reason: Obstruction | None = None
    for swap in (False, True):
        strands = part_strands(halfedges, threads, names, warp_runs=swap, weft_runs=not swap)
        if isinstance(strands, Obstruction):
            reason = reason or strands
            continue
        crossings = sort_crossings(threads, strands.warp)
        candidates.append((strands, crossings.swapped() if swap else crossings))
    return reason if reason is not None and not candidates else candidates


def _weave_bodies(
    threads: Threads,
    candidates: list[tuple[Strands, Crossings]],
    fabric: Fabric,
    names: Sequence[str],
) -> FabricWeave:
    """Label the bodies of the weave one by one, and put over and under where the labels say."""
    warp = np.array(candidates[0][0].warp)
    label = np.zeros(threads.n_crossings, dtype=np.int64)
    hands = set()
    for body in part_bodies(candidates[0][1]):
        reason: Obstruction | None = None
        for strands, crossings in candidates:
            body_crossings = crossings.some(body)
            labelling = label_body(threads, strands, body_crossings, fabric, names)
            if not isinstance(labelling, Obstruction):
                label[body] = labelling[0]
                hands.add(labelling[1])
                warp[body_crossings.warp], warp[body_crossings.weft] = True, False
                break
            reason = reason or labelling
        else:
            return FabricWeave(obstruction=reason)
    hands.discard("")
    on_top = (label < fabric.over)[threads.crossing] == warp[threads.thread_of_pass]
    twist = np.zeros(threads.n_crossings, dtype=bool)
    twist[threads.crossing[threads.forward]] = on_top[threads.forward]
    return FabricWeave(
        Weave(threads, str(fabric), twist, over_of_passes(threads, twist)),
        warp=warp,
        label=label,
        hand="mixed" if len(hands) > 1 else "".join(hands),
    )
