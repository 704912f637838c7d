"""Split vertices are welded where a file splits them; debris is told, and left out on demand."""

import numpy as np
import pytest
from irregular_meshes import together
from jobs import run
from meshes_shared import shared_mesh

from fabweave.app.mesh_source import load_mesh
from fabweave.app.settings import Settings, settings_from_options
from fabweave.core.errors import InputError
from fabweave.mesh.bodies import KeptBodies, keep_bodies, parse_bodies
from fabweave.mesh.check import check_mesh
from fabweave.mesh.io.files import read_mesh, write_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.weld import weld_seams


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
    assert notes[0].startswith(f"{mesh.n_corners - mesh.n_vertices} vertices were at the same")
    assert "--no-weld" in notes[0]


def test_a_seam_is_welded_and_places_that_differ_by_rounding_too() -> None:
    mesh = grids.torus(8, 6, 3.0, 1.0)
    seam = split_along(mesh, np.arange(mesh.n_faces) % 6 < 2)
    assert not check_mesh(seam).closed
    moved = seam.with_vertices(seam.vertices + 1e-10 * (np.arange(seam.n_vertices)[:, None] % 2))
    for one in (seam, moved):
        assert check_mesh(weld_seams(one, None)[0]).component_genus == (1,)
    assert weld_seams(seam, False) == (seam, ())


def test_closed_bodies_and_boundaries_that_touch_at_few_vertices_stay_apart() -> None:
    cube = solids.cube()
    aside = cube.with_vertices(cube.vertices + np.ptp(cube.vertices, axis=0))
    touching = together(cube, aside)
    assert weld_seams(touching, None) == (touching, ())
    welded, notes = weld_seams(touching, True)
    assert welded.n_vertices == touching.n_vertices - 1
    assert notes == ("1 vertex was at the same place as another and merged with it",)
    # Two sheets that meet at a corner: 2 of their vertices coincide.
    sheet = grids.hypar(3, 3, 30.0, 0.0)
    width = np.ptp(sheet.vertices, axis=0)
    sheets = together(sheet, sheet.with_vertices(sheet.vertices + width))
    assert weld_seams(sheets, None) == (sheets, ())
    assert weld_seams(sheets, True)[0].n_vertices == sheets.n_vertices - 1


def test_a_surface_that_was_cut_open_because_it_is_one_sided_stays_so() -> None:
    open_bottle = read_mesh(shared_mesh("bad/klein-bottle.obj")).mesh
    assert weld_seams(open_bottle, None) == (open_bottle, ())
    assert not check_mesh(weld_seams(open_bottle, True)[0]).orientable


def test_what_the_check_refuses_is_left_to_it() -> None:
    wrong = PolyMesh.from_faces([[0, 0, 0]], [[0, 1, 2]])
    assert weld_seams(wrong, True) == (wrong, ())
    assert keep_bodies(wrong, 1) == KeptBodies(wrong)


def test_bodies_are_kept_by_size_and_debris_is_told() -> None:
    large, small = grids.torus(8, 6, 30.0, 10.0), solids.cube()
    tiny = small.with_vertices(small.vertices / np.ptp(small.vertices) + 100.0)
    specks = [tiny.with_vertices(tiny.vertices + 5.0 * number) for number in range(3)]
    other = large.with_vertices(large.vertices * 0.5 + [200.0, 0, 0])
    mesh = together(*specks[:2], large, other, specks[2])
    same, notes, _ = keep_bodies(mesh, None)
    assert same is mesh
    assert notes == (
        "3 of the 5 bodies are smaller than a twentieth of the largest, and may be debris; "
        "--bodies 2 keeps only the large ones",
    )
    assert keep_bodies(together(large, other), None).notes == ()
    kept, notes, left_out = keep_bodies(mesh, 1)
    assert np.array_equal(kept.vertices, large.vertices)
    assert kept.faces() == large.faces()
    assert notes == (
        "4 of 5 bodies were left out, with 66 faces and 20% of the surface (--bodies)",
    )
    assert left_out == 0.2
    assert check_mesh(keep_bodies(mesh, 2).mesh).component_genus == (1, 1)
    assert keep_bodies(mesh, 5) == KeptBodies(mesh)


@pytest.mark.parametrize("text", ["none", "0", "-1", "1.5", "", "9" * 40])
def test_other_numbers_of_bodies_are_refused(text) -> None:
    with pytest.raises(InputError, match="all, largest, join, wrap, or a whole number"):
        parse_bodies(text)


@pytest.mark.parametrize("extension", ["obj", "ply", "off"])
def test_files_are_welded_by_themselves_or_as_asked(extension, tmp_path) -> None:
    path = tmp_path / f"ring.{extension}"
    write_mesh(path, split_all(grids.torus(8, 6, 3.0, 1.0)))
    loaded = load_mesh(Settings(str(path), size_mm=100.0))
    assert loaded.halfedges.n_edges == 2 * 48
    assert any("144 vertices were at the same place" in note for note in loaded.notes)
    assert load_mesh(Settings(str(path), size_mm=100.0, weld=False)).halfedges.n_edges == 4 * 48


@pytest.mark.slow
def test_the_command_line_and_job_toml_hold_both_answers(tmp_path, capsys) -> None:
    path = tmp_path / "ring.obj"
    write_mesh(path, split_all(grids.torus(8, 6, 3.0, 1.0)))
    assert run("inspect", path, "--size", "200mm", "--no-weld") == 1
    assert "no threads cross" in capsys.readouterr().err
    (tmp_path / "job.toml").write_text(f'[job]\nmesh = "{path}"\nsize = "200mm"\nweld = false\n')
    assert run("inspect", "--config", tmp_path / "job.toml") == 1
    assert run("inspect", "--config", tmp_path / "job.toml", "--weld", "--bodies", "largest") == 0
    assert "144 vertices were at the same place" in " ".join(capsys.readouterr().out.split())
    assert settings_from_options("a.obj", bodies=3).bodies == "3"


def test_a_refused_mesh_says_that_it_was_welded_before(tmp_path) -> None:
    fin = PolyMesh.from_faces(
        [[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]],
        [[0, 1, 2], [0, 1, 3], [0, 1, 4]],
    )
    write_mesh(tmp_path / "fin.obj", split_all(fin))
    with pytest.raises(InputError, match="1 edge has more than two faces") as error:
        load_mesh(Settings(str(tmp_path / "fin.obj")))
    assert "(before that check: 4 vertices were at the same place" in str(error.value)
