"""What strips resist as they stand: energies and forces, by methods of the verifier's own.

A strip leads from crossing to crossing in a few pieces, as it is developed. Where these meet, as it
stands, only the two crossings decide. What a piece is strained by is read in the frame half way
between its two ends.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.geometry import lay_steps, panel_bounds, unfold
from fabweave.verify.read.glb import Strip

Complex: TypeAlias = npt.NDArray[np.complexfloating]

#: In so many pieces; where they meet, as shares of the way.
PIECES = 4
_SHARES = np.arange(1, PIECES) / PIECES
#: Steps of differences: millimetres, and radians.
_STEP_MM, _STEP = 1e-4, 1e-6
#: How often what lies between crossings goes where it wants to.
_ROUNDS = 4
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
    rest : (S, M, 6) float array
        How each piece leads from end to end as it was cut, in the plane.
    length : (S, M) float array
        Of each piece.
    width : (S, M) float array
        Of each piece.
    """

    thread: Ints
    crossing: Ints
    over: Flags
    offset: Floats
    rest: Floats
    length: Floats
    width: Floats


def crossing_axes(
    strips: dict[int, Strip], crossings: dict[int, Ints], over: dict[int, Flags], count: int
) -> tuple[Floats, Floats, dict[int, Floats]]:
    """Return how crossings are turned in the model, strands' angles there, and panels' middles.

    x is along the strand above, z outward, and the angle is that of the strand below.
    """
    axes, way_below = np.zeros((count, 3, 3)), np.zeros((count, 3))
    middles = {}
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
    seen = np.einsum("nji,nj->ni", axes, way_below)
    return axes, np.arctan2(seen[:, 1], seen[:, 0]), middles


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
        rest, length = _pieces(line, begin - begin[0], end - begin[0])
        share = (np.arange(PIECES) + 0.5) / PIECES
        width = wide[both] @ np.stack([1.0 - share, share])
        of = np.full(len(first), thread)
        found.append((of, own, over[thread][both], offset, rest, length, width))
    return Spans(*(np.concatenate(column) for column in zip(*found, strict=True)))


def _pieces(line: Complex, enter: Ints, leave: Ints) -> tuple[Floats, Floats]:
    """Return how lines lead from panel to panel in pieces, (N - 1, M, 6), and their lengths.

    ``line`` is the middle of a strip in the plane, and panels are between two of its points.
    """
    place = (line[enter] + line[leave]) / 2
    way = (line[leave] - line[enter]) / np.abs(line[leave] - line[enter])
    run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(line)))])
    middle = (run[enter] + run[leave]) / 2
    long = middle[1:] - middle[:-1]
    at, ways = [place[:-1]], [way[:-1]]
    for share in _SHARES.tolist():
        there = middle[:-1] + share * long
        step = np.clip(np.searchsorted(run, there, side="right") - 1, 0, len(line) - 2)
        along = line[step + 1] - line[step]
        part = (there - run[step]) / np.maximum(run[step + 1] - run[step], 1e-300)
        at.append(line[step] + part * along)
        ways.append(along / np.abs(along))
    at.append(place[1:])
    ways.append(way[1:])
    rest = [_plane_twist(at[k], ways[k], at[k + 1], ways[k + 1]) for k in range(PIECES)]
    return np.stack(rest, axis=1), np.repeat(long[:, None] / PIECES, PIECES, axis=1)


def _plane_twist(start: Complex, way: Complex, end: Complex, other: Complex) -> Floats:
    """Return the motion and turn along an arc from places and ways to others, (N, 6)."""
    turn = np.angle(other / way)
    # Seen half way, the chord of an arc is shorter than the arc.
    chord = (end - start) / (way * np.exp(0.5j * turn)) / np.sinc(turn / (2 * np.pi))
    rest = np.zeros((len(start), 6))
    rest[:, 0], rest[:, 1], rest[:, 5] = chord.real, chord.imag, turn
    return rest


@dataclass(frozen=True, eq=False)
class Stand:
    """How all stands.

    Parameters
    ----------
    bodies : Attitude
        Crossings.
    angles : (X,) float array
        From the strand above to the one below.
    inner : sequence of Attitude
        Where the pieces of spans meet, about.
    """

    bodies: Attitude
    angles: Floats
    inner: Sequence[Attitude]


def _ends(spans: Spans, stand: Stand, moved: Floats) -> list[Attitude]:
    """Return the frames at the start and at the end of all spans; ``moved``, (S, 14), shifts them.

    Six numbers each are of the crossing at the start and at the end, and one each of the angles.
    """
    ends = []
    for side in (0, 1):
        own, crossing = moved[:, 7 * side : 7 * side + 7], spans.crossing[:, side]
        turn = np.zeros((len(crossing), 3))
        turn[:, 2] = np.where(spans.over[:, side], 0.0, stand.angles[crossing] + own[:, 6])
        body = stand.bodies.at(crossing).then(own[:, :3], own[:, 3:6])
        ends.append(body.then(spans.offset[:, side], turn))
    return ends


