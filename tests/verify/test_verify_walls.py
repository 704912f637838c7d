"""What was taken of a thin wall is held to the faces that were given."""

import pytest
from mesh_writers import write_mesh
from sealing import told, verify_job
from spoiling import edit_text
from walled_meshes import revolved

import fabweave as fw
from fabweave.mesh.io.files import read_mesh
from fabweave.options.settings import settings_from_job

pytestmark = pytest.mark.usefixtures("quick_jobs")


def made(folder, mesh, size="300mm", **options):
    """Make a job of a mesh; return its folder."""
    write_mesh(folder / "model.obj", mesh)
    fw.make(
        folder / "model.obj", folder / "job", size=size, remesh="none", effort="quick", **options
    )
    return folder / "job"


def source(job):
    return str(told(job).get("source", ""))


@pytest.mark.slow
def test_the_outer_side_of_a_shade_is_proved_and_any_other_face_is_found(tmp_path):
    outer = [(40.0, 10.0 * z) for z in range(7)]
    inner = [(38.0, 10.0 * z) for z in range(6, -1, -1)]
    job = made(tmp_path, revolved([*outer, *inner, outer[0]], 12))
    assert read_mesh(job / "woven_mesh.obj").mesh.n_faces == 6 * 12
    check = next(one for one in verify_job(job).checks if one.name == "source")
    assert (told(job), check.ok, check.count > 5) == ({}, True, True)
    text = (job / "job.toml").read_text()
    edit_text(job / "job.toml", r"scale = [0-9.]+", "scale = 3.0")
    assert "72 faces are not as they were given" in source(job)
    # Cut along a rim they might be parts of given faces, but these are elsewhere.
    edit_text(job / "job.toml", r"cut = 0", "cut = 1")
    assert "mm off those that were given" in source(job)
    (job / "job.toml").write_text(text)
    edit_text(job / "job.toml", r"(?s)\[outcome.taken\].*?added = 0\n", "")
    assert "the number of its faces" in source(job)


@pytest.mark.slow
def test_a_crack_that_was_closed_is_proved(tmp_path):
    job = made(tmp_path, revolved([(0.15, 0), (30, 0), (30, 60), (0, 60)], 5), "800mm", force=True)
    assert told(job) == {}
    edit_text(job / "job.toml", "added = [0-9]+", "added = 1")
    assert "were added" in source(job)


def test_a_job_from_before_keeps_both_sides(tmp_path):
    job, asked = tmp_path / "job.toml", tmp_path / "asked.toml"
    asked.write_text('[job]\nmesh = "shape:cube"\n')
    job.write_text(asked.read_text() + "[outcome]\n")
    assert [settings_from_job(path).mesh.walls for path in (job, asked)] == ["both", "auto"]
