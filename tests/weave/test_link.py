"""Weaves on spheres as links: known links, and an independent package's opinion."""

import itertools
import re
import warnings
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from strategies import SOLIDS, merged

from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.link import (
    PlanarDiagram,
    TwistedThreads,
    genus_of_bodies,
    pd_text,
    planar_diagram,
    trace_twisted,
)


def writhe(threads: TwistedThreads) -> int:
    return int(threads.signs.sum())


def knot_package():
    """Return the knot-theory package, which only these tests want; skip where it is absent."""
    with warnings.catch_warnings():
        # Its table of links leaves a database open, which newer interpreters mention.
        warnings.simplefilter("ignore", ResourceWarning)
        return pytest.importorskip("spherogram", reason="spherogram is not installed")


def weave_link(mesh: PolyMesh, twists) -> tuple[Halfedges, TwistedThreads, PlanarDiagram]:
    halfedges = build_halfedges(mesh)
    if isinstance(twists, int):
        twists = np.full(halfedges.n_edges, twists)
    threads = trace_twisted(halfedges, twists)
    return halfedges, threads, planar_diagram(halfedges, threads)


def polygon(n: int) -> PolyMesh:
    """Two n-gons back to back: the weave is a ring of bands."""
    angle = np.arange(n) * 2 * np.pi / n
    points = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(n)))
    return PolyMesh.from_faces(points, [list(range(n)), list(range(n))[::-1]])


def pretzel(columns: list[int]) -> tuple[PolyMesh, np.ndarray]:
    """Two vertices joined by one path for each column, of a twisted and an untwisted edge."""
    n = len(columns)
    faces = [[0, 2 + i, 1, 2 + (i + 1) % n] for i in range(n)]
    mesh = PolyMesh.from_faces(np.zeros((n + 2, 3)), faces)
    halfedges = build_halfedges(mesh)
    ends = np.sort(
        np.column_stack((halfedges.tail, halfedges.head))[halfedges.edge_halfedge], axis=1
    )
    twists = np.zeros(halfedges.n_edges, dtype=np.int64)
    at_first = ends[:, 0] == 0
    twists[at_first] = np.array(columns)[ends[at_first, 1] - 2]
    return mesh, twists


def determinant(diagram: PlanarDiagram) -> int:
    """The number of Fox colourings: a minor of the colouring matrix, in exact arithmetic."""
    rows = diagram.crossings.tolist()
    overs: dict[int, int] = {}  # arcs that are one strand over a crossing

    def find(arc: int) -> int:
        while arc in overs:
            arc = overs[arc]
        return arc

    for _, a, _, b in rows:
        if find(a) != find(b):
            overs[find(a)] = find(b)
    names = sorted({find(arc) for row in rows for arc in row})
    number = {name: i for i, name in enumerate(names)}
    matrix = np.zeros((len(rows), len(names)), dtype=object)
    for row, (under, over, out, _) in enumerate(rows):
        matrix[row, number[find(over)]] += 2
        matrix[row, number[find(under)]] -= 1
        matrix[row, number[find(out)]] -= 1
    if len(names) > len(rows):
        return 0  # a component that is never below lies on top of all the rest
    return abs(whole_determinant(matrix[1:, 1:]))


def whole_determinant(matrix: np.ndarray) -> int:
    """Bareiss' elimination: whole numbers throughout."""
    rows = [list(map(int, row)) for row in matrix]
    sign, last = 1, 1
    for k in range(len(rows)):
        pivot = next((i for i in range(k, len(rows)) if rows[i][k]), None)
        if pivot is None:
            return 0
        if pivot != k:
            rows[k], rows[pivot], sign = rows[pivot], rows[k], -sign
        for i in range(k + 1, len(rows)):
            for j in range(k + 1, len(rows)):
                rows[i][j] = (rows[i][j] * rows[k][k] - rows[i][k] * rows[k][j]) // last
        last = rows[k][k]
    return sign * last


def spanning_trees(halfedges: Halfedges) -> int:
    """Count the spanning trees of the mesh's edges (the matrix-tree theorem)."""
    count = int(halfedges.tail.max()) + 1
    laplacian = np.zeros((count, count), dtype=object)
    for half in halfedges.edge_halfedge.tolist():
        a, b = int(halfedges.tail[half]), int(halfedges.head[half])
        laplacian[a, a] += 1
        laplacian[b, b] += 1
        laplacian[a, b] -= 1
        laplacian[b, a] -= 1
    return whole_determinant(laplacian[1:, 1:])


