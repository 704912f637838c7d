"""Pictures show what is in front, with light that tells over from under."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from weaving_meshes import walked

from fabweave.core.colour_space import light_of
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.picture.camera import View, frame_object
from fabweave.picture.object_picture import irregular_marks, weave_picture
from fabweave.picture.render import (
    facet_normals,
    floor_light,
    key_direction,
    key_shadow,
    object_frame,
    render_scene,
    smooth_normals,
)
from fabweave.picture.surfaces import face_normals, polygon_triangles, ribbon_triangles
from fabweave.picture.zbuffer import nearest_of_layers, nearest_triangles, planes_through
from fabweave.ribbon.project import project_ribbons
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave

SIZE, WOVEN = (240, 200), (320, 320)
views = st.builds(View, st.floats(-360.0, 360.0), st.floats(-90.0, 90.0))


def naive_nearest(points, triangles, width, height):
    """Look at every triangle for every pixel centre that is clearly inside or clearly outside."""
    seen = np.full((height, width), -1)
    doubtful = np.zeros((height, width), dtype=bool)
    for row in range(height):
        for column in range(width):
            found = []
            for number, corners in enumerate(points[triangles]):
                (ax, ay), (bx, by), (cx, cy) = corners[:, :2] - (column + 0.5, row + 0.5)
                parts = np.array([bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx])
                area = parts.sum()
                if abs(area) < 1e-9:
                    continue
                shares = parts / area
                doubtful[row, column] |= bool(np.any(np.abs(shares) < 1e-9))
                if np.all(shares > 0):
                    found.append((float(shares @ corners[:, 2]), -number))
            if found:
                found.sort()
                seen[row, column] = -found[-1][1]
                near = [depth for depth, _ in found]
                doubtful[row, column] |= len(near) > 1 and near[-1] - near[-2] < 1e-9
    return seen, doubtful


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12))
def test_each_pixel_shows_the_triangle_a_naive_search_finds(seed, count):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-6, 22, (3 * count, 3))
    triangles = np.arange(3 * count).reshape(-1, 3)
    seen, nearness = nearest_triangles(points, triangles, width=17, height=13)
    expected, doubtful = naive_nearest(points, triangles, 17, 13)
    assert np.array_equal(seen[~doubtful], expected[~doubtful])
    assert np.array_equal(seen >= 0, np.isfinite(nearness))


@given(st.integers(0, 2**32 - 1))
def test_triangles_that_share_sides_leave_no_crack_and_no_double_pixel(seed):
    # Corners on a coarse lattice of halves: many lie exactly on pixel centres.
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(0.0, 13.0, 3.0), np.arange(0.0, 13.0, 3.0))
    inner = (x > 0) & (x < 12) & (y > 0) & (y < 12)
    x, y = (v + inner * rng.integers(-1, 2, v.shape) / 2 for v in (x, y))
    points = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    a = (np.arange(4)[:, None] * 5 + np.arange(4)).ravel()
    flip = rng.random(16) < 0.5
    one = np.where(flip, [a, a + 1, a + 6], [a, a + 1, a + 5]).T
    two = np.where(flip, [a, a + 6, a + 5], [a + 1, a + 6, a + 5]).T
    covered = np.zeros((12, 12), dtype=int)
    for triangle in np.concatenate((one, two)):
        covered += nearest_triangles(points, triangle[None], width=12, height=12)[0] >= 0
    assert np.array_equal(covered, np.ones((12, 12)))


@given(st.integers(0, 2**32 - 1))
def test_planes_take_their_values_at_the_corners(seed):
    rng = np.random.default_rng(seed)
    corners, values = rng.uniform(0, 100, (5, 3, 2)), rng.uniform(-9, 9, (5, 3))
    # Of a thin triangle the slopes are large, and rounding with them.
    planes = planes_through(corners, values)
    number = np.arange(5)
    scale = np.abs(planes.along_x) + np.abs(planes.along_y) + 1.0
    for corner in range(3):
        found = planes.at(number, corners[:, corner, 0], corners[:, corner, 1])
        assert np.all(np.abs(found - values[:, corner]) < 1e-10 * scale)


@given(views)
def test_views_are_right_handed_and_up_is_up(view):
    axes = view.axes()
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) > 0
    right, high, near = axes[:, 2]
    assert abs(right) < 1e-12
    assert high >= -1e-12
    assert np.isclose(near, np.sin(np.radians(view.elevation_deg)))


@given(views, st.integers(0, 2**32 - 1))
def test_objects_fill_their_frame(view, seed):
    points = np.random.default_rng(seed).normal(size=(9, 3)) * 1e3
    frame = frame_object(points, view, (300, 150))
    pixels = frame.pixels(points)[:, :2]
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    assert np.allclose(low + high, (300, 150))
    assert np.isclose(np.max((high - low) / (270, 135)), 1.0)


def test_the_order_of_triangles_does_not_matter_and_bytes_repeat():
    mesh = parse_shape("shape:torus?m=12&n=8")
    vertices, triangles, sides, face = polygon_triangles(mesh)
    colours = np.random.default_rng(1).integers(0, 256, (mesh.n_faces, 3)).astype(np.uint8)[face]
    order = np.random.default_rng(2).permutation(len(triangles))
    first, again, other = (
        render_scene(
            vertices, triangles[o], colours[o], edges=sides[o], size_px=SIZE, view=View()
        ).tobytes()
        for o in (slice(None), slice(None), order)
    )
    assert first == again == other


def woven(name: str, *, twisted: bool = True):
    mesh = parse_shape(f"shape:{name}")
    halfedges, threads = walked(mesh)
    weave = plain_weave(threads)
    if not twisted:
        twist = ~weave.twist
        weave = Weave(weave.threads, "plain", twist, over_of_passes(weave.threads, twist))
    return weave, project_ribbons(mesh, halfedges, weave, height_mm=0.5)


def shown_with_colours(weave, ribbons, view):
    """Give threads six strong colours, and make a picture."""
    n_threads = weave.threads.n_threads
    colours = np.full((n_threads, 3), 25, dtype=np.uint8)
    colours[np.arange(n_threads), np.arange(n_threads) % 3] = 230
    colours[np.arange(n_threads), (np.arange(n_threads) // 3 + np.arange(n_threads)) % 3] = 230
    return colours, np.asarray(
        weave_picture(ribbons, colours, size_px=WOVEN, view=view, floor=False)
    )


def shows_over(weave, ribbons, over, view, colours, picture) -> np.ndarray:
    """At each crossing that faces the eye: whether the thread that is over is what is seen."""
    vertices, triangles, _ = ribbon_triangles(ribbons)
    frame = object_frame(vertices, triangles, view, WOVEN)
    facing = ribbons.normal @ frame.axes[2] > 0.6
    threads = weave.threads
    upper = np.empty(threads.n_crossings, dtype=np.int64)
    upper[threads.crossing[over]] = threads.thread_of_pass[over]
    lower = np.empty(threads.n_crossings, dtype=np.int64)
    lower[threads.crossing[~over]] = threads.thread_of_pass[~over]
    told = facing & np.any(colours[upper] != colours[lower], axis=1)
    column, row = np.floor(frame.pixels(ribbons.centre + 0.5 * ribbons.normal)).T[:2].astype(int)
    light = light_of(picture[row[told], column[told]])
    # Light scales a colour, and keeps its direction.
    light /= np.linalg.norm(light, axis=1, keepdims=True)
    likeness = [
        np.einsum("xc,xc->x", light, own / np.linalg.norm(own, axis=1, keepdims=True))
        for own in (light_of(colours[upper[told]]), light_of(colours[lower[told]]))
    ]
    return likeness[0] > likeness[1] + 1e-6


@pytest.mark.parametrize("name", ["sphere?n=5&radius=50", "hypar?m=8&n=8", "hemisphere"])
@pytest.mark.parametrize("twisted", [True, False])
def test_at_every_crossing_the_thread_over_is_seen(name, twisted):
    weave, ribbons = woven(name, twisted=twisted)
    view = View(-60.0, 50.0)
    shown = shown_with_colours(weave, ribbons, view)
    seen = shows_over(weave, ribbons, weave.over, view, *shown)
    assert len(seen) > 40
    assert seen.all()
    # The same predicate objects to a picture of the contrary.
    assert not shows_over(weave, ribbons, ~weave.over, view, *shown).any()


def test_edges_are_seen_in_front_and_hidden_behind():
    mesh = parse_shape("shape:cube")
    vertices, triangles, sides, _ = polygon_triangles(mesh)
    view = View(-60.0, 30.0)
    picture = np.asarray(
        render_scene(
            vertices, triangles, (200, 200, 200), edges=sides, line_px=3.0, lit=False,
            size_px=SIZE, view=view,
        )
    )  # fmt: skip
    frame = object_frame(vertices, triangles, view, SIZE)
    outward = face_centres(mesh) - vertices.mean(axis=0)
    facing = outward @ frame.axes[2] > 0
    halfedges = build_halfedges(mesh)
    seen, hidden = [], []
    for h in halfedges.edge_halfedge:
        twin = halfedges.twin[h]
        beside = facing[[halfedges.face[h], halfedges.face[twin]]]
        middle = vertices[[halfedges.tail[h], halfedges.tail[twin]]].mean(axis=0)
        column, row = np.floor(frame.pixels(middle[None])[0, :2]).astype(int)
        if beside.all():
            seen.append(picture[row, column, 0])
        elif not beside.any():
            hidden.append(picture[row, column, 0])
    assert len(seen) == len(hidden) == 3
    assert max(seen) < 120
    assert hidden == [200, 200, 200]
    # Diagonals of quads are no edges of the mesh.
    centre = frame.pixels(face_centres(mesh)[facing])[:, :2].astype(int)
    assert np.all(picture[centre[:, 1], centre[:, 0]] == 200)


def test_a_plate_casts_the_shadow_that_geometry_says():
    # A small square floats over a large one; light falls along the key direction.
    def plate(half, near):
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half + 100.0
        return np.column_stack((corners, np.full(4, near)))

    points = np.concatenate((plate(90.0, 0.0), plate(15.0, 40.0)))
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    x, y = np.meshgrid(np.arange(20.5, 180.0), np.arange(20.5, 180.0))
    places = np.column_stack((x.ravel(), y.ravel(), np.zeros(x.size)))
    large, small = np.zeros(len(places), dtype=np.int64), np.full(len(places), 2)
    light = key_shadow(points, triangles, large, places, width=400, height=400)
    towards = key_direction() * (1, -1, 1)  # over the left shoulder, y down
    middle = 100.0 - 40.0 * towards[:2] / towards[2]
    away = np.max(np.abs(places[:, :2] - middle), axis=1)
    assert light[away < 13.0].max() < 0.4
    assert light[away > 17.0].min() == pytest.approx(1.0)
    above = np.column_stack((x.ravel() * 0.1 + 90.0, y.ravel() * 0.1 + 90.0, np.full(x.size, 40.0)))
    light = key_shadow(points, triangles, small, above, width=400, height=400)
    assert light.min() == pytest.approx(1.0)


def test_the_floor_is_dark_where_the_light_does_not_reach_it():
    # A square plate floats high over a floor that a far speck marks.
    plate = np.array([[-1, -1, 4], [1, -1, 4], [1, 1, 4], [-1, 1, 4.0]])
    speck = np.array([[9, 9, 0], [9.01, 9, 0], [9, 9.01, 0.0]])
    points = np.concatenate((plate, speck))
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]])
    view = View(-60.0, 40.0)
    towards = key_direction() @ view.axes()
    fallen = points - points[:, 2:] * towards / towards[2]
    frame = frame_object(
        np.concatenate((points, points * (1, 1, 0), fallen)), view, (500, 400), 0.1
    )
    light = floor_light(points, triangles, view, frame)
    assert light.shape == (400, 500)
    assert min(light[[0, -1]].min(), light[:, [0, -1]].min()) > 0.99

    def light_at(x, y):
        column, row = frame.pixels(np.array([[x, y, 0.0]]))[0, :2].astype(int)
        return light[row, column]

    middle = fallen[:4].mean(axis=0)
    deep = light_at(*middle[:2])
    assert deep < 0.85
    for x, y in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        # The light has a size: at the edge of the shadow half of it is seen, and all farther out.
        edge, out = (light_at(*(middle[:2] + far * np.array([x, y]))) for far in (1.0, 1.8))
        assert deep + 0.03 < edge < out - 0.03
    assert light_at(-7.5, 7.5) > 0.99


def test_normals_are_those_of_a_sphere():
    mesh = parse_shape("shape:sphere?n=12&radius=50")
    vertices, triangles, _, _ = polygon_triangles(mesh)
    outward = vertices[triangles] / np.linalg.norm(vertices[triangles], axis=2, keepdims=True)
    assert np.einsum("tcd,tcd->tc", smooth_normals(vertices, triangles), outward).min() > 0.995
    assert np.einsum("tcd,tcd->tc", facet_normals(vertices, triangles), outward).min() > 0.98


@pytest.mark.parametrize("name", ["dodecahedron", "cube", "icosahedron", "hypar?m=3&n=2"])
def test_polygons_are_cut_to_triangles_of_the_same_surface(name):
    mesh = parse_shape(f"shape:{name}")
    vertices, triangles, sides, face = polygon_triangles(mesh)
    run = np.stack((triangles, np.roll(triangles, -1, axis=1)), axis=-1)[sides]
    tail, following = mesh.indices, build_halfedges(mesh).next
    assert sorted(map(tuple, run.tolist())) == sorted(
        zip(tail.tolist(), tail[following].tolist(), strict=True)
    )
    corners = vertices[triangles]
    vector = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Newell's area vector of each polygon is the sum of those of its triangles.
    total = np.stack([np.bincount(face, weights=v, minlength=mesh.n_faces) for v in vector.T], 1)
    here = mesh.vertices[tail]
    expected = np.add.reduceat(np.cross(here, here[following]), mesh.offsets[:-1], axis=0)
    assert np.allclose(total, expected)
    unit = expected / np.linalg.norm(expected, axis=1, keepdims=True)
    assert np.allclose(face_normals(mesh), unit)


@pytest.mark.parametrize(
    ("count", "colour"),
    [(3, (0, 114, 178)), (5, (213, 94, 0)), (7, (213, 94, 0)), (8, (0, 158, 115)), (4, None)],
)
def test_marks_tell_fewer_more_and_fourfold(count, colour):
    # Quads around one vertex.
    turn = 2 * np.pi * np.arange(count) / count
    spokes = np.column_stack((np.cos(turn), np.sin(turn), np.zeros(count)))
    faces = [[0, 1 + k, 1 + count + k, 1 + (k + 1) % count] for k in range(count)]
    outer = spokes + np.roll(spokes, -1, axis=0)
    marks = irregular_marks(
        PolyMesh.from_faces(np.concatenate((np.zeros((1, 3)), spokes, outer)), faces)
    )
    assert marks.colours.tolist() == ([list(colour)] if colour else [])
    assert not marks.points.any()


@pytest.mark.parametrize("seed", range(4))
def test_layers_add_what_is_nearer_than_those_before(seed):
    generator = np.random.default_rng(seed)
    size, points = {"width": 13, "height": 11}, generator.uniform(0.0, 14.0, (60, 3)).round(1)
    triangles, layer = generator.integers(0, 60, (40, 3)), generator.integers(0, 6, 40)
    triangle, pixel, near = nearest_of_layers(points, triangles, layer, **size)
    found = set(zip(triangle.tolist(), pixel.tolist(), near.tolist(), strict=True))
    before, wanted = np.full((11, 13), -np.inf), set()
    for number in range(6):
        own = np.flatnonzero(layer == number)
        seen, nearness = nearest_triangles(points, triangles[own], **size)
        shown = np.flatnonzero((nearness > before).ravel())
        wanted |= {(int(own[seen.flat[at]]), int(at), nearness.flat[at]) for at in shown}
        before = np.maximum(before, nearness)
    assert found == wanted
    assert found
