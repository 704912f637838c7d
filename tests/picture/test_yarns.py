"""Yarns are closed tubes that cross over and under and touch nowhere."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import laid
from slow import slow_but
from weaving_meshes import meshes, walked

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.upright import resize_mesh
from fabweave.picture.bodies import Body, clashing_facets, yarn_bodies
from fabweave.picture.yarns import (
    Yarns,
    bends_too_tightly,
    draw_spines,
    lay_course,
    spin_yarns,
    touching_points,
)
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.clearance import segment_distances
from fabweave.weave.pattern import plain_weave
from fabweave.weave.strand_colours import thread_colours
from fabweave.weave.threads import thread_labels

SHAPES = {
    "torus": ("torus?m=10&n=6", "plain", "end"),
    "torus in twill": ("torus?m=12&n=8", "twill", "end"),
    "sphere": ("sphere?n=3", "plain", "end"),
    "tetrahedron": ("tetrahedron", "plain", "end"),
    "cube in triaxial twill": ("cube", "triaxial", "end"),
    "slit torus in twill": ("slit?genus=2", "twill", "end"),
    "open": ("hypar?m=5&n=4", "plain", "end"),
    "turning": ("hypar?m=5&n=4", "plain", "turn"),
    "tube": ("tube", "twill", "turn"),
}


def woven(shape: str, pattern: str = "plain", boundary: str = "end", size: float = 200.0):
    return laid(f"shape:{shape}", size_mm=size, pattern=pattern, boundary=boundary)[0]


def spun(woven_object: WovenObject, **options) -> Yarns:
    options = {"sides": 8, **options}
    return spin_yarns(
        woven_object.mesh,
        woven_object.halfedges,
        woven_object.weave,
        woven_object.labels,
        portals=woven_object.source.portals,
        **options,
    )


def course_of(woven_object: WovenObject):
    one = woven_object
    return lay_course(one.mesh, one.halfedges, one.weave, one.source.portals)


def bodies_of(woven_object: WovenObject, yarns: Yarns) -> tuple[Body, ...]:
    return yarn_bodies(yarns, woven_object.labels, thread_colours(woven_object.bunches))


@pytest.fixture(scope="module", params=slow_but(SHAPES, 0, 1, 3, 6, 7))
def made(request):
    woven_object = woven(*SHAPES[request.param])
    yarns = spun(woven_object)
    return SimpleNamespace(woven=woven_object, yarns=yarns, bodies=bodies_of(woven_object, yarns))


def test_every_thread_is_one_closed_tube_facing_outward(made):
    threads = made.woven.weave.threads
    assert len(made.bodies) == np.count_nonzero(threads.lengths)
    closed = dict(zip(made.woven.labels, threads.closed.tolist(), strict=True))
    for body in made.bodies:
        mesh = trimesh.Trimesh(body.vertices, body.all_triangles, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.body_count == 1
        assert mesh.volume > 0
        # A ring is a torus, and a yarn with caps a sphere.
        assert mesh.euler_number == (0 if closed[body.label] else 2)


def test_no_two_facets_run_through_one_another(made):
    assert len(clashing_facets(made.bodies)) == 0


def test_the_volume_is_that_of_the_cross_section_times_the_length(made):
    yarns = made.yarns
    for thread, body in zip(np.flatnonzero(np.diff(yarns.offsets)), made.bodies, strict=True):
        own = slice(*yarns.offsets[thread : thread + 2])
        spine, radius = yarns.spine[own], yarns.radius_mm[own]
        if yarns.closed[thread]:
            spine, radius = np.vstack((spine, spine[:1])), np.append(radius, radius[0])
        length = np.linalg.norm(np.diff(spine, axis=0), axis=1)
        # Pappus: a polygon of 8 corners on a circle, swept at right angles.
        section = 8 / 2 * np.sin(2 * np.pi / 8) * (radius[1:] ** 2 + radius[:-1] ** 2) / 2
        volume = trimesh.Trimesh(body.vertices, body.all_triangles, process=False).volume
        assert volume == pytest.approx(float(section @ length), rel=0.06)


def test_cross_sections_are_regular_and_turn_no_more_than_they_must(made):
    yarns = made.yarns
    arm = yarns.rim - yarns.spine[:, None]
    assert np.allclose(np.linalg.norm(arm, axis=2), yarns.radius_mm[:, None])
    following = np.arange(1, len(arm) + 1)
    following[yarns.offsets[1:] - 1] = np.where(yarns.closed, yarns.offsets[:-1], -1)
    here = np.flatnonzero(following >= 0)
    edge = yarns.spine[following[here]] - yarns.spine[here]
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    first, second = (arm[index][:, 0] for index in (here, following[here]))
    flat = [v - np.einsum("ij,ij->i", v, edge)[:, None] * edge for v in (first, second)]
    twist = np.arctan2(np.einsum("ij,ij->i", np.cross(*flat), edge), np.einsum("ij,ij->i", *flat))
    # What is left over goes evenly around each ring: half a turn at most.
    thread = np.searchsorted(yarns.offsets, here, side="right") - 1
    total = np.abs(np.bincount(thread, weights=twist, minlength=len(yarns.closed)))
    assert total.max() < np.pi + 0.35
    assert np.abs(twist).max() < 0.3


def test_over_is_above_under_at_every_crossing(made):
    woven_object = made.woven
    course = course_of(woven_object)
    over, under = course.twins[:, 1], course.twins[:, 0]
    normal = woven_object.ribbons.normal
    assert np.allclose(course.rise[over], normal)
    assert np.allclose(course.rise[under], -normal)
    assert np.array_equal(course.place[over], course.place[under])
    # On a straight course ribbons cross where their middles meet, yarns midway between portals.
    if woven_object.source.portals is None:
        assert np.allclose(course.place[over], woven_object.ribbons.centre)


def test_a_larger_radius_than_the_largest_is_refused_with_one_that_fits():
    woven_object = woven("torus?m=10&n=6")
    with pytest.raises(CannotMakeError, match=r"--yarn-radius ([\d.]+)mm") as refused:
        spun(woven_object, radius_mm=50.0)
    words = str(refused.value)
    fits = float(words.split("--yarn-radius ")[1].split("mm", maxsplit=1)[0])
    size = float(words.split("--size ")[1].split("mm", maxsplit=1)[0])
    yarns = spun(woven_object, radius_mm=fits)
    assert np.allclose(yarns.radius_mm, fits)
    assert 1.0 <= yarns.most < 1.2
    assert len(clashing_facets(bodies_of(woven_object, yarns))) == 0
    # Everything grows with the size.
    larger = woven("torus?m=10&n=6", size=size)
    assert np.allclose(spun(larger, radius_mm=50.0).radius_mm, 50.0)


def test_flat_plain_weave_comes_near_the_thickest_yarn_there_can_be():
    # Peirce (1937): round yarns of one thickness jam when their spacing is sqrt(3) diameters.
    woven_object = woven("hypar?m=8&n=8&height=0.001", size=80.0)
    yarns = spun(woven_object)
    radius = yarns.most * yarns.radius_mm
    spacing = 80.0 / 8 / np.sqrt(2)
    assert 0.8 < 2 * radius.max() / (spacing / np.sqrt(3)) <= 1.0


def test_a_surface_that_runs_through_itself_is_refused():
    one = woven("octahedron").mesh
    # The same octahedron once more, moved a little: their edges cross.
    both = PolyMesh.from_faces(
        np.concatenate((one.vertices, one.vertices + 1e-3)),
        one.faces() + [[corner + one.n_vertices for corner in face] for face in one.faces()],
    )
    woven_object = woven_mesh(both)
    with pytest.raises(CannotMakeError, match="any radius"):
        spun(woven_object)


def woven_mesh(mesh: PolyMesh) -> WovenObject:
    halfedges, threads = walked(mesh)
    weave = plain_weave(threads)
    labels = thread_labels(weave.threads.n_threads)
    bunches = np.zeros(weave.threads.n_threads, dtype=np.int64)
    source = SimpleNamespace(portals=None)
    return SimpleNamespace(
        mesh=mesh, halfedges=halfedges, weave=weave, labels=labels, bunches=bunches, source=source
    )


@pytest.mark.slow
@settings(max_examples=15)
@given(meshes())
def test_yarns_on_any_mesh_are_free_and_closed(mesh):
    woven_object = woven_mesh(resize_mesh(mesh, size_mm=300.0)[0])
    if woven_object.weave.threads.n_crossings == 0:
        return
    bodies = bodies_of(woven_object, spun(woven_object, sides=5))
    assert len(clashing_facets(bodies)) == 0
    for body in bodies:
        assert trimesh.Trimesh(body.vertices, body.all_triangles, process=False).is_watertight


# --- the checks object ------------------------------------------------------------------------


def spines_of(shape: str, radius: float):
    woven_object = woven(shape)
    course = course_of(woven_object)
    return draw_spines(course, np.full(len(course.place), radius))


@pytest.mark.slow
def test_thick_yarns_touch_and_bend_too_tightly():
    assert len(touching_points(spines_of("torus?m=10&n=6", 1.0))) == 0
    assert len(touching_points(spines_of("torus?m=10&n=6", 30.0))) > 0
    assert len(bends_too_tightly(spines_of("torus?m=10&n=6", 1.0))) == 0
    assert len(bends_too_tightly(spines_of("torus?m=10&n=6", 60.0))) > 0


def test_a_yarn_moved_into_another_is_found():
    spines = spines_of("octahedron", 2.0)
    point = spines.point.copy()
    a, b = spines.offsets[0], spines.offsets[1]
    point[a + 3] = point[b + 3]
    moved = replace(spines, point=point)
    pairs = touching_points(moved)
    assert {(0, 1)} <= {tuple(sorted(spines.thread[pair])) for pair in pairs}


def test_clashing_facets_names_the_bodies():
    woven_object = woven("tetrahedron")
    bodies = bodies_of(woven_object, spun(woven_object))
    moved = replace(bodies[0], vertices=bodies[0].vertices + 12.0)
    found = clashing_facets((moved, *bodies[1:]))
    assert len(found)
    assert 0 in found


@given(st.integers(0, 2**32 - 1))
def test_segment_distances_against_sampling(seed):
    dice = np.random.default_rng(seed)
    a, b, c, d = dice.normal(size=(4, 5, 3))
    if seed % 3 == 0:
        d = c + (b - a)  # parallel
    t = np.linspace(0, 1, 200)[:, None, None]
    one, other = a + t * (b - a), c + t * (d - c)
    away = np.linalg.norm(one[:, None] - other[None], axis=3).reshape(-1, 5).min(axis=0)
    found, _ = segment_distances(a.T, b.T, c.T, d.T)
    assert (found <= away + 1e-12).all()
    # Samples are half a step from the nearest points at most.
    step = (np.linalg.norm(b - a, axis=1) + np.linalg.norm(d - c, axis=1)) / 199 / 2
    assert (found >= away - step - 1e-12).all()
