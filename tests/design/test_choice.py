"""A model that is too fine to be built is made on a coarser mesh, unless its mesh is to be kept."""

from dataclasses import replace

import numpy as np
import pytest
from designs import outcome
from jobs import contents_of
from mesh_writers import write_mesh

from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Finding
from fabweave.design import choice, search, tried
from fabweave.design.beside import SOFT
from fabweave.design.choice import beside_it, mesh_rounds, what_can_be_built
from fabweave.design.making import make_or_advise
from fabweave.design.search import Search
from fabweave.design.tried import try_design
from fabweave.design.variety import is_free, two_digits
from fabweave.design.wishes import NO_WISHES, UNBUILT, Wishes, rank
from fabweave.job.run import run_job
from fabweave.job.stations import Stations, remeshed_by
from fabweave.mesh.leave_out import parse_leave_out
from fabweave.mesh.likeness import likeness
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import mid_edge
from fabweave.options.settings import Settings, read_job_options
from fabweave.plan.verdict import Verdict
from fabweave.ribbon.width import WidthRule

BAD = Verdict(
    level="not makeable",
    reasons=(Finding(rule="twist", level="not makeable", text="strips twist"),),
)


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
    made = make_or_advise(Stations(fine), tmp_path / "plain")
    chosen = made.job.asked
    assert not made.finished.job.verdict.stops
    assert made.finished.proof.ok
    assert made.finished.job.woven.mesh.n_faces < 512
    # What is not said of the mesh is as it was asked for, and job.toml has what was made.
    assert chosen.but(remesh=None, bodies="all") == fine
    assert read_job_options(tmp_path / "plain" / "job.toml")["remesh"] == chosen.mesh.remesh
    assert f"--remesh {chosen.mesh.remesh}: " in made.chosen
    assert "5,120 triangles" in made.chosen
    # Asked for by hand, it comes to the very same files.
    run_job(Stations(chosen), tmp_path / "stated")
    assert contents_of(tmp_path / "plain") == contents_of(tmp_path / "stated")


