"""The command line as a user meets it: proved jobs, errors that help, nothing half-done."""

import csv
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from jobs import OCTAHEDRON, run
from meshes_shared import mesh_params, shared_mesh

from fabweave.app.job_folder import write_contents
from fabweave.app.mesh_source import load_mesh
from fabweave.app.pipeline import run_job
from fabweave.app.settings import Settings
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.stock.sheet_size import SheetSize


def digest(folder: Path) -> dict[str, str]:
    return {
        str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


slow = pytest.mark.slow

MADE = (
    "job.toml", "woven_mesh.obj", "model.glb", "render.png", "crossing_map.json",
    "crossing_map.csv", "pieces.csv", "waste.json", "waste.html", "index.html", "verify.json",
    "contents.json", "ribbons.json", "stations.csv", "assembly.html", "assembly.pdf",
    "sheets/sheet_01.dxf", "sheets/sheet_01.svg", "sheets/sheet_01.png",
)  # fmt: skip

#: Small sheets are nested on sooner.
SHEET = ("--sheet", "500x350mm")


@pytest.fixture(scope="module")
def octahedron(finished) -> Path:
    return finished(*OCTAHEDRON)


@pytest.mark.usefixtures("shipped")
def test_a_finished_job_has_every_file_and_is_proved(tmp_path):
    folder = tmp_path / "octahedron"
    assert run("make", *OCTAHEDRON, "-q", "-o", folder) == 0
    assert set(MADE) <= set(digest(folder))
    assert json.loads((folder / "verify.json").read_text())["ok"] is True
    assert run("verify", folder, "-q") == 0
    assert list(tmp_path.iterdir()) == [folder]


def test_the_octahedron_has_four_rings_of_six_crossings(octahedron):
    plan = json.loads((octahedron / "crossing_map.json").read_text())
    assert plan["schema"] == "fabweave.crossing-map/1"
    assert [len(thread["crossings"]) for thread in plan["threads"]] == [6] * 4
    assert len(plan["crossings"]) == 12
    assert all(len(thread["pieces"]) >= 2 for thread in plan["threads"])
    rows = list(csv.DictReader((octahedron / "pieces.csv").read_text().splitlines()))
    assert [row["id"] for row in rows] == [piece["id"] for piece in plan["pieces"]]


@pytest.mark.parametrize(
    "shape",
    [
        "hypar?m=5&n=5",
        pytest.param("tetrahedron", marks=slow),
        pytest.param("tube?m=8&n=4", marks=slow),
        pytest.param("sphere?n=2", marks=slow),
    ],
)
def test_shapes_are_made_and_proved(shape, finished):
    folder = finished(f"shape:{shape}", "--size", "200mm", *SHEET, "--effort", "quick")
    assert run("verify", folder, "-q") == 0


def test_same_settings_give_the_same_bytes(octahedron, tmp_path):
    assert run("make", *OCTAHEDRON, "-q", "-o", tmp_path / "again") == 0
    assert digest(tmp_path / "again") == digest(octahedron)


@pytest.mark.slow
@pytest.mark.usefixtures("shipped")
def test_any_number_of_workers_gives_the_same_bytes(octahedron, tmp_path):
    sheets = (SheetSize(230.0, 225.0),)
    settings = Settings(mesh="shape:octahedron", size_mm=90.0, effort="quick", sheets=sheets)
    for workers in (0, 2):
        run_job(settings, tmp_path / str(workers), workers=workers)
    alone, beside = digest(tmp_path / "0"), digest(tmp_path / "2")
    assert alone == beside
    # Jobs for tests have a small picture, which the manual shows, too; nothing else differs.
    differing = {name for name, one in digest(octahedron).items() if one != alone[name]}
    assert differing == {"render.png", "assembly.pdf", "contents.json"}


def test_job_toml_makes_the_same_job_again(octahedron, tmp_path):
    assert run("make", "--config", octahedron / "job.toml", "-q", "-o", tmp_path / "again") == 0
    ours, again = digest(octahedron), digest(tmp_path / "again")
    assert again == ours
    options = tomllib.loads((octahedron / "job.toml").read_text())["job"]
    assert options["size"] == "90mm"
    assert options["material"] == "card"


def test_typed_options_win_over_the_config(octahedron, tmp_path):
    folder = tmp_path / "again"
    assert run("make", "--config", octahedron / "job.toml", "--size", "80mm", "-q",
               "-o", folder) == 0  # fmt: skip
    assert tomllib.loads((folder / "job.toml").read_text())["job"]["size"] == "80mm"


def test_an_older_job_is_replaced_and_nothing_else_is(octahedron, tmp_path, capsys):
    folder = tmp_path / "out"
    shutil.copytree(octahedron, folder)
    # What only the older job has goes.
    (folder / "sheets" / "sheet_02.dxf").write_text("older")
    (folder / "job.toml").write_text("older")
    write_contents(folder)
    assert run("make", *OCTAHEDRON, "-q", "-o", folder) == 0
    assert digest(folder) == digest(octahedron)
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "diary.txt").write_text("dear diary")
    assert run("make", *OCTAHEDRON, "-q", "-o", mine) == 2
    assert "diary.txt" in capsys.readouterr().err
    assert [path.name for path in mine.iterdir()] == ["diary.txt"]


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["make", "nowhere.obj"], 2, "nowhere.obj"),
        (["make", "shape:dodo"], 2, "torus"),
        (["make", "shape:torus?q=3"], 2, "m, n"),
        (["make", "shape:cube", "--size", "12 furlongs"], 2, "unit"),
        (["make", "shape:cube", "--size", "-3mm"], 2, "positive"),
        (["make", "shape:cube", "--size", "100", "--scale", "2"], 2, "scale"),
        (["make", "shape:cube", "--material", "marble"], 2, "card"),
        (["make", "shape:cube", "--sheet", "600"], 2, "600"),
        (["make", "shape:cube", "--sheet", "15x15mm"], 2, "margin"),
        (["make", "shape:cube", "--width", "0.9", "--crossing", "0.5"], 2, "width"),
        (["make", "shape:cube", "--hole", "0.3mm"], 2, "too small"),
        (["make", "shape:cube", "--pattern", "tartan"], 2, "plain"),
        (["make"], 2, "no mesh"),
        (["make", "shape:torus", "--size", "2mm"], 1, "a coarser mesh"),
        (["make", "shape:cube", "--size", "900mm", "--sheet", "60x60mm"], 1, "--sheet"),
        (["make", "shape:cube", "--size", "500mm", "--sheet", "250x250mm:1"], 1, "sheet"),
    ],
)
def test_mistakes_get_one_clear_message_and_leave_nothing(arguments, code, words, tmp_path, capsys):
    target = ["-o", str(tmp_path / "out"), "-q"]
    assert run(*arguments, *target) == code
    error = capsys.readouterr().err
    assert words in error
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


