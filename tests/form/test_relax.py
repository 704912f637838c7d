"""Strips come to rest where theory says, and a net's forces are those of its energy."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from strips_net import POISSON, YOUNG, chain, even_inner, fixing, net_of, screw_state

from fabweave.form.net import energy, section_stiffness, strains, turned
from fabweave.form.relax import Solver, relax, soft_modes
from fabweave.form.screw import Frames, exponential

LENGTH = 200.0


def bending(width=10.0, thickness=0.4):
    return YOUNG * width * thickness**3 / 12


# Large deflections of a cantilever with a load at its tip: load L² / E I, how far the tip goes down
# and back, as shares of the length (Mattiasson, Int. J. Numer. Meth. Eng. 17, 1981, table I).
MATTIASSON = [(0.2, 0.06636, 0.00265), (1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763),
              (10.0, 0.81061, 0.55500)]  # fmt: skip


def tip(load, spans, pieces=1):
    net = fixing(chain(LENGTH, spans, pieces=pieces), 0)
    weight = net.weight.copy()
    weight[-1, 2] = -load * bending() / LENGTH**2
    net = replace(net, weight=weight)
    found = relax(net, screw_state(net, [LENGTH / spans, 0, 0, 0, 0, 0]))
    assert found.settled
    x, y, z = found.state.bodies.origin[-1] / LENGTH
    assert abs(y) < 1e-9
    return -z, 1.0 - x


@pytest.mark.parametrize(("load", "down", "back"), MATTIASSON)
def test_a_cantilever_bends_as_elliptic_integrals_say(load, down, back):
    assert tip(load, 12, 4) == pytest.approx((down, back), abs=2e-4)


def test_it_converges_with_the_square_of_the_pieces():
    errors = [abs(tip(5.0, 4, pieces)[0] - 0.713789) for pieces in (1, 2, 4, 8)]
    assert errors[-1] < 2e-4
    for coarse, fine in itertools.pairwise(errors):
        assert 3.0 < coarse / fine < 5.5


@pytest.mark.parametrize("pieces", [1, 4])
def test_a_ring_has_the_energy_of_its_curvature(pieces):
    """A straight strip, closed: (2 pi)² E I / 2 L, whatever it was before."""
    spans = 8
    net = chain(LENGTH, spans, pieces=pieces, ring=True)
    turn = 2 * np.pi / spans
    state = screw_state(net, [LENGTH / spans, 0, 0, 0, turn, 0])
    push = exponential(0.2 * np.random.default_rng(1).normal(size=(spans, 6)))
    found = relax(net, even_inner(net, state.bodies.then(push), np.zeros(0)))
    assert found.settled
    assert found.energy_nmm == pytest.approx(2 * np.pi**2 * bending() / LENGTH, rel=1e-6)
    assert all(a >= b for a, b in zip(found.history, found.history[1:], strict=False))


@pytest.mark.parametrize("most", [1, 4, 7])
def test_what_is_left_on_its_way_goes_on_as_if_it_had_not_been(most):
    spans = 8
    net = chain(LENGTH, spans, pieces=4, ring=True)
    state = screw_state(net, [LENGTH / spans, 0, 0, 0, 2 * np.pi / spans, 0])
    push = exponential(0.2 * np.random.default_rng(1).normal(size=(spans, 6)))
    start = even_inner(net, state.bodies.then(push), np.zeros(0))
    whole, begun = relax(net, start), relax(net, start, most=most)
    assert len(begun.history) < len(whole.history)
    after = relax(net, start, begun=begun)
    assert after.history == whole.history
    assert np.array_equal(after.state.bodies.origin, whole.state.bodies.origin)


def test_a_twisted_strip_has_the_energy_of_its_twist():
    net = fixing(chain(LENGTH, 6), 0, 6)
    turn = 1.9
    start = screw_state(net, [LENGTH / 6, 0, 0, turn / 6, 0, 0])
    axes = start.bodies.axes.copy()
    axes[1:6] = np.eye(3)
    found = relax(net, even_inner(net, Frames(start.bodies.origin, axes), np.zeros(0)))
    shear = YOUNG / (2 * (1 + POISSON))
    wanted = shear * 10.0 * 0.4**3 / 3 * turn**2 / (2 * LENGTH)
    assert found.energy_nmm == pytest.approx(wanted, rel=1e-9)


def test_an_annulus_sector_closes_to_a_cone():
    """In the plane it keeps the curvature 1 / R, on the cone it has 1 / r in all."""
    radius, angle, spans = 150.0, 4.0, 24
    length = radius * angle
    net = chain(length, spans, turn=angle, width=20.0, thickness=0.1, ring=True)
    ring = length / (2 * np.pi)
    lean = np.arccos(ring / radius)
    # A frame goes round; its normal leans so that the curvature in its plane is 1 / R.
    turn = 2 * np.pi / spans
    twist = [length / spans, 0, 0, 0, turn * np.sin(lean), turn * np.cos(lean)]
    found = relax(net, screw_state(net, twist))
    assert found.settled
    wanted = 0.5 * bending(20.0, 0.1) * length * (ring**-2 - radius**-2)
    assert found.energy_nmm == pytest.approx(wanted, rel=1e-3)
    frames = found.state.bodies
    middle = frames.origin.mean(axis=0)
    assert np.linalg.norm(frames.origin - middle, axis=1) == pytest.approx(ring, rel=1e-4)


def test_an_arch_is_the_elastica():
    """Ends held nearer than the strip is long: its height is that of Euler's curve."""
    chord, spans = 0.6 * LENGTH, 40
    net = chain(LENGTH, spans)
    held = net.held.copy()
    held[[0, -1]] = 1e4
    place = net.place.copy()
    place[-1, 0] = chord
    net = replace(net, held=held, place=place)
    turn = 2.5 / spans
    start = screw_state(net, [LENGTH / spans, 0, 0, 0, -turn, 0])
    found = relax(net, start)
    assert found.settled
    modulus = brentq(lambda k: 2 * ellipe(k**2) / ellipk(k**2) - 1 - chord / LENGTH, 0.1, 0.95)
    height = np.abs(found.state.bodies.origin[:, 2]).max() / LENGTH
    assert height == pytest.approx(modulus / ellipk(modulus**2), rel=2e-3)


