"""Quads born from the skeleton: limbs are tubes, and rows of quads are put in and taken out."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from starfish import starfish

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.fair.fairing import fair_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.likeness import likeness
from fabweave.mesh.polymesh import face_centres
from fabweave.mesh.remesh import skeleton_quads
from fabweave.mesh.remesh.engines import SKELETON
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.limbs import pillowed
from fabweave.mesh.remesh.remeshed import check_remeshed, edge_lengths
from fabweave.mesh.remesh.skeleton_quads import (
    Skeleton,
    find_chords,
    lengthened,
    pruned,
    remesh_tubes,
    split_chords,
    wide_part,
    without_chord,
)
from fabweave.mesh.shapes.grids import hemisphere, sphere, torus
from fabweave.mesh.shapes.solids import cube
from fabweave.mesh.triangulate import triangulate

needs_pygel = pytest.mark.skipif(SKELETON.lack != "", reason="PyGEL cannot run")


def euler(mesh):
    return check_mesh(mesh).euler


@pytest.fixture(scope="module")
def star():
    return starfish()


@pytest.mark.slow
@needs_pygel
def test_limbs_are_counted_and_kept(star) -> None:
    found = remesh_tubes(star, 200)
    assert any("a skeleton with 5 tips" in note for note in found.notes)
    assert np.all(found.mesh.face_sizes == 4)
    assert check_remeshed(star, found.mesh) == ()
    assert 0.6 * 200 <= found.mesh.n_faces <= 1.1 * 200
    faired = fair_mesh(found.mesh, model_of(star, found.mesh.n_vertices)).mesh
    like = likeness(star, faired)
    assert like.greatest_mm < 0.05 * like.size_mm


@pytest.mark.slow
@needs_pygel
@pytest.mark.parametrize(
    "model", [triangulate(torus(40, 20, 100.0, 30.0)), starfish(open_at=2)], ids=["ring", "open"]
)
def test_genus_and_openings_are_kept(model) -> None:
    found = remesh_tubes(model, 150)
    before, after = check_mesh(model), check_mesh(found.mesh)
    assert (after.euler, after.n_boundary_loops) == (before.euler, before.n_boundary_loops)
    assert np.all(found.mesh.face_sizes == 4)


@pytest.mark.slow
@needs_pygel
def test_limbs_too_small_for_ribbons_are_told(star) -> None:
    small = star.with_vertices(star.vertices * 0.12)
    try:
        told = " ".join(remesh_tubes(small, 100).notes)
    except CannotMakeError as error:  # too little may be left
        told = str(error)
    assert "branches are too small for ribbons" in told


@pytest.mark.slow
@needs_pygel
def test_what_has_no_tubes_is_refused_in_one_message(star, monkeypatch) -> None:
    monkeypatch.setattr(skeleton_quads, "check_remeshed", lambda *_: ("it is a pity",))
    with pytest.raises(CannotMakeError, match=r"it is a pity\. What may help: "):
        remesh_tubes(star, 100)


# Chords.


@given(m=st.integers(3, 9), n=st.integers(3, 9))
@settings(max_examples=10)
def test_a_grid_has_a_chord_for_each_row_and_column(m, n) -> None:
    ring = torus(m, n, 3.0, 1.0)
    halfedges = build_halfedges(ring)
    number, chord = find_chords(halfedges)
    assert number == m + n
    assert sorted(np.bincount(chord)) == sorted([m] * n + [n] * m)
    for one in range(number):
        fewer = without_chord(ring, one)
        # Of three rows or columns, none can go: two would lie on one another.
        left = m * n - np.bincount(chord)[one]
        assert (fewer is None) if left in (2 * m, 2 * n) and 3 in (m, n) else fewer.n_faces == left
        assert fewer is None or euler(fewer) == 0


@given(times=st.lists(st.integers(1, 4), min_size=3, max_size=3))
@settings(max_examples=10)
def test_chords_are_split_into_as_many_as_asked(times) -> None:
    a, b, c = times
    fine = split_chords(cube(), np.array(times))
    assert fine.n_faces == 2 * (a * b + b * c + a * c)
    assert euler(fine) == 2
    assert np.allclose(np.abs(fine.vertices).max(axis=1), np.abs(cube().vertices).max())
    assert find_chords(build_halfedges(fine))[0] == a + b + c


@pytest.mark.parametrize("count", [60, 200, 700])
def test_chords_are_put_in_up_to_a_number(count) -> None:
    long = cube().with_vertices(cube().vertices * [1, 1, 6])
    fine = lengthened(long, count)
    assert 0.6 * count <= fine.n_faces <= count
    assert np.ptp(edge_lengths(fine)) / edge_lengths(fine).mean() < 0.6


def test_a_ring_goes_around_a_disc_only() -> None:
    fine = split_chords(cube(), np.array([3, 3, 3]))
    part = np.arange(54) < 9
    ringed = pillowed(fine, part)
    assert ringed.n_faces == 54 + 12
    assert euler(ringed) == 2
    assert check_mesh(ringed).fatal == ()
    ball = torus(12, 6, 3.0, 1.0)
    assert pillowed(ball, np.arange(72) < 6) is None
    bowl = hemisphere(4, 50.0)
    assert pillowed(bowl, np.ones(bowl.n_faces, dtype=bool)) is None


def test_what_is_too_wide_is_found_from_one_side() -> None:
    ball = sphere(6, 50.0)
    high = ball.vertices[:, 2:] > 30
    wide = ball.with_vertices(ball.vertices * np.where(high, 3.0, 1.0))
    side = float(np.median(edge_lengths(ball)))
    part = wide_part(wide, side)
    assert part is not None
    ringed = pillowed(wide, part)
    assert ringed is not None
    assert euler(ringed) == 2
    assert face_centres(wide)[part, 2].min() > 10
    assert wide_part(ball, side) is None


# Skeletons.


def test_bumps_and_small_branches_are_pruned() -> None:
    places = np.array(
        [[0, 0, z] for z in range(0, 110, 10)] + [[x, 0, 50] for x in (12, 24, 36, 48)]
    )
    trunk, limb = list(range(11)), [5, 11, 12, 13, 14]
    edges = np.array([*pairwise(trunk), *pairwise(limb)])

    def kept(radius, reach=15, side=0.0):
        radii = np.array([10.0] * 11 + [radius] * 4)
        used = edges[: reach - 1]
        found, thin = pruned(Skeleton(places[:reach].astype(float), used, radii[:reach]), 4.0, side)
        return found.n_tips, len(thin)

    assert kept(6.0) == (3, 0)
    assert kept(3.0) == (2, 1)
    assert kept(1.5, reach=12) == (2, 0)
    assert kept(6.0, side=30.0) == (3, 0)
    assert kept(6.0, side=60.0) == (2, 1)