def test_a_file_name_beyond_the_font_does_not_stop_a_job(tmp_path):
    mesh = tmp_path / "vö{se.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    assert run("make", mesh, "--size", "90mm", "--sheet", "300x300mm", "--effort", "quick", "-q",
               "-o", tmp_path / "out") == 0  # fmt: skip


# The Klein bottle is cut open and woven of 562 pieces: `inspect` tells enough of it, below.
BAD = [one for one in mesh_params(bad=True) if one.id != "bad/klein-bottle.obj"]


@slow
@pytest.mark.parametrize("row", BAD)
def test_bad_meshes_give_a_proved_job_or_one_message(row, tmp_path, capsys):
    code = run("make", row.path, "--size", "200mm", *SHEET, "--effort", "quick", "-q",
               "-o", tmp_path / "out")  # fmt: skip
    if code == 0:
        # A job that is not proved is not kept.
        assert (tmp_path / "out" / "verify.json").is_file()
        return
    error = capsys.readouterr().err
    assert code == (1 if row.path.stem == "nonmanifold_vertex" else 2)
    assert error.startswith("fabweave: ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bad/nonoriented_edge.obj", ["1 face was inside out", "keeps its coordinates"]),
        ("bad/klein-bottle.obj", ["240 pairs of faces", "136 boundary vertices", "genus 0"]),
        ("ngon/platonic_shelf.obj", ["5 bodies", "closed", "states no unit"]),
    ],
)
def test_notes_say_what_the_mesh_is(name, words):
    notes = "\n".join(load_mesh(Settings(mesh=str(shared_mesh(name)))).notes)
    for word in words:
        assert word in notes


