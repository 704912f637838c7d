"""Rings of quads with fans at maxima and polygons at minima have an exact twill, and only so."""

import numpy as np
import pytest
from meshes_shared import FOLDER
from ring_meshes import FAN, POLYGON, ball, chain
from twill_oracle import broken_by_all, conditions_of

from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.twill.conditions import count_broken
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.rows import TWISTS, ring_rows


def exchanged(mesh: PolyMesh) -> PolyMesh:
    """Return a mesh with polygons for its fans, and fans for its polygons."""
    faces, around = mesh.faces(), build_halfedges(mesh)
    valence = np.bincount(around.tail)
    tips = {v for v in range(mesh.n_vertices) if all(len(f) == 3 for f in faces if v in f)}
    fans = [f for f in faces if len(f) == 3 and tips & set(f)]
    polygons = [f for f in faces if f not in fans and (valence[f] % 2 == 1).all()]
    kept = [f for f in faces if f not in fans and f not in polygons]
    for tip in tips:
        after = {}
        for f in fans:
            if tip in f:
                k = f.index(tip)
                after[f[(k + 1) % 3]] = f[(k + 2) % 3]
        ring = [next(iter(after))]
        while len(ring) < len(after):
            ring.append(after[ring[-1]])
        kept.append(ring)
    points = [*mesh.vertices.tolist()]
    for f in polygons:
        points.append(mesh.vertices[f].mean(axis=0).tolist())
        kept += [[f[k - 1], f[k], len(points) - 1] for k in range(len(f))]
    used = sorted({v for f in kept for v in f})
    number = {v: k for k, v in enumerate(used)}
    return PolyMesh.from_faces(np.array(points)[used], [[number[v] for v in f] for f in kept])


def agrees(mesh: PolyMesh) -> bool:
    """Tell whether a mesh has rows that break no condition; where so, decide must agree."""
    halfedges, conditions = build_halfedges(mesh), conditions_of(mesh)
    rows, twillable = ring_rows(halfedges), decide_twill(conditions).twillable
    if rows is None:
        return False
    # On a closed mesh each edge is a crossing, in the order of edges.
    assert twillable
    return count_broken(conditions, TWISTS[rows]).total == 0


@pytest.mark.parametrize("strands", [3, 4, 5, 7, 8])
@pytest.mark.parametrize("rows", [1, 2, 3, 4])
def test_a_ball_with_a_fan_above_and_a_polygon_below_is_exact(strands, rows):
    assert agrees(ball(strands, rows))
    assert agrees(ball(strands, rows, FAN, POLYGON))  # upside down, all roles exchanged


@pytest.mark.parametrize("end", [FAN, POLYGON])
@pytest.mark.parametrize("strands", [5, 7, 8])
@pytest.mark.parametrize("rows", [1, 2, 3])
def test_a_ball_with_ends_alike_is_not(end, strands, rows):
    mesh = ball(strands, rows, end, end)
    assert ring_rows(build_halfedges(mesh)) is None
    assert not decide_twill(conditions_of(mesh)).twillable


@pytest.mark.parametrize(("ends", "exact"), [((POLYGON, FAN), True), ((FAN, FAN), False)])
def test_trying_all_twists_says_the_same(ends, exact):
    assert (broken_by_all(conditions_of(ball(3, 1, *ends))).min() == 0) == exact


@pytest.mark.parametrize("name", ["pole_ball", "goat_rings", "spot_rings"])
def test_trees_with_saddles_are_exact_and_stay_so_with_all_ends_exchanged(name):
    path = FOLDER / "rings" / f"{name}.obj"
    if not path.exists():
        pytest.skip("the shared meshes are not here")
    mesh = read_mesh(path).mesh
    assert agrees(mesh)
    assert agrees(exchanged(mesh))


@pytest.mark.parametrize("ways", [[(2, 2)], [(2, 4)], [(3, 1)], [(2, 2), (3, 5)], [(2, 4)] * 3])
def test_handles_whose_two_ways_differ_by_an_even_number_of_rows_are_exact(ways):
    mesh = chain(ways)
    assert check_mesh(mesh).component_genus == (len(ways),)
    assert agrees(mesh)
    # With one row more on one way around one handle, it is no longer.
    one, other = ways[-1]
    odd = chain([*ways[:-1], (one + 1, other)])
    assert ring_rows(build_halfedges(odd)) is None
    assert not decide_twill(conditions_of(odd)).twillable


@pytest.mark.parametrize(
    ("mesh", "ringed"),
    [
        (grids.torus(6, 4, 2.0, 1.0), True),
        (grids.torus(6, 5, 2.0, 1.0), True),
        (grids.torus(5, 6, 2.0, 1.0), True),
        (grids.torus(5, 7, 2.0, 1.0), False),
        (grids.sphere(4, 1.0), False),
        (solids.cube(), False),
        (solids.octahedron(), False),
    ],
)
def test_tori_need_an_even_way_around_and_irregular_quads_have_no_rows(mesh, ringed):
    assert agrees(mesh) == ringed == decide_twill(conditions_of(mesh)).twillable
