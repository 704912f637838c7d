"""Meshes that are symmetric but for noise become so exactly, and move no more than they must."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.automorphisms import find_symmetry
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.symmetrise import symmetrise
from fabweave.mesh.upright import largest_dimension

#: With the orders of their groups, reflections counted.
SHAPES = {
    "shape:cube": 48,
    "shape:torus?m=8&n=5": 32,
    "shape:dodecahedron": 120,
    "shape:tube?m=6&n=3": 24,
}


def shaken(mesh: PolyMesh, share: float, seed: int) -> PolyMesh:
    noise = np.random.default_rng(seed).uniform(-1.0, 1.0, mesh.vertices.shape)
    return mesh.with_vertices(mesh.vertices + share * largest_dimension(mesh) * noise)


@given(st.sampled_from(sorted(SHAPES)), st.sampled_from([1e-6, 1e-4, 2e-3]), st.integers(0, 99))
def test_noise_is_taken_away(shape, share, seed):
    mesh, order = parse_shape(shape), SHAPES[shape]
    rough = shaken(mesh, share, seed)
    made = symmetrise(rough)
    assert made.symmetry.order == order
    assert find_symmetry(made.mesh, build_halfedges(made.mesh)).order == order
    # The mean of many places is no further off than all of them.
    assert made.moved.max() <= 4 * share * largest_dimension(mesh)
    # Of all symmetric meshes it is the nearest: the one without noise is no nearer, but for a turn.
    off = np.sum((made.mesh.vertices - rough.vertices) ** 2)
    assert off <= np.sum((mesh.vertices - rough.vertices) ** 2) * (1 + 1e-6)


def test_what_is_not_symmetric_is_refused():
    rough = shaken(parse_shape("shape:torus?m=5&n=4"), 0.1, 3)
    with pytest.raises(CannotMakeError, match="leave out --symmetrise"):
        symmetrise(rough)
