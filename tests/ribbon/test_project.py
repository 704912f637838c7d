"""Ribbons lie over and under the surface as the weave says, and unfold exactly."""

import re

import numpy as np
import pytest
from hypothesis import given
from unfolding import plain_ribbons as woven
from unfolding import shape_at
from weaving_meshes import meshes

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.upright import resize_mesh
from fabweave.picture.model_files import ribbon_faces
from fabweave.piece.development import unfold_threads
from fabweave.ribbon.measures import NARROWEST_MM, require_width, ribbon_widths


@given(meshes())
def test_areas_of_strips_are_the_areas_of_ribbons(mesh):
    _, ribbons = woven(resize_mesh(mesh, size_mm=500.0)[0])
    strips = unfold_threads(ribbons)
    for thread in range(len(ribbons.closed)):
        a, b = ribbons.offsets[thread : thread + 2]
        if a == b:
            continue
        points = np.stack((ribbons.right[a:b], ribbons.left[a:b]), axis=1).reshape(-1, 3)
        x, y, z = (points[corner] for corner in ribbon_faces(ribbons, thread).T)
        space = np.linalg.norm(np.cross(y - x, z - x), axis=1).sum() / 2
        c, d = strips.offsets[thread : thread + 2]
        # The shoelace formula adds signed areas: overlaps of the strip with itself do not matter.
        outline = np.concatenate((strips.right[c:d], strips.left[c:d][::-1]))
        following = np.roll(outline, -1, axis=0)
        flat = (outline[:, 0] * following[:, 1] - outline[:, 1] * following[:, 0]).sum() / 2
        assert flat == pytest.approx(space, rel=1e-9)


@given(meshes())
def test_over_panels_lie_outside_and_are_centred_on_the_ones_below(mesh):
    weave, ribbons = woven(resize_mesh(mesh, size_mm=500.0)[0])
    middle = (ribbons.right + ribbons.left) / 2
    centre = (middle[ribbons.entry] + middle[ribbons.entry + 1]) / 2
    crossing = weave.threads.crossing
    above = np.einsum("pd,pd->p", centre - ribbons.centre[crossing], ribbons.normal[crossing])
    assert np.allclose(above, np.where(weave.over, 0.3, -0.3), atol=1e-9)
    aside = centre - ribbons.centre[crossing] - above[:, None] * ribbons.normal[crossing]
    assert np.abs(aside).max() < 1e-9


@given(meshes())
def test_panels_are_planar_and_normal_to_the_surface(mesh):
    _, ribbons = woven(resize_mesh(mesh, size_mm=500.0)[0])
    corners = [
        rail[ribbons.entry + step] for rail in (ribbons.right, ribbons.left) for step in (0, 1)
    ]
    spread = corners[1] - corners[0], corners[2] - corners[0], corners[3] - corners[0]
    volume = np.abs(np.einsum("pd,pd->p", np.cross(spread[0], spread[1]), spread[2]))
    assert volume.max() < 1e-9 * 500.0**3


def test_a_flat_square_grid_has_the_relative_width_and_length():
    # On unit squares the quad of an edge is a square of diagonal 1, so side 1/sqrt(2).
    _, ribbons = woven(shape_at("hypar?m=6&n=6&height=0.001", 6.0), length=0.8, width=0.5)
    width = np.linalg.norm(ribbons.left - ribbons.right, axis=1)
    assert np.allclose(width, 0.5 / np.sqrt(2))
    middle = (ribbons.right + ribbons.left) / 2
    length = np.linalg.norm(middle[ribbons.entry + 1] - middle[ribbons.entry], axis=1)
    assert np.allclose(length, 0.8 / np.sqrt(2))


@pytest.mark.parametrize(("length", "width"), [(0.5, 0.6), (1.0, 0.5), (0.7, -1.0)])
def test_impossible_widths_are_refused(length, width):
    with pytest.raises(InputError):
        woven(shape_at("cube"), length=length, width=width)


def test_faces_folded_flat_on_one_another_are_refused():
    pillow = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2], [2, 1, 0]])
    with pytest.raises(InputError, match="3 edges have no room"):
        woven(pillow)


def test_a_hair_is_refused_with_the_size_that_would_do():
    weave, ribbons = woven(shape_at("torus?m=24&n=12", 5.5))
    labels = tuple(map(str, range(weave.threads.n_threads)))
    with pytest.raises(CannotMakeError, match=r"--size (\d+)mm") as refused:
        require_width(ribbons, labels, 5.5)
    size = float(re.search(r"--size (\d+)mm", str(refused.value))[1])
    _, larger = woven(shape_at("torus?m=24&n=12", size))
    require_width(larger, labels, size)
    assert ribbon_widths(larger).min() >= NARROWEST_MM
