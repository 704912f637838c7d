"""Refinement schemes: what they keep, how much they make, and where it stands."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import klein_bottle, merged, moebius_strip, shuffled
from weaving_meshes import meshes

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.one_rings import find_rim, valences
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.subdivide import (
    MOST_EDGES,
    SCHEMES,
    Refinement,
    catmull_clark,
    catmull_clark_limit,
    doo_sabin,
    find_scheme,
    format_refinements,
    loop,
    loop_limit,
    parse_refinements,
    refine_mesh,
    simplest,
)
from fabweave.mesh.triangulate import triangulate

NAMES = [scheme.name for scheme in SCHEMES]
names = pytest.mark.parametrize("name", NAMES)


def refined(mesh, name, steps=1):
    return refine_mesh(mesh, [Refinement(name, steps)])


# What every scheme keeps.


@st.composite
def meshes_with_middles(draw):
    """Give meshes with extra vertices on some edges: two edges each, or boundary tips."""
    mesh = draw(meshes())
    half = build_halfedges(mesh)
    chosen = np.random.default_rng(draw(st.integers(0, 2**32))).random(half.n_edges) < 0.15
    middle = mesh.n_vertices + np.cumsum(chosen) - 1
    faces, h = [], 0
    for face in mesh.faces():
        faces.append([])
        for v in face:
            faces[-1] += [v, int(middle[half.edge[h]])] if chosen[half.edge[h]] else [v]
            h += 1
    first = half.edge_halfedge[chosen]
    points = (mesh.vertices[half.tail[first]] + mesh.vertices[half.head[first]]) / 2
    return PolyMesh.from_faces(np.concatenate([mesh.vertices, points]), faces)


@names
@settings(max_examples=25)
@given(
    mesh=st.one_of(meshes(), meshes_with_middles()),
    steps=st.integers(1, 3),
    seed=st.integers(0, 2**32),
)
def test_topology_is_kept(name, mesh, steps, seed):
    mesh = shuffled(merged(mesh, solids.cube()) if seed % 2 else mesh, seed)
    if mesh.n_faces > 60:
        steps = 1
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    if name in ("loop", "mid-edge") and np.any(~rim.on & (valences(half, rim) == 2)):
        with pytest.raises(CannotMakeError, match="only two edges"):
            refined(mesh, name, steps)
        return
    before, after = check_mesh(mesh), check_mesh(refined(mesh, name, steps))
    assert after.manifold
    assert after.oriented
    assert not after.fatal
    assert (after.euler, after.n_boundary_loops) == (before.euler, before.n_boundary_loops)
    assert sorted(after.component_genus) == sorted(before.component_genus)


@names
@given(mesh=meshes(), seed=st.integers(0, 2**32))
@settings(max_examples=15)
def test_schemes_follow_every_affine_map(name, mesh, seed):
    rng = np.random.default_rng(seed)
    matrix, shift = rng.normal(size=(3, 3)), rng.normal(size=3)
    plain = refined(mesh, name, 2)
    moved = refined(mesh.with_vertices(mesh.vertices @ matrix + shift), name, 2)
    assert np.array_equal(moved.indices, plain.indices)
    scale = 1 + np.abs(moved.vertices).max()
    assert np.abs(moved.vertices - (plain.vertices @ matrix + shift)).max() < 1e-9 * scale


@names
@given(
    m=st.integers(1, 7),
    n=st.integers(1, 7),
    seed=st.integers(0, 2**32),
    steps=st.integers(1, 3),
)
@settings(max_examples=15)
def test_plane_stays_plane_and_faces_keep_facing_up(name, m, n, seed, steps):
    """Faces of a flat grid with some diagonals stay flat, face up, and do not overlap."""
    rng = np.random.default_rng(seed)
    flat = grids.hypar(m, n, 10.0, 0.0)
    faces = []
    for a, b, c, d in flat.faces():
        cut = [[[a, b, c, d]], [[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]]
        faces += cut[int(rng.integers(3))]
    mesh = refined(PolyMesh.from_faces(flat.vertices, faces), name, steps)
    assert np.abs(mesh.vertices[:, 2]).max() < 1e-12
    areas = signed_areas(mesh)
    assert areas.min() > 1e-6
    # The sum of the areas is the area inside the boundary, whatever lies between.
    assert areas.sum() == pytest.approx(area_inside_rim(mesh), rel=1e-9)
    if not find_scheme(name).smooth:
        assert areas.sum() == pytest.approx(100.0)
    assert areas.sum() <= 100 + 1e-9


def signed_areas(mesh):
    x, y, _ = mesh.vertices[mesh.indices].T
    following = build_halfedges(mesh).next
    return np.add.reduceat(x * y[following] - y * x[following], mesh.offsets[:-1]) / 2


def area_inside_rim(mesh):
    half = build_halfedges(mesh)
    rim = half.twin < 0
    (x, y, _), (u, v, _) = mesh.vertices[half.tail[rim]].T, mesh.vertices[half.head[rim]].T
    return float(np.sum(x * v - y * u) / 2)


# How much they make.


@names
@settings(max_examples=20)
@given(mesh=meshes())
def test_counts_are_those_of_the_formulas(name, mesh):
    half = build_halfedges(mesh)
    v, e, f, h = mesh.n_vertices, half.n_edges, mesh.n_faces, mesh.n_corners
    rim = find_rim(half, v)
    inner_edges = e - int(rim.on.sum())
    inner_vertices = int(np.sum(~rim.on & (np.bincount(half.tail, minlength=v) >= 3)))
    fine = refined(mesh, name)
    got = fine.n_vertices, build_halfedges(fine).n_edges, fine.n_faces
    if name in ("catmull-clark", "quads"):
        assert got == (v + e + f, 2 * e + h, h)
    elif name in ("loop", "mid-edge"):
        assert got == (v + e, 2 * e + h, h + f)
    elif name == "doo-sabin":
        assert (got[0], got[2]) == (h, f + inner_edges + inner_vertices)
    elif not rim.on.any():
        assert (got[0], got[2]) == (e, f + inner_vertices)
        assert got[1] == h - int(np.sum(np.bincount(half.tail) == 2))


@names
@given(mesh=meshes(closed=True), steps=st.integers(1, 3))
@settings(max_examples=15)
def test_prediction_is_exact_on_closed_meshes(name, mesh, steps):
    edges = build_halfedges(mesh).n_edges
    finer = build_halfedges(refine_mesh(mesh, [Refinement(name, steps)]))
    assert finer.n_edges == find_scheme(name).growth ** steps * edges


# Where it stands.


@pytest.mark.parametrize(
    ("name", "sizes", "edges"),
    [
        ("catmull-clark", {4}, {4}),
        ("doo-sabin", {4}, {4}),
        ("simplest", {4}, {4}),
        ("quads", {4}, {4}),
        ("mid-edge", {3, 4}, {4, 6}),
    ],
)
def test_a_regular_torus_stays_regular_and_dual_schemes_make_all_vertices_so(name, sizes, edges):
    mesh = refined(grids.torus(7, 5, 35.0, 15.0), name)
    assert set(mesh.face_sizes.tolist()) == sizes
    assert set(np.bincount(mesh.indices).tolist()) == edges
    if name in ("doo-sabin", "simplest"):
        for solid in (solids.tetrahedron(), solids.icosahedron(), solids.dodecahedron()):
            assert set(np.bincount(refined(solid, name).indices).tolist()) == {4}


def test_known_positions_on_the_cube():
    fine = catmull_clark(solids.cube())
    assert np.abs(fine.vertices[:8]) == pytest.approx(np.full((8, 3), 5 / 9))
    assert np.sort(np.abs(fine.vertices[8:20])) == pytest.approx(np.tile([0, 0.75, 0.75], (12, 1)))
    assert np.sort(np.abs(fine.vertices[20:])) == pytest.approx(np.tile([0, 0, 1.0], (6, 1)))
    assert np.abs(catmull_clark_limit(solids.cube()).vertices) == pytest.approx(
        np.full((8, 3), 0.5)
    )
    small = np.sort(np.abs(doo_sabin(solids.cube()).vertices))
    assert small == pytest.approx(np.tile([0.5, 0.5, 1.0], (24, 1)))


@given(mesh=meshes())
def test_smooth_triangles_follow_loops_masks(mesh):
    """The plain textbook loop over a triangle mesh as the oracle."""
    mesh = triangulate(mesh)
    half = build_halfedges(mesh)
    fine = loop(mesh).vertices
    p = mesh.vertices
    around = [set() for _ in p]
    for a, b in zip(half.tail.tolist(), half.head.tolist(), strict=True):
        around[a].add(b)
        around[b].add(a)
    for edge, h in enumerate(half.edge_halfedge.tolist()):
        a, b, t = half.tail[h], half.head[h], half.twin[h]
        expected = (p[a] + p[b]) / 2
        if t >= 0:
            c, d = half.tail[half.prev[h]], half.tail[half.prev[t]]
            expected = 3 / 8 * (p[a] + p[b]) + (p[c] + p[d]) / 8
        assert fine[mesh.n_vertices + edge] == pytest.approx(expected)
    rim = find_rim(half, mesh.n_vertices)
    for v in np.flatnonzero(~rim.on).tolist():
        n = len(around[v])
        beta = (5 / 8 - (3 / 8 + math.cos(2 * math.pi / n) / 4) ** 2) / n
        expected = (1 - n * beta) * p[v] + beta * sum(p[w] for w in around[v])
        assert fine[v] == pytest.approx(expected)


@given(mesh=meshes())
def test_doo_sabin_follows_its_masks_inside(mesh):
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    fine = doo_sabin(mesh).vertices
    faces = mesh.faces()
    for f, face in enumerate(faces):
        if rim.on[face].any():
            continue
        n = len(face)
        for k in range(n):
            weights = [(3 + 2 * math.cos(2 * math.pi * (j - k) / n)) / (4 * n) for j in range(n)]
            weights[k] = (n + 5) / (4 * n)
            expected = np.array(weights) @ mesh.vertices[face]
            assert fine[mesh.offsets[f] + k] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("step", "limit"),
    [(catmull_clark, catmull_clark_limit), (loop, loop_limit)],
    ids=["cc", "loop"],
)
@given(mesh=meshes(), more=st.integers(1, 2))
@settings(max_examples=25)
def test_limit_does_not_depend_on_the_number_of_steps(step, limit, mesh, more):
    """Interior, extraordinary, boundary and corner vertices alike, on polygons of any size."""
    early = limit(mesh).vertices
    fine = mesh
    for _ in range(more):
        fine = step(fine)
    late = limit(fine).vertices[: mesh.n_vertices]
    assert np.abs(early - late).max() < 1e-9 * np.abs(mesh.vertices).max()


@pytest.mark.parametrize("step", [doo_sabin, simplest])
@given(mesh=meshes(closed=True))
@settings(max_examples=15)
def test_centres_of_faces_stay_and_so_lie_on_the_limit_surface(step, mesh):
    """A face's shrunk copy comes first in the result and has the same centre, step by step."""
    fine = step(step(mesh))
    middle = face_centres(mesh)
    assert np.abs(face_centres(fine)[: mesh.n_faces] - middle).max() < 1e-9 * np.abs(middle).max()


