"""Plain weave, over and under, bunches and labels."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from weaving_meshes import meshes

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.weave.pattern import over_of_passes, plain_weave
from fabweave.weave.threads import ALPHABET, thread_labels, trace_threads


@given(meshes(), st.booleans())
def test_plain_weave_alternates_and_every_crossing_has_one_strand_on_top(mesh, turn):
    weave = plain_weave(trace_threads(build_halfedges(mesh), turn=turn))
    threads = weave.threads
    assert np.array_equal(np.sort(threads.crossing[weave.over]), np.arange(threads.n_crossings))
    for thread in range(threads.n_threads):
        over = weave.over[threads.offsets[thread] : threads.offsets[thread + 1]]
        assert np.all(over[1:] != over[:-1])
        if threads.closed[thread] and len(over):
            assert over[0] != over[-1]


def test_a_counter_clockwise_edge_takes_its_left_strand_over():
    # Two triangles side by side, the shared edge pointing up. Seen from outside (+z), the strand
    # that starts at the lower left and leaves at the upper right arrives forward.
    mesh = PolyMesh.from_faces(
        [[0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]], [[0, 1, 2], [1, 0, 3]]
    )
    threads = trace_threads(build_halfedges(mesh))
    assert threads.n_crossings == 1
    forward = threads.forward
    assert np.array_equal(over_of_passes(threads, np.array([True])), forward)
    assert np.array_equal(over_of_passes(threads, np.array([False])), ~forward)


@given(st.integers(1, 3000))
def test_labels_are_distinct_and_free_of_look_alikes(count):
    labels = thread_labels(count)
    assert len(set(labels)) == count
    assert set("".join(labels)) <= set(ALPHABET)
    assert not set("IOQ") & set("".join(labels))
