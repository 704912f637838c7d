"""Kinds are proved: what does not cover its namesake is found."""

from pathlib import Path

import numpy as np
import pytest
from replacing import replace
from sealing import found_by, verify_job
from spoiling import edit_json
from verify_writers import completed

from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.shapes.grids import torus
from fabweave.verify.check.pieces import check_unfolding
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally


def respoken(folder, change):
    def edit(plan):
        change(plan["pieces"])
        for piece in plan["pieces"]:
            del piece["path"], piece["cutouts"]
        completed(plan)

    edit_json(folder / "crossing_map.json", edit)
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


@pytest.fixture(scope="module")
def uneven(tmp_path_factory) -> Path:
    """A torus whose vertices are off by less than a ten-thousandth of its size."""
    path = tmp_path_factory.mktemp("uneven") / "torus.obj"
    mesh = torus(12, 6, 35.0, 15.0)
    noise = np.random.default_rng(5).uniform(-2e-3, 2e-3, mesh.vertices.shape)
    path.write_bytes(obj_bytes(mesh.with_vertices(mesh.vertices + noise)))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("joint", ["rivet:2", "glue"])
def test_what_differs_by_less_than_a_fastener_s_play_is_made_equal(finished, uneven, joint):
    folder = finished(str(uneven), "--size", "300mm", "--joint", joint, "--kinds", "fewest",
                      "--effort", "quick", "--sheet", "400x300mm")  # fmt: skip
    job = load_job(folder, Tally("files"))
    pieces = job.map.pieces
    assert len({piece.kind for piece in pieces}) <= len(pieces) / 4
    fitted = max(pieces, key=lambda piece: piece.fitted_mm)
    assert 0.005 < fitted.fitted_mm <= 0.04
    first = {piece.kind: piece for piece in reversed(pieces)}
    for piece in pieces:
        theirs, turned = first[piece.kind].path, piece.turned
        outline = first[piece.kind].outline
        corner = outline.max(axis=0) + outline.min(axis=0)
        same = corner - theirs[:, :2] if turned else theirs[:, :2]
        assert np.abs(piece.path[:, :2] - same).max() <= (2e-6 if turned else 0.0)

    def found(change) -> str:
        changed = tuple(change(piece) if piece is fitted else piece for piece in pieces)
        return found_by(check_unfolding, replace(job, map=replace(job.map, pieces=changed)))

    assert found(lambda piece: piece) == ""
    # No more than a fastener's play may be claimed, and no more than was claimed may be off.
    assert "fitted to others by" in found(lambda piece: replace(piece, fitted_mm=0.3))
    stations = list(fitted.stations)
    stations[0] = replace(stations[0], y=stations[0].y + 0.15)
    assert "a station stands" in found(lambda piece: replace(piece, stations=tuple(stations)))
