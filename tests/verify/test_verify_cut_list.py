"""Lists of cuts, of rolls and of sheets: they are what the map has, and spoilt ones are found."""

import csv
import io
import json
import shutil
from dataclasses import replace
from fractions import Fraction

import pytest
from jobs import run
from sealing import found_by, told
from spoiling import edit_json, put

from fabweave.verify.check.tables import check_cut_list, check_row
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]

BALL = [
    "shape:icosahedron",
    "--refine",
    "loop:1",
    "--size",
    "300mm",
    "--pattern",
    "kagome",
    "--strips",
    "straight",
]
ROLLS = ("--stock", "roll:8mm:4m:2", "--stock", "roll:8mm:9m")
FAST = ("--strips", "straight", "--effort", "quick", "-q", "-o")


@pytest.fixture(scope="module")
def roll(tmp_path_factory):
    folder = tmp_path_factory.mktemp("roll") / "job"
    assert run("make", *BALL, *ROLLS, *FAST, folder) == 0
    return folder


@pytest.fixture(scope="module")
def sheet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sheet") / "job"
    words = ("--sheet", "300x520mm", "--label-side", "inside")
    assert run("make", *BALL, *words, *FAST, folder) == 0
    return folder


def rows_of(folder):
    return list(csv.DictReader(io.StringIO((folder / "cut_list.csv").read_text())))


def test_strips_of_rolls_fill_them_and_are_told_in_their_order(roll):
    plan, rows = json.loads((roll / "crossing_map.json").read_text()), rows_of(roll)
    assert sorted(row["piece"] for row in rows if row["piece"]) == sorted(
        piece["id"] for piece in plan["pieces"]
    )
    for sheet in plan["sheets"]:
        own = [row for row in rows if row["sheet"] == sheet["name"]]
        assert own[0]["from_mm"] == "0.00"
        assert float(own[-1]["to_mm"]) == sheet["roll_mm"]
        assert sheet["height_mm"] == 8.0
        assert sheet["width_mm"] <= sheet["roll_mm"]
        total = sum(float(row["length_mm"]) for row in own)
        assert total == pytest.approx(sheet["roll_mm"], abs=0.01 * len(own))
        assert {row["cut"] for row in own[:-1]} == {"piece"}
    for row in rows:
        inches = float(row["length_mm"]) / 25.4
        assert float(row["length_in"]) == pytest.approx(inches, abs=1e-3)
        fine = sum(Fraction(part) for part in row["length_32nds"].split())
        assert fine.denominator in {1, 2, 4, 8, 16, 32}
        assert abs(float(fine) - inches) <= 1 / 64 + 1e-3


def test_no_machine_cuts_a_roll(roll):
    costs = json.loads((roll / "waste.json").read_text())["estimate"]
    assert costs["machine_s"] == [0.0, 0.0]
    done = {action["action"]: action["count"] for action in costs["assembly"]["actions"]}
    assert done["cut"] == len([row for row in rows_of(roll) if row["cut"] == "piece"])
    assert "sort" not in done


def put_cell(number, column, value):
    def edit(rows):
        rows[number][column] = value(rows[number][column]) if callable(value) else value

    return edit


def added(by):
    return lambda text: f"{float(text) + by:.2f}"


def swapped(one, other):
    def edit(rows):
        rows[one], rows[other] = rows[other], rows[one]

    return edit


def names_swapped(rows):
    rows[0]["piece"], rows[1]["piece"] = rows[1]["piece"], rows[0]["piece"]


def all_moved(rows):
    for row in (row for row in rows if row["from_mm"]):
        row["from_mm"], row["to_mm"] = added(5.0)(row["from_mm"]), added(5.0)(row["to_mm"])


