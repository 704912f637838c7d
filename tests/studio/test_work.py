"""What the studio tells of a wish is what the rooms make of the same options."""

import asyncio
import math
import random
import time

import numpy as np
import pytest
from jobs import typed
from live_studio import unpacked
from mesh_writers import write_mesh
from meshes_shared import shared_mesh

from fabweave.design.inspection.facts import inspect_mesh
from fabweave.design.making import make_or_advise
from fabweave.job.stations import Stations
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import mid_edge
from fabweave.options.settings import settings_from_job, settings_from_options
from fabweave.studio.choosing import choose
from fabweave.studio.controls import controls
from fabweave.studio.fixes import fixes
from fabweave.studio.state import State, state_of_job
from fabweave.studio.work import look, make, plan
from fabweave.studio.worker import Worker, framed

pytestmark = pytest.mark.usefixtures("quick_jobs")

TORUS = "shape:torus?m=8&n=4"


def told(work, mesh, kept=None, **options):
    found = []
    wish = {"n": 1, "mesh": mesh, "options": options}
    work({} if kept is None else kept, wish, found.append)
    return [dict(values, **arrays) for values, arrays in found if "progress" not in values]


def test_what_is_seen_are_the_ribbons_of_the_same_options():
    (seen,) = told(look, TORUS, size="300mm", width="even,9mm")
    ribbons = Stations.read(TORUS, {"size": "300mm", "width": "even,9mm"}).ribbons.ribbons
    # What a page reads is what was sent.
    sent = unpacked(framed({}, {name: seen[name] for name in ("position", "shade", "index")}))
    for name in ("position", "shade", "index"):
        assert (sent[name] == seen[name].ravel()).all()
    position = seen["position"].reshape(-1, 2, 3)
    assert np.abs(position[:, 0] - ribbons.right).max() < 1e-4
    assert np.abs(position[:, 1] - ribbons.left).max() < 1e-4
    assert seen["crossings"] == 64
    shade = seen["shade"].reshape(-1, 2, 4) / 127.0
    lengths = np.linalg.norm(shade[:, 0, :3], axis=1)
    assert np.abs(lengths - 1.0).max() < 0.02
    # As often over as under: the mean height of all panels is that of the surface.
    assert abs(shade[ribbons.entry, 0, 3].sum()) < 1e-9
    corner = position.reshape(-1, 3)[seen["index"].reshape(-1, 3)]
    facing = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal = shade.reshape(-1, 4)[seen["index"].reshape(-1, 3)[:, 0], :3]
    assert (np.einsum("ij,ij->i", facing, normal) > 0.0).all()


def test_only_what_changes_is_made_anew():
    kept = {}
    told(look, TORUS, kept, size="300mm")
    weave = kept["stations"].weave
    told(look, TORUS, kept, size="300mm", width="even,7mm")
    assert kept["stations"].weave is weave
    told(look, TORUS, kept, size="310mm")
    other = kept["stations"].loaded
    told(look, TORUS, kept, size="300mm")
    assert kept["stations"].loaded is not other
    # What is undone is there at once: its mesh was kept.
    assert len(kept["meshes"]) == 2


def test_triangles_that_a_page_has_are_not_sent_again():
    wish = {"n": 1, "mesh": TORUS, "options": {}}
    found = []

    def seen(told):
        found.extend([told] if "shape" in told[0] else [])

    look({}, wish, seen)
    look({}, {**wish, "have": found[0][0]["shape"]}, seen)
    assert set(found[0][1]) - set(found[1][1]) == {"index"}


@pytest.mark.slow
def test_a_plan_tells_what_the_pieces_are_and_where_they_lie():
    figures, cut, sheets, steps = (
        one for one in told(plan, TORUS, size="200mm") if "progress" not in one
    )
    planned = Stations.read(TORUS, {"size": "200mm"}).planned
    assert [one["id"] for one in figures["pieces"]] == [one.id for one in planned.piece_set.pieces]
    assert figures["figures"]["pieces"] == len(planned.piece_set.pieces)
    assert sum(figures["widths"]["count"]) == len(planned.check.measured["width"].value)
    # Every rung belongs to a piece, and each piece has some.
    assert set(cut["owner"]) == set(range(len(figures["pieces"])))
    assert len(cut["owner"]) == planned.woven.ribbons.n_rungs
    assert sorted(piece for piece, *_ in sheets["placed"]) == list(range(len(figures["pieces"])))
    named = [id_ for step in steps["steps"] for id_ in step["pieces"]]
    assert sorted(named) == sorted(one["id"] for one in figures["pieces"])


