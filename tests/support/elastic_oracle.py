"""The mechanics of a woven object anew: what its strips store, and how far from balance it is.

Nothing is solved: energies and forces are evaluated where a record says that crossings rest.
Strips are developed by the verifier's code. A strip leads from crossing to crossing in a few
pieces; what strains a piece is read in the frame half way between its two ends.
"""

from itertools import pairwise
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from fabweave.verify.measure.geometry import lay_steps, panel_bounds, unfold
from fabweave.verify.read.glb import Strip

PIECES = 4
#: What pulls at a kilogram, N; what shear takes of a rectangular section.
GRAVITY, SHEAR = 9.81, 5 / 6
#: Steps of differences: millimetres, and radians.
STEP_MM, STEP = 1e-4, 1e-6
#: Numbers of a span: six and an angle of each of its crossings, and six where its pieces meet.
ENDS, ALL = 14, 14 + 6 * (PIECES - 1)


class Pose(NamedTuple):
    """Places and axes in space, (N, 3) and (N, 3, 3): columns are the axes."""

    place: np.ndarray
    axes: np.ndarray

    @classmethod
    def of(cls, rows):
        """Return them from places and rotation vectors, six numbers each."""
        table = np.array(rows, dtype=float).reshape(-1, 6)
        return cls(table[:, :3], Rotation.from_rotvec(table[:, 3:]).as_matrix())

    def at(self, which):
        """Return some of them."""
        return Pose(self.place[which], self.axes[which])

    def then(self, place, turn):
        """Return them moved by what is seen in them: places, and rotation vectors."""
        there = self.place + np.einsum("nij,nj->ni", self.axes, place)
        return Pose(there, self.axes @ Rotation.from_rotvec(turn).as_matrix())


class Spans(NamedTuple):
    """Strips from crossing to crossing, S of them, and how each of M pieces was cut."""

    thread: np.ndarray  # (S,)
    crossing: np.ndarray  # (S, 2), where each begins and ends
    over: np.ndarray  # (S, 2), whether it lies above there
    offset: np.ndarray  # (S, 2, 3), from there to the middle of its panel, in the crossing's axes
    rest: np.ndarray  # (S, M, 6), how a piece leads from end to end in the plane
    length: np.ndarray  # (S, M)
    width: np.ndarray  # (S, M)


class Stand(NamedTuple):
    """Where crossings are, the angles of strands below, and where pieces of spans meet."""

    bodies: Pose
    angles: np.ndarray
    inner: list


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def spans_of(woven):
    """Return the spans of all strips as they are wished for, and the angles of strands below."""
    ribbons, threads, over = woven.ribbons, woven.weave.threads, woven.weave.over
    rungs, crossing = np.stack([ribbons.right, ribbons.left], axis=1), threads.crossing
    corner = rungs[ribbons.entry[:, None] + [0, 1]]
    way = corner[:, 1].mean(axis=1) - corner[:, 0].mean(axis=1)
    out = np.cross(corner[:, 1, 1] - corner[:, 0, 0], corner[:, 0, 1] - corner[:, 1, 0])
    axes, below = np.zeros((threads.n_crossings, 3, 3)), np.zeros((threads.n_crossings, 3))
    z = unit(out[over])
    x = unit(way[over] - np.sum(way[over] * z, axis=1)[:, None] * z)
    axes[crossing[over]] = np.stack([x, np.cross(z, x), z], axis=2)
    below[crossing[~over]] = way[~over]
    seen = np.einsum("nji,nj->ni", axes, below)
    apart = corner.mean(axis=(1, 2)) - ribbons.centre[crossing]
    offset = np.einsum("nji,nj->ni", axes[crossing], apart)
    across = (corner[:, :, 1] - corner[:, :, 0]).mean(axis=1)
    wide = np.linalg.norm(np.cross(unit(way), across), axis=1)
    found = []
    for thread in np.flatnonzero(np.diff(threads.offsets)).tolist():
        low, high = ribbons.offsets[thread : thread + 2]
        own, closed = np.arange(*threads.offsets[thread : thread + 2]), int(ribbons.closed[thread])
        entry = ribbons.entry[own] - low
        right = ribbons.from_right[low:high]
        strip = Strip("", bool(closed), entry, entry + 1, rungs[low:high], right, 0.0)
        begin, end = panel_bounds(strip, 0, len(own) + closed)
        flat = unfold(strip, lay_steps(strip), int(begin[0]), int(end[-1])).mean(axis=1)
        both = np.stack([own, np.roll(own, -1)], axis=1)[: len(own) - 1 + closed]
        rest, length = pieces_of(flat @ [1.0, 1.0j], begin - begin[0], end - begin[0])
        found.append((np.full(len(both), thread), both, rest, length))
    thread, both, rest, length = (np.concatenate(column) for column in zip(*found, strict=True))
    share = (np.arange(PIECES) + 0.5) / PIECES
    width = wide[both] @ np.stack([1.0 - share, share])
    spans = Spans(thread, crossing[both], over[both], offset[both], rest, length, width)
    return spans, np.arctan2(seen[:, 1], seen[:, 0])


