"""Label crossings modulo a repeat, so that labels step evenly along warp and weft."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.weave.fabric.repeat import Fabric
from fabweave.weave.fabric.warp_and_weft import Strands
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
