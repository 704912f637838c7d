"""The check against theory, against meshes that are wrong in known ways, and against anything."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes_shared import mesh_params
from strategies import (
    any_meshes,
    broken_meshes,
    closed_surfaces,
    klein_bottle,
    merged,
    moebius_strip,
    open_surfaces,
    shuffled,
    with_flips,
)

from fabweave.core.errors import InputError
from fabweave.mesh.check import check_mesh, component_genus
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.prepare import prepare_mesh
from fabweave.mesh.shapes import grids, solids


@pytest.mark.parametrize("known", mesh_params())
def test_real_mesh_is_what_the_table_says(known):
    mesh = read_mesh(known.path).mesh
    report = check_mesh(mesh)
    for name in ("n_vertices", "n_edges", "n_faces", "face_sizes", "n_components",
                 "n_boundary_loops", "manifold", "oriented"):  # fmt: skip
        assert getattr(report, name) == getattr(known, name)
    assert report.genus == (None if known.genus is None else sum(known.genus))
    assert known.genus in (None, report.component_genus)
    fatal = {finding.rule for finding in report.fatal}
    assert fatal == REFUSED.get(known.name, set())
    if fatal:
        with pytest.raises(InputError, match=r"cannot be woven:\n  - \d+ "):
            prepare_mesh(mesh)
        return
    prepared, after, _ = prepare_mesh(mesh)
    assert (after.fatal, after.oriented) == ((), True)
    assert known.bad or after.findings == ()
    assert build_halfedges(prepared).n_edges == known.n_edges


REFUSED = {
    "bad/catmark_nonman_edges.obj": {"non-manifold-edge", "repeated-vertex"},
    "bad/catmark_val2_back2back.obj": {"duplicate-face"},
    "bad/moebius.obj": {"non-orientable"},
    "bad/nonmanifold_edge.obj": {"non-manifold-edge"},
    "bad/test-nan.obj": {"not-finite"},
}


@given(closed_surfaces(), st.integers(0, 2**32))
def test_closed_surface_has_its_genus_however_it_is_numbered(surface, seed):
    mesh, genus = surface
    report = check_mesh(shuffled(mesh, seed))
    assert report.euler == report.n_vertices - report.n_edges + report.n_faces == 2 - 2 * genus
    assert report.component_genus == (genus,)
    assert (report.closed, report.manifold, report.oriented, report.orientable) == (True,) * 4
    assert report.findings == ()


@given(open_surfaces(), st.integers(0, 2**32))
def test_open_surface_has_its_loops(surface, seed):
    mesh, loops = surface
    report = check_mesh(shuffled(mesh, seed))
    assert report.n_boundary_loops == loops
    assert report.component_genus == (0,)
    assert not report.closed
    assert report.rules <= {"lone-face"}


@pytest.mark.parametrize("n", [3, 4, 7, 20])
def test_moebius_strip_is_one_sided(n):
    report = check_mesh(moebius_strip(n))
    assert not report.orientable
    assert not report.oriented
    assert report.manifold
    assert (report.euler, report.n_boundary_loops, report.genus) == (0, 1, None)
    (finding,) = report.fatal
    assert finding.rule == "non-orientable"
    assert finding.text.startswith(f"{n} faces belong")


@given(st.integers(3, 7), st.integers(3, 7), st.integers(0, 2**32))
def test_klein_bottle_is_one_sided_and_closed(m, n, seed):
    report = check_mesh(shuffled(klein_bottle(m, n), seed))
    assert (report.euler, report.closed, report.orientable) == (0, True, False)
    assert report.manifold
    assert report.genus is None


@given(closed_surfaces(), st.data())
def test_flipped_faces_are_found_and_turned_back(surface, data):
    mesh, genus = surface
    flips = data.draw(st.lists(st.booleans(), min_size=mesh.n_faces, max_size=mesh.n_faces))
    flipped = with_flips(mesh, flips)
    report = check_mesh(flipped)
    assert report.orientable
    assert report.component_genus == (genus,)
    assert report.oriented == (len(set(flips)) == 1)
    if not report.oriented:
        assert report.rules == {"inconsistent-orientation"}
    prepared, after, notes = prepare_mesh(flipped)
    assert after.findings == ()
    # Outward again, whatever the majority was: exactly the faces that we began with.
    assert [sorted_cycle(f) for f in prepared.faces()] == [sorted_cycle(f) for f in mesh.faces()]
    assert bool(notes) == any(flips)


def sorted_cycle(face):
    start = face.index(min(face))
    return face[start:] + face[:start]


@given(open_surfaces(), st.data())
def test_majority_of_an_open_component_keeps_its_direction(surface, data):
    mesh, _ = surface
    flips = data.draw(st.lists(st.booleans(), min_size=mesh.n_faces, max_size=mesh.n_faces))
    wanted = mesh
    if 2 * sum(flips) > mesh.n_faces:
        wanted = with_flips(mesh, [True] * mesh.n_faces)
    prepared, _, _ = prepare_mesh(with_flips(mesh, flips))
    if 2 * sum(flips) != mesh.n_faces:
        assert [sorted_cycle(f) for f in prepared.faces()] == [
            sorted_cycle(f) for f in wanted.faces()
        ]
    assert check_mesh(prepared).oriented


def test_inward_body_is_turned_and_named_even_far_from_the_origin():
    inward = with_flips(solids.cube(), [True] * 6)
    far = inward.with_vertices(inward.vertices + 1e6)
    prepared, _, (note,) = prepare_mesh(merged(solids.tetrahedron(), far))
    assert "face 4, 5, 6, 7, 8 and 1 more" in note
    assert [sorted_cycle(f) for f in prepared.faces()[4:]] == [
        sorted_cycle([v + 4 for v in f]) for f in solids.cube().faces()
    ]


def test_two_spheres_glued_at_a_vertex():
    ball = grids.sphere(3, 1.0)
    other = ball.with_vertices(ball.vertices + np.array([3.0, 0, 0]))
    both = merged(ball, other)
    indices = both.indices.copy()
    indices[indices == ball.n_vertices] = 0
    mesh = PolyMesh(both.vertices, both.offsets, indices)
    report = check_mesh(mesh)
    (finding,) = (item for item in report.findings if item.rule == "non-manifold-vertex")
    assert (finding.where, finding.level) == ("vertex 0", "with care")
    assert report.edge_manifold
    assert not report.vertex_manifold
    assert report.n_components == 1
    assert report.genus is None
    assert "unreferenced-vertex" in report.rules
    apart, after, notes = prepare_mesh(mesh)
    assert after.component_genus == (0, 0)
    assert after.n_vertices == 2 * ball.n_vertices
    assert any("(vertex 0)" in note for note in notes)
    # The second one's corner is at the end now, where it was.
    assert apart.vertices[-1].tolist() == ball.vertices[0].tolist()


TRIANGLE = [[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


@pytest.mark.parametrize(
    ("vertices", "faces", "code", "where", "fatal"),
    [
        ([*TRIANGLE, [np.nan, 0, 0]], [[0, 1, 2], [1, 3, 2], [0, 4, 1]], "not-finite", (4,), True),
        ([*TRIANGLE, [1e61, 0, 0]], [[0, 1, 2], [1, 3, 2], [0, 4, 1]], "not-finite", (4,), True),
        (TRIANGLE, [[0, 1, 2], [1, 3, 4]], "index-range", (1,), True),
        (TRIANGLE, [[0, 1, 2], [1, 3, -1]], "index-range", (1,), True),
        (TRIANGLE, [[0, 1, 2], [1, 3, 2], []], "small-face", (2,), True),
        (TRIANGLE, [[0, 1, 2], [1, 3, 1, 2]], "repeated-vertex", (1,), True),
        (TRIANGLE, [[0, 1, 3, 2], [0, 2, 1, 3]], "duplicate-face", (1,), True),
        ([*TRIANGLE, [0, 2, 0]], [[0, 1, 2], [2, 4, 0]], "zero-area-face", (1,), False),
        ([*TRIANGLE, [0, 1, 0]], [[0, 1, 2], [1, 4, 2]], "zero-length-edge", (2, 4), False),
        (TRIANGLE, [[0, 1, 2]], "unreferenced-vertex", (3,), False),
        (TRIANGLE, [[0, 1, 2], [1, 2, 3]], "inconsistent-orientation", (1, 2), False),
        ([*TRIANGLE[:3], *TRIANGLE[1:]], [[0, 1, 2], [3, 5, 4]], "open-seam", (1,), False),
        (TRIANGLE, [[0, 1, 2]], "lone-face", (0,), False),
    ],
)
def test_each_problem_is_named_with_its_place(vertices, faces, code, where, fatal):
    mesh = PolyMesh.from_faces(vertices, faces)
    report = check_mesh(mesh)
    (finding,) = [item for item in report.findings if item.rule == code]
    assert re.match(rf"(vertex|edge|face) {'–'.join(map(str, where))}(?!\d)", finding.where)
    assert finding.level == ("not makeable" if fatal else "with care")
    assert finding.cure
    assert finding.where in str(finding)
    if fatal:
        with pytest.raises(InputError, match=r"cannot be woven") as caught:
            prepare_mesh(mesh)
        assert str(finding) in str(caught.value)
    else:
        prepare_mesh(mesh)


@given(closed_surfaces())
def test_no_false_alarm_on_good_meshes_scaled_to_extremes(surface):
    mesh, _ = surface
    for factor in (1e-9, 1e9):
        assert check_mesh(mesh.with_vertices(mesh.vertices * factor)).findings == ()


def test_loose_vertices_are_dropped_even_if_they_are_no_numbers():
    vertices = [[np.nan] * 3, *TRIANGLE, [np.inf, 0, 0]]
    prepared, report, notes = prepare_mesh(PolyMesh.from_faces(vertices, [[1, 2, 3], [2, 4, 3]]))
    assert prepared.vertices.tolist() == TRIANGLE
    assert prepared.faces() == [[0, 1, 2], [1, 3, 2]]
    assert report.findings == ()
    assert notes == ("2 vertices belong to no face and were left out",)


@pytest.mark.parametrize(("euler", "loops"), [(3, 0), (1, 0), (0, 1), (2, 1)])
def test_euler_check_objects_to_counts_that_no_surface_has(euler, loops):
    genus, wrong = component_genus(np.array([2, euler]), np.array([0, loops]), np.array([True] * 2))
    assert genus == (0, None)
    assert wrong.tolist() == [1]


@settings(max_examples=200)
@given(st.one_of(broken_meshes(), any_meshes()))
def test_any_content_gives_a_report_and_never_contradicts_euler(mesh):
    report = check_mesh(mesh)
    assert "euler" not in report.rules
    assert sum(number for _, number in report.face_sizes) == report.n_faces == mesh.n_faces
    assert all(int(item.text.split()[0]) > 0 and item.where for item in report.findings)
    try:
        prepared, after, _ = prepare_mesh(mesh)
    except InputError:
        assert report.fatal or not mesh.n_faces
    else:
        assert not report.fatal
        assert after.oriented
        assert not after.fatal
        assert build_halfedges(prepared).n_edges == after.n_edges


def edge_dictionary(mesh):
    """Count faces along each edge the slow way."""
    along = {}
    for face in mesh.faces():
        for a, b in zip(face, face[1:] + face[:1], strict=True):
            along.setdefault((min(a, b), max(a, b)), []).append((a, b))
    return along


@given(
    st.lists(
        st.lists(st.integers(0, 6), min_size=3, max_size=5, unique=True), min_size=1, max_size=9
    )
)
def test_properties_agree_with_a_slow_independent_count(faces):
    mesh = PolyMesh.from_faces(np.random.default_rng(0).normal(size=(7, 3)), faces)
    report = check_mesh(mesh)
    along = edge_dictionary(mesh)
    assert report.n_edges == len(along)
    assert report.edge_manifold == all(len(sides) <= 2 for sides in along.values())
    assert report.oriented == all(
        len(sides) != 2 or sides[0] != sides[1] for sides in along.values()
    )
    sets = [frozenset(face) for face in faces]
    assert ("duplicate-face" in report.rules) == (len(set(sets)) < len(sets))
    fans = {vertex: fan_count(mesh, vertex) for vertex in range(7)}
    assert report.vertex_manifold == all(number <= 1 for number in fans.values())


def fan_count(mesh, vertex):
    """Merge the faces at a vertex that share an edge there, one by one."""
    groups = []
    for face in mesh.faces():
        if vertex in face:
            k = face.index(vertex)
            ends = {face[k - 1], face[(k + 1) % len(face)]}
            touching = [group for group in groups if group & ends]
            groups = [group for group in groups if not group & ends]
            groups.append(ends.union(*touching))
    return len(groups)
