"""A mesh as programs write it is cleaned: what it was meant to be comes out, and is told."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from meshes_shared import shared_mesh
from scipy.spatial import KDTree
from strategies import any_meshes, closed_surfaces, merged, open_surfaces

from fabweave.mesh.check import check_mesh
from fabweave.mesh.clean import clean_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes import grids, solids


def with_faces(mesh: PolyMesh, faces: list[list[int]], points: object = ()) -> PolyMesh:
    """Return a mesh with other faces, and more vertices."""
    more = np.asarray(points, dtype=float).reshape(-1, 3)
    return PolyMesh.from_faces(np.concatenate([mesh.vertices, more]), faces)


def apart(mesh: PolyMesh) -> PolyMesh:
    """Give each corner a vertex of its own."""
    return PolyMesh(mesh.vertices[mesh.indices], mesh.offsets, np.arange(mesh.n_corners))


def seen(mesh: PolyMesh, of: PolyMesh) -> list[list[int]]:
    """Return the faces, their corners named by the vertices of another mesh at their places."""
    away, number = KDTree(of.vertices).query(mesh.vertices)
    assert away.max() < 1e-5 * np.ptp(of.vertices, axis=0).max()
    rings = [number[face].tolist() for face in mesh.faces()]
    return sorted(ring[(k := ring.index(min(ring))) :] + ring[:k] for ring in rings)


@given(closed_surfaces(), st.integers(0, 2**32 - 1))
def test_what_exports_spoil_is_mended(surface, seed):
    mesh, genus = surface
    mesh = clean_mesh(mesh).mesh
    dice = np.random.default_rng(seed)
    faces = mesh.faces()
    one = int(dice.integers(len(faces)))
    spoilt = with_faces(mesh, [*faces[:one], [*faces[one], faces[one][0]], *faces[one + 1 :]])
    doubled = with_faces(mesh, [*faces, faces[one]])
    twice = merged(mesh, mesh)
    two_gon = with_faces(mesh, [*faces, faces[one][:2]])
    unused = with_faces(mesh, faces, [[np.nan, np.inf, 0.0]])
    size = np.ptp(mesh.vertices, axis=0).max()
    crumb = with_faces(
        mesh,
        [*faces, [mesh.n_vertices + k for k in range(3)]],
        size * (0.05 + 1e-3 * np.eye(3)),
    )
    loose = apart(mesh)
    shaken = loose.with_vertices(
        loose.vertices + 1e-6 * size * dice.uniform(-1, 1, (loose.n_vertices, 3))
    )
    for bad in (spoilt, doubled, twice, two_gon, unused, crumb, loose, shaken):
        cleaned = clean_mesh(bad)
        assert seen(cleaned.mesh, mesh) == seen(mesh, mesh)
        assert check_mesh(cleaned.mesh).component_genus == (genus,)
        assert cleaned.notes
    assert clean_mesh(mesh).notes == ()


@given(st.one_of(closed_surfaces(), open_surfaces()), st.integers(0, 2**32 - 1))
def test_what_is_far_away_is_the_same_mesh(surface, seed):
    # Six decimals, as programs write them; beyond them nothing is left at such a distance.
    mesh = surface[0].with_vertices(np.round(surface[0].vertices, 6))
    away = np.round(np.random.default_rng(seed).uniform(-1e7, 1e7, 3), 3)
    assume(np.abs(away).max() > 1e5)
    here, there = (clean_mesh(mesh.with_vertices(mesh.vertices + by)) for by in (0.0, away))
    assert there.mesh.faces() == here.mesh.faces()
    assert np.abs(there.mesh.vertices - here.mesh.vertices).max() < 1e-7
    assert np.allclose(there.mesh.vertices + there.origin, mesh.vertices + away, atol=1e-8)
    assert there.notes


def box(x: float, y: float) -> PolyMesh:
    """Return a cube of side 2 about a place."""
    cube = solids.cube()
    return cube.with_vertices(cube.vertices * 2.0 / np.ptp(cube.vertices) + [x, y, 0.0])


def joined(*meshes: PolyMesh) -> PolyMesh:
    """Return meshes as one, vertices at one place being one."""
    both = merged(*meshes)
    places, number = np.unique(np.round(both.vertices, 9), axis=0, return_inverse=True)
    return PolyMesh(places, both.offsets, number.reshape(-1)[both.indices])


def test_faces_are_parted_at_edges_of_more_than_two():
    # Two cubes that touch along an edge are two cubes.
    report = check_mesh(clean_mesh(joined(box(0, 0), box(2, 2))).mesh)
    assert (report.component_genus, report.closed, report.manifold) == ((0, 0), True, True)
    # Those that share faces are one block, without walls inside; but a leaf of two sides is a leaf.
    four = joined(box(0, 0), box(2, 2), box(2, 0), box(0, 2))
    report = check_mesh(clean_mesh(four).mesh)
    assert (report.n_faces, report.component_genus, report.closed) == (16, (0,), True)
    leaf = grids.hypar(3, 3, 30.0, 10.0)
    two_sided = with_faces(leaf, [*leaf.faces(), *(face[::-1] for face in leaf.faces())])
    assert clean_mesh(two_sided).mesh.faces() == leaf.faces()
    # A box with a wall inside, of one side, is the box and a wall; one with a fin, the box and it.
    shell = joined(box(0, 0), box(2, 0))
    places = [sorted(face) for face in shell.faces()]
    inner = [n for n, face in enumerate(places) if places.count(face) == 2]
    wall = with_faces(shell, [f for n, f in enumerate(shell.faces()) if n != inner[0]])
    report = check_mesh(clean_mesh(wall).mesh)
    assert (report.n_components, report.n_boundary_loops, report.manifold) == (2, 1, True)
    cube = box(0, 0)
    a, b = cube.faces()[0][:2]
    fin = with_faces(cube, [*cube.faces(), [b, a, 8]], [[9.0, 9.0, 9.0]])
    report = check_mesh(clean_mesh(fin).mesh)
    assert (report.n_components, report.n_boundary_loops, report.manifold) == (2, 1, True)


def test_quads_that_end_at_a_pole_with_two_corners_are_triangles_there():
    m, n = 8, 5
    turn, rise = np.meshgrid(
        np.linspace(0.0, 2.0 * np.pi, m + 1), np.linspace(0.0, np.pi, n + 1), indexing="ij"
    )
    places = np.stack(
        [np.sin(rise) * np.cos(turn), np.sin(rise) * np.sin(turn), np.cos(rise)], axis=-1
    )
    places[:, [0, -1], :2] = 0.0
    places[-1] = places[0]
    corner = np.arange((m + 1) * (n + 1)).reshape(m + 1, n + 1)
    faces = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1)
    report = check_mesh(
        clean_mesh(PolyMesh.from_faces(places.reshape(-1, 3), faces.reshape(-1, 4))).mesh
    )
    assert (report.closed, report.component_genus) == (True, (0,))
    assert report.face_sizes == ((3, 2 * m), (4, m * (n - 2)))


@given(any_meshes())
def test_any_mesh_is_cleaned_or_left_to_the_check(mesh):
    first = clean_mesh(mesh)
    again = clean_mesh(first.mesh)
    assert first.mesh.n_faces <= mesh.n_faces or first.notes
    assert again.mesh.n_faces <= first.mesh.n_faces


#: Files, with vertices and faces that are right, the genus of their bodies, and pairs of faces that
#: run through one another.
STRANGERS = {
    "dup_body.obj": (8, 6, (0,)),
    "far_utm.obj": (52, 60, (0,)),
    "keyhole.obj": (16, 24, (1,)),
    "nested.obj": (16, 12, (0, 0)),
    "obj_2gon.obj": (8, 6, (0,)),
    "obj_dupface.obj": (8, 6, (0,)),
    "obj_far.obj": (8, 6, (0,)),
    "obj_nan_unused.obj": (8, 6, (0,)),
    "obj_rgb.obj": (8, 6, (0,)),
    "obj_repeat_closed.obj": (8, 6, (0,)),
    "obj_tri_as_quad.obj": (8, 12, (0,)),
    "ply_nan_unused.ply": (8, 6, (0,)),
    "sliver_closed.obj": (10, 7, (0,)),
    "star_prism.obj": (20, 12, (0,)),
    "stl_jitter.stl": (8, 12, (0,)),
    "t_junction.obj": (10, 7, (0,)),
    "two_high.obj": (16, 12, (0, 0)),
    "unwelded_jitter.obj": (8, 6, (0,)),
}


@pytest.mark.parametrize("name", STRANGERS)
def test_files_of_strangers_are_what_they_were_meant_to_be(name):
    mesh, report, _ = prepare_mesh(
        clean_mesh(read_mesh(shared_mesh(f"strangers/{name}")).mesh).mesh
    )
    assert (report.n_vertices, report.n_faces, report.component_genus) == STRANGERS[name]
    assert report.closed
    assert len(self_intersections(mesh)) == 0


@pytest.mark.parametrize("share", [1e-4, 3e-4])
def test_the_distance_that_is_proposed_closes_the_mesh(share):
    mesh = grids.torus(8, 6, 3.0, 1.0)
    loose = apart(mesh)
    dice = np.random.default_rng(5)
    shaken = loose.with_vertices(
        loose.vertices + share * dice.uniform(-1, 1, (len(loose.vertices), 3))
    )
    told = clean_mesh(shaken, size_mm=200.0).notes
    assert not check_mesh(clean_mesh(shaken).mesh).closed
    length = next(
        word for note in told for word in note.split() if word.endswith("mm") and word != "mm"
    )
    assert check_mesh(clean_mesh(shaken, length, size_mm=200.0).mesh).component_genus == (1,)
