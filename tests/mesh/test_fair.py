"""Fairing: vertices stay on the surface and faces upright, while threads straighten."""

import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import run
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from strategies import merged
from trimesh.triangles import closest_point
from weaving_meshes import meshes

from fabweave.core.errors import InputError
from fabweave.mesh import fairing as feature_lines
from fabweave.mesh.check import check_mesh
from fabweave.mesh.fairing import ON_SURFACE, fair_mesh
from fabweave.mesh.fairness import Fairness
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import find_rim
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes.grids import hemisphere, hypar, sphere, torus, tube
from fabweave.mesh.shapes.solids import cube
from fabweave.mesh.subdivide import split_to_quads
from fabweave.mesh.triangulate import fans, triangulate
from fabweave.options.settings import Settings
from fabweave.plan.ask import load_asked
from fabweave.weave.threads import trace_threads


def shaken(mesh, seed, share=0.12):
    """Move every vertex by a share of an edge or so, anywhere."""
    edge = np.linalg.norm(mesh.vertices[mesh.indices[1]] - mesh.vertices[mesh.indices[0]])
    noise = np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return mesh.with_vertices(mesh.vertices + share * edge * noise)


def shaken_plane(m, n, seed):
    """Return a flat grid whose inner vertices are moved in the plane."""
    mesh = hypar(m, n, 100.0, 0.0)
    inner = ~find_rim(build_halfedges(mesh), mesh.n_vertices).on
    noise = np.random.default_rng(seed).uniform(-1, 1, size=mesh.vertices.shape)
    return mesh.with_vertices(mesh.vertices + 30.0 / m * noise * inner[:, None] * [1, 1, 0])


def size_of(mesh):
    return float(np.ptp(mesh.vertices, axis=0).max())


def fan_triangles(mesh):
    """Return the triangles between edges and centres, (H, 3, 3), without the code under test."""
    triangles = []
    for face in mesh.faces():
        corners = mesh.vertices[face]
        triangles += [
            [corners.mean(axis=0), corners[k], corners[(k + 1) % len(face)]]
            for k in range(len(face))
        ]
    return np.array(triangles)


def distances(points, mesh):
    """Return distances from a mesh's surface by trying every triangle."""
    triangles = fan_triangles(mesh)
    found = []
    for point in points:
        nearest = closest_point(triangles, np.broadcast_to(point, (len(triangles), 3)))
        found.append(np.linalg.norm(nearest - point, axis=1).min())
    return np.array(found)


def fan_normals(mesh):
    """Return twice the area vectors of these triangles."""
    centre, tail, head = np.moveaxis(fan_triangles(mesh), 1, 0)
    return np.cross(tail - centre, head - centre)


IRREGULAR = {
    "torus": lambda: shaken(torus(24, 12, 35.0, 15.0), 0),
    "sphere": lambda: shaken(sphere(6, 50.0), 1),
    "hypar": lambda: shaken(hypar(10, 10, 100.0, 20.0), 2),
    "tube": lambda: shaken(tube(16, 12, 25.0, 100.0), 3),
    "hemisphere": lambda: shaken(hemisphere(4, 50.0), 4),
    "triangles": lambda: shaken(triangulate(torus(18, 12, 35.0, 15.0)), 5, 0.06),
    "plane": lambda: shaken_plane(9, 9, 6),
}
irregular = pytest.mark.parametrize("name", IRREGULAR)


@irregular
def test_threads_straighten_and_narrow_ribbons_find_room(name) -> None:
    faired = fair_mesh(IRREGULAR[name](), 30)
    assert faired.after.turning_deg < 0.8 * faired.before.turning_deg
    assert faired.after.width_spread > faired.before.width_spread + 0.04


@irregular
def test_vertices_stay_on_the_surface_and_faces_the_same(name) -> None:
    mesh = IRREGULAR[name]()
    faired = fair_mesh(mesh, 15)
    off = distances(faired.mesh.vertices, mesh)
    assert off.max() < ON_SURFACE * size_of(mesh)
    assert faired.off_surface < ON_SURFACE * size_of(mesh)
    centres_off = distances(face_centres(faired.mesh), mesh).max()
    assert faired.centres_off == pytest.approx(centres_off, rel=1e-6, abs=1e-9)
    assert np.array_equal(faired.mesh.indices, mesh.indices)
    assert np.array_equal(faired.mesh.offsets, mesh.offsets)
    moved = np.linalg.norm(faired.mesh.vertices - mesh.vertices, axis=1)
    assert faired.moved == pytest.approx(moved.max())
    assert moved.max() > 1e-3 * size_of(mesh)
    # The measure can object: a vertex lifted off by little is seen.
    lifted = faired.mesh.vertices + 1e-4 * size_of(mesh)
    assert distances(lifted, mesh).max() > 10 * ON_SURFACE * size_of(mesh)