OF_ANY = [
    lambda rows: rows.pop(),
    lambda rows: rows.clear(),
    all_moved,
    put_cell(-1, "sheet", "sheet_99"),
    put_cell(-1, "cut", "snip"),
    put_cell(-1, "to_mm", added(1.0)),
    put_cell(-2, "length_mm", added(0.1)),
    put_cell(-2, "length_in", lambda text: f"{float(text) + 0.01:.3f}"),
    put_cell(-2, "length_32nds", "1 1/32"),
    put_cell(-2, "length_32nds", "one"),
    put_cell(-2, "from_mm", added(0.1)),
    put_cell(-2, "piece", "A99"),
    swapped(-1, -2),
    lambda rows: rows.insert(-2, dict(rows[-2])),
]
OF_ROLLS = [
    names_swapped,
    swapped(0, 1),
    lambda rows: rows.pop(0),
    put_cell(0, "sheet", "sheet_02"),
    put_cell(0, "row", "2"),
    lambda rows: rows.insert(0, {**rows[0], "cut": "rip", "piece": "", "to_mm": "4.00"}),
]
OF_SHEETS = [
    put_cell(0, "to_mm", added(0.5)),
    swapped(0, 1),
    swapped(2, -1),
    lambda rows: rows.pop(3),
    lambda rows: rows.insert(1, {**rows[1], "to_mm": added(-3.0)(rows[1]["to_mm"])}),
]


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        *(("roll", change) for change in (*OF_ANY, *OF_ROLLS)),
        *(
            pytest.param("sheet", change, marks=pytest.mark.slow)
            for change in (*OF_ANY, *OF_SHEETS)
        ),
    ],
)
def test_a_spoilt_list_is_found(kind, change, request):
    job = load_job(request.getfixturevalue(kind), Tally("files"))
    assert not found_by(check_cut_list, job)
    rows = [dict(row) for row in job.cuts]
    change(rows)
    try:
        found = found_by(check_cut_list, replace(job, cuts=rows))
    except (ValueError, LookupError):  # which the proof tells as a finding
        found = "unfinished"
    assert found


@pytest.mark.parametrize(
    ("edits", "names"),
    [
        ([put("sheets", 0, "roll_mm", 4100.0)], {"cut-list", "stock"}),
        ([put("sheets", 0, "roll_mm", None)], {"cut-list", "stock"}),
        ([put("sheets", 0, "height_mm", 9.0)], {"stock"}),
        ([put("pieces", 0, "placement", "x_mm", 3.0)], {"cut-list", "sheets"}),
    ],
)
def test_a_map_at_odds_with_its_rolls_is_found(edits, names, roll, tmp_path):
    folder = shutil.copytree(roll, tmp_path / "job")
    edit_json(folder / "crossing_map.json", *edits)
    assert names <= set(told(folder))


@pytest.mark.parametrize("text", ["roll:8mm:4000mm:1", "roll:7mm:4000mm:2", "roll:8mm"])
def test_rolls_that_are_not_there_are_found(text, roll, tmp_path):
    folder = shutil.copytree(roll, tmp_path / "job")
    settings = (folder / "job.toml").read_text()
    assert "roll:8mm:4000mm:2" in settings
    (folder / "job.toml").write_text(settings.replace("roll:8mm:4000mm:2", text))
    assert "stock" in told(folder)


def test_a_list_that_is_missing_is_found(roll, tmp_path):
    folder = shutil.copytree(roll, tmp_path / "job")
    (folder / "cut_list.csv").unlink()
    assert "cut-list" in told(folder)


@pytest.mark.parametrize(
    ("words", "inches"),
    [("13/16", 0.8125), ("0", 0.0), ("3", 3.0), ("22 3/8", 22.375), ("1 1/0", None), ("-1", None)],
)
def test_inches_are_read_as_rules_have_them(words, inches):
    """Less than an inch has no whole ones before it."""
    stated, wanted = {"length_32nds": words}, {"length_32nds": 25.4 * (inches or 0.0)}
    found = found_by(lambda tally: check_row(stated, wanted, tally.at("row")))
    assert bool(found) == (inches is None)
