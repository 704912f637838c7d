"""Slit sums, bipyramids with handles, cages, regular meshes: theory, embedding, quality."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow import slow_but
from strategies import volume

from fabweave.core.errors import InputError
from fabweave.mesh.automorphisms import find_symmetry
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import edge_lengths
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.soft_tubes import soft_tubes
from fabweave.mesh.shapes.woven import bundle_quads, slit_columns
from fabweave.mesh.upright import largest_dimension
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill


def twillable(halfedges):
    """Decide twill, and recount the conditions that the found twill breaks."""
    conditions = twill_conditions(halfedges, trace_threads(halfedges))
    decision = decide_twill(conditions)
    if decision.twist is not None:
        assert count_broken(conditions, decision.twist).total == 0
    return decision.twillable


def n_threads(mesh):
    return trace_threads(build_halfedges(mesh)).n_threads


def corner_angles_deg(mesh):
    points = mesh.vertices[mesh.indices.reshape(-1, 4)]
    before = np.roll(points, 1, axis=1) - points
    after = np.roll(points, -1, axis=1) - points
    cosine = (before * after).sum(axis=2)
    cosine /= np.linalg.norm(before, axis=2) * np.linalg.norm(after, axis=2)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def assert_sound(mesh, genus, *, size=100.0):
    """Check that quads make a closed, outward, embedded surface of a genus and a size."""
    report = check_mesh(mesh)
    assert report.findings == ()
    assert (report.closed, report.n_components, report.genus) == (True, 1, genus)
    assert report.face_sizes == ((4, mesh.n_faces),)
    assert mesh.n_vertices - mesh.n_faces == 2 - 2 * genus
    assert volume(mesh) > 0
    assert len(self_intersections(mesh)) == 0
    assert largest_dimension(mesh) == pytest.approx(size, rel=1e-6)


def valences(mesh):
    numbers, counts = np.unique(np.bincount(mesh.indices), return_counts=True)
    return dict(zip(numbers.tolist(), counts.tolist(), strict=True))


def built_unless(description, reason):
    """Build a shape, or return None if it cannot be built for just this reason."""
    try:
        return parse_shape(description)
    except InputError as error:
        if reason not in str(error):
            raise
        return None


# Slit sums


@pytest.mark.parametrize("genus", [1, 2, 3, 4, 5, 6, 7, 8, 13, 30])
def test_slit_sum_is_embedded_and_exactly_twillable(genus):
    mesh = parse_shape(f"shape:slit?genus={genus}")
    assert_sound(mesh, genus)
    assert twillable(build_halfedges(mesh))
    irregular = {key: found for key, found in valences(mesh).items() if key != 4}
    assert irregular == ({8: 2 * (genus - 1)} if genus > 1 else {})
    lengths = edge_lengths(mesh)
    assert lengths.min() > 0.5 * np.median(lengths)
    assert lengths.max() < 2.5 * np.median(lengths)
    angles = corner_angles_deg(mesh)
    assert angles.min() > 40
    assert angles.max() < 140


@settings(max_examples=25)
@given(
    genus=st.integers(2, 7),
    slit=st.integers(2, 5),
    gap=st.integers(2, 6),
    n=st.integers(4, 9),
)
def test_slit_sum_of_any_counts(genus, slit, gap, n):
    m = (genus - 1) * (slit + gap)
    description = f"shape:slit?genus={genus}&m={m}&n={n}&slit={slit}&size=50"
    if m % 2 and n % 2:
        with pytest.raises(InputError, match="both odd"):
            parse_shape(description)
        return
    mesh = built_unless(description, "runs through itself")
    if mesh is None:
        assert m < 3 * n  # a ring so thick that its quads have no room
        return
    assert_sound(mesh, genus, size=50.0)
    assert mesh.n_faces == 2 * m * n
    assert twillable(build_halfedges(mesh))


@given(
    sheets=st.integers(2, 5),
    slits=st.integers(1, 4),
    slit=st.integers(2, 4),
    gap=st.integers(2, 4),
    n=st.integers(3, 7),
)
def test_cyclic_slit_sum_as_theory_says(sheets, slits, slit, gap, n):
    m = slits * (slit + gap)
    quads, corners = bundle_quads(sheets, slit_columns(m, slits, slit), n)
    mesh = PolyMesh.from_faces(np.zeros((quads.max() + 1, 3)), quads)
    genus = 1 + slits * (sheets - 1)
    assert mesh.n_vertices - mesh.n_faces == 2 - 2 * genus
    assert valences(mesh) == {4: mesh.n_vertices - 2 * slits, 4 * sheets: 2 * slits}
    assert len(np.unique(corners)) == sheets * m * (n + 1)
    assert twillable(build_halfedges(mesh)) == (m % 2 == 0 or n % 2 == 0)


# The knot of the examples


def test_the_knot_is_an_embedded_torus_grid():
    mesh = read_mesh(Path(__file__).parents[2] / "examples" / "meshes" / "knot.obj").mesh
    assert_sound(mesh, 1, size=1.0)
    assert valences(mesh) == {4: 66 * 8}
    assert n_threads(mesh) == 2 * math.gcd(66, 8)
    assert twillable(build_halfedges(mesh))
    lengths = edge_lengths(mesh)
    assert lengths.max() < 2.5 * lengths.min()
    assert abs(corner_angles_deg(mesh) - 90).max() < 20


# Bipyramids


@pytest.mark.parametrize("n", slow_but(range(2, 9)))
def test_bipyramid_with_handles(n):
    mesh = parse_shape(f"shape:bipyramid?n={n}")
    assert_sound(mesh, 2 * n)
    tips = {8: 2 * n + 2} if n == 2 else {8: 2 * n, 4 * n: 2}
    assert valences(mesh) == {4: mesh.n_vertices - 2 * n - 2, **tips}
    assert twillable(build_halfedges(mesh))
    assert np.argmax(mesh.vertices[:, 2]) == 0  # the tip
    assert len(np.bincount(mesh.indices)) == mesh.n_vertices


@pytest.mark.slow
@settings(max_examples=12)
@given(n=st.integers(2, 4), edge=st.integers(6, 12), handle=st.integers(5, 12))
def test_bipyramid_of_any_counts(n, edge, handle):
    description = f"shape:bipyramid?n={n}&edge={edge}&handle={handle}&size=70&height=45"
    if edge % 2 and handle % 2:
        with pytest.raises(InputError, match="both odd"):
            parse_shape(description)
        return
    mesh = parse_shape(description)
    assert_sound(mesh, 2 * n, size=70.0)
    assert mesh.n_faces == 6 * n * edge * handle
    assert twillable(build_halfedges(mesh))


# Regular meshes

REGULAR = [(8, 4, 3), (8, 4, 9), (12, 4, 5), (12, 4, 7), (16, 4, 7), (4, 8, 3), (4, 16, 4)]
REGULAR += [(4, 4, 1), (8, 8, 3), (8, 8, 13), (12, 12, 5), (12, 12, 9), (16, 16, 7), (16, 16, 13)]


@pytest.mark.parametrize(("face", "valence", "genus"), REGULAR)
@pytest.mark.parametrize("refine", [2, pytest.param(3, marks=pytest.mark.slow)])
def test_regular_mesh_is_embedded_and_exactly_twillable(face, valence, genus, refine):
    mesh = parse_shape(f"shape:regular?face={face}&valence={valence}&genus={genus}&refine={refine}")
    assert_sound(mesh, genus)
    half, big = build_halfedges(mesh), max(face, valence)
    assert twillable(half)
    # F 4k = V 4k = 2 E and V - E + F = 2 - 2g leave one solution.
    count = (genus - 1) // (big // 4 - 1) if big > 4 else 0
    irregular = {key: found for key, found in valences(mesh).items() if key != 4}
    assert irregular == ({big: 2 * count} if count else {})
    # Around a vertex with 4 k edges the angles cannot be better than 90° / k.
    both_large = face == valence > 4
    assert corner_angles_deg(mesh).min() > (0.4 if both_large else 0.5) * 90 / (big // 4)
    if not both_large:
        return
    # Straight on from one such vertex lies one of the other sort, vertices and middles of faces.
    links = coarse_links(half, face)
    assert len(links) == 2 * count * face
    sort = {int(links[0, 0]): 0}
    while len(sort) < 2 * count:
        sort |= {b: 1 - sort[a] for a, b in links.tolist() if a in sort}
    assert all(sort[a] != sort[b] for a, b in links.tolist())
    assert sum(sort.values()) == count


def coarse_links(half, valence):
    """Return from which vertices of high valence straight lines lead to which, (K, 2)."""
    edges_at = np.bincount(half.tail)
    start = np.flatnonzero(edges_at[half.tail] == valence)
    here = start
    while (going := edges_at[half.head[here]] == 4).any():
        here = np.where(going, half.next[half.twin[half.next[here]]], here)
    assert (edges_at[half.head[here]] == valence).all()
    return np.column_stack((half.tail[start], half.head[here]))


@pytest.mark.parametrize(("faces", "nodes"), [(4, 6), (6, 12), (12, 30)])
@pytest.mark.parametrize(("m", "n"), [(0, 4), (5, 8), pytest.param(16, 16, marks=pytest.mark.slow)])
def test_a_cage_is_regular_and_exactly_twillable(faces, nodes, m, n):
    mesh = parse_shape(f"shape:cage?faces={faces}&m={m}&n={n}&size=300")
    assert_sound(mesh, nodes + 1, size=300.0)
    half = build_halfedges(mesh)
    assert twillable(half)
    assert valences(mesh) == {4: mesh.n_vertices - 2 * nodes, 8: 2 * nodes}
    assert mesh.n_faces == 4 * nodes * (m or n) * n // 2
    assert len(coarse_links(half, 8)) == 16 * nodes
    # As round as the solid: all its rotations are the cage's.
    assert find_symmetry(mesh, half, reflections=False).order == {4: 24, 6: 24, 12: 60}[faces]


# The smooth surface


def test_soft_tubes_meet_the_formula_of_a_torus():
    turn = np.linspace(0, 2 * math.pi, 200, endpoint=False)
    ring = 20 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    tubes = soft_tubes([ring], radius=2.0, blend=1.6, closed=True)
    places = parse_shape("shape:torus?ring=20&tube=3").vertices
    for _ in range(8):
        places = tubes.project(places)
    away = np.hypot(np.hypot(*places[:, :2].T) - 20, places[:, 2])
    assert away == pytest.approx(np.full(len(away), 2.0), rel=0.04)
    assert tubes.project(places) == pytest.approx(places, abs=1e-6)
