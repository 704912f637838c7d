"""What collapses is told what makes it stand, and only what did so when it was tried."""

import numpy as np
import pytest
from jobs import laid, plan_job, stations_of

from fabweave.form import woven_net
from fabweave.form.body import RIVETED, body_of
from fabweave.form.hold import pins_of
from fabweave.job import cures
from fabweave.job.cures import stands_as_made
from fabweave.job.letting_go import let_job_go
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.weld import weld_mesh
from fabweave.options.settings import Settings, settings_from_options
from fabweave.ribbon.rules.remedy import Depth

pytestmark = pytest.mark.usefixtures("quick_jobs")
ASKED = Settings.of("shape:octahedron", size_mm=200.0, fasten="all")


@pytest.fixture(scope="module")
def planned():
    woven, settings, _supplies = laid(ASKED)
    return plan_job(woven, settings, depth=Depth.ALONG)


@pytest.fixture
def heavy(planned, monkeypatch):
    """Let all weigh so much that it sags by some 15 % of its size."""
    form = let_job_go(planned, ASKED).settled.form
    times = 0.15 * form.size_mm / form.sags_mm
    monkeypatch.setattr(woven_net, "GRAVITY", times * woven_net.GRAVITY)
    return planned


def test_what_stands_wants_no_cure(planned):
    found = let_job_go(planned, ASKED)
    assert found.settled.form.stands
    assert found.cure == ""


def test_what_is_added_to_the_command_makes_it_stand(heavy):
    found = let_job_go(heavy, ASKED)
    assert found.settled.form.collapse
    name, value = found.cure.split()[:2]
    assert name == "--thickness"
    options = {"size": "200mm", "fasten": "all", "effort": "quick", "thickness": value}
    thicker = settings_from_options(ASKED.mesh.source, **options)
    woven, _, _ = laid(thicker)
    job = stations_of(woven, thicker, Depth.ALONG)
    body = body_of(job.buildable.woven, job.brief)
    assert cures.settle(body, pins_of(body, job.piece_set)).form.stands


def test_no_cure_is_named_that_does_not_stand_as_it_is_made(heavy, monkeypatch):
    monkeypatch.setattr(cures, "stands_as_made", lambda *_: False)
    monkeypatch.setattr(cures, "_on_other_meshes", lambda *_: [])
    assert "makes it stand" not in let_job_go(heavy, ASKED).cure


def test_only_a_former_is_left_where_nothing_stands(heavy, monkeypatch):
    monkeypatch.setattr(cures, "_stands", lambda *_: False)
    monkeypatch.setattr(cures, "_on_other_meshes", lambda *_: [])
    assert let_job_go(heavy, ASKED).cure.startswith("--former auto")


def test_what_glue_cannot_hold_is_not_tried_without(heavy, monkeypatch):
    glued = []
    monkeypatch.setattr(cures, "_stands", lambda _, pieces: glued.append(pieces.glued))
    monkeypatch.setattr(cures, "_on_other_meshes", lambda *_: [])
    let_job_go(heavy, ASKED)
    assert len(glued) > 2
    assert all(glued)


def test_large_objects_are_tried_on_coarser_meshes_alone(heavy, monkeypatch):
    monkeypatch.setattr(cures, "_MOST_TRIED", heavy.weave.threads.n_crossings - 1)
    tried = []
    monkeypatch.setattr(
        cures, "stands_as_made", lambda job, *_: tried.append(job.asked.mesh.remesh)
    )
    assert "coarser" in let_job_go(heavy, ASKED).cure
    assert {str(one).partition(":")[0] for one in tried} == {"quads", "triangles"}


def test_ribs_are_all_strands_of_one_bunch(planned):
    ribs, thicker, _ = cures._stiffer(planned, ASKED)
    own = planned.supplies.only.thickness_mm
    assert len(ribs) == planned.woven.bunches.max() + 1
    for number, one in enumerate(ribs):
        each = [thick for _, thick in one["thickness_mm"]]
        assert each.pop(number) == max(other["thickness_mm"] for other in thicker) > own
        assert each == [own] * len(each)


def test_glue_keeps_all_crossings_from_turning_and_takes_a_dab_each():
    asked = ASKED.but(fasten="glue")
    woven, *_ = laid(asked)
    job = stations_of(woven, asked, Depth.ALONG)
    pieces, count = job.piece_set, job.n_crossings
    # Joints have their fasteners; nothing else has a hole for one.
    joints = {joint.crossing for joint in pieces.joints}
    assert set(np.flatnonzero(pieces.fastened).tolist()) <= joints
    assert np.all(pins_of(body_of(job.planned.woven, job.brief), pieces) == RIVETED)
    bare = stations_of(woven, ASKED.but(fasten="joints"), Depth.ALONG)
    more = job.costs.assembly.practised_h - bare.costs.assembly.practised_h
    assert job.costs.assembly.often("dab") >= count
    assert more == pytest.approx(12.0 / 3600.0 * job.costs.assembly.often("dab"), abs=2e-4)


@pytest.mark.parametrize(("turn_deg", "stands"), [(180.0, False), (360.0, True)])
def test_an_arch_opens_when_it_is_let_go_and_a_tube_does_not(turn_deg, stands):
    turn = np.radians(np.linspace(0.0, turn_deg, 13))
    rows, columns = np.meshgrid(np.linspace(0.0, 120.0, 5), turn, indexing="ij")
    points = np.stack([100.0 * np.cos(columns), rows, 100.0 * np.sin(columns)], axis=-1)
    at = np.arange(rows.size).reshape(rows.shape)
    quads = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1)
    mesh = weld_mesh(PolyMesh.from_faces(points.reshape(-1, 3), quads.reshape(-1, 4)))[0]
    asked = Settings.of("arch.obj", size_mm=200.0, effort="quick", remesh="none")
    assert stands_as_made(Stations(asked, mesh)) == stands