def middles_of(spans: Spans, stand: Stand, stiffness: Floats) -> list[Attitude]:
    """Return where pieces want to meet."""
    middles = list(stand.inner)
    for _ in range(_ROUNDS):
        force, matrix = _wants(spans, stand, stiffness, middles, 14)[1:]
        step = -np.linalg.solve(matrix, force[:, :, None])[:, :, 0].astype(np.float64)
        own = np.split(step, PIECES - 1, axis=1)
        middles = [one.then(by[:, :3], by[:, 3:]) for one, by in zip(middles, own, strict=True)]
    return middles


def _wants(
    spans: Spans, stand: Stand, stiffness: Floats, middles: list[Attitude], first: int
) -> tuple[float, Floats, Floats]:
    """Return what is in store, and its changes by the numbers of spans from one on.

    Of a span, six numbers and one are of the crossing at its start and of the angle there, and so
    at its end; six are of each place where pieces meet.
    """
    whole = 14 + 6 * (PIECES - 1)
    rows = (len(spans.thread), 6 * PIECES)
    off = (twists(spans, stand, middles) - spans.rest).reshape(rows)
    change = np.zeros((*rows, whole - first))
    for number in range(first, whole):
        length = (number % 7 if number < 14 else (number - 14) % 6) < 3
        moved = np.zeros((len(off), whole))
        moved[:, number] = step = _STEP_MM if length else _STEP
        both = [twists(spans, stand, middles, sign * moved).reshape(rows) for sign in (1, -1)]
        change[:, :, number - first] = (both[0] - both[1]) / (2 * step)
    resists = stiffness.reshape(rows)
    force = np.einsum("sji,sj->si", change, resists * off)
    matrix = np.swapaxes(change, 1, 2) @ (resists[:, :, None] * change)
    return 0.5 * float((resists * off**2).sum()), force, matrix


def twists(
    spans: Spans, stand: Stand, middles: list[Attitude], moved: Floats | None = None
) -> Floats:
    """Return how each piece leads from end to end, (S, M, 6); ``moved`` shifts all numbers."""
    whole = 14 + 6 * (PIECES - 1)
    moved = np.zeros((len(spans.thread), whole)) if moved is None else moved
    start, end = _ends(spans, stand, moved[:, :14])
    own = np.split(moved[:, 14:], PIECES - 1, axis=1)
    between = (one.then(by[:, :3], by[:, 3:]) for one, by in zip(middles, own, strict=True))
    chain = [start, *between, end]
    return np.stack([_twist(*pair) for pair in pairwise(chain)], axis=1)


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
    """Return what resists each piece's six strains, (S, M, 6), given those of threads."""
    e, nu, t = (values[spans.thread][:, None] for values in (young, poisson, thickness))
    w, length = spans.width, spans.length
    g, area = e / (2 + 2 * nu), w * t
    whole = [e * area, _SHEAR * g * area, _SHEAR * g * area, g * w * t**3 / 3,
             e * w * t**3 / 12, e * t * w**3 / 12]  # fmt: skip
    return np.stack(whole, axis=2) / length[..., None]


def weights(spans: Spans, density: Floats, thickness: Floats, count: int) -> Floats:
    """Return the weight that each crossing bears, N: half of each span that leads to it."""
    area = (spans.width * spans.length).sum(axis=1)
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
    middles = middles_of(spans, stand, stiffness)
    energy, force, matrix = _wants(spans, stand, stiffness, middles, 0)
    # Middles follow.
    follow = np.linalg.solve(
        matrix[:, 14:, 14:], np.concatenate([matrix[:, 14:, :14], force[:, 14:, None]], axis=2)
    )
    ends = force[:, :14] - np.einsum("sij,sj->si", matrix[:, :14, 14:], follow[:, :, 14])
    matrix = matrix[:, :14, :14] - matrix[:, :14, 14:] @ follow[:, :, :14]
    total, stiff = np.zeros((count, 7)), np.zeros((count, 7, 7))
    for side, own in ((0, slice(0, 7)), (1, slice(7, 14))):
        np.add.at(total, spans.crossing[:, side], ends[:, own])
        np.add.at(stiff, spans.crossing[:, side], matrix[:, own, own])
    return Pull(energy, total, stiff)


def moves(force: Floats, stiff: Floats) -> Floats:
    """Return how far forces move each crossing by itself, (X,), millimetres."""
    ridge = 1e-12 * np.einsum("nii->n", stiff)[:, None, None] * np.eye(stiff.shape[1])
    step = np.linalg.solve(stiff + ridge, force[:, :, None])[:, :3, 0]
    return np.asarray(np.linalg.norm(step, axis=1))


def nearest(places: Floats, to: Floats) -> Floats:
    """Return places after the rigid motion that brings them nearest to others, (N, 3)."""
    turn, _ = Rotation.align_vectors(to - to.mean(axis=0), places - places.mean(axis=0))
    return np.asarray(turn.apply(places - places.mean(axis=0)) + to.mean(axis=0))
