"""A job's offcut is the next job's stock; and what is said of stock is held to the files."""

import json
import tomllib
from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace

import pytest
import shapely
from jobs import contents_of
from sealing import found_by, verify_job
from spoiling import drop, put

from fabweave.cli.main import main
from fabweave.verify.check.sheets import check_offcuts, check_sheets, check_stock
from fabweave.verify.crossing_map import read_crossing_map
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = [pytest.mark.usefixtures("quick_jobs"), pytest.mark.slow]

FIRST = """
[[sheet]]
name = "board"
outline = [[60, 0], [420, 0], [420, 300], [0, 300], [0, 60]]
price = 3.5
grain = 90
defects = [{x = 330, y = 150, diameter = 30}]
"""


def make(folder, *options):
    command = ["make", "shape:cube", "--size", "110mm", "--effort", "quick", "-q"]
    main([*command, "-o", str(folder), *options])
    return folder


@pytest.fixture(scope="module")
def jobs(tmp_path_factory):
    """Make one job, and another one of what is left of the first."""
    root = tmp_path_factory.mktemp("stock")
    (root / "first.toml").write_text(FIRST)
    # Pieces so short leave a knot within each offcut.
    words = "--rotations grain:40deg --label-side inside --max-length 258mm"
    first = make(root / "first", "--stock", str(root / "first.toml"), *words.split())
    stock = str(first / "offcuts" / "stock.toml")
    return first, make(root / "second", "--stock", stock, "--sheet", "300x300mm")


def test_a_jobs_offcuts_are_the_stock_of_the_next(jobs):
    first, second = jobs
    kept = json.loads((first / "waste.json").read_text())["offcuts"]
    assert [record["sheet"] for record in kept] == [1, 2]
    price = 3.5 / (420.0 * 300.0 - 60.0**2 / 2.0)
    assert [one["worth"] for one in kept] == pytest.approx(
        [price * one["area_mm2"] for one in kept]
    )
    plan = json.loads((second / "crossing_map.json").read_text())
    names = [f"offcut_{number:02d} of Cube" for number in (1, 2)]
    used = {sheet["stock"]: sheet for sheet in plan["sheets"]}
    assert names[1] in used
    # The grain runs as before; the rest was paid for.
    for record, name in zip(kept, names, strict=True):
        if name not in used:  # nothing fits on it
            continue
        sheet = used[name]
        assert (sheet["offcut"], sheet["price"], sheet["grain_deg"]) == (True, None, 90.0)
        # It is that very outline, moved to its corner, with the knot in it.
        told, stated = shapely.Polygon(sheet["outline"]), shapely.Polygon(record["outline"])
        assert told.area == pytest.approx(stated.area, abs=0.1)
        assert len(sheet["defects"]) == len(record["holes"])
        assert (told.bounds[0], told.bounds[1]) == (0.0, 0.0)
    assert verify_job(second).ok
    # job.toml carries the outline: neither the drawing nor the list is needed again.
    stock = tomllib.loads((second / "job.toml").read_text())["job"]["stock"]["offcut"]
    assert {entry["name"]: entry["outline"] for entry in stock}[names[1]] == used[names[1]][
        "outline"
    ]


def test_the_same_bytes_come_from_job_toml_alone(jobs, tmp_path):
    first, _ = jobs
    again = tmp_path / "again"
    (tmp_path / "job.toml").write_bytes((first / "job.toml").read_bytes())
    main(["make", "--config", str(tmp_path / "job.toml"), "-q", "-o", str(again)])
    assert contents_of(again) == contents_of(first)


@pytest.fixture(scope="module")
def first(jobs):
    """Return the first job as it was read."""
    return load_job(jobs[0], Tally("files"))


def spoilt(job, folder, tmp_path, change):
    """Return what the checks find when a change is made to a job as it was read."""
    plan = json.loads((folder / "crossing_map.json").read_text())
    settings = deepcopy(job.settings)
    change(SimpleNamespace(plan=plan, settings=settings))
    path = tmp_path / "map.json"
    path.write_text(json.dumps(plan))
    job = replace(job, map=read_crossing_map(path), settings=settings)
    return "".join(found_by(check, job) for check in (check_stock, check_offcuts, check_sheets))


def nearer_defect(plan):
    piece = plan["pieces"][0]
    x, y = piece["placement"]["x_mm"], piece["placement"]["y_mm"]
    x = plan["sheets"][0]["width_mm"] - x  # sheets are mirrored
    plan["sheets"][0]["defects"][0] = [[x - 60, y - 60], [x + 60, y - 60], [x, y + 60]]


def narrower(plan):
    plan["sheets"][0]["outline"] = [[0, 0], [420, 0], [420, 300], [200, 150], [0, 300]]


def asked(*path_and_value):
    """Return a change of what was asked for."""
    return lambda job: put("job", *path_and_value)(job.settings)


def planned(change):
    return lambda job: change(job.plan)


SHEET = ("sheets", 0)
ASKED_SHEET = ("stock", "sheet", 0)
CHANGES = [
    (lambda _: None, None),
    (planned(put(*SHEET, "grain_deg", 0.0)), "grain is 0, but should be 90, as in job.toml"),
    (planned(put(*SHEET, "grain_deg", 0.0)), "from the nearest of the angles"),
    (planned(put(*SHEET, "stock", "other")), "not in the stock of job.toml"),
    (planned(put(*SHEET, "defects", [])), "its defects are not those of job.toml"),
    (planned(nearer_defect), "from defect 1"),
    (planned(narrower), "not within the sheet"),
    (planned(narrower), "its outline is not that of job.toml"),
    (planned(put(*SHEET, "rest", None)),
     "crossing_map.json: rests of sheets lack offcuts/offcut_01.dxf"),
    (planned(drop(*SHEET, "rest", "outline", -1)),
     "is not what the map has as the rest of sheet_01"),
    (asked(*ASKED_SHEET, "outline", lambda ring: ring[1:]), "its outline is not that of job.toml"),
    (asked(*ASKED_SHEET, "outline", [[0, 0], [9, 0], [0, 9]]), "not in the stock of job.toml"),
    (lambda job: job.settings["job"]["stock"]["sheet"][0].update(quantity=0), "and there are 0"),
    (asked("rotations", "90"), "as in job.toml, '90'"),
    (planned(put("layout", "rotations", "tolerance_deg", 0.0)),
     "with its tolerance, and from the grain, is (180.0, 0.0, 0.0), but should be (180.0,"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(CHANGES)))
def test_whatever_is_spoilt_is_found(jobs, first, tmp_path, number):
    change, words = CHANGES[number]
    found = spoilt(first, jobs[0], tmp_path, change)
    if words is None:
        assert found == ""
    else:
        assert words in found
