"""A job's offcut is the next job's stock; and what is said of stock is held to the files."""

import json
import tomllib
from copy import deepcopy
from dataclasses import replace
from types import SimpleNamespace

import pytest
import shapely

from fabweave.cli import main
from fabweave.verify import verify_job
from fabweave.verify.check_sheets import check_areas, check_sheets
from fabweave.verify.check_stock import check_stock
from fabweave.verify.loading import load_job
from fabweave.verify.read_map import read_crossing_map
from fabweave.verify.report import Tally

FIRST = """
[[sheet]]
name = "board"
size = "420x300mm"
price = 3.5
grain = 90
defects = [{x = 330, y = 150, diameter = 30}]
"""
SECOND = """
[[sheet]]
size = "300x300mm"
price = 5
[[offcut]]
name = "left of the first"
outline = "first/offcuts/offcut_01.dxf"
quantity = 1
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
    (root / "second.toml").write_text(SECOND)
    first = make(
        root / "first",
        "--stock",
        str(root / "first.toml"),
        "--rotations",
        "grain:40deg",
        "--label-side",
        "inside",
    )
    return first, make(root / "second", "--stock", str(root / "second.toml"))


def test_a_jobs_offcut_is_the_stock_of_the_next(jobs):
    first, second = jobs
    kept = json.loads((first / "waste.json").read_text())["offcut"]
    plan = json.loads((second / "crossing_map.json").read_text())
    used = plan["sheets"][0]
    assert (used["stock"], used["offcut"], used["price"]) == ("left of the first", True, None)
    # It is that very outline, moved to its corner, with the knot in it.
    told, stated = shapely.Polygon(used["outline"]), shapely.Polygon(kept["outline"])
    assert told.area == pytest.approx(stated.area, abs=0.1)
    assert len(used["defects"]) == len(kept["holes"])
    assert (told.bounds[0], told.bounds[1]) == (0.0, 0.0)
    assert verify_job(second).ok
    # job.toml carries the outline: neither the drawing nor the list is needed again.
    stock = tomllib.loads((second / "job.toml").read_text())["job"]["stock"]
    assert stock["offcut"][0]["outline"] == used["outline"]


def test_the_same_bytes_come_from_job_toml_alone(jobs, tmp_path):
    first, _ = jobs
    again = tmp_path / "again"
    (tmp_path / "job.toml").write_bytes((first / "job.toml").read_bytes())
    main(["make", "--config", str(tmp_path / "job.toml"), "-q", "-o", str(again)])
    names = sorted(path.relative_to(first) for path in first.rglob("*") if path.is_file())
    assert names == sorted(path.relative_to(again) for path in again.rglob("*") if path.is_file())
    assert [n for n in names if (first / n).read_bytes() != (again / n).read_bytes()] == []


def spoilt(jobs, tmp_path, change):
    """Return what the checks find when a change is made to a job as it was read."""
    folder = jobs[0]
    plan = json.loads((folder / "crossing_map.json").read_text())
    waste = json.loads((folder / "waste.json").read_text())
    job = load_job(folder, Tally("files"))
    settings = deepcopy(job.settings)
    change(SimpleNamespace(plan=plan, waste=waste, settings=settings))
    path = tmp_path / "map.json"
    path.write_text(json.dumps(plan))
    job = replace(job, map=read_crossing_map(path), waste=waste, settings=settings)
    tally = Tally("stock")
    for check in (check_stock, check_sheets, check_areas):
        check(job, tally)
    return " | ".join(tally.result().findings)


def nearer_defect(plan):
    piece = plan["pieces"][0]
    x, y = piece["placement"]["x_mm"], piece["placement"]["y_mm"]
    x = plan["sheets"][0]["width_mm"] - x  # sheets are mirrored
    plan["sheets"][0]["defects"][0] = [[x - 60, y - 60], [x + 60, y - 60], [x, y + 60]]


def narrower(plan):
    plan["sheets"][0]["outline"] = [[0, 0], [420, 0], [420, 300], [200, 150], [0, 300]]


CHANGES = [
    (lambda _: None, None),
    (lambda j: j.plan["sheets"][0].update(price=3.0), "price is 3.0 in the map, 3.5 in job.toml"),
    (lambda j: j.plan["sheets"][0].update(grain_deg=0.0), "grain is 0.0 in the map, 90.0"),
    (lambda j: j.plan["sheets"][0].update(grain_deg=0.0), "from the nearest of the angles"),
    (lambda j: j.plan["sheets"][0].update(offcut=True), "offcut is True in the map"),
    (lambda j: j.plan["sheets"][0].update(stock="other"), "not in the stock of job.toml"),
    (lambda j: j.plan["sheets"][0].update(defects=[]), "its defects are not those of job.toml"),
    (lambda j: nearer_defect(j.plan), "from its defect 1, not"),
    (lambda j: narrower(j.plan), "not within the outline"),
    (lambda j: narrower(j.plan), "is the outline that the map tells"),
    (lambda j: narrower(j.plan), "waste.json, sheet 1: area_mm2 is"),
    (
        lambda j: j.settings["job"]["stock"]["sheet"][0].update(size="400x300mm"),
        "not in the stock of job.toml",
    ),
    (lambda j: j.settings["job"]["stock"]["sheet"][0].update(quantity=0), "and 0 are in stock"),
    (lambda j: j.settings["job"].update(rotations="90"), "and job.toml '90'"),
    (
        lambda j: j.plan["layout"]["rotations"].update(tolerance_deg=0.0),
        "the map allows steps of 180.0° ± 0.0°, and job.toml",
    ),
    (lambda j: j.waste["sheets"][0].update(price=9.0), "waste.json, sheet 1: 'board' for 9.0"),
    (lambda j: j.waste["totals"].update(price=1.0), "the sheets cost 1.0, but come to"),
    (lambda j: j.waste.update(offcut=None), "an offcut is there that waste.json does not tell"),
    (lambda j: j.waste["offcut"].update(area_mm2=5.0), "its area is 5.0 mm², but comes to"),
    (lambda j: j.waste["offcut"].update(sheet=7), "is of sheet 7, which does not exist"),
    (lambda j: j.waste["offcut"].update(file="offcuts/x.dxf"), "waste.json tells of offcuts/x"),
    (lambda j: j.waste["offcut"]["rectangle"][0].__setitem__(0, -9.0), "rectangle is not within"),
    (
        lambda j: j.waste["offcut"].update(outline=[[0, 0], [420, 0], [420, 300], [0, 300]]),
        "mm from piece",
    ),
    (
        lambda j: j.waste["offcut"].update(outline=[[0, 0], [500, 0], [420, 300], [0, 300]]),
        "is not within sheet_02",
    ),
    (lambda j: j.waste["offcut"].update(holes=[]), "overlaps defect 1"),
    (lambda j: j.waste["offcut"].update(holes=[]), "does not draw its outline and holes"),
]


@pytest.mark.parametrize("number", range(len(CHANGES)))
def test_whatever_is_spoilt_is_found(jobs, tmp_path, number):
    change, words = CHANGES[number]
    found = spoilt(jobs, tmp_path, change)
    if words is None:
        assert found == ""
    else:
        assert words in found
