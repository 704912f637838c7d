"""Choose twists that break as few conditions of a twill as can be found, by annealing.

Copies of the weave are cooled 64 at once, one in each bit of a word.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from scipy import sparse
from scipy.sparse import csgraph

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
)
from fabweave.core.colouring import colour
from fabweave.weave.twill.conditions import EQUAL, TwillConditions, TwillWeights

#: One word a crossing; bit k of all words together is copy k of the weave's twists.
Copies = npt.NDArray[np.uint64]
_Twists = TypeVar("_Twists", BoolArray, Copies)

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

    @property
    def tables(self) -> tuple[tuple[IntArray, IntArray], ...]:
        """Pairs and their weights, and windows and theirs."""
        return (self.pairs, self.pair_weight), (self.windows, self.window_weight)


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
    found = colour(neighbours)
    seen = _as_seen(count, pairs, pair_weight, windows, window_weight)
    return Couplings(
        n_crossings=count,
        pairs=pairs,
        pair_weight=pair_weight,
        windows=windows,
        window_weight=window_weight,
        unit=float(pair_weight.sum() + window_weight.sum()) / max(conditions.count, 1) or 1.0,
        neighbours=neighbours,
        classes=tuple(_slots(count, np.flatnonzero(found == k), seen) for k in np.unique(found)),
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
    result = np.zeros(N_COPIES, dtype=np.int64)
    for broken, (_, weight) in zip(_broken(couplings, copies), couplings.tables, strict=True):
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


def score(couplings: Couplings, twist: BoolArray) -> int:
    """Return how many conditions twists break."""
    pairs, windows = _broken(couplings, twist)
    return int(pairs @ couplings.pair_weight + windows @ couplings.window_weight)


def cross(couplings: Couplings, twist: BoolArray, others: Iterable[BoolArray]) -> BoolArray:
    """Improve twists by patches of others.

    Where two choices of twists differ, they do so in patches, connected by shared conditions. No
    condition touches two patches, so each patch may be taken or left by itself, and is taken if
    it breaks less.

    Parameters
    ----------
    couplings : Couplings
        The conditions.
    twist : (X,) bool array
        What is to be improved.
    others : iterable of (X,) bool array
        Where patches come from, one after the other.

    Returns
    -------
    (X,) bool array
        Breaks no more conditions than ``twist`` does, and no more than any of ``others`` that
        differs from it in one patch only.

    References
    ----------
    Tinós, Whitley, Chicano, "Partition crossover for pseudo-Boolean optimization" (FOGA 2015).
    """
    result = twist.copy()
    for other in others:
        differing = np.flatnonzero(result != other)
        if not len(differing):
            continue
        among = couplings.neighbours[differing][:, differing]
        n_patches, patch = csgraph.connected_components(among, directed=False)
        patch_of = np.full(couplings.n_crossings, -1, dtype=np.int64)
        patch_of[differing] = patch
        gain = np.zeros(n_patches)
        for (conditions, weight), before, after in zip(
            couplings.tables, _broken(couplings, result), _broken(couplings, other), strict=True
        ):
            changed = np.flatnonzero(before != after)
            change = np.where(before[changed], weight[changed], -weight[changed])
            touched: IntArray = patch_of[conditions[changed]].max(axis=1)
            gain += np.bincount(touched, weights=change, minlength=n_patches)
        taken = differing[gain[patch] > 0]
        result[taken] = other[taken]
    return result


def _broken(couplings: Couplings, twist: _Twists) -> tuple[_Twists, _Twists]:
    """Return which pairs and which windows are broken, of one weave or of 64 copies at once."""
    left, right = twist[couplings.pairs].T
    a, b, c, d = twist[couplings.windows].T
    return ~(left ^ right), (a ^ b) & (c ^ d)


@dataclass(frozen=True)
class AnnealingSchedule:
    """How long to search.

    Parameters
    ----------
    sweeps : int
        Sweeps of the first annealing, from random twists.
    rounds : int
        Rounds of warming the best up again.
    round_sweeps : int
        Sweeps in each round.
    patience : int
        Rounds without gain after which the search ends.
    most_turns : float
        Limit on crossings times sweeps, so that large meshes end in time.
    chains, chain_sweeps : int
        Long coolings after that, and the sweeps of each.
    chain_patience : int
        Long coolings without gain after which the search ends.
    most_chain_turns : float
        Limit on crossings times sweeps of all long coolings: a mesh that is too large for one
        gets none.
    """

    sweeps: int
    rounds: int
    round_sweeps: int
    patience: int
    most_turns: float
    chains: int
    chain_sweeps: int
    chain_patience: int
    most_chain_turns: float


SEARCHES = {
    "quick": AnnealingSchedule(200, 6, 60, 3, 1e7, 0, 0, 0, 0.0),
    "normal": AnnealingSchedule(600, 30, 100, 6, 6e7, 4, 3000, 2, 1.3e8),
    "best": AnnealingSchedule(2000, 200, 150, 20, 2e8, 8, 6000, 4, 6e8),
}

#: Twists are disordered above the first temperature, and hardly change below the last.
_HOT, _WARM, _COLD = 2.6, 2.1, 0.7
#: A long cooling begins just below the temperature at which order melts away, so that seams of the
#: twill wander as far as they can, and spends most of its sweeps above the second temperature.
#: Below the third, where seams no longer find other ends, good copies displace bad ones.
_SEAMS_WANDER, _SEAMS_REST, _SEAMS_KEPT = 2.5, 1.8, 2.2
_SHARE_WANDERING = 0.7
#: Sweeps from one displacement to the next.
_DISPLACED_EVERY = 10
#: A small mesh needs no more sweeps of a long cooling than so many times its crossings.
_CHAIN_PER_CROSSING = 2
#: So many of the best are kept and crossed with one another.
_ELITE = 4


def optimise_twill(
    couplings: Couplings,
    start: BoolArray,
    *,
    effort: str = "normal",
    seed: int = 0,
    least: int = 0,
    progress: Progress = no_progress,
) -> BoolArray:
    """Search for twists that break as few conditions of a twill as possible.

    Sixty-four copies are annealed from random twists. The best of them and the start are then
    warmed up, cooled and crossed with all others, again and again. Where two choices of twists
    differ in patches that share no condition, the better of both is taken patch by patch: no patch
    loses what another gains. For a large mesh, which has no time to order itself from random
    twists, all begins with the start.

    What is left are seams, along which the diagonal changes direction or phase, and they end at
    irregular vertices: to lead them from other vertices to others is a long way uphill. So at last
    the best, and the start again, are cooled slowly from just below the temperature at which all
    order melts, and copies with long seams give way to copies with short ones.

    Parameters
    ----------
    couplings : Couplings
        The conditions of the mesh.
    start : (X,) bool array
        Twists to start from, such as a vote's; the result never breaks more.
    effort : {"quick", "normal", "best"}
        How long to search; counted in sweeps, not in seconds. The best begins with the normal one.
    seed : int
        Same seed, same result.
    least : int
        A known lower bound; reaching it ends the search.
    progress : callable
        Told how far the search is.

    Returns
    -------
    (X,) bool array
        The twists.

    References
    ----------
    The crossing of patches is the partition crossover of Tinós, Whitley and Chicano, "Partition
    crossover for pseudo-Boolean optimization" (FOGA 2015). Long coolings are population annealing:
    Hukushima and Iba, "Population annealing and its application to a spin glass" (2003).

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.mesh.shapes import grids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.twill.conditions import count_broken, twill_conditions
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(4, 6, 2.0, 1.0))
    >>> conditions = twill_conditions(halfedges, trace_threads(halfedges))
    >>> twist = optimise_twill(couple(conditions), np.ones(48, dtype=bool), effort="quick")
    >>> count_broken(conditions, twist).total
    0
    """
    if effort == "best":
        # It sets out from what a normal search finds, and so never breaks more than that.
        start = optimise_twill(
            couplings, start, effort="normal", seed=seed, least=least, progress=progress
        )
    search = SEARCHES[effort]
    rng = np.random.default_rng(seed)
    allowed = int(search.most_turns / max(couplings.n_crossings, 1))
    # A large mesh has no time to order itself from nothing: its whole time goes to the start.
    sweeps = search.sweeps if allowed >= 2 * search.sweeps else 0
    rounds = min(search.rounds, max(1, (allowed - sweeps) // search.round_sweeps))
    chain_sweeps = min(search.chain_sweeps, _CHAIN_PER_CROSSING * couplings.n_crossings)
    chain_turns = max(chain_sweeps * couplings.n_crossings, 1)
    chains = min(search.chains, int(search.most_chain_turns / chain_turns))
    total = sweeps + rounds * search.round_sweeps + chains * chain_sweeps
    done = 0

    def cool(
        copies: Copies, temperatures: FloatArray, *, displace_below: float = 0.0
    ) -> list[BoolArray]:
        """Cool copies down and return their twists, the best first."""
        nonlocal done
        since = 0.0
        for number, temperature in enumerate(temperatures.tolist(), start=1):
            sweep(couplings, copies, temperature, rng)
            if temperature <= displace_below and number % _DISPLACED_EVERY == 0:
                if since:
                    copies = resample(couplings, copies, since, temperature, rng)
                since = temperature
            done += 1
            if done % 10 == 0:
                progress("twill", done, total)
        sweep(couplings, copies, 0.0, rng)
        return list(unpack(copies)[np.argsort(scores(couplings, copies), kind="stable")])

    def best_crossed(elite: list[BoolArray], others: list[BoolArray]) -> list[BoolArray]:
        """Cross the elite with all others, and sort it."""
        return sorted(
            (cross(couplings, one, others) for one in elite), key=lambda one: score(couplings, one)
        )

    elite = [start]
    if score(couplings, start) > least and sweeps:
        cooled = cool(random_copies(couplings, rng), np.linspace(_HOT, _COLD, sweeps))
        elite = best_crossed([start, *cooled[: _ELITE - 1]], cooled)
    waited = 0
    for _ in range(rounds):
        before = score(couplings, elite[0])
        if before <= least or waited >= search.patience:
            break
        copies = pack(np.array(elite)[np.arange(N_COPIES) % len(elite)])
        cooled = cool(copies, np.linspace(_WARM, _COLD, search.round_sweeps))
        elite = best_crossed(elite, [*cooled, *elite])
        waited = 0 if score(couplings, elite[0]) < before else waited + 1
    waited = 0
    for number in range(chains):
        before = score(couplings, elite[0])
        if before <= least or waited >= search.chain_patience:
            break
        # Every other cooling sets out from the start: what has been found may lie in a blind alley.
        begin = np.array([start] if number % 2 else elite)
        copies = pack(begin[np.arange(N_COPIES) % len(begin)])
        cooled = cool(copies, _slowly(chain_sweeps), displace_below=_SEAMS_KEPT)
        half = _ELITE // 2
        elite = best_crossed([*elite[:half], *cooled[:half]], [*cooled, *elite])
        waited = 0 if score(couplings, elite[0]) < before else waited + 1
    return elite[0]


def _slowly(sweeps: int) -> FloatArray:
    """Return the temperatures of a long cooling."""
    wandering = int(_SHARE_WANDERING * sweeps)
    return np.concatenate(
        (
            np.linspace(_SEAMS_WANDER, _SEAMS_REST, wandering),
            np.linspace(_SEAMS_REST, _COLD, sweeps - wandering),
        )
    )
