"""Settings that nobody can mean get one message, quickly and without a warning."""

import tomllib

import numpy as np
import pytest
import trimesh

from fabweave.app.settings import Settings, job_toml
from fabweave.cli.main import main
from fabweave.core.errors import InputError


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--seed", "-5"), "'--seed': -5 is not a whole number from 0 to"),
        (("--seed", str(2**63)), "is not a whole number from 0 to"),
        (("--size", "1e300mm"), "'1e300mm' is not a length from 0.01 to 1000000 mm"),
        (("--size", "1e-300mm"), "'1e-300mm' is not a length from 0.01 to 1000000 mm"),
        (("--clearance", "1e200"), "'1e200' is not a length from 0.001 to 100 mm, or 0"),
        (("--thickness", "warp=0.4,weft=1e9"), "'1e9' is not a length from 0.001 to 100 mm"),
        (("--width", "..1e9mm"), "width '1e9mm' is not a length from 0.001 to 20000 mm"),
        (("--max-length", "1e30"), "'1e30' is not a length from 0.001 to 1000000 mm"),
        (("--lap", "1e300"), "'1e300' is not a length from 0.001 to 20000 mm"),
        (("--margin", "1e100"), "'1e100' is not a length from 0.001 to 20000 mm, or 0"),
        (("--scale", "1e9"), "the mesh would be 1e+11 mm in size"),
    ],
)
@pytest.mark.parametrize("command", ["make", "inspect"])
def test_what_nobody_means_is_refused(command, options, words, tmp_path, capsys) -> None:
    folder = ("-o", str(tmp_path / "out"), "-q") if command == "make" else ()
    with pytest.raises(SystemExit) as stop:
        main([command, "shape:torus", *options, *folder])
    assert stop.value.code == 2
    error = " ".join(capsys.readouterr().err.split())
    assert words in error
    assert "Traceback" not in error
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--stock", "no/such/stock.toml"), "cannot read the stock in no/such/stock.toml"),
        (("--rotations", "45"), "rotations '45' must be auto, free, 90, 180, or grain"),
    ],
)
def test_stock_and_angles_that_mean_nothing_are_wrong_usage(options, words, capsys) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["inspect", "shape:torus", *options])
    assert stop.value.code == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_the_largest_seed_comes_back_from_toml() -> None:
    settings = Settings("shape:cube", seed=2**63 - 1)
    assert tomllib.loads(job_toml(settings, {}))["job"]["seed"] == 2**63 - 1
    with pytest.raises(InputError, match=r"seed: .* is not a whole number from 0 to"):
        Settings("shape:cube", seed=2**63)


# z is in every other test
@pytest.mark.parametrize("up", ["y", pytest.param("x", marks=pytest.mark.slow)])
def test_the_axis_that_points_up_becomes_z_in_every_file(up, tmp_path, capsys) -> None:
    # Of a box, the axis that is said to point up can be told by its length.
    corners = [[x, y, z] for x in (0, 10) for y in (0, 20) for z in (0, 40)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    lines = [*(f"v {x} {y} {z}" for x, y, z in corners)]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    command = ("make", str(tmp_path / "box.obj"), "--size", "200mm", "--up", up)
    main([*command, "--effort", "quick", "-q", "-o", str(tmp_path / "job")])
    assert tomllib.loads((tmp_path / "job" / "job.toml").read_text())["job"]["up"] == up
    told = trimesh.load(tmp_path / "job" / "woven_mesh.obj", process=False)
    expected = {"z": (50, 100, 200), "y": (50, 200, 100), "x": (100, 200, 50)}[up]
    assert np.ptp(told.vertices, axis=0) == pytest.approx(expected)
    # The model stands as the mesh does, and it was turned, not mirrored: verify has passed.
    model = trimesh.load_scene(tmp_path / "job" / "model.glb")
    assert np.argsort(model.extents).tolist() == np.argsort(expected).tolist()
    capsys.readouterr()
