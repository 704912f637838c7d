"""Designs are tried as they would be made, each once, and the choice follows from figures."""

import json
import math
import re

import numpy as np
import pytest
from designs import outcome
from hypothesis import given
from hypothesis import strategies as st
from mesh_writers import write_mesh

from fabweave.core.parallel.executors import processes
from fabweave.design import search
from fabweave.design.making import make_or_advise, meet_wishes
from fabweave.design.search import Search
from fabweave.design.tried import try_design
from fabweave.design.variety import densities, name_of, variety
from fabweave.design.wishes import Wishes, choose, distance
from fabweave.form.hold import Foretold
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.options.settings import Settings
from fabweave.plan.verdict import NotMakeableError

pytestmark = pytest.mark.usefixtures("quick_jobs")

BALL = Settings.of("shape:icosahedron", size_mm=200.0, effort="quick")
DESIGNS = [BALL, BALL.but(refine="catmull-clark:1"), BALL.but(pattern="twill")]


@pytest.fixture(scope="module")
def tried():
    return Search(BALL, looks=True).add(DESIGNS)


@pytest.mark.slow
def test_what_is_tried_is_what_is_made(tried, tmp_path):
    for at, one in enumerate(tried[:2]):
        job = run_job(Stations(one.design), tmp_path / str(at)).job
        told = one.figures
        assert (told.pieces, told.joints) == (len(job.piece_set.pieces), len(job.piece_set.joints))
        assert told.crossings == job.weave.threads.n_crossings
        assert abs(told.sheets - len(job.layout.sheets)) <= 1
        assert one.verdict.level == job.verdict.level
        assert one.picture.startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_search_with_processes_finds_the_same(tried):
    told = []
    again = Search(BALL, executors=processes(2), told=told.append, looks=True).add(DESIGNS)
    assert [one.record() for one in again] == [one.record() for one in tried]
    assert [one.picture for one in again] == [one.picture for one in tried]
    assert told == again


@pytest.mark.slow
def test_a_mesh_that_was_made_once_serves_all_its_designs(tmp_path, monkeypatch):
    mesh = tmp_path / "ball.obj"
    write_mesh(mesh, parse_shape("shape:sphere?n=8"))
    asked = Settings.of(str(mesh), size_mm=200.0, effort="quick")
    plain = asked.but(remesh="triangles:60")
    designs = [plain, plain.but(pattern="triaxial"), plain.but(material="birch-veneer")]
    apart = [Search(asked).add([one])[0].record() for one in designs]
    meshes, given_meshes = [], []
    real = search.try_design

    def trying(*task, **options):
        *_, mesh, given_mesh = task
        meshes.append(mesh)
        given_meshes.append(given_mesh)
        return real(*task, **options)

    monkeypatch.setattr(search, "try_design", trying)
    together = Search(asked)
    assert [one.record() for one in together.add(designs)] == apart
    assert [one is not None for one in meshes] == [False, True, True]
    # The model is read once for all of them.
    assert given_meshes[0] is given_meshes[1] is given_meshes[2] is not None
    # What was tried is not tried again.
    assert together.add(designs[1:]) == together.tried[1:]
    assert len(meshes) == 3


def test_the_nearest_to_a_wish_is_chosen():
    few, some, many = (outcome(str(n), pieces=n, median_mm=900 / n) for n in (30, 90, 300))
    for wish, best in ((28, few), (100, some), (1000, many)):
        assert choose([many, some, few], Wishes(pieces=wish))[0] is best
    assert choose([few, some, many], Wishes(ribbon_mm=9.0))[0] is some
    # A limit that is kept weighs nothing, one that is passed much.
    cheap, dear = outcome("cheap", sheets=2), outcome("dear", sheets=5)
    assert distance(cheap, Wishes(sheets=3)) == distance(cheap, Wishes(sheets=9))
    assert distance(dear, Wishes(sheets=3)) == pytest.approx(4.0 * math.log(5 / 3))
    assert choose([dear, cheap], Wishes(sheets=3, pieces=12))[0] is cheap


