"""The command line as a user meets it: proved jobs, errors that help, nothing half-done."""

import copy
import json
import re
import tomllib

import numpy as np
import pytest
import trimesh
from jobs import OCTAHEDRON, contents_of, run
from mesh_writers import write_mesh
from meshes_shared import mesh_params

from fabweave.cli.make import tell_job
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.options.settings import Settings
from fabweave.stock.sheet_size import SheetSize

pytestmark = pytest.mark.usefixtures("quick_jobs")

slow = pytest.mark.slow

MADE = (
    "job.toml", "woven_mesh.obj", "model.glb", "render.png", "crossing_map.json",
    "crossing_map.csv", "pieces.csv", "waste.json", "waste.html", "index.html", "verify.json",
    "contents.json", "ribbons.json", "stations.csv", "assembly.html", "assembly.pdf",
    "sheets/sheet_01.dxf", "sheets/sheet_01.svg", "sheets/sheet_01.png",
)  # fmt: skip

#: Small sheets are nested on sooner.
SHEET = ("--sheet", "500x350mm")


@pytest.mark.usefixtures("shipped")
def test_a_finished_job_has_every_file_and_is_proved(tmp_path, capsys):
    folder = tmp_path / "octahedron"
    assert run("make", *OCTAHEDRON, "--json", "-o", folder) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["proved"], told["threads"], told["crossings"]) == (True, 4, 12)
    assert set(MADE) <= set(contents_of(folder))
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.slow
def test_the_terminal_shows_what_matters_and_v_shows_every_note(tmp_path, capsys):
    asked = Settings.of("shape:octahedron", size_mm=90.0, fair=1, effort="quick")
    made = run_job(Stations(asked), tmp_path / "job")
    notes = made.job.notes
    assert {note.detail for note in notes} == {False, True}
    assert any(note.more for note in notes if not note.detail)
    for verbose in (False, True):
        tell_job(made, tmp_path, verbose=verbose)
        due = [note if verbose else note.text for note in notes if verbose or not note.detail]
        shown = capsys.readouterr().out.splitlines()
        assert [line.strip() for line in shown[: len(due)]] == due
        assert not any(note.text in "".join(shown[len(due) :]) for note in notes)
    for note in notes:
        assert re.fullmatch("[a-z-]+", note.rule)
        again = copy.copy(note)  # as processes do
        assert (again.rule, again.text, again.more) == (note.rule, note.text, note.more)
        assert (again, again.detail) == (note, note.detail)


@pytest.mark.slow
@pytest.mark.usefixtures("shipped")
def test_any_number_of_workers_gives_the_same_bytes(finished, tmp_path):
    sheets = (SheetSize(230.0, 225.0),)
    settings = Settings.of("shape:octahedron", size_mm=90.0, effort="quick", sheets=sheets)
    for workers in (0, 2):
        run_job(Stations(settings), tmp_path / str(workers), workers=workers)
    alone, beside = contents_of(tmp_path / "0"), contents_of(tmp_path / "2")
    assert alone == beside
    # Jobs for tests have a small picture, which the manual shows, too; nothing else differs.
    made = contents_of(finished(*OCTAHEDRON))
    differing = {name for name in made if made[name] != alone[name]}
    assert differing <= {"render.png", "assembly.pdf", "contents.json"}


#: What is typed after ``make``, and the code that it ends with: each is refused in a moment.
MISTAKES = [
    ("", 2),
    ("nowhere.obj", 2),
    ("shape:dodo", 2),
    ("shape:torus?q=3", 2),
    ("shape:cube --siz 400mm", 2),
    ("shape:cube --sheet 15x15mm", 2),
    ("shape:cube --width 0.9 --crossing 0.5", 2),
    ("shape:cube --fastener 0.3mm", 2),
    ("shape:cube --margin 1m", 2),
    ("shape:cube --kerf 9mm", 2),
    ("shape:cube --layout /dev/zero", 2),
    ("shape:torus --material warp=card", 2),
    ("shape:torus --material 0=card,1=card,2=card", 2),
    ("shape:torus --material warp=card,weft=card --thickness weft=1mm", 2),
    ("shape:torus --material warp=card,weft=card --sheet 2=600x400mm", 2),
    ("shape:torus --thickness warp=0.5mm", 2),
    ("shape:torus --sheet weft=600x400mm", 2),
    ("shape:torus --size 2mm", 1),
    ("shape:cube --size 900mm --sheet 60x60mm", 1),
    ("shape:cube --size 500mm --sheet 250x250mm:1", 1),
]


