"""Rows of rings are proved: that faces have them as rings do, and that they give the twists."""

import numpy as np
import pytest
from sealing import verify_job
from spoiling import put
from verify_specimen import make_specimen, torus
from verify_writers import write_job

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.weave.twill.rows import TWISTS, ring_rows


def ringed(points, faces):
    """Return the rows of a mesh by edge, and its twists as the proof counts them."""
    halfedges = build_halfedges(PolyMesh.from_faces(points, faces))
    first = halfedges.edge_halfedge
    ends = np.sort(np.column_stack([halfedges.tail[first], halfedges.head[first]]), axis=1)
    rows = dict(zip(map(tuple, ends.tolist()), ring_rows(halfedges).tolist(), strict=True))
    return rows, {edge: bool(TWISTS[row]) for edge, row in rows.items()}


@pytest.fixture(scope="module")
def rows_of():
    return ringed(*torus(6, 4))


@pytest.fixture
def plan(rows_of):
    rows, sense = rows_of
    made = make_specimen(torus(6, 4), pattern="twill", sense=sense)
    made.plan["weave"]["rows"] = [rows[tuple(one["edge"])] for one in made.plan["crossings"]]
    return made


def test_true_rows_pass(plan, tmp_path):
    assert verify_job(write_job(plan, tmp_path)).failed == ()


def half_a_turn(rows):
    """All strands that are over become under: rows of another twill."""
    return [(row + 2) % 4 for row in rows]


def two_exchanged(rows):
    at = rows.index(0), rows.index(2)
    return [
        rows[at[1]] if k == at[0] else rows[at[0]] if k == at[1] else r for k, r in enumerate(rows)
    ]


def rung_for_line(rows):
    """The row of one edge whose twist is the same, but which is no rung."""
    at = rows.index(1)
    return [2 if k == at else row for k, row in enumerate(rows)]


@pytest.mark.parametrize(
    "spoil",
    [
        half_a_turn,
        two_exchanged,
        rung_for_line,
        lambda rows: rows[:-1],
        lambda rows: [4, *rows[1:]],
    ],
    ids=["half a turn", "two exchanged", "rung for line", "too few", "no row"],
)
def test_false_rows_are_found(plan, tmp_path, spoil):
    put("weave", "rows", spoil(plan.plan["weave"]["rows"]))(plan.plan)
    assert verify_job(write_job(plan, tmp_path)).failed == ("pattern",)
