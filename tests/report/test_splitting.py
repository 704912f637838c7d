"""What the report says of the pieces of each thread is so, and verify knows if it is not."""

import json

import numpy as np
import pytest

from fabweave.flat.split.length_curve import Choice
from fabweave.report.splitting import SplittingRecord, splitting_section


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
    page = (job / "waste.html").read_text(encoding="utf-8")
    assert page.count("<circle") == 2 * len(lengths)


def test_a_curve_is_drawn_within_its_picture() -> None:
    lengths = 100.0, 200.0
    choices = tuple(Choice(length, 9, 9, 1.0, np.sqrt(length)).record() for length in lengths)
    chosen = choices[0]
    told = SplittingRecord(
        max_length_mm=100.0, prefer="work", chosen=chosen, choices=choices, threads=()
    )
    page = splitting_section(told)
    assert page.count("<polyline") == 2
    assert "at most 100 mm: 9 pieces, 9 joints" in page
    assert "the least work of 2 lengths" in page
    assert page.count('class="taken"') == 1
    bare = SplittingRecord(max_length_mm=1.0, prefer=None, chosen=chosen, choices=(), threads=())
    assert "<svg" not in splitting_section(bare)
    assert "as asked for" in splitting_section(bare)
