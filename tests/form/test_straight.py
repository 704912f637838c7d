"""Straight strips: ribbons that unfold to rectangles, flat on one another, beside the mesh."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from elastic_oracle import off_balance
from jobs import laid, run
from sealing import told
from slow import slow_but
from spoiling import edit_json
from trimesh.triangles import closest_point

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.records import to_json
from fabweave.form.body import BARE, body_of
from fabweave.form.relaxed import form_record
from fabweave.form.settle import settle
from fabweave.form.straight import _astray, _exact_conditions
from fabweave.job.ask import brief_of
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.job.write import json_text
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import plain_triangles
from fabweave.options.settings import Settings
from fabweave.piece.development import unfold_threads
from fabweave.ribbon.measures import panel_widths
from fabweave.ribbon.project import crossing_heights
from fabweave.ribbon.rules.rules import measure_clearance
from fabweave.sheet.drawing import Layer, PieceDrawing, Polyline
from fabweave.sheet.kerf import MicroJoints
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.stock.ribbon_limits import thread_limits
from fabweave.stock.sheet_size import parse_roll
from fabweave.weave.pattern import strand_passes
from fabweave.weave.symmetry import find_weave_symmetry

pytestmark = pytest.mark.usefixtures("quick_jobs")

BALL = {
    "source": "shape:icosahedron", "refine": "loop:1", "pattern": "kagome", "strips": "straight",
    "size_mm": 200.0, "effort": "quick",
}  # fmt: skip


def asked(**changes):
    """Return the settings of a small ball of straight strips, with changes."""
    words = {**BALL, **changes}
    refine = words.pop("refine")
    return Settings.of(words.pop("source"), **words, refine=refine)


def tube(rings=5, around=9):
    """Return an open tube of regular triangles."""
    angle = 2 * np.pi / around
    side = 2 * np.sin(angle / 2)
    points, faces = [], []
    for ring in range(rings + 1):
        turn = angle * (np.arange(around) + ring / 2)
        high = np.full(around, ring * side * np.sqrt(3) / 2)
        points.append(np.stack([np.cos(turn), np.sin(turn), high], axis=1))
    for ring in range(rings):
        a, b = ring * around, (ring + 1) * around
        for k in range(around):
            other = (k + 1) % around
            faces += [[a + k, a + other, b + k], [b + k, a + other, b + other]]
    return PolyMesh.from_faces(np.concatenate(points).tolist(), faces)


def torus(around=12, across=6):
    """Return a torus of triangles, every ring turned by half a step."""
    i, j = (index.ravel() for index in np.indices((around, across)))
    u, v = 2 * np.pi * (i + j / 2) / around, 2 * np.pi * j / across
    out = 1 + 0.42 * np.cos(v)
    points = np.stack([out * np.cos(u), out * np.sin(u), 0.42 * np.sin(v)], axis=1)

    def number(a, b):
        # Around the tube once, rings are turned by half of all steps across.
        return ((a + across // 2 * (b == across)) % around) * across + b % across

    one, two = number(i, j), number(i + 1, j)
    up, over = number(i, j + 1), number(i + 1, j + 1)
    faces = np.concatenate([np.stack([one, two, up], 1), np.stack([up, two, over], 1)])
    return PolyMesh.from_faces(points.tolist(), faces.tolist())


@pytest.fixture(scope="module")
def ball():
    return laid(asked())


def off_mesh(woven):
    surface = Surface(*plain_triangles(woven.mesh))
    return surface.feet(woven.ribbons.centre).distances / woven.size_mm


def test_strips_unfold_to_rectangles_of_one_width(ball):
    ribbons = ball[0].ribbons
    strips = unfold_threads(ribbons)
    right, left = (side @ np.array([1.0, 1.0j]) for side in (strips.right, strips.left))
    width = np.abs(left - right)
    assert np.ptp(width) < 1e-9
    for start, end in zip(strips.offsets[:-1], strips.offsets[1:], strict=True):
        # A strip sets off along x, and no rung leaves the two lines of its rails.
        for rail in (right[start:end], left[start:end]):
            assert np.ptp(rail.imag) < 1e-9
            assert np.diff(rail.real).min() > 0.1


def test_strands_lie_flat_on_one_another_as_far_apart_as_they_are_thick(ball):
    woven, settings, supplies = ball
    ribbons, weave = woven.ribbons, woven.weave
    height = crossing_heights(
        weave, supplies.thickness_mm(woven.bunches), settings.ribbons.clearance_mm
    )
    lower, upper = ribbons.entry[strand_passes(weave)].T
    for entry, sign in ((upper, 1.0), (lower, -1.0)):
        for rung in (entry, entry + 1):
            for rail in (ribbons.right, ribbons.left):
                apart = np.einsum("nd,nd->n", rail[rung] - ribbons.centre, ribbons.normal)
                assert apart == pytest.approx(sign * height, abs=1e-8)
    corners = [side[at] for side in (ribbons.right, ribbons.left) for at in (upper, upper + 1)]
    below = [side[at] for side in (ribbons.right, ribbons.left) for at in (lower, lower + 1)]
    apart = sum(corners) / 4 - sum(below) / 4
    assert apart == pytest.approx(2 * height[:, None] * ribbons.normal, abs=1e-8)


def test_how_far_off_the_mesh_they_rest_and_how_much_they_turn_is_so(ball):
    woven, settings, supplies = ball
    body = body_of(woven, brief_of(settings, supplies))
    settled = settle(body, np.full(len(body.places), BARE))
    form = settled.form
    rest = off_balance(woven, json.loads(json_text(to_json(form_record(settled, 0.0)))))["let go"]
    assert rest.energy < 1e-4
    assert rest.balance_mm < 0.01
    corners = woven.mesh.vertices[np.array(woven.mesh.faces())]
    there = (closest_point(corners, np.tile(at, (len(corners), 1))) - at for at in settled.rested)
    away = np.array([np.linalg.norm(arms, axis=1).min() for arms in there])
    for each, most, mean, within in (
        (away, form.model_mm, form.model_mean_mm, 0.006),
        (rest.turn_deg, form.turn_deg, form.turn_mean_deg, 0.001),
    ):
        assert most == pytest.approx(each.max(), abs=within)
        assert mean == pytest.approx(np.sqrt((each**2).mean()), abs=within)


def test_they_stay_near_the_mesh_and_look_outward(ball):
    woven = ball[0]
    assert off_mesh(woven).max() < 0.015
    outward = np.einsum("nd,nd->n", woven.ribbons.normal, woven.ribbons.centre)
    assert outward.min() > 0.0


def test_the_width_that_is_asked_for_is_that_of_all_strips(ball):
    own = laid(asked(width=replace(ball[1].ribbons.width_rule, most_mm=5.0, least_mm=5.0)))[0]
    width = np.linalg.norm(own.ribbons.left - own.ribbons.right, axis=1)
    assert width == pytest.approx(5.0, abs=1e-9)


@pytest.mark.parametrize("long", slow_but([1.6, 1.0, 2.2]))
def test_strips_leave_each_other_room_on_long_eggs_too(ball, long):
    """Crossings along a long egg are sharp: they open, and strips need not be narrower for it."""
    mesh = ball[0].mesh
    egg = mesh.with_vertices(mesh.vertices * [1.0, 1.0, long])
    woven, settings, supplies = laid(asked(source="egg", refine=None), egg)
    limits = thread_limits(supplies, woven.bunches, settings.ribbons.clearance_mm)
    near, _ = measure_clearance(woven.ribbons, woven.weave, limits)
    assert not len(near.value)
    assert off_mesh(woven).max() < 0.03
    room = laid(asked(source="egg", refine=None, strips="wavy"), egg)[0].ribbons
    least = np.quantile(panel_widths(room).min(axis=1), 0.05)
    assert panel_widths(woven.ribbons) == pytest.approx(least, rel=1e-6)


@pytest.mark.slow
def test_a_torus_keeps_its_symmetry():
    """Its inside has hollow edges, of which either side is as near."""
    woven, *_ = laid(asked(source="torus", refine=None), torus())
    found = find_weave_symmetry(woven.mesh, woven.halfedges, woven.weave)
    group, images = found.group, found.crossing_images(np.arange(woven.weave.threads.n_crossings))
    assert group.order >= 12
    place = woven.ribbons.centre - group.centre
    for matrix, there in zip(group.matrix, images, strict=True):
        assert place @ matrix.T == pytest.approx(place[there], abs=1e-3)


def test_how_conditions_change_is_right(ball):
    woven, settings, supplies = ball
    ribbons = woven.ribbons
    height = crossing_heights(
        woven.weave, supplies.thickness_mm(woven.bunches), settings.ribbons.clearance_mm
    )
    width = float(np.linalg.norm(ribbons.left[0] - ribbons.right[0]))
    conditions = _exact_conditions(ribbons, woven.weave, width, height)
    points = np.concatenate([ribbons.right, ribbons.left])
    off, change = conditions.off(points)
    assert np.abs(off).max() < 1e-9
    way = np.random.default_rng(3).normal(size=points.shape)
    step = 1e-5
    told_ = (conditions.off(points + step * way)[0] - conditions.off(points - step * way)[0]) / 2
    assert change @ way.T.ravel() == pytest.approx(told_ / step, abs=1e-6)


def test_strips_that_leave_their_edges_are_noticed(ball):
    woven, ribbons = ball[0], ball[0].ribbons
    assert not _astray(woven, ribbons).any()
    assert _astray(woven, replace(ribbons, right=ribbons.left, left=ribbons.right)).all()
    assert _astray(woven, replace(ribbons, right=-ribbons.right, left=-ribbons.left)).all()
    # One strip is turned about the normal of a crossing until it goes where the other one does.
    turned, entry = ribbons.left.copy(), int(ribbons.entry[0])
    at = [entry, entry + 1]
    middle = (ribbons.right[at] + ribbons.left[at]) / 2
    turned[at] = ribbons.right[at] + 3 * (middle[1] - middle[0]) * np.array([[1.0], [-1.0]])
    astray = _astray(woven, replace(ribbons, left=turned))
    assert astray.tolist().count(True) == 1
    assert astray[woven.weave.threads.crossing[0]]


def test_strips_that_turn_back_are_refused():
    with pytest.raises(CannotMakeError):
        laid(asked(source="tube", refine=None, boundary="turn"), tube())


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "job"
    # Ends that are butted are square, too; what is to lie edge on edge lies a kerf apart.
    job, proof, *_ = run_job(Stations(asked(kerf_mm=0.2, gap_mm=0.0, joint="none")), folder)
    assert {"cut", "form", "unfolding"} <= {check.name for check in proof.checks if check.ok}
    return job, folder


@pytest.fixture
def spoilt(made, tmp_path):
    return made[0], shutil.copytree(made[1], tmp_path / "job")


def test_a_job_is_proved_and_tells_what_it_comes_to(made):
    job, folder = made
    form = json.loads((folder / "verdict.json").read_text("utf-8"))["form"]
    assert 0.0 < form["model_mean_mm"] < form["model_mm"] < 0.03 * form["size_mm"]
    assert 0.0 < form["turn_mean_deg"] < form["turn_deg"] < 2.0
    # Every edge that two strips share is cut once: less than two thirds of all outlines.
    whole, common = (
        sum(
            np.hypot(
                *np.diff(entity.points[[*range(len(entity.points)), *closing]], axis=0).T
            ).sum()
            for piece in drawing.pieces
            for entity in piece.entities
            if entity.layer is Layer.CUT_OUTER
            for closing in [[0] if entity.closed else []]
        )
        for drawing in (job.drawings[0], job.kerfed[0])
    )
    assert common < 0.67 * whole


def without_a_run(drawing):
    first, *others = drawing.pieces
    cut = next(one for one in first.entities if one.layer is Layer.CUT_OUTER)
    kept = tuple(one for one in first.entities if one is not cut)
    return replace(drawing, pieces=(PieceDrawing(first.piece_id, kept), *others))


def cut_twice(drawing):
    first, *others = drawing.pieces
    cut = next(one for one in first.entities if one.layer is Layer.CUT_OUTER)
    again = PieceDrawing(first.piece_id, (*first.entities, replace(cut, points=cut.points[:2])))
    return replace(drawing, pieces=(again, *others))


def with_another_cut(drawing):
    first, *others = drawing.pieces
    cut = next(one for one in first.entities if one.layer is Layer.CUT_OUTER)
    middle = (cut.points[0] + cut.points[1]) / 2
    more = Polyline(Layer.CUT_OUTER, np.stack([middle, middle + np.array([3.0, 3.0])]))
    return replace(drawing, pieces=(PieceDrawing(first.piece_id, (*first.entities, more)), *others))


def moved(drawing):
    first, *others = drawing.pieces
    entities = tuple(
        replace(one, points=one.points + np.array([0.0, 0.3]))
        if one.layer is Layer.CUT_OUTER
        else one
        for one in first.entities
    )
    return replace(drawing, pieces=(PieceDrawing(first.piece_id, entities), *others))


@pytest.mark.slow
@pytest.mark.parametrize("spoil", [without_a_run, cut_twice, with_another_cut, moved])
def test_other_cuts_are_found(spoilt, spoil):
    job, folder = spoilt
    drawing = spoil(job.kerfed[0])
    (folder / "cut" / f"{drawing.name}.dxf").write_bytes(dxf_bytes(drawing))
    (folder / "cut" / f"{drawing.name}.svg").write_bytes(svg_text(drawing).encode())
    assert set(told(folder)) & {"cut", "lines"}


@pytest.mark.parametrize(
    "wish", [{"micro_joints": MicroJoints(3)}, {"gap_mm": (("warp", 0.0), ("weft", 2.0))}]
)
def test_strips_edge_on_edge_that_cannot_share_cuts_are_refused(wish):
    with pytest.raises(InputError, match="--gap"):
        asked(**{"gap_mm": 0.0, **wish})
    assert not asked(gap_mm=2.0, micro_joints=MicroJoints(3)).common_cuts


@pytest.mark.parametrize("joint", ["rivet:2", "tuck", "none", "dovetail"])
def test_straight_strips_share_cuts_where_nothing_parts_them(joint):
    assert asked(joint=joint, gap_mm=0.0).common_cuts
    # What is no rectangle does not lie edge on edge unless it is asked to.
    assert asked(joint=joint).common_cuts == (joint != "dovetail")
    assert not asked(joint=joint, gap_mm=1.0).common_cuts


@pytest.mark.slow
def test_a_gap_that_is_asked_for_parts_the_cuts(tmp_path):
    words = [
        "shape:icosahedron", "--refine", "loop:1", "--pattern", "kagome", "--strips", "straight",
        "--size", "200mm", "--effort", "quick", "--gap", "3mm", "-q",
    ]  # fmt: skip
    assert run("make", *words, "-o", tmp_path / "job") == 0
    assert not (tmp_path / "job" / "cut").exists()


@pytest.fixture(scope="module")
def tucked(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tucked") / "job"
    rolls = (parse_roll("roll:8mm:20m"),)
    job, proof, *_ = run_job(Stations(asked(sheets=rolls, joint="tuck", fastener="none")), folder)
    assert proof.ok
    return job, folder


@pytest.mark.slow
def test_each_ring_is_one_strip_off_the_roll_that_laps_its_own_start(tucked):
    pieces, strips = tucked[0].piece_set, unfold_threads(tucked[0].woven.ribbons)
    length = strips.right[strips.offsets[1:] - 1, 0] - strips.right[strips.offsets[:-1], 0]
    assert [joint.pieces for joint in pieces.joints] == [(n, n) for n in range(len(length))]
    for piece, joint in zip(pieces.pieces, pieces.joints, strict=True):
        assert joint.kind.name == "tuck"
        assert np.ptp(piece.outline[:, 0]) == pytest.approx(
            length[piece.thread] + joint.lap_mm, abs=2 * pieces.fit_mm
        )


@pytest.mark.slow
@pytest.mark.parametrize("change", [-8.0, 8.0])
def test_a_ring_that_laps_its_own_start_elsewhere_is_found(tucked, tmp_path, change):
    folder = shutil.copytree(tucked[1], tmp_path / "job")

    def shift(plan):
        plan["joints"][0]["ahead_mm"] += change

    edit_json(folder / "crossing_map.json", shift)
    assert {"joints", "unfolding"} <= set(told(folder))
