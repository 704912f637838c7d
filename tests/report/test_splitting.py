"""What the report says of the pieces of each thread is so, and verify knows if it is not."""

import json
import shutil

import numpy as np
import pytest

from fabweave.flat.split.length_curve import Choice
from fabweave.report.splitting import SplittingRecord, splitting_section
from fabweave.verify import verify_job


@pytest.fixture(scope="module")
def job(finished):
    options = ("--size", "200mm", "--sheet", "600x400mm", "--effort", "quick")
    return finished("shape:cube", "--refine", "catmull-clark:1", *options)


def test_the_lengths_that_were_compared_rise_and_one_of_them_was_taken(job) -> None:
    told = json.loads((job / "waste.json").read_text(encoding="utf-8"))["splitting"]
    lengths = [choice["max_length_mm"] for choice in told["choices"]]
    assert lengths == sorted(lengths)
    assert told["max_length_mm"] in lengths
    # The longer a piece may be, the fewer there are, and the less they fill.
    assert told["choices"][0]["joints"] >= told["choices"][-1]["joints"]
    plan = json.loads((job / "crossing_map.json").read_text(encoding="utf-8"))
    assert sum(row["pieces"] for row in told["threads"]) == len(plan["pieces"])
    assert all(0.1 < row["fill"] <= 1 for row in told["threads"])
    page = (job / "waste.html").read_text(encoding="utf-8")
    assert page.count("<circle") == 2 * len(lengths)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "value"), [("pieces", 99), ("thread", "ZZ"), ("longest_mm", 1.0), ("fill", 0.99)]
)
def test_verify_knows_what_is_not_so(job, tmp_path, key, value) -> None:
    folder = tmp_path / "spoilt"
    shutil.copytree(job, folder)
    report = json.loads((folder / "waste.json").read_text(encoding="utf-8"))
    assert report["splitting"]["threads"][1][key] != value
    report["splitting"]["threads"][1][key] = value
    (folder / "waste.json").write_text(json.dumps(report), encoding="utf-8")
    assert verify_job(folder).failed == ("areas",)


def test_a_curve_is_drawn_within_its_picture() -> None:
    lengths = 100.0, 200.0
    choices = tuple(Choice(length, 9, 9, 1.0, np.sqrt(length)).record() for length in lengths)
    page = splitting_section(SplittingRecord(max_length_mm=100.0, choices=choices, threads=()))
    assert page.count("<polyline") == 2
    bare = SplittingRecord(max_length_mm=1.0, choices=(), threads=())
    assert "<svg" not in splitting_section(bare)
