"""What the report says of the pieces of each thread is so."""

import json

import pytest


@pytest.fixture(scope="module")
def job(finished):
    options = ("--size", "200mm", "--sheet", "600x400mm", "--effort", "quick")
    return finished("shape:cube", "--refine", "catmull-clark:1", *options)


def test_the_lengths_that_were_compared_rise_and_one_of_them_was_taken(job) -> None:
    told = json.loads((job / "waste.json").read_text(encoding="utf-8"))["splitting"]
    lengths = [choice["max_length_mm"] for choice in told["choices"]]
    assert lengths == sorted(lengths)
    assert told["max_length_mm"] in lengths
    assert told["prefer"] == "balanced"
    taken = next(one for one in told["choices"] if one["max_length_mm"] == told["max_length_mm"])
    assert taken == told["chosen"]
    assert taken["cost"] == min(choice["cost"] for choice in told["choices"])
    # The longer a piece may be, the fewer there are, and the less they fill.
    assert told["choices"][0]["joints"] >= told["choices"][-1]["joints"]
    plan = json.loads((job / "crossing_map.json").read_text(encoding="utf-8"))
    assert told["chosen"]["pieces"] == len(plan["pieces"])
    assert told["chosen"]["joints"] == len(plan["joints"])
    assert sum(row["pieces"] for row in told["threads"]) == len(plan["pieces"])
    assert all(0.1 < row["fill"] <= 1 for row in told["threads"])
