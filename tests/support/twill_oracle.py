"""The conditions of a mesh, and the least that any twists break, by trying all."""

import numpy as np
from hypothesis import strategies as st
from strategies import SOLIDS
from weaving_meshes import meshes, walked

from fabweave.core.arrays import IntArray
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.mesh.topology import solve_parity
from fabweave.weave.twill.conditions import TwillConditions, count_broken, twill_conditions
from fabweave.weave.twill.decide import Decision


def conditions_of(mesh: PolyMesh) -> TwillConditions:
    return twill_conditions(*walked(mesh))


def refined(mesh: PolyMesh, text: str) -> PolyMesh:
    return refine_mesh(mesh, parse_refinements(text))


def broken_by_all(conditions: TwillConditions) -> IntArray:
    """Return how many conditions each choice of all twists breaks."""
    choices = np.arange(1 << conditions.n_crossings)
    twist = (choices >> np.arange(conditions.n_crossings)[:, None]) & 1 == 1
    broken = np.zeros(len(choices), dtype=np.int64)
    for first, last in conditions.edge:
        broken += twist[first] == twist[last]
    for a, b, c, d in conditions.gaps:
        broken += (twist[b] != twist[c]) & (twist[a] != twist[d])
    return broken


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
        st.integers(3, 4).map(lambda m: grids.torus(m, 3, 35.0, 15.0)),
        st.tuples(st.integers(1, 4), st.integers(1, 3)).map(
            lambda mn: grids.hypar(*mn, 100.0, 40.0)
        ),
        st.tuples(st.integers(3, 5), st.integers(1, 3)).map(lambda mn: grids.tube(*mn, 20.0, 40.0)),
    )
    return surfaces.filter(lambda mesh: 0 < conditions_of(mesh).n_crossings <= 18)
