"""Fairing: strands straighten and even out near the model, and the energy falls."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow import slow_but
from strategies import merged
from weaving_meshes import meshes

from fabweave.mesh.check import check_mesh
from fabweave.mesh.fair.energy import Energy, Wish
from fabweave.mesh.fair.fairing import Guard, fair_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.likeness import likeness
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.shapes.grids import hemisphere, hypar, sphere, torus, tube
from fabweave.mesh.shapes.solids import cube
from fabweave.mesh.subdivide import split_to_quads
from fabweave.mesh.triangulate import fans, triangulate
from fabweave.ribbon.measures import ribbon_widths
from fabweave.ribbon.project import project_ribbons
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads


def shaken(mesh, seed, share=0.12):
    """Move every vertex by a share of an edge or so, anywhere."""
    edge = np.linalg.norm(mesh.vertices[mesh.indices[1]] - mesh.vertices[mesh.indices[0]])
    noise = np.random.default_rng(seed).normal(size=mesh.vertices.shape)
    return mesh.with_vertices(mesh.vertices + share * edge * noise)


def faired(mesh, model, steps=12, **options):
    return fair_mesh(mesh, model_of(model, mesh.n_vertices), steps, **options)


BALL, ROUND = sphere(5, 50.0), sphere(24, 50.0)
TUBE, PIPE = tube(16, 12, 25.0, 100.0), tube(48, 20, 25.0, 100.0)
RING, FINE_RING = torus(16, 8, 35.0, 15.0), torus(48, 24, 35.0, 15.0)
#: A coarse mesh off its model, and the model.
ROUGH = {
    "sphere": lambda: (shaken(BALL, 1, 0.1), ROUND),
    "tube": lambda: (shaken(TUBE, 3), PIPE),
    "torus": lambda: (shaken(RING, 0), FINE_RING),
    "hypar": lambda: (shaken(hypar(8, 8, 100.0, 20.0), 2), hypar(20, 20, 100.0, 20.0)),
    "hemisphere": lambda: (shaken(hemisphere(4, 50.0), 4), hemisphere(16, 50.0)),
    "triangles": lambda: (shaken(triangulate(torus(18, 12, 35.0, 15.0)), 5), FINE_RING),
}
rough = pytest.mark.parametrize("name", slow_but(ROUGH))


# Known answers.


@rough
def test_strands_straighten_near_the_model_while_the_energy_falls(name) -> None:
    mesh, model = ROUGH[name]()
    result = faired(mesh, model)
    assert np.all(np.diff(result.energies) < 0)
    assert result.after.turn_deg < 0.8 * result.before.turn_deg
    assert result.after.room_ratio < result.before.room_ratio
    before, after = likeness(model, mesh), likeness(model, result.mesh)
    assert after.in_mean_mm < before.in_mean_mm
    assert after.out_mean_mm < before.out_mean_mm


@pytest.mark.slow
def test_a_sphere_comes_to_one_energy_from_clean_and_noisy_starts() -> None:
    clean, noisy = faired(BALL, ROUND, 20), faired(*ROUGH["sphere"](), 20)
    assert clean.before.turn_deg > 12
    assert clean.after.turn_deg < 6.5
    # Energies count in mean edges and rooms of their own start, which differ a little.
    energy = Energy(BALL, model_of(ROUND, BALL.n_vertices))
    ends = [energy.at(one.mesh.vertices).value for one in (clean, noisy)]
    assert ends[1] == pytest.approx(ends[0], rel=0.01)


def test_corners_with_three_edges_do_not_stand_out_like_warts() -> None:
    ball = faired(shaken(BALL, 1, 0.1), ROUND).mesh
    inside, valence = interior_valences(build_halfedges(ball))
    off = np.linalg.norm(ball.vertices, axis=1) - 50.0
    edge = np.median(
        np.linalg.norm(ball.vertices[ball.indices[1::4]] - ball.vertices[ball.indices[::4]], axis=1)
    )
    # Without being held closely they come to stand out by a third.
    assert np.abs(off[inside[valence == 3]]).max() < 0.25 * edge


def test_ribbons_keep_their_width_over_a_sharp_edge() -> None:
    # Over the rim of a lens the quad of a crossing is folded, and flattened it has little room.
    flat = np.array([[0.96, 0.0, 0.006], [0.0, 1.0, 0.0], [-0.3, 0.0, 0.02]])
    lens = [one.with_vertices(one.vertices @ flat) for one in (sphere(4, 50.0), ROUND)]

    def least(mesh):
        halfedges = build_halfedges(mesh)
        weave = plain_weave(trace_threads(halfedges))
        ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.0)
        return ribbon_widths(ribbons)[np.add.outer([0, 1], ribbons.entry)].min()

    assert least(faired(*lens).mesh) > 1.5 * least(lens[0])


# The energy and its measures.


@pytest.mark.parametrize("name", ["torus", "hypar", "triangles"])
def test_derivatives_are_those_of_the_energy(name) -> None:
    mesh, model = ROUGH[name]()
    # All terms count: nothing is wide enough, or bends or twists little enough.
    wish = Wish(least_mm=9.0, most_mm=9.5, radius_mm=50.0, twist_deg=3.0)
    energy = Energy(mesh, model_of(model, mesh.n_vertices), wish)
    way = np.random.default_rng(0).normal(size=mesh.vertices.shape)
    state, step = energy.at(mesh.vertices), 1e-6
    rise = energy.at(mesh.vertices + step * way).value
    rise -= energy.at(mesh.vertices - step * way).value
    slope = 2 * state.gradient @ way.T.reshape(-1)
    assert rise / (2 * step) == pytest.approx(slope, rel=1e-7)
    # The curvature is symmetric, and no motion makes the square of anything negative.
    assert np.abs(state.curvature - state.curvature.T).max() < 1e-9 * state.curvature.max()
    assert way.T.reshape(-1) @ (state.curvature @ way.T.reshape(-1)) > 0


@pytest.mark.parametrize("seed", range(3))
def test_turns_in_the_plane_are_those_of_the_threads(seed) -> None:
    flat = hypar(6, 5, 100.0, 0.0)
    inner = ~np.any(np.isclose(np.abs(flat.vertices[:, :2]), np.abs(flat.vertices).max()), axis=1)
    noise = np.random.default_rng(seed).uniform(-5, 5, size=flat.vertices.shape)
    mesh = flat.with_vertices(flat.vertices + noise * inner[:, None] * [1, 1, 0])
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
    found = Energy(mesh, model_of(flat, 42)).turns_deg(mesh.vertices)
    # Each crossing is measured as its two threads pass it, walked both ways.
    expected = np.sort(np.repeat(np.degrees(turns), 2))
    assert np.allclose(np.sort(found), expected, atol=1e-6)
    assert expected.max() > 5


@pytest.mark.parametrize("course", ["auto", "projection"])
def test_regular_triangles_are_straight_and_even(course) -> None:
    m, n = 6, 5
    i, j = np.meshgrid(np.arange(m + 1), np.arange(n + 1), indexing="ij")
    points = np.stack([i + j / 2, j * np.sqrt(0.75), 0 * i], axis=-1).reshape(-1, 3)
    at = (i * (n + 1) + j)[:-1, :-1].reshape(-1)
    right, up = n + 1, 1
    triangles = [[at, at + right, at + up], [at + right, at + right + up, at + up]]
    faces = np.concatenate([np.stack(corners, axis=1) for corners in triangles])
    mesh = PolyMesh.from_faces(points, faces)
    energy = Energy(mesh, model_of(mesh, mesh.n_vertices), course=course)
    assert energy.turns_deg(points).max() < 1e-6
    assert np.ptp(energy.rooms(points)) < 1e-9


# What is kept.


@pytest.mark.slow
@settings(max_examples=8)
@given(mesh=meshes(), seed=st.integers(0, 2**32 - 1))
def test_any_mesh_keeps_what_it_is(mesh, seed) -> None:
    rough_one = shaken(mesh, seed, 0.08)
    result = faired(rough_one, mesh, 4)
    assert np.array_equal(result.mesh.indices, mesh.indices)
    assert np.array_equal(result.mesh.offsets, mesh.offsets)
    assert np.all(np.diff(result.energies) < 0)
    before, after = check_mesh(rough_one), check_mesh(result.mesh)
    assert after.fatal == ()
    assert (after.euler, after.component_genus) == (before.euler, before.component_genus)


def test_the_guard_objects_to_faces_turned_over_or_through_one_another() -> None:
    low, high = hypar(6, 6, 100.0, 0.0), hypar(6, 6, 100.0, 0.0)
    sheets = merged(low, high.with_vertices(high.vertices + np.array([0.0, 0.0, 2.0])))
    guard = Guard(sheets)
    assert not guard.spoilt(sheets.vertices).any()
    inner = 24  # the middle of the lower sheet
    for move, touched in (([0, 0, 5], True), ([0, 0, -5], False), ([20, 0, 0], True)):
        moved = sheets.vertices.copy()
        moved[inner] += move
        assert guard.spoilt(moved)[inner] == touched
    # What was so from the start may stay.
    moved = sheets.vertices.copy()
    moved[inner] += [0, 0, 5]
    assert not Guard(sheets.with_vertices(moved)).spoilt(moved).any()


@pytest.mark.slow
def test_boundaries_and_sharp_lines_stay_lines() -> None:
    mesh, model = ROUGH["hypar"]()
    rim = model_of(model, mesh.n_vertices).rim
    half = build_halfedges(mesh)
    on = half.tail[half.twin < 0]
    before, after = (
        np.linalg.norm(rim.nearest(points) - points, axis=1).mean()
        for points in (mesh.vertices[on], faired(mesh, model).mesh.vertices[on])
    )
    assert after < 0.1 * before
    box = cube()
    for _ in range(3):
        box = split_to_quads(box)
    corner = np.abs(box.vertices).max()
    at_side = np.isclose(np.abs(box.vertices), corner).sum(axis=1)
    noise = np.random.default_rng(0).uniform(-0.06, 0.06, size=box.vertices.shape) * corner
    moved = faired(box.with_vertices(box.vertices + noise * (at_side == 1)[:, None]), box)
    lines = np.sort(np.abs(moved.mesh.vertices[at_side > 1]), axis=1)
    assert np.abs(lines[:, 1:] - corner).max() < 0.03 * corner
    assert Surface(*fans(box)).feet(moved.mesh.vertices).distances.max() < 0.03 * corner


# Limits, and what is refused.


# Whole jobs.
