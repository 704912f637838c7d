"""Hypothesis strategies for meshes, and meshes that theory knows everything about."""

import igl
import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from fabweave.core.arrays import offsets_of
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.triangulate import triangulate

SOLIDS = (
    solids.tetrahedron,
    solids.cube,
    solids.octahedron,
    solids.icosahedron,
    solids.dodecahedron,
)


def at_most(count: int) -> settings:
    """Look at so many examples, or at fewer where `make test` only glances at each property."""
    return settings(max_examples=min(count, settings().max_examples))


def merged(*meshes: PolyMesh) -> PolyMesh:
    """Put meshes side by side in one, as separate components."""
    shifts = offsets_of(np.array([mesh.n_vertices for mesh in meshes]))
    corners = offsets_of(np.array([mesh.n_corners for mesh in meshes]))
    offsets = [mesh.offsets[:-1] + c for mesh, c in zip(meshes, corners[:-1], strict=True)]
    return PolyMesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([*offsets, corners[-1:]]),
        np.concatenate([m.indices + s for m, s in zip(meshes, shifts[:-1], strict=True)]),
    )


def shuffled(mesh: PolyMesh, seed: int) -> PolyMesh:
    """Renumber vertices and faces, and start every face elsewhere: the same surface."""
    rng = np.random.default_rng(seed)
    number = rng.permutation(mesh.n_vertices)
    vertices = np.empty_like(mesh.vertices)
    vertices[number] = mesh.vertices
    faces = mesh.faces()
    turned = []
    for face in rng.permutation(mesh.n_faces).tolist():
        start = int(rng.integers(len(faces[face])))
        turned.append([int(number[v]) for v in faces[face][start:] + faces[face][:start]])
    return PolyMesh.from_faces(vertices, turned)


def with_flips(mesh: PolyMesh, flips: list[bool]) -> PolyMesh:
    """Reverse some faces."""
    faces = [face[::-1] if flip else face for face, flip in zip(mesh.faces(), flips, strict=True)]
    return PolyMesh.from_faces(mesh.vertices, faces)


def volume(mesh: PolyMesh) -> float:
    """Return what a closed surface encloses; negative if it is inside out."""
    triangles = triangulate(mesh)
    return float(np.linalg.det(triangles.vertices[triangles.indices.reshape(-1, 3)]).sum()) / 6.0


def moebius_strip(n: int) -> PolyMesh:
    """Return a Möbius strip of n quads (n at least 3)."""
    angle = np.arange(n) * 2 * np.pi / n
    side = np.array([-0.3, 0.3])
    reach = 1 + side * np.cos(angle / 2)[:, None]
    height = side * np.sin(angle / 2)[:, None]
    vertices = np.stack(
        [reach * np.cos(angle)[:, None], reach * np.sin(angle)[:, None], height], axis=-1
    )
    faces = [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(n - 1)]
    faces.append([2 * n - 2, 1, 0, 2 * n - 1])
    return PolyMesh.from_faces(vertices.reshape(-1, 3), faces)


def klein_bottle(m: int, n: int) -> PolyMesh:
    """Return the connectivity of a closed Klein bottle of m × n quads, anywhere in space."""
    faces = []
    for i in range(m):
        for j in range(n):
            k = (j + 1) % n
            near = [i * n + j, i * n + k]
            # The last ring meets the first one mirrored.
            far = [(i + 1) * n + j, (i + 1) * n + k] if i < m - 1 else [-j % n, -k % n]
            faces.append([near[0], far[0], far[1], near[1]])
    points = np.random.default_rng(0).normal(size=(m * n, 3))
    return PolyMesh.from_faces(points, faces)


def closed_surfaces() -> st.SearchStrategy[tuple[PolyMesh, int]]:
    """Give closed oriented meshes of one component and their genus."""
    spheres = st.one_of(
        st.sampled_from(SOLIDS).map(lambda solid: solid()),
        st.integers(1, 5).map(lambda n: grids.sphere(n, 50.0)),
    )
    tori = st.tuples(st.integers(3, 9), st.integers(3, 9)).map(
        lambda sides: grids.torus(*sides, 35.0, 15.0)
    )
    return st.one_of(spheres.map(lambda m: (m, 0)), tori.map(lambda m: (m, 1)))


def open_surfaces() -> st.SearchStrategy[tuple[PolyMesh, int]]:
    """Give open oriented meshes of one component and genus 0, and their number of loops."""
    sides = st.tuples(st.integers(3, 8), st.integers(1, 8))
    return st.one_of(
        sides.map(lambda s: (grids.tube(*s, 25.0, 100.0), 2)),
        sides.map(lambda s: (grids.hypar(*s, 100.0, 40.0), 1)),
        st.integers(1, 4).map(lambda n: (grids.hemisphere(n, 50.0), 1)),
    )


@st.composite
def any_meshes(draw: st.DrawFn) -> PolyMesh:
    """Give meshes with any positions and any faces over vertices that exist."""
    coordinate = st.floats(allow_nan=True, allow_infinity=True)
    points = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=1, max_size=8))
    vertex = st.integers(0, len(points) - 1)
    faces = draw(st.lists(st.lists(vertex, min_size=1, max_size=7), min_size=1, max_size=8))
    return PolyMesh.from_faces(np.array(points), faces)


@st.composite
def broken_meshes(draw: st.DrawFn) -> PolyMesh:
    """Give meshes of any content at all: faces of any size, vertices that do not exist."""
    coordinate = st.one_of(st.floats(), st.sampled_from([0.0, 1.0, 1e308, -1e308]))
    points = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), max_size=6))
    vertex = st.one_of(st.integers(0, 5), st.integers(-(2**63), 2**63 - 1))
    faces = draw(st.lists(st.lists(vertex, max_size=6), max_size=8))
    return PolyMesh.from_faces(np.array(points).reshape(-1, 3), faces)


# Triangles.

_COORDINATE = st.integers(-8, 8).map(lambda n: n / 4)
#: Two corners may be one, but the triangle has an area.
TRIANGLES = (
    st.tuples(*[st.tuples(_COORDINATE, _COORDINATE, _COORDINATE)] * 3)
    .map(np.array)
    .filter(lambda one: bool(np.any(np.cross(one[1] - one[0], one[2] - one[0]))))
)


def require_gap(gap: float, one: np.ndarray, other: np.ndarray) -> None:
    """Hold the distance of triangles between bounds: from libigl, of points all over the first."""
    steps = np.arange(25) / 24
    u, v = (axis.ravel() for axis in np.meshgrid(steps, steps))
    inside = u + v <= 1 + 1e-12
    weights = np.column_stack((1 - u - v, u, v))[inside]
    faces = np.array([[0, 1, 2]])
    squared = igl.point_mesh_squared_distance(weights @ one, np.ascontiguousarray(other), faces)[0]
    sampled = float(np.sqrt(squared.min()))
    longest = max(np.linalg.norm(one[i] - one[i - 1]) for i in range(3))
    assert gap <= sampled + 1e-9
    assert sampled <= gap + longest / 24 + 1e-9
