"""A solid that is a thin wall is woven once, as its outer side; what is no wall stays as it is."""

import numpy as np
import pytest
from meshes_shared import shared_mesh
from strategies import merged, with_flips
from walled_meshes import opened_box, revolved

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.given import give_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.rim_cut import boundary_walks, part_along_rim
from fabweave.mesh.seen import fill_cracks
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.mesh.topology import keep_faces
from fabweave.mesh.triangulate import surface_area
from fabweave.mesh.walls import find_wall, outer_walls
from fabweave.options.settings import Settings


def sides(thick, rim=0, base=2.0):
    """Return the profiles of a vase's outer side, and of all of it, with a rounded rim or none."""
    height = np.linspace(0.0, 100.0, 21)
    outer = [(30.0 + 10.0 * np.sin(z / 20.0), z) for z in height]
    radius = outer[-1][0] - 0.5 * thick
    arc = np.pi * np.arange(1, rim) / rim if rim else []
    top = [(radius + 0.5 * thick * np.cos(a), 100.0 + 0.5 * thick * np.sin(a)) for a in arc]
    inner = [(r - thick, z) for r, z in outer[::-1] if z > base]
    bottom = [(30.0 + 10.0 * np.sin(base / 20.0) - thick, base), (0.0, base)]
    return [(0.0, 0.0), *outer], [(0.0, 0.0), *outer, *top, *inner, *bottom]


def none(mesh):
    return np.zeros(mesh.n_faces, dtype=bool)


@pytest.mark.parametrize(("thick", "rim"), [(1.5, 0), (2.5, 8)])
def test_a_vase_is_its_outer_side_up_to_its_rim(thick, rim):
    outer, whole = sides(thick, rim)
    walled = outer_walls(revolved(whole), none(revolved(whole)))
    assert 0.7 * thick < walled.thickness < 1.1 * thick  # it leans
    mesh, report, _ = prepare_mesh(walled.mesh)
    assert (report.n_boundary_loops, report.euler) == (1, 1)
    # At a round rim the cut may be anywhere on it.
    more = 2.0 * np.pi * outer[-1][0] * 0.5 * np.pi * thick * (rim > 0)
    least = surface_area(revolved(outer))
    assert least * (1 - 1e-9) <= surface_area(mesh) <= least * (1 + 1e-9) + more
    (loop,) = boundary_walks(mesh)
    assert np.ptp(mesh.vertices[loop][:, 2]) < 1e-9


def test_a_lampshade_has_two_rims_and_a_box_without_a_lid_one():
    shade = revolved([(50, 0), (30, 90), (28.4, 90), (48.4, 0), (50, 0)])
    found = outer_walls(shade, none(shade)).mesh
    assert check_mesh(found).n_boundary_loops == 2
    assert surface_area(found) == pytest.approx(surface_area(revolved([(50, 0), (30, 90)])))
    box = opened_box(2.0)
    found = outer_walls(box, none(box)).mesh
    assert surface_area(found) == pytest.approx(80 * 60 + 2 * 50 * (80 + 60))


def test_of_a_plate_the_upper_side_is_woven_and_of_a_cap_the_one_outside():
    plate = revolved([(0, 0), (60, 0), (60, 2), (0, 2)][::-1])
    plate = with_flips(plate, [True] * plate.n_faces)
    found = outer_walls(plate, none(plate)).mesh
    assert set(found.vertices[:, 2].tolist()) == {2.0}
    angle = np.linspace(0.0, 0.5, 9)
    cap = [(100 * np.sin(a), -100 * np.cos(a)) for a in angle]
    cap += [(97 * np.sin(a), -97 * np.cos(a)) for a in angle[::-1]]
    found = outer_walls(revolved(cap), none(revolved(cap))).mesh
    assert np.allclose(np.linalg.norm(found.vertices, axis=1), 100.0)


def test_of_a_hollow_ball_the_outer_side_alone_is_woven():
    ball = parse_shape("shape:sphere?n=6")
    inner = ball.with_vertices(0.5 * ball.vertices)
    for inside in (inner, with_flips(inner, [True] * inner.n_faces)):
        mesh = merged(ball, inside)
        looks = np.repeat([False, inside is not inner], ball.n_faces)
        found = outer_walls(prepare_mesh(mesh)[0], looks)
        # A ball inside a ball that looks outward may be meant.
        assert found.hidden == int(inside is not inner)
        assert found.mesh.n_faces == (2 - found.hidden) * ball.n_faces
    thin = merged(ball, ball.with_vertices(0.97 * ball.vertices))
    assert outer_walls(thin, none(thin)).hidden == 1


