"""Check that what is told of an object's form agrees with its record, its strips and the map.

Forces are not balanced again here: tests hold what finds where it rests to mechanics of their own.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.check.fastening import carrying
from fabweave.verify.crossing_map import CrossingMap, FormRecord, StateRecord
from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.geometry import lay_steps, panel_bounds, unfold
from fabweave.verify.measure.walks import edge_quads, joined
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import AIMED, Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Place, Tally, stated_number

Complex: TypeAlias = npt.NDArray[np.complexfloating]

#: Distances are told to hundredths of a millimetre.
TOLD_MM = 0.011
#: Strips of the relaxed model unfold to those that are cut, from panel to panel, to this.
CUT_MM = 0.05
#: Crossings are wished where they are on their edges, to this share of how far they are beside the
#: middles of these, and so many millimetres.
BESIDE, WISHED_MM = 0.5, 0.001
#: What goes farther than this share of a body's size collapses, and is told without a number; and
#: a body whose lowest place is higher than that share above all stands on nothing.
FALLS, FOOT = 0.1, 0.02
#: States, and what is told of each.
_NAMES = {"let go": "settles_mm", "standing": "sags_mm", "loaded": "loaded_mm"}


def check_form(job: Job, tally: Tally) -> None:
    """Check what an object was let go with, and what is told of where it comes to rest."""
    plan = required(job.map)
    told, place = (job.verdict or {}).get("form"), tally.at("form.json")
    place.equal("whether it was let go", job.form is not None, told is not None)
    if job.form is None or told is None:
        return
    bodies = _bodies_of(required(job.wished), plan)
    if _check_aim(job, job.form, told, tally) and _check_given(job, job.form, bodies, place):
        _check_told(job, job.form, bodies, tally)
    _check_relaxed(job, job.form, tally)


def _check_aim(job: Job, form: FormRecord, told: dict[str, Any], tally: Tally) -> bool:
    """Check that the woven mesh is no farther than told from the one that it settles onto.

    Crossings are wished at the edges of that one; without it, where they are woven.
    """
    place, aim, mesh = tally.at(AIMED), form.get("aim"), required(job.mesh)
    place.equal("whether it is there", job.aimed is not None, aim is not None)
    if job.aimed is None or aim is None:
        place.expect(
            told.get("moved_mm") is None, "the mesh is said to be moved, and it is missing"
        )
        return aim is None
    place.expect(job.options.get("as_drawn") != "off", "it is to be woven as it is drawn")
    same = len(job.aimed.vertices) == len(mesh.vertices) and np.array_equal(
        job.aimed.corner, mesh.corner
    )
    if not (
        place.expect(same, "its faces are not those of woven_mesh.obj")
        and place.equal("how many crossings it is told of", len(aim), len(job.edges))
    ):
        return False
    moved = np.linalg.norm(job.aimed.vertices - mesh.vertices, axis=1)
    # Where it collapses, it was moved for nothing.
    wanted = None if told.get("collapses") else float(moved.max())
    place.number("moved_mm", told.get("moved_mm"), wanted, within=TOLD_MM)
    sides = np.array([job.edges[at] for at in range(len(aim))])
    wished, woven = (edge_quads(one, sides) for one in (job.aimed, mesh))
    # Where strands do not cross in the middle of a quad, they do so by the same shares in both.
    beside = np.array([one.position for one in required(job.map).crossings]) - woven.middle
    off = np.linalg.norm(np.array(aim) - wished.middle - beside, axis=1)
    most = BESIDE * np.linalg.norm(beside, axis=1) + WISHED_MM
    return place.expect(
        bool((off <= most).all()),
        f"{np.count_nonzero(off > most)} crossings are not wished at its edges",
    )


def _check_given(job: Job, form: FormRecord, bodies: list["_Body"], place: Place) -> bool:
    """Check what states were found with; say whether they can be read."""
    plan = required(job.map)
    names = [*_NAMES][: 3 if "load" in job.options else 2]
    if not (
        place.equal("how many threads there are", len(form["threads"]), len(plan.threads))
        and place.equal("the states", [one["name"] for one in form["states"]], names)
    ):
        return False
    held, hung = set(form["held"]), carrying(job)
    for own in (set(body.own.tolist()) for body in bodies):
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


def _check_told(job: Job, form: FormRecord, bodies: list["_Body"], tally: Tally) -> None:
    """Check how far crossings are said to go, and that what collapses is said first."""
    verdict = job.verdict or {}
    told: dict[str, Any] = dict(verdict["form"])
    drawn = [one.position for one in required(job.map).crossings]
    wished, states = np.array(form.get("aim", drawn)), form["states"]
    before, falls = wished, False
    for state in states:
        place, there = tally.at("form.json", state["name"]), _places(state)
        falls |= _check_distances(job, state["name"], there, before, bodies, told, place)
        before = before if state["name"] != "let go" else there
    based = carrying(job) if job.based else set()
    _check_end(told, there, wished, bodies, based, tally.at("verdict.json"))
    place, reasons = tally.at("verdict.json"), verdict.get("reasons") or [{}]
    rests = all(state["settled"] for state in states)
    place.equal("whether it came to rest", told.get("settled"), rests)
    if falls:
        place.equal("whether it collapses", told.get("collapses"), True)
    if told.get("collapses") and "former" not in job.options:
        place.equal("the first reason", dict(reasons[0]).get("rule"), "collapse")
        place.equal("the verdict", verdict.get("level"), "not makeable")


def _check_end(
    told: dict[str, Any], there: Floats, wished: Floats, bodies: list["_Body"],
    based: set[int], place: Place,
) -> None:  # fmt: skip
    """Check how far the object is said to be off in the end, and that moving its mesh gained."""
    off = np.zeros(len(there))
    each = told.get("bodies") or [told]
    for body, said in zip(bodies, each, strict=True):
        ends = there[body.own]
        ends = ends if based & set(body.own.tolist()) else nearest(ends, wished[body.own])
        away = ends - wished[body.own]
        off[body.own] = np.linalg.norm(away, axis=1)
        _check_far(place, "off_mm", said, float(off[body.own].max()), body.size_mm)
    own = np.concatenate([body.own for body in bodies])
    mean, size_mm = float(np.sqrt((off[own] ** 2).mean())), max(body.size_mm for body in bodies)
    _check_far(place, "off_mean_mm", told, mean, size_mm)
    if told.get("moved_mm") is not None:
        drawn = stated_number(told, "drawn_mean_mm")
        place.expect(mean <= drawn, "it comes no nearer than as it is drawn on its model")


def _check_distances(
    job: Job, name: str, places: Floats, before: Floats, bodies: list["_Body"],
    told: dict[str, Any], place: Place,
) -> bool:  # fmt: skip
    """Check how far crossings are said to go in a state; say whether a body falls."""
    far, goes, falls, hung = np.zeros(len(places)), name == "let go", False, carrying(job)
    key, each = _NAMES[name], told.get("bodies") or [told]
    size_mm = float(np.ptp(required(job.wished).vertices, axis=0).max())
    if not place.equal("how many bodies it is told of", len(each), len(bodies)):
        return False
    for number, (body, said) in enumerate(zip(bodies, each, strict=True), start=1):
        there, hangs = places[body.own], hung & set(body.own.tolist())
        if (goes or hangs) and not (hangs and job.based):
            there = nearest(there, before[body.own])
        far[body.own] = np.linalg.norm(there - before[body.own], axis=1)
        here = place.at(f"body {number}") if len(each) > 1 else place
        falls |= _check_far(here, key, said, float(far[body.own].max()), body.size_mm)
        if goes and len(each) > 1:
            air_mm = 0.0 if hangs or body.high_mm <= FOOT * size_mm else body.high_mm
            here.number("air_mm", said.get("air_mm") or 0.0, air_mm, within=TOLD_MM)
    # What no strip joins goes nowhere.
    far = far[np.concatenate([body.own for body in bodies])]
    _check_far(place, key, told, float(far.max()), size_mm)
    if goes:
        _check_far(place, "mean_mm", told, float(np.sqrt((far**2).mean())), size_mm)
    return falls


def nearest(places: Floats, to: Floats) -> Floats:
    """Return places after the rigid motion that brings them nearest to others, (N, 3)."""
    # Of places on a line many turns do: any of them brings them there.
    left, _, right = np.linalg.svd((to - to.mean(axis=0)).T @ (places - places.mean(axis=0)))
    turn = left * (1.0, 1.0, np.sign(np.linalg.det(left @ right))) @ right
    return np.asarray((places - places.mean(axis=0)) @ turn.T + to.mean(axis=0))


@dataclass(frozen=True, eq=False)
class _Body:
    """The crossings of a body, its largest extent, and how high above all its lowest place is."""

    own: Ints
    size_mm: float
    high_mm: float


def _bodies_of(mesh: LoadedMesh, plan: CrossingMap) -> list[_Body]:
    """Return the bodies that strips join, each as large as its part of the mesh."""
    count = len(plan.crossings)
    links = np.array([pair for one in plan.threads for pair in pairwise(one.crossings)])
    owner = joined(links.reshape(-1, 2), count)
    numbers = np.unique(owner[links.reshape(-1, 2)[:, 0]])
    owns = [np.flatnonzero(owner == number) for number in numbers]
    owns = owns if len(owns) > 1 else [np.arange(count)]
    edges = np.stack([mesh.corner, mesh.corner[mesh.next]], axis=1)
    label = joined(edges, len(mesh.vertices))
    ground = mesh.vertices[mesh.corner, 2].min()
    found = []
    for own in owns:
        parts = {int(label[plan.crossings[at].edge[0]]) for at in own.tolist()}
        vertices = mesh.vertices[np.isin(label, sorted(parts))]
        size = float(np.ptp(vertices, axis=0).max())
        found.append(_Body(own, size, float(vertices[:, 2].min() - ground)))
    return found


def _check_far(place: Place, key: str, told: dict[str, Any], far_mm: float, size_mm: float) -> bool:
    """Check how far something is said to go, or that no number is said; say whether it falls."""
    value, limit = told.get(key), FALLS * size_mm
    if value is None:
        place.expect(far_mm > limit - TOLD_MM, f"{key} is not told, although it does not collapse")
    elif place.expect(far_mm <= limit + TOLD_MM, f"{key} is told, although it collapses"):
        place.number(key, value, far_mm, within=TOLD_MM)
    return far_mm > limit + TOLD_MM


def _places(state: StateRecord) -> Floats:
    """Return where crossings are, (X, 3)."""
    return np.array(state["bodies"], dtype=np.float64).reshape(-1, 6)[:, :3]


def _check_relaxed(job: Job, form: FormRecord, tally: Tally) -> None:
    """Check that strips of the relaxed model are those that are cut, and as near as is told."""
    place = tally.at("model_relaxed.glb")
    model, plan, cut = job.relaxed, required(job.map), required(job.model)
    if form["strips_mm"] is None:
        place.expect(model is None, "form.json says that there is none")
        return
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
    off = np.linalg.norm(middles - _places(first), axis=1)
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