@pytest.mark.parametrize("name", ["mid-edge", "quads"])
@given(mesh=meshes())
@settings(max_examples=15)
def test_linear_schemes_keep_vertices_and_area(name, mesh):
    fine = refined(mesh, name, 2)
    assert np.array_equal(fine.vertices[: mesh.n_vertices], mesh.vertices)
    half = build_halfedges(mesh)
    ends = mesh.vertices[half.tail] + mesh.vertices[half.head]
    once = refined(mesh, name)
    first = half.edge_halfedge
    assert np.array_equal(once.vertices[mesh.n_vertices :][: half.n_edges], ends[first] / 2)


# The boundary.


def rim_points(mesh, start):
    """Return the boundary polygon through a vertex."""
    half = build_halfedges(mesh)
    rim = find_rim(half, mesh.n_vertices)
    points = [start]
    while (v := int(rim.after[points[-1]])) != start:
        points.append(v)
    return mesh.vertices[points]


@given(m=st.integers(3, 12), n=st.integers(1, 5))
def test_rim_of_a_tube_is_the_spline_curve(m, n):
    """Boundary vertices of smooth schemes stand on the B-spline curve of the old ones."""
    mesh = grids.tube(m, n, 25.0, 100.0)
    ring = 2 / 3 + math.cos(2 * math.pi / m) / 3  # (1, 4, 1)/6 on a regular polygon
    for name in ("catmull-clark", "loop"):
        fine = refined(mesh, name, 2)
        radius = np.hypot(*fine.vertices[: mesh.n_vertices][:: n + 1, :2].T)
        assert radius == pytest.approx(np.full(m, 25.0 * ring))
        on = find_rim(build_halfedges(fine), fine.n_vertices).on
        assert np.abs(fine.vertices[on, 2]) == pytest.approx(np.full(on.sum(), 50.0))
        assert on.sum() == 2 * m * 4


