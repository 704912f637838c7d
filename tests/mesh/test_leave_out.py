"""Openings: what they do to the topology, where their rims lie, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.leave_out import leave_out, parse_leave_out, read_leave_out, rim_on_circle
from fabweave.mesh.polymesh import PolyMesh, face_normals
from fabweave.mesh.shapes import grids, solids
from fabweave.options.settings import Settings
from fabweave.weave.threads import trace_threads


def opened(mesh: PolyMesh, text: str):
    return leave_out(mesh, parse_leave_out(text))


def boundary(mesh: PolyMesh) -> np.ndarray:
    halfedges = build_halfedges(mesh)
    return np.unique(halfedges.tail[halfedges.twin < 0])


@given(
    n=st.integers(2, 9),
    diameter=st.floats(20.0, 150.0),
    sides=st.sampled_from([("top",), ("bottom",), ("top", "bottom")]),
)
def test_each_disc_lowers_the_euler_characteristic_by_one_and_has_one_rim(n, diameter, sides):
    ball = grids.sphere(n, 100.0)
    try:
        holed, openings = opened(ball, ",".join(f"{side}:{diameter}mm" for side in sides))
    except InputError as error:
        assert "nothing would be left out" in str(error)  # noqa: PT017 - a face is larger
        return
    report = check_mesh(holed)
    assert report.euler == 2 - len(sides)
    assert report.n_boundary_loops == len(sides)
    assert (report.n_components, report.findings) == (1, ())
    assert holed.n_faces == ball.n_faces - sum(one.faces for one in openings)
    rim = holed.vertices[boundary(holed)]
    far = np.abs(np.linalg.norm(rim[:, :2], axis=1) - diameter / 2.0)
    assert far.max() == pytest.approx(max(one.off_mm for one in openings), abs=1e-9)
    assert np.count_nonzero(far > 1e-6) == sum(one.off for one in openings)
    # What is not on the rim is where it was; faces look outwards still.
    assert np.all(np.einsum("fd,fd->f", face_normals(holed), holed.vertices[first(holed)]) > 0)
    threads = trace_threads(build_halfedges(holed), turn=True)
    assert threads.closed.all()


def first(mesh: PolyMesh) -> np.ndarray:
    return mesh.indices[mesh.offsets[:-1]]


def test_a_grid_is_opened_where_it_is_highest():
    # A tent: one face of a plane, 10 mm squares, has its middle at the top.
    flat = grids.hypar(7, 7, 70.0, 0.0)
    tent = flat.with_vertices(flat.vertices - [0, 0, 0.01] * (flat.vertices**2).sum(1)[:, None])
    holed, (hole,) = opened(tent, "top:21mm")
    # The face at the top and its four neighbours, 10 mm away.
    assert (hole.faces, hole.x_mm, hole.y_mm, hole.rim) == (5, 0.0, 0.0, 12)
    assert check_mesh(holed).euler == check_mesh(tent).euler - 1
    # Only what hangs together is left out: not the far side of a closed mesh.
    ball, (south,) = opened(grids.sphere(4, 100.0), "bottom:60mm")
    assert south.faces == 4
    assert ball.vertices[:, 2].max() == pytest.approx(100.0)


def test_faces_by_number_leave_the_others_in_their_order():
    cube = solids.cube()
    holed, (hole,) = opened(cube, "4,1")
    faces = [cube.vertices[face].tolist() for n, face in enumerate(cube.faces()) if n not in (1, 4)]
    assert [holed.vertices[face].tolist() for face in holed.faces()] == faces
    assert (hole.side, hole.faces, hole.diameter_mm) == ("faces", 2, None)
    assert check_mesh(holed).euler == 0 if check_mesh(holed).n_boundary_loops == 2 else 1


def test_a_corner_that_would_be_flat_goes_less_far():
    # On the left of a square lies the middle of the circle; its corners would come onto a line.
    square = PolyMesh.from_faces([[2, 0, 0], [4, 2, 0], [2, 4, 0], [0, 2, 0]], [[0, 1, 2, 3]])
    ground = PolyMesh.from_faces([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], [[0, 1, 2, 3]])
    moved = rim_on_circle(ground, square, np.array([3]), np.array([-4.0, 2.0]), 6.0)
    # It should go 2 mm, to the diagonal from (2, 0) to (2, 4); an eighth less leaves it 14° flat.
    assert moved[3].tolist() == [1.75, 2.0, 0.0]
    assert np.array_equal(moved[:3], square.vertices[:3])
    # Where the surface does not reach, nothing moves.
    far = rim_on_circle(ground, square, np.array([3]), np.array([-40.0, 2.0]), 6.0)
    assert np.array_equal(far, square.vertices)


@pytest.mark.parametrize(
    ("mesh", "text"),
    [
        (grids.sphere(8, 100.0), "top:9mm"),
        (solids.cube(), "0,1,2,3,4,5"),
        (solids.cube(), "6"),
        (grids.torus(8, 5, 35.0, 15.0), "top:60mm"),
        (solids.cube(), "0,top:9m"),
    ],
)
def test_what_cannot_be_left_out_is_refused(mesh, text):
    with pytest.raises(InputError):
        opened(mesh, text)


def test_what_falls_apart_or_touches_at_a_corner_is_refused():
    ball = grids.sphere(3, 50.0)
    equator = np.flatnonzero(np.abs(ball.vertices[ball.indices, 2].reshape(-1, 4)).max(1) < 30.0)
    # Two faces that share one corner only.
    faces = ball.faces()
    other = next(n for n in range(1, 54) if len(set(faces[0]) & set(faces[n])) == 1)
    with pytest.raises(InputError, match="touch itself at a mere corner"):
        opened(ball, f"0,{other}")
    with pytest.raises(InputError, match="fall apart into 2 bodies"):
        opened(ball, ",".join(map(str, equator)))


def test_a_file_lists_faces(tmp_path):
    path = tmp_path / "faces.txt"
    path.write_text("7, 3 # the mouth\n\n12\n7\n")
    assert read_leave_out(str(path)) == "3,7,12"
    assert read_leave_out("bottom:1in, 4") == "bottom:25.4mm,4"
    path.write_text("3\nmany\n")
    for name, words in ((str(path), "line 2 of faces.txt has 'many'"), ("mouth.txt", "mouth.txt")):
        with pytest.raises(InputError, match=words):
            read_leave_out(name)


@pytest.mark.parametrize("size_mm", [30.0, 100.0, 400.0, 3000.0])
def test_a_ring_on_a_closed_mesh_is_refused_with_an_opening_in_proportion(size_mm):
    with pytest.raises(InputError, match=r"^rim: ") as caught:
        _ = Stations(Settings.of("shape:sphere?n=4", size_mm=size_mm, rim="ring")).loaded
    said = str(caught.value).rpartition(" ")[2]
    ((_, wide_mm),) = parse_leave_out(said).diameters_mm
    assert 0.3 * size_mm <= wide_mm <= 0.5 * size_mm
    asked = Settings.of("shape:sphere?n=4", size_mm=size_mm, rim="ring", leave_out=said)
    assert Stations(asked).loaded.rim == "ring"
