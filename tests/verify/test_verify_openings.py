"""What was left out of the woven mesh is held to what the settings and job.toml say."""

import shutil

import pytest
from jobs import OCTAHEDRON
from mesh_writers import write_mesh
from sealing import told, verify_job
from spoiling import edit_text

import fabweave as fw
from fabweave.mesh.shapes.catalogue import parse_shape

pytestmark = pytest.mark.usefixtures("quick_jobs")

LAMP = (
    "shape:sphere?n=3", "--size", "150mm", "--leave-out", "top:60mm,0", "--boundary", "turn",
    "--effort", "quick",
)  # fmt: skip


@pytest.fixture
def lamp(finished, tmp_path):
    """Return a copy of a lamp with a hole at its top, and a face less."""
    return finished.copy(tmp_path / "job", *LAMP)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("top:60mm,0", "top:50mm,0", "diameter_mm is 60, but should be 50"),
        ("top:60mm,0", "bottom:60mm,0", "what was left out, by side, is"),
        ("top:60mm,0", "top:60mm,0,1", "faces is 1, but should be 2"),
        ('leave_out = ".*"\n', "", "what was left out, by side, is"),
        ("diameter_mm = 60.0", "diameter_mm = 61.0", "diameter_mm is 61, but should be 60"),
        ("x_mm = 0.0", "x_mm = 1.0", "no boundary of the mesh has"),
        ("rim = 4", "rim = 5", "no boundary of the mesh has 5 vertices within"),
        ("rim = 4", "rim = 'four'", "no boundary of the mesh has nan"),
        (r'\[\[outcome.openings\]\]\nside = "faces"\nfaces = 1\n', "", "left out, by side"),
    ],
)
def test_another_opening_is_found(lamp, old, new, words):
    edit_text(lamp / "job.toml", old, new)
    assert words in str(told(lamp)["source"])


@pytest.mark.slow
def test_a_true_opening_passes_and_the_hole_is_there(lamp):
    assert told(lamp) == {}


@pytest.mark.slow
def test_faces_that_were_left_out_of_a_file_are_known(tmp_path):
    ball = tmp_path / "ball.obj"
    write_mesh(ball, parse_shape("shape:sphere?n=3"))
    options = {"size": "150mm", "effort": "quick", "leave_out": "bottom:60mm,0"}
    fw.make(ball, tmp_path / "job", **options)
    source = next(check for check in verify_job(tmp_path / "job").checks if check.name == "source")
    # 54 faces without two; the size, their number, and what is told of either opening.
    assert source.findings == ()
    assert source.count >= 52 + 2
    for leave_out, words in (
        ("bottom:60mm,1", "faces are not as in ball.obj"),
        ("top:60mm,0", "by side"),
    ):
        again = shutil.copytree(tmp_path / "job", tmp_path / leave_out[:3])
        edit_text(again / "job.toml", "bottom:60mm,0", leave_out)
        assert words in str(told(again)["source"])


@pytest.mark.slow
def test_what_nobody_left_out_is_not_told(finished, tmp_path):
    folder = finished.copy(tmp_path / "job", *OCTAHEDRON)
    with (folder / "job.toml").open("a") as file:
        file.write('[[outcome.openings]]\nside = "top"\nfaces = 1\n')
    assert "what was left out, by side, is ['top']" in str(told(folder)["source"])
