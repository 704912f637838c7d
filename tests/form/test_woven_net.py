"""Woven objects come to rest as their symmetry, their size and their material say."""

from dataclasses import replace

import numpy as np
import pytest
from jobs import laid

from fabweave.form.body import fitted
from fabweave.form.net import energy, strains
from fabweave.form.relax import relax, soft_modes
from fabweave.form.woven_net import Elastic, woven_net

CARD = Elastic(3000.0, 0.3, 750.0)


def net_of(shape, size_mm, pin, material=CARD, pieces=2, **options):
    woven, _, supplies = laid(shape, size_mm=size_mm, **options)
    threads = woven.weave.threads
    net, state = woven_net(
        woven.ribbons, woven.weave, supplies.thickness_mm(woven.bunches),
        [material] * threads.n_threads, np.full(threads.n_crossings, pin), pieces=pieces,
    )  # fmt: skip
    return woven, replace(net, weight=0 * net.weight), state


def test_a_net_has_the_weight_and_the_length_of_its_ribbons():
    woven, _, supplies = laid("shape:torus?m=12&n=6", size_mm=300.0)
    threads = woven.weave.threads
    thickness = supplies.thickness_mm(woven.bunches)
    net, state = woven_net(woven.ribbons, woven.weave, thickness, [CARD] * threads.n_threads,
                           np.zeros(threads.n_crossings))  # fmt: skip
    assert len(net.ends) == 2 * threads.n_crossings
    assert (net.turns >= 0).sum() == 2 * threads.n_crossings
    middle = (woven.ribbons.left + woven.ribbons.right) / 2
    for thread in range(threads.n_threads):
        own = middle[woven.ribbons.offsets[thread] : woven.ribbons.offsets[thread + 1]]
        length = np.linalg.norm(own - np.roll(own, -1, axis=0), axis=1).sum()
        spans = np.flatnonzero(
            np.isin(np.arange(len(net.ends)), np.arange(*threads.offsets[thread : thread + 2]))
        )
        assert net.rest[spans, :, 0].sum() == pytest.approx(length, rel=0.03)
    # Nothing but bending and twisting, a little stretch, and no turn at pins.
    twist, _ = strains(net, state)
    assert np.abs(twist - net.rest)[..., 0].max() < 0.05 * net.rest[..., 0].max()
    assert net.rest_angles == pytest.approx(state.angles)
    area = (net.rest[..., 0] * net.stiffness[..., 0] * net.rest[..., 0] / CARD.young_mpa).sum()
    assert -net.weight[:, 2].sum() == pytest.approx(9.81 * 750e-9 * area, rel=1e-2)


def test_a_flat_weave_is_at_rest():
    """A hypar next to without height, of strips next to without thickness: nothing is bent."""
    _, net, state = net_of("shape:hypar?m=6&n=6&height=0.001", 300.0, 10.0, thickness_mm=0.02,
                           clearance_mm=0.001, boundary="end")  # fmt: skip
    found = relax(net, state)
    assert found.settled
    moved = fitted(found.state, state.bodies.origin).bodies.origin - state.bodies.origin
    assert np.linalg.norm(moved, axis=1).max() < 0.04


def test_what_is_symmetric_relaxes_symmetrically():
    woven, net, state = net_of("shape:torus?m=12&n=6", 300.0, 5.0)
    found = relax(net, state)
    assert found.settled
    places = fitted(found.state, state.bodies.origin).bodies.origin
    middle = places.mean(axis=0)
    turn = 2 * np.pi / 12
    matrix = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    turned = (places - middle) @ np.transpose(matrix) + middle
    apart = np.linalg.norm(turned[:, None] - places[None], axis=2).min(axis=1)
    assert apart.max() < 1e-3
    assert np.linalg.norm(places - woven.ribbons.centre, axis=1).max() > 0.1


def test_stiffer_is_as_much_more_energy_and_the_same_shape():
    _, net, state = net_of("shape:torus?m=12&n=6", 300.0, 0.0)
    _, stiff, same = net_of("shape:torus?m=12&n=6", 300.0, 0.0, Elastic(9000.0, 0.3, 750.0))
    one, other = relax(net, state), relax(stiff, same)
    assert other.energy_nmm == pytest.approx(3 * one.energy_nmm, rel=1e-6)
    places = fitted(other.state, one.state.bodies.origin).bodies.origin
    assert np.abs(places - one.state.bodies.origin).max() < 1e-2


def test_twice_as_large_and_as_thick_is_eight_times_the_energy():
    _, net, state = net_of("shape:torus?m=12&n=6", 200.0, 0.0, thickness_mm=0.3,
                           clearance_mm=0.2)  # fmt: skip
    _, larger, there = net_of("shape:torus?m=12&n=6", 400.0, 0.0, thickness_mm=0.6,
                              clearance_mm=0.4)  # fmt: skip
    assert energy(larger, there) == pytest.approx(8 * energy(net, state), rel=1e-6)


def test_energy_never_rises_and_triangles_brace_themselves():
    _, net, state = net_of("shape:torus?m=12&n=6", 300.0, 0.0)
    found = relax(net, state)
    assert all(a >= b for a, b in zip(found.history, found.history[1:], strict=False))
    plain, _ = soft_modes(net, found.state, 8)
    _, kagome, there = net_of("shape:icosahedron", 300.0, 0.0, pattern="kagome",
                              refine="loop:2")  # fmt: skip
    braced, _ = soft_modes(kagome, relax(kagome, there).state, 8)
    assert np.abs(plain[:6]).max() < 0.05 * plain[6]
    assert np.abs(braced[:6]).max() < 0.05 * braced[6]
