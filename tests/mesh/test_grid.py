"""Grids: rows and columns over a disc, a tube or a torus, without any irregular vertex."""

import numpy as np
import pytest
from meshes_shared import FOLDER
from scipy.spatial.transform import Rotation

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.automorphisms import find_symmetry
from fabweave.mesh.check import check_mesh
from fabweave.mesh.fair.fairing import fair_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.mirror import find_mirror
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.chart import harmonic, loops_of, sheet_of, torus_chart
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.grid import lacks_grid, mirrored, remesh_grid
from fabweave.mesh.remesh.remeshed import edge_lengths
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import grid_quads, hypar, torus
from fabweave.mesh.triangulate import triangulate


def revolved(radii, heights, sides):
    """Return a tube of triangles whose profile turns about the z axis."""
    angle = 2 * np.pi * np.arange(sides) / sides
    round_ = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rings = [r * round_ + [0, 0, z] for r, z in zip(radii, heights, strict=True)]
    quads = grid_quads(len(rings), sides, wrap=(False, True))
    quads = quads[: (len(rings) - 1) * sides, ::-1]  # seen from outside
    return triangulate(PolyMesh.from_faces(np.concatenate(rings), quads))


def columns_of(mesh):
    """Return how many columns a tube's grid has; vertices are sorted by row."""
    return len(loops_of(mesh, build_halfedges(mesh))[0].sides)


def off_the_rims(given, mesh):
    """Return how far boundary vertices of a mesh are off the boundary of another, at most."""
    edges = [loop.points for loop in loops_of(given, build_halfedges(given))]
    sides = [np.stack([points, np.roll(points, -1, axis=0)], axis=1) for points in edges]
    start, end = np.moveaxis(np.concatenate(sides), 1, 0)
    rim = np.concatenate([loop.points for loop in loops_of(mesh, build_halfedges(mesh))])
    way, to = end - start, rim[:, None] - start
    share = np.clip(np.einsum("ned,ed->ne", to, way) / np.sum(way**2, axis=1), 0, 1)
    return np.linalg.norm(to - share[..., None] * way, axis=2).min(axis=1).max()


def test_a_cylinder_of_long_thin_triangles_gets_even_strips():
    pipe = revolved([60.0, 60.0], [0.0, 200.0], 126)
    laid = remesh_grid(pipe, 100)
    assert laid.mesh.n_faces in range(90, 111)
    assert len(laid.irregular) == 0
    assert off_the_rims(pipe, laid.mesh) < 0.08  # the chords of 126 sides
    faired = fair_mesh(laid.mesh, model_of(pipe, laid.mesh.n_vertices))
    assert faired.after.room_ratio == pytest.approx(1.0, abs=0.08)
    for mesh in (laid.mesh, faired.mesh):
        radii = np.hypot(*mesh.vertices[:, :2].T).reshape(-1, columns_of(mesh))
        assert np.ptp(radii, axis=1).max() < 1e-6


@pytest.mark.parametrize(
    ("radii", "heights"),
    [
        ([100.0, 50.0], [0.0, 150.0]),
        (60 + 25 * np.sin(np.linspace(0, 6, 31)), np.linspace(0, 200, 31)),
    ],
    ids=["cone", "vase"],
)
def test_columns_of_what_is_round_are_congruent_and_rows_equally_wide(radii, heights):
    shape = revolved(radii, heights, 48)
    mesh = remesh_grid(shape, 160).mesh
    columns = columns_of(mesh)
    points = mesh.vertices.reshape(-1, columns, 3)
    assert find_symmetry(mesh, build_halfedges(mesh), tolerance=1e-9).n_rotations >= columns
    height = np.linalg.norm(np.diff(points, axis=0), axis=2)
    assert height == pytest.approx(height.mean(), rel=1e-3)
    assert mesh.n_faces == pytest.approx(160, rel=0.15)


def test_a_turned_copy_gets_the_turned_grid():
    shape = revolved([60.0, 90.0, 50.0], [0.0, 80.0, 160.0], 16)
    motion, way = Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix(), [5.0, -8.0, 3.0]
    turned = shape.with_vertices(shape.vertices @ motion + way)
    one, other = remesh_grid(shape, 120).mesh, remesh_grid(turned, 120).mesh
    assert other.faces() == one.faces()
    assert np.abs(one.vertices @ motion + way - other.vertices).max() < 1e-6


def test_corners_of_rims_stay():
    tower = revolved([100.0, 60.0], [0.0, 150.0], 6)
    mesh = remesh_grid(tower, 150).mesh
    away = np.linalg.norm(tower.vertices[:, None] - mesh.vertices, axis=2).min(axis=1)
    assert away.max() < 1e-6
    assert off_the_rims(tower, mesh) < 1e-5


