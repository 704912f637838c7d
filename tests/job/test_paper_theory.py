"""The theory that figures 5 to 9 of the paper draw holds, and spoiled weaves break it."""

import importlib
import itertools
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from fabweave.core.arrays import unit
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.threads import trace_threads

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(scope="module")
def theory():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLES)
        yield importlib.import_module("paper_theory")


def on_unit_sphere(solid):
    mesh = solid()
    return PolyMesh.from_faces(
        unit(mesh.vertices),
        [mesh.indices[a:b].tolist() for a, b in itertools.pairwise(mesh.offsets)],
    )


def twists_at(halfedges, vertex):
    half = halfedges.edge_halfedge
    return 1 * ((halfedges.tail[half] == vertex) | (halfedges.head[half] == vertex))


def gauss_integral(one, other):
    """Return the linking number of two closed polygons (Klenin, Langowski 2000, method 1a)."""
    a, b = one[:, None], np.roll(one, -1, axis=0)[:, None]
    c, d = other[None], np.roll(other, -1, axis=0)[None]
    sides = [
        unit(np.cross(*pair))
        for pair in ((c - a, d - a), (d - a, d - b), (d - b, c - b), (c - b, c - a))
    ]
    angle = sum(
        np.arcsin(np.clip(np.sum(sides[k] * sides[(k + 1) % 4], axis=2), -1.0, 1.0))
        for k in range(4)
    )
    sign = np.sign(np.sum(np.cross(d - c, b - a) * (c - a), axis=2))
    return np.sum(angle * sign) / (4.0 * np.pi)


def test_face_walks_of_the_octahedron(theory):
    halfedges = build_halfedges(solids.octahedron())
    cases = {8: np.zeros(12, dtype=int), 4: np.ones(12, dtype=int), 6: twists_at(halfedges, 4)}
    for walks, half_twists in cases.items():
        links = np.abs(theory.linking_numbers(halfedges, half_twists))
        assert links.shape == (walks, walks)
        linked = sorted(links[np.triu_indices(walks, 1)].tolist())
        assert linked == {8: [0] * 28, 4: [1] * 6, 6: [0] * 14 + [2]}[walks]


@pytest.mark.parametrize("shape", ["tetrahedron", "cube", "dodecahedron", "torus?m=6&n=4", "cage"])
def test_walks_are_faces_without_twists_and_threads_with_all(theory, shape):
    mesh = parse_shape(f"shape:{shape}")
    halfedges = build_halfedges(mesh)
    for half_twists, walks in (
        (0, mesh.n_faces), (2, mesh.n_faces), (1, trace_threads(halfedges).n_threads),
        (-1, trace_threads(halfedges).n_threads),
    ):  # fmt: skip
        every = np.full(halfedges.n_edges, half_twists)
        assert theory.trace_walks(halfedges, every)[2].max() + 1 == walks


@pytest.mark.slow
@pytest.mark.parametrize("solid", [solids.octahedron, solids.cube])
def test_drawn_rings_are_linked_as_counted(theory, solid):
    mesh = on_unit_sphere(solid)
    halfedges = build_halfedges(mesh)
    draw = np.random.default_rng(5)
    for half_twists in (twists_at(halfedges, 0), *draw.integers(-2, 3, size=(3, 12))):
        rings = theory.boundary(mesh, half_twists)
        counted = theory.linking_numbers(halfedges, half_twists)
        for one, other in itertools.combinations(range(len(rings)), 2):
            drawn = gauss_integral(rings[one], rings[other])
            assert drawn == pytest.approx(counted[one, other], abs=1e-6)


def test_an_edge_crosses_once_for_each_half_twist_left_over_right(theory):
    _, rows = theory.figure_6()
    assert {row["half-twists"] for row in rows} >= {0, 1, 2}
    for row in rows:
        assert row["crossings"] == abs(row["half-twists"])
        assert row["strands"].startswith("swap" if row["half-twists"] % 2 else "keep")
    x = np.linspace(-1.0, 1.0, 11)[:, None]
    strip = theory.Strip(x * (1.0, 0.0, 0.0), 0 * x + (0.0, 1.0, 0.0), 0 * x + (0.0, 0.0, 1.0))
    for half_twists in (1, -1):
        left, right = strip.side(half_twists, 1)[5], strip.side(half_twists, -1)[5]
        assert (left[2] > right[2]) == (half_twists > 0)