@pytest.mark.parametrize(("typed", "code"), MISTAKES)
def test_mistakes_get_one_message_and_leave_nothing(typed, code, tmp_path, capsys):
    assert run("make", *typed.split(), "-o", tmp_path / "out", "-q") == code
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.count("fabweave: ") + told.err.count("Usage: ") == 1
    assert "Traceback" not in told.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("typed", ["", "--size 400mm", "shape:cube"])
def test_where_no_folder_is_named_one_is_proposed(typed, capsys):
    assert run("make", *typed.split()) == 2
    told = capsys.readouterr().err
    assert f"-o {typed.removeprefix('shape:') if ':' in typed else 'out'}" in told
    assert "Traceback" not in told


@pytest.mark.slow
def test_a_file_name_beyond_the_font_does_not_stop_a_job(tmp_path):
    mesh = tmp_path / "vö{se.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    assert run("make", mesh, "--size", "90mm", "--sheet", "300x300mm", "--effort", "quick", "-q",
               "-o", tmp_path / "out") == 0  # fmt: skip


# The Klein bottle is cut open and woven of 562 pieces.
BAD = [one for one in mesh_params(bad=True) if one.id != "bad/klein-bottle.obj"]


@slow
@pytest.mark.parametrize("row", BAD)
def test_bad_meshes_give_a_proved_job_or_one_message(row, tmp_path, capsys):
    code = run("make", row.path, "--size", "200mm", *SHEET, "--remesh", "none", "--effort", "quick",
               "-q", "-o", tmp_path / "out")  # fmt: skip
    if code == 0:
        # A job that is not proved is not kept.
        assert (tmp_path / "out" / "verify.json").is_file()
        return
    error = capsys.readouterr().err
    assert code == (1 if row.path.stem == "nonmanifold_vertex" else 2)
    assert error.startswith("fabweave: ")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_verify_tells_what_it_proved_and_ends_with_a_code_of_its_own(finished, tmp_path, capsys):
    folder = finished.copy(tmp_path / "spoiled", *OCTAHEDRON)
    count = len(json.loads((folder / "verify.json").read_text("utf-8"))["checks"])
    assert run("verify", folder) == 0
    assert str(count) in capsys.readouterr().out.splitlines()[-1]
    plan = json.loads((folder / "crossing_map.json").read_text())
    plan["threads"][0]["over"][0] = not plan["threads"][0]["over"][0]
    (folder / "crossing_map.json").write_text(json.dumps(plan))
    assert run("verify", folder) == 1
    told = capsys.readouterr().out
    failed = [line.split()[0] for line in told.splitlines() if " FAILS " in line]
    assert {"over-under", "seal"} <= set(failed)
    assert told.splitlines()[-1].endswith(", ".join(failed))
    assert run("verify", tmp_path / "nothing") == 2


@pytest.mark.parametrize(
    ("command", "name"), [("shapes", "torus"), ("materials", "card"), ("targets", "snijlab")]
)
def test_what_there_is_is_listed(command, name, capsys):
    assert run(command) == 0
    assert name in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("up", ["y", "x", "-x", "0,0.5,1"])
def test_the_axis_that_points_up_becomes_z_in_every_file(up, tmp_path):
    # Of a box, the axis that is said to point up can be told by its length.
    cube = parse_shape("shape:cube")
    write_mesh(tmp_path / "box.obj", cube.with_vertices(cube.vertices * (1.0, 2.0, 4.0)))
    job = tmp_path / "job"
    assert run("make", tmp_path / "box.obj", "--size", "200mm", "--up", up, "--effort", "quick",
               "--remesh", "none", "--as-drawn", "off", "-o", job) == 0  # fmt: skip
    assert tomllib.loads((job / "job.toml").read_text())["job"]["up"] == up
    told = trimesh.load(job / "woven_mesh.obj", process=False)
    expected = {"y": (50, 200, 100), "x": (100, 200, 50), "-x": (100, 200, 50),
                "0,0.5,1": (200 / 20**0.5, 160, 200)}[up]  # fmt: skip
    assert np.ptp(told.vertices, axis=0) == pytest.approx(expected)
    # The model stands as the mesh does, and it was turned, not mirrored: verify has passed.
    model = trimesh.load_scene(job / "model.glb")
    assert np.argsort(model.extents).tolist() == np.argsort(expected).tolist()
