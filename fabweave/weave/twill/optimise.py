"""Choose twists that break as few conditions of a twill as can be found."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csgraph

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, Progress, no_progress
from fabweave.weave.twill.anneal import (
    N_COPIES,
    Copies,
    Couplings,
    pack,
    random_copies,
    resample,
    scores,
    sweep,
    unpack,
)


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
        for conditions, weight, before, after in zip(
            (couplings.pairs, couplings.windows),
            (couplings.pair_weight, couplings.window_weight),
            _broken(couplings, result),
            _broken(couplings, other),
            strict=True,
        ):
            changed = np.flatnonzero(before != after)
            change = np.where(before[changed], weight[changed], -weight[changed])
            touched: IntArray = patch_of[conditions[changed]].max(axis=1)
            gain += np.bincount(touched, weights=change, minlength=n_patches)
        taken = differing[gain[patch] > 0]
        result[taken] = other[taken]
    return result


def _broken(couplings: Couplings, twist: BoolArray) -> tuple[BoolArray, BoolArray]:
    """Return which pairs and which windows are broken."""
    left, right = twist[couplings.pairs].T
    a, b, c, d = twist[couplings.windows].T
    return left == right, (a != b) & (c != d)


@dataclass(frozen=True)
class Search:
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
    "quick": Search(200, 6, 60, 3, 1e7, 0, 0, 0, 0.0),
    "normal": Search(600, 30, 100, 6, 6e7, 4, 3000, 2, 1.3e8),
    "best": Search(2000, 200, 150, 20, 2e8, 8, 6000, 4, 6e8),
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
    >>> from fabweave.weave.twill.anneal import couple
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