def chaikin(points):
    following = np.roll(points, -1, axis=0)
    return np.stack([0.75 * points + 0.25 * following, 0.25 * points + 0.75 * following], axis=1)


@pytest.mark.parametrize(("step", "times"), [(doo_sabin, 1), (simplest, 2)])
@given(m=st.integers(3, 9), n=st.integers(2, 5))
def test_rim_of_dual_schemes_is_cut_as_by_chaikin(step, times, m, n):
    mesh = grids.tube(m, n, 25.0, 100.0)
    fine, expected = mesh, rim_points(mesh, 0)
    for _ in range(2):
        expected = chaikin(expected).reshape(-1, 3)
        for _ in range(times):
            fine = step(fine)
        on = find_rim(build_halfedges(fine), fine.n_vertices).on
        lower = fine.vertices[on & (fine.vertices[:, 2] < 0)]
        assert sorted(map(tuple, lower.round(9) + 0.0)) == sorted(
            map(tuple, expected.round(9) + 0.0)
        )
        # The rows next to the boundary become denser with the rest: no strip is left behind.
        inner = np.unique(np.abs(np.abs(fine.vertices[:, 2]) - 50).round(9))
        assert inner[1] <= 100 / n


@pytest.mark.parametrize("name", ["catmull-clark", "doo-sabin", "loop"])
def test_corners_of_a_sheet_stay_and_flat_grids_stay_straight(name):
    mesh = grids.hypar(5, 4, 10.0, 0.0)
    fine = refined(mesh, name, 2)
    where = {tuple(point) for point in fine.vertices[:, :2].round(9).tolist()}
    assert {(-5.0, -5.0), (-5.0, 5.0), (5.0, -5.0), (5.0, 5.0)} <= where
    assert signed_areas(fine).sum() == pytest.approx(100.0)
    if name == "doo-sabin":  # a grid of m cells becomes one of 2m - 1, its rows straight
        assert [len(np.unique(fine.vertices[:, axis].round(9))) for axis in (0, 1)] == [18, 14]


