"""Spoil the steps of the assembly, one fact at a time: the replay must object."""

import copy
from dataclasses import replace
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
from assembly_models import model_of
from sealing import result_of, told
from spoiling import drop, edit_json, exchange, more, put
from verify_specimen import assemble
from verify_writers import write_job

from fabweave.core.records import to_json
from fabweave.plan.order import Order
from fabweave.plan.steps import build_steps
from fabweave.verify.check.steps import check_steps
from fabweave.verify.crossing_map import Step

TORUS, OPEN = "shape:torus?m=12&n=6", "shape:hypar?m=4&n=3"


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
    # The table of stations has the step of each.
    assert set(found) - {"tables"} == {"steps"}, found


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


class Assembled:
    """The pieces of a model, and the steps that put them together in an order, as JSON."""

    def __init__(self, shape, order, fastened):
        self.model = model_of(shape)
        pieces = self.model.made.pieces
        self.fastened = fastened
        alike = np.ones(len(pieces))
        order = Order(order, alike, alike.astype(int), 1.0, 1.0, self.model.enclosed)
        made = replace(self.model.made, fastened=self.fastened)
        self.plan = {"steps": [to_json(step) for step in build_steps(made, order)]}

    def result(self, *changes, closed=None, ticks=()):
        """Spoil the steps, and return what the replay finds in them."""
        plan = copy.deepcopy(self.plan)
        for change in changes:
            change(plan)
        strands, made = {}, self.model.made
        pieces = {piece.id: self._piece(piece, strands, ticks) for piece in made.pieces}
        crossings = {
            key: SimpleNamespace(id=key, fastened=bool(self.fastened[key]), over=own[True],
                                 under=own[False])
            for key, own in sorted(strands.items())
        }  # fmt: skip
        joints = {
            joint.id: SimpleNamespace(
                id=joint.id, pieces=tuple(made.pieces[at].id for at in joint.pieces)
            )
            for joint in made.joints
        }
        read = SimpleNamespace(
            steps=msgspec.convert(plan["steps"], tuple[Step, ...]),
            piece=pieces, pieces=pieces.values(), crossing=crossings,
            crossings=crossings.values(), joint=joints, joints=joints.values(),
        )  # fmt: skip
        closed = self.model.enclosed if closed is None else closed
        mesh = SimpleNamespace(twin=np.array([1, 0] if closed else [-1]))
        return result_of(check_steps, SimpleNamespace(map=read, mesh=mesh, rings=[]))

    @staticmethod
    def _piece(piece, strands, ticks):
        passes = list(zip(piece.crossings.tolist(), piece.over.tolist(), strict=True))
        for key, over in passes:
            strands.setdefault(key, {})[over] = SimpleNamespace(piece=piece.id)
        return SimpleNamespace(
            id=piece.id,
            ticks=ticks,
            joints=(piece.start_joint, piece.end_joint),
            stations=[SimpleNamespace(crossing=key, over=over) for key, over in passes],
        )


def at_random(shape, seed, share):
    """Assemble a model in any order, with fasteners at a share of the crossings that take one."""
    made, dice = model_of(shape).made, np.random.default_rng(seed)
    fastened = made.fastened & (dice.random(len(made.fastened)) < share)
    return Assembled(shape, dice.permutation(len(made.pieces)), fastened)


@pytest.fixture(scope="module")
def clipped():
    """Return the assembly of a closed surface that needs clips, and reaches from outside."""
    assembled = at_random(TORUS, seed=1, share=0.7)
    assert assembled.result().findings == ()
    return assembled


def first(what):
    """Return a function that finds the first step that has something in a list."""
    return lambda plan: next(step for step in plan["steps"] if step.get(what))


def silent(plan):
    """Say nothing of clips and reach, as maps of earlier versions do."""
    for step in plan["steps"]:
        for key in ("clips", "unclips", "outside"):
            step.pop(key, None)


def stay_on(plan):
    """Take all clips off after the last step."""
    clips = [clip for step in plan["steps"] for clip in step.pop("unclips", ())]
    plan["steps"][-1]["unclips"] = clips


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


def take_off_twice(plan):
    """Take a clip off again, after the last step."""
    clip = first("unclips")(plan)["unclips"][0]
    plan["steps"][-1]["unclips"] = [*plan["steps"][-1].get("unclips", ()), clip]


def too_early(plan):
    """Put a clip on before its second piece is there."""
    at = max(at for at, step in enumerate(plan["steps"]) if step.get("clips"))
    plan["steps"][at - 1]["clips"] = plan["steps"][at].pop("clips")


def to_itself(clip):
    return [*clip[:2], clip[1]]


SPOILT_CLIPS = [
    (drop(first("clips"), "clips"), "lies loose"),
    (take_off_twice, "is not on"),
    (never_clip, "lies loose"),
    (take_off_early, "lies loose"),
    (stay_on, "is on where a fastener is"),
    (drop(having("unclips"), "unclips"), "is on where a fastener is"),
    (put(first("unclips"), "unclips", lambda clips: clips * 2), "is not on"),
    (put(first("clips"), "clips", lambda clips: clips * 2), "is on already"),
    (put(first("clips"), "clips", 0, 0, more(1)), "joins no two strands"),
    (put(first("clips"), "clips", 0, to_itself), "joins no two strands"),
    (too_early, "joins no two strands"),
    (drop(having("outside"), "outside", -1), "set outside lack"),
    (put(first("outside"), "outside", lambda keys: keys * 2), "set outside have"),
    (put("steps", 1, "outside", [0]), "set outside have"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "words"), SPOILT_CLIPS)
def test_another_clip_or_reach_is_found(clipped, spoil, words):
    assert words in str(clipped.result(spoil).findings)


def test_a_clip_that_stays_where_no_fastener_comes_is_found():
    bare = at_random(TORUS, seed=1, share=0.0)
    assert bare.result().findings == ()
    spoilt = bare.result(drop(having("unclips"), "unclips"))
    assert "that nobody takes off" in str(spoilt.findings)


def test_an_open_surface_keeps_its_inside_in_reach(clipped):
    assert "set outside have" in str(clipped.result(closed=False).findings)


def test_maps_of_earlier_versions_say_nothing_of_hands(clipped):
    assert clipped.result(silent).findings == ()


def test_a_map_with_ticks_cannot_pass_for_one_of_those(clipped):
    found = str(clipped.result(silent, ticks=(0,)).findings)
    assert "lies loose" in found


@pytest.mark.parametrize("shape", [TORUS, "shape:octahedron", "shape:tube?m=6&n=2", OPEN])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.3, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_whatever_the_order_clips_hold_and_hands_reach(shape, share, seed):
    # Pieces in whatever order may come to lie beside all others; nothing else is wrong.
    found = at_random(shape, seed, share).result().findings
    assert all("hold on nothing" in finding for finding in found)