def frame(*, braced):
    """Return four strips that are pinned at the corners of a square; a fifth one braces it."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float) * 100.0
    ends = [(0, 1), (1, 2), (2, 3), (3, 0)] + [(0, 2)] * braced
    ways = np.array([corners[b] - corners[a] for a, b in ends])
    lengths = np.linalg.norm(ways, axis=1)
    heading = np.arctan2(ways[:, 1], ways[:, 0])
    # At each corner one strip has the frame of the body, and the others turn in it.
    turns = np.array([(0, -1), (1, -1), (2, -1), (3, -1)] + [(4, 5)] * braced)
    own = heading[[3, 0, 1, 2]]
    angles = np.array(
        [heading[a] - own[a] for a in range(4)] + [np.pi / 4 - own[0], np.pi / 4 - own[2]]
    )
    rest = np.zeros((len(ends), 2, 6))
    rest[..., 0] = lengths[:, None] / 2
    section = section_stiffness(np.array(10.0), np.array(0.4), np.array(YOUNG), POISSON)
    stiffness = section / rest[..., :1]
    net = net_of(ends, rest, stiffness, 4, turns=turns, pins=np.zeros(4 + 2 * braced))
    return net, even_inner(net, Frames(corners, turned(own).axes), angles[: len(net.pins)])


@pytest.mark.parametrize(("braced", "loose"), [(False, 1), (True, 0)])
def test_a_frame_of_four_bars_is_a_mechanism_until_it_is_braced(braced, loose):
    net, state = frame(braced=braced)
    stiffness, motion = soft_modes(net, state, 8)
    assert np.count_nonzero(stiffness < 1e-6) == 6 + loose
    assert stiffness[6 + loose] > 1e-3
    assert (motion**2).sum(axis=(1, 2)) == pytest.approx(1.0, rel=1e-3)


def softest_under(load):
    """Return what resists the softest mode of a strip on edge, loaded at its tip."""
    net = fixing(chain(LENGTH, 12, pieces=4), 0)
    weight = net.weight.copy()
    weight[-1, 1] = -load
    net = replace(net, weight=weight)
    found = relax(net, screw_state(net, [LENGTH / 12, 0, 0, 0, 0, 0]))
    assert np.abs(found.state.bodies.origin[:, 2]).max() < 1e-9
    return soft_modes(net, found.state, 1)[0][0]


def test_a_strip_on_edge_turns_over_under_its_load_when_theory_says():
    """It buckles sideways at 4.0126 sqrt(E I G J) / L² (Timoshenko and Gere, section 6.3)."""
    twisting = YOUNG / (2 * (1 + POISSON)) * 10.0 * 0.4**3 / 3
    unit = np.sqrt(bending() * twisting) / LENGTH**2
    least, most = 3.6 * unit, 4.4 * unit
    assert softest_under(least) > 0 > softest_under(most)
    assert brentq(softest_under, least, most, rtol=1e-4) / unit == pytest.approx(4.0126, rel=0.01)


def random_net(seed, pieces=1):
    random = np.random.default_rng(seed)
    bodies, spans, angles = 5, 7, 3
    ends = random.integers(0, bodies, (spans, 2))
    ends[:, 1] = (ends[:, 0] + 1 + random.integers(0, bodies - 1, spans)) % bodies
    stiffness = 1.0 + random.random((spans, pieces, 6))
    at = exponential(0.2 * random.normal(size=(2 * spans, 6)))
    net = net_of(
        ends, np.zeros((spans, pieces, 6)), stiffness, bodies,
        turns=random.integers(-1, angles, (spans, 2)), pins=random.random(angles), at=at,
    )  # fmt: skip
    net = replace(
        net, weight=random.normal(size=(bodies, 3)), held=random.random((bodies, 3)),
        place=random.normal(size=(bodies, 3)),
    )  # fmt: skip
    frames = exponential(0.5 * random.normal(size=(bodies, 6)))
    state = even_inner(net, frames, 0.3 * random.normal(size=angles))
    return replace(
        net, rest=strains(net, state)[0] + 0.3 * random.normal(size=net.rest.shape)
    ), state


@pytest.mark.parametrize("seed", range(4))
def test_forces_are_the_slope_of_the_energy(seed):
    net, state = random_net(seed)
    solver = Solver(net)
    force, _, local = solver.system(state, 0.0)
    step = 1e-5
    for number, unit in enumerate(np.eye(net.n_freedoms)):
        ahead, behind = (
            energy(net, solver.moved(state, local, way * unit)) for way in (step, -step)
        )
        assert force[number] == pytest.approx((ahead - behind) / (2 * step), abs=1e-7)


def test_stiffness_is_the_slope_of_the_forces_where_pieces_turn_little():
    """With what stress adds; what is left out is of second order in how much a piece turns."""
    net = chain(60.0, 3)
    state = screw_state(net, [20.0, 0, 0, 0, 0, 0])
    stress = np.random.default_rng(0).normal(size=(3, 1, 6)) * ([0.01] * 5 + [0.001])
    random = np.random.default_rng(1)
    net = replace(
        net, rest=net.rest + stress, stiffness=np.full((3, 1, 6), 100.0),
        weight=random.normal(size=(4, 3)), held=random.random((4, 3)),
        place=state.bodies.origin + random.normal(size=(4, 3)),
    )  # fmt: skip
    solver = Solver(net)
    _, _, local = solver.system(state, 0.0)
    both = []
    for stressed in (False, True):
        matrix = solver.system(state, 0.0, stressed=stressed)[1]
        both.append(np.empty(matrix.shape))
        both[-1][np.ix_(solver.order, solver.order)] = matrix.toarray()
        assert np.abs(both[-1] - both[-1].T).max() < 1e-9
    step, wrong = 1e-3, []
    for one, unit in enumerate(np.eye(12)):
        for other, second in enumerate(np.eye(12)[: one + 1]):
            sums = [
                energy(
                    net, solver.moved(state, local, np.append(a * unit + b * second, [0.0] * 12))
                )
                for a, b in step * np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
            ]
            slope = (sums[0] - sums[1] - sums[2] + sums[3]) / (4 * step**2)
            wrong.append([abs(matrix[one, other] - slope) for matrix in both])
    without, with_stress = np.max(wrong, axis=0)
    assert with_stress < 0.02 * without


def test_a_rigid_motion_changes_nothing():
    net, state = random_net(2, pieces=2)
    net = replace(net, weight=0 * net.weight, held=0 * net.held)
    solver = Solver(net)
    away = exponential(np.array([[30.0, -8.0, 5.0, 0.7, -1.2, 0.4]]))
    count = net.n_bodies
    bodies = away[np.zeros(count, dtype=int)].then(state.bodies)
    inner = away[np.zeros(len(state.inner.origin), dtype=int)].then(state.inner)
    moved = replace(state, bodies=bodies, inner=inner)
    assert energy(net, moved) == pytest.approx(energy(net, state), rel=1e-12)
    force, other = (solver.system(one, 0.0)[0] for one in (state, moved))
    assert np.abs(force - other).max() < 1e-10
