"""What strips resist as they stand: energies and forces, by methods of the verifier's own.

A strip leads from crossing to crossing in two pieces. At rest these are two arcs that join as one
smooth curve (a biarc) in its development. As it stands, what a piece is strained by is read in the
frame half way between its two ends.
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.geometry import lay_steps, panel_bounds, unfold
from fabweave.verify.read.glb import Strip

Complex: TypeAlias = npt.NDArray[np.complexfloating]

#: Steps of differences: millimetres, and radians.
_STEP_MM, _STEP = 1e-4, 1e-6
#: What pulls at a kilogram, N; what shear takes of a rectangular section.
GRAVITY, _SHEAR = 9.81, 5 / 6


@dataclass(frozen=True, eq=False)
class Attitude:
    """Places and rotations in space, (N, 3) and (N, 3, 3): columns are the axes."""

    place: Floats
    axes: Floats

    def at(self, which: Ints) -> "Attitude":
        """Return some of them."""
        return Attitude(self.place[which], self.axes[which])

    def then(self, place: Floats, turn: Floats) -> "Attitude":
        """Return them moved by what is seen in them: places, and rotation vectors."""
        there = self.place + np.einsum("nij,nj->ni", self.axes, place)
        return Attitude(there, self.axes @ Rotation.from_rotvec(turn).as_matrix())


@dataclass(frozen=True, eq=False)
class Spans:
    """Strips from crossing to crossing, S of them, and how they were cut.

    Parameters
    ----------
    thread : (S,) int array
    crossing : (S, 2) int array
        Where each begins and ends.
    over : (S, 2) bool array
        Whether it lies above there.
    offset : (S, 2, 3) float array
        From the crossing to the middle of its panel, in the crossing's axes.
    rest : (S, 2, 6) float array
        Each piece as it was cut: its length along x, and its turn about z.
    width : (S, 2) float array
        Of each piece.
    """

    thread: Ints
    crossing: Ints
    over: Flags
    offset: Floats
    rest: Floats
    width: Floats


def crossing_axes(
    strips: dict[int, Strip], crossings: dict[int, Ints], over: dict[int, Flags], count: int
) -> tuple[Attitude, Floats, dict[int, Floats]]:
    """Return how crossings stand in the model, the angle between strands, and panels' middles.

    x is along the strand above, z outward, and the angle is that of the strand below.
    """
    axes, way_below = np.zeros((count, 3, 3)), np.zeros((count, 3))
    middles = {}
    place = np.zeros((count, 3))
    for thread, strip in strips.items():
        corner = strip.rungs[np.stack([strip.entry, strip.exit], axis=1)]
        middles[thread] = corner.mean(axis=(1, 2))
        way = corner[:, 1].mean(axis=1) - corner[:, 0].mean(axis=1)
        out = np.cross(corner[:, 1, 1] - corner[:, 0, 0], corner[:, 0, 1] - corner[:, 1, 0])
        own, above = crossings[thread], over[thread]
        z = out[above] / np.linalg.norm(out[above], axis=1)[:, None]
        x = way[above] - np.sum(way[above] * z, axis=1)[:, None] * z
        x /= np.linalg.norm(x, axis=1)[:, None]
        axes[own[above]] = np.stack([x, np.cross(z, x), z], axis=2)
        way_below[own[~above]] = way[~above]
        np.add.at(place, own, middles[thread] / 2)
    seen = np.einsum("nji,nj->ni", axes, way_below)
    return Attitude(place, axes), np.arctan2(seen[:, 1], seen[:, 0]), middles


def spans_of(
    strips: dict[int, Strip],
    crossings: dict[int, Ints],
    over: dict[int, Flags],
    where: Attitude,
    middles: dict[int, Floats],
) -> Spans:
    """Return the spans of all strips, thread after thread."""
    found: list[tuple[Any, ...]] = []
    for thread, strip in strips.items():
        size, closed = len(strip.entry), int(strip.closed)
        begin, end = panel_bounds(strip, 0, size + closed)
        flat = unfold(strip, lay_steps(strip), int(begin[0]), int(end[-1])).mean(axis=1)
        line: Complex = flat @ np.array([1.0, 1.0j])
        enter, leave = line[begin - begin[0]], line[end - begin[0]]
        way = (leave - enter) / np.abs(leave - enter)
        rungs = strip.rungs[np.stack([strip.entry, strip.exit], axis=1)]
        across = (rungs[:, :, 1] - rungs[:, :, 0]).mean(axis=1)
        along = rungs[:, 1].mean(axis=1) - rungs[:, 0].mean(axis=1)
        along /= np.linalg.norm(along, axis=1)[:, None]
        wide = np.linalg.norm(np.cross(along, across), axis=1)
        first = np.arange(size - 1 + closed)
        both = np.stack([first, (first + 1) % size], axis=1)
        own = crossings[thread][both]
        apart = middles[thread][both] - where.place[own]
        offset = np.einsum("sekj,sek->sej", where.axes[own], apart)
        rest = _biarcs((enter + leave) / 2, way)
        width = wide[both] @ np.array([[0.75, 0.25], [0.25, 0.75]])
        found.append((np.full(len(first), thread), own, over[thread][both], offset, rest, width))
    return Spans(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _biarcs(place: Complex, way: Complex) -> Floats:
    """Return the two arcs from each place to the next, (N - 1, 2, 6): lengths and turns."""
    p, q, t, u = place[:-1], place[1:], way[:-1], way[1:]
    chord, both = q - p, t + u
    dot = (chord * both.conj()).real
    bent = 2 * (1 - (t * u.conj()).real)
    root = np.sqrt(dot**2 + bent * np.abs(chord) ** 2)
    # The arm of both arcs' tangents; written so that it holds for straight ones, too.
    arm = np.abs(chord) ** 2 / (dot + root)
    middle, join = (p + q + arm * (t - u)) / 2, chord - arm * both
    rest = np.zeros((len(p), 2, 6))
    for side, (there, first, last) in enumerate(((middle - p, t, join), (q - middle, join, u))):
        turn = np.angle(last * first.conj())
        rest[:, side, 0] = np.abs(there) / np.sinc(turn / (2 * np.pi))
        rest[:, side, 5] = turn
    return rest


@dataclass(frozen=True, eq=False)
class Stand:
    """How all stands: crossings, the angle of the strand below, and the middles of spans."""

    bodies: Attitude
    angles: Floats
    middles: Attitude


def twists(spans: Spans, stand: Stand, moved: Floats | None = None) -> Floats:
    """Return how each piece leads from end to end, (S, 2, 6); ``moved``, (S, 20), shifts the ends.

    Six numbers each are of the crossing at the start, of that at the end, and of the middle, and
    one each of the angles.
    """
    moved = np.zeros((len(spans.thread), 20)) if moved is None else moved
    ends = []
    for side, own in ((0, slice(0, 6)), (1, slice(7, 13))):
        crossing = spans.crossing[:, side]
        body = stand.bodies.at(crossing).then(moved[:, own][:, :3], moved[:, own][:, 3:])
        turn = np.zeros((len(crossing), 3))
        angle = stand.angles[crossing] + moved[:, own.stop]
        turn[:, 2] = np.where(spans.over[:, side], 0.0, angle)
        ends.append(body.then(spans.offset[:, side], turn))
    middle = stand.middles.then(moved[:, 14:17], moved[:, 17:])
    return np.stack([_twist(ends[0], middle), _twist(middle, ends[1])], axis=1)


def _twist(one: Attitude, other: Attitude) -> Floats:
    """Return the displacement and the turn along a screw, seen in the frame half way, (N, 6)."""
    turn = Rotation.from_matrix(np.swapaxes(one.axes, 1, 2) @ other.axes).as_rotvec()
    half = one.axes @ Rotation.from_rotvec(turn / 2).as_matrix()
    chord = np.einsum("nji,nj->ni", half, other.place - one.place)
    angle = np.linalg.norm(turn, axis=1)[:, None]
    axis = turn / np.maximum(angle, 1e-300)
    along = np.sum(chord * axis, axis=1)[:, None] * axis
    return np.concatenate([along + (chord - along) / np.sinc(angle / (2 * np.pi)), turn], axis=1)


def resistance(spans: Spans, young: Floats, poisson: Floats, thickness: Floats) -> Floats:
    """Return what resists each piece's six strains, (S, 2, 6), given those of threads."""
    e, nu, t = (values[spans.thread][:, None] for values in (young, poisson, thickness))
    w, length = spans.width, spans.rest[..., 0]
    g, area = e / (2 + 2 * nu), w * t
    whole = [e * area, _SHEAR * g * area, _SHEAR * g * area, g * w * t**3 / 3,
             e * w * t**3 / 12, e * t * w**3 / 12]  # fmt: skip
    return np.stack(whole, axis=2) / length[..., None]


