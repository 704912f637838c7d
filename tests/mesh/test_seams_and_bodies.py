"""Split vertices are welded where a file splits them; debris is told, and left out on demand."""

import numpy as np
import pytest
from mesh_writers import off_bytes, ply_bytes
from meshes_shared import shared_mesh
from strategies import merged

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.mesh.bodies import KeptBodies, keep_bodies, parse_bodies
from fabweave.mesh.check import check_mesh
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.weld import weld_seams
from fabweave.options.settings import Settings


def split_all(mesh: PolyMesh) -> PolyMesh:
    """Give each corner a vertex of its own."""
    return PolyMesh(mesh.vertices[mesh.indices], mesh.offsets, np.arange(mesh.n_corners))


def split_along(mesh: PolyMesh, where: np.ndarray) -> PolyMesh:
    """Give the chosen faces vertices of their own, which makes a seam around them."""
    chosen = np.repeat(where, mesh.face_sizes)
    used, place = np.unique(mesh.indices[chosen], return_inverse=True)
    indices = mesh.indices.copy()
    indices[chosen] = mesh.n_vertices + place
    return PolyMesh(np.concatenate((mesh.vertices, mesh.vertices[used])), mesh.offsets, indices)


@pytest.mark.parametrize("mesh", [grids.torus(8, 6, 3.0, 1.0), solids.dodecahedron()])
def test_loose_faces_become_the_surface_that_they_were(mesh) -> None:
    welded, notes = weld_seams(split_all(mesh), None)
    assert check_mesh(welded).component_genus == check_mesh(mesh).component_genus
    assert (welded.n_vertices, welded.n_faces) == (mesh.n_vertices, mesh.n_faces)
    # Each corner of the welded faces is where it was.
    assert np.array_equal(welded.vertices[welded.indices], mesh.vertices[mesh.indices])
    assert str(mesh.n_corners - mesh.n_vertices) in notes[0]


def test_a_seam_is_welded_and_places_that_differ_by_rounding_too() -> None:
    mesh = grids.torus(8, 6, 3.0, 1.0)
    seam = split_along(mesh, np.arange(mesh.n_faces) % 6 < 2)
    assert not check_mesh(seam).closed
    moved = seam.with_vertices(seam.vertices + 1e-10 * (np.arange(seam.n_vertices)[:, None] % 2))
    for one in (seam, moved):
        assert check_mesh(weld_seams(one, None)[0]).component_genus == (1,)
    assert weld_seams(seam, "none") == (seam, ())


def test_closed_bodies_and_boundaries_that_touch_at_few_vertices_stay_apart() -> None:
    cube = solids.cube()
    aside = cube.with_vertices(cube.vertices + np.ptp(cube.vertices, axis=0))
    touching = merged(cube, aside)
    assert weld_seams(touching, None) == (touching, ())
    assert weld_seams(touching, "all")[0].n_vertices == touching.n_vertices - 1
    # Two sheets that meet at a corner: 2 of their vertices coincide.
    sheet = grids.hypar(3, 3, 30.0, 0.0)
    width = np.ptp(sheet.vertices, axis=0)
    sheets = merged(sheet, sheet.with_vertices(sheet.vertices + width))
    assert weld_seams(sheets, None) == (sheets, ())
    assert weld_seams(sheets, "all")[0].n_vertices == sheets.n_vertices - 1


def test_a_surface_that_was_cut_open_because_it_is_one_sided_stays_so() -> None:
    open_bottle = read_mesh(shared_mesh("bad/klein-bottle.obj")).mesh
    assert weld_seams(open_bottle, None) == (open_bottle, ())
    assert not check_mesh(weld_seams(open_bottle, "all")[0]).orientable


def test_bodies_are_kept_by_size_and_debris_is_told() -> None:
    large, small = grids.torus(8, 6, 30.0, 10.0), solids.cube()
    tiny = small.with_vertices(small.vertices / np.ptp(small.vertices) + 100.0)
    specks = [tiny.with_vertices(tiny.vertices + 5.0 * number) for number in range(3)]
    other = large.with_vertices(large.vertices * 0.5 + [200.0, 0, 0])
    mesh = merged(*specks[:2], large, other, specks[2])
    same, (note,), _ = keep_bodies(mesh, None)
    assert same is mesh
    assert "--bodies 2" in note
    assert keep_bodies(merged(large, other), None).notes == ()
    kept, _, left_out = keep_bodies(mesh, 1)
    assert np.array_equal(kept.vertices, large.vertices)
    assert kept.faces() == large.faces()
    assert left_out == 0.2
    assert check_mesh(keep_bodies(mesh, 2).mesh).component_genus == (1, 1)
    assert keep_bodies(mesh, 5) == KeptBodies(mesh)


@pytest.mark.parametrize("text", ["none", "0", "-1", "1.5", "", "9" * 40])
def test_other_numbers_of_bodies_are_refused(text) -> None:
    with pytest.raises(InputError, match="all, largest, join, wrap, or a whole number"):
        parse_bodies(text)


@pytest.mark.parametrize(
    ("extension", "written"), [("obj", obj_bytes), ("ply", ply_bytes), ("off", off_bytes)]
)
def test_files_are_welded_by_themselves_or_as_asked(extension, written, tmp_path) -> None:
    path = tmp_path / f"ring.{extension}"
    path.write_bytes(written(split_all(grids.torus(8, 6, 3.0, 1.0))))
    loaded = Stations(Settings.of(str(path), size_mm=100.0)).loaded
    assert loaded.halfedges.n_edges == 2 * 48
    assert any("144 vertices were at the same place" in note for note in loaded.notes)
    assert (
        Stations(Settings.of(str(path), size_mm=100.0, weld="none")).loaded.halfedges.n_edges
        == 4 * 48
    )
