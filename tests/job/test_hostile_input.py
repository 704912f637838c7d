"""Whatever an input file holds, what comes of it is a mesh, or an error of ours.

    FABWEAVE_FUZZ=1000 pytest tests/app/test_hostile_input.py

spoils each kind of file in a thousand ways in place of forty.
"""

import os

import numpy as np
import pytest
from spoilt_input import Kinds, try_one

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings, settings_from_job, settings_from_options

pytestmark = pytest.mark.usefixtures("quick_jobs")

NAMES = (
    "binary.ply", "box.3mf", "box.glb", "box.gltf", "box.stl", "crossing_map.json",
    "cube.obj", "cube.off", "cube.ply", "job.toml", "layout", "materials.toml", "offcut.dxf",
    "preset.toml", "ribbons.json", "stock.toml", "targets.toml", "text.stl",
)  # fmt: skip


@pytest.fixture(scope="module")
def kinds(tmp_path_factory):
    return Kinds(tmp_path_factory.mktemp("sound"))


def test_the_sound_files_are_read(kinds, tmp_path):
    assert set(kinds.readers()) == set(NAMES)
    kinds.lay_out(tmp_path)
    kinds.require_sound(tmp_path)


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("name", NAMES)
def test_spoilt_files_are_read_or_refused(name, kinds, tmp_path):
    kinds.lay_out(tmp_path)
    reader = kinds.readers()[name]
    seeds = set(range(int(os.environ.get("FABWEAVE_FUZZ", "40"))))
    # These found faults.
    seeds |= {1160, 1280} if name == "job.toml" else set()
    outcomes = {seed: try_one(reader, tmp_path, f"{name} {20_000 + seed}") for seed in seeds}
    assert {seed: told for seed, told in outcomes.items() if told not in ("read", "refused")} == {}


LENGTHS = (
    "size", "thickness", "clearance", "max_length", "margin", "gap", "hairline",
    "kerf",
)  # fmt: skip


@pytest.mark.parametrize("name", LENGTHS)
@pytest.mark.parametrize("value", [1e300, "1e300mm", 1e-300, 10**400, "-5mm"])
def test_lengths_that_nobody_means_are_refused_wherever_they_are_said(name, value, tmp_path):
    place = rf"{name}(_mm)?: "
    with pytest.raises(InputError, match=place):
        settings_from_options("shape:cube", **{name: value})
    if not isinstance(value, str):
        with pytest.raises(InputError, match=place):
            Settings.of("shape:cube", **{f"{name}_mm": value})
        value = "1e300mm"
    job = tmp_path / "job.toml"
    job.write_text(f'[job]\nmesh = "shape:cube"\n{name} = "{value}"\n')
    with pytest.raises(InputError, match=rf"job\.toml, {place}"):
        settings_from_job(job)


def test_names_that_are_not_utf_8_are_refused_before_the_work():
    with pytest.raises(InputError, match=r"mesh: the name 'm\\udcff.obj' is not in UTF-8"):
        settings_from_options("m\udcff.obj")


def test_a_face_of_very_many_corners_is_refused(tmp_path):
    # Around a circle, with a point above: read in linear time, and then refused.
    count = 50_000
    angle = np.arange(count) * (2 * np.pi / count)
    rows = [f"v {x} {y} 0" for x, y in zip(np.cos(angle), np.sin(angle), strict=True)]
    rows += ["v 0 0 1", "f " + " ".join(map(str, range(count, 0, -1)))]
    rows += [f"f {at + 1} {(at + 1) % count + 1} {count + 1}" for at in range(count)]
    (tmp_path / "cone.obj").write_text("\n".join(rows))
    settings = settings_from_options(str(tmp_path / "cone.obj"), size=300)
    with pytest.raises(InputError, match=r"1 face has more than 2000 corners \(face 0 has 50000\)"):
        _ = Stations(settings).loaded


def test_a_drawing_that_is_cut_off_is_not_taken_for_a_smaller_one(kinds, tmp_path, capfd):
    whole = (kinds.folder / "offcut.dxf").read_bytes()
    (tmp_path / "stock.toml").write_text('[[offcut]]\noutline = "part.dxf"\n')
    for share in range(1, 20):
        (tmp_path / "part.dxf").write_bytes(whole[: len(whole) * share // 20])
        with pytest.raises(InputError, match="it does not end with EOF as DXF files do"):
            settings_from_options("shape:cube", stock=tmp_path / "stock.toml")
    assert capfd.readouterr().err == ""