def weights(spans: Spans, density: Floats, thickness: Floats, count: int) -> Floats:
    """Return the weight that each crossing bears, N: half of each span that leads to it."""
    area = (spans.width * spans.rest[..., 0]).sum(axis=1)
    half = GRAVITY * 1e-9 * (density * thickness)[spans.thread] * area / 2
    both = np.bincount(spans.crossing.ravel(), np.repeat(half, 2), minlength=count)
    return both.astype(np.float64)


@dataclass(frozen=True, eq=False)
class Pull:
    """What strips want of crossings, their middles being where they want to be.

    Parameters
    ----------
    energy_nmm : float
        What strips have in store, N mm.
    force : (X, 7) float array
        Its gradient, by six numbers of each crossing and one of its angle.
    stiff : (X, 7, 7) float array
        How that changes while neighbours stay.
    """

    energy_nmm: float
    force: Floats
    stiff: Floats


def pull_of(spans: Spans, stand: Stand, stiffness: Floats, count: int) -> Pull:
    """Return what strips want of each crossing."""
    off = (twists(spans, stand) - spans.rest).reshape(-1, 12)
    change = np.zeros((len(off), 12, 20))
    lengths = [0, 1, 2, 7, 8, 9, 14, 15, 16]
    for number in range(20):
        step = _STEP_MM if number in lengths else _STEP
        moved = np.zeros((len(off), 20))
        moved[:, number] = step
        both = [twists(spans, stand, sign * moved).reshape(-1, 12) for sign in (1, -1)]
        change[:, :, number] = (both[0] - both[1]) / (2 * step)
    resists = stiffness.reshape(-1, 12)
    force = np.einsum("sji,sj->si", change, resists * off)
    matrix = np.einsum("ski,sk,skj->sij", change, resists, change, optimize=True)
    # Middles follow: what they gain is no longer in store.
    follow = np.linalg.solve(
        matrix[:, 14:, 14:], np.concatenate([matrix[:, 14:, :14], force[:, 14:, None]], axis=2)
    )
    energy = 0.5 * ((resists * off**2).sum() - (force[:, 14:] * follow[:, :, 14]).sum())
    ends = force[:, :14] - np.einsum("sij,sj->si", matrix[:, :14, 14:], follow[:, :, 14])
    matrix = matrix[:, :14, :14] - matrix[:, :14, 14:] @ follow[:, :, :14]
    total, stiff = np.zeros((count, 7)), np.zeros((count, 7, 7))
    for side, own in ((0, slice(0, 7)), (1, slice(7, 14))):
        np.add.at(total, spans.crossing[:, side], ends[:, own])
        np.add.at(stiff, spans.crossing[:, side], matrix[:, own, own])
    return Pull(float(energy), total, stiff)


def moves(force: Floats, stiff: Floats) -> Floats:
    """Return how far forces move each crossing by itself, (X,), millimetres."""
    ridge = 1e-12 * np.einsum("nii->n", stiff)[:, None, None] * np.eye(stiff.shape[1])
    step = np.linalg.solve(stiff + ridge, force[:, :, None])[:, :3, 0]
    return np.asarray(np.linalg.norm(step, axis=1))


def nearest(places: Floats, to: Floats) -> Floats:
    """Return places after the rigid motion that brings them nearest to others, (N, 3)."""
    turn, _ = Rotation.align_vectors(to - to.mean(axis=0), places - places.mean(axis=0))
    return np.asarray(turn.apply(places - places.mean(axis=0)) + to.mean(axis=0))
