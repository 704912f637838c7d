"""The command model: every format, yarns and pictures, and mistakes that leave nothing."""

import json

import numpy as np
import pytest
import trimesh
from jobs import run
from PIL import Image
from slow import slow_but

TORUS = "shape:torus?m=8&n=6"


def model(path, *options: object) -> int:
    return run("model", TORUS, "--size", "120mm", *options, "-q", "-o", path)


@pytest.mark.parametrize("yarn", [(), ("--yarn", "--sides", 6)], ids=["ribbons", "yarns"])
@pytest.mark.parametrize("suffix", [*slow_but(["glb", "obj", "ply", "stl", "3mf", "png"], 0, 4)])
def test_every_format_is_written(suffix, yarn, tmp_path):
    path = tmp_path / f"object.{suffix}"
    assert model(path, *yarn) == 0
    assert [found.name for found in tmp_path.iterdir()] == [path.name]
    if suffix in ("stl", "3mf"):
        scene = trimesh.load_scene(path)
        assert all(mesh.is_watertight for mesh in scene.geometry.values())
        # The torus is 120 mm across; what lies on it stands out or back a little.
        assert np.abs(np.ptp(scene.bounds, axis=0)[:2] - 120.0).max() < 12.0
    if suffix == "glb":
        assert np.abs(np.ptp(trimesh.load_scene(path).bounds, axis=0)[:2] - 0.120).max() < 0.012


@pytest.mark.slow
def test_a_model_is_that_of_the_job_but_for_the_room_of_laps(finished, tmp_path):
    assert model(tmp_path / "model.glb") == 0
    drawn = ("--sheet", "600x400mm", "--effort", "quick", "--as-drawn", "off")
    job = finished(TORUS, "--size", "120mm", *drawn)
    ours, jobs = (trimesh.load_scene(path) for path in (tmp_path / "model.glb", job / "model.glb"))
    # A job's model marks what was found, too.
    assert set(ours.geometry) == {name for name in jobs.geometry if "finding" not in name}
    for label, mesh in ours.geometry.items():
        other = jobs.geometry[label]
        assert np.array_equal(mesh.faces, other.faces)
        assert np.array_equal(mesh.visual.material.main_color, other.visual.material.main_color)
        assert np.abs(mesh.vertices - other.vertices).max() < 0.001  # a millimetre


@pytest.mark.slow
@pytest.mark.parametrize("what", ["twists", "faults"])
def test_the_weave_is_shown_on_its_mesh(what, tmp_path, capsys):
    path = tmp_path / "a.png"
    assert model(path, "--show", what, "--pattern", "twill", "--json") == 0
    assert json.loads(capsys.readouterr().out)["kind"] == what
    with Image.open(path) as picture:
        assert picture.width >= 1000
        red, _, blue = np.moveaxis(np.asarray(picture).astype(int), -1, 0)
    assert np.count_nonzero(blue > red + 80) > 300
    assert np.count_nonzero(red > blue + 80) > 300


@pytest.mark.parametrize(
    ("name", "options", "code"),
    [
        ("object.dwg", "", 2),
        ("object", "", 2),
        ("nowhere/object.glb", "", 2),
        ("object.stl", "--yarn-radius 40mm", 1),
        ("object.stl", "--yarn --sides 2", 2),
        ("object.png", "--view up", 2),
        ("object.png", "--view 0,100", 2),
        ("object.glb", "--pattern tartan", 2),
        ("object.glb", "--show twists", 2),
        ("object.png", "--show faults --yarn", 2),
        ("object.png", "--show nothing", 2),
        ("object.png", "--colours piece", 2),
    ],
)
def test_mistakes_get_one_message_and_leave_the_older_file(name, options, code, tmp_path, capsys):
    older = tmp_path / name
    if older.parent.is_dir():
        older.write_bytes(b"older")
    assert model(older, *options.split()) == code
    error = capsys.readouterr().err
    assert "Traceback" not in error
    assert [path.read_bytes() for path in tmp_path.iterdir()] in ([], [b"older"])
