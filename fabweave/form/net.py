"""The elastic net: strips that are as they were cut, pinned to one another where they cross."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.form.screw import Frames, adjoint, back_from, brackets, exponential, logarithm, skew

#: Of shear, what a rectangular cross-section takes.
_SHEAR = 5 / 6


@frozen_value
class Net:
    """Spans of strips between bodies; a body is a crossing, or the free end of a strip.

    A span leads from one body to another, in 2^k pieces of constant curvature and torsion. Either
    end is a frame on its body, x along the strip and z along its normal, that may be turned about
    z by an angle of its own: so strands turn on one another at a pin.

    Parameters
    ----------
    ends : (S, 2) int array
        The bodies at the start and at the end of each span.
    at : Frames
        The frame of each end on its body, (2 S): all starts, then all ends.
    turns : (S, 2) int array
        The angle by which each end is turned; -1 for none.
    rest : (S, M, 6) float array
        The twist of each piece of a span as it was cut: flat.
    stiffness : (S, M, 6) float array
        What resists its stretch, two shears, twist, bending, and bending in its plane: of forces
        N/mm, of moments N mm.
    pins : (A,) float array
        How each angle resists turning, N mm per radian.
    rest_angles : (A,) float array
        Where it does not.
    weight : (B, 3) float array
        The force on each body, N.
    held : (B, 3) float array
        How stiffly its place is held, N/mm.
    place : (B, 3) float array
        The place at which it is held.
    fixed : (B,) bool array
        Which bodies neither move nor turn.
    """

    ends: IntArray
    at: Frames
    turns: IntArray
    rest: FloatArray
    stiffness: FloatArray
    pins: FloatArray
    rest_angles: FloatArray
    weight: FloatArray
    held: FloatArray
    place: FloatArray
    fixed: BoolArray

    @property
    def n_bodies(self) -> int:
        """Number of bodies."""
        return len(self.weight)

    @property
    def n_freedoms(self) -> int:
        """Six numbers for each body, and one for each angle."""
        return 6 * self.n_bodies + len(self.pins)


@frozen_value
class NetState:
    """Where a net is.

    Parameters
    ----------
    bodies : Frames
        (B)
    angles : (A,) float array
        Radians.
    inner : Frames
        The frames between the pieces of each span, S x (M - 1) of them, span after span.
    """

    bodies: Frames
    angles: FloatArray
    inner: Frames


def section_stiffness(
    width_mm: FloatArray,
    thickness_mm: FloatArray,
    young_mpa: FloatArray,
    poisson: float | FloatArray,
) -> FloatArray:
    """Return what resists the strains of strips, (..., 6): E A, shear twice, G J, and E I twice.

    Examples
    --------
    >>> card = section_stiffness(np.array(10.0), np.array(0.4), np.array(3000.0), 0.3)
    >>> card.round(1).tolist()
    [12000.0, 3846.2, 3846.2, 246.2, 160.0, 100000.0]
    """
    area = width_mm * thickness_mm
    shear = young_mpa / (2 * (1 + poisson))
    slide = _SHEAR * shear * area
    bend = young_mpa * area / 12
    stiffness = (
        young_mpa * area, slide, slide,
        shear * area * thickness_mm**2 / 3, bend * thickness_mm**2, bend * width_mm**2,
    )  # fmt: skip
    return np.stack(stiffness, axis=-1)


def turned(angles: FloatArray) -> Frames:
    """Return frames turned about z by angles, (N)."""
    twist = np.zeros((len(angles), 6))
    twist[:, 5] = angles
    return exponential(twist)


def end_frames(net: Net, bodies: Frames, angles: FloatArray) -> tuple[Frames, Frames]:
    """Return the frames at the ends of all spans, on their bodies and in space, (2 S) each."""
    which = net.turns.T.ravel()
    padded = np.append(angles, 0.0)  # -1 is the last one
    own = net.at.then(turned(padded[which]))
    return own, bodies[net.ends.T.ravel()].then(own)


def cut_inner(net: Net, bodies: Frames, angles: FloatArray) -> NetState:
    """Return a state whose spans run as they were cut, and make up evenly for what is missing."""
    _, frames = end_frames(net, bodies, angles)
    spans, pieces = net.rest.shape[:2]
    ahead, back = [frames[:spans]], [frames[spans:]]
    for piece in range(pieces - 1):
        ahead.append(ahead[-1].moved(net.rest[:, piece]))
        back.append(back[-1].moved(-net.rest[:, pieces - 1 - piece]))
    inner = [
        one.moved(number / pieces * logarithm(other.seen_from(one)))
        for number, (one, other) in enumerate(zip(ahead[1:], back[:0:-1], strict=True), start=1)
    ]
    origin, axes = (
        np.stack([getattr(one, name) for one in inner], axis=1) if inner else empty
        for name, empty in (("origin", np.zeros((0, 3))), ("axes", np.zeros((0, 3, 3))))
    )
    return NetState(bodies, angles, Frames(origin.reshape(-1, 3), axes.reshape(-1, 3, 3)))


def strains(net: Net, state: NetState) -> tuple[FloatArray, Frames]:
    """Return the twist of each piece, (S, M, 6), and where each span's ends lie on their bodies."""
    own, frames = end_frames(net, state.bodies, state.angles)
    spans, pieces = net.rest.shape[:2]

    def chain(inner: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
        shape = inner.shape[1:]
        inner = inner.reshape(spans, pieces - 1, *shape)
        return np.concatenate([first[:, None], inner, last[:, None]], axis=1)

    origin = chain(state.inner.origin, frames.origin[:spans], frames.origin[spans:])
    axes = chain(state.inner.axes, frames.axes[:spans], frames.axes[spans:])
    start = Frames(origin[:, :-1].reshape(-1, 3), axes[:, :-1].reshape(-1, 3, 3))
    end = Frames(origin[:, 1:].reshape(-1, 3), axes[:, 1:].reshape(-1, 3, 3))
    return logarithm(end.seen_from(start)).reshape(spans, pieces, 6), own


def energy(net: Net, state: NetState) -> float:
    """Return what strains, pins, weight and supports have in store, N mm."""
    twist, _ = strains(net, state)
    origin = state.bodies.origin
    return float(
        0.5 * (net.stiffness * (twist - net.rest) ** 2).sum()
        + 0.5 * (net.pins * (state.angles - net.rest_angles) ** 2).sum()
        - (net.weight * origin).sum()
        + 0.5 * (net.held * (origin - net.place) ** 2).sum()
    )


@frozen_value
class Local:
    """What each span wants of its two ends, its inner frames at rest between them.

    Parameters
    ----------
    force : (S, 14) float array
        The gradient by six numbers of the body at its start and one of the angle there; so at
        its end.
    matrix : (S, 14, 14) float array
        And how that changes.
    levels : list of tuple of float arrays
        How inner frames follow the frames beside them: of each pair of pieces that were joined,
        the inverse, the coupling to the frame before and to the one after, and the force of the
        frame between them.
    ends : (2, S, 6, 7) float array
        How an end moves with its body and its angle.
    """

    force: FloatArray
    matrix: FloatArray
    levels: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]]
    ends: FloatArray


