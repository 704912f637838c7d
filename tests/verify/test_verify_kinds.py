"""Kinds are proved: what does not cover its namesake is found."""

import json

import numpy as np
import pytest

from fabweave.verify import verify_job


def respoken(folder, change):
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    change(plan["pieces"])
    path.write_text(json.dumps(plan))
    checks = {check.name: check for check in verify_job(folder).checks}
    return checks["kinds"]


def make_twin(pieces):
    """Put a copy of the first piece, turned and shifted, in place of the second."""
    turn = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    first, second = pieces[0], pieces[1]
    second["kind"] = first["kind"]
    second["outline"] = (np.array(first["outline"]) @ turn.T + 3.0).tolist()
    second["stations"] = [dict(station) for station in first["stations"]]
    for station in second["stations"]:
        station["x"], station["y"] = (turn @ [station["x"], station["y"]] + 3.0).tolist()
    for piece in (first, second):
        piece["joints"] = [None, None]
        piece.pop("cutouts", None)
    return second


def mirror(piece):
    piece["outline"] = [[-x, y] for x, y in piece["outline"]][::-1]
    for station in piece["stations"]:
        station["x"] = -station["x"]


def test_twins_are_of_one_kind_and_mirrored_ones_are_not(job):
    assert respoken(job("octahedron"), make_twin).ok

    def spoil(pieces):
        mirror(make_twin(pieces))

    found = respoken(job("octahedron"), spoil)
    assert not found.ok
    assert "does not cover" in str(found.findings[0])


@pytest.mark.parametrize("what", ["over", "hole", "outline"])
def test_a_twin_that_differs_is_found(job, what):
    def spoil(pieces):
        twin = make_twin(pieces)
        if what == "over":
            twin["stations"][0]["over"] = not twin["stations"][0]["over"]
        elif what == "hole":
            drilled = next(s for s in twin["stations"] if s["hole_mm"] is not None)
            drilled["hole_mm"] += 0.5
        else:
            twin["outline"][0][0] += 0.4
            twin["outline"][0][1] += 0.4

    assert not respoken(job("octahedron"), spoil).ok


def test_pieces_without_a_kind_are_malformed(job):
    folder = job("octahedron")
    path = folder / "crossing_map.json"
    plan = json.loads(path.read_text())
    del plan["pieces"][0]["kind"]
    path.write_text(json.dumps(plan))
    assert not verify_job(folder).ok
