"""A weave of one's own: which way every edge is twisted, in a list that is read and written."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import fabweave as fw
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads
from fabweave.weave.weave_pattern import HEAD, read_twists, twisted_weave, twists_text

pytestmark = pytest.mark.usefixtures("quick_jobs")

HALFEDGES = build_halfedges(parse_shape("shape:torus?m=6&n=4"))
THREADS = trace_threads(HALFEDGES)


@given(st.lists(st.booleans(), min_size=48, max_size=48), st.randoms())
def test_what_is_written_is_read_again_in_any_order(twist, shuffle):
    weave = twisted_weave(HALFEDGES, THREADS, np.array(twist))
    head, *lines = twists_text(HALFEDGES, weave).splitlines()
    assert head == HEAD
    assert len(lines) == THREADS.n_crossings == 48
    shuffle.shuffle(lines)
    assert read_twists("\n".join(lines).encode(), HALFEDGES, THREADS).tolist() == twist


def test_plain_weave_is_where_nothing_is_said_and_alternates():
    twist = read_twists(b"", HALFEDGES, THREADS)
    assert np.array_equal(twist, plain_weave(THREADS).twist)
    # Flipping one edge turns over and under at its crossing about, and nowhere else.
    first = THREADS.crossing_halfedge[5]
    line = f"{HALFEDGES.head[first]},{HALFEDGES.tail[first]},-1"
    twist = read_twists(line.encode(), HALFEDGES, THREADS)
    flipped = twisted_weave(HALFEDGES, THREADS, twist)
    changed = THREADS.crossing[flipped.over != plain_weave(THREADS).over]
    assert changed.tolist() == [5, 5]


@pytest.mark.parametrize(
    ("lines", "error"),
    [
        ("0,one,1", InputError),
        ("0,13,1", InputError),
        ("0,1,1\n1,0,1", InputError),
        ("0,1,3", CannotMakeError),
        ("0,1,1\n" * 200, InputError),
        ("\xff,1,1", InputError),
    ],
)
def test_what_is_no_list_is_refused_with_its_line(lines, error):
    halfedges = build_halfedges(parse_shape("shape:tetrahedron"))
    with pytest.raises(error):
        read_twists(lines.encode("latin-1"), halfedges, trace_threads(halfedges))


@pytest.mark.slow
def test_a_twill_written_down_is_made_and_proved_and_a_turned_crossing_is_found(tmp_path):
    mesh = fw.shape("torus?m=6&n=4", size="300mm")
    twill = fw.weave(mesh, pattern="twill")
    path = tmp_path / "edges.csv"
    path.write_text(twists_text(twill.woven.halfedges, twill.woven.weave))
    again = fw.weave(mesh, twists=str(path))
    assert np.array_equal(again.woven.weave.over, twill.woven.weave.over)
    folder = tmp_path / "job"
    assert fw.make(
        "shape:torus?m=6&n=4", folder, size="300mm", twists=str(path), effort="quick", force=True
    )
    plan = json.loads((folder / "crossing_map.json").read_text())
    assert plan["weave"]["pattern"] == "twists"
    assert plan["weave"]["exact"]
    plan["weave"]["broken"]["edge"] = 2
    (folder / "crossing_map.json").write_text(json.dumps(plan))
    assert "pattern" in fw.verify(folder).failed
