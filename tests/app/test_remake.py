"""The settings of a job give the same bytes: verify --remake proves it."""

import json
import re

import numpy as np
import pytest
from jobs import OCTAHEDRON, run

import fabweave as fw
from fabweave.app.remake import remake_job
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape


def test_a_job_is_made_again(finished, capsys):
    assert run("verify", finished(*OCTAHEDRON), "--remake", "--json") == 0
    told = json.loads(capsys.readouterr().out)["remake"]
    assert told["ok"] is True
    assert {"job.toml", "contents.json", "sheets/sheet_01.dxf"} <= {*told["same"]}


@pytest.mark.parametrize(
    ("setting", "other"),
    [('size = "90mm"', 'size = "88mm"'), ('effort = "quick"', 'effort = "quick"\nkerf = "0.2mm"')],
)
def test_settings_that_are_not_those_of_the_job_are_found(
    finished, tmp_path, setting, other, capsys
):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    text = (folder / "job.toml").read_text()
    assert setting in text
    (folder / "job.toml").write_text(text.replace(setting, other))
    assert run("verify", folder, "--remake") == 1
    said = re.sub(r"\s+", " ", capsys.readouterr().out)
    assert "remake: not the same job: " in said
    assert "job.toml" in said


def test_a_job_of_a_mesh_in_memory_is_made_again(tmp_path):
    points = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1.1, 0], [0, -1, 0], [0, 0, 1 / 3], [0, 0, -1]])
    faces = [[a, b, c] for a, b, c in ((0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5),
                                       (1, 2, 5), (3, 1, 5), (0, 3, 5))]  # fmt: skip
    mesh = fw.mesh(points, faces)
    fw.make(mesh, tmp_path / "job", size="90mm", sheet="230x225mm", effort="quick")
    again = remake_job(tmp_path / "job")
    assert again.ok, again


def test_a_job_of_a_mesh_file_is_made_again_wherever_it_lies(tmp_path):
    path = tmp_path / "cow.obj"
    write_mesh(path, parse_shape("shape:octahedron"))
    options = ("--size", "90mm", "--sheet", "230x225mm", "--effort", "quick", "-q")
    assert run("make", path.resolve(), *options, "-o", tmp_path / "job") == 0
    assert f'mesh = "{path.resolve()}"' in (tmp_path / "job" / "job.toml").read_text()
    again = remake_job(tmp_path / "job")
    assert again.ok, again
