"""The view that is chosen shows the form of an object."""

import numpy as np
import pytest

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import solids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar
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