@pytest.mark.slow
def test_a_mesh_that_is_to_be_kept_is_refused_with_what_can_be_built(fine, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(choice, "mesh_rounds", lambda *_, **__: pytest.fail("meshes were tried"))
    monkeypatch.setattr(choice, "what_can_be_built", lambda found: asked.append(found.asked) or "")
    with pytest.raises(CannotMakeError):
        make_or_advise(Stations(fine.but(remesh="none")), tmp_path / "job")
    assert asked == [fine.but(remesh="none")]
    assert not (tmp_path / "job").exists()


@pytest.mark.slow
def test_what_is_good_as_it_is_stays(tmp_path):
    mesh = tmp_path / "cube.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    asked = Settings.of(str(mesh), size_mm=200.0, effort="quick")
    made = make_or_advise(Stations(asked), tmp_path / "job")
    assert (made.job.asked, made.chosen) == (asked, "")
    assert "remesh" not in read_job_options(tmp_path / "job" / "job.toml")


@pytest.mark.slow
def test_what_is_foreseen_comes_true(fine, tmp_path):
    kept = fine.but(remesh="none")
    worst = Stations(kept).foreseen[0]
    assert (worst.rule, worst.limit) == ("width", 1.0)
    assert worst.value < 1.0
    with pytest.raises(CannotMakeError):
        run_job(Stations(kept), tmp_path / "job")
    # At six times the size its ribbons are six times as wide.
    larger = kept.but(size_mm=6.0 * fine.mesh.size_mm)
    assert Stations(larger).foreseen == []


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


def test_good_grades_come_first_and_limbs_and_evenings_count():
    ball = parse_shape("shape:sphere?n=8")
    loaded = Stations(Settings.of("shape:sphere?n=8")).loaded

    def graded(grade, away=0.001, **figures):
        """A mesh that is so far from its model everywhere, as a share of its size."""
        mesh = ball.with_vertices(ball.vertices * (1.0 + 2.0 * away))
        made = replace(loaded, likeness=likeness(ball, mesh))
        return replace(outcome(grade=grade, **figures), loaded=made)

    order = [
        graded(9.0, hours=(3.0, 6.0)),
        graded(9.5, hours=(9.0, 18.0)),
        graded(7.0, hours=(1.0, 2.0)),
        # What is hardly the model goes behind, however well it is built, and so does what daunts.
        graded(9.5, away=0.03, hours=(1.0, 2.0)),
        graded(9.5, median_mm=4.9),
        graded(9.4, crossings=1001),
        outcome("bad", BAD),
    ]
    ranks = [rank(one, NO_WISHES) for one in order]
    assert ranks == sorted(set(ranks))


FALLS = Verdict(
    level="not makeable", reasons=(Finding(rule="form", level="not makeable", text="it falls"),)
)


def test_what_does_not_stand_by_itself_goes_behind_what_does():
    soft = outcome("soft", FALLS, grade=8.0)
    order = [outcome(grade=6.1), outcome(grade=1.0), soft, outcome(grade=9.0, median_mm=4.9)]
    ranks = [rank(one, NO_WISHES) for one in order]
    assert ranks == sorted(set(ranks))
    # Who wishes for something gets what stands, and what else stops a design is never passed over.
    assert rank(soft, Wishes(pieces=10)) == UNBUILT
    worse = Verdict(level="not makeable", reasons=(*FALLS.reasons, *BAD.reasons))
    assert rank(outcome("worse", worse, grade=8.0), NO_WISHES) == UNBUILT


@pytest.mark.parametrize(("form_mm", "unsure"), [(2.0, False), (9.0, True), (None, False)])
def test_what_is_foretold_to_go_far_is_let_go_before_it_is_chosen(form_mm, unsure):
    """A ball of 200 mm collapses where it goes 20 mm: a foretelling is rough."""
    loaded = Stations(Settings.of("shape:sphere?n=4", size_mm=200.0)).loaded
    found = replace(outcome(form_mm=form_mm), loaded=loaded)
    assert (found.unsure, found.makeable, found.soft) == (unsure, True, False)
    assert (found.fallen.unsure, found.fallen.makeable, found.fallen.soft) == (False, False, True)


def standing_in(tries, loaded, verdicts=()):
    """Return what stands in for trying: each design comes to the next verdict, or can be built."""
    left = list(verdicts)

    def trying(design, name, *_, **__):
        tries.append(design)
        verdict = left.pop(0) if left else None
        found = outcome(name, verdict, design=design, grade=3.0)
        return replace(found, loaded=loaded(design) if callable(loaded) else loaded)

    return trying


def with_another(mesh, move):
    """Return a mesh and the same beside it."""
    beside = mesh.with_vertices(mesh.vertices + np.array([70.0 * move, 0.0, 0.0]))
    return PolyMesh(
        np.concatenate([mesh.vertices, beside.vertices]),
        np.concatenate([mesh.offsets, mesh.offsets[-1] + mesh.offsets[1:]]),
        np.concatenate([mesh.indices, mesh.n_vertices + mesh.indices]),
    )


def bowl_of(ball):
    """Return the lower part of a ball of triangles."""
    faces = ball.indices.reshape(-1, 3)
    return PolyMesh.from_faces(ball.vertices, faces[ball.vertices[faces].max(axis=1)[:, 2] < 15.0])


@pytest.mark.parametrize(("move", "bodies"), [(0.4, "wrap"), (3.0, "all"), (None, "all")])
def test_bodies_that_run_through_one_another_are_wrapped_first(fine, monkeypatch, move, bodies):
    ball = Stations(fine).loaded.mesh
    if move is not None:
        ball = with_another(ball, move)
    tries = []
    loaded = Stations(fine, ball).loaded
    monkeypatch.setattr(search, "try_design", standing_in(tries, loaded))
    found = Search(fine)
    found.run(mesh_rounds(found, loaded))
    assert len(found.tried) == len(tries) > 0
    assert {one.mesh.bodies for one in tries} == {bodies}


def test_what_is_open_is_never_wrapped(fine, monkeypatch):
    """A bowl that runs through itself stays a bowl, though none of its meshes can be made."""
    loaded = Stations(fine, bowl_of(Stations(fine).loaded.mesh)).loaded
    tries = []
    monkeypatch.setattr(search, "try_design", standing_in(tries, None, [BAD] * 20))
    found = Search(fine)
    found.run(mesh_rounds(found, replace(loaded, clashes=9)))
    assert {one.mesh.bodies for one in tries} == {"all"}
    assert tries[0].mesh.remesh.startswith("grid:")  # a disc has one


def test_open_bodies_that_run_through_one_another_are_tried_wrapped_and_as_they_are(
    fine, monkeypatch
):
    """As those of a teapot, whose spout and handle are open where they go into the pot."""
    loaded = Stations(fine, with_another(bowl_of(Stations(fine).loaded.mesh), 0.4)).loaded
    tries = []
    monkeypatch.setattr(search, "try_design", standing_in(tries, None, [BAD] * 20))
    found = Search(fine)
    found.run(mesh_rounds(found, loaded))
    assert tries[0].mesh.bodies == "wrap"
    assert {one.mesh.bodies for one in tries} == {"wrap", "all"}


@pytest.mark.parametrize(("grade", "kept"), [(7.5, True), (6.5, False)])
def test_a_mesh_that_is_good_is_kept_and_else_competes(fine, monkeypatch, grade, kept):
    tries = []

    def trying(design, name, *_, **__):
        tries.append(design)
        return replace(outcome(name, design=design, grade=grade), loaded=Stations(fine).loaded)

    monkeypatch.setattr(search, "try_design", trying)
    found = Search(fine)
    found.run(mesh_rounds(found, Stations(fine).loaded, own=True))
    assert tries[0] == fine
    assert (len(tries) == 1) is kept
    assert all(one.mesh.remesh for one in tries[1:])


@pytest.mark.slow
def test_where_no_mesh_can_be_built_it_is_refused(fine, tmp_path):
    with pytest.raises(CannotMakeError, match="--material card"):
        make_or_advise(Stations(fine.but(material="birch-ply-3")), tmp_path / "job")
    assert not (tmp_path / "job").exists()


def test_ways_out_of_what_cannot_be_built_can_be(monkeypatch):
    tries = []

    def trying(design, name, *_, **__):
        tries.append(design)
        verdict = None if design.stock.material == SOFT else BAD
        return replace(outcome(str(len(tries)), verdict, design=design), name=name, excess=2.0)

    monkeypatch.setattr(search, "try_design", trying)
    asked = Settings.of("shape:torus?m=8&n=4", size_mm=120.0, material="birch-ply-3")
    told = what_can_be_built(Search(asked))
    assert any((one.mesh.size_mm or 0.0) > 120.0 for one in tries)
    assert tries[-1].stock.material == SOFT
    assert [line.count("--material card") for line in told.splitlines()] == [0, 1]


@pytest.mark.parametrize(("pinched", "opened"), [([40], True), (list(range(0, 216, 9)), False)])
def test_a_mesh_is_opened_where_a_few_places_stop_it(pinched, opened):
    """Faces pinched to a twentieth leave ribbons no room: few are left out, many are not."""
    ball = parse_shape("shape:sphere?n=6&radius=100")
    points, quads = ball.vertices.copy(), ball.indices.reshape(-1, 4)
    for face in pinched:
        corners = points[quads[face]]
        points[quads[face]] = corners.mean(axis=0) + 0.05 * (corners - corners.mean(axis=0))
    asked = Settings.of("ball.obj", size_mm=200.0, remesh="quads:216")
    remeshed = replace(Stations(asked, ball).loaded.remeshed, mesh=ball.with_vertices(points))
    attempt = try_design(asked, "ball", ball.with_vertices(points), remeshed, opens=True)
    gone = parse_leave_out(attempt.design.mesh.leave_out).faces
    assert attempt.makeable == opened
    assert attempt.design.but(leave_out=None) == asked
    assert set(gone) >= set(pinched) if opened else not gone
    assert len(gone) <= 0.06 * 216
    # What was opened is what its settings make.
    assert attempt.loaded.mesh.n_faces == 216 - len(gone)


def test_only_what_is_better_than_all_before_it_is_told(monkeypatch):
    told, grades = [], {40: 3.0, 50: 2.0, 60: 5.0, 70: 5.0, 80: 8.0}

    def trying(design, name, *_, **__):
        return outcome(name, design=design, grade=grades[int(design.mesh.remesh.split(":")[1])])

    monkeypatch.setattr(search, "try_design", trying)
    asked = Settings.of("a.obj")
    Search(asked, better=told.append).add(asked.but(remesh=f"quads:{n}") for n in grades)
    assert [line.split(":")[2] for line in told] == ["40", "60", "80"]
    assert all(line.startswith("best so far: --remesh quads:") for line in told)


@pytest.mark.parametrize(("grade", "there"), [(6.0, {"finer"}), (1.0, set())])
def test_nobody_is_sent_to_what_is_far_worse(monkeypatch, grade, there):
    grades = {40: 8.0, 80: grade}

    def trying(design, name, *_, **__):
        faces = int(design.mesh.remesh.split(":")[1])
        return outcome(name, design=design, grade=grades[faces], crossings=2 * faces)

    monkeypatch.setattr(search, "try_design", trying)
    found = Search(Settings.of("a.obj"))
    chosen, _ = found.add(found.asked.but(remesh=f"quads:{n}") for n in grades)
    assert set(beside_it(found, chosen)) == there


@pytest.mark.parametrize(("built", "most"), [(False, 0), (True, 1), (True, 3)])
def test_ctrl_c_keeps_what_can_be_built(fine, monkeypatch, built, most):
    loaded, tries = Stations(fine).loaded, []
    makes = standing_in(tries, loaded, [] if built else [BAD] * 9)

    def trying(*task, **options):
        if len(tries) == most:
            raise KeyboardInterrupt
        return makes(*task, **options)

    monkeypatch.setattr(search, "try_design", trying)
    found = Search(fine, partly=True)
    if not built:
        with pytest.raises(KeyboardInterrupt):
            found.run(mesh_rounds(found, loaded))
    else:
        found.run(mesh_rounds(found, loaded))
        assert [one.design for one in found.tried] == tries
        assert len(tries) == most


def test_a_kind_far_behind_is_tried_no_more_and_neighbours_of_the_best_are(fine, monkeypatch):
    loaded, tries = Stations(fine).loaded, []

    def trying(design, name, *_, **__):
        tries.append(design.mesh.remesh)
        grade = 4.0 if design.mesh.remesh.startswith("rings") else 0.5
        return replace(outcome(name, design=design, grade=grade), loaded=loaded)

    monkeypatch.setattr(search, "try_design", trying)
    found = Search(fine)
    found.run(mesh_rounds(found, loaded))
    kinds = [one.partition(":")[0] for one in tries]
    assert kinds.count("quads") == kinds.count("tubes") == 1
    best = int(found.ranked[0].design.mesh.remesh.partition(":")[2])
    counts = [int(one.partition(":")[2]) for one in tries if one.startswith("rings")]
    assert {two_digits(share * best) for share in (0.8, 1.25)} <= set(counts)


def test_designs_share_a_mesh_where_only_later_steps_differ():
    one = Settings.of("a.obj", size_mm=90.0, remesh="quads:90")
    same = [one.but(pattern="twill"), one.but(leave_out="3"), one.but(thickness_mm=1.0, fair=0)]
    assert {remeshed_by(other) for other in same} == {remeshed_by(one)}
    others = [
        one.but(size_mm=91.0),
        one.but(remesh="quads:91"),
        one.but(bodies="wrap"),
        one.but(seed=1),
    ]
    assert len({remeshed_by(other) for other in (one, *others)}) == 5


def test_a_way_that_made_no_mesh_is_tried_no_more(fine, monkeypatch):
    loaded, tries = Stations(fine).loaded, []

    def made(design):
        return None if design.mesh.remesh.startswith("quads") else loaded

    monkeypatch.setattr(search, "try_design", standing_in(tries, made, [BAD] * 20))
    found = Search(fine)
    found.run(mesh_rounds(found, loaded))
    kinds = [one.mesh.remesh.partition(":")[0] for one in tries]
    assert kinds.count("quads") == 1 < kinds.count("tubes")
    assert "rings" in kinds


@pytest.mark.parametrize(("bodies", "opened"), [(1, True), (2, False)])
def test_no_limb_is_cut_off_by_an_opening(fine, monkeypatch, bodies, opened):
    loaded, design = Stations(fine).loaded, fine.but(remesh="quads:90")

    def once(design, *_, **__):
        if design.mesh.leave_out is None:
            stopped = replace(outcome(verdict=BAD, design=design), loaded=loaded)
            return tried._Once(stopped, None, (3,))
        made = replace(outcome(design=design), loaded=loaded)
        return tried._Once(made, None, bodies=bodies)

    monkeypatch.setattr(tried, "_try_once", once)
    attempt = try_design(design, "D", opens=True)
    assert attempt.makeable == opened
    assert attempt.design.mesh.leave_out == ("3" if opened else None)


@pytest.mark.parametrize(("ringed", "verdict"), [(True, None), (True, BAD), (False, None)])
def test_rings_come_first_for_a_twill_and_win_where_they_are_exact(
    fine, monkeypatch, ringed, verdict
):
    loaded, tries = Stations(fine).loaded, []
    monkeypatch.setattr(choice, "ring_rows", lambda _: np.zeros(1) if ringed else None)
    verdicts = [verdict, *[BAD] * 20]
    monkeypatch.setattr(search, "try_design", standing_in(tries, lambda _: loaded, verdicts))
    found = Search(fine.but(pattern="twill"))
    found.run(mesh_rounds(found, loaded))
    kinds = [one.mesh.remesh.partition(":")[0] for one in tries]
    assert kinds[0] == "rings"
    assert (len(kinds) == 1) == (ringed and verdict is None)
