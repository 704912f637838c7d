"""Where an object is said to rest, forces balance, by mechanics that the maker knows nothing of."""

import copy
import json

import numpy as np
import pytest
from elastic_oracle import (
    PIECES,
    Pose,
    Spans,
    Stand,
    moves,
    off_balance,
    pull_of,
    resistance,
    spans_of,
    weights,
)
from jobs import laid

from fabweave.core.records import to_json
from fabweave.form.body import BARE, PINNED, body_of
from fabweave.form.relaxed import form_record
from fabweave.form.settle import settle
from fabweave.job.ask import brief_of
from fabweave.job.write import json_text


def strip(length):
    """Return a span of card from a crossing to another."""
    rest, one = np.zeros((1, PIECES, 6)), np.ones((1, PIECES))
    rest[..., 0] = length / PIECES
    no = np.zeros(1, dtype=int)
    both = np.array([[0, 1]])
    spans = Spans(no, both, both >= 0, np.zeros((1, 2, 3)), rest, rest[..., 0], 10.0 * one)
    return spans, resistance(spans, [3000.0], [0.3], [0.4])


def stand(rows):
    """Return how two crossings stand, and where pieces between them meet."""
    return Stand(Pose.of(rows[:: len(rows) - 1]), np.zeros(2), [Pose.of(row) for row in rows[1:-1]])


@pytest.mark.parametrize(("axis", "inertia"), [(4, 10 * 0.4**3 / 12), (5, 0.4 * 10**3 / 12)])
def test_the_oracle_knows_the_energy_and_moments_of_an_arc(axis, inertia):
    radius, angle = 30.0, np.pi / 2 * np.arange(PIECES + 1) / PIECES
    rows = np.zeros((PIECES + 1, 6))
    rows[:, 0], rows[:, axis] = radius * np.sin(angle), angle
    rows[:, {4: 2, 5: 1}[axis]] = {4: -1, 5: 1}[axis] * radius * (1 - np.cos(angle))
    spans, stiffness = strip(radius * np.pi / 2)
    energy, force, _ = pull_of(spans, stand(rows), stiffness, 2)
    assert energy == pytest.approx(3000 * inertia * np.pi / radius / 4, rel=1e-6)
    # A pure moment: no force, and E I over the radius at either end.
    assert np.abs(force[:, axis]) == pytest.approx(3000 * inertia / radius, rel=1e-5)
    assert np.abs(force[:, :3]).max() < 1e-4 * abs(force[0, axis]) / radius


def test_the_oracle_knows_how_far_a_pulled_strip_wants_back():
    spans, stiffness = strip(40.0)
    rows = np.zeros((PIECES + 1, 6))
    rows[:, 0] = 40.5 * np.arange(PIECES + 1) / PIECES
    _, force, stiff = pull_of(spans, stand(rows), stiffness, 2)
    assert force[:, 0] == pytest.approx([-150.0, 150.0], rel=1e-6)
    assert moves(force, stiff) == pytest.approx([0.5, 0.5], rel=1e-3)


@pytest.fixture(
    scope="module",
    params=[
        ("tube?m=8&n=4", BARE, {"load": "20g@top"}),
        ("tube?m=8&n=4", PINNED, {"load": "20g@top", "boundary": "turn"}),
        ("torus?m=8&n=4", BARE, {"thickness_mm": 0.2}),
        ("octahedron", PINNED, {"hang": "top"}),
    ],
    ids=lambda case: case[0],
)
def let_go(request):
    """An object, its body, and the record of where it comes to rest."""
    shape, pin, options = request.param
    woven, settings, supplies = laid(f"shape:{shape}", size_mm=200.0, **options)
    body = body_of(woven, brief_of(settings, supplies))
    pins = np.full(len(body.places), pin)
    record = form_record(settle(body, pins), 0.0)
    return woven, body, json.loads(json_text(to_json(record)))


def test_forces_balance_where_it_rests(let_go):
    woven, _, form = let_go
    for name, off in off_balance(woven, form).items():
        assert off.energy < 0.01, name
        assert off.balance_mm < 0.05, name
        assert off.borne < 0.01, name


def test_strips_resist_as_they_are_cut_and_weigh_what_they_weigh(let_go):
    """Rails of the maker's panels are a little askew, by which their widths differ."""
    woven, body, form = let_go
    spans, angles = spans_of(woven)
    young, poisson, density, thickness = (
        [thread[key] for thread in form["threads"]]
        for key in ("young_mpa", "poisson", "density_kg_m3", "thickness_mm")
    )
    assert spans.rest == pytest.approx(body.net.rest, abs=1e-9)
    assert angles == pytest.approx(body.net.rest_angles, abs=1e-12)
    stiffness = resistance(spans, young, poisson, thickness)
    assert stiffness == pytest.approx(body.net.stiffness, rel=0.08)
    weight = weights(spans, density, thickness, len(angles))
    assert weight == pytest.approx(-body.net.weight[:, 2], rel=0.025)


def shift(name, axis, millimetres):
    def change(form):
        states = {state["name"]: state for state in form["states"]}
        states[name]["bodies"][5][axis] += millimetres

    return change


def scale(key, factor):
    def change(form):
        for thread in form["threads"]:
            thread[key] *= factor

    return change


@pytest.mark.parametrize("let_go", [("tube?m=8&n=4", BARE, {"load": "20g@top"})], indirect=True)
@pytest.mark.parametrize(
    ("change", "where", "what", "limit"),
    [
        (shift("let go", 2, 1.0), "let go", "balance_mm", 0.05),
        (shift("let go", 0, -0.4), "let go", "balance_mm", 0.05),
        (shift("standing", 2, 0.5), "standing", "balance_mm", 0.05),
        (scale("young_mpa", 1.2), "let go", "energy", 0.01),
        (scale("thickness_mm", 1.1), "let go", "energy", 0.01),
        (scale("density_kg_m3", 1.5), "standing", "borne", 0.01),
        (lambda form: form["load_n"].clear(), "loaded", "borne", 0.01),
        (lambda form: form["held"].pop(), "standing", "borne", 0.01),
        (lambda form: form["states"][0].update(energy_nmm=1.0), "let go", "energy", 0.01),
    ],
)
def test_the_oracle_objects_to_another_record(let_go, change, where, what, limit):
    woven, _, form = let_go
    spoilt = copy.deepcopy(form)
    change(spoilt)
    assert getattr(off_balance(woven, spoilt)[where], what) > limit
