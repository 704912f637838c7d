"""A model that is too fine to be built is made on a coarser mesh, unless its mesh is to be kept."""

from dataclasses import replace

import numpy as np
import pytest
from designs import candidate
from jobs import contents_of

from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Finding
from fabweave.design import coarser, making, search
from fabweave.design.beside import SOFT
from fabweave.design.candidate import Tried
from fabweave.design.coarser import Attempt, foreseen, is_free
from fabweave.design.making import make_or_advise
from fabweave.design.search import Trials
from fabweave.job.ask import load_asked
from fabweave.job.run import run_job
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.leave_out import parse_leave_out
from fabweave.mesh.likeness import likeness
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import mid_edge
from fabweave.options.settings import Settings, read_job_options
from fabweave.plan.verdict import Verdict
from fabweave.ribbon.width import WidthRule

pytestmark = pytest.mark.usefixtures("quick_jobs")


@pytest.fixture(scope="module")
def fine(tmp_path_factory):
    """A ball of 5,120 triangles: an icosahedron, divided four times."""
    mesh = parse_shape("shape:icosahedron")
    for _ in range(4):
        mesh = mid_edge(mesh)
    radius = np.linalg.norm(mesh.vertices, axis=1, keepdims=True)
    path = tmp_path_factory.mktemp("fine") / "ball.obj"
    write_mesh(path, mesh.with_vertices(mesh.vertices / radius))
    return Settings.of(str(path), size_mm=70.0, effort="quick")


@pytest.mark.slow
def test_what_is_too_fine_is_made_on_a_coarser_mesh(fine, tmp_path):
    made = make_or_advise(fine, tmp_path / "plain")
    assert not made.finished.job.verdict.stops
    assert made.finished.proof.ok
    assert made.finished.job.woven.mesh.n_faces < 512
    # What is not said of the mesh is as it was asked for, and job.toml has what was made.
    assert made.settings.but(remesh=None, bodies="all") == fine
    assert read_job_options(tmp_path / "plain" / "job.toml")["remesh"] == made.settings.mesh.remesh
    assert f"(--remesh {made.settings.mesh.remesh})" in made.chosen
    assert "5,120 triangles" in made.chosen
    # Asked for by hand, it comes to the very same files.
    run_job(made.settings, tmp_path / "stated")
    assert contents_of(tmp_path / "plain") == contents_of(tmp_path / "stated")


