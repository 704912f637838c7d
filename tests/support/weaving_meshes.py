"""Hypothesis strategies for meshes to weave on: closed and open, with mixed faces."""

import numpy as np
from hypothesis import strategies as st
from strategies import closed_surfaces, open_surfaces

from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.weave.threads import Threads, trace_threads


def walked(mesh: PolyMesh, *, turn: bool = False) -> tuple[Halfedges, Threads]:
    """Return the half-edges of a mesh and the walks of its threads."""
    halfedges = build_halfedges(mesh)
    return halfedges, trace_threads(halfedges, turn=turn)


def cut_faces(mesh: PolyMesh, choices: list[int]) -> PolyMesh:
    """Cut some quads and larger faces by a diagonal; 0 leaves a face as it is."""
    faces = []
    for face, choice in zip(mesh.faces(), choices, strict=False):
        if len(face) < 4 or choice == 0:
            faces.append(face)
            continue
        turned = face[choice % len(face) :] + face[: choice % len(face)]
        faces += [turned[:3], [turned[0], *turned[2:]]]
    return PolyMesh.from_faces(mesh.vertices, faces + mesh.faces()[len(choices) :])


@st.composite
def meshes(draw: st.DrawFn, *, closed: bool = False) -> PolyMesh:
    """Give oriented manifold meshes of one component with triangles, quads and larger faces.

    Faces are planar or nearly so and none is folded on its neighbour, so ribbons have room
    everywhere.
    """
    surfaces = closed_surfaces() if closed else st.one_of(closed_surfaces(), open_surfaces())
    mesh, _ = draw(surfaces)
    if draw(st.booleans()):
        seed = draw(st.integers(0, 2**32 - 1))
        mesh = cut_faces(mesh, np.random.default_rng(seed).integers(0, 5, mesh.n_faces).tolist())
    return mesh


def slit_sum(m: int, n: int, length: int) -> PolyMesh:
    """Return the connectivity of two m × n tori joined along a slit; positions mean nothing.

    Right of the slit, between its ends, each torus continues in the other one.
    """
    quads = grids.grid_quads(m, n, wrap=(True, True))
    number = np.arange(m * n)
    number[1:length] += m * n
    other = np.arange(m * n) + m * n
    other[1:length] -= m * n
    one, two = quads.copy(), quads + m * n
    right = np.arange(length)  # the first column of quads, from vertex 0 to vertex `length`
    one[right], two[right] = number[quads[right]], other[quads[right]]
    # The ends of the slit are one vertex each.
    faces = np.concatenate([one, two])
    for end in (0, length):
        faces[faces == m * n + end] = end
    used, indices = np.unique(faces, return_inverse=True)
    points = np.random.default_rng(0).normal(size=(len(used), 3))
    return PolyMesh.from_faces(points, indices.reshape(-1, 4))


def dual(mesh: PolyMesh) -> PolyMesh:
    """Return the connectivity of the dual of a closed mesh."""
    half = build_halfedges(mesh)
    faces = []
    for start in [int(np.flatnonzero(half.tail == v)[0]) for v in range(mesh.n_vertices)]:
        fan = [start]
        while (h := int(half.twin[half.prev[fan[-1]]])) != start:
            fan.append(h)
        faces.append([int(half.face[h]) for h in fan])
    return PolyMesh.from_faces(np.random.default_rng(0).normal(size=(mesh.n_faces, 3)), faces)