@pytest.mark.slow
def test_sheets_are_nested_finer_when_that_is_asked_for():
    kept, found = {}, []
    wish = {"n": 1, "mesh": TORUS, "options": {"size": "200mm", "effort": "normal"}}
    plan(kept, wish, found.append)
    plan(kept, {**wish, "finer": True}, found.append)
    told = [values for values, _ in found if "sheets" in values]
    assert [one["effort"] for one in told] == ["quick", "normal"]
    assert len(told[1]["sheets"]) <= len(told[0]["sheets"])
    layout = Stations.read(TORUS, wish["options"]).layout
    placed = [(place.sheet, round(place.x_mm, 2)) for place in layout.placements]
    assert [(sheet, x) for _, sheet, x, *_ in told[1]["placed"]] == placed


def test_what_cannot_be_built_is_told_with_its_reasons():
    first = next(one for one in told(plan, TORUS, size="40mm") if "verdict" in one)
    assert first["verdict"]["level"] == "not makeable"
    assert first["verdict"]["reasons"]


@pytest.mark.slow
def test_an_inexact_twill_is_voted_first_and_searched_then():
    # Around a vertex with three edges no 2/2 twill closes.
    found = told(look, "shape:sphere?n=4", size="200mm", pattern="twill")
    assert [one["better"] for one in found] == [True, False]
    assert found[1]["broken"] <= found[0]["broken"]


def test_yarns_are_told_as_closed_tubes():
    found = []
    look({}, {"n": 1, "mesh": TORUS, "options": {}, "yarns": True}, found.append)
    _, arrays = found[-1]
    index = arrays["index"].reshape(-1, 3)
    sides = np.concatenate([index[:, [k, (k + 1) % 3]] for k in range(3)])
    there = set(map(tuple, sides.tolist()))
    assert there == {(end, start) for start, end in there}


def walked(steps, seed, mesh, options, most_crossings=math.inf):
    """Yield the states of a random walk over the controls, each of which can be seen."""
    draw, kept, state = random.Random(seed), {}, State(mesh, options)  # noqa: S311 - no secret
    told(look, state.mesh, kept, **state.options)
    for _ in range(steps):
        stations = kept["stations"]
        one = draw.choice(
            controls(stations.asked, stations.completed[0], stations.loaded, stations.ribbons)
        )
        if one.option == "up" and draw.random() < 0.5:
            value = ",".join(f"{draw.uniform(-1.0, 1.0):.3g}" for _ in range(3))
        elif one.kind == "choice":
            value = draw.choice(one.choices)[0]
        elif one.kind == "range":
            # Near what is there: sizes of metres and hundreds of quads take long.
            most = min(one.most, 500.0 if one.unit == "mm" else 60.0)
            near = min(max(float(one.value) * draw.choice((0.8, 0.95, 1.1, 1.25)), one.least), most)
            value = f"{round(near / one.step) * one.step:.6g}"
        else:
            value = draw.choice(("600x400mm", "20x30in", "300x300mm"))
        said = one.template.replace("{}", value) if value else None
        before = kept["stations"]
        if one.option == "mesh":
            following = State(said, {"size": "200mm"})
        else:
            following = State.of(
                {"mesh": state.mesh, "options": {**state.options, one.option: said}}
            )
        (*_, seen) = told(look, following.mesh, kept, **following.options)
        if "crossings" not in seen or seen["crossings"] > most_crossings:
            kept["stations"] = before
            continue
        state = following
        yield state, seen


def same_from_its_files(state, seen, folder):
    """The job.toml and the command that a page shows mean the very settings that it has."""
    settings = settings_from_options(state.mesh, **state.options)
    path = folder / "job.toml"
    path.write_text(seen["toml"], "utf-8")
    assert settings_from_job(path) == settings
    again = state_of_job(path)
    assert settings_from_options(again.mesh, **again.options) == settings
    assert typed(seen["command"]) == settings


