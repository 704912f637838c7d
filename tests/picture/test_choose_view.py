"""The view that is chosen shows the form of an object."""

import numpy as np
import pytest

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import solids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import grid_quads, hemisphere, hypar, tube
from fabweave.mesh.upright import resize_mesh
from fabweave.picture.camera import View, choose_view
from fabweave.picture.surfaces import polygon_triangles


def seen_faces(mesh: PolyMesh, view: View) -> np.ndarray:
    """Return the shares of the faces in what is seen of a convex body, the largest first."""
    points, triangles, _, face = polygon_triangles(mesh)
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.bincount(face, np.maximum(normal @ view.axes()[2], 0.0))
    return np.sort(area[area > 1e-9])[::-1] / area.sum()


@pytest.mark.parametrize(
    "name", ["tetrahedron", "cube", "octahedron", "icosahedron", "dodecahedron"]
)
@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_a_solid_shows_several_faces(name, size) -> None:
    mesh, _ = resize_mesh(getattr(solids, name)(), size_mm=size)
    points, triangles, _, _ = polygon_triangles(mesh)
    shares = seen_faces(mesh, choose_view(points, triangles))
    # Of a tetrahedron two, as large as if they were all alike.
    few = 2 if name == "tetrahedron" else 3
    assert len(shares) >= few
    assert shares[few - 1] > 0.05


def test_round_things_are_seen_at_the_height_of_the_eye_and_flat_ones_from_above() -> None:
    # What is as high as wide is seen at the height of the eye; the flatter, the higher.
    round_, thick, thin, flat = (
        choose_view(*polygon_triangles(mesh)[:2])
        for mesh in (
            parse_shape("shape:sphere?n=8"),
            parse_shape("shape:torus?m=24&n=12&ring=30&tube=22"),
            parse_shape("shape:torus?m=24&n=12&ring=40&tube=14"),
            hypar(4, 4, 100.0, 0.0),
        )
    )
    assert round_ == View(-60.0, 12.0)
    heights = [view.elevation_deg for view in (round_, thick, thin, flat)]
    assert heights == sorted(set(heights))


def sheet(bulge: float, turn_deg: float, *, inside_out: bool) -> PolyMesh:
    """Return a relief that stands, its middle in front, which is -y before it is turned."""
    across, up = (x.ravel() for x in np.meshgrid(np.linspace(-1, 1, 13), np.linspace(-1, 1, 13)))
    round_ = np.sqrt(1.2 - 0.5 * across**2 - 0.4 * up**2)
    nose = 0.3 * np.exp(-((across / 0.2) ** 2) - (up / 0.4) ** 2)
    points = np.stack([across, -bulge * (round_ + nose), 1.3 * up], axis=1)
    quads = grid_quads(12, 12, wrap=(False, False))
    turn = np.radians(turn_deg)
    turned = points[:, :2] @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    return PolyMesh.from_faces(
        100.0 * np.column_stack([turned, points[:, 2]]), quads[:, ::-1] if inside_out else quads
    )


@pytest.mark.parametrize("turn_deg", [0.0, 90.0, 135.0, 180.0, 250.0])
@pytest.mark.parametrize("inside_out", [False, True])
def test_a_mask_is_looked_in_the_face_wherever_that_is(turn_deg, inside_out) -> None:
    points, triangles = polygon_triangles(sheet(1.0, turn_deg, inside_out=inside_out))[:2]
    view = choose_view(points, triangles)
    face = np.radians(turn_deg - 90.0)
    seen = view.axes()[2] @ [np.cos(face), np.sin(face), 0.0]
    # Not straight on, so that the nose shows.
    assert 0.8 < seen < 0.98


@pytest.mark.parametrize("inside_out", [False, True])
def test_a_flat_relief_is_seen_from_the_side_of_its_normals(inside_out) -> None:
    points, triangles = polygon_triangles(sheet(1e-3, 30.0, inside_out=inside_out))[:2]
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).sum(axis=0)
    assert choose_view(points, triangles).axes()[2] @ normal > 0.7 * np.linalg.norm(normal)


@pytest.mark.parametrize(("aside", "back"), [(0, -1), (0, 1), (1, 0), (-1, 0)])
def test_a_body_is_seen_from_where_its_head_leans(aside, back) -> None:
    ball = parse_shape("shape:sphere?n=8")
    points, triangles = polygon_triangles(ball)[:2]
    points = points / np.abs(points).max()
    # A body that lies, with a head on its one end.
    body, head = points * [1, 1, 0.6], 0.5 * points + [0.8 * aside, 0.8 * back, 1.0]
    view = choose_view(
        np.concatenate([body, head]), np.concatenate([triangles, triangles + len(points)])
    )
    assert view.axes()[2] @ [aside, back, 0.0] > 0.4


def test_a_rim_reads_from_above_and_a_roof_from_a_low_side() -> None:
    def height(mesh: PolyMesh) -> float:
        return choose_view(*polygon_triangles(mesh)[:2]).elevation_deg

    closed, bowl = parse_shape("shape:sphere?n=8"), hemisphere(6, 50.0)
    closed = closed.with_vertices(closed.vertices * [1, 1, 2])
    assert height(closed) < 15
    assert 20 < height(tube(24, 12, 30.0, 120.0)) < 40
    assert 20 < height(bowl.with_vertices(bowl.vertices * [1, 1, -1])) < 45
    assert 10 < height(bowl.with_vertices(bowl.vertices * [1, 1, 0.35])) < 25