@pytest.mark.parametrize("seed", range(3))
def test_no_triangle_of_a_ball_turns_inward(seed) -> None:
    mesh = shaken(sphere(6, 50.0), seed)
    faired = fair_mesh(mesh, 40).mesh
    outward = np.einsum("td,td->t", fan_normals(faired), fan_triangles(faired)[:, 0])
    assert np.all(outward > 0)


@pytest.mark.parametrize("seed", range(4))
def test_a_plane_stays_the_plane_it_was_without_overlap(seed) -> None:
    mesh = shaken_plane(8, 6, seed)
    faired = fair_mesh(mesh, 40).mesh
    assert np.abs(faired.vertices[:, 2]).max() < 1e-12
    areas = fan_normals(faired)[:, 2] / 2
    assert areas.min() > 0
    # Upright triangles that cover the square's area once cannot overlap.
    assert areas.sum() == pytest.approx(np.prod(np.ptp(mesh.vertices, axis=0)[:2]), rel=1e-12)
    rim = find_rim(build_halfedges(mesh), mesh.n_vertices)
    reach = np.abs(mesh.vertices[:, :2]).max(axis=0)
    on_side = np.abs(np.abs(faired.vertices[:, :2]) - reach) < 1e-9
    assert np.array_equal(np.any(on_side, axis=1), rim.on)
    corners = np.flatnonzero(rim.corner)
    assert np.array_equal(faired.vertices[corners], mesh.vertices[corners])
    # Vertices of the boundary keep their order, and so their sides.
    ahead = faired.vertices[rim.after[rim.on]] - faired.vertices[rim.on]
    once = mesh.vertices[rim.after[rim.on]] - mesh.vertices[rim.on]
    assert np.all(np.einsum("nd,nd->n", ahead, once) > 0)


@settings(max_examples=25)
@given(mesh=meshes(), seed=st.integers(0, 2**32 - 1))
def test_any_mesh_keeps_what_it_is(mesh, seed) -> None:
    mesh = shaken(mesh, seed, 0.08)
    faired = fair_mesh(mesh, 6)
    size = size_of(mesh)
    off = Surface(*fans(mesh)).closest(faired.mesh.vertices)[2]
    assert off.max() < ON_SURFACE * size
    assert check_mesh(faired.mesh).fatal == ()
    assert np.array_equal(faired.mesh.indices, mesh.indices)
    rim = find_rim(build_halfedges(mesh), mesh.n_vertices)
    if rim.on.any():
        start, end = mesh.vertices[rim.on], mesh.vertices[rim.after[rim.on]]
        for point in faired.mesh.vertices[rim.on]:
            way = end - start
            share = np.einsum("nd,nd->n", point - start, way) / np.sum(way**2, axis=1)
            foot = start + np.clip(share, 0, 1)[:, None] * way
            assert np.linalg.norm(foot - point, axis=1).min() < 1e-9 * size


def test_sharp_edges_and_corners_stay(monkeypatch) -> None:
    mesh = cube()
    for _ in range(3):
        mesh = split_to_quads(mesh)
    corner = np.abs(mesh.vertices).max()
    at_side = np.abs(np.abs(mesh.vertices) - corner) < 1e-9
    rng = np.random.default_rng(0)
    # Vertices are shaken along the faces and edges of the cube that they are on.
    noise = rng.uniform(-0.06, 0.06, size=mesh.vertices.shape) * corner * ~at_side
    mesh = mesh.with_vertices(mesh.vertices + noise)
    faired = fair_mesh(mesh, 30)
    assert faired.n_fixed == 8
    still = np.abs(np.abs(faired.mesh.vertices) - corner) < 1e-9
    assert np.array_equal(still, at_side)
    assert faired.centres_off < 1e-9 * corner
    assert faired.after.turning_deg < faired.before.turning_deg
    # Without sharp edges it would be rounded off: the angle decides.
    monkeypatch.setattr(feature_lines, "SHARP_DEG", 120.0)
    assert fair_mesh(mesh, 30).centres_off > 1e-3 * corner


