"""A remeshed job has a picture of what its model lost; any other has none."""

import shutil

import pytest
from jobs import OCTAHEDRON

from fabweave.verify import verify_job

REMESHED = (
    "shape:sphere?n=6&radius=60", "--remesh", "triangles:60", "--effort", "quick", "--force",
)  # fmt: skip


@pytest.fixture
def remeshed(finished, tmp_path):
    """Return a copy of a remeshed job."""
    return shutil.copytree(finished(*REMESHED), tmp_path / "job")


def told(folder):
    return {check.name: check.findings for check in verify_job(folder).checks if not check.ok}


@pytest.mark.slow
def test_the_picture_is_there_and_is_told(remeshed):
    assert told(remeshed) == {}
    assert '<img src="likeness.png"' in (remeshed / "waste.html").read_text("utf-8")
    assert "likeness.png" in (remeshed / "contents.json").read_text("utf-8")
    assert "likeness_mm = " in (remeshed / "job.toml").read_text("utf-8")


@pytest.mark.slow
def test_a_picture_that_is_gone_or_broken_is_a_finding(remeshed):
    picture = remeshed / "likeness.png"
    picture.write_bytes(picture.read_bytes()[:-300])
    assert "likeness.png" in str(told(remeshed)["files"])
    picture.unlink()
    found = told(remeshed)
    assert set(found) == {"files"}
    assert "likeness.png is missing" in str(found["files"])


@pytest.mark.slow
@pytest.mark.parametrize("value", ["-1.0", "nan", '"far"', "[]"])
def test_a_likeness_is_a_length(remeshed, value):
    settings = remeshed / "job.toml"
    lines = settings.read_text("utf-8").split("\n")
    lines = [f"likeness_mm = {value}" if x.startswith("likeness_mm") else x for x in lines]
    settings.write_text("\n".join(lines), "utf-8")
    assert set(told(remeshed)) == {"outcome"}


@pytest.mark.slow
def test_a_mesh_as_it_comes_has_no_likeness(finished, tmp_path):
    folder = shutil.copytree(finished(*OCTAHEDRON), tmp_path / "job")
    (folder / "likeness.png").write_bytes((folder / "render.png").read_bytes())
    assert set(told(folder)) == {"files"}
    (folder / "likeness.png").unlink()
    text = (folder / "job.toml").read_text("utf-8")
    (folder / "job.toml").write_text(
        text.replace("[outcome]", "[outcome]\nlikeness_mm = 3.0"), "utf-8"
    )
    assert set(told(folder)) == {"files", "index", "outcome", "page"}
