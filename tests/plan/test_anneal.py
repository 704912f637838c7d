"""Annealing keeps what it knows up to date: after any moves it is what is worked out afresh."""

from functools import cache

import numpy as np
import pytest
from assembly_models import model_of, twice
from hypothesis import given
from hypothesis import strategies as st

from fabweave.plan.anneal import OrderSearch, anneal
from fabweave.plan.effort import find_contacts, measure_order
from fabweave.plan.order import grow_order

SHAPES = ("shape:tetrahedron", "shape:octahedron", "shape:tube?m=6&n=2")
FASTENED = ("joints", "all", "none")


@cache
def contacts_of(shape, fastened, objects=1):
    """Return what the pieces of objects meet if some, all or no crossings take a fastener."""
    woven = model_of(shape)
    one = woven.made.fastened
    some = {"joints": one, "all": one | True, "none": one & False}[fastened]
    pieces = woven.made.pieces if objects == 1 else twice(woven.made.pieces, len(woven.centres))
    return find_contacts(pieces, np.tile(some, objects))


def held(contacts, order):
    """Say which pieces of an order meet nothing before them."""
    rank = np.argsort(order)
    return [
        piece
        for piece in order
        if all(rank[other] > rank[piece] for other, _, _ in contacts.meets[piece])
    ]


shapes, fasteners, seeds = (
    st.sampled_from(SHAPES), st.sampled_from(FASTENED), st.integers(0, 2**32 - 1)
)  # fmt: skip


@given(st.builds(contacts_of, shapes, fasteners), seeds)
def test_any_order_costs_what_is_measured(contacts, seed):
    """The weights of things, summed over what is there, are the effort as it is defined."""
    count = len(contacts.meets)
    orders = [np.random.default_rng((seed, copy)).permutation(count).tolist() for copy in range(3)]
    search = OrderSearch(contacts, orders, [order[:1] for order in orders], enclosed=False)
    assert search.orders().T.tolist() == orders
    for order, cost in zip(orders, search.costs(), strict=True):
        measured = measure_order(contacts, order, enclosed=False)
        # Places are evenly spread, with one end more than there are pieces.
        loose = (measured.cost - measured.total) * count / (count + 1)
        assert cost == pytest.approx(measured.total + loose)


@given(
    st.builds(contacts_of, shapes, fasteners, st.sampled_from([1, 2])), st.booleans(), seeds,
    st.data(),
)  # fmt: skip
def test_what_is_kept_up_is_what_is_worked_out_afresh(contacts, enclosed, seed, data):
    """Pieces go anywhere, and back again: sums are exact, and costs change as was foretold."""
    rng = np.random.default_rng(seed)
    first = np.unique(contacts.component, return_index=True)[1]
    last = len(contacts.meets) - 1 - np.unique(contacts.component[::-1], return_index=True)[1]
    roots = [first.tolist(), last.tolist()]
    search = OrderSearch(
        contacts, [grow_order(contacts, own) for own in roots], roots, enclosed=enclosed
    )
    copies, real = search.copies, slice(len(contacts.meets))
    for number in data.draw(st.lists(st.integers(0, len(search.classes) - 1), max_size=8)):
        of = search.classes[number]
        place, sums, costs = copies.place.copy(), copies.sums.copy(), search.costs()
        ways = search.ways(of, 0.25 + rng.random((len(of.pieces), 2)) / 2)
        root, possible = copies.root[of.pieces], np.isfinite(ways.cost)
        now = np.maximum((ways.there < place[of.pieces]).sum(axis=0) - 1, 0)[None]
        assert np.all(np.take_along_axis(possible, now, axis=0) | root)
        chosen = np.argmax(np.where(possible, rng.random(possible.shape), -1.0), axis=0)[None]

        search.go(of, ways, now[0])
        np.testing.assert_array_equal(copies.sums[:, real], sums[:, real])
        stayed = search.costs()
        copies.place[:], copies.sums[:] = place, sums
        np.testing.assert_array_equal(search.costs(), costs)

        search.go(of, ways, chosen[0])
        np.testing.assert_array_equal(copies.sums[:, real], search.sums()[:, real])
        for order, own in zip(search.orders().T.tolist(), roots, strict=True):
            assert held(contacts, order) == own
        known = np.where(root, 0.0, ways.cost)
        here, there = (np.take_along_axis(known, one, axis=0) for one in (now, chosen))
        change = (there - here).sum(axis=(0, 1))
        np.testing.assert_allclose(search.costs() - stayed, change, atol=1e-8)


def test_a_sum_that_is_wrong_is_seen():
    """What the tests above compare with does object."""
    contacts = contacts_of(SHAPES[1], "joints")
    search = OrderSearch(contacts, [grow_order(contacts, [0])], [[0]], enclosed=True)
    before = search.sums()
    search.copies.place[0] = 0.999
    assert np.any(search.sums() != before)


@pytest.mark.parametrize("shape", SHAPES)
def test_annealed_orders_hold_and_are_the_same_for_the_same_seed(shape):
    contacts = contacts_of(shape, "joints")
    grown = grow_order(contacts, [1])
    found = anneal(contacts, [(grown, [1])] * 8, enclosed=True, sweeps=10, seed=5)
    again = anneal(contacts, [(grown, [1])] * 8, enclosed=True, sweeps=10, seed=5)
    assert found == again
    costs = [measure_order(contacts, order, enclosed=True).cost for order, _ in found]
    by_thread = measure_order(contacts, range(len(grown)), enclosed=True).cost
    assert costs[0] < by_thread
    assert costs[0] == pytest.approx(min(costs), rel=0.02)  # places stand for counts of pieces
    for order, roots in found:
        assert roots == [1]
        assert sorted(order) == list(range(len(contacts.meets)))
        assert held(contacts, order) == [1]
