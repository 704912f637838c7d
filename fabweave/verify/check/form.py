"""Check that what is said of an object's form is so: it stands where forces are in balance.

Nothing is solved again: where crossings stand is read, and energies, forces and distances are
evaluated there, from strips that are developed anew and by code and formulae of the verifier's own.
"""

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from fabweave.verify.check.fastening import hanging
from fabweave.verify.crossing_map import CrossingMap, FormRecord, StateRecord
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.elastic import (
    GRAVITY,
    PIECES,
    Attitude,
    Spans,
    Stand,
    crossing_axes,
    middles_of,
    moves,
    nearest,
    pull_of,
    resistance,
    spans_of,
    twists,
    weights,
)
from fabweave.verify.measure.nearness import distances_to
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally, stated_number

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
#: Panels of the relaxed model are where crossings are.
MODEL_MM = 0.01
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
    if _check_given(job, job.form, place):
        proof = _Proof(job, job.form, weave)
        for state in job.form["states"]:
            proof.check(state, dict(told), tally.at("form.json", state["name"]))
    _check_relaxed(job, job.form, weave, tally)


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


def _check_given(job: Job, form: FormRecord, place: Place) -> bool:
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
    asked = str(job.options.get("hang", ""))
    if asked:
        place.same("what it hangs from", form["held"], hanging(asked, plan))
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
        self.hung = "hang" in job.options
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
        if name == "let go":
            away = np.linalg.norm(nearest(places, self.weave.wished) - self.weave.wished, axis=1)
            root = float(np.sqrt((away**2).mean()))
            place.number("mean_mm", told.get("mean_mm"), root, within=TOLD_MM)
            key = "settles_mm"
        else:
            there = nearest(places, self.first) if self.hung else places
            away = np.linalg.norm(there - self.first, axis=1)
            key = "sags_mm" if name == "standing" else "loaded_mm"
        place.number(key, told.get(key), float(away.max()), within=TOLD_MM)


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


def _check_relaxed(job: Job, form: FormRecord, weave: _Weave, tally: Tally) -> None:
    """Check that the relaxed model has its panels where crossings are when it was let go."""
    place = tally.at("model_relaxed.glb")
    model, plan = job.relaxed, required(job.map)
    if not place.expect(model is not None, "it is missing or cannot be read") or model is None:
        return
    bodies = _attitude(form["states"][0]["bodies"])
    spans = weave.spans
    for one in plan.threads:
        own = spans.thread == one.id
        strip = model.get(one.label)
        if not own.any() or not place.expect(strip is not None, f"it lacks {one.label}"):
            continue
        strip = required(strip)
        corners = strip.rungs[np.stack([strip.entry, strip.exit], axis=1)]
        at = np.arange(int(own.sum()))
        there = bodies.at(spans.crossing[own, 0])
        wanted = there.place + np.einsum("nij,nj->ni", there.axes, spans.offset[own, 0])
        off = np.linalg.norm(corners.mean(axis=(1, 2))[at] - wanted, axis=1)
        place.at(f"thread {one.label}").at_most(
            "apart_mm", float(off.max()), MODEL_MM, "a panel is {} from its crossing"
        )
