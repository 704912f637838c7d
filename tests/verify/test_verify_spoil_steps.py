"""Spoil the steps of the assembly, one fact at a time: the replay must object."""

import json

import pytest
from sealing import verify_job
from verify_specimen import assemble
from verify_writers import write_job


def told(folder):
    return {check.name: check.findings for check in verify_job(folder).checks if not check.ok}


def having(plan, what):
    """Return the last step that has something in a list."""
    return [step for step in plan["steps"] if step[what]][-1]


def forget_the_last_piece(plan):
    plan["steps"].pop()


def place_a_piece_twice(plan):
    plan["steps"][-1]["pieces"] *= 2


def place_another_piece(plan):
    plan["steps"][4]["pieces"], plan["steps"][5]["pieces"] = (
        plan["steps"][5]["pieces"],
        plan["steps"][4]["pieces"],
    )


def exchange_steps(plan):
    one, two = plan["steps"][3:5]
    plan["steps"][3:5] = [two, one]
    one["step"], two["step"] = two["step"], one["step"]


def number_from_nought(plan):
    for step in plan["steps"]:
        step["step"] -= 1


def forget_a_crossing(plan):
    having(plan, "crossings")["crossings"].pop()


def make_a_crossing_twice(plan):
    done = having(plan, "crossings")["crossings"]
    done.append(done[0])


def make_a_crossing_early(plan):
    plan["steps"][0]["crossings"].append(having(plan, "crossings")["crossings"].pop())


def go_under_instead_of_over(plan):
    step = having(plan, "over")
    step["under"].append(step["over"].pop())


def go_over_instead_of_under(plan):
    step = having(plan, "under")
    step["over"].append(step["under"].pop())


def forget_a_joint(plan):
    having(plan, "joints")["joints"].pop()


def join_early(plan):
    plan["steps"][0]["joints"].append(having(plan, "joints")["joints"].pop())


def fasten_early(plan):
    plan["steps"][0]["fasten"].append(having(plan, "fasten")["fasten"].pop())


def fasten_never(plan):
    having(plan, "fasten")["fasten"].pop()


def close_nothing(plan):
    having(plan, "closes")["closes"] = False


def close_at_once(plan):
    plan["steps"][0]["closes"] = True


SPOILS = [
    forget_the_last_piece, place_a_piece_twice, place_another_piece, exchange_steps,
    number_from_nought, forget_a_crossing, make_a_crossing_twice, make_a_crossing_early,
    go_under_instead_of_over, go_over_instead_of_under, forget_a_joint, join_early, fasten_early,
    fasten_never, close_nothing, close_at_once, ]  # fmt: skip


@pytest.mark.parametrize("spoil", SPOILS, ids=lambda spoil: spoil.__name__)
def test_the_replay_objects(job, spoil):
    folder = job("torus")
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    spoil(plan)
    path.write_text(json.dumps(plan))
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
