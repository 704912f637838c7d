"""A form that is told is proved by physics of the verifier's own; whatever is spoiled is found."""

import json
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sealing import told
from spoiling import edit_json

from fabweave.verify.check.form import (
    CUT_MM,
    PIECES,
    Attitude,
    Spans,
    Stand,
    _panels_flat,
    _pieces,
    middles_of,
    moves,
    nearest,
    pull_of,
    resistance,
    twists,
    weights,
)
from fabweave.verify.read.glb import Strip

FLAT = np.zeros(3)
CARD = (np.array([3000.0]), np.array([0.3]), np.array([0.4]))


def strip(length, width=10.0, turn=0.0):
    """Return a span from a crossing to another, cut as an arc that turns by so much."""
    rest = np.zeros((1, PIECES, 6))
    rest[..., 0], rest[..., 5] = length / PIECES, turn / PIECES
    one = np.ones((1, PIECES))
    return Spans(
        np.zeros(1, dtype=np.int64), np.array([[0, 1]]), np.ones((1, 2), dtype=bool),
        np.zeros((1, 2, 3)), rest, length / PIECES * one, width * one,
    )  # fmt: skip


def stand(*frames):
    """Return how two crossings stand, and pieces between them: places and rotation vectors."""
    place, turn = (np.array([frame[at] for frame in frames], dtype=float) for at in (0, 1))
    all_ = Attitude(place, Rotation.from_rotvec(turn).as_matrix())
    inner = [all_.at(np.array([at])) for at in range(1, PIECES)]
    return Stand(all_.at(np.array([0, PIECES])), np.zeros(2), inner)


def arc(radius, share, axis):
    """Return the place and the turn after a share of a quarter circle, bent about y or z."""
    angle = share * np.pi / 2
    rise = radius * (1 - np.cos(angle))
    way = (0.0, 0.0, -rise) if axis == "y" else (0.0, rise, 0.0)
    return np.add(way, (radius * np.sin(angle), 0, 0)), angle * np.eye(3)["xyz".index(axis)]


@pytest.mark.parametrize(("axis", "inertia"), [("y", 10 * 0.4**3 / 12), ("z", 0.4 * 10**3 / 12)])
def test_a_strip_that_is_bent_to_an_arc_has_its_known_energy(axis, inertia):
    radius = 30.0
    length = radius * np.pi / 2
    spans = strip(length)
    bent = stand(*(arc(radius, share, axis) for share in np.linspace(0, 1, PIECES + 1)))
    stiffness = resistance(spans, *CARD)
    found = pull_of(spans, bent, stiffness, 2)
    assert found.energy_nmm == pytest.approx(3000 * inertia * length / radius**2 / 2, rel=1e-6)
    # A pure moment: no force, and E I over the radius at either end.
    moment = found.force[:, 3 + "xyz".index(axis)]
    assert np.abs(moment) == pytest.approx(3000 * inertia / radius, rel=1e-5)
    assert np.abs(found.force[:, :3]).max() < 1e-4 * abs(moment[0]) / radius


def test_as_it_was_cut_it_stores_nothing():
    spans = strip(30.0 * np.pi / 2, turn=np.pi / 2)
    bent = stand(*(arc(30.0, share, "z") for share in np.linspace(0, 1, PIECES + 1)))
    stiffness = resistance(spans, *CARD)
    middles = middles_of(spans, bent, stiffness)
    assert twists(spans, bent, middles) == pytest.approx(spans.rest, abs=1e-9)
    assert pull_of(spans, bent, stiffness, 2).energy_nmm < 1e-12


def test_a_pulled_strip_wants_back_as_far_as_it_was_pulled():
    spans = strip(40.0)
    pulled = stand(*(((40.5 * at / PIECES, 0, 0), FLAT) for at in range(PIECES + 1)))
    found = pull_of(spans, pulled, resistance(spans, *CARD), 2)
    assert found.force[:, 0] == pytest.approx([-150.0, 150.0], rel=1e-6)
    assert moves(found.force, found.stiff) == pytest.approx([0.5, 0.5], rel=1e-3)


def test_a_strip_weighs_what_it_weighs():
    spans = strip(50.0, width=20.0)
    weight = weights(spans, np.array([750.0]), np.array([0.4]), 2)
    assert weight.sum() == pytest.approx(50 * 20 * 0.4 * 1e-9 * 750 * 9.81)
    assert weight[0] == weight[1]


def test_pieces_lead_from_panel_to_panel():
    """Put together, they lead to where the next panel is; each is as long as the others."""
    angle = np.linspace(0.0, 2.5, 60)
    line = 40.0 * np.exp(1j * angle) + 3.0 * angle
    enter, leave = np.array([0, 57]), np.array([2, 59])
    rest, length = _pieces(line, enter, leave)
    at = (line[0] + line[2]) / 2
    heading = (line[2] - line[0]) / abs(line[2] - line[0])
    for dx, dy, *_, turn in rest[0]:
        at += heading * (dx + 1j * dy) * np.sinc(turn / (2 * np.pi)) * np.exp(0.5j * turn)
        heading *= np.exp(1j * turn)
    assert at == pytest.approx((line[57] + line[59]) / 2, abs=1e-9)
    assert heading == pytest.approx((line[59] - line[57]) / abs(line[59] - line[57]), abs=1e-9)
    assert np.ptp(length) < 1e-9
    assert length.sum() == pytest.approx(np.abs(np.diff(line))[1:58].sum(), rel=0.01)


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
def test_what_is_made_is_in_balance(loaded):
    assert told(loaded) == {}
    check = next(one for one in json.loads((loaded / "verify.json").read_text("utf-8"))["checks"]
                 if one["name"] == "form")  # fmt: skip
    assert {"energy", "balance_mm", "borne", "cut_mm"} <= set(check["measured"])
    assert check["measured"]["energy"]["value"] < 0.005
    assert check["measured"]["balance_mm"]["value"] < 0.02


def shift(name, millimetres, axis=2):
    def change(document):
        state(document, name)["bodies"][5][axis] += millimetres

    return change


def without_load(document):
    document["load_n"] = []


def as_it_stood(document):
    state(document, "loaded").update(bodies=state(document, "standing")["bodies"])


def scale(key, factor):
    def change(document):
        for thread in document["threads"]:
            thread[key] *= factor

    return change


SPOILT = [
    (shift("let go", 1.0), "from where forces balance"),
    (shift("let go", -0.4, 0), "from where forces balance"),
    (shift("standing", 0.5), "from where forces balance"),
    (scale("young_mpa", 1.2), "of itself off what is said"),
    (scale("density_kg_m3", 1.5), "of its weight otherwise"),
    (scale("thickness_mm", 2.0), "its thickness"),
    (without_load, "not what was asked for"),
    (as_it_stood, "of its weight otherwise"),
    (lambda d: d["pins_nmm"].__setitem__(0, 500.0), "resist turning"),
    (lambda d: d["states"].pop(), "the states"),
    (lambda d: d["held"].pop(), "of its weight otherwise"),
    (lambda d: state(d, "let go").update(energy_nmm=1.0), "of itself off what is said"),
    (lambda d: state(d, "let go")["bodies"].pop(), "one row for each"),
    (lambda d: state(d, "let go").update(angles=[0.1] * len(state(d, "let go")["angles"])),
     "of itself off what is said"),
    (lambda d: state(d, "let go").update(settled=False), "came to rest"),
]  # fmt: skip


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