def pieces_of(line, enter, leave):
    """Return how a line in the plane leads from panel to panel in pieces, and their lengths."""
    run = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(line)))])
    middle = (run[enter] + run[leave]) / 2
    long = np.diff(middle)
    at, ways = [], []
    for share in np.arange(1, PIECES) / PIECES:
        there = middle[:-1] + share * long
        step = np.clip(np.searchsorted(run, there, side="right") - 1, 0, len(line) - 2)
        along = line[step + 1] - line[step]
        at.append(line[step] + (there - run[step]) / np.diff(run)[step] * along)
        ways.append(along / np.abs(along))
    place, way = (line[enter] + line[leave]) / 2, line[leave] - line[enter]
    at, ways = [place[:-1], *at, place[1:]], [way[:-1], *ways, way[1:]]
    rest = np.zeros((len(long), PIECES, 6))
    for number, ((a, heading), (b, other)) in enumerate(pairwise(zip(at, ways, strict=True))):
        turn = np.angle(other / heading)
        # Seen half way, the chord of an arc is shorter than the arc.
        half = heading / np.abs(heading) * np.exp(0.5j * turn)
        chord = (b - a) / half / np.sinc(turn / (2 * np.pi))
        rest[:, number, [0, 1, 5]] = np.stack([chord.real, chord.imag, turn], axis=1)
    return rest, np.repeat(long[:, None] / PIECES, PIECES, axis=1)


def twists(spans, stand, moved=None):
    """Return how each piece leads from end to end, (S, M, 6); ``moved``, (S, ALL), shifts all."""
    moved = np.zeros((len(spans.thread), ALL)) if moved is None else moved
    chain = []
    for side in (0, 1):
        own, crossing = moved[:, 7 * side : 7 * side + 7], spans.crossing[:, side]
        turn = np.zeros((len(crossing), 3))
        turn[:, 2] = np.where(spans.over[:, side], 0.0, stand.angles[crossing] + own[:, 6])
        body = stand.bodies.at(crossing).then(own[:, :3], own[:, 3:6])
        chain.append(body.then(spans.offset[:, side], turn))
    inner = np.split(moved[:, ENDS:], PIECES - 1, axis=1)
    chain[1:1] = [p.then(by[:, :3], by[:, 3:]) for p, by in zip(stand.inner, inner, strict=True)]
    found = []
    for one, other in pairwise(chain):
        # Along a screw, seen in the frame half way.
        turn = Rotation.from_matrix(np.swapaxes(one.axes, 1, 2) @ other.axes).as_rotvec()
        half = one.axes @ Rotation.from_rotvec(turn / 2).as_matrix()
        chord = np.einsum("nji,nj->ni", half, other.place - one.place)
        angle = np.linalg.norm(turn, axis=1)[:, None]
        axis = turn / np.maximum(angle, 1e-300)
        along = np.sum(chord * axis, axis=1)[:, None] * axis
        way = along + (chord - along) / np.sinc(angle / (2 * np.pi))
        found.append(np.concatenate([way, turn], axis=1))
    return np.stack(found, axis=1)


def resistance(spans, young, poisson, thickness):
    """Return what resists each piece's six strains, (S, M, 6), given those of threads."""
    e, nu, t = (np.asarray(one)[spans.thread][:, None] for one in (young, poisson, thickness))
    w, g, area = spans.width, e / (2 + 2 * nu), spans.width * t
    whole = [e * area, SHEAR * g * area, SHEAR * g * area, g * w * t**3 / 3,
             e * w * t**3 / 12, e * t * w**3 / 12]  # fmt: skip
    return np.stack(whole, axis=2) / spans.length[..., None]


def weights(spans, density, thickness, count):
    """Return the weight that each crossing bears, N: half of each span that leads to it."""
    area = (spans.width * spans.length).sum(axis=1)
    half = GRAVITY * 1e-9 * (np.multiply(density, thickness))[spans.thread] * area / 2
    return np.bincount(spans.crossing.ravel(), np.repeat(half, 2), minlength=count)


