"""Spoil the steps of the assembly, one fact at a time: the replay must object."""

import pytest
from sealing import told
from spoiling import drop, edit_json, exchange, put
from verify_specimen import assemble
from verify_writers import write_job


def having(what):
    """Return a function that finds the last step that has something in a list."""
    return lambda plan: [step for step in plan["steps"] if step[what]][-1]


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