@pytest.mark.parametrize("name", ["hypar", "hemisphere", "sail"])
def test_a_disc_has_four_corners(name):
    surface = {
        "hypar": hypar(6, 5, 100.0, 40.0),
        "hemisphere": parse_shape("shape:hemisphere?n=4"),
        "sail": hypar(4, 4, 100.0, 60.0),
    }[name]
    if name == "sail":  # a corner is cut off, so that the rim has five
        surface = PolyMesh.from_faces(surface.vertices, surface.faces()[1:])
    laid = remesh_grid(surface, 140)
    mesh = laid.mesh
    assert len(laid.irregular) == 0
    half = build_halfedges(mesh)
    faces_at = np.bincount(half.tail, minlength=mesh.n_vertices)
    assert np.count_nonzero(faces_at == 1) == 4
    assert check_mesh(mesh).n_boundary_loops == 1
    assert off_the_rims(surface, mesh) < 1e-6
    if name == "hypar":
        away = np.linalg.norm(
            surface.vertices[[0, 5, 36, 41]][:, None] - mesh.vertices, axis=2
        ).min(axis=1)
        assert away.max() < 1e-6


def test_what_is_its_own_image_gets_a_grid_that_is():
    path = FOLDER / "open" / "hypar.obj"
    if not path.exists():
        pytest.skip("the shared meshes are not beside the repository")
    mesh = remesh_grid(read_mesh(path).mesh, 100).mesh
    across = mesh.vertices[:, [1, 0, 2]]  # x and y exchange
    away = np.linalg.norm(across[:, None] - mesh.vertices, axis=2).min(axis=1)
    assert away.max() < 1e-6


def test_noise_does_not_spoil_the_mirror():
    sail = hypar(6, 6, 100.0, 40.0)
    mirror = find_mirror(sail)
    noise = np.random.default_rng(4).normal(size=sail.vertices.shape)
    rough, rougher = (sail.with_vertices(sail.vertices + much * noise) for much in (1.0, 6.0))
    made = mirrored(rough, mirror)
    assert find_symmetry(rough, build_halfedges(rough)).order == 1
    assert find_symmetry(made, build_halfedges(made)).n_reflections == 1
    assert mirrored(rougher, mirror) is None


def test_a_torus_is_cut_along_its_two_short_ways():
    ring = torus(30, 14, 35.0, 15.0)
    laid = remesh_grid(triangulate(ring), 240)
    report = check_mesh(laid.mesh)
    assert (report.genus, report.closed, len(laid.irregular)) == (1, True, 0)
    assert edge_lengths(laid.mesh).max() < 3.0 * edge_lengths(laid.mesh).min()
    assert not torus_chart(sheet_of(triangulate(ring))).folded


def test_harmonic_functions_are_linear_where_that_is_flat():
    flat = triangulate(hypar(7, 4, 10.0, 0.0))
    x = flat.vertices[:, 0]
    ends = np.flatnonzero(np.isclose(x, x.min()) | np.isclose(x, x.max()))
    sheet = sheet_of(flat)
    found = harmonic(sheet, ends, x[ends], np.zeros(sheet.halfedges.n_edges))
    assert found == pytest.approx(x, abs=1e-12)


@pytest.mark.parametrize(
    ("shape", "has"),
    [("shape:sphere", "closed"), ("shape:slit?genus=2", "2 handles")],
)
def test_what_has_no_grid_is_refused(shape, has):
    with pytest.raises(CannotMakeError, match=has):
        remesh_grid(parse_shape(shape), 100)


def test_trousers_have_no_grid():
    cloth = hypar(6, 3, 60.0, 10.0)
    faces = cloth.faces()
    holes = PolyMesh.from_faces(
        cloth.vertices, [f for k, f in enumerate(faces) if k not in (4, 13)]
    )
    assert check_mesh(holes).n_boundary_loops == 3
    assert "3 openings" in lacks_grid(holes)
    with pytest.raises(CannotMakeError):
        remesh_grid(holes, 60)


def test_a_long_tongue_has_no_good_grid():
    tongue = revolved([400.0, 8.0, 6.0], [0.0, 10.0, 300.0], 24)
    with pytest.raises(CannotMakeError):
        remesh_grid(tongue, 100)


def test_a_tall_thin_pipe_with_corners_gets_few_columns():
    laid = remesh_grid(revolved([2.0, 2.0], [0.0, 150.0], 4), 210)
    assert laid.mesh.n_faces == pytest.approx(210, rel=0.1)
    assert columns_of(laid.mesh) == 4
