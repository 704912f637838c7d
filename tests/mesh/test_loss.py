"""The map of losses covers the model, and its distances have known answers."""

import numpy as np
import pytest
from strategies import volume

from fabweave.mesh.likeness import loss_map
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import solids
from fabweave.mesh.triangulate import surface_area


def test_the_parts_are_small_and_cover_the_model():
    cube = solids.cube()
    loss = loss_map(cube, cube)
    side = np.ptp(cube.vertices, axis=0).max()
    assert loss.size_mm == pytest.approx(side)
    whole = PolyMesh.from_faces(loss.points, loss.triangles)
    assert surface_area(whole) == pytest.approx(6 * side**2)
    corners = loss.points[loss.triangles]
    assert np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max() <= side / 50
    assert loss.lost_mm.max() < 1e-6 * side
    # They are turned as the faces of the model are: the volume is that of the cube.
    assert volume(whole) == pytest.approx(side**3)
