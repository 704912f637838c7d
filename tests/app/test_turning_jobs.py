"""Jobs whose threads turn back at the boundary are made and proved from their files."""

import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np
import pytest
from jobs import run
from meshes_shared import shared_mesh

from fabweave.verify import verify_job
from fabweave.verify.measure.walks import read_obj, trace_walks


def words(mesh: object) -> tuple[object, ...]:
    return (mesh, "--size", "200mm", "--sheet", "600x400mm", "--effort", "quick",
            "--boundary", "turn")  # fmt: skip


def make(mesh: object, folder: Path) -> int:
    return run("make", *words(mesh), "-q", "-o", folder)


slow = pytest.mark.slow


def plan_of(folder: Path) -> dict:
    return json.loads((folder / "crossing_map.json").read_text())


@pytest.fixture(scope="module")
def mat(finished) -> Path:
    return finished(*words("shape:hypar?m=6&n=4"))


@pytest.mark.parametrize(
    ("mesh", "threads", "crossings"),
    [
        ("shape:hypar?m=2&n=2", 2, 4),
        ("shape:tube?m=5&n=1", 1, 5),
        pytest.param("shape:hypar?m=5&n=4", 1, 31, marks=slow),
        pytest.param("shape:tube?m=6&n=3", 6, 30, marks=slow),
    ],
)
def test_shapes_are_made_and_proved(mesh, threads, crossings, finished):
    folder = finished(*words(mesh))
    plan = plan_of(folder)
    assert [thread["closed"] for thread in plan["threads"]] == [True] * threads
    assert sum(len(thread["crossings"]) for thread in plan["threads"]) == 2 * crossings
    for thread in plan["threads"]:
        over = np.array(thread["over"])
        assert np.all(over != np.roll(over, 1))
    assert len(plan["joints"]) == len(plan["pieces"])  # rings only
    assert verify_job(folder).ok


@slow
def test_a_real_mesh_is_made_and_proved(finished):
    folder = finished(*words(shared_mesh("open/tubemesh.off")))
    assert len(plan_of(folder)["threads"]) == 1


@pytest.mark.slow
def test_the_settings_say_so_and_make_the_job_again(mat, tmp_path):
    settings = tomllib.loads((mat / "job.toml").read_text())
    assert settings["job"]["boundary"] == "turn"
    notes = settings["outcome"]["notes"]
    assert any("turn back at 20 boundary edges" in note for note in notes)
    assert run("make", "--config", mat / "job.toml", "-q", "-o", tmp_path / "again") == 0
    for name in ("crossing_map.json", "model.glb", "job.toml", "sheets/sheet_01.dxf"):
        assert (tmp_path / "again" / name).read_bytes() == (mat / name).read_bytes()


@pytest.mark.slow
def test_without_the_option_threads_end(mat, tmp_path):
    assert run("make", "--config", mat / "job.toml", "--boundary", "end", "-q",
               "-o", tmp_path / "end") == 0  # fmt: skip
    assert {thread["closed"] for thread in plan_of(tmp_path / "end")["threads"]} == {False}
    assert tomllib.loads((tmp_path / "end" / "job.toml").read_text())["job"]["boundary"] == "end"


@pytest.mark.parametrize("claim", ['boundary = "end"', ""])
def test_the_verifier_goes_by_the_settings(mat, claim, tmp_path):
    folder = tmp_path / "spoiled"
    shutil.copytree(mat, folder)
    text = (folder / "job.toml").read_text()
    assert 'boundary = "turn"\n' in text
    (folder / "job.toml").write_text(text.replace('boundary = "turn"', claim))
    assert verify_job(folder).failed == ("seal", "mesh-walks", "pattern", "space")


def test_maker_and_verifier_trace_the_same_turning_walks(mat):
    walks = trace_walks(read_obj(mat / "woven_mesh.obj"), turning=True)
    lengths = sorted(len(thread["crossings"]) for thread in plan_of(mat)["threads"])
    assert sorted(len(walk.passes) for walk in walks) == lengths == [38, 38]


@pytest.mark.parametrize(
    ("mesh", "code", "words"),
    [
        (
            "shape:hypar?m=3&n=1",
            1,
            r"2 faces hang on by a single edge \(faces 0, 2\).*--boundary end",
        ),
        ("shape:hypar?m=1&n=1", 1, "no threads cross"),
    ],
)
def test_what_cannot_turn_is_refused_with_what_would_help(mesh, code, words, tmp_path, capsys):
    assert make(mesh, tmp_path / "out") == code
    assert re.search(words, capsys.readouterr().err)
    assert list(tmp_path.iterdir()) == []


def test_a_face_by_itself_is_left_out_and_named(tmp_path):
    # Two meshes in one: a mat of two by two squares, and a square by itself.
    points = [(x, y, 0) for y in range(3) for x in range(3)]
    points += [(x + 5, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    faces = [(1, 2, 5, 4), (2, 3, 6, 5), (4, 5, 8, 7), (5, 6, 9, 8), (10, 11, 12, 13)]
    lines = [f"v {x} {y} {z}" for x, y, z in points]
    lines += ["f " + " ".join(map(str, face)) for face in faces]
    mesh = tmp_path / "two.obj"
    mesh.write_text("\n".join(lines) + "\n")
    assert make(mesh, tmp_path / "out") == 0
    assert [len(thread["crossings"]) for thread in plan_of(tmp_path / "out")["threads"]] == [
        4,
        4,
        0,
    ]
    notes = tomllib.loads((tmp_path / "out" / "job.toml").read_text())["outcome"]["notes"]
    assert any(note.startswith("1 thread runs round a face") for note in notes)
