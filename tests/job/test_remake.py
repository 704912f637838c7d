"""The settings of a job give the same bytes: ``verify --remake`` proves it."""

import json
import tomllib
from pathlib import Path

import numpy as np
import pytest
from jobs import OCTAHEDRON, run
from mesh_writers import write_mesh
from spoiling import edit_text

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.job.remake import remake_job
from fabweave.mesh.shapes.catalogue import parse_shape

pytestmark = pytest.mark.usefixtures("quick_jobs")

OWN = ("--library", Path(__file__).parents[2] / "examples" / "materials.toml")
#: One job of each kind of setting that could be lost between job.toml and the files.
JOBS = {
    "plain": OCTAHEDRON,
    "drawn at random": ("shape:octahedron", "--pattern", "twill", "--seed", "7", *OCTAHEDRON[1:]),
    "turning": ("shape:hypar?m=6&n=4", "--size", "200mm", "--boundary", "turn",
                "--sheet", "600x400mm", "--effort", "quick"),
    "two materials": ("shape:torus?m=4&n=4", "--size", "260mm", "--kinds", "any", "--force",
                      "--material", "warp=wool-felt,weft=card:red", "--effort", "quick",
                      "--gap", "warp=2mm,weft=3mm", *OWN),
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [name if name == "plain" else pytest.param(name, marks=pytest.mark.slow)
             for name in JOBS]
)  # fmt: skip
def test_a_job_is_made_again(name, finished, capsys):
    assert run("verify", finished(*JOBS[name]), "--remake", "--json") == 0
    told = json.loads(capsys.readouterr().out)["remake"]
    assert told["ok"] is True
    assert {"job.toml", "contents.json", "sheets/sheet_01.dxf"} <= {*told["same"]}


@pytest.mark.slow
def test_settings_that_are_not_those_of_the_job_are_found(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    edit_text(folder / "job.toml", 'effort = "quick"', 'effort = "quick"\nkerf = "0.2mm"')
    assert run("verify", folder, "--remake", "-q") == 1


@pytest.mark.slow
def test_papers_come_again_of_the_layout_that_was_recorded(finished, monkeypatch, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    monkeypatch.setattr("fabweave.nest.pins.nest", None)  # nothing is nested
    assert remake_job(folder, nest=False).ok
    with (folder / "index.html").open("a") as page:
        page.write(" ")
    assert remake_job(folder, nest=False).differing == ("index.html",)


@pytest.mark.slow
def test_a_job_of_a_mesh_in_memory_is_made_again(tmp_path):
    mesh = parse_shape("shape:octahedron")
    points = np.where(mesh.vertices == mesh.vertices.max(), 0.33, mesh.vertices)
    uneven = fw.mesh(points, mesh.faces())
    fw.make(uneven, tmp_path / "job", size="120mm", sheet="230x225mm", effort="quick", force=True)
    assert remake_job(tmp_path / "job").ok


@pytest.mark.slow
def test_a_job_of_a_mesh_file_is_made_again_wherever_it_lies(tmp_path):
    path = tmp_path / "cow.obj"
    write_mesh(path, parse_shape("shape:octahedron"))
    assert run("make", path.resolve(), *OCTAHEDRON[1:], "-q", "-o", tmp_path / "job") == 0
    assert f'mesh = "{path.resolve()}"' in (tmp_path / "job" / "job.toml").read_text()
    assert remake_job(tmp_path / "job").ok


@pytest.mark.slow
def test_a_recorded_layout_gives_the_same_pieces_in_the_same_places(finished, tmp_path):
    first, again = finished(*OCTAHEDRON), tmp_path / "again"
    layout = ("--layout", first / "crossing_map.json", "-q")
    assert run("make", *OCTAHEDRON, *layout, "-o", again) == 0
    assert tomllib.loads((again / "job.toml").read_text())["job"]["layout"] == "crossing_map.json"
    plans = [json.loads((folder / "crossing_map.json").read_text()) for folder in (first, again)]
    assert [plan["layout"].pop("recorded") for plan in plans] == [False, True]
    assert plans[0] == plans[1]
    # Its job.toml finds the layout beside it.
    assert remake_job(again).ok
    with pytest.raises(InputError):
        fw.make(OCTAHEDRON[0], tmp_path / "no", size="88mm", layout=first / "crossing_map.json")
