"""A former's plates are sections of the inside: held against solids whose sections are known."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import CannotMakeError
from fabweave.options.settings import settings_from_options
from fabweave.piece.former import (
    Former,
    Laid,
    Plane,
    Plate,
    WayOut,
    build_former,
    closed_triangles,
    rim_loops,
    snapped,
)
from fabweave.plan.ask import complete_settings, lay_asked, load_asked
from fabweave.plan.planned_job import plan_job
from fabweave.plan.way_out import leaving

LAYER, THICK = 0.4, 1.2


def planned(name, **options):
    settings, supplies = complete_settings(settings_from_options(name, effort="quick", **options))
    return plan_job(lay_asked(load_asked(settings), settings, supplies), settings, supplies)


def former_of(job, thick=THICK):
    return build_former(job.woven, job.split_plan.runs, layer_mm=LAYER, thickness_mm=thick)


@pytest.fixture(scope="module")
def torus():
    return planned("shape:torus", size="300mm")


def test_the_former_of_a_torus_is_a_ring_with_discs_around_it(torus):
    plates = former_of(torus).plates
    spines = [plate for plate in plates if plate.spine]
    slices = [plate for plate in plates if not plate.spine]
    assert [len(plate.outline.interiors) for plate in spines] == [1] * len(spines)
    tube = np.ptp(torus.woven.mesh.vertices[:, 2]) / 2.0
    for plate in slices:
        # A disc, less the layers, what the faces' flatness takes, and a slot.
        assert 0.8 * np.pi * tube**2 < plate.outline.area < np.pi * tube**2
        assert not plate.outline.interiors
        assert len(plate.joins) == len(spines)
    assert all(len(plate.joins) == len(slices) for plate in spines)
    pieces = {mark.piece for plate in plates for mark in plate.marks}
    assert pieces == set(range(len(torus.piece_set.pieces)))


def test_ticks_point_inwards_from_the_edge(torus):
    for plate in former_of(torus).plates:
        for mark in plate.marks:
            assert plate.outline.boundary.distance(shapely.Point(mark.point)) < 1e-6
            assert np.linalg.norm(mark.inward) == pytest.approx(1.0)


def test_what_is_too_flat_for_a_former_is_refused():
    with pytest.raises(CannotMakeError):
        former_of(planned("shape:hypar", size="200mm"))


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
        assert sides[1] <= max(deep, way) + 1e-6
    assert bool(broken.snaps) == (
        min(wide, high) > 0.9 * way or max(wide, high) > max(deep, 0.9 * way)
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
