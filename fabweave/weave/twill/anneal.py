"""Anneal the twists of a weave: 64 copies at once, one in each bit of a word."""

import math

import numpy as np
import numpy.typing as npt
from scipy import sparse

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.weave.twill.conditions import EQUAL, TwillConditions, TwillWeights

#: One word a crossing; bit k of all words together is copy k of the weave's twists.
Copies = npt.NDArray[np.uint64]

N_COPIES = 64
_NONE = np.uint64(0)
_ALL = ~_NONE
#: Chances are rounded to 1/256: each is drawn from 8 random bits.
_CHANCE_BITS = 8
#: Steps uphill by more conditions than this are never taken: while it is so hot that they would
#: often be, there is no order yet that they could keep.
_HIGHEST_STEP = 5


@frozen_value
class _Slots:
    """Conditions as the crossings of one class see them, K of one weight for each crossing.

    A condition breaks where ``middle`` and ``other`` differ, and the crossing from its partner. An
    edge condition breaks where the crossing equals its partner: its two middles always differ,
    and ``inverted`` turns the partner round. Unused slots have middles that never differ.
    """

    level: int
    partner: IntArray
    middle: IntArray
    other: IntArray
    inverted: Copies


@frozen_value
class Couplings:
    """The conditions of a twill, equal ones merged, arranged for annealing.

    Parameters
    ----------
    n_crossings : int
        Number of crossings.
    pairs, windows : (M, 2) and (N, 4) int arrays
        Different conditions: the two of a pair must differ; of the first two and the last two of
        a window, at least one couple must agree.
    pair_weight, window_weight : (M,) and (N,) int arrays
        How often each occurs, times its weight.
    unit : float
        What a condition weighs on average; temperatures are in this unit.
    neighbours : (X, X) sparse matrix
        Which crossings share a condition.
    classes : tuple
        Crossings that share no condition with one another, and their slots: all of a class may be
        turned at the same time.
    """

    n_crossings: int
    pairs: IntArray
    pair_weight: IntArray
    windows: IntArray
    window_weight: IntArray
    unit: float
    neighbours: sparse.csr_array
    classes: tuple[tuple[IntArray, tuple[_Slots, ...]], ...]


def couple(conditions: TwillConditions, weights: TwillWeights = EQUAL) -> Couplings:
    """Arrange the conditions of a mesh for annealing.

    Parameters
    ----------
    conditions : TwillConditions
        The conditions.
    weights : TwillWeights, optional
        What counts how much; all that is counted is in proportion to whole numbers.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(6, 6, 2.0, 1.0))
    >>> couplings = couple(twill_conditions(halfedges, trace_threads(halfedges)))
    >>> len(couplings.pairs), len(couplings.windows), couplings.window_weight.max().tolist()
    (144, 144, 2)
    """
    count = conditions.n_crossings
    of_edge, of_face, of_vertex = weights.whole
    pairs, pair_weight = np.unique(np.sort(conditions.edge, axis=1), axis=0, return_counts=True)
    pair_weight = pair_weight.astype(np.int64) * of_edge
    a, b, c, d = conditions.gaps.T
    couples = np.sort(np.stack((np.column_stack((b, c)), np.column_stack((a, d))), axis=1), axis=2)
    code = couples[:, :, 0] * np.int64(count) + couples[:, :, 1]
    couples = np.take_along_axis(couples, np.argsort(code, axis=1)[:, :, None], axis=1)
    windows, which = np.unique(couples.reshape(-1, 4), axis=0, return_inverse=True)
    each = np.repeat((of_face, of_vertex), (len(conditions.face), len(conditions.vertex)))
    window_weight = np.bincount(which.ravel(), each, minlength=len(windows)).astype(np.int64)
    neighbours = _neighbours(count, pairs, windows)
    colour = _colour(neighbours)
    seen = _as_seen(count, pairs, pair_weight, windows, window_weight)
    return Couplings(
        n_crossings=count,
        pairs=pairs,
        pair_weight=pair_weight,
        windows=windows,
        window_weight=window_weight,
        unit=float(pair_weight.sum() + window_weight.sum()) / max(conditions.count, 1) or 1.0,
        neighbours=neighbours,
        classes=tuple(_slots(count, np.flatnonzero(colour == k), seen) for k in np.unique(colour)),
    )


def _neighbours(count: int, pairs: IntArray, windows: IntArray) -> sparse.csr_array:
    """Return which crossings share a condition."""
    row = np.concatenate((pairs.ravel(), np.repeat(windows, 4, axis=1).ravel()))
    column = np.concatenate((pairs[:, ::-1].ravel(), np.tile(windows, 4).ravel()))
    apart = row != column
    linked = sparse.coo_array(
        (np.ones(np.count_nonzero(apart), dtype=np.int32), (row[apart], column[apart])),
        shape=(count, count),
    )
    return linked.tocsr()


