"""The conditions of a mesh, and the least that any twists break, by trying all."""

import numpy as np
from hypothesis import strategies as st
from meshes_shared import shared_mesh
from strategies import SOLIDS
from weaving_meshes import meshes

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.subdivide.refine import parse_refinements, refine_mesh
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.conditions import TwillConditions, twill_conditions


def conditions_of(mesh: PolyMesh) -> TwillConditions:
    halfedges = build_halfedges(mesh)
    return twill_conditions(halfedges, trace_threads(halfedges))


def real_mesh(name: str) -> PolyMesh:
    return prepare_mesh(read_mesh(shared_mesh(name)).mesh)[0]


def refined(mesh: PolyMesh, text: str) -> PolyMesh:
    return refine_mesh(mesh, parse_refinements(text))


def brute_force(conditions: TwillConditions) -> tuple[int, int]:
    """Return the least number of broken conditions over all twists, and how many reach it."""
    choices = np.arange(1 << conditions.n_crossings)
    twist = (choices >> np.arange(conditions.n_crossings)[:, None]) & 1 == 1
    broken = np.zeros(len(choices), dtype=np.int64)
    for first, last in conditions.edge:
        broken += twist[first] == twist[last]
    for a, b, c, d in conditions.gaps:
        broken += (twist[b] != twist[c]) & (twist[a] != twist[d])
    return int(broken.min()), int(np.count_nonzero(broken == broken.min()))


def small_meshes() -> st.SearchStrategy[PolyMesh]:
    """Give meshes of at most 18 edges of every kind: closed and open, any genus up to 1."""
    surfaces = st.one_of(
        meshes(),
        st.sampled_from(SOLIDS).map(lambda solid: solid()),
        st.tuples(st.integers(3, 4), st.integers(3, 3)).map(
            lambda mn: grids.torus(*mn, 35.0, 15.0)
        ),
        st.tuples(st.integers(1, 4), st.integers(1, 3)).map(
            lambda mn: grids.hypar(*mn, 100.0, 40.0)
        ),
        st.tuples(st.integers(3, 5), st.integers(1, 3)).map(lambda mn: grids.tube(*mn, 20.0, 40.0)),
    )
    return surfaces.filter(lambda mesh: 0 < conditions_of(mesh).n_crossings <= 18)
