"""The view that is chosen shows the form of an object."""

import numpy as np
import pytest

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes import solids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hypar
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
def test_a_solid_shows_three_faces_at_least(name, size) -> None:
    mesh, _ = resize_mesh(getattr(solids, name)(), size_mm=size)
    points, triangles, _, _ = polygon_triangles(mesh)
    shares = seen_faces(mesh, choose_view(points, triangles))
    assert len(shares) >= 3
    assert shares[2] > 0.05


def test_from_the_usual_place_a_tetrahedron_shows_one_face_only() -> None:
    # So the test above can fail.
    assert len(seen_faces(solids.tetrahedron(), View())) == 1


def test_flat_and_round_things_are_seen_from_where_they_were() -> None:
    points, triangles, _, _ = polygon_triangles(parse_shape("shape:sphere?n=8"))
    assert choose_view(points, triangles) == View()
    points, triangles, _, _ = polygon_triangles(hypar(4, 4, 100.0, 0.0))
    assert choose_view(points, triangles).elevation_deg > View().elevation_deg