@pytest.mark.parametrize(
    "shape",
    ["shape:cube", "shape:torus?m=24&n=12", "shape:torus?m=64&n=12&tube=0.03", "shape:sphere?n=6"],
)
def test_what_is_no_wall_stays(shape):
    mesh = parse_shape(shape)
    assert outer_walls(mesh, none(mesh)).mesh is mesh


@pytest.mark.parametrize(
    "name",
    ["quad/spot_quadrangulated.obj", "quad/bob_quad.obj", "tri/double-torus.obj",
     "tri/polyhedraexplorer_genus49.stl", "open/hypar.obj"],
)  # fmt: skip
def test_animals_and_frames_stay(name):
    mesh = give_mesh(Settings.of(str(shared_mesh(name)), walls="both").mesh).mesh
    assert find_wall(mesh) is None


def test_bars_are_no_wall():
    """A frame of bars is as thick everywhere, but goes on in one direction only."""
    bar = refine_mesh(opened_box(1.0), parse_refinements("mid-edge:1"))
    assert find_wall(bar) is not None
    ring = revolved([(50, 0), (52, 0), (52, 2), (50, 2), (50, 0)])
    assert find_wall(ring) is None


def test_a_ragged_rim_is_cut_along_a_line():
    rng = np.random.default_rng(1)
    count = 40
    x, y = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    places = np.stack([x, y], axis=2) + rng.uniform(-0.3, 0.3, (count, count, 2))
    number = np.arange(count * count).reshape(count, count)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    halves = np.concatenate([np.stack(t, 2).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    mesh = PolyMesh.from_triangles(
        np.column_stack([places.reshape(-1, 2), np.zeros(count * count)]), halves
    )
    middles = mesh.vertices[halves].mean(axis=1)[:, :2]
    far = np.linalg.norm(middles - 19.5, axis=1)
    kept = far < 13.0
    smooth, ragged = part_along_rim(mesh, kept)
    assert ragged == 1
    assert check_mesh(smooth).kind == check_mesh(keep_faces(mesh, kept)).kind
    (before,), (after,) = boundary_walks(keep_faces(mesh, kept)), boundary_walks(smooth)

    def longer(points, loop):
        return np.linalg.norm(points[loop] - points[np.roll(loop, 1)], axis=1).sum() / 26 / np.pi

    assert longer(mesh.vertices, before) > 1.15
    assert longer(smooth.vertices, after) < 1.03
    assert surface_area(smooth) == pytest.approx(np.pi * 13.0**2, rel=0.1)


def test_cracks_are_closed_and_rims_are_not():
    torn = revolved([(0.1, 0), (30, 0), (30, 60), (0, 60)], 8)
    whole, count, notes = fill_cracks(torn)
    assert (check_mesh(whole).closed, check_mesh(whole).oriented) == (True, True)
    assert (count, len(notes)) == (6, 1)
    bowl = revolved([(0, 0), (30, 0), (30, 60)], 8)
    for mesh in (bowl, whole):
        assert fill_cracks(mesh)[0] is mesh


def test_the_option_says_which_sides_are_woven():
    whole = revolved(sides(2.0)[1])
    load = {
        walls: give_mesh(Settings.of("vase.obj", walls=walls, size_mm=400.0).mesh, in_memory=whole)
        for walls in ("auto", "both", "outside")
    }
    assert load["both"].mesh.n_faces == whole.n_faces
    assert load["both"].seen.kind == "ball"
    assert load["auto"].mesh.n_faces == load["outside"].mesh.n_faces < whole.n_faces
    assert load["auto"].seen.kind == "disc"
    assert np.ptp(load["auto"].mesh.vertices, axis=0).max() == pytest.approx(400.0)
    with pytest.raises(CannotMakeError, match="no wall"):
        give_mesh(Settings.of("x.obj", walls="outside").mesh, in_memory=parse_shape("shape:cube"))
