"""Where threads turn back, ribbons lead round boundary edges: flat, inside, as wide as before."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from unfolding import plain_ribbons
from weaving_meshes import meshes

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes import grids
from fabweave.mesh.upright import resize_mesh
from fabweave.ribbon.project import RUNGS_A_TURN, Ribbons, require_no_loop, turn_rungs
from fabweave.ribbon.width import WidthRule
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads, trace_threads


def woven(mesh: PolyMesh, *, turn: bool = True, **options: float) -> tuple[Weave, Ribbons]:
    return plain_ribbons(mesh, turn=turn, **options)


def rungs_of_turns(threads: Threads, ribbons: Ribbons) -> np.ndarray:
    """Return the rungs of each turn, (B, 3), by counting along every thread."""
    rungs, place = [], {}
    for before in threads.turn_pass.tolist():
        first = int(ribbons.entry[before]) + 2 + RUNGS_A_TURN * place.setdefault(before, 0)
        place[before] += 1
        rungs.append(range(first, first + RUNGS_A_TURN))
    return np.array(rungs, dtype=np.int64).reshape(-1, RUNGS_A_TURN)


def distance_to_line(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    way = (end - start) / np.linalg.norm(end - start, axis=-1, keepdims=True)
    return np.linalg.norm(np.cross(points - start, way), axis=-1)


@given(meshes(), st.booleans())
def test_a_ribbon_has_two_rungs_a_pass_three_a_turn_and_one_an_end(mesh, turn):
    weave, ribbons = woven(resize_mesh(mesh, size_mm=500.0)[0], turn=turn)
    threads = weave.threads
    turns = np.bincount(threads.thread_of_pass[threads.turn_pass], minlength=threads.n_threads)
    ends = np.where(threads.closed | ~threads.woven, 0, 2)
    assert np.array_equal(
        np.diff(ribbons.offsets), 2 * threads.lengths + RUNGS_A_TURN * turns + ends
    )
    if not turn:
        return
    # No rung serves twice.
    used = [ribbons.entry, ribbons.entry + 1, rungs_of_turns(threads, ribbons).ravel()]
    assert np.array_equal(np.sort(np.concatenate(used)), np.arange(ribbons.n_rungs))


@given(meshes(), st.floats(0.1, 0.9), st.floats(0.0, 0.09))
def test_turns_lie_in_their_triangles_and_look_outward(mesh, width, more):
    mesh, _ = resize_mesh(mesh, size_mm=500.0)
    weave, ribbons = woven(mesh, width=width, length=width + more)
    threads, halfedges = weave.threads, build_halfedges(mesh)
    rungs, edge = rungs_of_turns(threads, ribbons), threads.turn_halfedge
    if len(edge) == 0:
        return
    tail, head = mesh.vertices[halfedges.tail[edge]], mesh.vertices[halfedges.head[edge]]
    centre = face_centres(mesh)[halfedges.face[edge]]
    frame = np.stack((tail - centre, head - centre, np.cross(tail - centre, head - centre)), axis=2)
    for rail in (ribbons.right, ribbons.left):
        near, far, off = np.moveaxis(
            np.linalg.solve(frame, rail[rungs].swapaxes(1, 2) - centre[:, :, None]), 1, 0
        )
        assert min(near.min(), far.min()) > 0
        assert np.max(near + far) < 1
        assert np.abs(off).max() < 1e-12
    # Forward along its half-edge the right rail is the outer one; either way, outside is outside.
    outer = np.where(threads.turn_forward[:, None, None], ribbons.right[rungs], ribbons.left[rungs])
    inner = np.where(threads.turn_forward[:, None, None], ribbons.left[rungs], ribbons.right[rungs])
    reach = [distance_to_line(rail, tail[:, None], head[:, None]) for rail in (outer, inner)]
    assert np.all(reach[0] < reach[1])
    along = ribbons.right[rungs[:, -1]] - ribbons.right[rungs[:, 0]]
    across = ribbons.left[rungs[:, 1]] - ribbons.right[rungs[:, 1]]
    assert np.all(np.einsum("bd,bd->b", np.cross(along, across), frame[:, :, 2]) > 0)
    # Both rails run along the edge.
    for distance in reach:
        assert np.allclose(distance, distance[:, :1])


@pytest.mark.parametrize(
    ("width", "wide"), [(0.2, 0.2 / 2**0.5), (0.4, 0.4 / 2**0.5), (0.65, 0.390625), (0.8, 0.4375)]
)
def test_a_flat_square_mat_turns_as_wide_as_it_comes_if_there_is_room(width, wide):
    # On unit squares the ribbon is width / sqrt(2) wide and a triangle 1 / 2 high. The panel keeps
    # (1 - width) / 2 of that from the centre, and a quarter as much from the edge.
    mesh = grids.hypar(4, 4, 4.0, 0.0)
    weave, ribbons = woven(mesh, width=width, length=0.85)
    rungs = rungs_of_turns(weave.threads, ribbons)
    across = np.linalg.norm(ribbons.left[rungs[:, 1]] - ribbons.right[rungs[:, 1]], axis=1)
    assert np.allclose(across, wide, rtol=1e-9)


def test_on_a_flat_mat_nothing_overlaps_but_at_crossings():
    # Turns and connectors take nothing from one another, nor from crossings that are not theirs.
    for width, length in ((0.65, 0.7), (0.8, 0.8), (0.3, 0.9)):
        weave, ribbons = woven(grids.hypar(5, 4, 5.0, 0.0), width=width, length=length)
        (start,) = set(ribbons.offsets[:-1].tolist())  # one thread, as 5 and 4 have no divisor
        following = np.roll(np.arange(start, ribbons.n_rungs), -1)
        corners = (ribbons.right, ribbons.right[following], ribbons.left[following], ribbons.left)
        quads = shapely.polygons(np.stack(corners, axis=1)[:, :, :2])
        assert np.all(shapely.is_valid(quads))
        crossing = np.zeros(len(quads), dtype=bool)
        crossing[ribbons.entry] = True
        one, two = shapely.STRtree(quads).query(quads, predicate="intersects")
        other = (one < two) & ~(crossing[one] & crossing[two])
        shared = shapely.area(shapely.intersection(quads[one[other]], quads[two[other]]))
        assert shared.max() < 1e-12
        square = shapely.box(-2.5, -2.5, 2.5, 2.5)
        assert np.all(shapely.contains(square, quads))
        assert len(weave.threads.turn_pass) == 18


def test_a_face_whose_centre_lies_on_its_boundary_edge_is_refused():
    points = [[-1, 0, 0], [1, 0, 0], [3, 2, 0], [0, -2, 0], [4, -2, 0]]
    mesh = PolyMesh.from_faces(points, [[0, 1, 2, 3], [3, 2, 4]])
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges, turn=True)
    with pytest.raises(InputError, match=r"1 turn has no room .*between vertices 0-1"):
        turn_rungs(
            mesh, halfedges, threads, length=0.7, width=WidthRule(0.65), narrowing=np.ones(99)
        )


def test_a_face_that_hangs_by_one_edge_is_refused_by_name():
    for m, n, faces in ((2, 1, "0, 1"), (1, 4, "0, 3")):
        halfedges = build_halfedges(grids.hypar(m, n, 1.0, 0.0))
        with pytest.raises(CannotMakeError, match=rf"2 faces hang .*\(faces {faces}\)"):
            require_no_loop(trace_threads(halfedges, turn=True), halfedges)
    for turn in (False, True):
        halfedges = build_halfedges(grids.tube(3, 1, 1.0, 1.0))
        require_no_loop(trace_threads(halfedges, turn=turn), halfedges)
