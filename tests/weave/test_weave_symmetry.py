"""The motions that map a weave onto itself: over goes to over, in space and in the permutations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes_shared import shared_mesh
from symmetry_oracle import all_motions, pass_places
from weaving_meshes import meshes

from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import largest_dimension
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar, torus, tube
from fabweave.mesh.subdivide.catmull_clark import catmull_clark
from fabweave.mesh.symmetry.group import orbits
from fabweave.mesh.symmetry.search import find_symmetry
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave
from fabweave.weave.symmetry import WeaveSymmetry, find_weave_symmetry
from fabweave.weave.thread_labels import thread_labels
from fabweave.weave.threads import trace_threads
from fabweave.weave.weave_pattern import weave_pattern


def plain(mesh: PolyMesh) -> tuple[Halfedges, Weave]:
    halfedges = build_halfedges(mesh)
    return halfedges, plain_weave(trace_threads(halfedges))


def twisted(mesh: PolyMesh, twist: np.ndarray) -> tuple[Halfedges, Weave]:
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    return halfedges, Weave(threads, "own", twist, over_of_passes(threads, twist))


def patterned(mesh: PolyMesh, pattern: str) -> tuple[Halfedges, Weave]:
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    labels = thread_labels(threads.n_threads)
    result = weave_pattern(pattern, halfedges, threads, part_bunches(threads), labels)
    return halfedges, result.weave


def assert_carried(mesh: PolyMesh, halfedges: Halfedges, found: WeaveSymmetry) -> None:
    """Check by places in space that each motion takes each pass to its image, above or below."""
    places = pass_places(mesh, halfedges, found.weave)
    group, threads = found.group, found.weave.threads
    images = found.pass_images(np.arange(len(places)))
    for matrix, image in zip(group.matrix, images, strict=True):
        moved = group.centre + (places - group.centre) @ matrix.T
        there = places[image]
        tolerance = 1e-5 * largest_dimension(mesh)
        assert np.abs(moved[:, 0] - there[:, 0]).max() < tolerance
        same = np.abs(moved - there).max(axis=(1, 2)) < tolerance
        against = np.abs(moved - there[:, [0, 2, 1]]).max(axis=(1, 2)) < tolerance
        assert np.all(same | against)
        assert np.array_equal(np.sort(image), np.arange(len(places)))
    # Threads go to threads, and the generators alone make the same orbits.
    all_threads = found.thread_images(np.arange(threads.n_threads))
    assert np.array_equal(found.thread_orbits, orbits(all_threads, threads.n_threads))
    first = threads.crossing_halfedge
    assert np.array_equal(
        group.images(first)[1 : 1 + len(group.generators)], group.generators[:, first]
    )
    for image, thread in zip(images, all_threads, strict=True):
        assert np.array_equal(threads.thread_of_pass[image], thread[threads.thread_of_pass])


@pytest.mark.parametrize(
    ("shape", "rotations", "stabiliser"),
    [
        # A rotation keeps the sense of every screw, and in plain weave there is one sense: so
        # each rotation of the body is one of the weave, and no reflection is. Threads are the
        # Petrie polygons, and the rotations take each to each: 12 / 3, 24 / 4, 60 / 6.
        ("tetrahedron", 12, 4),
        ("cube", 24, 6),
        ("octahedron", 24, 6),
        ("icosahedron", 60, 10),
        ("dodecahedron", 60, 10),
        ("sphere", 24, None),
        ("torus?m=24&n=12", 48, None),
    ],
)
def test_plain_weave_has_the_rotations_of_its_mesh(shape, rotations, stabiliser):
    mesh = parse_shape(f"shape:{shape}")
    halfedges, weave = plain(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert (found.group.n_rotations, found.group.n_reflections) == (rotations, 0)
    assert_carried(mesh, halfedges, found)
    if stabiliser is not None:
        assert not found.thread_orbits.any()
        assert not found.crossing_orbits.any()
        for thread in range(weave.threads.n_threads):
            assert len(found.stabiliser(thread)) == stabiliser


def test_twill_on_a_torus_has_half_the_rotations():
    # Turning by one step keeps the twill; turning the ring over swaps its warp and weft.
    mesh = torus(24, 12, 35.0, 15.0)
    halfedges, weave = patterned(mesh, "twill")
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert found.group.n_rotations == 24
    assert np.array_equal(np.sort(found.group.angle_deg), np.arange(-165.0, 181.0, 15.0))
    assert_carried(mesh, halfedges, found)
    # Orbits have as many members as the group has elements over their stabilisers.
    sizes = np.bincount(found.thread_orbits)[found.thread_orbits]
    for thread, size in enumerate(sizes.tolist()):
        assert size * len(found.stabiliser(thread)) == found.group.order


def test_twill_on_an_odd_torus_has_reflections():
    # A reflection of it swaps the two twists everywhere, and so keeps over and under.
    mesh = torus(8, 3, 35.0, 15.0)
    halfedges, weave = patterned(mesh, "twill")
    found = find_weave_symmetry(mesh, halfedges, weave)
    first = weave.threads.crossing_halfedge
    ends = np.sort(np.stack((halfedges.tail[first], halfedges.head[first]), axis=1), axis=1)
    sense = dict(zip(map(tuple, ends.tolist()), weave.twist.tolist(), strict=True))
    assert len(all_motions(mesh, sense)) == found.group.order
    assert (found.group.n_rotations, found.group.n_reflections) == (4, 4)
    assert_carried(mesh, halfedges, found)


def test_refined_icosahedron():
    mesh = catmull_clark(catmull_clark(parse_shape("shape:icosahedron")))
    halfedges, weave = plain(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert (found.group.n_rotations, found.group.n_reflections) == (60, 0)
    assert_carried(mesh, halfedges, found)
    # Only a half-turn about its own middle leaves a crossing in its place.
    orbit = np.bincount(found.crossing_orbits)
    assert set(orbit.tolist()) <= {30, 60}
    assert orbit.sum() == weave.threads.n_crossings


def test_the_mirror_image_of_a_plain_weave_has_over_and_under_swapped():
    mesh = read_mesh(shared_mesh("quad/spot_quadrangulated.obj")).mesh
    halfedges, weave = plain(mesh)
    assert find_weave_symmetry(mesh, halfedges, weave).group.order == 1
    reflection = find_symmetry(mesh, halfedges).permutations[1]
    # With each side twisted its own way, the reflection carries over to over.
    edge = halfedges.edge[halfedges.edge_halfedge]
    image = halfedges.edge[reflection[halfedges.edge_halfedge]]
    on_mirror = edge == image
    assert on_mirror.any()
    halfedges, both = twisted(mesh, edge < image)
    # An edge on the mirror, or across it, is its own image, and no screw is its own mirror image.
    assert find_weave_symmetry(mesh, halfedges, both).group.order == 1


def test_a_weave_may_have_reflections():
    # A reflection that leaves no edge in its place: one of two edges is twisted each way.
    mesh = tube(6, 2, 10.0, 17.0)
    halfedges = build_halfedges(mesh)
    group = find_symmetry(mesh, halfedges)
    first = trace_threads(halfedges).crossing_halfedge
    crossing = np.full(halfedges.n_edges, -1)
    crossing[halfedges.edge[first]] = np.arange(len(first))
    for reflection in np.flatnonzero(~group.proper):
        image = crossing[halfedges.edge[group.permutations[reflection][first]]]
        if np.array_equal(image[image], np.arange(len(first))) and np.all(
            image != np.arange(len(first))
        ):
            halfedges, weave = twisted(mesh, np.arange(len(first)) < image)
            found = find_weave_symmetry(mesh, halfedges, weave)
            assert found.group.n_reflections >= 1
            assert_carried(mesh, halfedges, found)
            break
    else:
        pytest.fail("no reflection leaves every edge")


def test_a_saddle_in_plain_weave_is_turned_over_by_half_turns():
    mesh = hypar(4, 4, 10.0, 3.0)
    halfedges, weave = plain(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert (found.group.n_rotations, found.group.n_reflections) == (4, 0)
    # What is above from the front lies below from the back, and carried there it is above again.
    assert np.count_nonzero(found.group.reverses) == 2
    assert_carried(mesh, halfedges, found)


@given(
    st.sampled_from([(4, 3), (4, 4), (6, 3)]),
    st.sampled_from([1, 2, 3]),
    st.integers(0, 2**32 - 1),
)
def test_trying_all_motions_finds_those_of_any_twists(sides, classes, seed):
    # Twists that depend on little keep some of the symmetry.
    mesh = torus(*sides, 35.0, 15.0)
    halfedges = build_halfedges(mesh)
    first = trace_threads(halfedges).crossing_halfedge
    chosen = np.random.default_rng(seed).integers(0, 2, 4 * classes).astype(bool)
    across = np.abs(halfedges.head[first] - halfedges.tail[first]) == 1
    twist = chosen[(halfedges.tail[first] % (2 * classes)) + 2 * classes * across]
    halfedges, weave = twisted(mesh, twist)
    ends = np.sort(np.stack((halfedges.tail[first], halfedges.head[first]), axis=1), axis=1)
    sense = dict(zip(map(tuple, ends.tolist()), twist.tolist(), strict=True))
    expected = all_motions(mesh, sense)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert found.group.order == len(expected)
    for matrix in expected:
        assert np.abs(found.group.matrix - matrix).max(axis=(1, 2)).min() < 1e-9
    assert_carried(mesh, halfedges, found)


@given(meshes())
def test_rotations_of_any_mesh_carry_its_plain_weave(mesh):
    halfedges, weave = plain(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert found.group.n_reflections == 0
    assert found.group.order == find_symmetry(mesh, halfedges, reflections=False).order
    if weave.threads.n_crossings:
        assert_carried(mesh, halfedges, found)


def test_threads_that_turn_at_the_boundary_are_carried():
    mesh = hypar(4, 4, 10.0, 3.0)
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges, turn=True))
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert found.group.order == 4
    assert_carried(mesh, halfedges, found)


def test_one_other_twist_leaves_what_keeps_its_edge():
    mesh = parse_shape("shape:cube")
    _, weave = plain(mesh)
    twist = weave.twist.copy()
    twist[5] = False
    found = find_weave_symmetry(mesh, *twisted(mesh, twist))
    # The half-turn about the middle of that edge, and no reflection: the rest is plain.
    assert (found.group.n_rotations, found.group.n_reflections) == (2, 0)
    assert found.group.angle_deg[1] == 180.0
    assert found.crossing_orbits[5] not in np.delete(found.crossing_orbits, 5)