def test_where_a_wish_cannot_be_met_the_nearest_of_the_good_is_chosen():
    bad = outcome("bad", price=(1.0, 3.0), grade=0.0)
    good = outcome("good", price=(4.0, 8.0), grade=9.2)
    best = outcome("best", price=(9.0, 20.0), grade=10.0)
    for budget, chosen in ((1.0, good), (3.5, bad), (9.0, good)):
        assert choose([bad, good, best], Wishes(budget=budget))[0] is chosen
    assert choose([bad, best], Wishes(budget=99.0))[0] is best
    assert choose([bad], Wishes(budget=1.0))[0] is bad


@pytest.mark.parametrize(("far_mm", "holds"), [(19.0, True), (21.0, False)])
def test_what_collapses_when_it_is_let_go_is_not_proposed(far_mm, holds, monkeypatch):
    far = Foretold(far_mm, 0.0, 1.0, np.zeros(0))
    monkeypatch.setattr("fabweave.job.stations.foretell_end", lambda *_: far)
    tried = try_design(Settings.of("shape:cube", size_mm=200.0, effort="quick"), "cube")
    assert tried.makeable == holds
    assert {stop.rule for stop in tried.verdict.stops} == (set() if holds else {"form"})
    # No more is told of it than what it takes to collapse.
    assert tried.figures.form_mm == min(far_mm, 20.0)


@given(st.floats(20.0, 2000.0), st.integers(1, 12))
def test_densities_ascend_within_what_a_person_weaves(radius, count):
    found = densities(parse_shape(f"shape:sphere?n=2&radius={radius:.3f}"), count)
    assert found == sorted(set(found))
    assert 1 <= len(found) <= count
    assert 40 <= found[0] <= found[-1] <= 1500


def test_what_is_stated_is_the_same_in_all_designs(tmp_path):
    mesh = tmp_path / "ball.obj"
    write_mesh(mesh, parse_shape("shape:sphere?n=8"))
    asked = Settings.of(str(mesh), size_mm=300.0, remesh="quads:90", pattern="twill")
    designs = variety(asked, Search(asked).model().mesh, 30)
    assert {(one.mesh.remesh, one.weave.pattern, one.mesh.size_mm) for one in designs} == {
        ("quads:90", "twill", 300.0)
    }
    asked = Settings.of(str(mesh), size_mm=300.0)
    free = variety(asked, Search(asked).model().mesh, 30)
    assert len({name_of(one, asked) for one in free}) == len(free) > 9


@pytest.mark.slow
def test_a_wish_is_met_by_what_is_made(tmp_path):
    mesh = tmp_path / "cube.obj"
    write_mesh(mesh, parse_shape("shape:cube"))
    asked = Settings.of(str(mesh), size_mm=300.0, effort="quick")
    settings, why = meet_wishes(Search(asked, wishes=Wishes(pieces=40)))
    job = run_job(Stations(settings), tmp_path / "job").job
    assert f"{len(job.piece_set.pieces)} pieces" in why
    assert 20 <= len(job.piece_set.pieces) <= 80


@pytest.mark.slow
def test_what_cannot_be_built_is_refused_with_what_can(tmp_path):
    asked = Settings.of("shape:sphere?n=3", size_mm=90.0, material="birch-veneer", effort="quick")
    with pytest.raises(NotMakeableError) as refusal:
        make_or_advise(Stations(asked), tmp_path / "job")
    assert not (tmp_path / "job").exists()
    assert re.search(r"\n  --\w+", str(refusal.value))
    # With --force it is made all the same, says so on each sheet, and is proved.
    finished = make_or_advise(Stations(asked.but(force=True)), tmp_path / "job").finished
    assert finished.proof.ok
    assert finished.job.verdict.forced
    assert json.loads((tmp_path / "job" / "verdict.json").read_text())["forced"] is True
