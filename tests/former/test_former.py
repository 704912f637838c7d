"""A former's plates are sections of the inside: held against solids whose sections are known."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import CannotMakeError
from fabweave.former.plates import (
    Former,
    Laid,
    Plane,
    Plate,
    StripMark,
    WayOut,
    build_former,
    closed_triangles,
    level_area,
    rim_loops,
    snapped,
)
from fabweave.former.sheets import former_notes, with_room
from fabweave.former.way_out import leaving, let_out
from fabweave.job.stations import Stations
from fabweave.options.settings import settings_from_options
from fabweave.piece.development import piece_stretches

pytestmark = pytest.mark.usefixtures("quick_jobs")

LAYER, THICK = 0.4, 1.2


def planned(name, **options):
    # What lies on a former is cut as it is drawn.
    settings = settings_from_options(name, effort="quick", as_drawn="off", **options)
    return Stations(settings).buildable


def former_of(job, thick=THICK):
    return build_former(job.woven, job.split_plan.runs, layer_mm=LAYER, thickness_mm=thick)


@pytest.fixture(scope="module")
def torus():
    # Lengths and fasteners that are given need not be found.
    job = planned("shape:torus", size="300mm", max_length="400mm", fasten="joints")
    return job, former_of(job).plates


def test_the_former_of_a_torus_is_a_ring_with_discs_around_it(torus):
    job, plates = torus
    spines = [plate for plate in plates if plate.spine]
    slices = [plate for plate in plates if not plate.spine]
    assert [len(plate.outline.interiors) for plate in spines] == [1] * len(spines)
    tube = np.ptp(job.woven.mesh.vertices[:, 2]) / 2.0
    for plate in slices:
        # A disc, less the layers, what the faces' flatness takes, and a slot.
        assert 0.8 * np.pi * tube**2 < plate.outline.area < np.pi * tube**2
        assert not plate.outline.interiors
        assert len(plate.joins) == len(spines)
    assert all(len(plate.joins) == len(slices) for plate in spines)
    pieces = {mark.piece for plate in plates for mark in plate.marks}
    assert pieces == set(range(len(job.piece_set.pieces)))


def rails_of(job, piece):
    """The rails of a piece from end to end, (R, 2, 3)."""
    ribbons, stretches = (
        job.woven.ribbons,
        piece_stretches(job.woven.ribbons, job.woven.weave, job.piece_set.pieces),
    )
    rung = stretches.rung[slice(*stretches.offsets[piece : piece + 2])]
    return np.stack((ribbons.right[rung], ribbons.left[rung]), axis=1)


def finely(line):
    """Points of a line of points, (N, 3), a fiftieth of a side apart."""
    share = np.linspace(0.0, 1.0, 51)[:, None, None]
    return (line[:-1] + share * np.diff(line, axis=0)).reshape(-1, 3)


@pytest.fixture(scope="module")
def tetrahedron():
    job = planned("shape:tetrahedron", size="200mm", fasten="joints")
    return job, former_of(job)


def test_a_name_stands_beside_its_strip_even_if_that_lies_in_the_plane(tetrahedron):
    job, former = tetrahedron
    level = [plate for plate in former.plates if plate.spine and not plate.plane.origin.any()]
    assert len(level) == 1  # one strip goes round in its plane, over four crossings
    ids = [job.piece_set.pieces[mark.piece].id for mark in level[0].marks]
    assert sorted(one[0] for one in ids) == ["A", "A", "B", "B", "C", "C", "C", "C"]
    assert len({tuple(mark.point.round(3)) for mark in level[0].marks}) == len(ids)
    for plate in former.plates:
        for mark in plate.marks:
            middle = finely(rails_of(job, mark.piece).mean(axis=1))
            away = np.linalg.norm(middle - plate.plane.raised(mark.point), axis=1).min()
            assert away < 2.0 * LAYER + 7.0


def test_a_way_out_is_free_of_rails_and_goes_on_to_the_other_side():
    job = planned("shape:octahedron", size="400mm", max_length="500mm", fasten="joints")
    pieces, order = job.piece_set.pieces, np.arange(len(job.piece_set.pieces))
    way = let_out(
        Former((), 1.0), job.woven, pieces, SimpleNamespace(order=order, enclosed=True)
    ).way
    rails = [rails_of(job, piece) for piece in order[: way.before]]
    points = np.concatenate([finely(rail[:, side]) for rail in rails for side in (0, 1)])
    assert way.wide_mm == pytest.approx(
        2.0 * np.linalg.norm(points - way.at, axis=1).min(), rel=0.01
    )
    # On the octahedron's other side, the sum of whose coordinates is everywhere the same.
    there = way.at + way.deep_mm * way.inward
    assert np.abs(there).sum() == pytest.approx(200.0, abs=0.01)
    assert there @ way.at < 0.0


def test_what_would_not_break_is_not_taken_out():
    bar = shapely.box(50, 49, 150, 51)  # too narrow for slits, along the middle row
    outline = shapely.union_all([shapely.box(0, 0, 50, 100), bar, shapely.box(150, 0, 200, 100)])
    plate = Plate("F1", False, Plane(np.zeros(3), np.eye(3)[:2]), outline, (), ())
    assert snapped(plate, 60.0, 300.0) is None
    assert snapped(plate, 120.0, 300.0).snaps == ()


def test_names_that_have_no_room_are_left_out_and_told():
    disc = shapely.Point(0, 0).buffer(12.0, quad_segs=32)
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    out = np.column_stack((np.cos(turns), np.sin(turns)))
    lines = shapely.shortest_line(disc.boundary, shapely.points(12.0 * out))
    edge = shapely.get_coordinates(lines)[::2]
    marks = tuple(StripMark(at, edge[at], -out[at]) for at in range(24))
    plate = Plate("F1", False, Plane(np.zeros(3), np.eye(3)[:2]), disc, marks, ())
    pieces = [SimpleNamespace(id=f"A{at}") for at in range(24)]
    laid = with_room(Laid(Former((plate,), 1.0), None), pieces)
    named = {mark.piece for mark in laid.former.plates[0].marks}
    left = {piece for _, piece in laid.unnamed}
    assert named
    assert left == {piece.id for piece in pieces} - {pieces[at].id for at in named}
    assert any(str(len(left)) in note for note in former_notes(laid))


@pytest.mark.slow
def test_what_is_too_flat_for_a_former_is_refused():
    with pytest.raises(CannotMakeError):
        former_of(planned("shape:hypar", size="200mm"))


@pytest.mark.slow
def test_openings_are_closed_and_the_volume_is_that_of_the_half_ball():
    job = planned("shape:hemisphere", size="300mm")
    mesh, halfedges = job.woven.mesh, job.woven.halfedges
    assert len(rim_loops(halfedges)) == 1
    points, triangles = closed_triangles(mesh, halfedges)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0
    assert volume == pytest.approx(2.0 / 3.0 * np.pi * 150.0**3, rel=0.05)
    # Each side is there once in either sense: nothing is open.
    sides = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    assert len(np.unique(sides, axis=0)) == len(sides)
    there = {(start, end) for start, end in sides.tolist()}
    assert there == {(end, start) for start, end in there}


@pytest.mark.parametrize("seed", range(8))
def test_what_bodies_that_stand_in_one_another_enclose_is_what_any_of_them_does(seed):
    rng, count, bodies = np.random.default_rng(seed), 40, 4
    turn = 2.0 * np.pi * np.arange(count) / count
    rims, points, triangles = [], [], []
    for number in range(bodies):
        away = 50.0 + rng.normal(0.0, 6.0, count)
        rim = np.column_stack((np.cos(turn), np.sin(turn))) * away[:, None] + rng.normal(0, 4, 2)
        rims.append(shapely.Polygon(rim))
        points += [np.insert(rim, 2, height, axis=1) for height in (-1.0, 1.0)]
        below = 2 * count * number + np.arange(count)
        onward = np.roll(below, -1)
        triangles += [(below, onward, below + count), (onward, onward + count, below + count)]
    area = level_area(np.concatenate(points), np.concatenate(triangles, axis=1).T)
    assert area.symmetric_difference(shapely.union_all(rims)).area < 1e-6


@given(
    st.floats(20.0, 300.0), st.floats(20.0, 300.0), st.floats(25.0, 90.0), st.floats(10.0, 200.0)
)
def test_a_plate_breaks_into_parts_that_the_way_lets_out(wide, high, way, deep):
    plate = Plate(
        "F1", False, Plane(np.zeros(3), np.eye(3)[:2]), shapely.box(0, 0, wide, high), (), ()
    )
    broken = snapped(plate, way, deep)
    assert shapely.get_num_geometries(broken.outline) == 1  # bridges hold it until it is broken
    lines = shapely.union_all([shapely.LineString(line) for line in broken.snaps])
    parts = shapely.get_parts(plate.outline.difference(lines.buffer(1e-6))).tolist()
    for part in parts:
        sides = sorted(np.ptp(shapely.get_coordinates(part), axis=0))
        assert sides[0] <= way
        assert sides[1] <= max(deep, way)
    assert bool(broken.snaps) == (
        min(wide, high) > 0.9 * way or max(wide, high) > 0.9 * max(deep, way)
    )


@pytest.mark.parametrize(
    ("before", "until", "step", "gap"),
    [(2, 2, 2, "gap"), (0, 1, 1, "gap"), (None, 4, 3, "opening")],
)
def test_a_former_is_taken_out_before_the_step_of_its_piece_or_after_all(before, until, step, gap):
    steps = [SimpleNamespace(step=at, pieces=own) for at, own in ((1, "A"), (2, "BC"), (3, "D"))]
    way = WayOut(np.zeros(3), np.eye(3)[2], 70.0, 90.0, before)
    said = leaving(Laid(Former((), 1.0), way), steps)
    assert (said.until, said.step) == (until, step)
    assert f"out through the {gap} (step 0.3)." in said.told
    assert leaving(Laid(Former((), 1.0), None), steps).told == ""
    ring = [*steps, SimpleNamespace(step=4, pieces=())]
    assert leaving(Laid(Former((), 1.0), way), ring).step == (4 if before is None else step)
