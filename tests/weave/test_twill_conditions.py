"""The conditions of a 2/2 twill, counted again by walking, and the exact decision."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes_shared import real_mesh
from strategies import merged, shuffled
from twill_oracle import broken_by_all, conditions_of, proves, refined, small_meshes
from weaving_meshes import meshes, walked

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.pattern import over_of_passes
from fabweave.weave.threads import thread_labels, trace_threads
from fabweave.weave.twill.conditions import (
    TwillConditions,
    broken_at_turns,
    count_broken,
    twill_conditions,
)
from fabweave.weave.twill.decide import Decision, decide_twill, explain


@pytest.mark.parametrize(
    ("mesh", "steps", "edges", "total"),
    [
        (solids.cube, 1, 48, 264),
        (solids.cube, 2, 192, 1128),
        (solids.cube, 3, 768, 4584),
        (solids.icosahedron, 1, 120, 660),
    ],
)
def test_number_of_conditions_is_known(mesh, steps, edges, total) -> None:
    conditions = conditions_of(refined(mesh(), f"catmull-clark:{steps}"))
    assert conditions.n_crossings == edges
    assert conditions.count == total


@given(meshes(closed=True))
def test_closed_meshes_have_a_condition_for_each_pass_and_corner(mesh: PolyMesh) -> None:
    halfedges = build_halfedges(mesh)
    conditions = twill_conditions(halfedges, trace_threads(halfedges))
    valence = np.bincount(mesh.indices)
    assert len(conditions.edge) == 2 * halfedges.n_edges
    assert len(conditions.face) == mesh.face_sizes[mesh.face_sizes >= 4].sum()
    assert len(conditions.vertex) == valence[valence >= 4].sum()


@given(meshes(), st.integers(0, 2**32 - 1), st.booleans())
def test_edge_conditions_are_the_two_over_two_under_of_the_threads(mesh, seed, turn) -> None:
    halfedges, threads = walked(mesh, turn=turn)
    conditions = twill_conditions(halfedges, threads)
    twist = np.random.default_rng(seed).random(threads.n_crossings) < 0.5
    over = over_of_passes(threads, twist)
    broken = 0
    for number in range(threads.n_threads):
        own = over[threads.offsets[number] : threads.offsets[number + 1]].tolist()
        count = len(own)
        steps = range(count if threads.closed[number] else count - 2)
        # Two passes apart a strand changes sides in a 2/2 twill: o o u u o o u u.
        broken += sum(own[k] == own[(k + 2) % count] for k in steps)
    at_turns = broken_at_turns(threads, twist)
    assert count_broken(conditions, twist).edge + at_turns == broken
    assert at_turns == 0 or len(threads.turn_pass)


@pytest.mark.parametrize(
    ("mesh", "breaks"),
    [
        (parse_shape("shape:tube"), 32),
        (parse_shape("shape:hypar"), 36),
        (grids.tube(16, 6, 1.0, 1.0), 32),
    ],
)
def test_an_exact_twill_whose_threads_turn_back_breaks_at_known_places(mesh, breaks) -> None:
    # What a walk along each thread and round its turns finds; no choice of twists has fewer.
    halfedges, threads = walked(mesh, turn=True)
    twist = decide_twill(twill_conditions(halfedges, threads)).twist
    assert broken_at_turns(threads, twist) == breaks


@given(meshes(), st.integers(0, 2**32 - 1))
def test_counts_do_not_depend_on_numbering_or_on_the_sense(mesh: PolyMesh, seed) -> None:
    halfedges, threads = walked(mesh)
    twist = np.random.default_rng(seed).random(threads.n_crossings) < 0.5
    broken = count_broken(twill_conditions(halfedges, threads), twist)
    assert count_broken(twill_conditions(halfedges, threads), ~twist) == broken

    first = threads.crossing_halfedge
    ends = zip(halfedges.tail[first].tolist(), halfedges.head[first].tolist(), strict=True)
    by_ends = {frozenset(pair): sense for pair, sense in zip(ends, twist.tolist(), strict=True)}
    if len(by_ends) < len(twist):
        return  # two edges between the same vertices cannot be told apart by their ends
    halfedges, threads = walked(shuffled(mesh, seed))
    back = np.argsort(np.random.default_rng(seed).permutation(mesh.n_vertices))
    first = threads.crossing_halfedge
    ends = np.column_stack((back[halfedges.tail[first]], back[halfedges.head[first]]))
    same = np.array([by_ends[frozenset(pair)] for pair in ends.tolist()], dtype=bool)
    assert count_broken(twill_conditions(halfedges, threads), same) == broken


@given(small_meshes())
def test_decision_agrees_with_all_choices(mesh: PolyMesh) -> None:
    conditions = conditions_of(mesh)
    decision = decide_twill(conditions)
    assert decision.twillable == (broken_by_all(conditions).min() == 0)
    assert proves(conditions, decision)


@given(st.data())
def test_decision_agrees_with_all_choices_for_any_conditions(data) -> None:
    # Conditions that no mesh has: many free bits, so that the solver decides.
    count = data.draw(st.integers(4, 16))
    crossing = st.integers(0, count - 1)
    edges = data.draw(st.lists(st.tuples(crossing, crossing), max_size=4))
    gaps = data.draw(st.lists(st.tuples(*(crossing,) * 4), max_size=40))
    conditions = TwillConditions(
        count,
        np.array(edges, dtype=np.int64).reshape(-1, 2),
        np.zeros(len(edges), dtype=np.int64),
        np.array(gaps, dtype=np.int64).reshape(-1, 4),
        np.zeros((0, 4), dtype=np.int64),
    )
    decision = decide_twill(conditions)
    assert decision.twillable == (broken_by_all(conditions).min() == 0)
    assert proves(conditions, decision)


@pytest.mark.parametrize("m", range(3, 13))
@pytest.mark.parametrize("n", range(3, 13))
def test_tori_are_twillable_exactly_when_a_side_is_even(m: int, n: int) -> None:
    decision = decide_twill(conditions_of(grids.torus(m, n, 2.0, 1.0)))
    assert decision.twillable == (m % 2 == 0 or n % 2 == 0)


def test_bodies_are_decided_one_by_one() -> None:
    torus = grids.torus(4, 6, 2.0, 1.0)
    many = merged(*[torus] * 6)
    decision = decide_twill(conditions_of(many))
    assert decision.twillable
    assert decision.free_bits == 6 * decide_twill(conditions_of(torus)).free_bits
    assert not decide_twill(conditions_of(merged(many, solids.cube()))).twillable


@pytest.mark.parametrize(
    ("name", "twillable"),
    [
        ("quad/catmark_torus.obj", True),
        ("tri/double-torus.obj", True),
        ("quad/spot_quadrangulated.obj", False),
        ("quad/bob_quad.obj", False),
        ("ngon/hexaSphere.off", False),
    ],
)
def test_real_meshes_have_their_known_answers(name: str, twillable: bool) -> None:
    conditions = conditions_of(real_mesh(name))
    decision = decide_twill(conditions)
    assert decision.twillable == twillable
    assert proves(conditions, decision)


def test_certificates_are_checked_not_believed() -> None:
    even, odd = conditions_of(grids.torus(4, 4, 2.0, 1.0)), conditions_of(solids.cube())
    good, bad = decide_twill(even), decide_twill(odd)
    assert good.twist is not None
    spoiled = good.twist.copy()
    spoiled[0] ^= True
    none = np.zeros(0, dtype=np.int64)
    assert not proves(even, replace(good, twist=spoiled))
    assert not proves(even, Decision(None, 4, none, none))
    assert not proves(even, Decision(None, -1, np.arange(3), none))
    assert not proves(odd, replace(bad, contradiction=bad.contradiction[:-1]))
    assert not proves(odd, replace(bad, contradiction=bad.contradiction[[0, 1, 0]]))
    assert not proves(even, Decision(None, 4, none, np.arange(1)))


@given(meshes(closed=True))
def test_what_is_named_as_the_obstruction_obstructs(mesh: PolyMesh) -> None:
    halfedges, threads = walked(mesh)
    conditions = twill_conditions(halfedges, threads)
    decision = decide_twill(conditions)
    labels = thread_labels(threads.n_threads)
    reason = explain(halfedges, threads, conditions, decision, labels)
    assert (reason is None) == decision.twillable
    if reason is None:
        return
    valence, sizes = np.bincount(mesh.indices), mesh.face_sizes
    assert all(valence[v] % 4 and f"vertex {v} has valence {valence[v]}" in reason.text
               for v in reason.vertices)  # fmt: skip
    assert all(sizes[f] % 4 and f"face {f} has {sizes[f]} sides" in reason.text
               for f in reason.faces)  # fmt: skip
    assert reason.vertices or reason.faces or reason.threads


@pytest.mark.parametrize("length", [2, 6, 10, 3, 5])
def test_a_ring_of_crossings_that_is_no_multiple_of_four_obstructs(length: int) -> None:
    # One ring that passes other strands: only its own edge conditions.
    ring = np.arange(length)
    pairs = np.column_stack((ring, (ring + 2) % length))
    none = np.zeros((0, 4), dtype=np.int64)
    conditions = TwillConditions(length, pairs, np.zeros(length, dtype=np.int64), none, none)
    decision = decide_twill(conditions)
    assert not decision.twillable
    assert proves(conditions, decision)
