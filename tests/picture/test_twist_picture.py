"""Pictures of a weave on its mesh show every twist and every fault, and no other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import walked

from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide import catmull_clark
from fabweave.picture.camera import View
from fabweave.picture.twist_picture import broken_places, weave_on_mesh
from fabweave.weave.pattern import Weave, over_of_passes
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill

EXACT = ("torus?m=8&n=6", "torus?m=7&n=4", "slit?genus=2", "bipyramid", "tube", "hypar")


def traced(name, steps=0):
    mesh = parse_shape(f"shape:{name}")
    for _ in range(steps):
        mesh = catmull_clark(mesh)
    return mesh, *walked(mesh)


def with_twist(threads, twist):
    return Weave(threads, "given", twist, over_of_passes(threads, twist))


def exact(name):
    mesh, halfedges, threads = traced(name)
    twist = decide_twill(twill_conditions(halfedges, threads)).twist
    return mesh, halfedges, with_twist(threads, twist)


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_twill_has_no_fault_until_a_crossing_is_turned(name):
    mesh, halfedges, weave = exact(name)
    inner = np.ones(mesh.n_faces, dtype=bool)
    inner[halfedges.face[halfedges.twin < 0]] = False
    assert len(broken_places(mesh, halfedges, weave)[0]) == 0
    # One crossing the other way round is seen at once.
    middle = np.flatnonzero(inner[halfedges.face] & (halfedges.twin >= 0))[0]
    edge = halfedges.edge[weave.threads.crossing_halfedge] == halfedges.edge[middle]
    spoiled = with_twist(weave.threads, weave.twist ^ edge)
    assert len(broken_places(mesh, halfedges, spoiled)[0]) >= 4


@given(st.sampled_from(("cube", "octahedron", "torus?m=5&n=4", "hypar")), st.integers(0, 2**32 - 1))
def test_every_broken_condition_has_its_place(name, seed):
    mesh, halfedges, threads = traced(name, steps=1 if name in ("cube", "octahedron") else 0)
    twist = np.random.default_rng(seed).random(threads.n_crossings) < 0.5
    weave = with_twist(threads, twist)
    broken = count_broken(twill_conditions(halfedges, threads), twist)
    points, colours = broken_places(mesh, halfedges, weave)
    _, first, counts = np.unique(colours, axis=0, return_index=True, return_counts=True)
    assert sorted(counts.tolist()) == sorted(
        count for count in (broken.edge, broken.face, broken.vertex) if count
    )
    assert len(first) <= 3
    edge, face, vertex = np.split(points, np.cumsum([broken.edge, broken.face]))
    ends = mesh.vertices[halfedges.tail] + mesh.vertices[halfedges.head]
    centres = [
        mesh.vertices[mesh.indices[low:high]].mean(axis=0)
        for low, high in zip(mesh.offsets[:-1], mesh.offsets[1:], strict=True)
    ]
    for found, places in ((edge, ends / 2), (face, centres), (vertex, mesh.vertices)):
        away = np.linalg.norm(found[:, None] - np.array(places)[None], axis=2)
        assert np.all(away.min(axis=1, initial=np.inf) < 1e-9)


def test_a_face_shows_the_twists_of_its_edges():
    """Seen from above, each edge of a grid is blue or red as it twists, and grey at the rim."""
    mesh, halfedges, threads = traced("hypar?m=3&n=3&height=0.001")
    twist = np.arange(threads.n_crossings) % 2 == 0
    size = (300, 300)
    picture = weave_on_mesh("twists", mesh, halfedges, with_twist(threads, twist), size_px=size,
                            view=View(-90.0, 90.0))  # fmt: skip
    # Around it is the sheet with its caption.
    pixels = np.asarray(picture).astype(int)[12:312, 12:312]
    low, high = mesh.vertices[:, :2].min(axis=0), mesh.vertices[:, :2].max(axis=0)
    sense = {int(halfedges.edge[h]): bool(t)
             for h, t in zip(threads.crossing_halfedge, twist, strict=True)}  # fmt: skip
    for half in range(halfedges.n_halfedges):
        ends = mesh.vertices[[halfedges.tail[half], halfedges.head[half]], :2]
        share = ((ends.mean(axis=0) - low) / (high - low) - 0.5) * 0.9 + 0.5
        edge = int(halfedges.edge[half])
        if edge not in sense:
            continue
        column, row = int(share[0] * 300), int((1 - share[1]) * 300)
        around = pixels[row - 1 : row + 2, column - 1 : column + 2]
        red, _, blue = around.mean(axis=(0, 1))
        assert (blue > red + 60) if sense[edge] else (red > blue + 60)
