"""Spoil the steps of the assembly, one fact at a time: the replay must object."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from assembly_models import model_of
from sealing import found_by, result_of, told
from spoiling import drop, edit_json, exchange, more, put
from verify_specimen import assemble
from verify_writers import write_job

from fabweave.plan.order import Order
from fabweave.plan.steps import build_steps
from fabweave.verify.check.steps import check_steps
from fabweave.verify.crossing_map import read_crossing_map
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


def having(what):
    """Return a function that finds the last step that has something in a list."""
    return lambda plan: [step for step in plan["steps"] if step.get(what)][-1]


def place_another_piece(plan):
    four, five = plan["steps"][4:6]
    four["pieces"], five["pieces"] = five["pieces"], four["pieces"]


def exchange_steps(plan):
    exchange("steps", 3, 4)(plan)
    for at in (3, 4):
        plan["steps"][at]["step"] = at + 1


def number_from_nought(plan):
    for step in plan["steps"]:
        step["step"] -= 1


def early(what):
    """Return an edit that has something done in the first step."""

    def edit(plan):
        plan["steps"][0][what].append(having(what)(plan)[what].pop())

    return edit


def other_side(side, other):
    def edit(plan):
        step = having(side)(plan)
        step[other].append(step[side].pop())

    return edit


@pytest.mark.parametrize(
    "spoil",
    [
        drop("steps", -1),
        put("steps", -1, "pieces", lambda names: names * 2),
        place_another_piece,
        exchange_steps,
        number_from_nought,
        drop(having("crossings"), "crossings", -1),
        put(having("crossings"), "crossings", lambda made: [*made, made[0]]),
        *map(early, ("crossings", "joints", "fasten")),
        other_side("over", "under"),
        other_side("under", "over"),
        drop(having("joints"), "joints", -1),
        drop(having("fasten"), "fasten", -1),
        put(having("closes"), "closes", False),
        put("steps", 0, "closes", True),
    ],
    ids=lambda spoil: spoil.__name__,
)
def test_the_replay_objects(job, spoil):
    folder = job("torus")
    edit_json(folder / "crossing_map.json", spoil)
    found = told(folder)
    assert set(found) == {"steps"}, found


def test_a_piece_that_holds_on_nothing_is_found(specimen, tmp_path):
    spoiled = specimen("torus")
    first, *others = spoiled.plan["pieces"]
    passed = {station["crossing"] for station in first["stations"]}
    apart = next(
        p for p in others if not passed & {station["crossing"] for station in p["stations"]}
    )
    order = [first, apart, *(piece for piece in others if piece is not apart)]
    spoiled.plan["steps"] = assemble(order, spoiled.plan["joints"], hold=False)
    found = told(write_job(spoiled, tmp_path))
    assert set(found) == {"steps"}
    assert "hold on nothing" in found["steps"][0]
    assert len(found["steps"]) == 1


#: A closed surface whose plan has clips, and fasteners that are set from outside.
CLIPPED = ("shape:torus?m=6&n=4", "--size", "200mm", "--effort", "quick")


@pytest.fixture
def clipped(finished, tmp_path):
    """Return a function that spoils a job's plan, and says what the replay finds in it."""
    whole = load_job(finished(*CLIPPED), Tally("files"))
    copy = tmp_path / "crossing_map.json"
    copy.write_bytes((finished(*CLIPPED) / copy.name).read_bytes())

    def spoiled(*changes, **other):
        edit_json(copy, *changes)
        return found_by(check_steps, replace(whole, map=read_crossing_map(copy), **other))

    return spoiled


def first(what):
    """Return a function that finds the first step that has something in a list."""
    return lambda plan: next(step for step in plan["steps"] if step.get(what))


def silent(plan):
    """Say nothing of clips and reach, as maps of earlier versions do."""
    for step in plan["steps"]:
        for key in ("clips", "unclips", "outside"):
            step.pop(key, None)


def stay_on(plan):
    """Take a clip off after the last step only."""
    plan["steps"][-1]["unclips"] = [first("unclips")(plan)["unclips"].pop(0)]


def never_clip(plan):
    """Let one clip be, both on and off."""
    clip = first("clips")(plan)["clips"].pop(0)
    off = next(step for step in plan["steps"] if clip in step.get("unclips", ()))
    off["unclips"].remove(clip)


def take_off_early(plan):
    """Take a clip off as soon as it is on: in the step after."""
    at = next(at for at, step in enumerate(plan["steps"]) if step.get("clips"))
    clip = plan["steps"][at]["clips"][0]
    off = next(step for step in plan["steps"] if clip in step.get("unclips", ()))
    off["unclips"].remove(clip)
    plan["steps"][at + 1].setdefault("unclips", []).append(clip)