def test_walks_over_the_controls_end_in_what_job_toml_says(tmp_path):
    for state, seen in walked(40, 7, TORUS, {"size": "200mm"}):
        same_from_its_files(state, seen, tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_where_a_walk_ends_the_job_is_that_of_its_job_toml(seed, tmp_path):
    *_, (state, seen) = walked(12, 50 + seed, "shape:octahedron", {"size": "250mm"})
    options = {**state.options, "effort": "quick", "force": True}
    (tmp_path / "jobs").mkdir()
    wish = {"mesh": state.mesh, "options": options, "folder": str(tmp_path / "jobs")}
    found = []
    make({}, wish, found.append)
    if any("error" in values for values, _ in found):
        pytest.skip("what the walk ends in cannot be made, and is told so")
    (tmp_path / "job.toml").write_text(seen["toml"], "utf-8")
    again = settings_from_job(tmp_path / "job.toml", effort="quick", force=True)
    make_or_advise(Stations(again), tmp_path / "again")
    made = next(values["made"] for values, _ in found if "made" in values)
    one, two = tmp_path / "jobs" / made, tmp_path / "again"
    assert (one / "contents.json").read_bytes() == (two / "contents.json").read_bytes()


@pytest.mark.slow
def test_walks_on_a_found_model_end_in_what_job_toml_says(tmp_path):
    mesh = str(shared_mesh("quad/bob_controlmesh.obj"))
    for state, seen in walked(30, 3, mesh, {"size": "300mm", "remesh": "quads:150"}):
        same_from_its_files(state, seen, tmp_path)


@pytest.mark.slow
def test_a_model_is_shown_on_the_mesh_on_which_make_and_inspect_weave_it(tmp_path):
    mesh = parse_shape("shape:icosahedron")
    for _ in range(3):
        mesh = mid_edge(mesh)
    away = np.linalg.norm(mesh.vertices, axis=1, keepdims=True)
    path = tmp_path / "ball.obj"
    write_mesh(path, mesh.with_vertices(mesh.vertices / away))
    options = {"size": "90mm", "effort": "quick"}
    # It is shown as it comes, and no hairnet of strips that nobody could cut.
    *_, raw = told(look, str(path), **options)
    assert raw["raw"]
    assert len(raw["index"]) == mesh.n_faces
    found, kept = told(choose, str(path), **options), {}
    made = make_or_advise(Stations.read(str(path), options), tmp_path / "job")
    facts = inspect_mesh(Stations.read(str(path), options), answer=True).facts
    (choice,) = (one["choice"] for one in found if "choice" in one)
    assert choice["why"] == made.chosen == facts["chosen"]
    assert choice["options"]["remesh"] == made.job.asked.mesh.remesh
    cards = [one["card"] for one in found if "card" in one]
    usual = choice["roles"]["usual"]
    assert usual["options"] == {**options, **choice["options"]}
    assert usual in [card["state"] for card in cards]
    # The one that leads last is what is taken, and a card's ribbons are what is then seen.
    number = [card["state"] for card in cards].index(usual)
    shown = [one for one in found if "card" in one][number]
    (seen,) = told(look, usual["mesh"], kept, **usual["options"])
    assert (seen["position"] == shown["position"]).all()
    figures = next(one["figures"] for one in told(plan, usual["mesh"], kept, **usual["options"])
                   if "figures" in one)  # fmt: skip
    assert figures["pieces"] == facts["pieces"]["count"] == len(made.finished.job.piece_set.pieces)
    # What the page makes then are the files of the command that chose by itself.
    (tmp_path / "jobs").mkdir()
    asked, answered = {**usual, "folder": str(tmp_path / "jobs")}, []
    make({}, asked, answered.append)
    folder = next(values["made"] for values, _ in answered if "made" in values)
    one, two = tmp_path / "jobs" / folder, tmp_path / "job"
    assert (one / "crossing_map.csv").read_bytes() == (two / "crossing_map.csv").read_bytes()


def test_cures_are_options_that_read_and_change_something():
    text = "use --size 90mm, or --remesh quads:N, or --bodies largest; --no-such 3, --force"
    found = fixes(TORUS, {"bodies": "largest"}, text)
    assert [one["options"] for one in found] == [{"size": "90mm"}]


@pytest.mark.slow
def test_what_an_error_names_as_a_cure_can_be_set_and_cures():
    options = {"size": "90mm", "thickness": "0.8mm"}
    reasons = next(one["verdict"]["reasons"] for one in told(plan, TORUS, **options)
                   if "verdict" in one)  # fmt: skip
    cures = [cure for reason in reasons if reason["level"] == "not makeable"
             for cure in reason["fixes"] if "size" in cure["options"]]  # fmt: skip
    assert cures
    after = next(one["verdict"] for one in told(plan, TORUS, **{**options, **cures[-1]["options"]})
                 if "verdict" in one)  # fmt: skip
    before = {reason["rule"] for reason in reasons}
    assert {reason["rule"] for reason in after["reasons"]} < before


@pytest.mark.slow
def test_trouble_is_where_rules_are_broken_and_nowhere_else():
    options = {"size": "90mm", "thickness": "0.8mm"}
    cut = next(one for one in told(plan, TORUS, **options) if "cut" in one)
    planned = Stations.read(TORUS, options)
    planned.depth = planned.depth.NEAR
    check, entry = planned.planned.check, planned.planned.woven.ribbons.entry
    measured = check.measured["bend"]
    assert cut["trouble"]["bend"] == int((measured.margins < 1.0).sum()) > 0
    heat = cut["heat_bend"].astype(float)
    worst = np.full(len(entry), np.inf)
    np.minimum.at(worst, measured.passes, measured.margins)
    assert (heat[entry[worst < 1.0]] >= 97.0).all()
    assert (heat[entry[worst >= 1.25]] == 0.0).all()
    # Let go, crossings go as far as is foretold.
    moves = np.linalg.norm(cut["moves"].reshape(-1, 3), axis=1)
    assert moves.max() == pytest.approx(
        np.linalg.norm(planned.foretold.moves, axis=1).max(), rel=1e-4
    )


def test_a_large_model_is_shown_before_it_is_checked_and_upright(tmp_path):
    mesh = parse_shape("shape:torus?m=110&n=100")
    path = tmp_path / "lying.obj"
    write_mesh(path, mesh)
    glance, raw = told(look, str(path), size="300mm", up="x")
    assert glance["glance"]
    assert raw["raw"]
    assert len(glance["index"]) == 2 * mesh.n_faces
    first, last = (np.ptp(one["position"].reshape(-1, 3), axis=0) for one in (glance, raw))
    assert np.abs(first / first.max() - last / last.max()).max() < 1e-5
    # What is wrong with a model is said by its checks.
    path.write_text(path.read_text() + "f 1 2 3\n" * 3)
    assert any("error" in one or "raw" in one for one in told(look, str(path), size="300mm"))


def test_yarns_are_as_thick_as_is_asked():
    def girth(share):
        found = []
        wish = {"n": 1, "mesh": TORUS, "options": {}, "yarns": True, "radius": share}
        look({}, wish, found.append)
        corners = found[-1][1]["position"].reshape(-1, 8, 3)
        return np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).mean()

    assert girth(0.25) == pytest.approx(girth(0.5) / 2.0, rel=0.05)


def stubborn(_kept, _wish, tell):
    """Raise an error of its own where it is interrupted, as comparing named columns in C may."""
    tell(({"began": True}, {}))
    try:
        time.sleep(30)
    except KeyboardInterrupt:
        raise TypeError from None


def broken(_kept, _wish, _tell):
    """Fail."""
    raise TypeError


def test_what_was_to_stop_is_stopped_whatever_it_raises():
    async def all_told(work):
        worker, found = Worker(), []
        async for values, _ in worker.do(work, {}):
            found.append(next(iter(values)))
            if values == {"began": True}:
                worker.interrupt()
        worker.close()
        return found

    assert asyncio.run(all_told(stubborn)) == ["began", "stopped"]
    assert asyncio.run(all_told(broken)) == ["error"]
