"""The motions that map a weave onto itself: over goes to over, in space and in the permutations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from symmetry_oracle import all_motions, pass_places
from weaving_meshes import meshes, walked

from fabweave.mesh.automorphisms import find_symmetry, orbits
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar, torus
from fabweave.mesh.upright import largest_dimension
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave
from fabweave.weave.symmetry import WeaveSymmetry, find_weave_symmetry, nearest_symmetry
from fabweave.weave.threads import thread_labels
from fabweave.weave.weave_pattern import weave_pattern


def plain(mesh: PolyMesh) -> tuple[Halfedges, Weave]:
    halfedges, threads = walked(mesh)
    return halfedges, plain_weave(threads)


def twill(mesh: PolyMesh) -> tuple[Halfedges, Weave]:
    halfedges, threads = walked(mesh)
    labels = thread_labels(threads.n_threads)
    result = weave_pattern("twill", halfedges, threads, part_bunches(threads), labels)
    return halfedges, result.weave


def twists_by_ends(halfedges: Halfedges, weave: Weave) -> dict:
    """Return the twist of each crossing by the vertices of its edge, in order."""
    first = weave.threads.crossing_halfedge
    ends = np.sort(np.stack((halfedges.tail[first], halfedges.head[first]), axis=1), axis=1)
    return dict(zip(map(tuple, ends.tolist()), weave.twist.tolist(), strict=True))


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


def stabiliser_of(found, thread: int) -> np.ndarray:
    """Return the motions that map a thread onto itself, the identity among them."""
    return np.flatnonzero(found.thread_images(np.array([thread]))[:, 0] == thread)


@pytest.mark.parametrize(
    ("shape", "rotations", "stabiliser"),
    [
        # A rotation keeps the sense of every screw, and in plain weave there is one sense: so
        # each rotation of the body is one of the weave, and no reflection is. Threads are the
        # Petrie polygons, and the rotations take each to each: 12 / 3, 24 / 4, 60 / 6.
        ("tetrahedron", 12, 4),
        ("cube", 24, 6),
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
            assert len(stabiliser_of(found, thread)) == stabiliser


def test_twill_on_a_torus_has_half_the_rotations():
    # Turning by one step keeps the twill; turning the ring over swaps its warp and weft.
    mesh = torus(24, 12, 35.0, 15.0)
    halfedges, weave = twill(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert found.group.n_rotations == 24
    assert np.array_equal(np.sort(found.group.angle_deg), np.arange(-165.0, 181.0, 15.0))
    assert_carried(mesh, halfedges, found)
    # Orbits have as many members as the group has elements over their stabilisers.
    sizes = np.bincount(found.thread_orbits)[found.thread_orbits]
    for thread, size in enumerate(sizes.tolist()):
        assert size * len(stabiliser_of(found, thread)) == found.group.order


def test_twill_on_an_odd_torus_has_reflections():
    # A reflection of it swaps the two twists everywhere, and so keeps over and under.
    mesh = torus(8, 3, 35.0, 15.0)
    halfedges, weave = twill(mesh)
    found = find_weave_symmetry(mesh, halfedges, weave)
    assert len(all_motions(mesh, twists_by_ends(halfedges, weave))) == found.group.order
    assert (found.group.n_rotations, found.group.n_reflections) == (4, 4)
    assert_carried(mesh, halfedges, found)


@pytest.mark.parametrize("turn", [False, True])
def test_a_saddle_in_plain_weave_is_turned_over_by_half_turns(turn):
    mesh = hypar(4, 4, 10.0, 3.0)
    halfedges, threads = walked(mesh, turn=turn)
    found = find_weave_symmetry(mesh, halfedges, plain_weave(threads))
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
    halfedges, threads = walked(mesh)
    first = threads.crossing_halfedge
    chosen = np.random.default_rng(seed).integers(0, 2, 4 * classes).astype(bool)
    across = np.abs(halfedges.head[first] - halfedges.tail[first]) == 1
    twist = chosen[(halfedges.tail[first] % (2 * classes)) + 2 * classes * across]
    weave = Weave(threads, "own", twist, over_of_passes(threads, twist))
    expected = all_motions(mesh, twists_by_ends(halfedges, weave))
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
    halfedges, threads = walked(mesh, turn=True)
    found = find_weave_symmetry(mesh, halfedges, plain_weave(threads))
    assert found.group.order == 4
    assert_carried(mesh, halfedges, found)


def test_symmetries_that_a_few_digits_hide_are_found():
    """Rounded, a torus of six sides keeps its mirrors exactly, and turns by a sixth nearly."""
    mesh = torus(6, 4, 35.0, 15.0)
    rough = mesh.with_vertices(mesh.vertices.round(3))
    exact, near = (nearest_symmetry(one, build_halfedges(one)) for one in (mesh, rough))
    assert find_symmetry(rough, build_halfedges(rough)).order not in (1, exact.order)
    assert near.order == exact.order == 24