def faces_of_diagram(diagram: PlanarDiagram) -> int:
    """Count the regions by walking round them, from the four-tuples alone."""
    where: dict[int, list[tuple[int, int]]] = {}
    for row, arcs in enumerate(diagram.crossings.tolist()):
        for slot, arc in enumerate(arcs):
            where.setdefault(arc, []).append((row, slot))
    ends = {pair: other for a, b in where.values() for pair, other in ((a, b), (b, a))}
    unseen, count = set(ends), 0
    while unseen:
        count += 1
        at = next(iter(unseen))
        while at in unseen:
            unseen.discard(at)
            row, slot = ends[at]
            at = (row, (slot + 1) % 4)
    return count


def jones(diagram: PlanarDiagram, writhe: int) -> dict[int, int]:
    """Kauffman's state sum: the Jones polynomial as powers of A (t is A to the minus fourth)."""
    rows = (diagram.crossings - 1).tolist()
    bracket: Counter[int] = Counter()
    for choice in itertools.product((0, 1), repeat=len(rows)):
        parent = list(range(2 * len(rows)))

        def find(arc: int, parent: list[int] = parent) -> int:
            while parent[arc] != arc:
                arc = parent[arc]
            return arc

        for (i, j, k, m), b in zip(rows, choice, strict=True):
            # From below, counter-clockwise: the A regions lie to the left of the strand on top.
            for x, y in ((i, m), (j, k)) if b else ((i, j), (k, m)):
                parent[find(x)] = find(y)
        circles = len({find(arc) for arc in range(len(parent))}) + len(diagram.loops)
        # (-A² - A⁻²) to the number of circles less one.
        term = Counter({len(rows) - 2 * sum(choice): 1})
        for _ in range(circles - 1):
            grown: Counter[int] = Counter()
            for power, factor in term.items():
                grown[power + 2] -= factor
                grown[power - 2] -= factor
            term = grown
        for power, factor in term.items():
            bracket[power] += factor
    sign = -1 if writhe % 2 else 1
    return {p - 3 * writhe: sign * f for p, f in bracket.items() if f}


# The rest of this file asserts what theory and tables say.


@pytest.mark.parametrize("solid", SOLIDS)
def test_the_determinant_of_plain_weave_counts_spanning_trees(solid):
    # The mesh is the checkerboard graph of its plain weave.
    halfedges, threads, diagram = weave_link(solid(), 1)
    assert diagram.n_components == threads.n_threads
    assert determinant(diagram) == spanning_trees(halfedges)


def test_the_tetrahedron_weaves_the_borromean_rings():
    _, threads, diagram = weave_link(solids.tetrahedron(), 1)
    assert len(diagram.crossings) == 6
    assert diagram.n_components == 3
    assert not linking(threads).any()
    assert determinant(diagram) == 16
    # From the tables: -t⁻³ + 3t⁻² - 2t⁻¹ + 4 - 2t + 3t² - t³, the same for its mirror image.
    table = {-3: -1, -2: 3, -1: -2, 0: 4, 1: -2, 2: 3, 3: -1}
    assert jones(diagram, writhe(threads)) == {-4 * p: f for p, f in table.items()}


def linking(threads: TwistedThreads) -> np.ndarray:
    """Twice the linking number of each pair of threads."""
    matrix = np.zeros((threads.n_threads, threads.n_threads), dtype=np.int64)
    pairs = threads.thread_of_pass[threads.passes]
    np.add.at(matrix, (pairs[:, 0], pairs[:, 1]), threads.signs)
    matrix += matrix.T
    np.fill_diagonal(matrix, 0)
    return matrix


@pytest.mark.parametrize(("n", "sense"), [(n, s) for n in (3, 5, 7) for s in (1, -1)])
def test_rings_of_bands_are_torus_knots(n, sense):
    _, threads, diagram = weave_link(polygon(n), sense)
    assert (diagram.n_components, determinant(diagram)) == (1, n)
    # With an even number of half-twists there are two rings, linked n times.
    _, rings, linked = weave_link(polygon(n), [sense] * (n - 1) + [0])
    assert (np.abs(linking(rings)) == (n - 1) * (1 - np.eye(2))).all()
    assert determinant(linked) == n - 1
    # (2, n) torus knots: the right-handed one has t^((n-1)/2) (1 - t^3 - t^(n+1) + t^(n+2))
    # over (1 - t^2); multiplied out it is t^k + t^(k+2) - t^(k+3) + … with k = (n - 1)/2.
    k = (n - 1) // 2
    expected = {k: 1, **{k + 1 + i: (-1) ** (i + 1) for i in range(1, n)}}
    assert jones(diagram, writhe(threads)) == {-4 * sense * p: f for p, f in expected.items()}


