"""The order of assembly: its cost by definition, near the optimum, far below naive orders."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from assembly_models import model_of, twice
from crossing_maps import step_record
from hypothesis import given
from hypothesis import strategies as st
from rims import ring_of
from slow import slow_but

from fabweave.piece.piece import find_owners
from fabweave.plan import effort as model
from fabweave.plan.effort import (
    MeasuredOrder,
    StationBits,
    find_contacts,
    measure_order,
    piece_effort,
    reach,
)
from fabweave.plan.order import _easy_end, order_by_number, plan_order
from fabweave.plan.steps import build_steps, last_tenth


def planned(woven, *, enclosed=None, effort="quick", seed=0):
    """Plan the order of a model, closed as it is or as is said."""
    enclosed = woven.enclosed if enclosed is None else enclosed
    return plan_order(
        woven.made.pieces,
        woven.centres,
        woven.normals,
        woven.made.fastened,
        enclosed=enclosed,
        effort=effort,
        seed=seed,
    )


SMALL = (
    "shape:tetrahedron", "shape:octahedron", "shape:cube?n=2", "shape:torus?m=6&n=4",
    "shape:hypar?m=4&n=3", "shape:tube?m=6&n=2",
)  # fmt: skip


def effort_by_hand(made, order, *, enclosed):
    """Return the effort of each piece in order, straight from the words of the model."""
    pieces, there, result = made.pieces, set(), []
    for at, number in enumerate(order):
        piece, count = pieces[number], len(pieces[number].crossings)
        there.add(number)
        others = [other for other in there if other != number]
        # The strand that the piece itself makes there counts, too, if it crosses itself.
        held = {
            (crossing, over)
            for other in (*others, number)
            for crossing, over in zip(pieces[other].crossings, pieces[other].over, strict=True)
        }
        over, under = [], []
        for k, (crossing, top) in enumerate(zip(piece.crossings, piece.over, strict=True)):
            if (crossing, not top) in held:
                (over if top else under).append(k)
        joined = 0
        for joint in made.joints:
            joined += (joint.pieces[0] == number) * (joint.pieces[1] in there)
            joined += (joint.pieces[1] == number) * (joint.pieces[0] in there)
        met = len(over) + len(under) + joined
        plain = model.LAY * len(over) + model.CLOSE * (joined == 2)
        plain += dict(enumerate(model.LOOSE)).get(met, 0.0)
        behind = model.JOIN * joined
        for k in under:
            left = 2 * k <= count - 1
            away = min(k, count - 1 - k)
            outside = sum((2 * j <= count - 1) == left and (j < k) == left and j != k
                          for j in under)  # fmt: skip
            behind += model.TUCK if away == 0 else model.THREAD + model.PULL * away
            behind += model.DRAG * outside
        result.append(plain + behind * (reach((at + 1) / len(order)) if enclosed else 1.0))
    return result


@pytest.mark.slow
@pytest.mark.parametrize("shape", SMALL)
@pytest.mark.parametrize("seed", [0, 1])
def test_the_effort_is_what_the_model_says(shape, seed):
    woven = model_of(shape)
    order = np.random.default_rng(seed).permutation(len(woven.made.pieces)).tolist()
    contacts = find_contacts(woven.made.pieces, woven.made.fastened)
    measured = measure_order(contacts, order, enclosed=woven.enclosed)
    np.testing.assert_allclose(
        measured.effort, effort_by_hand(woven.made, order, enclosed=woven.enclosed)
    )


@st.composite
def situations(draw):
    """Return a number of stations, and for each what is there: nothing, over or under."""
    count = draw(st.integers(1, 14))
    there = draw(st.lists(st.sampled_from(" ou"), min_size=count, max_size=count))
    return count, there


def state_of(there):
    bits = StationBits(len(there))
    return sum(
        bits.strand(k, over=what == "o", second=False) for k, what in enumerate(there) if what > " "
    )


@given(situations())
def test_the_effort_is_the_same_from_either_end(situation):
    count, there = situation
    one, two = piece_effort(count, state_of(there)), piece_effort(count, state_of(there[::-1]))
    assert one[0] == two[0]
    # The middle of an odd number of stations has its tip at the start.
    if count % 2 == 0 or there[count // 2] != "u":
        assert one[1] == pytest.approx(two[1])


@given(situations(), st.integers(0, 13))
def test_a_strand_more_above_is_never_easier(situation, at):
    count, there = situation
    there[at % count] = " "
    free = piece_effort(count, state_of(there))
    there[at % count] = "o"
    over = piece_effort(count, state_of(there))
    there[at % count] = "u"
    under = piece_effort(count, state_of(there))
    assert sum(under) > sum(over)
    assert under[1] >= free[1] + model.TUCK


@given(situations(), st.data())
def test_a_strand_lapped_of_two_pieces_is_one_strand(situation, data):
    count, there = situation
    state = state_of(there)
    bits = StationBits(count)
    for k, what in enumerate(there):
        if what > " " and data.draw(st.booleans()):
            state ^= bits.strand(k, over=what == "o", second=True)
            if data.draw(st.booleans()):
                state ^= bits.strand(k, over=what == "o", second=False)
    assert piece_effort(count, state) == piece_effort(count, state_of(there))


def held(contacts, order):
    """Say which pieces of an order meet nothing before them."""
    rank = {piece: at for at, piece in enumerate(order)}
    return [
        piece
        for piece in order
        if all(rank[other] > rank[piece] for other, _, _ in contacts.meets[piece])
    ]


@pytest.mark.parametrize("shape", SMALL)
@pytest.mark.parametrize("effort", ["quick", "normal"])
def test_every_piece_comes_once_and_holds(shape, effort):
    woven = model_of(shape)
    contacts = find_contacts(woven.made.pieces, woven.made.fastened)
    found = planned(woven, effort=effort, seed=3)
    order = found.order.tolist()
    assert sorted(order) == list(range(len(woven.made.pieces)))
    assert held(contacts, order) == order[:1]
    # What is told is what the order costs, and neither naive order costs less.
    measured = measure_order(contacts, order, enclosed=woven.enclosed)
    assert found.effort.tolist() == measured.effort.tolist()
    naive = [
        sum(effort_by_hand(woven.made, order, enclosed=woven.enclosed))
        for order in (range(len(order)), order_by_number(woven.made.pieces).tolist())
    ]
    assert (found.by_thread, found.by_number) == pytest.approx(naive)
    assert found.total < min(naive)
    assert found.saved == pytest.approx(1 - found.total / min(naive))


@pytest.mark.parametrize("shape", ["shape:tetrahedron", "shape:hypar?m=2&n=3"])
def test_the_best_of_all_orders_is_found(shape):
    """Every order of six or seven pieces in which each meets one before it."""
    woven = model_of(shape, boundary="end")
    contacts = find_contacts(woven.made.pieces, woven.made.fastened)
    count = len(woven.made.pieces)
    assert 5 <= count <= 7
    best = min(
        measure_order(contacts, order, enclosed=woven.enclosed).cost
        for order in itertools.permutations(range(count))
        if len(held(contacts, order)) == 1
    )
    found = planned(woven, effort="best")
    assert found.cost <= best * 1.02 + 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(
    ("shape", "changed"),
    slow_but(
        [
            ("shape:cube", {"refine": "catmull-clark:3", "max_length_mm": 200.0}),
            ("shape:slit?genus=2", {"pattern": "twill"}),
            ("shape:icosahedron", {"pattern": "triaxial", "refine": "loop:1"}),
        ]
    ),
)
def test_a_quarter_below_naive_orders(shape, changed):
    woven = model_of(shape, 400.0, **changed)
    found = planned(woven)
    assert found.saved >= 0.25


def test_of_orders_that_cost_nearly_the_same_the_one_with_the_easiest_end_is_taken():
    def order(*efforts):
        none = np.zeros(len(efforts), dtype=int)
        return MeasuredOrder(np.arange(len(efforts)), np.array(efforts), none)

    hard, easy = order(40.0, 40.0, 20.0), order(50.0, 40.5, 10.0)
    dear = order(60.0, 42.0, 1.0)
    assert _easy_end([hard, easy, dear]) is easy
    assert _easy_end([]).total == 0.0


def test_two_objects_are_made_one_after_the_other():
    """Where nothing joins them, each begins with a piece of its own, and is finished first."""
    woven = model_of("shape:octahedron")
    one = woven.made.pieces
    pieces = twice(one, len(woven.centres))
    fastened = np.tile(woven.made.fastened, 2)
    contacts = find_contacts(pieces, fastened)
    found = plan_order(
        pieces, np.concatenate((woven.centres, woven.centres + 500.0)),
        np.tile(woven.normals, (2, 1)), fastened, enclosed=True,
        effort="quick", seed=0,
    )  # fmt: skip
    order = found.order.tolist()
    assert held(contacts, order) == [order[0], order[len(one)]]
    assert set(order[: len(one)]) == set(range(len(one)))


@pytest.mark.parametrize("shape", SMALL)
def test_steps_group_only_what_is_laid(shape):
    woven = model_of(shape)
    found = planned(woven)
    steps = build_steps(woven.made, found)
    ids = [piece.id for piece in woven.made.pieces]
    assert [key for step in steps for key in step.pieces] == [ids[k] for k in found.order]
    for step in steps:
        if len(step.pieces) > 1:
            connections = len(step.over) + len(step.under) + len(step.joints)
            assert not step.under
            assert connections <= 8
            assert len(step.pieces) <= 4
    assert sum(step.effort for step in steps) == pytest.approx(found.total, abs=0.01 * len(ids))


def test_what_a_ring_holds_is_fastened_with_it_in_the_last_step():
    woven = model_of("shape:hypar?m=4&n=3")
    found = planned(woven, enclosed=False)
    keys = np.array([5, 2, 9, 7])
    ring = ring_of((50.0, 0.0), (55.0, 0.0), 4, hole_mm=np.full(4, 2.0), edge_mm=4.0)
    named = (replace(piece, crossings=keys[piece.crossings]) for piece in ring.pieces)
    ring = replace(ring, pieces=tuple(named))
    plain = build_steps(woven.made, found)
    *steps, last = build_steps(replace(woven.made, rings=(ring,)), found)
    assert (last.ring, last.pieces, last.effort, last.step) == (
        ("R1", "R2"), (), 0.0, len(plain) + 1
    )  # fmt: skip
    assert sorted(last.fasten) == sorted(keys)
    for step, before in zip(steps, plain, strict=True):
        waits = tuple(key for key in before.fasten if key not in keys)
        # What waits to be fastened may be clipped in the meantime, and that is said.
        assert replace(step, text="") == replace(before, fasten=waits, text="")
    owners = find_owners(woven.made.pieces, len(woven.centres)).piece
    for piece in ring.pieces:
        for at, key in enumerate(piece.crossings, start=1):
            over, under = (woven.made.pieces[owners[key, side]].id for side in (1, 0))
            part = next(one for one in last.text.split(": ")[1].split(";") if piece.id in one)
            assert f"{over} with {under} ({at})" in part


def test_the_last_tenth_is_that_of_the_fewest_last_steps():
    first = step_record(1, pieces=("A1",) * 9, effort=9.0)
    last = step_record(2, pieces=("A2",), effort=4.0)
    # One piece of ten takes 4, all take 1.3 in the mean.
    assert last_tenth([first, last]) == pytest.approx(4.0 / 1.3)
    # Of eleven pieces, one is less than a tenth: the step before counts, too.
    assert last_tenth([step_record(0, pieces=("B1",)), first, last]) == pytest.approx(
        1.3 / (14 / 11)
    )
    assert last_tenth([]) == 1.0
