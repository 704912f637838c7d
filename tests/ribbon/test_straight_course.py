"""On a straight course strands run along the medial line, flat where they lie on one another."""

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from meshes_shared import real_mesh
from unfolding import plain_ribbons
from weaving_meshes import meshes

from fabweave.mesh.fair.portals import medial_portals, portals_of
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.ribbon.measures import open_share, panel_widths

WIDTH, LENGTH = 0.65, 0.7


def laid(mesh, course="straight", height_mm=0.0, width=WIDTH):
    portals = portals_of(course, mesh, build_halfedges(mesh))
    return plain_ribbons(mesh, height_mm=height_mm, width=width, length=LENGTH, portals=portals)


def panels(ribbons):
    """Return the corners of each pass's panel, (P, 4, 3)."""
    at = ribbons.entry
    sides = (ribbons.right[at], ribbons.right[at + 1], ribbons.left[at + 1], ribbons.left[at])
    return np.stack(sides, axis=1)


def patch(n, side):
    """Return a flat patch of n by n pairs of regular triangles."""
    i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
    points = np.stack([i + j / 2, j * np.sqrt(3) / 2, np.zeros_like(i)], axis=-1).reshape(-1, 3)
    a = (i[:-1, :-1] * (n + 1) + j[:-1, :-1]).reshape(-1)
    b, c, d = a + n + 1, a + n + 2, a + 1
    faces = np.concatenate([np.column_stack([a, b, d]), np.column_stack([b, c, d])])
    return PolyMesh.from_triangles(side * points, faces)


def ball(steps):
    return refine_mesh(parse_shape("shape:icosahedron"), parse_refinements(f"loop:{steps}"))


@pytest.mark.parametrize("n", [3, 4, 5, 6, 7])
def test_in_a_regular_polygon_the_share_is_the_square_of_a_sine(n):
    # The middles of edges lie at the cosine of pi / n of the radius; along a radius, at its square.
    turn = 2 * np.pi * np.arange(n) / n
    corners = np.column_stack([np.cos(turn), np.sin(turn), np.ones(n)])
    mesh = PolyMesh.from_faces(corners.tolist(), [list(range(n))])
    found = medial_portals(mesh, build_halfedges(mesh))
    assert np.allclose(found, max(np.sin(np.pi / n) ** 2, 0.2), atol=1e-12)


@given(st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9))
def test_in_any_triangle_it_is_three_quarters(numbers):
    corners = np.array(numbers).reshape(3, 3)
    sides = np.roll(corners, -1, axis=0) - corners
    if np.linalg.norm(np.cross(sides[0], sides[1])) < 1e-3:
        return
    mesh = PolyMesh.from_faces(corners.tolist(), [[0, 1, 2]])
    assert np.allclose(medial_portals(mesh, build_halfedges(mesh)), 0.75, atol=1e-6)


def test_courses_differ_where_they_should():
    mesh = parse_shape("shape:cube")
    halfedges = build_halfedges(mesh)
    assert portals_of("auto", mesh, halfedges) is portals_of("projection", mesh, halfedges) is None
    assert np.allclose(portals_of("straight", mesh, halfedges), 0.5, atol=1e-12)
    mixed = real_mesh("ngon/platonic_shelf.obj", 400.0)
    halfedges = build_halfedges(mixed)
    quad = mixed.face_sizes[halfedges.face] == 4
    auto = portals_of("auto", mixed, halfedges)
    assert 0 < np.count_nonzero(quad) < len(quad)
    assert np.array_equal(auto == 0.5, quad)


def test_where_most_faces_are_quads_fans_and_polygons_leave_strands_as_much_room():
    ball = real_mesh("rings/pole_ball.obj", 400.0)
    room = {course: panel_widths(laid(ball, course)[1]).min() for course in ("auto", "straight")}
    assert room["auto"] > 1.3 * room["straight"]


@given(meshes())
def test_half_way_through_all_portals_is_the_projection_method_to_the_last_bit(mesh):
    half = np.full(mesh.n_corners, 0.5)
    one, other = (plain_ribbons(mesh, width=0.3, portals=portals)[1] for portals in (None, half))
    assert np.allclose(one.right, other.right, atol=1e-9)
    assert np.allclose(one.left, other.left, atol=1e-9)


def test_on_regular_triangles_strips_are_straight_and_as_wide_as_the_theory_says():
    side = 40.0
    weave, ribbons = laid(patch(6, side))
    assert weave.threads.n_threads > 10
    for thread in np.flatnonzero(weave.threads.lengths):
        rungs = slice(*ribbons.offsets[thread : thread + 2])
        right, left = ribbons.right[rungs], ribbons.left[rungs]
        middle = (right + left) / 2
        # All on one line, and every rung at right angles to it.
        assert np.linalg.matrix_rank(middle - middle[0], tol=1e-9) == 1
        way = middle[-1] - middle[0]
        assert np.abs((left - right) @ way).max() < 1e-9
        width = np.linalg.norm(left - right, axis=1)
        # A ribbon of the whole room would just close the openings of three sides.
        assert np.allclose(width, WIDTH * side / (2 * np.sqrt(3)), atol=1e-9)


@pytest.mark.parametrize("width", [0.3, 0.65])
def test_what_stays_open_of_a_flat_kagome_is_what_the_theory_says(width):
    # A third even if the small openings close. A patch has no ribbons at its rim: its middle tells.
    side, n = 40.0, 60
    mesh = patch(n, side)
    weave, ribbons = laid(mesh, width=width)
    ribbon = width * side / (2 * np.sqrt(3))
    covered = (1.5 * side * ribbon - 1.5 * ribbon**2 / np.sin(np.pi / 3)) / (
        np.sqrt(3) / 4 * side**2
    )
    found = open_share(ribbons, weave, mesh)
    assert found == pytest.approx(1.0 - covered, abs=1.5 / n)
    assert 1.0 - found < covered


CLOSED = {
    "ball": lambda: ball(2),
    "hexagons": lambda: real_mesh("ngon/hexaSphere.off", 400.0),
    "solids": lambda: real_mesh("ngon/platonic_shelf.obj", 400.0),
}


@pytest.mark.parametrize("name", CLOSED)
def test_both_panels_have_the_crossing_in_their_middle_and_hold_what_lies_on_the_other(name):
    weave, ribbons = laid(CLOSED[name]())
    crossing = weave.threads.crossing
    corners = panels(ribbons)
    assert np.allclose(corners.mean(axis=1), ribbons.centre[crossing], atol=1e-9)
    order = np.argsort(crossing, kind="stable").reshape(-1, 2)
    along = corners[:, 1] - corners[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    for first, second in order[:: max(1, len(order) // 200)]:
        u = along[first]
        v = np.cross(ribbons.normal[crossing[first]], u)
        plane = np.column_stack([u, v])
        one, other = (shapely.Polygon(corners[p] @ plane) for p in (first, second))
        both = one & other
        # What the rails bound is no more than the panels share: it lies in the middle of either.
        rails = [_band(corners[p] @ plane) for p in (first, second)]
        assert (rails[0] & rails[1]).area == pytest.approx(both.area, rel=1e-6)


def _band(panel):
    """Return the strip between the two rails of a panel, drawn out far beyond its ends."""
    right, left = panel[1] - panel[0], panel[2] - panel[3]
    ends = [panel[0] - 9 * right, panel[1] + 9 * right, panel[2] + 9 * left, panel[3] - 9 * left]
    return shapely.make_valid(shapely.Polygon(ends))
