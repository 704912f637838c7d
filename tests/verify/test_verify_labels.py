"""Spoil labels: the check objects to letters at edges and holes, and on the wrong side."""

import pytest
import shapely
from sealing import verify_job
from verify_specimen import lettered
from verify_writers import write_job


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
