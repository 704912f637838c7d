"""Spoil labels: the check objects to letters at edges and holes, and on the wrong side."""

import numpy as np
import pytest
import shapely
from replacing import replace
from sealing import found_by, verify_job
from verify_specimen import lettered
from verify_writers import write_job

from fabweave.verify.check.drawings import check_labels
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


def labels(specimen, kind, *, begins=""):
    """Return the labels of a kind with their pieces."""
    return [
        (piece, one)
        for piece in specimen.plan["pieces"]
        for one in piece["labels"]
        if one["kind"] == kind and one["text"].startswith(begins)
    ]


def letter_again(specimen):
    """Engrave what the map says."""
    for piece in specimen.plan["pieces"]:
        own = specimen.engraving[piece["id"]]
        own[:] = [shape for shape in own if shape[0] != "ENGRAVE_LABEL"]
        for one in piece["labels"]:
            own.extend(("ENGRAVE_LABEL", run, False) for run in lettered(one))


def findings(specimen, folder, settings=""):
    write_job(specimen, folder)
    if settings:
        text = (folder / "job.toml").read_text()
        (folder / "job.toml").write_text(f"{text}\n[job]\n{settings}\n")
    report = verify_job(folder)
    assert set(report.failed) <= {"labels"}, report.failed
    return next(check for check in report.checks if check.name == "labels").findings


def move_onto_hole(specimen):
    piece, one = labels(specimen, "partner")[0]
    station = piece["stations"][one["station"]]
    one["x"], one["y"] = station["x"], station["y"]
    return "mm from an edge, a hole or a mark"


def move_to_edge(specimen):
    piece, one = labels(specimen, "partner")[0]
    station = piece["stations"][one["station"]]
    edge = shapely.LinearRing(piece["outline"])
    step = [0.01 * (one[key] - station[key]) for key in ("x", "y")]
    while shapely.MultiLineString(lettered(one)).distance(edge) > 0.15:
        one["x"], one["y"] = one["x"] + step[0], one["y"] + step[1]
    return "mm from an edge, a hole or a mark"


def move_onto_mark(specimen):
    piece, one = labels(specimen, "partner")[0]
    own = specimen.engraving[piece["id"]]
    tick = next(run for layer, run, _ in own if layer == "ENGRAVE_MARK")
    one["x"], one["y"] = tick[0]
    return "mm from an edge, a hole or a mark"


@pytest.mark.parametrize("spoil", [move_onto_hole, move_to_edge, move_onto_mark])
def test_letters_that_are_not_clear_are_found(specimen, tmp_path, spoil):
    spoiled = specimen("octahedron")
    words = spoil(spoiled)
    letter_again(spoiled)
    found = findings(spoiled, tmp_path)
    assert any(words in finding for finding in found), found


# --- settings -----------------------------------------------------------------------------------


def test_sheets_lie_as_the_settings_say(specimen, tmp_path):
    found = findings(specimen("octahedron"), tmp_path, 'label_side = "inside"')
    assert found == (
        "sheet_01: whether it is mirrored, with labels inside, is False, but should be True",
    )


# --- ticks --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def job(finished):
    return load_job(
        finished("shape:torus?m=8&n=6", "--size", "200mm", "--effort", "quick"), Tally("files")
    )


def with_piece(job, piece, **changes):
    pieces = tuple(replace(one, **changes) if one is piece else one for one in job.map.pieces)
    return replace(job, map=replace(job.map, pieces=pieces))


def without(job, sheet, gone):
    """Return a job whose drawing of a sheet lacks a shape."""
    drawing = job.sheets.dxf[sheet]
    left = replace(drawing, shapes=tuple(one for one in drawing.shapes if one is not gone))
    return replace(job, sheets=replace(job.sheets, dxf={**job.sheets.dxf, sheet: left}))


@pytest.mark.slow
def test_every_crossing_has_a_hole_or_a_tick(job):
    assert found_by(check_labels, job) == ""
    for piece in job.map.pieces:
        for at, station in enumerate(piece.stations):
            assert station.over or piece.cut_at.get(at) or at in piece.ticks


@pytest.mark.slow
def test_ticks_that_lie_elsewhere_are_found(job):
    piece = next(one for one in job.map.pieces if one.ticks and len(one.stations) > 3)
    over = next(at for at, one in enumerate(piece.stations) if one.over)
    for ticks in ((*piece.ticks, over), (*piece.ticks, len(piece.stations))):
        assert "nothing covers" in found_by(check_labels, with_piece(job, piece, ticks=ticks))
    # What is drawn is not stated; what is stated is not drawn, or points elsewhere.
    assert found_by(check_labels, with_piece(job, piece, ticks=piece.ticks[1:]))
    sheet = job.map.sheets[piece.sheet - 1].name
    at = piece.placed(piece.points)[piece.ticks[0]]
    spoilt = job
    for shape in job.sheets.dxf[sheet].of("ENGRAVE_MARK", piece.id):
        if np.hypot(*(shape.run[:, :2].mean(axis=0) - at)) < 10.0:
            spoilt = without(spoilt, sheet, shape)
    assert "is not drawn" in found_by(check_labels, spoilt)
    moved = tuple(replace(one, x=one.x + 0.5) for one in piece.stations)
    assert found_by(check_labels, with_piece(job, piece, stations=moved))