@pytest.mark.parametrize(
    "mesh",
    [
        *(grids.hypar(m, n, 1.0, 0.0) for m in (2, 3) for n in (3, 4, 5)),
        *map(parse_shape, ("shape:torus?m=5&n=3", "shape:slit", "shape:sphere?n=3")),
    ],
)
def test_cycles_and_their_parts_are_even(theory, mesh):
    threads = trace_threads(build_halfedges(mesh), turn=True)
    visits = theory.self_crossings(threads)
    assert not np.any(threads.lengths % 2)
    assert not np.any((visits[:, 1] - visits[:, 0] - 1) % 2)
    # The two passes of a crossing, and no others, are at one place.
    assert np.array_equal(*threads.crossing[visits].T)
    met = np.bincount(threads.crossing * threads.n_threads + threads.thread_of_pass)
    assert len(visits) == np.count_nonzero(met == 2)


@pytest.mark.slow
def test_figure_8_counts_self_crossings(theory):
    _, rows = theory.figure_8()
    assert all(row["self-crossings"] for row in rows)
    for row in rows:
        parts = [int(part) for part in row["passes between two visits"].split(", ")]
        assert all(part % 2 == 0 for part in [row["passes of each"], *parts])


def test_each_condition_holds_and_breaks_where_one_edge_is_turned(theory):
    cloth = theory.twill_cloth()
    assert cloth.weave.exact
    conditions, examples = cloth.conditions, cloth.examples()
    first, middle, last = examples["edge"].tolist()
    assert {first, last} in [set(pair) for pair in conditions.edge.tolist()]
    for kind in ("face", "vertex"):
        assert examples[kind].tolist() in getattr(conditions, kind).tolist()
        a, b, c, d = cloth.weave.twist[examples[kind]]
        assert b != c
        assert a == d
    edges = cloth.weave.twist[examples["edge"]]
    assert edges[0] != edges[2]
    assert np.count_nonzero(edges[:-1] == edges[1:]) == 1
    over = ~cloth.warp_on_top[[first, middle, last]]
    assert over.tolist() == [True, True, False]
    for kind, crossings in examples.items():
        for crossing in (crossings[0], crossings[-1]):
            assert getattr(cloth.spoiled(crossing).weave.broken, kind) > 0


@pytest.mark.slow
def test_in_exact_twill_warp_is_on_top_at_one_or_three_of_a_gap(theory):
    cloth = theory.twill_cloth()
    gaps = cloth.conditions.gaps
    assert set(cloth.warp_on_top[gaps].sum(axis=1).tolist()) == {1, 3}
    _, rows = theory.figure_5()
    broken = [sum(row[key] for key in list(row)[2:]) for row in rows]
    assert [count > 0 for count in broken] == [False, True, False, True]


def test_blue_edges_twist_counter_clockwise(theory):
    cloth = theory.twill_cloth()
    crossings = cloth.examples()["face"]
    picture = theory.cloth_picture(cloth, crossings, strands=False, edges=True)
    shown = {colour: count for count, colour in picture.getcolors(picture.width * picture.height)}
    share = shown[theory.BLUE] / (shown[theory.BLUE] + shown[theory.RED])
    assert share == pytest.approx(cloth.weave.twist[crossings].mean(), abs=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("numbers", [["6"], pytest.param(["7", "9"], marks=pytest.mark.slow)])
def test_figures_are_made_alone_with_a_page_and_the_same_each_time(
    numbers, tmp_path, capsys, monkeypatch
):
    monkeypatch.syspath_prepend(EXAMPLES)
    names = [f"figure_0{number}.png" for number in numbers]
    for folder in ("one", "two"):
        arguments = ["make_figures.py", str(tmp_path / folder), *numbers, "--page"]
        monkeypatch.setattr(sys, "argv", arguments)
        runpy.run_path(str(EXAMPLES / "make_figures.py"))
        assert capsys.readouterr().out.split() == names
    assert {path.name for path in (tmp_path / "one").iterdir()} == {"README.md", *names}
    for name in ("README.md", *names):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    page = (tmp_path / "one" / "README.md").read_text("utf-8")
    assert all(name in page for name in names)
