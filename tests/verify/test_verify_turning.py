"""Threads that turn back at the boundary are proved, and every false claim of it is found."""

import itertools

import numpy as np
import pytest
from sealing import verify_job
from verify_specimen import make_specimen, octahedron, saddle
from verify_writers import write_job, write_mesh
from weaving_meshes import walked

from fabweave.mesh.polymesh import PolyMesh
from fabweave.verify.check.space import check_turns, turns_after
from fabweave.verify.measure.walks import Pass, trace_walks
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.mesh import read_obj
from fabweave.verify.report import Tally
from fabweave.weave.twill.conditions import twill_conditions
from fabweave.weave.twill.decide import decide_twill


def failed(specimen, folder):
    return set(verify_job(write_job(specimen, folder)).failed)


def test_a_plan_that_claims_to_turn_but_ends_is_found(tmp_path):
    ending = make_specimen(saddle(), joints=1)
    assert failed(ending, tmp_path / "true") == set()
    ending.boundary = "turn"
    assert failed(ending, tmp_path / "false") == {"mesh-walks", "pattern", "space"}


def test_where_a_twill_breaks_at_turns_is_counted(tmp_path):
    points, faces = saddle()
    halfedges, threads = walked(PolyMesh.from_faces(points, faces), turn=True)
    twist = decide_twill(twill_conditions(halfedges, threads)).twist
    first = threads.crossing_halfedge
    ends = np.sort(np.column_stack([halfedges.tail[first], halfedges.head[first]]), axis=1)
    sense = dict(zip(map(tuple, ends.tolist()), twist.tolist(), strict=True))
    specimen = make_specimen((points, faces), pattern="twill", sense=sense, turning=True)
    claim = specimen.plan["weave"]
    threads = [thread["over"] for thread in specimen.plan["threads"]]
    # Its conditions hold, so what breaks along its rings breaks at turns.
    true = sum(over[at] == over[at - 2] for over in threads for at in range(len(over)))
    assert true > 0
    for told in (None, true, true - 1, true + 1):
        claim["broken_at_turns"] = told or 0
        assert failed(specimen, tmp_path / str(told)) == (set() if told == true else {"pattern"})


@pytest.mark.parametrize("claim", ["end", None])
def test_a_plan_that_claims_to_end_but_turns_is_found(claim, tmp_path):
    turning = make_specimen(saddle(), turning=True)
    turning.boundary = claim
    assert failed(turning, tmp_path) == {"mesh-walks", "pattern", "space"}


def test_another_word_for_the_boundary_is_found(tmp_path):
    closed = make_specimen(octahedron(), joints=2)
    for word, objecting in (("end", set()), ("turn", set()), ("bend", {"mesh-walks"})):
        closed.boundary = word
        assert failed(closed, tmp_path / word) == objecting


def test_a_ribbon_that_reaches_beyond_the_boundary_is_found(tmp_path):
    # Everything else of the job is made from that ribbon, so nothing else objects.
    assert failed(make_specimen(saddle(), turning=True, rim=1.0), tmp_path / "a") == set()
    report = verify_job(write_job(make_specimen(saddle(), turning=True, rim=1.01), tmp_path / "b"))
    assert report.failed == ("space",)
    (check,) = [check for check in report.checks if not check.ok]
    assert check.found == 16  # the sixteen boundary edges of four by four squares
    assert "leaves its triangle by 0.2" in check.findings[0]


def test_a_ribbon_that_cuts_across_instead_of_turning_is_found(tmp_path):
    report = verify_job(write_job(make_specimen(saddle(), turning=True, rim=None), tmp_path))
    # It runs into those that it would have gone round, too.
    assert report.failed == ("space", "clearance")
    check = next(check for check in report.checks if check.name == "space")
    assert "its ribbon has 0 rungs there" in check.findings[0]


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    """Return a mesh of three by three squares and its three walks."""
    specimen = make_specimen(saddle(3), turning=True)
    folder = tmp_path_factory.mktemp("mesh")
    write_mesh(specimen, folder)
    mesh = read_obj(folder / "woven_mesh.obj")
    return mesh, trace_walks(mesh, turning=True)


