"""The woven mesh is held to the size and to the mesh that the settings name."""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from jobs import OCTAHEDRON
from mesh_writers import write_mesh
from random_jobs import random_job
from sealing import result_of, verify_job
from slow import slow_but
from spoiling import edit_text

import fabweave as fw
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.job.stations import Stations
from fabweave.options.settings import job_toml, settings_from_options
from fabweave.verify.check.source import check_source
from fabweave.verify.read.job_files import load_job
from fabweave.verify.report import Tally

pytestmark = pytest.mark.usefixtures("quick_jobs")

#: A pyramid on a square, with a split and a loose vertex, lying on its side.
PYRAMID = """\
v 0 0 0
v 2 0 0 1.0
v 2 0 2
v 0 0 2 # a comment
v 1 3 1
v 9 9 9
v 0 0 0
f 1/1 2/2 3/3 4/4
f 5 2 7
f -3//1 -6//2 -5//3 \\

f 3 4 -3
f 1 5 4
"""


def source_findings(folder):
    check = next(check for check in verify_job(folder).checks if check.name == "source")
    return check.findings, check.count


@pytest.fixture(scope="module")
def pyramid(tmp_path_factory):
    """Return a job and the file that it was made from, both where nothing is looked for."""
    folder = tmp_path_factory.mktemp("pyramid")
    (folder / "pyramid.obj").write_text(PYRAMID)
    options = {"up": "y", "weld": "all", "size": "80mm", "effort": "quick", "sheet": "300x300mm"}
    fw.make(folder / "pyramid.obj", folder / "job", **options)
    return folder


@pytest.fixture
def copied(pyramid, tmp_path):
    """Return a copy of that job, with the mesh beside it, as settings name it."""
    folder = Path(shutil.copytree(pyramid, tmp_path / "both"))
    path = (folder / "pyramid.obj").as_posix()
    edit_text(folder / "job" / "job.toml", r'mesh = ".*"', f'mesh = "{path}"')
    return folder


def test_the_mesh_that_was_given_is_the_one_that_is_woven(copied):
    findings, count = source_findings(copied / "job")
    # The size, the number of faces, and five of them.
    assert (findings, count) == ((), 7)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("v 1 3 1", "v 1.01 3 1", "4 faces are not as in pyramid.obj, first face 1"),
        ("f 1 5 4\n", "", "the number of its faces is 5, but should be 4, as in pyramid.obj"),
        ("f 3 4 -3", "f 4 3 2", "1 faces are not as in pyramid.obj, first face 3"),
        ("v 0 0 0", "v 0 0 0.1", "faces are not as in"),
    ],
)
def test_another_mesh_is_found(copied, old, new, words):
    path = copied / "pyramid.obj"
    before = path.stat()
    assert old in PYRAMID
    path.write_text(PYRAMID.replace(old, new, 1))
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))
    findings, _ = source_findings(copied / "job")
    assert len(findings) == 1
    assert words in findings[0]


@pytest.mark.parametrize("to", ["0.01,1,0", "-y", "1,1,1"])
def test_another_direction_is_found(copied, to):
    edit_text(copied / "job" / "job.toml", 'up = "y"', f'up = "{to}"')
    assert "faces are not as in" in source_findings(copied / "job")[0][0]


def test_a_mesh_that_is_newer_than_the_job_says_nothing(copied):
    path = copied / "pyramid.obj"
    path.write_text(PYRAMID.replace("v 1 3 1", "v 1 4 1"))
    os.utime(path, (2e9, 2e9))
    assert source_findings(copied / "job") == ((), 1)


@pytest.mark.parametrize(
    "name",
    ["gone.obj", "//host/share/a.obj", "\\\\\\\\host\\\\share\\\\a.obj", "/dev/zero",
     "/dev/zero.obj", "a\\u0000.obj", "pyramid.stl"],
)  # fmt: skip
def test_a_mesh_that_is_not_at_hand_says_nothing(copied, name):
    other = 'mesh = "' + name.replace("\\", "\\\\") + '"'
    edit_text(copied / "job" / "job.toml", r'mesh = ".*"', other)
    assert source_findings(copied / "job") == ((), 1)