def test_verify_objects_to_a_spoiled_job(octahedron, tmp_path, capsys):
    folder = tmp_path / "spoiled"
    shutil.copytree(octahedron, folder)
    plan = json.loads((folder / "crossing_map.json").read_text())
    plan["threads"][0]["over"][0] = not plan["threads"][0]["over"][0]
    (folder / "crossing_map.json").write_text(json.dumps(plan))
    assert run("verify", folder) == 1
    assert "over-under" in capsys.readouterr().out
    assert run("verify", tmp_path / "nothing") == 2


def test_json_says_what_was_made(tmp_path, capsys):
    assert run("make", *OCTAHEDRON, "--json", "-o", tmp_path / "out") == 0
    told = json.loads(capsys.readouterr().out)
    assert told["proved"] is True
    assert (told["threads"], told["crossings"]) == (4, 12)


def test_lists_and_help(capsys):
    for command, word in (("shapes", "torus"), ("materials", "card")):
        assert run(command) == 0
        assert word in capsys.readouterr().out
    for command in ("make", "verify"):
        assert run(command, "--help") == 0
        assert "Usage" in capsys.readouterr().out


#: Runs the command line, and waits to be interrupted when it tells of a stage for the so-manieth
#: time. Where tests run in the background of a shell, children are told to ignore the signal.
WAITING = """\
import faulthandler, signal, sys, time
faulthandler.dump_traceback_later(250, exit=True)  # tells where it hangs, should it ever
signal.signal(signal.SIGINT, signal.default_int_handler)
import fabweave.cli.main, fabweave.app.pipeline as pipeline
stage, times = sys.argv[1], int(sys.argv[2])
real = pipeline.run_job
def waiting(settings, directory, progress, **rest):
    def aloud(what, *counts):
        global times
        progress(what, *counts)
        times -= what == stage
        if what == stage and not times:
            print("so far", flush=True)
            # In short naps: a signal that comes just before one begins does not end it.
            for _ in range(1000):
                time.sleep(0.1)
    return real(settings, directory, aloud, **rest)
pipeline.run_job = waiting
fabweave.cli.main.main(sys.argv[3:])
"""


@contextmanager
def finally_killed(process):
    """Leave no process of that group behind, however the block ends."""
    try:
        yield
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends a POSIX signal")
@pytest.mark.parametrize(
    ("stage", "times"),
    [
        # While processes that help begin to start: they are not to say anything.
        ("nesting", 1),
        # When a folder for the new job is there, and half full.
        ("files", 2),
    ],
)
def test_an_interrupted_run_leaves_the_older_job_alone(octahedron, stage, times, tmp_path):
    folder = tmp_path / "out"
    shutil.copytree(octahedron, folder)
    before = digest(folder)
    process = subprocess.Popen(
        [sys.executable, "-c", WAITING, stage, str(times), "make", *OCTAHEDRON, "-q", "-o", folder],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    with process, finally_killed(process):
        assert process.stdout.readline() == b"so far\n"
        if stage == "files":
            (new,) = tmp_path.glob(".out.*/new")
            assert (new / "crossing_map.json").is_file()
        time.sleep(0.5 if stage == "nesting" else 0.0)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does it: all of them
        _, error = process.communicate(timeout=300)
    assert process.returncode == 130
    assert error.strip() == b"stopped; nothing was written"
    assert digest(folder) == before
    assert list(tmp_path.iterdir()) == [folder]


def test_verify_says_at_last_how_many_checks_passed_or_which_did_not(octahedron, tmp_path, capsys):
    assert run("verify", octahedron) == 0
    told = capsys.readouterr().out
    count = len(json.loads((octahedron / "verify.json").read_text("utf-8"))["checks"])
    assert told.splitlines()[-1] == f"all {count} checks passed"
    spoilt = tmp_path / "spoilt"
    shutil.copytree(octahedron, spoilt)
    (spoilt / "verdict.json").write_text("{}")
    assert run("verify", spoilt) == 1
    told = capsys.readouterr().out
    failed = [line.split()[0] for line in told.splitlines() if " FAILS " in line]
    assert failed == ["seal"]
    last = f"{len(failed)} of {count} checks failed: {', '.join(failed)}"
    assert told.splitlines()[-1] == last