def strip_of(mesh, walk):
    """Lay rungs along a walk: two at each crossing, anywhere, and two in each triangle."""
    rungs, entry = [], []
    for step in walk.passes:
        entry.append(len(rungs))
        rungs += [np.zeros((2, 3)), np.ones((2, 3))]
        for turn in turns_after(step, mesh):
            ends = mesh.vertices[mesh.corner[[turn.side, mesh.next[turn.side]]]]
            centre = mesh.centres[mesh.face[turn.side]]
            for u in (0.3, 0.6) if turn.forward else (0.6, 0.3):
                point = (1 - u) * ends[0] + u * ends[1]
                rung = [0.1 * centre + 0.9 * point, 0.7 * centre + 0.3 * point]
                rungs.append(np.array(rung if turn.forward else rung[::-1]))
    entry = np.array(entry)
    return Strip("A", True, entry, entry + 1, np.array(rungs), np.ones(len(rungs), bool), 1e-6)


def findings(strip, walk, mesh):
    tally = Tally("space")
    check_turns(strip, walk.passes, mesh, tally, turning=True)
    return tally.result()


def spoil_plane(rungs):
    rungs[0, 0] += [0.0, 0.0, 0.02]


def spoil_place(rungs):
    rungs += 5.0 * np.sign(rungs.mean(axis=(0, 1)) - [60.0, 60.0, 0.0]) * [1.0, 1.0, 0.0]


def spoil_order(rungs):
    rungs[:] = rungs[::-1].copy()


def spoil_sides(rungs):
    rungs[:] = rungs[:, ::-1].copy()


def spoil_number(rungs):
    rungs[0, 1, 2] = np.nan


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (None, None),
        (spoil_plane, "leaves its triangle by 0.0"),
        (spoil_place, "leaves its triangle by"),
        (spoil_order, "does not follow the edge"),
        (spoil_sides, "right and left are exchanged"),
        (spoil_number, "leaves its triangle by nan"),
    ],
)
def test_each_rule_of_a_turn_objects(turning, spoil, words):
    mesh, walks = turning
    for walk in walks:
        strip = strip_of(mesh, walk)
        at = next(k for k, step in enumerate(walk.passes) if turns_after(step, mesh))
        if spoil is None:
            result = findings(strip, walk, mesh)
            assert result.ok
            assert result.count >= 4  # each thread turns at four sides
            continue
        first = strip.exit[at] + 1
        spoil(strip.rungs[first : first + 2])
        result = findings(strip, walk, mesh)
        assert any(words in finding for finding in result.findings), result.findings


def test_turns_are_nothing_to_threads_that_end(turning):
    mesh, walks = turning
    strip = strip_of(mesh, walks[0])
    strip.rungs[:] = 0.0
    tally = Tally("space")
    check_turns(strip, walks[0].passes, mesh, tally, turning=False)
    assert tally.result().count == 0


def test_walks_turn_as_a_mirror_drawing(turning):
    mesh, walks = turning
    assert [len(walk.passes) for walk in walks] == [8, 8, 8]
    assert all(walk.closed for walk in walks)
    sides = [
        turn.side for walk in walks for step in walk.passes for turn in turns_after(step, mesh)
    ]
    assert sorted(sides) == np.flatnonzero(mesh.twin < 0).tolist()
    for walk in walks:
        for one, two in itertools.pairwise(walk.passes):
            assert one.forward != two.forward


def test_turns_follow_from_a_pass(turning):
    # Into the corner square 0-4-5-1 from its side 4-5: along its sides 0-4 and 1-0, backwards,
    # or on to its inner side 5-1.
    mesh, _ = turning
    corner = mesh.corner[:4].tolist()
    assert corner == [0, 4, 5, 1]
    across = int(mesh.twin[1])
    assert turns_after(Pass(across, True), mesh) == [Pass(0, False), Pass(3, False)]
    assert turns_after(Pass(across, False), mesh) == []
