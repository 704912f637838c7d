"""Hypothesis strategies for meshes to weave on: closed and open, with mixed faces."""

import numpy as np
from hypothesis import strategies as st
from strategies import closed_surfaces, open_surfaces

from fabweave.mesh.polymesh import PolyMesh


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
