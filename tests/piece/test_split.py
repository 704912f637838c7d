"""Pieces give back their threads, joint on joint and hole on hole."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from sheet_fit import fits_some_sheet
from splitting import split_threads
from weaving_meshes import meshes

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.upright import resize_mesh
from fabweave.piece.development import Runs, unfold_runs
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.outline import RigidMotion, resting_frame, strip_outline, strip_outlines
from fabweave.piece.piece import Joint, find_owners
from fabweave.piece.pieces import PieceSet, build_pieces
from fabweave.piece.split import splitting
from fabweave.piece.split.candidates import MOST_PASSES, list_sites
from fabweave.ribbon.project import Ribbons, project_ribbons
from fabweave.stock.sheet_size import SheetSize
from fabweave.weave.pattern import Weave, plain_weave
from fabweave.weave.threads import thread_labels, trace_threads

RULES = tuple(HoleRule(hole, 2 * hole) for hole in (4.1, 2.5, 1.0))


def woven(mesh: PolyMesh) -> tuple[Weave, Ribbons]:
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    return weave, project_ribbons(mesh, halfedges, weave, height_mm=0.25)


def split(
    mesh: PolyMesh, length_mm: float = 300.0, fits=lambda _: True, max_length_mm: float = np.inf
):
    weave, ribbons = woven(mesh)
    labels = thread_labels(weave.threads.n_threads)
    runs = split_threads(
        ribbons, weave, length_mm=length_mm, max_length_mm=max_length_mm, fits=fits, labels=labels
    )
    return weave, ribbons, runs, build_pieces(ribbons, weave, runs, labels, RULES)


def shape_at(name: str, size_mm: float = 400.0) -> PolyMesh:
    return resize_mesh(parse_shape(f"shape:{name}"), size_mm=size_mm)[0]


def check_runs(weave: Weave, runs: Runs) -> None:
    """Runs of a thread follow one another and share only their joints, which lie under."""
    for thread in range(weave.threads.n_threads):
        count = int(weave.threads.lengths[thread])
        own = np.flatnonzero(runs.thread == thread)
        if count == 0:
            assert len(own) == 0
            continue
        first, last = runs.first[own], runs.last[own]
        assert np.array_equal(first[1:], last[:-1])
        assert np.all(last > first) or (count == 1 and len(own) == 1)
        over = weave.over[weave.threads.offsets[thread] :]
        if weave.threads.closed[thread]:
            assert last[-1] == first[0] + count
            joints = first
        else:
            assert (first[0], last[-1]) == (0, count - 1)
            joints = first[1:]
        assert not over[joints % count].any()


@given(meshes(), st.floats(80.0, 600.0))
def test_pieces_cover_their_threads_and_join_under_crossings(mesh, max_length):
    mesh, _ = resize_mesh(mesh, size_mm=400.0)
    weave, _, runs, _ = split(mesh, max_length)
    check_runs(weave, runs)


@pytest.mark.parametrize("name", ["torus?m=12&n=8", "hypar?m=8&n=8", "sphere?n=4"])
def test_no_piece_is_longer_than_asked(name):
    _, ribbons, runs, made = split(shape_at(name), max_length_mm=280.0)
    strips = unfold_runs(ribbons, runs)
    middle = (strips.right + strips.left) / 2
    for a, b in zip(strips.offsets, strips.offsets[1:], strict=False):
        assert np.hypot(*np.diff(middle[a:b], axis=0).T).sum() <= 280.0 + 1e-9
    assert len(made.pieces) == len(runs.thread)


def joint_offset(made: PieceSet, joint: Joint) -> np.ndarray:
    """Superpose the second piece of a joint on the first by its station and direction."""
    a, b = (made.pieces[index] for index in joint.pieces)
    (ax, ay), (bx, by) = a.directions[-1], b.directions[0]
    cosine, sine = ax * bx + ay * by, ay * bx - ax * by
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return (b.rails[0] - b.points[0]) @ turn.T + a.points[-1] - a.rails[-1]


@pytest.mark.parametrize("name", ["torus?m=12&n=8", "dodecahedron", "tetrahedron", "sphere?n=4"])
def test_joints_superpose_exactly(name):
    _, _, _, made = split(shape_at(name))
    assert made.joints
    for joint in made.joints:
        assert np.abs(joint_offset(made, joint)).max() < 3e-6  # places have six decimals
        a, b = (made.pieces[index] for index in joint.pieces)
        assert a.crossings[-1] == b.crossings[0] == joint.crossing
        assert a.end_joint == b.start_joint == joint.id
        if len(joint.holes):
            assert np.array_equal(joint.holes[0], [a.points[-1], b.points[0]])
            assert a.hole_mm[-1] == b.hole_mm[0] == made.size_mm[joint.crossing]


@pytest.mark.parametrize("name", ["torus?m=24&n=12", "octahedron", "hypar?m=6&n=6"])
def test_holes_have_their_room_and_both_strands_have_them(name):
    weave, _, _, made = split(shape_at(name))
    edge = {rule.hole_mm: rule.edge_mm for rule in made.rules}
    seen = np.zeros(weave.threads.n_crossings, dtype=int)
    for piece in made.pieces:
        drilled = ~np.isnan(piece.hole_mm)
        ring = shapely.LinearRing(piece.outline)
        distance = shapely.distance(shapely.points(piece.points[drilled]), ring)
        assert np.all(distance >= [edge[hole] - 1e-9 for hole in piece.hole_mm[drilled].tolist()])
        np.add.at(seen, piece.crossings[drilled], 1)
    joints = np.zeros_like(seen)
    for joint in made.joints:
        joints[joint.crossing] += 1
    # Every drilled crossing has a hole in both strands, and one more where a joint laps.
    assert np.all((seen == 0) | (seen == 2 + joints))


def test_outlines_are_simple_and_have_no_short_side():
    _, _, _, made = split(shape_at("sphere?n=6"))
    for piece in made.pieces:
        polygon = shapely.Polygon(piece.outline)
        assert polygon.is_valid
        assert shapely.is_ccw(shapely.LinearRing(piece.outline))
        sides = np.hypot(*np.diff(piece.outline, axis=0, append=piece.outline[:1]).T)
        assert sides.min() >= 0.1
        assert np.abs(piece.outline.min(axis=0)).max() < 1e-9


def test_owners_name_the_piece_that_ends_at_a_joint():
    weave, _, _, made = split(shape_at("torus?m=12&n=8"))
    owners = find_owners(made.pieces, weave.threads.n_crossings)
    for index, piece in enumerate(made.pieces):
        for station, (crossing, over) in enumerate(zip(piece.crossings, piece.over, strict=True)):
            if station == 0 and piece.start_joint is not None:
                continue
            assert owners.piece[crossing, int(over)] == index
            assert owners.station[crossing, int(over)] == station
            partner = made.pieces[owners.partners(piece)[station]]
            assert crossing in partner.crossings
            assert partner.over[partner.crossings == crossing][0] != over


@pytest.mark.slow
@pytest.mark.parametrize("usable", [(), ((150.0, 150.0),)])
def test_every_piece_fits_whether_the_bed_is_known_or_asked(usable):
    asked = []

    def small(outline):
        asked.append(outline)
        return fits_some_sheet(outline, [SheetSize(150.0, 150.0)], 0.0)

    weave, ribbons = woven(shape_at("torus?m=24&n=12"))
    labels = thread_labels(weave.threads.n_threads)
    runs = split_threads(ribbons, weave, fits=small, labels=labels, usable=usable)
    check_runs(weave, runs)
    strips = unfold_runs(ribbons, runs)
    assert all(small(outline) for outline in strip_outlines(strips))
    # Where the bed is known, few pieces need a question.
    assert len(asked) - len(runs.thread) < (len(runs.thread) if usable else np.inf)


@given(st.floats(-3.2, 3.2), st.floats(20.0, 200.0), st.floats(2.0, 15.0))
def test_a_turned_rectangle_comes_to_rest_on_its_long_side(angle, length, width):
    corners = np.array([[0, 0], [length, 0], [length, width], [0, width]])
    turned = RigidMotion(angle, np.array([7.0, -3.0])).apply(corners)
    start, end = turned[[0, 3]].mean(axis=0), turned[[1, 2]].mean(axis=0)
    rested = resting_frame(turned, start, end).apply(turned)
    assert np.allclose(rested, corners, atol=1e-6)


def test_thin_outlines_keep_their_ends_and_lose_short_sides():
    right = np.array([[0, 0], [0.05, 0], [5, 0], [9.98, 0], [10, 0]])
    left = right + np.array([0, 2])
    outline = strip_outline(right, left)
    assert outline.tolist() == [[0, 0], [5, 0], [10, 0], [10, 2], [5, 2], [0, 2]]


def test_threads_too_long_to_try_all_pieces_are_cut_from_few(monkeypatch):
    # Two threads of 840 passes, with no piece as short as asked.
    asked = []

    def noted(*args):
        asked.append(args[5])
        return real(*args)

    real = splitting.list_candidates
    monkeypatch.setattr(splitting, "list_candidates", noted)
    weave, _, runs, _ = split(shape_at("torus?m=20&n=21"), length_mm=1.0)
    assert weave.threads.lengths.tolist() == [840, 840]
    assert asked == [MOST_PASSES]
    check_runs(weave, runs)


@pytest.mark.parametrize("name", ["torus?m=8&n=6", "octahedron", "tetrahedron"])
def test_steps_from_site_to_site_lead_once_around_a_ring(name):
    sites = list_sites(woven(shape_at(name))[0])
    around = np.bincount(sites.thread, sites.steps, len(sites.closed))
    assert sites.closed.all()
    assert around.tolist() == sites.lengths.tolist()