def test_opposite_twists_undo_one_another():
    _, threads, diagram = weave_link(polygon(3), [2, -1, 0])
    assert jones(diagram, writhe(threads)) == {0: 1}  # a twisted unknot of three crossings


@pytest.mark.parametrize("solid", SOLIDS)
def test_untwisted_edges_give_unlinked_rings_and_each_twist_joins(solid):
    mesh = solid()
    halfedges, _, diagram = weave_link(mesh, 0)
    assert diagram.loops.tolist() == list(range(mesh.n_faces))
    assert pd_text(diagram).count("Loop") == mesh.n_faces
    twists = np.zeros(halfedges.n_edges, dtype=np.int64)
    twists[0] = 1
    _, threads, joined = weave_link(mesh, twists)
    assert joined.n_components == mesh.n_faces - 1
    assert len(joined.loops) == mesh.n_faces - 2
    # All rings apart: (-A² - A⁻²) to one less than their number.
    count = threads.n_threads
    value = jones(joined, writhe(threads))
    assert sum(value.values()) == (-2) ** (count - 1)
    assert max(value) == 2 * (count - 1)


@st.composite
def links(draw: st.DrawFn):
    """Give weaves on spheres with any mixture of twists."""
    mesh = draw(st.one_of(
        st.sampled_from(SOLIDS).map(lambda solid: solid()),
        st.integers(1, 2).map(lambda n: grids.sphere(n, 50.0)),
        st.integers(3, 6).map(polygon),
    ))  # fmt: skip
    most = draw(st.integers(0, 3))
    count = build_halfedges(mesh).n_edges
    twists = np.random.default_rng(draw(st.integers(0, 2**32 - 1))).integers(-most, most + 1, count)
    return weave_link(mesh, twists)


@given(links())
def test_diagrams_are_planar_and_each_arc_has_two_ends(link):
    _, threads, diagram = link
    count = len(diagram.crossings)
    assert count == threads.n_crossings
    arcs = np.sort(diagram.crossings, axis=None)
    assert np.array_equal(arcs, np.repeat(np.arange(1, 2 * count + 1), 2))
    # Euler's formula, body by body of the diagram: X - 2X + F = 2 each.
    row = np.argsort(diagram.crossings, axis=None, kind="stable") // 4
    joined = coo_array((np.ones(2 * count), (row[::2], row[1::2])), shape=(count, count))
    parts = connected_components(joined, directed=False)[0] if count else 0
    assert faces_of_diagram(diagram) == count + 2 * parts


# From here an independent package reads the diagram.


def packaged(diagram: PlanarDiagram):
    return knot_package().Link([tuple(row) for row in diagram.crossings.tolist()])


