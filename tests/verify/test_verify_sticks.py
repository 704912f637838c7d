"""The marks on straight strips are those of the plan: what is spoilt in their table is found."""

import csv
import io
import shutil

import pytest
from jobs import OCTAHEDRON, STRAIGHT
from sealing import found_by, told
from spoiling import edit_json, edit_text

from fabweave.verify.check.tables import check_sticks
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def made(finished):
    return finished(*STRAIGHT)


@pytest.fixture
def job(made, tmp_path):
    return shutil.copytree(made, tmp_path / "job")


def found(folder) -> str:
    return found_by(check_sticks, load_job(folder, Tally("files")))


def spoilt(folder, change) -> str:
    """Change the rows of the table, and return what is found then."""
    path = folder / "sticks.csv"
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    change(rows)
    text = io.StringIO(newline="")
    writer = csv.DictWriter(text, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    path.write_text(text.getvalue())
    return found(folder)


def first(rows, mark="crossing"):
    return next(row for row in rows if row["mark"] == mark)


def put(which, **cells):
    return lambda rows: first(rows, which).update(cells)


def more(mark, column, by):
    def change(rows) -> None:
        row = first(rows, mark)
        row[column] = str(float(row[column]) + by)

    return change


def of_all(column, value):
    """Return a change of a cell in all rows of the first kind."""

    def change(rows) -> None:
        kind = rows[0]["kind"]
        for row in rows:
            if row["kind"] == kind:
                row[column] = value(row[column])

    return change


def swap_rows(rows) -> None:
    rows[1], rows[2] = rows[2], rows[1]


def turn_round(rows) -> None:
    """Count from the other end of the strip."""
    for row in rows:
        if row["kind"] == rows[0]["kind"]:
            row["distance_mm"] = f"{float(row['length_mm']) - float(row['distance_mm']):.2f}"
    rows.sort(key=lambda row: (row["kind"], float(row["distance_mm"])))


def test_true_marks_are_true_and_many(made) -> None:
    assert found(made) == ""


def test_jobs_of_wavy_strips_have_no_such_table(finished, made, tmp_path) -> None:
    folder = shutil.copytree(finished(*OCTAHEDRON), tmp_path / "job")
    assert found(folder) == ""
    shutil.copy(made / "sticks.csv", folder)
    assert "whether there is one" in found(folder)


SPOILT = [
    (more("crossing", "distance_mm", 0.02), "distance_mm is"),
    (more("joint", "distance_mm", -0.02), "distance_mm is"),
    (more("hole", "distance_mm", 0.02), "distance_mm is"),
    (more("slot", "distance_mm", 0.02), "distance_mm is"),
    (more("crossing", "across_mm", 0.02), "across_mm is"),
    (more("hole", "across_mm", -0.02), "across_mm is"),
    (more("crossing", "distance_in", 0.002), "distance_in, in mm, is"),
    (more("cut", "distance_mm", 0.02), "distance_mm is"),
    (more("cut", "length_mm", 0.02), "length_mm is"),
    (more("cut", "width_mm", -0.02), "width_mm is"),
    (put("crossing", nearest_in="1 1/32"), "nearest_in, in mm, is"),
    (put("crossing", lies="under"), "lies is 'under'"),
    (put("joint", lies="over"), "lies is 'over'"),
    (put("joint", mark="crossing"), "mark is"),
    (put("crossing", station="77"), "station is"),
    (put("hole", hole_mm="9"), "hole_mm is 9"),
    (put("hole", hole_mm=""), "hole_mm is ''"),
    (put("slot", hole_mm="3"), "hole_mm is '3'"),
    (put("slot", mark="hole"), "mark is"),
    (put("crossing", distance_mm="nan"), "distance_mm is nan"),
    (of_all("kind", lambda _: "99"), "kind is"),
    (of_all("pieces", lambda names: names.rpartition(" ")[0]), "pieces is"),
    (of_all("pieces", lambda names: f"{names} Z9"), "pieces is"),
    (of_all("turned", lambda _: ""), "turned is"),
    (of_all("length_mm", lambda told: f"{float(told) + 1.0}"), "length_mm is"),
    (swap_rows, "mark is"),
    (turn_round, "but should be"),
    (lambda rows: rows.pop(), "the number of its rows is"),
    (lambda rows: rows.append(rows[-1]), "the number of its rows is"),
]


@pytest.mark.parametrize(("change", "words"), SPOILT)
def test_a_spoilt_row_is_found(job, change, words) -> None:
    assert words in spoilt(job, change)


def test_a_table_that_cannot_be_read_is_found(job) -> None:
    edit_text(job / "sticks.csv", ",crossing,1,", ",crossing,1,far")
    assert list(told(job)) == ["sticks"]


def test_a_table_that_is_missing_is_found(job) -> None:
    (job / "sticks.csv").unlink()
    assert "whether there is one" in found(job)


def test_a_table_of_strips_that_are_said_to_be_wavy_is_found(job) -> None:
    edit_text(job / "job.toml", 'strips = "straight"', 'strips = "wavy"')
    assert "whether there is one" in found(job)


def test_a_plan_whose_strips_differ_from_the_table_is_found(job) -> None:
    def shift(plan) -> None:
        plan["pieces"][0]["stations"][1]["x"] += 0.1

    edit_json(job / "crossing_map.json", shift)
    assert "should be" in found(job)