def test_relative_paths_begin_above_the_job(copied, tmp_path, monkeypatch):
    edit_text(copied / "job" / "job.toml", r'mesh = ".*"', 'mesh = "pyramid.obj"')
    monkeypatch.chdir(copied)
    assert source_findings(copied / "job") == ((), 7)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "pyramid.obj").write_text("v 0 0 0\nf 1 1 1\n")
    os.utime(elsewhere / "pyramid.obj", (1e9, 1e9))
    monkeypatch.chdir(elsewhere)
    assert source_findings(copied / "job") == ((), 1)


@pytest.mark.slow
def test_a_mesh_from_memory_is_kept_and_compared(tmp_path):
    vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
    faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
    mesh = fw.mesh(vertices, faces)
    fw.make(mesh, tmp_path / "job", size="90mm", effort="quick", sheet="300x300mm")
    assert source_findings(tmp_path / "job") == ((), 6)
    edit_text(tmp_path / "job" / "mesh.obj", "v 1.0 ", "v 1.1 ")
    findings, _ = source_findings(tmp_path / "job")
    # What is made is of the size that is asked for, so all faces would be smaller.
    assert "4 faces are not as in mesh.obj" in findings[0]
    (tmp_path / "job" / "mesh.obj").write_text("f 1 2 3\n")
    assert "files" in verify_job(tmp_path / "job").failed


@pytest.mark.slow
def test_another_size_is_found(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    assert source_findings(folder) == ((), 1)
    edit_text(folder / "job.toml", '"90mm"', '"91mm"')
    words = "its greatest extent is 90, but should be 91, as in job.toml"
    assert words in source_findings(folder)[0][0]


def checked(folder, **options):
    """Bring a mesh to the loom, and return what is said of it against its own settings."""
    settings = settings_from_options(options.pop("mesh"), **options)
    loaded = Stations(settings).loaded
    write_mesh(folder / "woven_mesh.obj", loaded.mesh)
    used = settings.but(up=settings.mesh.up or loaded.up)
    (folder / "job.toml").write_text(job_toml(used, {}))
    return result_of(check_source, load_job(folder, Tally("files")))


@pytest.mark.parametrize(
    "options",
    slow_but(
        [{"up": "0.2,-1,0.1", "size": "60mm"}, {"size": "25.4mm", "up": "x"}, {"weld": "all"},
         {"up": "1e-9,1e-8,-1"}, {"up": "-x"}, {"weld": "none"}, {"up": "y", "size": "1234.5mm"},
         {"bodies": "largest"}, {"bodies": "1"}, {"fair": 3, "size": "90mm"},
         {"pattern": "triaxial"}, {"refine": "catmull-clark:1"}],
        0, 2,
    ),
    ids=str,
)  # fmt: skip
def test_no_mesh_that_is_rightly_made_is_objected_to(options, tmp_path):
    tried = 0
    for seed in range(24):
        vertices, faces, _ = random_job(seed)
        dice = np.random.default_rng(seed)
        # Inside out in places, with vertices split and moved by less than what is welded.
        faces = [face[::-1] if dice.random() < 0.2 else face for face in faces]
        split = np.concatenate([vertices, np.asarray(vertices)[::2] * (1.0 + 1e-12)])
        if dice.random() < 0.5:
            faces = [
                [int(v) + 0 if v % 2 or dice.random() < 0.5 else len(vertices) + int(v) // 2
                 for v in face]
                for face in faces
            ]  # fmt: skip
        write_obj(tmp_path / "a.obj", split, faces)
        try:
            result = checked(tmp_path, mesh=str(tmp_path / "a.obj"), **options)
        except (InputError, CannotMakeError):
            continue
        tried += 1
        assert result.ok, (seed, result.findings)
    assert tried > 3


def write_obj(path, vertices, faces):
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in np.asarray(vertices).tolist()]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")
    os.utime(path, (1e9, 1e9))