def _colour(neighbours: sparse.csr_array) -> IntArray:
    """Give each crossing the least class that no neighbour has."""
    bounds, indices = neighbours.indptr.tolist(), neighbours.indices.tolist()
    colour = [-1] * neighbours.shape[0]
    for crossing in range(len(colour)):
        taken = {colour[other] for other in indices[bounds[crossing] : bounds[crossing + 1]]}
        colour[crossing] = next(k for k in range(len(taken) + 1) if k not in taken)
    return np.array(colour, dtype=np.int64)


def _as_seen(
    count: int, pairs: IntArray, pair_weight: IntArray, windows: IntArray, window_weight: IntArray
) -> IntArray:
    """Return conditions as their crossings see them: rows of weight, crossing and slot.

    Windows that meet a crossing twice are left out: turning it changes both couples. They occur
    on meshes of a handful of faces, and are counted in the score.
    """
    never, always = count, count + 1
    kept = np.array([len(set(row)) == 4 for row in windows.tolist()], dtype=bool)
    rows = []
    for i, j in ((0, 1), (1, 0)):
        apart = pairs[:, 0] != pairs[:, 1]
        pair = pairs[apart]
        filled = np.full(len(pair), never), np.full(len(pair), always), np.ones(len(pair), np.int64)
        rows.append(np.column_stack((pair_weight[apart], pair[:, [i, j]], *filled)))
    window = windows[kept]
    for order in ((0, 1, 2, 3), (1, 0, 2, 3), (2, 3, 0, 1), (3, 2, 0, 1)):
        zero = np.zeros(len(window), dtype=np.int64)
        rows.append(np.column_stack((window_weight[kept], window[:, order], zero)))
    return np.concatenate(rows)


def _slots(count: int, members: IntArray, seen: IntArray) -> tuple[IntArray, tuple[_Slots, ...]]:
    """Arrange what the crossings of a class see: a slot for each binary digit of a weight."""
    place = np.full(count, -1, dtype=np.int64)
    place[members] = np.arange(len(members))
    conditions = seen[place[seen[:, 1]] >= 0]
    result = []
    for level in range(int(conditions[:, 0].max(initial=0)).bit_length()):
        rows = conditions[(conditions[:, 0] >> level) & 1 == 1]
        at = place[rows[:, 1]]
        order = np.argsort(at, kind="stable")
        rows, at = rows[order], at[order]
        slot = np.arange(len(at)) - np.searchsorted(at, at)
        shape = (int(slot.max(initial=-1)) + 1, len(members))
        partner, middle, other = np.full((3, *shape), count, dtype=np.int64)
        for table, column in zip((partner, middle, other), rows[:, 2:5].T, strict=True):
            table[slot, at] = column
        inverted = np.zeros(shape, dtype=np.uint64)
        inverted[slot, at] = np.where(rows[:, 5] == 1, _ALL, _NONE)
        result.append(_Slots(level, partner, middle, other, inverted))
    return members, tuple(result)


def random_copies(couplings: Couplings, rng: np.random.Generator) -> Copies:
    """Return copies with twists drawn at random."""
    copies = rng.integers(0, 2**64, size=couplings.n_crossings + 2, dtype=np.uint64)
    copies[-2:] = _NONE, _ALL
    return copies


def pack(twists: BoolArray) -> Copies:
    """Return copies with the given twists, (64, X), one each.

    Examples
    --------
    >>> import numpy as np
    >>> twists = np.random.default_rng(0).random((64, 5)) < 0.5
    >>> bool(np.array_equal(unpack(pack(twists)), twists))
    True
    """
    words = np.packbits(np.ascontiguousarray(twists.T), axis=1, bitorder="little")
    return np.concatenate((words.view("<u8").ravel().astype(np.uint64), [_NONE, _ALL]))


def unpack(copies: Copies) -> BoolArray:
    """Return the twists of all copies, (64, X)."""
    octets = copies[:-2].astype("<u8").view(np.uint8).reshape(-1, 8)
    return np.unpackbits(octets, axis=1, bitorder="little").T.astype(bool)


