"""Long edges are split without changing the surface; short ones vanish, and the kind stays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.mesh.check import check_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.remeshed import edge_lengths
from fabweave.mesh.remesh.triangles import collapse_short, split_long
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.triangulate import surface_area as area
from fabweave.mesh.triangulate import triangulate


def kind(mesh):
    report = check_mesh(mesh)
    assert not report.fatal
    return report.kind


SURFACES = {
    "ball": triangulate(grids.sphere(6, 50.0)),
    "ring": triangulate(grids.torus(20, 12, 35.0, 15.0)),
    "saddle": triangulate(grids.hypar(5, 4, 40.0, 9.0)),
    "solid": solids.icosahedron(),
}


@given(st.sampled_from(sorted(SURFACES)), st.integers(1, 900))
def test_splitting_gives_the_number_and_keeps_the_surface(name, wanted):
    mesh = SURFACES[name]
    split = split_long(mesh, wanted)
    assert max(wanted, mesh.n_faces) <= split.n_faces <= max(wanted + 1, mesh.n_faces)
    assert kind(split) == kind(mesh)
    assert area(split) == pytest.approx(area(mesh), rel=1e-12)
    assert edge_lengths(split).max() <= edge_lengths(mesh).max() * (1 + 1e-12)
    np.testing.assert_array_equal(split.vertices[: mesh.n_vertices], mesh.vertices)


def with_slivers(mesh, count, seed):
    """Split edges very near to one end: as many short edges, and slivers on the same surface."""
    split = split_long(mesh, mesh.n_faces + 2 * count)
    vertices, new = split.vertices.copy(), np.arange(mesh.n_vertices, split.n_vertices)
    faces = split.indices.reshape(-1, 3)
    for vertex in np.random.default_rng(seed).permutation(new)[:count].tolist():
        beside = np.unique(faces[np.any(faces == vertex, axis=1)])
        sums = split.vertices[beside][:, None] + split.vertices[beside][None]
        ends = np.argwhere(np.all(sums == 2 * split.vertices[vertex], axis=2))
        apart = ends[ends[:, 0] != ends[:, 1]]
        if len(apart):
            end = beside[apart[0, 0]]
            vertices[vertex] += 0.98 * (split.vertices[end] - vertices[vertex])
    return split.with_vertices(vertices)


@pytest.mark.parametrize("name", ["ball", "ring", "saddle"])
@pytest.mark.parametrize("seed", range(3))
def test_short_edges_vanish_and_the_kind_of_surface_stays(name, seed):
    model = SURFACES[name]
    uneven = with_slivers(model, 20, seed)
    least = 0.2 * float(np.median(edge_lengths(model)))
    assert np.count_nonzero(edge_lengths(uneven) < least) >= 20
    even = collapse_short(model_of(model, uneven.n_vertices), uneven, least)
    assert edge_lengths(even).min() >= least
    assert kind(even) == kind(model)
    assert not len(self_intersections(even))
    assert area(even) == pytest.approx(area(model), rel=0.03)


def test_corners_and_edges_of_a_solid_stay_where_they_are():
    cube = split_long(triangulate(solids.cube()), 300)
    model = model_of(triangulate(solids.cube()), cube.n_vertices)
    fewer = collapse_short(model, cube, 1.5 * float(np.median(edge_lengths(cube))))
    assert fewer.n_faces < cube.n_faces
    corners = solids.cube().vertices
    gap = np.linalg.norm(fewer.vertices[:, None] - corners[None], axis=2).min(axis=0)
    assert gap.max() == 0.0
    assert area(fewer) == pytest.approx(area(cube), rel=1e-12)