def to_itself(clip):
    return [*clip[:2], clip[1]]


SPOILT_CLIPS = [
    (drop(first("clips"), "clips"), "lies loose"),
    (drop(first("clips"), "clips"), "is not on"),
    (never_clip, "lies loose"),
    (take_off_early, "lies loose"),
    (stay_on, "is on where a fastener is"),
    (drop(having("unclips"), "unclips"), "that nobody takes off"),
    (put(first("unclips"), "unclips", lambda clips: clips * 2), "is not on"),
    (put(first("clips"), "clips", lambda clips: clips * 2), "is on already"),
    (put(first("clips"), "clips", 0, 0, more(1)), "joins no two strands"),
    (put(first("clips"), "clips", 0, to_itself), "joins no two strands"),
    (put("steps", 0, "clips", lambda _: [[0, "A1", "B1"]]), "joins no two strands"),
    (drop(having("outside"), "outside", -1), "set outside lack"),
    (put(first("outside"), "outside", lambda keys: keys * 2), "set outside have"),
    (put("steps", 1, "outside", [0]), "set outside have"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "words"), SPOILT_CLIPS)
def test_another_clip_or_reach_is_found(clipped, spoil, words):
    assert clipped() == ""
    assert words in clipped(spoil)


def test_an_open_surface_keeps_its_inside_in_reach(clipped):
    opened = SimpleNamespace(twin=np.array([1, 0, -1]))
    assert "set outside have" in clipped(mesh=opened)
    assert clipped(silent, mesh=opened) == ""


def as_proof_reads(model, order, fastened):
    """Return what the replay needs of a plan that is put together in an order."""
    made = replace(model.made, fastened=fastened)
    alike = np.ones(len(order))
    steps = build_steps(made, Order(order, alike, alike.astype(int), 1.0, 1.0, model.enclosed))
    names = {}
    for piece in made.pieces:
        for key, over in zip(piece.crossings.tolist(), piece.over.tolist(), strict=True):
            names.setdefault(key, {})[over] = piece.id
    pieces = [
        SimpleNamespace(
            id=piece.id,
            joints=(piece.start_joint, piece.end_joint),
            stations=[
                SimpleNamespace(crossing=key, over=over)
                for key, over in zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
            ],
        )
        for piece in made.pieces
    ]
    crossings = [
        SimpleNamespace(
            id=key,
            fastened=bool(fastened[key]),
            over=SimpleNamespace(piece=own[True]),
            under=SimpleNamespace(piece=own[False]),
        )
        for key, own in sorted(names.items())
    ]
    joints = [
        SimpleNamespace(id=joint.id, pieces=tuple(made.pieces[at].id for at in joint.pieces))
        for joint in made.joints
    ]
    steps = [
        SimpleNamespace(
            **{key: getattr(step, key) or () for key in ("clips", "unclips", "outside")},
            **{key: getattr(step, key) for key in ("step", "pieces", "crossings", "over", "under",
                                                   "joints", "fasten", "closes", "ring")},
        )
        for step in steps
    ]  # fmt: skip
    return SimpleNamespace(
        pieces=pieces, crossings=crossings, joints=joints, steps=steps,
        piece={one.id: one for one in pieces}, crossing={one.id: one for one in crossings},
        joint={one.id: one for one in joints},
    )  # fmt: skip


@pytest.mark.parametrize(
    "shape",
    ["shape:torus?m=6&n=4", "shape:octahedron", "shape:tube?m=6&n=2", "shape:hypar?m=4&n=3"],
)
@pytest.mark.parametrize("seed", range(4))
def test_whatever_the_order_clips_hold_and_hands_reach(shape, seed):
    model, dice = model_of(shape), np.random.default_rng(seed)
    order = dice.permutation(len(model.made.pieces))
    fastened = model.made.fastened & (dice.random(len(model.made.fastened)) < dice.choice([0.3, 1]))
    plan = as_proof_reads(model, order, fastened)
    mesh = SimpleNamespace(twin=np.array([1, 0] if model.enclosed else [-1]))
    result = result_of(check_steps, SimpleNamespace(map=plan, mesh=mesh, rim=None))
    # Pieces in whatever order may come to lie beside all others; nothing else is wrong.
    assert all("hold on nothing" in finding for finding in result.findings)
    assert result.count > 8 * len(plan.steps)