@settings(max_examples=40, deadline=None)
@given(links())
def test_the_package_counts_the_same_components_and_linking_numbers(link):
    _, threads, diagram = link
    if not len(diagram.crossings):
        return
    theirs = packaged(diagram)
    assert theirs.is_planar()
    arcs = np.arange(1, 2 * threads.n_crossings + 1)
    assert np.array_equal(np.sort(diagram.crossings, axis=None), np.repeat(arcs, 2))
    assert len(theirs.link_components) == threads.n_threads - len(diagram.loops)
    own = Counter(np.abs(linking(threads)[np.triu_indices(threads.n_threads, 1)] // 2).tolist())
    others = Counter(
        abs(int(x)) for row, line in enumerate(theirs.linking_matrix()) for x in line[row + 1 :]
    )
    own.pop(0, None)
    others.pop(0, None)
    assert own == others
    if threads.n_threads == 1:
        assert theirs.writhe() == writhe(threads)


@pytest.mark.parametrize("mesh", [*(solid() for solid in SOLIDS), grids.sphere(3, 50.0)])
def test_the_package_finds_plain_weaves_alternating(mesh):
    halfedges, _, diagram = weave_link(mesh, 1)
    assert packaged(diagram).is_alternating()
    assert len(packaged(diagram).crossings) == halfedges.n_edges
    twists = np.ones(halfedges.n_edges, dtype=np.int64)
    twists[0] = -1
    assert not packaged(weave_link(mesh, twists)[2]).is_alternating()
    # With two sides exchanged the diagram is none of a sphere.
    spoiled = diagram.crossings.copy()
    spoiled[0, [1, 3]] = spoiled[0, [3, 1]]
    with pytest.raises(ValueError, match="planar"):
        packaged(replace(diagram, crossings=spoiled))


def test_the_package_finds_the_pretzel_knot_with_a_lens_space_surgery():
    # P(-2, 3, 7): genus 5, fibred, Alexander polynomial of Lehmer; one half-twist off it is not.
    homology = pytest.importorskip("knot_floer_homology", reason="it is not installed")
    mesh, twists = pretzel([-2, 3, 7])
    _, threads, diagram = weave_link(mesh, twists)
    assert (threads.n_threads, threads.n_crossings) == (1, 12)
    found = homology.pd_to_hfk([list(row) for row in diagram.crossings.tolist()])
    assert (found["seifert_genus"], found["fibered"], found["L_space_knot"]) == (5, True, True)
    euler: Counter[int] = Counter()
    for (alexander, maslov), rank in found["ranks"].items():
        euler[alexander] += rank * (-1) ** maslov
    lehmer = [1, -1, 0, 1, -1, 1, -1, 1, 0, -1, 1]
    assert [euler[power] for power in range(-5, 6)] in (lehmer, [-x for x in lehmer])
    assert determinant(diagram) == abs(-2 * 3 + 3 * 7 - 2 * 7)
    mesh, twists = pretzel([-2, 3, 5])
    _, _, torus_knot = weave_link(mesh, twists)
    found = homology.pd_to_hfk([list(row) for row in torus_knot.crossings.tolist()])
    assert (found["seifert_genus"], determinant(torus_knot)) == (4, 1)


@pytest.mark.parametrize("columns", [[1, 1, 1], [3, 5, 7], [-3, 5, 7], [2, 3, 3], [1, -1, 3]])
def test_pretzel_links_have_their_determinants(columns):
    mesh, twists = pretzel(columns)
    _, threads, diagram = weave_link(mesh, twists)
    p, q, r = columns
    assert determinant(diagram) == abs(p * q + q * r + p * r)
    assert threads.n_threads == max(1, sum(x % 2 == 0 for x in columns))


def test_a_knot_of_the_mesh_is_read_by_the_package():
    homology = pytest.importorskip("knot_floer_homology", reason="it is not installed")
    # The homology of an alternating knot has as much rank as its determinant.
    for n in (3, 5, 7):
        halfedges, threads, diagram = weave_link(polygon(n), 1)
        found = homology.pd_to_hfk(diagram.crossings.tolist())
        assert found["total_rank"] == spanning_trees(halfedges) == n
        assert found["tau"] == (n - 1) // 2 * np.sign(writhe(threads))


# What cannot be drawn, and how it is written.


def test_handles_and_boundaries_are_refused_in_words():
    both = merged(solids.cube(), grids.torus(4, 3, 35.0, 15.0))
    assert genus_of_bodies(build_halfedges(both)).tolist() == [0, 1]
    with pytest.raises(CannotMakeError, match="genus 1"):
        weave_link(both, 1)
    with pytest.raises(CannotMakeError, match="10 boundary edges"):
        weave_link(grids.tube(5, 2, 10.0, 10.0), 0)


def test_bodies_lie_apart():
    _, threads, diagram = weave_link(merged(solids.tetrahedron(), polygon(3)), 1)
    assert diagram.n_components == threads.n_threads == 3 + 1
    assert faces_of_diagram(diagram) == 9 + 2 * 2
    assert determinant(diagram) == 0  # a split link


@given(links())
def test_the_text_holds_the_diagram(link):
    _, _, diagram = link
    text = pd_text(diagram)
    rows = [list(map(int, row.split(","))) for row in re.findall(r"X\[([^\]]*)\]", text)]
    loops = re.findall(r"Loop\[(\d+)\]", text)
    assert rows == diagram.crossings.tolist()
    count = 2 * len(rows)
    assert list(map(int, loops)) == [count + 1 + n for n in range(len(diagram.loops))]