# Symmetry.


@pytest.mark.parametrize(
    ("mesh", "iterations", "motions"),
    [
        # Rounding grows with every iteration, so few are made.
        (torus(12, 8, 35.0, 15.0), 3, Rotation.from_rotvec([[0, 0, np.pi / 6], [np.pi, 0, 0]])),
        (sphere(4, 50.0), 20, Rotation.from_rotvec(np.pi / 2 * np.eye(3))),
    ],
)
def test_symmetry_is_kept(mesh, iterations, motions) -> None:
    faired = fair_mesh(mesh, iterations).mesh.vertices
    for motion in (*motions.as_matrix(), np.diag([1.0, 1.0, -1.0])):
        away, _ = cKDTree(faired).query(faired @ motion.T)
        assert away.max() < 1e-8


def test_motions_and_scale_make_no_difference() -> None:
    mesh = shaken(tube(10, 6, 25.0, 80.0), 7)
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    once = fair_mesh(mesh, 8).mesh.vertices
    other = fair_mesh(mesh.with_vertices(3.0 * mesh.vertices @ turn.T + [70, -20, 5]), 8)
    assert np.abs(other.mesh.vertices - (3.0 * once @ turn.T + [70, -20, 5])).max() < 1e-6 * 240


def test_bodies_do_not_disturb_each_other() -> None:
    small, large = shaken(torus(9, 6, 3.0, 1.0), 1), shaken(sphere(4, 50.0), 2)
    large = large.with_vertices(large.vertices + np.array([200.0, 0.0, 0.0]))
    both = fair_mesh(merged(small, large), 12)
    cut = small.n_vertices
    for body, faired in ((small, both.mesh.vertices[:cut]), (large, both.mesh.vertices[cut:])):
        fairness = Fairness(body, build_halfedges(body))
        before, after = (fairness.turning_deg(x).mean() for x in (body.vertices, faired))
        assert after < before
        surface = Surface(*fans(body))
        assert surface.closest(faired)[2].max() < ON_SURFACE * size_of(body)


# The measure and its derivatives.


@pytest.mark.parametrize("seed", range(3))
def test_turning_in_the_plane_is_that_of_the_threads(seed) -> None:
    mesh = shaken_plane(6, 5, seed)
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    centres = face_centres(mesh)
    turns = []
    for t in range(threads.n_threads):
        ways = []
        for p in range(threads.offsets[t], threads.offsets[t + 1]):
            h = int(threads.halfedge[p])
            tail, head = mesh.vertices[halfedges.tail[h]], mesh.vertices[halfedges.head[h]]
            own, other = centres[halfedges.face[h]], centres[halfedges.face[halfedges.twin[h]]]
            # From the portal on this side, at the tail if it arrives forward, to the far one.
            start, end = (tail, head) if threads.forward[p] else (head, tail)
            ways.append((end + other - start - own)[:2] / 2)
        angle = [np.arctan2(way[1], way[0]) for way in ways]
        for k in range(1, len(ways) - 1):
            turn = angle[k + 1] - angle[k - 1]
            turns.append(abs((turn + np.pi) % (2 * np.pi) - np.pi))
    found = Fairness(mesh, halfedges).turning_deg(mesh.vertices)
    # Each crossing is measured as its two threads pass it, walked both ways.
    expected = np.sort(np.repeat(np.degrees(turns), 2))
    assert np.allclose(np.sort(found), expected, atol=1e-9)
    assert expected.max() > 5


def test_regular_squares_are_straight_until_one_is_bent() -> None:
    mesh = hypar(6, 6, 100.0, 0.0)
    fairness = Fairness(mesh, build_halfedges(mesh))
    assert fairness.turning_deg(mesh.vertices).max() < 1e-9
    bent = mesh.vertices + np.where(np.arange(49) == 24, 3.0, 0.0)[:, None] * [1, 0, 0]
    assert fairness.turning_deg(bent).max() > 5


def test_regular_triangles_are_straight() -> None:
    m, n = 6, 5
    i, j = np.meshgrid(np.arange(m + 1), np.arange(n + 1), indexing="ij")
    points = np.stack([i + j / 2, j * np.sqrt(0.75), 0 * i], axis=-1).reshape(-1, 3)
    at = (i * (n + 1) + j)[:-1, :-1].reshape(-1)
    right, up = n + 1, 1
    faces = np.concatenate(
        [
            np.stack([at, at + right, at + up], axis=1),
            np.stack([at + right, at + right + up, at + up], axis=1),
        ]
    )
    mesh = PolyMesh.from_faces(points, faces)
    fairness = Fairness(mesh, build_halfedges(mesh))
    assert fairness.turning_deg(points).max() < 1e-9
    assert np.allclose(fairness.widths(points), 1 / np.sqrt(3))


