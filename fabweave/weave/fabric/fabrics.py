"""Weave twills over a and under b, and satins, where warp and weft exist and the labels close."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.weave.fabric.repeat import Fabric
from fabweave.weave.fabric.warp_and_weft import Strands, part_strands
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave
from fabweave.weave.thread_labels import thread_labels
from fabweave.weave.threads import Threads
from fabweave.weave.twill.obstruction import Obstruction

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


@frozen_value
class Labelling:
    """Labels that close everywhere.

    Parameters
    ----------
    label : (N,) int array
        The label of each crossing modulo the repeat.
    hand : str
        "S" or "Z", "mixed", or "" for a fabric without hands.
    """

    label: IntArray
    hand: str


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
    links = sparse.coo_array(
        (np.ones(len(crossings.warp), dtype=np.int8), (crossings.warp, crossings.weft)),
        shape=(count, count),
    )
    _, body = csgraph.connected_components(links, directed=False)
    body_of_crossing = body[crossings.warp]
    order = np.argsort(body_of_crossing, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(body_of_crossing[order])) + 1)


def label_body(
    threads: Threads,
    strands: Strands,
    crossings: Crossings,
    fabric: Fabric,
    hand: str | None,
    names: Sequence[str],
) -> Labelling | Obstruction:
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
        Repeat and shift.
    hand : {"S", "Z"} or None
        The hand that is wanted, or any, one throughout if possible.
    names : sequence of str
        Names of the threads, for the words.

    Returns
    -------
    Labelling or Obstruction
    """
    off = _rings_off(threads, crossings, fabric, names)
    if off is not None:
        return off
    size = fabric.repeat
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
    if chosen is None or (hand is not None and chosen[1] not in (hand, "")):
        where = None if chosen else (known[warp], known[weft], unlike, example)
        return _not_closing(where, fabric, hand, names)
    way = chosen[0]
    label = (start @ way)[weft] + (way[group] * sense)[weft] * crossings.weft_at
    return Labelling(label % size, chosen[1])


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
    size = fabric.repeat
    warp, weft = np.unique(crossings.warp), np.unique(crossings.weft)
    thread = np.concatenate((warp, weft))
    step = np.repeat((fabric.shift, 1), (len(warp), len(weft)))
    off = np.where(threads.closed[thread], threads.lengths[thread] * step % size, 0)
    if not off.any():
        return None
    at = int(np.lexsort((thread, off == 0))[0])
    steps = int(min(off[at], size - off[at]))
    wrong = thread[off > 0]
    return Obstruction(
        f"going once round thread {names[thread[at]]} the pattern is {steps} "
        f"step{'s' * (steps > 1)} off: {threads.lengths[thread[at]]} crossings are not a "
        f"multiple of {size // int(np.gcd(step[at], size))}; this is so for {len(wrong)} of "
        f"{len(thread)} threads",
        threads=tuple(np.sort(wrong)[:4].tolist()),
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


def _not_closing(
    where: tuple[IntArray, IntArray, IntArray, IntArray] | None,
    fabric: Fabric,
    hand: str | None,
    names: Sequence[str],
) -> Obstruction:
    """Say by how much, and where, the labels do not meet."""
    if where is None:
        return Obstruction(f"the pattern closes, but not with the hand {hand} everywhere")
    warp, weft, unlike, example = where
    off = unlike.sum(axis=1) % fabric.repeat
    at = int(np.flatnonzero(off)[0])  # all directions alike are one of the choices that fail
    pair = (int(warp[example[at]]), int(weft[example[at]]))
    steps = int(min(off[at], fabric.repeat - off[at]))
    return Obstruction(
        "whichever way the threads run, the pattern does not match up around loops that follow "
        f"several threads: one such loop ends where threads {names[pair[0]]} and "
        f"{names[pair[1]]} cross, {steps} of {fabric.repeat} steps off",
        threads=pair,
    )


HANDS = ("S", "Z")


@frozen_value
class FabricWeave:
    """A fabric on a mesh, exact everywhere, or what keeps the mesh from it.

    Parameters
    ----------
    fabric : Fabric
        What was asked for.
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

    fabric: Fabric
    weave: Weave | None = None
    obstruction: Obstruction | None = None
    warp: BoolArray | None = None
    label: IntArray | None = None
    hand: str = ""


def weave_fabric(
    halfedges: Halfedges,
    threads: Threads,
    fabric: Fabric,
    *,
    hand: str | None = None,
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
        The fabric; 1/1 is plain weave, which exists on every mesh.
    hand : {"S", "Z"}, optional
        The hand of the twill line, the same everywhere; otherwise the fabric's, or, if it has
        none, any will do, in each body one hand throughout if possible. A cloth turned by a quarter
        has the other hand, as its weft has become its warp: a closed weave often allows both by
        the choice of the warp.
    labels : sequence of str, optional
        Names of the threads, for the words.

    Returns
    -------
    FabricWeave
        With a weave or an obstruction.

    Raises
    ------
    InputError
        If the hand is neither "S" nor "Z", or the fabric has none.

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
    'going once round thread A the pattern is 2 steps off: 70 crossings are not a multiple of 4; \
this is so for 2 of 2 threads'

    References
    ----------
    B. Grünbaum, G. C. Shephard, "Satins and twills: an introduction to the geometry of fabrics",
    Mathematics Magazine 53(3), 1980.
    """
    if hand is not None and (hand not in HANDS or not fabric.handed):
        raise InputError(
            f"the hand must be S or Z, not {hand!r}"
            if fabric.handed
            else f"the fabric {fabric} is its own mirror image, so it has no hand"
        )
    hand = hand or fabric.hand or None
    if fabric.repeat == 2:
        return FabricWeave(fabric, plain_weave(threads))
    names = thread_labels(threads.n_threads) if labels is None else labels
    candidates = _candidates(halfedges, threads, fabric, names)
    if isinstance(candidates, Obstruction):
        return FabricWeave(fabric, obstruction=candidates)
    return _weave_bodies(threads, candidates, fabric, hand, names)


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
    hand: str | None,
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
            labelling = label_body(threads, strands, body_crossings, fabric, hand, names)
            if isinstance(labelling, Labelling):
                label[body] = labelling.label
                hands.add(labelling.hand)
                warp[body_crossings.warp], warp[body_crossings.weft] = True, False
                break
            reason = reason or labelling
        else:
            return FabricWeave(fabric, obstruction=reason)
    hands.discard("")
    on_top = (label < fabric.over)[threads.crossing] == warp[threads.thread_of_pass]
    twist = np.zeros(threads.n_crossings, dtype=bool)
    twist[threads.crossing[threads.forward]] = on_top[threads.forward]
    return FabricWeave(
        fabric,
        Weave(threads, str(fabric), twist, over_of_passes(threads, twist)),
        warp=warp,
        label=label,
        hand="mixed" if len(hands) > 1 else "".join(hands),
    )