@pytest.mark.slow
def test_a_mesh_that_is_to_be_kept_is_refused_with_what_can_be_built(fine, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(making, "coarser_meshes", lambda *_, **__: pytest.fail("meshes were tried"))
    monkeypatch.setattr(
        making, "what_can_be_built", lambda trials: asked.append(trials.asked) or ""
    )
    with pytest.raises(CannotMakeError):
        make_or_advise(fine.but(remesh="none"), tmp_path / "job")
    assert asked == [fine.but(remesh="none")]
    assert not (tmp_path / "job").exists()


@pytest.mark.slow
def test_what_can_be_built_as_it_is_stays(tmp_path, monkeypatch):
    monkeypatch.setattr(making, "coarser_meshes", lambda *_, **__: pytest.fail("meshes were tried"))
    mesh = tmp_path / "cube.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    asked = Settings.of(str(mesh), size_mm=200.0, effort="quick")
    made = make_or_advise(asked, tmp_path / "job")
    assert (made.settings, made.chosen) == (asked, "")
    assert "remesh" not in read_job_options(tmp_path / "job" / "job.toml")


@pytest.mark.slow
def test_what_is_foreseen_comes_true(fine, tmp_path):
    kept = fine.but(remesh="none")
    worst = foreseen(kept, load_asked(kept))[0]
    assert (worst.rule, worst.limit) == ("width", 1.0)
    assert worst.value < 1.0
    with pytest.raises(CannotMakeError):
        run_job(kept, tmp_path / "job")
    # At six times the size its ribbons are six times as wide.
    larger = kept.but(size_mm=6.0 * fine.mesh.size_mm)
    assert foreseen(larger, load_asked(larger)) == []


@pytest.mark.parametrize(
    ("options", "free"),
    [
        ({}, True),
        ({"pattern": "twill", "width": WidthRule(0.9, 8.0, 8.0), "bodies": "largest"}, True),
        ({"leave_out": "top:20mm"}, True),
        ({"leave_out": "12,13"}, False),
        ({"remesh": "none"}, False),
        ({"remesh": "quads:90"}, False),
        ({"refine": "loop:1"}, False),
        ({"symmetrise": True}, False),
        ({"twists": "own.csv"}, False),
        ({"force": True}, False),
    ],
)
def test_a_mesh_is_free_where_nothing_counts_its_faces(options, free):
    assert is_free(Settings.of("model.obj", **options)) is free
    assert not is_free(Settings.of("shape:cube", **options))


def test_little_care_comes_first_and_then_likeness():
    ball = parse_shape("shape:sphere?n=8")

    def attempt(reasons, away, verdict="with care"):
        """A mesh that is so far from its model everywhere, as a share of its size."""
        mesh = ball.with_vertices(ball.vertices * (1.0 + 2.0 * away))
        loaded = replace(load_asked(Settings.of("shape:sphere?n=8")), likeness=likeness(ball, mesh))
        reason = Finding(rule="twist", level="with care", text="twist")
        level = verdict if reasons else "makeable"
        return Attempt(
            Settings.of("a.obj"), loaded, Verdict(level=level, reasons=(reason,) * reasons)
        )

    order = [
        attempt(0, 0.001),
        attempt(0, 0.008),
        attempt(1, 0.001),
        attempt(2, 0.0005),
        attempt(2, 0.002),
        # What is hardly the model goes behind, though it is built with no care at all.
        attempt(0, 0.03),
    ]
    ranks = [one.rank for one in order]
    assert ranks == sorted(set(ranks))


def test_even_strips_come_before_uneven_ones():
    loaded = load_asked(Settings.of("shape:sphere?n=8"))
    twist = Finding(rule="twist", level="with care", text="twist")
    care = Verdict(level="with care", reasons=(twist,))
    order = [
        Attempt(Settings.of("a.obj"), replace(loaded, turn_deg=turn), care, narrow)
        for turn, narrow in ((4.0, 0.0), (8.0, 0.0), (8.0, 0.3))
    ]
    assert [one.rank for one in order] == sorted({one.rank for one in order})


@pytest.mark.parametrize(("move", "bodies"), [(0.4, "wrap"), (3.0, "wrap"), (None, "all")])
def test_what_runs_through_itself_or_has_several_bodies_is_wrapped_first(
    fine, monkeypatch, move, bodies
):
    ball = load_asked(fine).mesh
    if move is not None:
        beside = ball.with_vertices(ball.vertices + np.array([70.0 * move, 0.0, 0.0]))
        ball = PolyMesh(
            np.concatenate([ball.vertices, beside.vertices]),
            np.concatenate([ball.offsets, ball.offsets[-1] + ball.offsets[1:]]),
            np.concatenate([ball.indices, ball.n_vertices + ball.indices]),
        )
    tried = []

    def attempt(settings, _given):
        tried.append(settings)
        return Attempt(settings, loaded, Verdict(level="makeable", reasons=()))

    loaded = load_asked(fine, given_mesh=ball)
    monkeypatch.setattr(coarser, "try_mesh", attempt)
    assert len(list(coarser.coarser_meshes(Trials(fine), loaded))) == len(tried)
    assert {one.mesh.bodies for one in tried} == {bodies}


@pytest.mark.slow
def test_where_no_mesh_can_be_built_it_is_refused(fine, tmp_path):
    with pytest.raises(CannotMakeError, match="--material card"):
        make_or_advise(fine.but(material="birch-ply-3"), tmp_path / "job")
    assert not (tmp_path / "job").exists()


def test_ways_out_of_what_cannot_be_built_can_be(monkeypatch):
    tried = []
    bend = Finding(rule="bend", level="not makeable", text="it bends too much")
    stopped = Verdict(level="not makeable", reasons=(bend,))

    def explore(_, designs, *__, **___):
        known = len(tried)
        tried.extend(designs)
        return [
            Tried(candidate=replace(
                candidate(str(at), None if one.stock.material == SOFT else stopped), excess=2.0
            ), picture=None)
            for at, one in enumerate(designs, start=known)
        ]  # fmt: skip

    monkeypatch.setattr(search, "explore", explore)
    asked = Settings.of("shape:torus?m=8&n=4", size_mm=120.0, material="birch-ply-3")
    told = making.what_can_be_built(Trials(asked))
    assert any((one.mesh.size_mm or 0.0) > 120.0 for one in tried)
    assert [f"  {at}: " in told for at, _ in enumerate(tried)] == [
        one.stock.material == SOFT for one in tried
    ]
    assert tried[-1].stock.material == SOFT


@pytest.mark.parametrize(("pinched", "opened"), [([40], True), (list(range(0, 216, 9)), False)])
def test_a_mesh_is_opened_where_a_few_places_stop_it(pinched, opened):
    """Faces pinched to a twentieth leave ribbons no room: few are left out, many are not."""
    ball = parse_shape("shape:sphere?n=6&radius=100")
    points, quads = ball.vertices.copy(), ball.indices.reshape(-1, 4)
    for face in pinched:
        corners = points[quads[face]]
        points[quads[face]] = corners.mean(axis=0) + 0.05 * (corners - corners.mean(axis=0))
    asked = Settings.of("ball.obj", size_mm=200.0, remesh="none")
    attempt = coarser.try_mesh(asked, ball.with_vertices(points))
    gone = parse_leave_out(attempt.settings.mesh.leave_out).faces
    assert attempt.built == opened
    assert attempt.settings.but(leave_out=None) == asked
    assert set(gone) >= set(pinched) if opened else not gone
    assert len(gone) <= 0.06 * 216
    # What was opened is what its settings make.
    assert attempt.loaded.mesh.n_faces == 216 - len(gone)


def test_only_what_is_better_than_all_before_it_is_told(fine, monkeypatch):
    loaded, told, left = load_asked(fine), [], [2, 3, 1, 1, 0]
    reason = Finding(rule="twist", level="not makeable", text="strips twist")

    def attempt(settings, _given):
        reasons = left.pop(0) if left else 5
        level = "not makeable" if reasons else "makeable"
        return Attempt(settings, loaded, Verdict(level=level, reasons=(reason,) * reasons))

    monkeypatch.setattr(coarser, "try_mesh", attempt)
    list(coarser.coarser_meshes(Trials(fine, better=told.append), loaded))
    more = ["not makeable: strips twist (and 1 more)", "not makeable: strips twist", "makeable"]
    assert [line.rpartition("; ")[2] for line in told] == more
    assert all(line.startswith("best so far: --remesh ") for line in told)
    assert all("about 7680 crossings" in line for line in told)


@pytest.mark.parametrize(("built", "most"), [(False, 0), (True, 1), (True, 3)])
def test_ctrl_c_keeps_what_can_be_built(fine, monkeypatch, built, most):
    loaded, tried = load_asked(fine), []

    def attempt(settings, _given):
        if len(tried) == most:
            raise KeyboardInterrupt
        tried.append(settings)
        stops = Finding(rule="twist", level="not makeable", text="strips twist")
        level = ("makeable", ()) if built else ("not makeable", (stops,))
        return Attempt(settings, loaded, Verdict(level=level[0], reasons=level[1]))

    monkeypatch.setattr(coarser, "try_mesh", attempt)
    search = coarser.coarser_meshes(Trials(fine), loaded)
    if not built:
        with pytest.raises(KeyboardInterrupt):
            list(search)
    else:
        assert {str(one.settings) for one in search} == {str(one) for one in tried}
        assert len(tried) == most


def test_a_way_that_made_no_mesh_is_tried_no_more(fine, monkeypatch):
    tried = []

    def attempt(settings, _given):
        kind, _, _ = settings.mesh.remesh.partition(":")
        tried.append(kind)
        made = None if kind == "quads" else loaded
        return Attempt(settings, made, Verdict(level="makeable", reasons=()))

    loaded = load_asked(fine)
    monkeypatch.setattr(coarser, "try_mesh", attempt)
    list(coarser.coarser_meshes(Trials(fine), loaded))
    assert tried.count("quads") == 1 < tried.count("tubes")


def test_a_model_of_few_faces_is_told_what_can_be_built(tmp_path, monkeypatch):
    """No coarser mesh is tried of it, so none is said to have been."""
    mesh = tmp_path / "cube.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    asked = []
    monkeypatch.setattr(making, "coarser_meshes", lambda *_, **__: pytest.fail("meshes were tried"))
    monkeypatch.setattr(
        making, "what_can_be_built", lambda trials: asked.append(trials.asked) or ""
    )
    settings = Settings.of(str(mesh), size_mm=60.0, material="birch-ply-3", effort="quick")
    with pytest.raises(CannotMakeError):
        make_or_advise(settings, tmp_path / "job")
    assert asked == [settings]


@pytest.mark.parametrize(("parts", "opened"), [(1, True), (2, False)])
def test_no_limb_is_cut_off_by_an_opening(fine, monkeypatch, parts, opened):
    loaded = load_asked(fine)
    stop = Finding(rule="clearance", level="not makeable", text="no room")

    def once(settings, *_):
        if settings.mesh.leave_out is None:
            return Attempt(settings, loaded, Verdict(level="not makeable", reasons=(stop,))), [3]
        return Attempt(settings, loaded, Verdict(level="makeable", reasons=()), parts=parts), []

    monkeypatch.setattr(coarser, "_try_once", once)
    attempt = coarser.try_mesh(fine)
    assert attempt.built == opened
    assert attempt.settings.mesh.leave_out == ("3" if opened else None)
