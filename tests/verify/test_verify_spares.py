"""Spares are cut, counted and named beside the pieces, and nothing is woven of them."""

import csv
import json
from collections import Counter

import numpy as np
import pytest
from replacing import replace
from sealing import found_by

from fabweave.piece.congruence import parse_spares, spared
from fabweave.verify.check.drawings import check_dxf, check_labels
from fabweave.verify.check.pieces import check_kinds
from fabweave.verify.check.service import check_service
from fabweave.verify.read.job_files import Job, load_job
from fabweave.verify.report import Tally

# A whole job of its own stands behind each.
pytestmark = pytest.mark.slow

JOB = [
    "shape:octahedron", "--size", "200mm", "--refine", "catmull-clark:1", "--effort", "quick",
    "--spares", "10%", "--profile", "service",
]  # fmt: skip


@pytest.fixture(scope="module")
def folder(finished):
    return finished(*JOB)


@pytest.fixture(scope="module")
def job(folder) -> Job:
    return load_job(folder, Tally("files"))


def with_map(job: Job, **changes) -> Job:
    return replace(job, map=replace(job.map, **changes))


def test_so_many_spares_of_each_kind_are_wanted():
    kinds = np.array([1] * 41 + [2] * 40 + [3])
    assert Counter(kinds[spared(kinds, "5%")].tolist()) == {1: 3, 2: 2, 3: 1}
    assert spared(kinds, "2").tolist() == [0, 0, 41, 41, 81, 81]
    assert spared(kinds, "100%").tolist() == [0] * 41 + [41] * 40 + [81]
    assert parse_spares("12.5 %") == (0.125, 0)


def test_spares_are_cut_and_woven_nowhere(folder, job):
    plan = job.map
    kinds = Counter(piece.kind for piece in plan.pieces)
    wanted = {kind: -(-count // 10) for kind, count in kinds.items()}
    assert Counter(plan.cut_piece[name].kind for name in plan.spare_of) == wanted
    assert len(plan.to_cut) == len(plan.pieces) + sum(wanted.values())
    assert sum(len(plan.on_sheet(sheet.number)) for sheet in plan.sheets) == len(plan.to_cut)
    assert not {name for thread in plan.threads for name in thread.pieces} & set(plan.spare_of)
    # Each has the very shape of the first of its kind.
    for name, origin in plan.spare_of.items():
        first = next(one for one in plan.pieces if one.kind == plan.cut_piece[name].kind)
        assert origin == first.id
        assert plan.cut_piece[name].path is first.path
    with (folder / "pieces.csv").open() as file:
        rows = {row["id"]: row["spare_of"] for row in csv.DictReader(file)}
    assert {name: origin for name, origin in rows.items() if origin} == plan.spare_of
    with (folder / "service" / "parts.csv").open() as file:
        table = {int(row["kind"]): int(row["quantity"]) for row in csv.DictReader(file)}
    assert table == {kind: count + wanted[kind] for kind, count in kinds.items()}
    waste = json.loads((folder / "waste.json").read_text())
    assert waste["totals"]["pieces"] == len(plan.to_cut)
    for check in (check_kinds, check_labels, check_service, check_dxf):
        assert found_by(check, job) == ""


def test_a_spare_that_is_missing_misplaced_or_misnamed_is_found(job):
    plan = job.map
    name, origin = next(iter(plan.spare_of.items()))
    (spare,) = (one for one in plan.spares if one.id == name)
    others = tuple(one for one in plan.spares if one is not spare)
    lost = with_map(job, spares=others)
    assert "number of its spares" in found_by(check_kinds, lost)
    assert "belong to " + name in found_by(check_dxf, lost)
    place = replace(spare.placement, x_mm=spare.placement.x_mm + 1.0)
    moved = with_map(job, spares=(replace(spare, placement=place), *others))
    assert f"piece {name}" in found_by(check_dxf, moved)
    # What is said to be a spare of another kind does not cover what is drawn.
    other = next(one for one in plan.pieces if one.kind != plan.piece[origin].kind)
    disguised = with_map(job, spares=(replace(spare, of=other.id), *others))
    assert f"piece {name}" in found_by(check_dxf, disguised)
    assert "number of its spares" in found_by(check_kinds, disguised)
    for asked, found in (("2", "number of its spares"), ("some", "no share and no number")):
        settings = {**job.settings, "job": {**job.options, "spares": asked}}
        assert found in found_by(check_kinds, replace(job, settings=settings))


@pytest.mark.parametrize("labels", ["kinds", "none", "full", "numbers"])
def test_spares_bear_what_their_kind_does(finished, labels):
    folder = finished(*JOB[:-2], "--labels", labels, "--label-side", "inside")
    plan = json.loads((folder / "crossing_map.json").read_text())
    kinds = {piece["id"]: piece["kind"] for piece in plan["pieces"]}
    for spare in plan["spares"]:
        told = {one["text"].rstrip("→") for one in spare["labels"]}
        kind = kinds[spare["of"]]
        assert told == {"kinds": {f"K{kind}"}, "none": set()}.get(labels, {spare["id"]})
