"""Handles: what they do to the topology, the way they run, and what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.handles import _frames, add_handles, parse_handles
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.threads import trace_threads


def nearest(mesh: PolyMesh, *direction: float) -> int:
    return int(np.argmax(face_centres(mesh) @ np.array(direction)))


@given(st.data())
def test_each_handle_lowers_the_euler_characteristic_by_two(data) -> None:
    mesh = data.draw(
        st.sampled_from(
            [grids.sphere(3, 50.0), grids.torus(8, 5, 35.0, 15.0), solids.icosahedron(),
             solids.dodecahedron(), grids.hypar(5, 5, 20.0, 60.0)]
        )
    )  # fmt: skip
    faces = mesh.faces()
    one, two = data.draw(
        st.tuples(*[st.integers(0, mesh.n_faces - 1)] * 2).filter(
            lambda pair: not set(faces[pair[0]]) & set(faces[pair[1]])
        )
    )
    joined, _ = add_handles(mesh, ((one, two),))
    before, after = check_mesh(mesh), check_mesh(joined)
    assert not after.fatal
    assert after.euler == before.euler - 2
    assert after.genus == before.genus + 1
    assert after.n_boundary_loops == before.n_boundary_loops
    assert after.n_components == 1
    # What stays comes first, as it was; the rest are quads.
    kept = [face for at, face in enumerate(faces) if at not in (one, two)]
    assert joined.faces()[: len(kept)] == kept
    assert np.all(joined.face_sizes[len(kept) :] == 4)
    threads = trace_threads(build_halfedges(joined))
    assert threads.lengths.sum() == 2 * threads.n_crossings


def test_a_mug_and_a_bead() -> None:
    ball = grids.sphere(6, 50.0)
    mug = (nearest(ball, 1, 0.05, 0.7), nearest(ball, 1, 0.05, -0.7))
    bead = (nearest(ball, 0.05, 0.05, 1), nearest(ball, 0.05, 0.05, -1))
    joined, (note,) = add_handles(ball, (mug,))
    assert f"faces {mug[0]} and {mug[1]} were joined by a handle of" in note
    assert not len(self_intersections(joined))
    new = joined.vertices[ball.n_vertices :]
    assert np.all(np.linalg.norm(new, axis=1) > 49.0)
    assert new[:, 0].max() > 75.0
    drilled, (note,) = add_handles(ball, (bead,))
    assert "by a tunnel of" in note
    assert not len(self_intersections(drilled))
    assert np.all(np.linalg.norm(drilled.vertices[ball.n_vertices :], axis=1) < 50.0)
    # A sphere with a tunnel has the genus of a torus; with a handle, too, of a double torus.
    both, _ = add_handles(ball, (mug, bead))
    assert check_mesh(both).genus == 2


def test_a_straight_tube_between_plates_is_a_straight_prism() -> None:
    # Two squares that look at one another, each a plate of its own.
    low = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    high = [[0, 0, 4], [0, 1, 4], [1, 1, 4], [1, 0, 4]]
    plates = PolyMesh.from_faces(low + high, [[0, 1, 2, 3], [4, 5, 6, 7]])
    tube, _ = add_handles(plates, ((0, 1),))
    assert (tube.n_faces, tube.n_vertices) == (16, 20)
    assert set(map(tuple, np.unique(np.round(tube.vertices[:, :2], 9), axis=0))) == {
        (0, 0), (0, 1), (1, 0), (1, 1)
    }  # fmt: skip
    assert np.unique(np.round(tube.vertices[:, 2] * 64)).size == 5
    report = check_mesh(tube)
    assert (report.euler, report.n_boundary_loops, report.n_components) == (0, 2, 1)


def test_frames_follow_a_curve_without_twist() -> None:
    angle = np.linspace(0.0, 3.0, 40)
    along = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    frames = _frames(along)
    np.testing.assert_allclose(frames[:, 2], along, atol=1e-12)
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (40, 1, 1)), atol=1e-12
    )
    # In a plane curve the axis across the plane stays.
    np.testing.assert_allclose(frames[:, :2, 2], np.tile(frames[0, :2, 2], (40, 1)), atol=1e-12)


@pytest.mark.parametrize(
    ("mesh", "pair"), [("sphere", (0, 96)), ("sphere", (0, 1)), ("mixed", (0, 1))]
)
def test_handles_that_cannot_be_are_refused_in_words(mesh, pair) -> None:
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [1, 1, 5], [0, 1, 5]]
    mixed = PolyMesh.from_faces(points, [[0, 1, 2], [3, 4, 5, 6]])
    with pytest.raises(InputError):
        add_handles(grids.sphere(4, 50.0) if mesh == "sphere" else mixed, (pair,))


@pytest.mark.parametrize("text", ["", "3", "3:", "a:4", "1:2:3", "1:2,", "-1:2", "1.5:2"])
def test_what_names_no_two_faces_is_refused(text) -> None:
    with pytest.raises(InputError, match="names no two faces"):
        parse_handles(text)


def test_a_face_holds_one_end_only() -> None:
    with pytest.raises(InputError, match="face 2 is named twice"):
        parse_handles("1:2,2:3")
