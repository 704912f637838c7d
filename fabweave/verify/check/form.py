"""Check that what is said of an object's form is so: it stands where forces are in balance.

Nothing is solved again: where crossings stand is read, and energies, forces and distances are
evaluated there, from strips that are developed anew and by code and formulae of the verifier's own.

A strip leads from crossing to crossing in a few pieces, as it is developed. Where these meet, as it
stands, only the two crossings decide. What a piece is strained by is read in the frame half way
between its two ends.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from fabweave.verify.check.fastening import hanging
from fabweave.verify.crossing_map import CrossingMap, FormRecord, StateRecord
from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.geometry import lay_steps, panel_bounds, unfold
from fabweave.verify.measure.nearness import distances_to
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Place, Tally, stated_number

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


#: How bare crossings, those of one fastener and those of more resist turning, N mm per radian.
BARE, ONE, MORE = 1.0, 25.0, 10_000.0
#: Energies agree to this share; and no crossing wants to move farther by itself than this share of
#: the size, or by this.
ENERGY, MOVE, MOVE_MM = 0.05, 2e-3, 0.2
#: Or than this share of how far it went in all; the farther that is, the more ways a strip may rest
#: in between two crossings: energies may differ by so many times the share of the size.
FAR, SLACK = 0.1, 2.0
#: What stands bears all weights, to this share; but weights whose work on what holds them is a
#: smaller share of the energy in strips than that are lost in rounding.
BORNE, LIGHT = 0.05, 5e-8
#: Distances are told to hundredths of a millimetre.
TOLD_MM = 0.011
#: And turns to a few hundredths of a degree: strips rest in between as they are found to.
TOLD_DEG = 0.05
#: Strips of the relaxed model unfold to those that are cut, from panel to panel, to this.
CUT_MM = 0.05
#: What goes farther than this share of a body's size collapses, and is told without a number; and
#: a body whose lowest place is higher than that share above all stands on nothing.
FALLS, FOOT = 0.1, 0.02
_LOAD = re.compile(r"([\d.]+)(kg|g|oz|lb)(?:@(.+))?")
_MASSES = {"g": 1e-3, "kg": 1.0, "oz": 0.028349523125, "lb": 0.45359237}
_NAMES = ("let go", "standing", "loaded")


def check_form(job: Job, tally: Tally) -> None:
    """Check the states in which an object was found against its strips, and what is said of it."""
    plan = required(job.map)
    told, place = (job.verdict or {}).get("form"), tally.at("form.json")
    place.equal("whether it was let go", job.form is not None, told is not None)
    if job.form is None or told is None:
        return
    weave = _Weave.of(plan, required(job.model))
    if _check_given(job, job.form, weave, place):
        proof = _Proof(job, job.form, weave)
        for state in job.form["states"]:
            proof.check(state, dict(told), tally.at("form.json", state["name"]))
        proof.check_verdict(job.verdict or {}, tally.at("verdict.json"))
    _check_relaxed(job, job.form, tally)


@dataclass(frozen=True, eq=False)
class _Weave:
    """The strips of the model, as they are wished for.

    Parameters
    ----------
    spans : Spans
    wished : (X, 3) float array
        Where crossings are.
    angles : (X,) float array
        From the strand above to the one below.
    """

    spans: Spans
    wished: Floats
    angles: Floats

    @property
    def owns(self) -> list[Ints]:
        """The crossings of each body that strips join; all where that is one."""
        count = len(self.wished)
        label = _joined(self.spans.crossing, count)
        numbers = np.unique(label[self.spans.crossing[:, 0]])
        if len(numbers) < 2:
            return [np.arange(count)]
        return [np.flatnonzero(label == number) for number in numbers]

    @classmethod
    def of(cls, plan: CrossingMap, model: dict[str, Strip]) -> "_Weave":
        """Read it from map and model."""
        threads = [one for one in plan.threads if one.label in model]
        strips = {one.id: model[one.label] for one in threads}
        crossings = {one.id: np.array(one.crossings, dtype=np.int64) for one in threads}
        over = {one.id: np.array(one.over, dtype=np.bool_) for one in threads}
        wished = np.array([one.position for one in plan.crossings])
        axes, angles, middles = crossing_axes(strips, crossings, over, len(wished))
        spans = spans_of(strips, crossings, over, Attitude(wished, axes), middles)
        return cls(spans, wished, angles)


def _check_given(job: Job, form: FormRecord, weave: _Weave, place: Place) -> bool:
    """Check what states were found with; say whether they can be read."""
    plan = required(job.map)
    names = [*_NAMES[:2], *(_NAMES[2:] if "load" in job.options else [])]
    if not (
        place.equal("how many threads there are", len(form["threads"]), len(plan.threads))
        and place.equal("the states", [one["name"] for one in form["states"]], names)
        and place.equal("how crossings resist turning", form["pins_nmm"], _pins(job, plan))
    ):
        return False
    for one, strip in zip(plan.threads, form["threads"], strict=True):
        wanted = job.supplies[one.id].thickness_mm
        place.at(f"thread {one.label}").number("its thickness", strip["thickness_mm"], wanted)
    bears, due = np.array(form["load_n"]).reshape(-1, 2), _load(job, plan)
    loads = np.zeros(len(plan.crossings))
    loads[bears[:, 0].astype(np.int64)] = bears[:, 1]
    place.expect(np.allclose(loads, due, rtol=1e-6), "the load is not what was asked for")
    held, hung = set(form["held"]), hanging(str(job.options.get("hang", "")), plan)
    for own in (set(own.tolist()) for own in weave.owns):
        if hung & own:
            place.same("what it hangs from", held & own, hung & own)
        place.expect(bool(held & own), f"nothing holds the body of crossing {min(own)}")
    return place.expect(
        all(
            len(one["bodies"]) == len(one["angles"]) == len(plan.crossings)
            for one in form["states"]
        ),
        "a state has not one row for each crossing",
    )


class _Proof:
    """What states are held to: strips as they were cut, pins, weights and supports."""

    def __init__(self, job: Job, form: FormRecord, weave: _Weave) -> None:
        """Find what resists, and what weighs."""
        young, poisson, density, thickness = (
            np.array([stated_number(one, key) for one in form["threads"]])
            for key in ("young_mpa", "poisson", "density_kg_m3", "thickness_mm")
        )
        self.weave, self.count = weave, len(weave.wished)
        self.stiffness = resistance(weave.spans, young, poisson, thickness)
        self.pins = np.array(form["pins_nmm"])
        self.weight = weights(weave.spans, density, thickness, self.count)
        self.load = _load(job, required(job.map))
        self.held = np.isin(np.arange(self.count), form["held"]) * float(form["held_n_mm"])
        plan = required(job.map)
        self.bodies = _bodies_of(required(job.mesh), plan, weave.owns)
        self.hung = hanging(str(job.options.get("hang", "")), plan)
        self.falls, self.former = False, "former" in job.options
        self.straight, self.mesh = job.options.get("strips") == "straight", required(job.mesh)
        self.size = float(np.ptp(required(job.mesh).vertices, axis=0).max())
        #: What strips want of crossings where they were let go, and where these are then.
        self.still, self.first = np.zeros((self.count, 7)), weave.wished

    def check(self, state: StateRecord, told: dict[str, Any], place: Place) -> None:
        """Check one state: its energy, whether forces are in balance, and how far crossings are."""
        inner = np.array(state["inner"]).reshape(len(self.weave.spans.thread), PIECES - 1, 6)
        stand = Stand(
            _attitude(state["bodies"]),
            np.array(state["angles"]),
            [_attitude(rows) for rows in np.swapaxes(inner, 0, 1)],
        )
        free, places = state["name"] == "let go", stand.bodies.place
        went = float(np.linalg.norm(places - self.first, axis=1).max())
        found = pull_of(self.weave.spans, stand, self.stiffness, self.count)
        turned = stand.angles - self.weave.angles
        stored = found.energy_nmm + 0.5 * float(self.pins @ turned**2)
        force, stiff = found.force, found.stiff
        force[:, 6] += self.pins * turned
        stiff[:, 6, 6] += self.pins
        outer = missing = 0.0
        if free:
            self.still, self.first = force, places
        else:
            bears = self.weight + (self.load if state["name"] == "loaded" else 0.0)
            sunk = places - self.first
            outer = float(bears @ places[:, 2] + 0.5 * (self.held[:, None] * sunk**2).sum())
            push = self.held[:, None] * sunk
            if bears.sum() ** 2 > LIGHT * stored * self.held.sum():
                missing = abs(push[:, 2].sum() + bears.sum()) / bears.sum()
            push[:, 2] += bears
            # Of what strips want, only what changed counts, and rounding goes.
            force = force - self.still
            force[:, :3] += np.einsum("nji,nj->ni", stand.bodies.axes, push)
            stiff[:, :3, :3] += self.held[:, None, None] * np.eye(3)
        self._check_distances(state["name"], places, told, place)
        if free and self.straight:
            self._check_straight(stand, told, place)
        if not state["settled"]:
            place.equal("whether it came to rest", told.get("settled"), False)
            return
        if not free:
            place.at_most("borne", missing, BORNE, "what holds it bears {} of its weight otherwise")
        off = abs(stored + outer - state["energy_nmm"]) / max(stored, 1e-9)
        most = ENERGY + SLACK * went / self.size
        place.at_most("energy", off, most, "its energy is {} of itself off what is said")
        wants = float(moves(force, stiff).max())
        limit = max(MOVE * self.size, MOVE_MM, FAR * went)
        place.at_most("balance_mm", wants, limit, "a crossing is {} from where forces balance")

    def _check_straight(self, stand: Stand, told: dict[str, Any], place: Place) -> None:
        """Check how far straight strips are said to rest from the mesh, and how much they turn."""
        mesh = self.mesh
        corner, following = mesh.vertices[mesh.corner], mesh.vertices[mesh.corner[mesh.next]]
        faces = np.stack([corner, following, mesh.centres[mesh.face]], axis=1)
        away = distances_to(stand.bodies.place, faces)
        middles = middles_of(self.weave.spans, stand, self.stiffness)
        twist = twists(self.weave.spans, stand, middles) - self.weave.spans.rest
        turn = np.degrees(np.abs(twist[..., 5].sum(axis=1)))
        for key, each, within in (("model", away, TOLD_MM), ("turn", turn, TOLD_DEG)):
            unit = "mm" if key == "model" else "deg"
            root = float(np.sqrt((each**2).mean()))
            for name, value in ((f"{key}_{unit}", each.max()), (f"{key}_mean_{unit}", root)):
                place.number(name, told.get(name), float(value), within=within)

    def _check_distances(
        self, name: str, places: Floats, told: dict[str, Any], place: Place
    ) -> None:
        """Check how far crossings are said to go."""
        far, goes = np.zeros(len(places)), name == "let go"
        key = "settles_mm" if goes else "sags_mm" if name == "standing" else "loaded_mm"
        each = told.get("bodies") or [told]
        if not place.equal("how many bodies it is told of", len(each), len(self.bodies)):
            return
        before = self.weave.wished if goes else self.first
        for number, (body, said) in enumerate(zip(self.bodies, each, strict=True), start=1):
            own, there = body.own, places[body.own]
            if goes or self.hung & set(own.tolist()):
                there = nearest(there, before[own])
            far[own] = np.linalg.norm(there - before[own], axis=1)
            here = place.at(f"body {number}") if len(each) > 1 else place
            self.falls |= _check_far(here, key, said, float(far[own].max()), body.size_mm)
            if goes and len(each) > 1:
                here.number("air_mm", said.get("air_mm") or 0.0, self._air(body), within=TOLD_MM)
        # What no strip joins goes nowhere.
        own = np.concatenate([body.own for body in self.bodies])
        _check_far(place, key, told, float(far[own].max()), self.size)
        if goes:
            _check_far(place, "mean_mm", told, float(np.sqrt((far[own] ** 2).mean())), self.size)

    def _air(self, body: "_Body") -> float:
        """Return how high a body is that neither stands nor hangs."""
        stands = body.high_mm <= FOOT * self.size or self.hung & set(body.own.tolist())
        return 0.0 if stands else body.high_mm

    def check_verdict(self, verdict: dict[str, Any], place: Place) -> None:
        """Check that what collapses is said first, and that it cannot be built."""
        reasons, told = verdict.get("reasons") or [{}], dict(verdict.get("form") or {})
        if self.falls:
            place.equal("whether it collapses", told.get("collapses"), True)
        if told.get("collapses") and not self.former:
            place.equal("the first reason", dict(reasons[0]).get("rule"), "collapse")
            place.equal("the verdict", verdict.get("level"), "not makeable")


@dataclass(frozen=True, eq=False)
class _Body:
    """The crossings of a body, its largest extent, and how high above all its lowest place is."""

    own: Ints
    size_mm: float
    high_mm: float


def _bodies_of(mesh: LoadedMesh, plan: CrossingMap, owns: list[Ints]) -> list[_Body]:
    """Return the bodies that strips join, each as large as its part of the mesh."""
    edges = np.stack([mesh.corner, mesh.corner[mesh.next]], axis=1)
    label = _joined(edges, len(mesh.vertices))
    ground = mesh.vertices[mesh.corner, 2].min()
    found = []
    for own in owns:
        parts = {int(label[plan.crossings[at].edge[0]]) for at in own.tolist()}
        vertices = mesh.vertices[np.isin(label, sorted(parts))]
        size = float(np.ptp(vertices, axis=0).max())
        found.append(_Body(own, size, float(vertices[:, 2].min() - ground)))
    return found


def _joined(links: Ints, count: int) -> Ints:
    """Return numbers that those of so many have alike which links, (N, 2), join."""
    ones = np.ones(len(links), dtype=np.float64)
    graph = coo_array((ones, (links[:, 0], links[:, 1])), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def _check_far(place: Place, key: str, told: dict[str, Any], far_mm: float, size_mm: float) -> bool:
    """Check how far something is said to go, or that no number is said; say whether it falls."""
    value, limit = told.get(key), FALLS * size_mm
    if value is None:
        place.expect(far_mm > limit - TOLD_MM, f"{key} is not told, although it does not collapse")
    elif place.expect(far_mm <= limit + TOLD_MM, f"{key} is told, although it collapses"):
        place.number(key, value, far_mm, within=TOLD_MM)
    return far_mm > limit + TOLD_MM


def _attitude(rows: list[list[float]] | Floats) -> Attitude:
    table = np.array(rows, dtype=np.float64).reshape(-1, 6)
    return Attitude(table[:, :3], Rotation.from_rotvec(table[:, 3:]).as_matrix())


def _pins(job: Job, plan: CrossingMap) -> list[float]:
    """Return how each crossing resists turning, as it is fastened: of two materials, the less."""
    own, turning = job.options.get("library"), []
    for supply in job.supplies.values():
        name = str(supply.material).partition(":")[0]
        entry = own.get(name) if isinstance(own, dict) else None
        turning.append(tuple((entry or {}).get("turning_nmm", (BARE, ONE))))
    bare, one_nmm = map(min, zip(*turning, strict=True))
    riveted = {joint.crossing for joint in plan.joints if len(joint.holes) > 1}
    return [
        MORE if one.id in riveted else one_nmm if one.fastened else bare for one in plan.crossings
    ]


def _load(job: Job, plan: CrossingMap) -> Floats:
    """Return what each crossing is to bear as settings ask, (X,), N."""
    load = np.zeros(len(plan.crossings))
    words = _LOAD.fullmatch(str(job.options.get("load", "")))
    if words:
        at = sorted(hanging(words[3] or "top", plan))
        load[at] = GRAVITY * float(words[1]) * _MASSES[words[2]] / len(at)
    return load


def _check_relaxed(job: Job, form: FormRecord, tally: Tally) -> None:
    """Check that strips of the relaxed model are those that are cut, and as near as is told."""
    place = tally.at("model_relaxed.glb")
    model, plan, cut = job.relaxed, required(job.map), required(job.model)
    if not place.expect(model is not None, "it is missing or cannot be read") or model is None:
        return
    first, count = form["states"][0], len(plan.crossings)
    middles = np.zeros((count, 3))
    for one in plan.threads:
        if one.label not in cut or not one.crossings:
            continue
        strip, here = model.get(one.label), place.at(f"thread {one.label}")
        if not here.expect(strip is not None, "it is missing") or strip is None:
            return
        if not here.equal("how many panels there are", len(strip.entry), len(one.crossings)):
            return
        size = len(strip.rungs)
        half = (strip.entry + (strip.exit - strip.entry) % size // 2) % size
        # A thread that crosses itself comes twice.
        np.add.at(middles, np.array(one.crossings), strip.rungs[half].mean(axis=1) / 2.0)
        if first["settled"]:
            off = np.abs(_panels_flat(strip) - _panels_flat(cut[one.label]))
            here.at_most("cut_mm", float(off.max()), CUT_MM, "it unfolds {} off what is cut")
    off = np.linalg.norm(middles - _attitude(first["bodies"]).place, axis=1)
    place.number("strips_mm", form["strips_mm"], float(off.max()), within=TOLD_MM)


def _panels_flat(strip: Strip) -> Complex:
    """Return where each panel and the next lie in the plane, (N, 6), seen from where one begins."""
    size, closed = len(strip.entry), int(strip.closed)
    begin, end = panel_bounds(strip, 0, size + closed)
    flat = unfold(strip, lay_steps(strip), int(begin[0]), int(end[-1])) @ np.array([1.0, 1.0j])
    begin, end = begin - begin[0], end - begin[0]
    after = slice(1, None) if len(begin) > 1 else slice(None)
    rungs = [end[: len(begin[after])], begin[after], end[after]]
    corners = np.concatenate([flat[rung] for rung in rungs], axis=1)
    start = flat[begin[: len(begin[after])]]
    way = start[:, 1] - start[:, 0]
    return np.asarray((corners - start[:, :1]) / (way / np.abs(way))[:, None])
