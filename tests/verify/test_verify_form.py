"""What is told of a form agrees with its record, plan and model; what is spoilt is found."""

import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sealing import told
from spoiling import edit_json

from fabweave.verify.check.form import CUT_MM, _panels_flat, nearest
from fabweave.verify.read.glb import Strip


def test_the_nearest_is_found_in_space():
    random = np.random.default_rng(4)
    places = random.normal(size=(7, 3))
    turned = Rotation.from_rotvec([0.3, -1.0, 2.0]).apply(places) + np.array([4.0, 5.0, 6.0])
    assert nearest(turned, places) == pytest.approx(places, abs=1e-9)


LOADED = ("shape:tube?m=8&n=4", "--size", "200mm", "--load", "20g@top", "--effort", "quick")


@pytest.fixture
def loaded(finished, tmp_path):
    return finished.copy(tmp_path / "job", *LOADED)


def state(document, name):
    return next(one for one in document["states"] if one["name"] == name)


@pytest.mark.slow
def test_what_is_made_is_true(loaded):
    assert told(loaded) == {}


def shift(name, millimetres, axis=2):
    def change(document):
        for row in state(document, name)["bodies"][5:]:
            row[axis] += millimetres

    return change


SPOILT = [
    (shift("let go", 1.0), "settles_mm is"),
    (shift("let go", -0.4, 0), "mean_mm is"),
    (shift("standing", 0.5), "sags_mm is"),
    (lambda d: state(d, "loaded").update(bodies=state(d, "standing")["bodies"]), "loaded_mm is"),
    (lambda d: d["states"].pop(), "the states"),
    (lambda d: d["held"].clear(), "nothing holds"),
    (lambda d: state(d, "let go")["bodies"].pop(), "one row for each"),
    (lambda d: state(d, "let go").update(settled=False), "came to rest"),
    (lambda d: d.update(strips_mm=d["strips_mm"] + 0.02), "strips_mm is"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("change", "words"), SPOILT)
def test_another_state_is_found(loaded, change, words):
    edit_json(loaded / "form.json", change)
    assert words in str(told(loaded)["form"])


@pytest.mark.slow
@pytest.mark.parametrize("key", ["settles_mm", "mean_mm", "sags_mm", "loaded_mm"])
def test_another_distance_is_found(loaded, key):
    edit_json(loaded / "verdict.json", lambda d: d["form"].update({key: d["form"][key] + 0.05}))
    assert key in str(told(loaded)["form"])


@pytest.mark.slow
def test_a_collapse_that_is_not_told_is_found_and_one_that_is_not(loaded):
    """No number is told of what collapses, and only of that; and it cannot be built."""
    edit_json(loaded / "verdict.json", lambda d: d["form"].update(sags_mm=None))
    assert "sags_mm is not told" in str(told(loaded)["form"])
    edit_json(loaded / "verdict.json", lambda d: d["form"].update(collapses=True))
    assert "the first reason" in str(told(loaded)["form"])


def test_strips_that_are_wider_or_bent_in_their_plane_are_found():
    """A strip of the model against one that is a little wider, and one that turns aside."""
    along = np.linspace(0.0, 90.0, 10)
    rails = np.stack(
        [np.stack([along, side + 0 * along, 0 * along], axis=1) for side in (-5, 5)], 1
    )
    turned = rails + 0.001 * along[:, None, None] ** 2 * [0.0, 1.0, 0.0]

    def strip(rungs):
        panels = np.array([0, 4, 8])
        right = np.ones(len(rungs) - 1, dtype=bool)
        return Strip("A", False, panels, panels + 1, rungs, right, 0.0)

    cut = _panels_flat(strip(rails))
    # Rolled up, it is the same strip.
    around = np.stack([30 * np.sin(along / 30), 30 * np.cos(along / 30)], axis=1)
    rolled = np.stack([around[:, None, 0] + [0, 0], rails[:, :, 1], around[:, None, 1] + [0, 0]], 2)
    chord = 60 * np.sin(10 / 60)
    flat = strip(rails * [chord / 10.0, 1.0, 1.0])
    assert np.abs(_panels_flat(strip(rolled)) - _panels_flat(flat)).max() < 1e-9
    for other in (rails * [1.0, 1.02, 1.0], turned, rails * [1.01, 1.0, 1.0]):
        assert np.abs(_panels_flat(strip(other)) - cut).max() > 2 * CUT_MM


@pytest.mark.slow
def test_another_model_is_found_and_a_form_that_is_missing(loaded):
    shutil.copy(loaded / "model.glb", loaded / "model_relaxed.glb")
    assert "strips_mm" in str(told(loaded)["form"])
    (loaded / "model_relaxed.glb").unlink()
    assert "missing" in str(told(loaded)["form"])
    (loaded / "form.json").unlink()
    assert "whether it was let go" in str(told(loaded)["form"])


MOVED = ("shape:torus?m=8&n=6", "--size", "300mm", "--effort", "quick")


@pytest.fixture
def moved(finished, tmp_path):
    return finished.copy(tmp_path / "job", *MOVED)


def test_what_is_moved_to_settle_onto_its_model_is_true(moved):
    assert (moved / "aimed_mesh.obj").exists()
    assert told(moved) == {}


def shift_mesh(name, millimetres):
    """Move a vertex of a mesh of a job."""

    def change(folder):
        path = folder / name
        lines = path.read_text().splitlines()
        at = next(number for number, line in enumerate(lines) if line.startswith("v "))
        _, x, y, z = lines[at].split()
        lines[at] = f"v {float(x) + millimetres} {y} {z}"
        path.write_text("\n".join(lines) + "\n")

    return change


def form_json(change):
    return lambda folder: edit_json(folder / "form.json", change)


def verdict_json(**values):
    return lambda folder: edit_json(folder / "verdict.json", lambda d: d["form"].update(values))


UNTRUE = [
    (shift_mesh("aimed_mesh.obj", 0.1), "not wished at its edges"),
    (shift_mesh("aimed_mesh.obj", 9.0), "moved_mm"),
    (lambda folder: (folder / "aimed_mesh.obj").unlink(), "whether it is there"),
    (verdict_json(moved_mm=0.0), "moved_mm"),
    (verdict_json(moved_mm=None), "moved_mm"),
    (verdict_json(collapses=True), "moved_mm"),
    (verdict_json(collapses=True, moved_mm=None), "the first reason"),
    (verdict_json(off_mm=0.0), "off_mm"),
    (verdict_json(off_mean_mm=0.0), "off_mean_mm"),
    (verdict_json(drawn_mean_mm=0.01), "no nearer than"),
    (form_json(lambda d: d.pop("aim")), "whether it is there"),
    (form_json(lambda d: d["aim"].pop()), "how many crossings"),
    (form_json(lambda d: d["aim"][3].__setitem__(2, d["aim"][3][2] + 0.5)), "not wished"),
    (form_json(shift("standing", 3.0, 0)), "off_mm"),
    (
        lambda folder: (folder / "job.toml").write_text(
            (folder / "job.toml").read_text().replace('as_drawn = "on"', 'as_drawn = "off"')
        ),
        "as it is drawn",
    ),
]


@pytest.mark.parametrize(("spoil", "words"), UNTRUE)
def test_another_aim_is_found(moved, spoil, words):
    spoil(moved)
    assert words in str(told(moved)["form"])


def test_the_mesh_that_it_settles_onto_has_the_size(moved):
    """What is woven is of another size; what comes out is that of the settings."""
    shift_mesh("aimed_mesh.obj", 50.0)(moved)
    assert "greatest extent" in str(told(moved)["source"])
