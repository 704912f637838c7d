"""Joined pieces give back their thread, whatever the joint: station by station, hole on hole."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from random_jobs import random_job
from splitting import split_threads
from weaving_meshes import meshes

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.upright import resize_mesh
from fabweave.piece.development import unfold_threads
from fabweave.piece.joint.holes import PITCH_D, SLIDE_D, HoleRule, slot_path
from fabweave.piece.joint.kinds import (
    CLEARANCE_MM,
    GLUE,
    KINDS,
    JointRule,
    dovetail,
    dovetail_room,
    parse_joint,
    slot_room,
    tab_in_slot,
)
from fabweave.piece.joint.planning import plan_joints
from fabweave.piece.outline import STRAIGHT_MM
from fabweave.piece.pieces import PieceSet, build_pieces
from fabweave.ribbon.project import project_ribbons, smooth_ribbons
from fabweave.verify.measure.development import KINDS as PROVED_KINDS
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import thread_labels, trace_threads

RULES = tuple(HoleRule(hole, 2 * hole) for hole in (4.1, 2.5, 1.6, 1.0))


def make(mesh, rule: JointRule, *, slots: bool = False, length_mm: float = 300.0):
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    ribbons = smooth_ribbons(project_ribbons(mesh, halfedges, weave, height_mm=0.25), 2)
    labels = thread_labels(weave.threads.n_threads)
    runs = split_threads(ribbons, weave, length_mm=length_mm, fits=lambda _: True, labels=labels)
    plan = plan_joints(ribbons, weave, runs, rule)
    return weave, ribbons, build_pieces(ribbons, weave, runs, labels, RULES, plan, slots=slots)


def shape_at(name: str, size_mm: float = 400.0):
    return resize_mesh(parse_shape(f"shape:{name}"), size_mm=size_mm)[0]


def onto(made: PieceSet, joint):
    """Return the motion that lays the second piece of a joint on the first, by its station."""
    a, b = (made.pieces[index] for index in joint.pieces)
    (ax, ay), (bx, by) = a.directions[-1], b.directions[0]
    cosine, sine = ax * bx + ay * by, ay * bx - ax * by
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return lambda points: (points - b.points[0]) @ turn.T + a.points[-1]


def strip_area(strips) -> float:
    rings = [
        np.concatenate((strips.right[a:b], strips.left[a:b][::-1]))
        for a, b in zip(strips.offsets, strips.offsets[1:], strict=False)
        if b > a
    ]
    # By the shoelace formula: a long strip may lie over itself.
    return sum(
        0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
        for x, y in (r.T for r in rings)
    )


def lap_area(made: PieceSet, joint) -> float:
    """Return what the two pieces of a joint share when laid on one another; NaN if not clear."""
    a, b = (made.pieces[index] for index in joint.pieces)
    width = float(np.hypot(*(a.rails[-1, 1] - a.rails[-1, 0])))
    near = shapely.Point(a.points[-1]).buffer(joint.lap_mm + width)
    first, second = shapely.Polygon(a.outline), shapely.Polygon(onto(made, joint)(b.outline))
    # On a grid: figures with almost common edges can come out as anything otherwise.
    shared = first.intersection(second, grid_size=1e-6)
    # A piece that winds back over its mate elsewhere may do so here, too.
    return float(shared.area) if shared.difference(near).area < 1e-3 else np.nan


rules = st.one_of(
    st.sampled_from([JointRule(kind) for kind in KINDS.values() if not kind.most_fasteners]),
    st.integers(1, 4).map(lambda n: parse_joint(f"rivet:{n}")),
    st.floats(4.0, 80.0).map(lambda lap: parse_joint(f"glue,lap={lap}mm")),
    st.floats(4.0, 80.0).map(lambda lap: parse_joint(f"rivet:2,lap={lap}mm")),
)


@given(meshes(), rules)
def test_pieces_are_the_thread_and_its_laps(mesh, rule):
    mesh, _ = resize_mesh(mesh, size_mm=400.0)
    _, ribbons, made = make(mesh, rule)
    whole = strip_area(unfold_threads(ribbons))
    pieces = sum(shapely.Polygon(piece.outline).area for piece in made.pieces)
    slack = 2 * STRAIGHT_MM * sum(shapely.Polygon(p.outline).length for p in made.pieces)
    share = 0.0
    for joint in made.joints:
        a, b = (made.pieces[index] for index in joint.pieces)
        assert a.crossings[-1] == b.crossings[0] == joint.crossing
        assert joint.kind in (rule.kind, GLUE)
        assert (joint.lap_mm > 0) == joint.kind.laps
        ends = onto(made, joint)(b.rails[0])
        assert np.abs(ends - a.rails[-1]).max() < 3e-6  # places have six decimals
        holes = onto(made, joint)(joint.holes[:, 1])
        assert np.abs(holes - joint.holes[:, 0]).max(initial=0.0) < 3e-6
        if a is b:
            share = np.nan  # a ring of one piece cannot be laid on itself as a whole
            continue
        share += lap_area(made, joint)
        if joint.kind.name == "dovetail":
            # The seam is air: shorter than three times the ribbon's width.
            slack += 3 * CLEARANCE_MM * np.hypot(*(a.rails[-1, 1] - a.rails[-1, 0])) * 2
    if np.isfinite(share):
        assert pieces - share == pytest.approx(whole, abs=slack + 1e-6)


@pytest.mark.parametrize("name", ["torus?m=16&n=8", "octahedron", "sphere?n=4"])
def test_a_tuck_lies_over_three_crossings_of_its_own_and_ends_under_strands(name):
    _, _, made = make(shape_at(name), parse_joint("tuck"))
    tucked = [joint for joint in made.joints if joint.kind.name == "tuck"]
    assert tucked or name == "octahedron"
    taken = [joint.crossing for joint in made.joints]
    for joint in tucked:
        first, second = (made.pieces[index] for index in joint.pieces)
        figure = shapely.Polygon(first.outline)
        covers = shapely.covers(figure, shapely.points(onto(made, joint)(second.points)))
        on = int(np.argmin(covers)) - 1
        assert on >= 2
        assert not second.over[[0, on]].any()
        assert on + 1 < len(second.crossings)
        assert np.isnan(second.hole_mm[: on + 1]).all()
        taken += second.crossings[1 : on + 1].tolist()
    assert len(taken) == len(set(taken))
    assert sorted(taken) == sorted(made.plan.laps.tolist())


@pytest.mark.parametrize("count", [2, 3, 4])
def test_groups_keep_their_pitch_and_go_through_three_layers(count):
    weave, _, made = make(shape_at("torus?m=12&n=8"), parse_joint(f"rivet:{count}"))
    keep = {rule.hole_mm: rule.edge_mm for rule in made.rules}
    grouped = [joint for joint in made.joints if len(joint.holes) == count]
    assert len(grouped) >= 0.9 * len(made.joints)
    spread = {}
    for joint in grouped:
        first = joint.holes[:, 0]
        apart = np.hypot(*(first[:, None] - first[None, :]).transpose(2, 0, 1))
        off = ~np.eye(count, dtype=bool)
        assert apart[off].min() == pytest.approx(PITCH_D * joint.hole_mm)
        spread[joint.crossing] = np.sort(apart[off])
    layers = np.zeros(weave.threads.n_crossings, dtype=int)
    for piece in made.pieces:
        ring = shapely.LinearRing(piece.outline)
        edge = shapely.distance(shapely.points(piece.holes[:, 1:3]), ring)
        assert np.all(edge >= [keep[hole] - 1e-9 for hole in piece.holes[:, 3].tolist()])
        for station in np.unique(piece.more_holes[:, 0]).astype(int):
            own = piece.more_holes[piece.more_holes[:, 0] == station, 1:3]
            apart = np.hypot(*(own[:, None] - own[None, :]).transpose(2, 0, 1))
            crossing = int(piece.crossings[station])
            assert np.isnan(piece.hole_mm[station])
            assert np.sort(apart[~np.eye(count, dtype=bool)]) == pytest.approx(spread[crossing])
            layers[crossing] += 1
    assert set(layers[[joint.crossing for joint in grouped]]) == {3}
    assert layers.sum() == 3 * len(grouped)


@pytest.mark.parametrize("kind", [kind for kind in KINDS.values() if not kind.most_fasteners])
def test_only_rivets_have_holes_at_joints(kind):
    _, _, made = make(shape_at("torus?m=12&n=8"), JointRule(kind))
    # Where a long lap has not the crossings, it is glued.
    assert {joint.kind for joint in made.joints} <= {kind, GLUE if kind.crossings > 1 else kind}
    joined = [joint.crossing for joint in made.joints] + made.plan.beside.tolist()
    for piece in made.pieces:
        at_joint = np.isin(piece.crossings, joined)
        assert np.isnan(piece.hole_mm[at_joint]).all()
        assert not np.isnan(piece.hole_mm[~at_joint]).any()
        # Guides belong to laps without fasteners, and lie inside the piece.
        assert bool(piece.guides) == kind.marked
        inside = shapely.Polygon(piece.outline)
        assert all(inside.contains(shapely.LineString(guide)) for guide in piece.guides)


@pytest.mark.parametrize("lap", [6.0, 25.0, 300.0])
def test_laps_are_as_long_as_asked_and_keep_to_their_crossing(lap):
    _, _, made = make(shape_at("torus?m=12&n=8"), parse_joint(f"glue,lap={lap}mm"))
    for joint in made.joints:
        assert joint.lap_mm <= lap + 1e-9
        a, b = (made.pieces[index] for index in joint.pieces)
        # No station but the joint's own lies under the other piece's lap.
        near = shapely.Point(a.points[-1]).buffer(0.6 * joint.lap_mm + 1.0)
        cover = shapely.Polygon(onto(made, joint)(b.outline)).intersection(near)
        assert not cover.contains(shapely.Point(a.points[-2]))
        assert cover.contains(shapely.Point(a.points[-1]))
    if lap < 30.0:
        assert all(joint.lap_mm == pytest.approx(lap) for joint in made.joints)


@pytest.mark.parametrize("lap", [8.0, 20.0, 60.0, 200.0])
def test_the_slot_of_a_short_lap_on_a_slanting_panel_has_its_walls(lap):
    # A short lap ends inside the panel, along a line as slanting as those at the panel's ends.
    vertices, faces, _ = random_job(73400, small=True)
    mesh = resize_mesh(PolyMesh.from_faces(vertices, faces), size_mm=553.0)[0]
    _, _, made = make(mesh, parse_joint(f"slot,lap={lap}mm"))
    kinds = [joint.kind.name for joint in made.joints]
    assert "slot" in kinds
    for joint in made.joints:
        second = made.pieces[joint.pieces[1]]
        for slot in second.slots:
            hole = shapely.Polygon(slot.path.flattened(0.01))
            assert shapely.Polygon(second.outline).contains(hole.buffer(0.99))


@given(st.floats(0.0, 20.0), st.floats(0.1, 3.0))
def test_a_dovetail_holds(extra, thickness):
    shape = dovetail(dovetail_room(thickness) + extra, thickness)
    room = dovetail_room(thickness) + extra
    tongue = shapely.Polygon(shape.tongue)
    wall = shapely.box(shape.begin_mm, -room, 3 * room, room) - shapely.Polygon(shape.socket)
    body = shapely.box(-3 * room, -room, shape.end_mm, room) | tongue
    assert body.intersection(wall).area == 0.0
    assert wall.geom_type == "Polygon"
    # Nowhere nearer than the clearance, and pulled away it runs into the socket.
    assert body.distance(wall) == pytest.approx(CLEARANCE_MM, abs=1e-6)
    pulled = shapely.transform(wall, lambda xy: xy + np.array([4 * CLEARANCE_MM, 0.0]))
    assert body.intersection(pulled).area > 0.0
    assert np.abs(shape.tongue[:, 1]).max() + CLEARANCE_MM < room


@given(st.floats(0.0, 20.0), st.floats(0.1, 3.0))
def test_a_tab_goes_through_its_slot_to_the_shoulders(extra, thickness):
    room = slot_room(thickness) + extra
    shape = tab_in_slot(room, thickness)
    slot = shapely.Polygon(shape.slot)
    width, length = np.ptp(shape.slot, axis=0)
    tab = np.ptp(shape.tongue[:, 1])
    assert width == pytest.approx(thickness + CLEARANCE_MM)
    assert length == pytest.approx(tab + 2 * CLEARANCE_MM)
    assert length < 2 * room
    assert room - length / 2 >= max(1.0, 2 * thickness) - 1e-9
    assert slot.centroid.coords[0] == pytest.approx((0.0, 0.0), abs=1e-9)


def test_slots_lie_under_and_never_at_joints():
    weave, _, made = make(shape_at("torus?m=12&n=8"), JointRule(), slots=True)
    joints = {joint.crossing for joint in made.joints}
    seen = 0
    for piece in made.pieces:
        for slot in piece.slots:
            seen += 1
            assert not piece.over[slot.station]
            assert piece.crossings[slot.station] not in joints
            polygon = shapely.Polygon(slot.path.flattened(0.01))
            assert polygon.contains(
                shapely.Point(piece.points[slot.station]).buffer(0.49 * piece.hole_mm[slot.station])
            )
            assert shapely.Polygon(piece.outline).contains(polygon)
        stations = [slot.station for slot in piece.slots]
        assert not set(stations) & set(piece.holes[:, 0])
    assert seen == weave.threads.n_crossings - len(joints)


@given(st.floats(0.8, 8.0), st.floats(0.0, 6.3))
def test_a_slot_is_a_hole_that_slides(hole, angle):
    way = np.array([np.cos(angle), np.sin(angle)])
    path = slot_path(hole, np.array([3.0, -2.0]), way)
    straight = 2 * SLIDE_D * hole
    assert path.area == pytest.approx(np.pi / 4 * hole**2 + hole * straight)
    assert path.length == pytest.approx(np.pi * hole + 2 * straight)
    slid = shapely.LineString(
        [[3.0, -2.0] - SLIDE_D * hole * way, [3.0, -2.0] + SLIDE_D * hole * way]
    )
    swept = slid.buffer(hole / 2, quad_segs=64)
    assert (
        shapely.Polygon(path.flattened(0.001)).symmetric_difference(swept).area
        < 0.02 * hole * np.pi
    )


def test_verify_knows_the_same_kinds_and_what_they_are():
    assert list(KINDS) == list(PROVED_KINDS)
    for name, proved in PROVED_KINDS.items():
        kind = KINDS[name]
        assert proved.laps == kind.laps
        assert proved.fastened == bool(kind.most_fasteners)
        assert any(proved.shaped) == (kind.shape is not None)
        if kind.shape is not None and kind.room_mm is not None:
            ends = kind.shape(kind.room_mm(0.5), 0.5)
            assert proved.shaped == (True, ends.begin_mm is not None)
            assert proved.slotted == (ends.slot is not None)


def test_long_laps_are_refused_where_strips_differ_in_thickness():
    mesh = shape_at("torus?m=12&n=8")
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    ribbons = smooth_ribbons(project_ribbons(mesh, halfedges, weave, height_mm=0.25), 2)
    labels = thread_labels(weave.threads.n_threads)
    runs = split_threads(ribbons, weave, length_mm=300.0, fits=lambda _: True, labels=labels)
    thickness = np.full(weave.threads.n_threads, 0.5)
    assert plan_joints(ribbons, weave, runs, parse_joint("tuck"), thickness).beside.size
    thickness[0] = 0.8
    with pytest.raises(CannotMakeError):
        plan_joints(ribbons, weave, runs, parse_joint("tuck"), thickness)