def _bracket(force: FloatArray) -> FloatArray:
    """Return the matrices N with a N b = force . [a, b] for twists a and b, (..., 6, 6)."""
    flat = force.reshape(-1, 6)
    result = np.zeros((len(flat), 6, 6))
    push = skew(flat[:, :3])
    result[:, :3, 3:] = result[:, 3:, :3] = -push
    result[:, 3:, 3:] = -skew(flat[:, 3:])
    return result.reshape(*force.shape, 6)


def local_system(
    net: Net, state: NetState, damping: FloatArray, *, stressed: bool = False
) -> Local:
    """Return what spans want of their ends; inner frames are damped so much, (6,).

    ``stressed`` adds what stress adds to stiffness, but for what is of second order in how much a
    piece turns.
    """
    spans, pieces = net.rest.shape[:2]
    twist, at = strains(net, state)
    stress = net.stiffness * (twist - net.rest)
    begin, end = (one.reshape(spans, pieces, 6, 6) for one in back_from(twist.reshape(-1, 6)))
    pull, push = _pulled(begin, stress), _pulled(end, stress)
    # How a piece resists its start, its end, and each by the other.
    firm = net.stiffness[..., None] * end
    own, other = _turned_back(begin) @ (net.stiffness[..., None] * begin), _turned_back(end) @ firm
    cross = _turned_back(begin) @ firm
    if stressed:
        # The second order of log(exp(-a) exp(twist) exp(b)), by Baker, Campbell and Hausdorff.
        bracket = _bracket(stress)
        more = bracket @ brackets(twist.reshape(-1, 6)).reshape(*twist.shape, 6)
        more = (more + _turned_back(more)) / 12
        cross -= bracket / 2 + 2 * more
        own -= more
        other -= more

    levels: list[tuple[FloatArray, FloatArray, FloatArray, FloatArray]] = []
    diagonal = np.diag(damping)
    while own.shape[1] > 1:
        middle = _inverse(other[:, ::2] + own[:, 1::2] + diagonal)
        before, after = _turned_back(cross[:, ::2]), cross[:, 1::2]
        between = push[:, ::2] + pull[:, 1::2]
        levels.append((middle, before, after, between))
        follow, lead = middle @ before, middle @ after
        own = own[:, ::2] - cross[:, ::2] @ follow
        other = other[:, 1::2] - _turned_back(after) @ lead
        cross = -(cross[:, ::2] @ lead)
        pull, push = pull[:, ::2] - _pulled(follow, between), push[:, 1::2] - _pulled(lead, between)

    ends = np.zeros((2, spans, 6, 7))
    unit = Frames(np.zeros((2 * spans, 3)), np.broadcast_to(np.eye(3), (2 * spans, 3, 3)))
    ends[..., :6] = adjoint(unit.seen_from(at)).reshape(2, spans, 6, 6)
    ends[..., 5, 6] = (net.turns >= 0).T
    start, last = ends
    result = np.empty((spans, 14, 14))
    result[:, :7, :7] = _turned_back(start) @ own[:, 0] @ start
    result[:, 7:, 7:] = _turned_back(last) @ other[:, 0] @ last
    result[:, :7, 7:] = _turned_back(start) @ cross[:, 0] @ last
    result[:, 7:, :7] = _turned_back(result[:, :7, 7:])
    force = np.concatenate([pull[:, 0], push[:, 0]], axis=1)
    # A turn after a motion is not the motion after the turn.
    for side in (0, 1) if stressed else ():
        swing = 0.5 * _bracket(force[:, 6 * side : 6 * side + 6])[..., 5]
        cross = np.einsum("ski,sk->si", ends[side][..., :6], swing) * ends[side][:, 5, 6:]
        own_rows, turn = slice(7 * side, 7 * side + 6), 7 * side + 6
        result[:, own_rows, turn] += cross
        result[:, turn, own_rows] += cross
    felt = [_pulled(ends[side], force[:, 6 * side : 6 * side + 6]) for side in (0, 1)]
    return Local(np.concatenate(felt, axis=1), result, levels, ends)