def pull_of(spans, stand, stiffness, count):
    """Return what strips store, what they want of each crossing, (X, 7), and how that changes.

    Where pieces meet goes where it wants to.
    """
    rows = (len(spans.thread), 6 * PIECES)
    off = (twists(spans, stand) - spans.rest).reshape(rows)
    change = np.zeros((*rows, ALL))
    for number in range(ALL):
        place = (number % 7 if number < ENDS else (number - ENDS) % 6) < 3
        step = (STEP_MM if place else STEP) * np.eye(ALL)[number]
        both = [twists(spans, stand, np.tile(way * step, (rows[0], 1))) for way in (1, -1)]
        change[:, :, number] = (both[0] - both[1]).reshape(rows) / (2 * step[number])
    resists = stiffness.reshape(rows)
    force = np.einsum("sji,sj->si", change, resists * off)
    matrix = np.swapaxes(change, 1, 2) @ (resists[:, :, None] * change)
    known = np.concatenate([matrix[:, ENDS:, :ENDS], force[:, ENDS:, None]], axis=2)
    follow = np.linalg.solve(matrix[:, ENDS:, ENDS:], known)
    energy = 0.5 * (resists * off**2).sum() - 0.5 * (force[:, ENDS:] * follow[:, :, ENDS]).sum()
    ends = force[:, :ENDS] - np.einsum("sij,sj->si", matrix[:, :ENDS, ENDS:], follow[:, :, ENDS])
    matrix = matrix[:, :ENDS, :ENDS] - matrix[:, :ENDS, ENDS:] @ follow[:, :, :ENDS]
    total, stiff = np.zeros((count, 7)), np.zeros((count, 7, 7))
    for side, own in ((0, slice(0, 7)), (1, slice(7, 14))):
        np.add.at(total, spans.crossing[:, side], ends[:, own])
        np.add.at(stiff, spans.crossing[:, side], matrix[:, own, own])
    return energy, total, stiff


def moves(force, stiff):
    """Return how far forces move each crossing by itself, (X,), millimetres."""
    ridge = 1e-12 * np.einsum("nii->n", stiff)[:, None, None] * np.eye(7)
    return np.linalg.norm(np.linalg.solve(stiff + ridge, force[:, :, None])[:, :3, 0], axis=1)


def off_balance(woven, form):
    """Return of each state of a record how far it is from what physics says, by its name.

    ``energy`` is how far what is stated is off what is in store, as a share of that;
    ``balance_mm`` how far a crossing is from where forces balance; ``borne`` which share of all
    weight what holds it does not bear; ``turn_deg`` by how much strips turn in their plane.
    """
    spans, wished = spans_of(woven)
    young, poisson, density, thickness = (
        [thread[key] for thread in form["threads"]]
        for key in ("young_mpa", "poisson", "density_kg_m3", "thickness_mm")
    )
    count, stiffness = len(wished), resistance(spans, young, poisson, thickness)
    pins, load, held = np.array(form["pins_nmm"]), np.zeros(count), np.zeros(count)
    weight = weights(spans, density, thickness, count)
    for at, newtons in form["load_n"]:
        load[at] = newtons
    held[form["held"]] = form["held_n_mm"]
    found, still, first = {}, 0.0, None
    for state in form["states"]:
        inner = np.array(state["inner"]).reshape(len(spans.thread), PIECES - 1, 6)
        angles = np.array(state["angles"])
        stand = Stand(Pose.of(state["bodies"]), angles, list(map(Pose.of, inner.swapaxes(0, 1))))
        stored, force, stiff = pull_of(spans, stand, stiffness, count)
        stored += 0.5 * float(pins @ (angles - wished) ** 2)
        force[:, 6] += pins * (angles - wished)
        stiff[:, 6, 6] += pins
        place, outer, borne = stand.bodies.place, 0.0, 0.0
        if state["name"] == "let go":
            still, first = force, place
        else:
            bears = weight + load * (state["name"] == "loaded")
            push = held[:, None] * (place - first)
            outer = bears @ place[:, 2] + 0.5 * (push * (place - first)).sum()
            borne = abs(push[:, 2].sum() + bears.sum()) / bears.sum()
            push[:, 2] += bears
            # Of what strips want, only what changed counts, and rounding goes.
            force = force - still
            force[:, :3] += np.einsum("nji,nj->ni", stand.bodies.axes, push)
            stiff[:, :3, :3] += held[:, None, None] * np.eye(3)
        found[state["name"]] = SimpleNamespace(
            energy=abs(stored + outer - state["energy_nmm"]) / max(stored, 1e-9),
            balance_mm=moves(force, stiff).max(),
            borne=borne,
            turn_deg=np.degrees(np.abs((twists(spans, stand) - spans.rest)[..., 5].sum(axis=1))),
        )
    return found
