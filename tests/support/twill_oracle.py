"""The conditions of a mesh, and the least that any twists break, by trying all."""

import runpy
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from meshes_shared import shared_mesh
from strategies import SOLIDS
from weaving_meshes import meshes

from fabweave.core.arrays import IntArray
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.subdivide.refine import parse_refinements, refine_mesh
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.conditions import TwillConditions, count_broken, twill_conditions
from fabweave.weave.twill.decide import Decision
from fabweave.weave.twill.parity import solve_parity


def conditions_of(mesh: PolyMesh) -> TwillConditions:
    halfedges = build_halfedges(mesh)
    return twill_conditions(halfedges, trace_threads(halfedges))


def real_mesh(name: str) -> PolyMesh:
    return prepare_mesh(read_mesh(shared_mesh(name)).mesh)[0]


def refined(mesh: PolyMesh, text: str) -> PolyMesh:
    return refine_mesh(mesh, parse_refinements(text))


def slab_with_two_holes() -> PolyMesh:
    """Return the slab that the benchmark measures."""
    benchmark = Path(__file__).parents[1] / "benchmarks" / "bench_twill.py"
    known = runpy.run_path(str(benchmark), run_name="twill")
    slab: PolyMesh = known["block"](known["TWO_HOLES"])
    return slab


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


def proves(conditions: TwillConditions, decision: Decision) -> bool:
    """Check a decision by its certificate alone; clauses by trying all choices of their bits."""
    if decision.twist is not None:
        return count_broken(conditions, decision.twist).total == 0
    if len(decision.contradiction):
        return _is_odd_ring(conditions.edge, decision.contradiction)
    first, last = conditions.edge.T
    linked = solve_parity(conditions.n_crossings, first, last, np.ones(len(first), dtype=bool))
    if linked.odd_ring or not len(decision.clauses):
        return False
    gaps = conditions.gaps[decision.clauses]
    bits, windows = np.unique(linked.classes[gaps], return_inverse=True)
    choices = np.arange(1 << len(bits))
    unbroken = np.ones(len(choices), dtype=bool)
    for window, opposite in zip(windows.reshape(-1, 4), linked.opposite[gaps], strict=True):
        a, b, c, d = (((choices[:, None] >> window) & 1 == 1) ^ opposite).T
        unbroken &= (b == c) | (a == d)
    return not unbroken.any()


def _is_odd_ring(pairs: IntArray, ring: IntArray) -> bool:
    """Return whether a ring of odd length goes along pairs."""
    known = {frozenset(pair) for pair in pairs[np.isin(pairs, ring).all(axis=1)].tolist()}
    steps = zip(ring.tolist(), np.roll(ring, -1).tolist(), strict=True)
    return len(ring) % 2 == 1 and all(frozenset(step) in known for step in steps)


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
