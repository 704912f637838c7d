"""Ribbons that come too near are found, and nothing else is."""

import tracemalloc

import igl
import numpy as np
import pytest
from hypothesis import given
from jobs import laid
from meshes_shared import shared_mesh
from ribbon_strips import shifted
from strategies import TRIANGLES, require_gap

from fabweave.core.errors import CannotMakeError
from fabweave.design.inspection.facts import inspect_mesh
from fabweave.job.stations import Stations
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import settings_from_options
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.rules.clearance import Nearness, near_pairs, triangle_distances
from fabweave.ribbon.stretches import cut_stretches, steps_apart
from fabweave.ribbon.width import PROPORTIONAL


def woven(shape: str, **options):
    options = {"size_mm": 300.0, **options}
    return laid(f"shape:{shape}", **options)[0]


@given(TRIANGLES, TRIANGLES)
def test_distances_agree_with_quadratic_sampling_and_are_symmetric(one, other) -> None:
    distance, place = triangle_distances(one[None], other[None])
    back, _ = triangle_distances(other[None], one[None])
    assert distance[0] == pytest.approx(back[0], abs=1e-9)
    require_gap(distance[0], one, other)
    # The place lies midway: half the distance from either.
    for triangle in (one, other):
        corners, faces = np.ascontiguousarray(triangle), np.array([[0, 1, 2]])
        away = igl.point_mesh_squared_distance(place, corners, faces)[0]
        assert np.sqrt(away[0]) == pytest.approx(distance[0] / 2, abs=1e-7)


def pairs_within(ribbons: Ribbons, crossing: np.ndarray, reach: float) -> Nearness:
    return near_pairs(ribbons, crossing, reach, lambda pairs: np.full(len(pairs), reach))


def igl_pairs(ribbons: Ribbons) -> set[tuple[int, int]]:
    """Pairs of threads that libigl finds to intersect, by exact predicates."""
    vertices, triangles, thread = ribbon_triangles(ribbons)
    mesh = PolyMesh.from_triangles(vertices, triangles)
    pairs = thread[self_intersections(mesh)]
    return {(min(a, b), max(a, b)) for a, b in pairs.tolist() if a != b}


@pytest.mark.parametrize("shape", ["torus?m=12&n=8", "sphere?n=4", "hypar", "tetrahedron"])
@pytest.mark.parametrize("by", [(0.0, 0.0, 0.0), (6.0, 1.0, 4.0), (-3.0, 9.0, 2.0)])
def test_spoilt_ribbons_intersect_where_libigl_says_so(shape: str, by: tuple) -> None:
    woven_object = woven(shape)
    threads = woven_object.weave.threads
    longest = int(np.argmax(threads.lengths))
    ribbons = shifted(woven_object.ribbons, longest, np.array(by))
    near = pairs_within(ribbons, threads.crossing, 0.0)
    stretches = cut_stretches(ribbons)
    found = {(min(a, b), max(a, b)) for a, b in stretches.thread[near.pairs].tolist() if a != b}
    exact = igl_pairs(ribbons)
    assert found <= exact
    # Panels of one crossing are not ours to find: that is another rule's.
    partners = {
        tuple(sorted(threads.thread_of_pass[threads.crossing == at].tolist()))
        for at in range(threads.n_crossings)
    }
    assert exact - found <= partners
    if by[0] < 0:
        assert any(longest in pair for pair in found)


@pytest.mark.parametrize("smooth", [0, 3, 8])
@pytest.mark.parametrize("name", ["tri/csaszar.obj", "quad/catmark_toroidal_tet.obj"])
def test_ribbons_run_through_themselves_where_libigl_says_so(name: str, smooth: int) -> None:
    options = {"course": "projection", "width": PROPORTIONAL, "smooth": smooth}
    woven_object = laid(str(shared_mesh(name)), size_mm=400.0, **options)[0]
    ribbons = woven_object.ribbons
    stretches = cut_stretches(ribbons)
    vertices, triangles, _ = ribbon_triangles(ribbons)
    mesh = PolyMesh.from_triangles(vertices, triangles)
    quads = np.flatnonzero(following_rung(ribbons.offsets, ribbons.closed) >= 0)
    number = (2 * quads[:, None] + [0, 1]).ravel()
    owner = np.empty(2 * ribbons.n_rungs, dtype=np.int64)
    owner[stretches.triangle] = np.repeat(
        np.arange(len(stretches.thread)), np.diff(stretches.offsets)
    )
    exact = np.sort(owner[number[self_intersections(mesh)]], axis=1).reshape(-1, 2)
    found = pairs_within(ribbons, woven_object.weave.threads.crossing, 0.0).pairs

    def near_by(pairs: np.ndarray) -> set[tuple[int, int]]:
        steps = steps_apart(stretches, pairs)
        return {(a, b) for a, b in pairs[(steps == 0) | (steps == 1)].tolist()}

    assert near_by(found) == near_by(exact)
    assert bool(near_by(exact)) == (name == "tri/csaszar.obj")


@pytest.mark.slow
def test_what_is_all_but_filled_with_material_is_refused_in_bounded_memory():
    # Every ribbon is within reach of every other: some forty million pairs.
    settings = settings_from_options("shape:cube", size=2.0, refine="catmull-clark:4")
    tracemalloc.start()
    with pytest.raises(CannotMakeError, match=r"too small for its material: more than \d+ "):
        inspect_mesh(Stations(settings))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 700e6
