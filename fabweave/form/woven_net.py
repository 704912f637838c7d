"""The elastic net of a woven object, as its strips are cut."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import ComplexArray, FloatArray, IntArray, frozen_value, unit
from fabweave.form.net import Net, NetState, cut_inner, section_stiffness, turned
from fabweave.form.screw import Frames, logarithm
from fabweave.piece.development import run_rungs, unfold
from fabweave.ribbon.measures import panel_widths
from fabweave.ribbon.project import Ribbons, following_rung, local_entry
from fabweave.weave.pattern import Weave, strand_passes

#: What pulls at a kilogram, N.
GRAVITY = 9.81


@frozen_value
class Elastic:
    """What a material resists with.

    Parameters
    ----------
    young_mpa : float
        Young's modulus, N/mm².
    poisson : float
    density_kg_m3 : float
    """

    young_mpa: float
    poisson: float
    density_kg_m3: float


def woven_net(
    ribbons: Ribbons,
    weave: Weave,
    thickness_mm: FloatArray,
    materials: Sequence[Elastic],
    pins: FloatArray,
    *,
    pieces: int = 4,
) -> tuple[Net, NetState]:
    """Return the net of ribbons, and the state in which it is the object that was wished for.

    Parameters
    ----------
    ribbons : Ribbons
    weave : Weave
    thickness_mm : (T,) float array
        Of each thread.
    materials : sequence of Elastic
        Of each thread.
    pins : (X,) float array
        How each crossing resists turning, N mm per radian; 0 for strips that turn freely.
    pieces : int
        In how many pieces of constant curvature a span from crossing to crossing is taken: a power
        of two.
    """
    threads = weave.threads
    thread = threads.thread_of_pass
    following = following_rung(threads.offsets, threads.closed)
    first = np.flatnonzero(following >= 0)
    second, of = following[first], thread[first]
    position = first - threads.offsets[of]

    # In the plane: where each span begins and ends, and how it gets there.
    start = local_entry(ribbons, of, position)
    last = local_entry(ribbons, of, position + 1) + 1
    offsets, rung = run_rungs(ribbons, of, start, last)
    flat = unfold(ribbons, offsets, rung)
    rest = _flat_twists((flat.right + flat.left) @ np.array([0.5, 0.5j]), offsets, pieces)

    width = panel_widths(ribbons).mean(axis=1)
    share = (np.arange(pieces) + 0.5) / pieces
    wide = width[first, None] * (1 - share) + width[second, None] * share
    each = np.linalg.norm(rest[..., :3], axis=2)
    young, poisson, density = (
        np.array([getattr(one, name) for one in materials])[of][:, None]
        for name in ("young_mpa", "poisson", "density_kg_m3")
    )
    thick = np.broadcast_to(thickness_mm[of][:, None], wide.shape)
    stiffness = section_stiffness(wide, thick, young, poisson) / each[..., None]

    # In space: the strand above has its own frame, the one below is turned from it.
    upper, lower = strand_passes(weave).T[::-1]
    panel = ribbons.entry[:, None] + [0, 1]
    across = (ribbons.right + ribbons.left)[panel] / 2
    along, centre = across[:, 1] - across[:, 0], across.mean(axis=1)
    x = unit(along[upper] - np.sum(along[upper] * ribbons.normal, axis=1)[:, None] * ribbons.normal)
    axes = np.stack([x, np.cross(ribbons.normal, x), ribbons.normal], axis=2)
    bodies = Frames(ribbons.centre, axes)
    below = np.einsum("nji,nj->ni", axes, along[lower])
    angles = np.arctan2(below[:, 1], below[:, 0])
    crossing, is_lower = threads.crossing, np.zeros(len(thread), dtype=np.bool_)
    is_lower[lower] = True
    offset = np.einsum("nji,nj->ni", axes[crossing], centre - ribbons.centre[crossing])
    passes = np.concatenate([first, second])
    at = Frames(offset[passes], np.broadcast_to(np.eye(3), (len(passes), 3, 3)))
    turns = np.where(is_lower, crossing, -1)

    mass = (density * 1e-9 * thick * wide * each).sum(axis=1) / 2
    weight = np.zeros((len(ribbons.centre), 3))
    for side in (first, second):
        weight[:, 2] -= GRAVITY * np.bincount(crossing[side], mass, minlength=len(weight))
    net = Net(
        ends=crossing[np.stack([first, second], axis=1)],
        at=at,
        turns=np.stack([turns[first], turns[second]], axis=1),
        rest=rest,
        stiffness=stiffness,
        pins=np.asarray(pins, dtype=np.float64),
        rest_angles=angles,
        weight=weight,
        held=np.zeros_like(weight),
        place=ribbons.centre,
        fixed=np.zeros(len(weight), dtype=np.bool_),
    )
    return net, cut_inner(net, bodies, angles)


def _flat_twists(line: ComplexArray, offsets: IntArray, pieces: int) -> FloatArray:
    """Return the twists along strips in the plane, (S, M, 6), as they were cut.

    Parameters
    ----------
    line : (N,) complex array
        The middles of rungs, a span's after another's: two of a panel, maybe some, two of a panel.
    offsets : (S + 1,) int array
    pieces : int
        Of equal length, from the middle of a panel to that of the next.
    """
    begin, end = offsets[:-1], offsets[1:] - 1
    steps = np.append(np.diff(line), 0.0)
    run = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
    first, last = (run[begin] + run[begin + 1]) / 2, (run[end - 1] + run[end]) / 2
    along = first + np.linspace(0.0, 1.0, pieces + 1)[:, None] * (last - first)
    rung = np.searchsorted(run, along, side="right") - 1
    rung[[0, -1]] = begin, end - 1
    at = line[rung] + steps[rung] * (along - run[rung]) / np.abs(steps[rung])
    axes = turned(np.angle(steps[rung]).ravel()).axes.reshape(pieces + 1, -1, 3, 3)
    origin = np.stack([at.real, at.imag, np.zeros_like(at.real)], axis=-1)
    from_, to = (
        Frames(origin[some].reshape(-1, 3), axes[some].reshape(-1, 3, 3))
        for some in (np.s_[:-1], np.s_[1:])
    )
    return np.moveaxis(logarithm(to.seen_from(from_)).reshape(pieces, -1, 6), 0, 1)