@pytest.mark.parametrize("name", ["torus", "hypar", "hemisphere"])
def test_derivatives_are_those_of_the_energy(name) -> None:
    mesh = IRREGULAR[name]()
    fairness = Fairness(mesh, build_halfedges(mesh))
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=(2, *mesh.vertices.shape))
    slope, step = fairness.at(mesh.vertices), 1e-5
    rise = fairness.at(mesh.vertices + step * one).energy
    rise -= fairness.at(mesh.vertices - step * one).energy
    assert rise / (2 * step) == pytest.approx(2 * np.sum(slope.gradient() * one), rel=1e-5)
    assert np.sum(slope.curvature(one) * other) == pytest.approx(
        np.sum(slope.curvature(other) * one), rel=1e-9, abs=1e-9
    )
    assert np.sum(slope.curvature(one) * one) > 0
    assert np.abs(slope.curvature(np.ones_like(one))).max() < 1e-9  # shifts change nothing


# Limits, and what is refused.


def test_what_cannot_be_faired_is_refused() -> None:
    with pytest.raises(InputError, match="-1 times"):
        fair_mesh(cube(), -1)
    assert np.array_equal(fair_mesh(cube(), 0).mesh.vertices, cube().vertices)
    flat = cube().with_vertices(cube().vertices * [1, 0, 0])
    with pytest.raises(InputError, match="triangles with an area"):
        fair_mesh(flat, 5)


def test_foreign_code_never_sees_a_broken_surface() -> None:
    points, triangles = fans(cube())
    with pytest.raises(ValueError, match="finite points"):
        Surface(np.where(points > 0.9, np.nan, points), triangles)
    with pytest.raises(ValueError, match="do not exist"):
        Surface(points, triangles + 20)
    with pytest.raises(ValueError, match="must be finite"):
        Surface(points, triangles).closest(np.full((1, 3), np.inf))


@pytest.mark.parametrize("factor", [1e-150, 1e150])
def test_closest_points_at_any_scale(factor) -> None:
    points, triangles = fans(cube())
    places = np.array([[0.2, 0.3, 5.0], [-7.0, 0.1, 0.2]])
    found, normals, away = Surface(points * factor, triangles).closest(places * factor)
    side = points.max()
    assert np.allclose(found / factor, [[0.2, 0.3, side], [-side, 0.1, 0.2]])
    assert np.allclose(away / factor, [5 - side, 7 - side])
    assert np.all(np.einsum("nd,nd->n", normals, places) > 0)


# Real meshes and whole jobs.


@pytest.mark.slow
def test_a_faired_job_is_made_and_proved_and_says_so(tmp_path) -> None:
    write_mesh(tmp_path / "ball.obj", shaken(sphere(2, 50.0), 3, 0.08))
    options = ("--size", "200mm", "--sheet", "600x400mm", "--effort", "quick", "--fair", "12")
    assert run("make", tmp_path / "ball.obj", *options, "-q", "-o", tmp_path / "out") == 0
    job = tomllib.loads((tmp_path / "out" / "job.toml").read_text(encoding="utf-8"))
    assert job["job"]["fair"] == 12
    assert any(note.startswith("fairing: in 12 iterations") for note in job["outcome"]["notes"])
    assert run("verify", tmp_path / "out", "-q") == 0


def test_fairing_comes_before_the_triaxial_subdivision_and_the_final_size(tmp_path) -> None:
    write_mesh(tmp_path / "ball.obj", shaken(sphere(3, 50.0), 3, 0.08))
    plain = Settings.of(str(tmp_path / "ball.obj"), size_mm=300.0, fair=10)
    woven = load_asked(plain)
    triaxial = load_asked(plain.but(pattern="triaxial"))
    assert size_of(woven.mesh) == pytest.approx(300.0, rel=1e-12)
    old = triaxial.mesh.vertices[: triaxial.n_old_vertices]
    assert np.array_equal(old, woven.mesh.vertices)
    assert any(note.startswith("the mesh was faired:") for note in woven.notes)
