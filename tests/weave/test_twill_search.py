"""Voting, annealing, crossing and the lower bound, against each other and all choices."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from slow import slow_but
from twill_oracle import broken_by_all, conditions_of, refined, small_meshes
from weaving_meshes import meshes, walked

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.bunches import part_bunches
from fabweave.weave.twill import bound as bounds
from fabweave.weave.twill.anneal import (
    N_COPIES,
    couple,
    cross,
    optimise_twill,
    pack,
    random_copies,
    resample,
    score,
    scores,
    sweep,
    unpack,
)
from fabweave.weave.twill.bound import WIDER_WORK, irregular_seeds, prove_bound
from fabweave.weave.twill.conditions import (
    EQUAL,
    Broken,
    count_broken,
    parse_weights,
    twill_conditions,
)
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.voting import best_vote, literal_vote
from fabweave.weave.twill.weaving import TwillSearch, weave_twill


def vote_of(mesh: PolyMesh):
    halfedges, threads = walked(mesh)
    return best_vote(twill_conditions(halfedges, threads), threads, part_bunches(threads))


@pytest.mark.parametrize(
    ("mesh", "steps", "paper"),
    # What a plain implementation of the paper's voting breaks on these.
    [
        (solids.cube, 1, 26),
        (solids.cube, 2, 70),
        (solids.cube, 3, 170),
        (solids.icosahedron, 1, 62),
    ],
)
def test_our_voting_is_as_good_as_plain_voting(mesh, steps: int, paper: int) -> None:
    assert vote_of(refined(mesh(), f"catmull-clark:{steps}")).broken.total <= paper


def literal_vote_of(mesh: PolyMesh):
    halfedges, threads = walked(mesh)
    conditions = twill_conditions(halfedges, threads)
    return literal_vote(conditions, halfedges, threads, part_bunches(threads), EQUAL)


@pytest.mark.parametrize("vote_by", [vote_of, literal_vote_of])
@given(mesh=meshes())
def test_votes_decide_every_crossing_and_count_what_they_break(vote_by, mesh) -> None:
    vote, conditions = vote_by(mesh), conditions_of(mesh)
    assert vote.twist.shape == (conditions.n_crossings,)
    assert vote.broken == count_broken(conditions, vote.twist)


def test_literal_votes_begin_alike_around_one_vertex() -> None:
    mesh = refined(solids.cube(), "catmull-clark:2")
    halfedges, threads = walked(mesh)
    twist = literal_vote_of(mesh).twist
    of_edge = np.zeros(halfedges.n_edges, dtype=bool)
    of_edge[halfedges.edge[threads.crossing_halfedge]] = twist
    alike = [
        of_edge[halfedges.edge[halfedges.tail == vertex]].all() for vertex in range(mesh.n_vertices)
    ]
    assert any(alike)


@pytest.mark.parametrize(
    ("text", "face", "vertex"), [("2/2", 2, 2), ("1.5/3", 1.5, 3), ("0.5/1", 0.5, 1)]
)
def test_weights_are_what_is_counted(text: str, face: float, vertex: float) -> None:
    conditions = conditions_of(refined(solids.icosahedron(), "catmull-clark:1"))
    weights = parse_weights(text)
    couplings = couple(conditions, weights)
    twists = np.random.default_rng(0).random((N_COPIES, conditions.n_crossings)) < 0.5
    broken = [count_broken(conditions, twist) for twist in twists]
    scale = weights.whole[0]
    wanted = [scale * (one.edge + face * one.face + vertex * one.vertex) for one in broken]
    assert scores(couplings, pack(twists)).tolist() == wanted
    total = len(conditions.edge) + face * len(conditions.face) + vertex * len(conditions.vertex)
    assert couplings.unit == pytest.approx(scale * total / conditions.count)


@pytest.mark.slow
@pytest.mark.parametrize("text", ["2/2", "0.5/0.5"])
def test_a_weave_is_best_by_its_own_weights(text: str) -> None:
    weights = parse_weights(text)
    of_edge, of_face, of_vertex = weights.whole

    def weigh(weave: Broken) -> int:
        return of_edge * weave.edge + of_face * weave.face + of_vertex * weave.vertex

    halfedges, threads = walked(solids.icosahedron())
    weave = [
        weave_twill(
            halfedges,
            threads,
            part_bunches(threads),
            "ABCDEF",
            TwillSearch(weights=one, effort="quick"),
        ).weave.broken
        for one in (EQUAL, weights)
    ]
    assert weave[0].total <= weave[1].total
    assert weigh(weave[1]) <= weigh(weave[0])


def test_the_method_of_the_paper_is_left_as_it_comes() -> None:
    mesh = refined(solids.cube(), "catmull-clark:2")
    halfedges, threads = walked(mesh)
    names = [str(number) for number in range(threads.n_threads)]
    how = TwillSearch(method="voting")
    voted = weave_twill(halfedges, threads, part_bunches(threads), names, how)
    assert voted.voted == voted.weave.broken == literal_vote_of(mesh).broken
    assert np.array_equal(voted.weave.twist, literal_vote_of(mesh).twist)


def started(mesh: PolyMesh, seed: int):
    """Return couplings of a mesh that has some, and random copies of its twists."""
    conditions = conditions_of(mesh)
    assume(conditions.n_crossings)
    couplings, rng = couple(conditions), np.random.default_rng(seed)
    return couplings, rng, random_copies(couplings, rng)


@given(meshes(), st.integers(0, 2**32 - 1))
def test_scores_of_copies_and_of_twists_are_the_broken_conditions(mesh: PolyMesh, seed) -> None:
    conditions = conditions_of(mesh)
    assume(conditions.n_crossings)
    couplings = couple(conditions)
    twists = np.random.default_rng(seed).random((N_COPIES, conditions.n_crossings)) < 0.5
    counted = [count_broken(conditions, twist).total for twist in twists]
    assert scores(couplings, pack(twists)).tolist() == counted
    assert [score(couplings, twist) for twist in twists] == counted
    assert np.array_equal(unpack(pack(twists)), twists)


@given(meshes(), st.integers(0, 2**32 - 1))
def test_cold_sweeps_never_break_more_in_any_copy(mesh: PolyMesh, seed) -> None:
    couplings, rng, copies = started(mesh, seed)
    before = scores(couplings, copies)
    for _ in range(4):
        sweep(couplings, copies, 0.0, rng)
        after = scores(couplings, copies)
        if all(len(set(row)) == 4 for row in couplings.windows.tolist()):
            assert np.all(after <= before)
        before = after


@pytest.mark.slow
@pytest.mark.parametrize("temperature", [0.7, pytest.param(1.0, marks=pytest.mark.slow)])
def test_sweeps_keep_the_boltzmann_distribution(temperature: float) -> None:
    # A torus of 9 quads has 18 crossings: the mean score of all choices is known exactly.
    conditions = conditions_of(grids.torus(3, 3, 2.0, 1.0))
    couplings = couple(conditions)
    broken = broken_by_all(conditions)
    weight = np.exp(-(broken - broken.min()) / temperature)
    mean = float((broken * weight).sum() / weight.sum())
    deviation = float(np.sqrt(((broken - mean) ** 2 * weight).sum() / weight.sum()))

    rng = np.random.default_rng(1)
    copies = random_copies(couplings, rng)
    found = []
    for number in range(800):
        sweep(couplings, copies, temperature, rng)
        if number >= 200 and number % 5 == 0:
            found.append(scores(couplings, copies))
    # 7,680 samples, correlated over a few sweeps; coins are rounded to 1/256.
    assert abs(np.mean(found) - mean) < 0.12 * deviation


@given(meshes(), st.integers(0, 2**32 - 1))
def test_copies_displace_one_another_as_cooling_would_have_it(mesh: PolyMesh, seed) -> None:
    couplings, rng, copies = started(mesh, seed)
    before = scores(couplings, copies)
    share = np.exp(-before * (1 / 2.0 - 1 / 2.1))
    share *= N_COPIES / share.sum()
    after = scores(couplings, resample(couplings, copies, 2.1, 2.0, rng))
    # Each score is kept as often as it should be, to within one copy for each that has it.
    for value in np.unique(before):
        had = before == value
        assert abs(np.count_nonzero(after == value) - share[had].sum()) < np.count_nonzero(had) + 1
    assert set(after.tolist()) <= set(before.tolist())
    same = resample(couplings, copies, 2.0, 2.0, rng)
    assert np.array_equal(same, copies)


@given(meshes(), st.integers(0, 2**32 - 1))
def test_crossing_is_as_good_as_the_best_choice_of_patches(mesh: PolyMesh, seed) -> None:
    conditions = conditions_of(mesh)
    assume(conditions.n_crossings)
    couplings = couple(conditions)
    rng = np.random.default_rng(seed)
    first = rng.random(conditions.n_crossings) < 0.5
    second = first ^ (rng.random(conditions.n_crossings) < 0.15)
    crossed = cross(couplings, first, [second])
    assert score(couplings, crossed) <= min(score(couplings, first), score(couplings, second))
    # Patches may be taken or left one by one: no single one of them improves the result.
    assert np.array_equal(cross(couplings, crossed, [first, second]), crossed)
    assert np.all((crossed == first) | (crossed == second))


@pytest.mark.slow
@settings(deadline=None, max_examples=12)
@given(small_meshes())
def test_small_meshes_are_woven_as_well_as_possible(mesh: PolyMesh) -> None:
    halfedges, threads = walked(mesh)
    conditions = twill_conditions(halfedges, threads)
    least = broken_by_all(conditions).min()
    vote = best_vote(conditions, threads, part_bunches(threads))
    found = optimise_twill(couple(conditions), vote.twist, effort="quick")
    assert count_broken(conditions, found).total == least
    bound = prove_bound(couple(conditions), irregular_seeds(halfedges, threads))
    degenerate = any(len(set(row)) < len(row) for row in conditions.gaps.tolist())
    degenerate |= bool(np.any(conditions.edge[:, 0] == conditions.edge[:, 1]))
    assert bound.least <= least
    if not degenerate:
        assert bound.optimum
        assert bound.least == least


@pytest.mark.slow
@given(meshes().filter(lambda mesh: mesh.n_corners <= 100), st.integers(0, 3))
@settings(max_examples=10, deadline=None)
def test_search_never_breaks_more_than_its_start(mesh: PolyMesh, seed: int) -> None:
    conditions = conditions_of(mesh)
    start = np.random.default_rng(seed).random(conditions.n_crossings) < 0.5
    found = optimise_twill(couple(conditions), start, effort="quick", seed=seed)
    assert count_broken(conditions, found).total <= count_broken(conditions, start).total
    if decide_twill(conditions).twillable and conditions.n_crossings <= 60:
        assert count_broken(conditions, found).total == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "steps", "known"),
    [(solids.cube, 1, 16), (solids.octahedron, 1, 16), (solids.cube, 2, 32), (solids.cube, 3, 64),
     (solids.icosahedron, 1, 40)],
)  # fmt: skip
def test_search_reaches_what_is_known(mesh, steps: int, known: int) -> None:
    conditions = conditions_of(refined(mesh(), f"catmull-clark:{steps}"))
    start = np.ones(conditions.n_crossings, dtype=bool)
    found = optimise_twill(couple(conditions), start, effort="quick", least=known)
    assert count_broken(conditions, found).total <= known


@pytest.mark.parametrize("mesh", [solids.cube, solids.octahedron])
def test_sixteen_is_proved_optimal(mesh) -> None:
    bound = prove_bound(couple(conditions_of(refined(mesh(), "catmull-clark:1"))), [])
    assert (bound.least, bound.optimum) == (16, True)


@pytest.mark.parametrize(("m", "n", "least"), [(7, 5, 20), (9, 7, 28), (15, 13, 52), (6, 5, 0)])
def test_odd_rings_of_conditions_bound_the_twill_of_an_odd_torus(m, n, least) -> None:
    # 4mn edge conditions, in rings of m: optima of the first two by MaxSAT.
    conditions = conditions_of(grids.torus(m, n, 3.0, 1.0))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bounds, "_MOST_WHOLE", 0)
        bound = prove_bound(couple(conditions), [])
    assert bound.least == least
    start = np.zeros(conditions.n_crossings, dtype=np.bool_)
    found = optimise_twill(couple(conditions), start, effort="quick")
    assert count_broken(conditions, found).total >= least


@pytest.mark.parametrize(("steps", "at_least", "at_most"), slow_but([(2, 28, 32), (3, 40, 64)]))
def test_bounds_of_large_spheres_lie_below_what_is_known(steps, at_least, at_most) -> None:
    halfedges, threads = walked(refined(solids.cube(), f"catmull-clark:{steps}"))
    couplings = couple(twill_conditions(halfedges, threads))
    seeds = irregular_seeds(halfedges, threads)
    bound = prove_bound(couplings, seeds, wider_work=WIDER_WORK["normal"])
    assert not bound.cut_short
    # With less work less is proved, and never too much.
    little, some = (prove_bound(couplings, seeds, most_work=work) for work in (1, 30_000_000))
    assert little.least <= some.least <= bound.least
    assert little.cut_short
    assert at_least <= bound.least <= at_most
    assert not bound.optimum


@settings(deadline=None, max_examples=30)
@given(small_meshes())
def test_sums_over_regions_prove_no_more_than_is_true(mesh: PolyMesh) -> None:
    halfedges, threads = walked(mesh)
    conditions = twill_conditions(halfedges, threads)
    couplings = couple(conditions)
    seeds = irregular_seeds(halfedges, threads)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bounds, "_MOST_WHOLE", 0)
        bound = prove_bound(couplings, seeds, wider_work=1e8)
    assert bound.least <= broken_by_all(conditions).min()
    assert not bound.optimum
