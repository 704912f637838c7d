"""The built-in shapes: counts, outward faces, exact places; and wrong names and values."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.errors import InputError
from fabweave.mesh.check import check_mesh
from fabweave.mesh.shapes.catalogue import SHAPES, parse_shape

# V, E, F, genus, loops of each shape as functions of its counts.
COUNTS = {
    "tetrahedron": lambda: (4, 6, 4, 0, 0),
    "cube": lambda n: (6 * n * n + 2, 12 * n * n, 6 * n * n, 0, 0),
    "octahedron": lambda: (6, 12, 8, 0, 0),
    "icosahedron": lambda: (12, 30, 20, 0, 0),
    "dodecahedron": lambda: (20, 30, 12, 0, 0),
    "torus": lambda m, n: (m * n, 2 * m * n, m * n, 1, 0),
    "sphere": lambda n: (6 * n * n + 2, 12 * n * n, 6 * n * n, 0, 0),
    "tube": lambda m, n: (m * (n + 1), m * (2 * n + 1), m * n, 0, 2),
    "hemisphere": lambda n: (12 * n * n + 4 * n + 1, 24 * n * n + 4 * n, 12 * n * n, 0, 1),
    "hypar": lambda m, n: ((m + 1) * (n + 1), m * (n + 1) + n * (m + 1), m * n, 0, 1),
    "slit": lambda genus, _m, _n, _slit: quads(2 * 32 * 8, genus),
    "cage": lambda _faces, _m, n: quads(24 * n * n, 13),
    "bipyramid": lambda n, edge, handle: quads(6 * n * edge * handle, 2 * n),
    "regular": lambda _face, _valence, genus, _refine: quads(2 * 32 * 8, genus),
}


def quads(count, genus):
    """Return what Euler's formula says of a closed surface of quads."""
    return (count + 2 - 2 * genus, 2 * count, count, genus, 0)


def counts_of(report):
    surface = report.n_vertices, report.n_edges, report.n_faces
    return (*surface, report.genus, report.n_boundary_loops)


@pytest.mark.parametrize("name", ["torus", "tube", "hypar"])
@given(m=st.integers(3, 15), n=st.integers(3, 15))
def test_counts_of_grids(name, m, n):
    report = check_mesh(parse_shape(f"shape:{name}?m={m}&n={n}"))
    assert counts_of(report) == COUNTS[name](m, n)
    assert report.face_sizes == ((4, m * n),)
    assert report.findings == ()


@pytest.mark.parametrize("name", ["sphere", "hemisphere"])
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_counts_of_spheres(name, n):
    mesh = parse_shape(f"shape:{name}?n={n}&radius=7")
    report = check_mesh(mesh)
    assert counts_of(report) == COUNTS[name](n)
    assert report.rules == set()
    assert np.linalg.norm(mesh.vertices, axis=1) == pytest.approx(np.full(mesh.n_vertices, 7.0))
    valences = np.bincount(mesh.indices)
    if name == "sphere":
        assert np.count_nonzero(valences == 3) == 8
        assert np.count_nonzero(valences == 4) == mesh.n_vertices - 8
    else:
        assert mesh.vertices[:, 2].min() == 0
        assert np.count_nonzero(mesh.vertices[:, 2] == 0) == 8 * n
        assert outward(mesh) > 0


def outward(mesh):
    """Return the least cosine between a quad's normal and the way out from the origin."""
    points = mesh.vertices[mesh.indices.reshape(-1, 4)]
    normal = np.cross(points[:, 2] - points[:, 0], points[:, 3] - points[:, 1])
    centre = points.mean(axis=1)
    scale = np.linalg.norm(normal, axis=1) * np.linalg.norm(centre, axis=1)
    return (np.einsum("ij,ij->i", normal, centre) / scale).min()


@pytest.mark.parametrize(
    ("name", "edge"),
    [
        ("tetrahedron", 2 * 2**0.5),
        ("cube", 2.0),
        ("octahedron", 2**0.5),
        ("icosahedron", 4 / (1 + 5**0.5)),
        ("dodecahedron", 4 / (3 + 5**0.5)),
    ],
)
def test_solids_are_regular(name, edge):
    mesh = parse_shape(f"shape:{name}?size=2")
    for face in mesh.faces():
        points = mesh.vertices[face]
        sides = np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1)
        assert sides == pytest.approx(np.full(len(face), edge))
    radii = np.linalg.norm(mesh.vertices, axis=1)
    assert radii == pytest.approx(np.full(len(radii), radii[0]))


@pytest.mark.parametrize(
    "text",
    [
        "torus",
        "shape:blob",
        "shape:",
        "shape:torus?k=3",
        "shape:torus?",
        "shape:torus?m=3&m=4",
        "shape:torus?m=2001",
        "shape:torus?m=1_0",
        "shape:torus?tube=40",
        "shape:sphere?radius=nan",
        "shape:slit?genus=0",
        "shape:slit?m=9&n=5",
        "shape:slit?genus=5&m=12",
        "shape:knot?p=2&q=3",
        "shape:bipyramid?height=200",
        "shape:regular?face=6",
        "shape:regular?face=16&genus=3",
        "shape:regular?face=8&valence=8&genus=4",
        "shape:regular?face=8&valence=12&genus=5",
        "shape:cage?faces=5",
        "shape:cage?m=5&n=6",
        "shape:regular?face=4&genus=2",
    ],
)
def test_what_cannot_be_built_is_refused(text):
    with pytest.raises(InputError):
        parse_shape(text)


@given(st.text(max_size=30))
def test_any_description_gives_a_mesh_or_an_input_error(text):
    for head in ("shape:", "shape:cube?size=", "shape:torus?m="):
        try:
            assert parse_shape(head + text).n_faces > 0
        except InputError as error:
            assert "shape" in str(error)  # noqa: PT017 -- either is right


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_every_bound_can_be_built(shape):
    least = {item.name: f"{item.least:g}" for item in shape.parameters if item.whole}
    assert check_mesh(shape.make(least)).fatal == ()
    assert shape.text
    assert all(item.text and item.least <= item.default <= item.most for item in shape.parameters)
