"""What makes up for places that get worse moves no more than it must."""

import numpy as np
import pytest

from fabweave.form.compensate import _crossings_between
from fabweave.form.keep_rules import Broken, RuleKeeper
from fabweave.job.stations import Stations

pytestmark = pytest.mark.usefixtures("quick_jobs")

#: A row of margins; a pass; what it needs of one of the vertices beside it; and how far it is off.
ROW, PASS, SLOPE, DOWN_MM = 2, 5, np.array([0.02, 0.0, 0.01]), 20.0


def test_the_least_motion_makes_up_for_a_margin():
    """One margin falls with one vertex: that goes back along its slope, and nothing else moves."""
    woven = Stations.read("shape:torus?m=8&n=6", {"size": "300mm"}).ribbons
    mesh, threads = woven.mesh, woven.weave.threads
    vertex = woven.halfedges.tail[threads.crossing_halfedge[threads.crossing[PASS]]]

    def along(there, down_mm=0.0):
        broken = Broken.__new__(Broken)
        broken.margins = np.full((6, len(threads.crossing)), np.inf)
        moved = there.vertices[vertex] - mesh.vertices[vertex] - [down_mm, 0.0, 0.0]
        broken.margins[ROW, PASS] = 1.2 + moved @ SLOPE
        return broken

    keeper = RuleKeeper(woven, along(mesh), along, _crossings_between(woven), lambda step: step)
    moved = mesh.vertices.copy()
    moved[vertex, 0] -= DOWN_MM
    there = mesh.with_vertices(moved)
    worse = along(there)
    assert worse.worse_than(along(mesh))[ROW, PASS]
    correction = keeper.correction(there, worse)
    mended = along(mesh.with_vertices(moved + correction)).margins[ROW, PASS]
    assert 1.0 <= mended <= 1.01
    alone = np.zeros_like(correction)
    alone[vertex] = SLOPE * (mended - worse.margins[ROW, PASS]) / (SLOPE @ SLOPE)
    assert np.abs(correction - alone).max() < 1e-6 * DOWN_MM
    # What is as good as it was asks for nothing.
    assert not keeper.correction(mesh, along(mesh)).any()


def test_ribbons_that_break_more_rules_are_found():
    """The same shape, a tenth as large, bends more tightly than its material takes."""
    large, small = (
        Broken(one.along, one.ribbons)
        for one in (Stations.read("shape:torus?m=8&n=6", {"size": f"{mm}mm"}) for mm in (300, 30))
    )
    assert large.no_more_than(large)
    assert not large.worse_than(large).any()
    assert large.no_more_than(small)
    assert not small.no_more_than(large)
    assert small.worse_than(large).any()
