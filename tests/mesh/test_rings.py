"""Rings around a model: a field of strands, parted at saddles, closed at tips."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from starfish import starfish

from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.one_rings import irregular_share
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.chart import sheet_of
from fabweave.mesh.remesh.handle_cuts import cut_handles
from fabweave.mesh.remesh.level_cuts import find_saddles, parts_of, saddle_cuts
from fabweave.mesh.remesh.remeshed import check_remeshed
from fabweave.mesh.remesh.rings import remesh_rings
from fabweave.mesh.remesh.strand_flow import LEAST, choose_fluxes, field_of, find_poles, links_of
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.shapes.grids import hemisphere, sphere, torus
from fabweave.mesh.triangulate import triangulate
from fabweave.weave.threads import trace_threads
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.rows import TWISTS, ring_rows

EXAMPLES = Path(__file__).resolve().parents[2] / "examples" / "meshes"


@pytest.fixture(scope="module")
def star() -> PolyMesh:
    return starfish()


def test_all_faces_are_quads_but_at_tips_and_the_weave_is_exact(star):
    made = remesh_rings(star, 250).mesh
    assert check_remeshed(star, made, None) == ()
    assert ring_rows(build_halfedges(made)) is not None
    assert 0.6 * 250 <= made.n_faces <= 1.5 * 250
    # A fan or an opening is one place: far fewer are irregular than vertices around them.
    assert irregular_share(made) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spot", "koala", "goathead", "nefertiti"])
def test_animals_and_heads_have_an_exact_twill(name):
    model = read_mesh(EXAMPLES / f"{name}.obj").mesh
    made = remesh_rings(model, 300).mesh
    halfedges = build_halfedges(made)
    rows = ring_rows(halfedges)
    assert rows is not None
    conditions = twill_conditions(halfedges, trace_threads(halfedges))
    assert count_broken(conditions, TWISTS[rows]).total == 0
    assert decide_twill(conditions).twillable


@pytest.mark.slow
def test_the_same_model_gives_the_same_rings(star):
    one, other = (remesh_rings(star, 200).mesh for _ in range(2))
    assert np.array_equal(one.vertices, other.vertices)
    assert np.array_equal(one.indices, other.indices)


@pytest.mark.parametrize(
    "model", [triangulate(sphere(12, 100.0)), triangulate(hemisphere(12, 100.0))], ids=["", "open"]
)
def test_round_and_open_models_have_rings(model):
    made = remesh_rings(model, 150).mesh
    assert check_remeshed(model, made, None) == ()
    assert ring_rows(build_halfedges(made)) is not None


def test_a_handle_is_cut_around_the_tube_and_a_torus_needs_no_saddle():
    model = triangulate(torus(24, 12, 100.0, 30.0))
    cut, ((one, other),) = cut_handles(model)
    assert check_mesh(cut).component_genus == (0,)
    assert check_mesh(cut).euler == 0
    assert np.array_equal(cut.vertices[one], cut.vertices[other])
    assert not set(one.tolist()) & set(other.tolist())
    # The short way around: no loop along the ring, nor twice around the tube.
    way = cut.vertices[one]
    assert np.linalg.norm(way - np.roll(way, 1, axis=0), axis=1).sum() < 2.2 * np.pi * 30.0
    made = remesh_rings(model, 150).mesh
    assert check_remeshed(model, made, None) == ()
    assert (made.face_sizes == 4).all()
    assert irregular_share(made) == 0
    assert ring_rows(build_halfedges(made)) is not None


@pytest.mark.parametrize("genus", [2, 3])
def test_models_with_handles_have_rings(genus):
    model = triangulate(parse_shape(f"shape:slit?genus={genus}"))
    made = remesh_rings(model, 250).mesh
    assert check_mesh(made).component_genus == (genus,)
    halfedges = build_halfedges(made)
    rows = ring_rows(halfedges)
    assert rows is not None
    conditions = twill_conditions(halfedges, trace_threads(halfedges))
    assert count_broken(conditions, TWISTS[rows]).total == 0


def test_strands_are_whole_and_none_is_lost(star):
    side = 30.0
    sheet = sheet_of(star, positive=True)
    links = links_of(sheet)
    poles = find_poles(sheet, links, [], [], [], side, None)
    assert len(poles.sites) >= 5  # the arms
    field = field_of(sheet, links, poles, side)
    for flux in choose_fluxes(field, 4):
        assert flux.sum() == 0
        assert np.abs(flux[flux != 0]).min() >= LEAST
        height = field.height(flux) + 1e-9 * np.arange(star.n_vertices) / star.n_vertices
        saddles = find_saddles(sheet.halfedges, height, star.n_vertices)
        # Morse: on a sphere there are two more ends than saddles.
        assert len(saddles) == np.count_nonzero(flux) - 2
        parts = parts_of(saddle_cuts(star.vertices, sheet.corners, height, saddles))
        assert len(parts) == 2 * len(saddles) + 1
        # Each part is a tube, or a disc around a tip.
        assert all(check_mesh(part.mesh).euler in (0, 1) for part in parts)
        assert sum(part.mesh.n_faces for part in parts) >= star.n_faces
        inner = [set(part.vertex.tolist()) for part in parts]
        assert all(len(a & b) < len(a) for a, b in combinations(inner, 2))
