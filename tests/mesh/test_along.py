"""Quads along a direction: angles that are known, grooves along it, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fabweave.core.arrays import unit
from fabweave.core.errors import InputError
from fabweave.mesh import load as mesh_source
from fabweave.mesh.check import check_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.along import Groove, fine_enough, groove_spacing, grooved
from fabweave.mesh.remesh.direction import (
    Direction,
    axis_direction,
    curvature_direction,
    mean_turn_deg,
    read_directions,
)
from fabweave.mesh.remesh.engines import ENGINES
from fabweave.mesh.remesh.fit import fit, model_of
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.triangulate import surface_area, triangulate
from fabweave.options.settings import Settings
from fabweave.plan.ask import load_asked

needs_quadriflow = pytest.mark.skipif(
    not ENGINES[0].installed, reason="pyQuadriFlow is not installed (extra [quad])"
)


def slab(turn_deg: float, side: int = 8) -> PolyMesh:
    """Return a flat grid of unit squares, turned in its plane."""
    flat = grids.hypar(side, side, float(side), 0.0)
    turn = Rotation.from_rotvec([0, 0, math.radians(turn_deg)])
    return flat.with_vertices(turn.apply(flat.vertices + side * np.array([0.5, 0.5, 0])))


@given(st.floats(-400, 400))
def test_a_turned_grid_turns_by_what_it_is_turned_by_modulo_a_right_angle(turn_deg) -> None:
    off = abs((turn_deg + 45.0) % 90.0 - 45.0)
    assert mean_turn_deg(slab(turn_deg), axis_direction("x")) == pytest.approx(off, abs=1e-6)
    strands = replace(axis_direction("x"), diagonal=True)
    assert mean_turn_deg(slab(turn_deg), strands) == pytest.approx(45.0 - off, abs=1e-6)
    # A vector, its opposite and what is at right angles mean the same; upright means nothing.
    assert mean_turn_deg(slab(turn_deg), axis_direction("y")) == pytest.approx(off, abs=1e-6)
    assert mean_turn_deg(slab(turn_deg), axis_direction("z")) == 0.0


def test_tori_run_along_their_axis_and_along_their_curvature() -> None:
    torus = grids.torus(48, 24, 35.0, 15.0)
    # Meridians lie in planes through the axis, parallels across it.
    assert mean_turn_deg(torus, axis_direction("z")) < 1.0
    assert mean_turn_deg(torus, axis_direction("x")) > 15.0
    bends = curvature_direction(triangulate(torus))
    assert mean_turn_deg(torus, bends) < 3.0
    # A sphere bends alike in all directions, so these matter little.
    ball = triangulate(grids.sphere(12, 50.0))
    assert np.linalg.norm(curvature_direction(ball).vectors, axis=1).mean() < 0.1
    assert np.linalg.norm(bends.vectors, axis=1).mean() > 0.2


def test_the_nearest_of_listed_places_counts() -> None:
    text = "# place, vector\n-9,4,0, 1,0,0\n\n17 4 0  3 3 0 # slanted\n"
    listed = read_directions(text, "own.txt")
    at = np.array([[-5.0, 0.0, 0.0], [20.0, 0.0, 3.0]])
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    half = math.sqrt(0.5)
    np.testing.assert_allclose(listed.on(at, up), [[1, 0, 0], [half, half, 0]])
    # Projected onto a plane it is shorter.
    np.testing.assert_allclose(listed.on(at[1:], np.array([[0.0, 1.0, 0.0]])), [[half, 0, 0]])


@pytest.mark.parametrize(
    "text", ["# nothing\n\n", "1 2 3 4 5", "0 0 0 1 0 x", "0 0 0 1 0 inf", "0 0 0 0 0 0"]
)
def test_lists_that_are_none_are_refused_in_words(text) -> None:
    with pytest.raises(InputError):
        read_directions(text, "own.txt")


def test_fitting_turns_edges_of_a_sphere_towards_an_axis() -> None:
    ball = grids.sphere(24, 50.0)
    model = model_of(ball, 98)
    slanted = Direction("slanted", np.zeros((1, 3)), unit(np.array([[1.0, 2.0, 3.0]])))
    plain = fit(model, grids.sphere(4, 50.0), 6)
    turned = fit(model, plain, 6, along=slanted)
    assert mean_turn_deg(turned, slanted) < mean_turn_deg(plain, slanted) - 2.0
    assert np.array_equal(turned.indices, plain.indices)
    radius = np.linalg.norm(turned.vertices, axis=1)
    assert np.all((radius > 45.0) & (radius < 55.0))


@given(st.integers(4, 60))
def test_cutting_long_edges_keeps_the_surface_and_ends_with_short_ones(parts) -> None:
    solid = solids.icosahedron()
    spacing = float(np.ptp(solid.vertices)) / parts * 6
    fine = fine_enough(solid, spacing)
    assert not check_mesh(fine).fatal
    assert (check_mesh(fine).closed, check_mesh(fine).euler) == (True, 2)
    assert surface_area(fine) == pytest.approx(surface_area(solid), rel=1e-12)
    corner = fine.vertices[fine.indices.reshape(-1, 3)]
    longest = np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2).max()
    assert longest <= spacing / 4.5
    # Faces look the way they did.
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    assert np.all(np.einsum("nd,nd->n", normal, corner.mean(axis=1)) > 0)


def test_grooves_run_along_the_direction_and_leave_the_rim() -> None:
    sheet = triangulate(slab(0.0))
    spacing = groove_spacing(sheet, 64)
    assert spacing == pytest.approx(0.5)
    fine = fine_enough(sheet, spacing)
    for axis, across in (("x", 1), ("y", 0)):
        rough = grooved(fine, axis_direction(axis), Groove(0.8, 1.0), spacing)
        height = rough.vertices[:, 2]
        np.testing.assert_array_equal(rough.vertices[:, :2], fine.vertices[:, :2])
        rim = np.any((fine.vertices[:, :2] < 1e-9) | (fine.vertices[:, :2] > 8 - 1e-9), axis=1)
        assert not height[rim].any()
        assert 0.02 < height.std() < 0.8 * spacing / (2 * math.pi)
        # Slopes across are far steeper than slopes along.
        corner = rough.vertices[rough.indices.reshape(-1, 3)]
        normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
        slope = np.sqrt(np.mean(normal[:, :2] ** 2, axis=0))
        assert slope[across] > 3 * slope[1 - across]


def test_only_new_quads_run_along_a_direction() -> None:
    for remesh in (None, "triangles:300", "coarse"):
        with pytest.raises(InputError, match="--remesh"):
            Settings.of("shape:cube", remesh=remesh, along="x")
    with pytest.raises(InputError, match="no such file"):
        load_asked(Settings.of("shape:cube", remesh="quads:50", along="no such file"))


def test_listed_directions_are_those_of_the_given_mesh(tmp_path) -> None:
    # Places are in the unit of the file, and turn with the mesh.
    path = tmp_path / "own.txt"
    path.write_text("1 2 3  0 2 0\n")
    listed = mesh_source._wished(str(path), "y", 10.0)
    assert isinstance(listed, Direction)
    np.testing.assert_allclose(listed.points, [[10, -30, 20]])
    np.testing.assert_allclose(listed.vectors, [[0, 0, 1]])
    assert listed.title == "own.txt"


@pytest.mark.slow
@needs_quadriflow
def test_a_sphere_is_laid_along_an_axis() -> None:
    ball = triangulate(grids.sphere(16, 50.0))
    along = remesh_quads(ball, 150, along=axis_direction("x"), engines=ENGINES[:1])
    assert along.alignment is not None
    # Strands run along the diagonals of quads.
    angle = mean_turn_deg(along.mesh, replace(axis_direction("x"), diagonal=True))
    assert angle == pytest.approx(45.0 - mean_turn_deg(along.mesh, axis_direction("x")))
    assert along.alignment.mean_deg == pytest.approx(angle)
    assert angle < 15.0
    assert angle < along.alignment.plain_deg - 5.0

    assert check_mesh(along.mesh).euler == 2
