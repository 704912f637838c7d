"""A ribbon follows its thread's walk where it crosses the edge to the face beyond, the same way."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import meshes

from fabweave.mesh.fair.portals import medial_portals
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.polymesh import PolyMesh
from fabweave.ribbon.project import project_ribbons
from fabweave.verify.measure.walks import Panels, Pass, follows_walk
from fabweave.verify.read.mesh import read_obj
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("mesh") / "mesh.obj"


@given(meshes(), st.floats(0.0, 0.9), st.booleans())
def test_a_ribbon_follows_its_own_walk_and_no_other(path, mesh, slim, straight):
    # Drawn out, both ways across an edge are nearly the same, and quads are not convex.
    mesh = PolyMesh(mesh.vertices * (1.0, 1.0 - slim, 1.0), mesh.offsets, mesh.indices)
    path.write_bytes(obj_bytes(mesh))
    read = read_obj(path)
    halfedges = build_halfedges(mesh)
    weave = plain_weave(trace_threads(halfedges))
    portals = medial_portals(mesh, halfedges) if straight else None
    ribbons = project_ribbons(mesh, halfedges, weave, height_mm=0.0, portals=portals)
    middle = (ribbons.right + ribbons.left) / 2
    along = middle[ribbons.entry + 1] - middle[ribbons.entry]

    sides, forward = weave.threads.halfedge, weave.threads.forward

    def follows(along, sides, forward):
        nothing = np.zeros_like(along)
        passes = tuple(map(Pass, sides.tolist(), forward.tolist()))
        return follows_walk(Panels(nothing, nothing, along), passes, read)

    assert follows(along, sides, forward).all()
    assert not follows(along, sides, ~forward).any()
    assert not follows(-along, sides, forward).any()
    # Walked back it comes from the other side, and from near the same end of that.
    assert follows(-along, read.twin[sides], forward).all()
    assert not follows(np.full_like(along, np.nan), sides, forward).any()