def sweep(
    couplings: Couplings, copies: Copies, temperature: float, rng: np.random.Generator
) -> None:
    """Offer each crossing of each copy to turn once, by Metropolis' rule; changes ``copies``.

    A turn that breaks d conditions more is taken with the chance exp(-d / temperature). All 64
    copies are computed together: numbers of conditions are kept as binary digits, one word each,
    and added digit by digit.

    Parameters
    ----------
    couplings : Couplings
        The conditions.
    copies : (X + 2,) uint64 array
        The twists; the last two words are constants.
    temperature : float
        In units of one condition; 0 takes no step uphill.
    rng : numpy.random.Generator
        Draws the chances.
    """
    # Where conditions weigh more, coins are worth more, too: a power of two, to add it as a digit.
    level = max(math.frexp(couplings.unit)[1] - 1, 0)
    worth = 2**level / couplings.unit
    chance = float(np.exp(-worth / temperature)) if temperature > 0 else 0.0
    throws = round(_HIGHEST_STEP / worth)
    for members, slots in couplings.classes:
        twists = copies[members]
        worse: list[Copies] = []
        better: list[Copies] = []
        for slot in slots:
            matters = copies[slot.middle] ^ copies[slot.other]
            broken = twists ^ copies[slot.partner] ^ slot.inverted
            for gained, lost in zip(matters & ~broken, matters & broken, strict=True):
                _add(worse, gained, slot.level)
                _add(better, lost, slot.level)
        # A turn may cost as many conditions as a coin of the given chance falls heads in a row.
        heads = np.full(twists.shape, _ALL)
        for _ in range(throws if chance > 0 else 0):
            heads = heads & _coins(chance, twists.shape, rng)
            _add(better, heads, level)
        copies[members] = twists ^ _not_less(better, worse, twists.shape)


def _add(digits: list[Copies], summand: Copies, level: int) -> None:
    """Add one digit of value 2**level to numbers kept as binary digits, least first."""
    while len(digits) <= level:
        digits.append(np.zeros_like(summand))
    carry = summand
    for place in range(level, len(digits)):
        digits[place], carry = digits[place] ^ carry, digits[place] & carry
    if carry.any():
        digits.append(carry)


def _not_less(left: list[Copies], right: list[Copies], shape: tuple[int, ...]) -> Copies:
    """Compare numbers kept as binary digits: all bits where left >= right."""
    result = np.full(shape, _ALL)
    nothing = np.zeros(shape, dtype=np.uint64)
    for place in range(max(len(left), len(right))):
        a = left[place] if place < len(left) else nothing
        b = right[place] if place < len(right) else nothing
        result = (a & ~b) | (~(a ^ b) & result)
    return result


def _coins(chance: float, shape: tuple[int, ...], rng: np.random.Generator) -> Copies:
    """Throw a coin for each bit: heads with the given chance, rounded to 1/256.

    Reading the chance's digits from the least to the first, each halves what came before and adds
    a half if it is one.
    """
    digits = round(chance * (1 << _CHANCE_BITS))
    if digits >= 1 << _CHANCE_BITS:
        return np.full(shape, _ALL)
    random = rng.integers(0, 2**64, size=(_CHANCE_BITS, *shape), dtype=np.uint64)
    heads = np.zeros(shape, dtype=np.uint64)
    for place in range(_CHANCE_BITS):
        heads = heads | random[place] if (digits >> place) & 1 else heads & random[place]
    return heads


def scores(couplings: Couplings, copies: Copies) -> IntArray:
    """Return what the conditions that each copy breaks weigh, (64,)."""
    left, right = copies[couplings.pairs].T
    a, b, c, d = copies[couplings.windows].T
    result = np.zeros(N_COPIES, dtype=np.int64)
    for broken, weight in (
        (~(left ^ right), couplings.pair_weight),
        ((a ^ b) & (c ^ d), couplings.window_weight),
    ):
        octets = broken.astype("<u8").view(np.uint8).reshape(-1, 8)
        result += weight @ np.unpackbits(octets, axis=1, bitorder="little")
    return result


def resample(
    couplings: Couplings,
    copies: Copies,
    before: float,
    after: float,
    rng: np.random.Generator,
) -> Copies:
    """Let copies that break little displace those that break much, as cooling would have it.

    Each copy is taken as often as its chance grows when the temperature falls, exp(-broken /
    after) to exp(-broken / before), rounded up or down at random.

    Parameters
    ----------
    couplings : Couplings
        The conditions.
    copies : (X + 2,) uint64 array
        The twists.
    before, after : float
        The temperatures, in units of one condition.
    rng : numpy.random.Generator
        Draws one number.

    Returns
    -------
    (X + 2,) uint64 array

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.conditions import twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(4, 4, 2.0, 1.0))
    >>> couplings = couple(twill_conditions(halfedges, trace_threads(halfedges)))
    >>> rng = np.random.default_rng(0)
    >>> copies = random_copies(couplings, rng)
    >>> least = int(scores(couplings, copies).min())
    >>> frozen = scores(couplings, resample(couplings, copies, 1.0, 0.01, rng))
    >>> bool(np.all(frozen == least))
    True
    """
    broken = scores(couplings, copies) / couplings.unit
    share = np.exp((broken.min() - broken) * (1 / after - 1 / before))
    reached = np.cumsum(share / share.sum())
    drawn = (np.arange(N_COPIES) + rng.random()) / N_COPIES
    taken = np.minimum(np.searchsorted(reached, drawn), N_COPIES - 1)
    return pack(unpack(copies)[taken])