def _inverse(matrices: FloatArray) -> FloatArray:
    """Return the inverses of small matrices, (..., N, N), whose pivots are on their diagonals.

    By sweeps over all of them at once: LAPACK is called for each by itself.
    """
    size = matrices.shape[-1]
    swept = np.ascontiguousarray(np.moveaxis(matrices.reshape(-1, size, size), 0, 2))
    for at in range(size):
        pivot = 1.0 / swept[at, at]
        row, column = swept[at] * pivot, swept[:, at].copy()
        row[at], column[at], swept[:, at], swept[at] = pivot, 0.0, 0.0, 0.0
        swept -= column[:, None] * row
        swept[at] = row
    return np.ascontiguousarray(np.moveaxis(swept, 2, 0)).reshape(matrices.shape)


def _turned_back(matrices: FloatArray) -> FloatArray:
    """Return transposed matrices, (..., N, M)."""
    return np.swapaxes(matrices, -1, -2)


def _pulled(change: FloatArray, force: FloatArray) -> FloatArray:
    """Return forces, (..., M), as what changes them feels them."""
    return np.asarray(np.einsum("...i,...ij->...j", force, change))


def _moved(change: FloatArray, step: FloatArray) -> FloatArray:
    """Return how steps, (..., N), move what goes with them."""
    return np.asarray(np.einsum("...ij,...j->...i", change, step))


def inner_steps(local: Local, step: FloatArray) -> FloatArray:
    """Return the twists of inner frames that follow those of bodies and angles, (S x (M - 1), 6).

    ``step`` is (S, 14), as forces are.
    """
    nodes = np.stack(
        [_moved(local.ends[0], step[:, :7]), _moved(local.ends[1], step[:, 7:])], axis=1
    )
    for middle, before, after, between in reversed(local.levels):
        wanted = between + _moved(before, nodes[:, :-1]) + _moved(after, nodes[:, 1:])
        grown = np.empty((len(nodes), 2 * nodes.shape[1] - 1, 6))
        grown[:, ::2], grown[:, 1::2] = nodes, -_moved(middle, wanted)
        nodes = grown
    return nodes[:, 1:-1].reshape(-1, 6)