# Chains.


@given(st.lists(st.builds(Refinement, st.sampled_from(NAMES), st.integers(1, 9)), max_size=4))
def test_text_of_refinements_reads_back(chain):
    assert parse_refinements(format_refinements(chain)) == tuple(chain)


@names
def test_too_much_is_refused_at_once(name):
    def never(*_told):
        raise AssertionError("a step was begun")

    torus, steps = grids.torus(24, 12, 35.0, 15.0), [Refinement(name, 100)]
    with pytest.raises(CannotMakeError, match=f"more than {MOST_EDGES} edges"):
        refine_mesh(torus, steps, progress=never)
    # Fewer steps would be begun.
    with pytest.raises(AssertionError, match="begun"):
        refine_mesh(torus, [Refinement(name, 1)], progress=never)


# What cannot be refined.


def back_to_back():
    return PolyMesh.from_faces(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3], [0, 3, 2, 1]]
    )


def test_vertices_with_two_edges():
    for name in ("loop", "mid-edge"):
        with pytest.raises(CannotMakeError, match="only two edges"):
            refined(back_to_back(), name)
    for name in ("catmull-clark", "quads"):
        report = check_mesh(refined(back_to_back(), name))
        assert not report.fatal
        assert report.genus == 0
    prism = doo_sabin(back_to_back())
    assert sorted(prism.face_sizes.tolist()) == [4] * 6
    assert check_mesh(prism).genus == 0


@names
def test_what_is_no_oriented_surface_is_refused(name):
    for mesh in (moebius_strip(5), klein_bottle(4, 5)):
        with pytest.raises(InputError, match="in the same direction"):
            refined(mesh, name)
    bow_tie = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [0, 3, 4]])
    if name != "quads":
        with pytest.raises(InputError, match="touch at 1 vertices"):
            refined(bow_tie, name)
