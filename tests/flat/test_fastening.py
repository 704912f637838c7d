"""Fasteners go where they are wanted: counts that the weave gives, and holes only there."""

from types import SimpleNamespace

import numpy as np
import pytest

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.flat.joint.fastening import Fastening, fastened_crossings, parse_fastening
from fabweave.flat.joint.holes import HoleRule, choose_rule
from fabweave.flat.joint.kinds import JointRule
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads

NO_JOINTS = np.zeros(0, dtype=np.int64)


def wanted(shape: str, text: str, joints=NO_JOINTS):
    halfedges = build_halfedges(parse_shape(f"shape:{shape}"))
    weave = plain_weave(trace_threads(halfedges))
    return fastened_crossings(parse_fastening(text), weave, halfedges, joints), weave


@pytest.mark.parametrize("text", ["every:1", "every:0", "every", "some", "", "all:2", "every:-2"])
def test_what_names_no_crossings_is_refused(text):
    with pytest.raises(InputError, match="does not say which crossings"):
        parse_fastening(text)


def test_what_is_typed_is_read_whatever_its_case():
    assert parse_fastening(" Every:3 ") == Fastening("every", 3)


@pytest.mark.parametrize("shape", ["octahedron", "torus?m=8&n=4", "hypar?n=4"])
def test_all_are_all_none_are_none_and_joints_are_the_joints(shape):
    joints = np.array([1, 4])
    assert wanted(shape, "all")[0].all()
    assert not wanted(shape, "none", joints)[0].any()
    assert np.flatnonzero(wanted(shape, "joints", joints)[0]).tolist() == [1, 4]


@pytest.mark.parametrize("shape", ["octahedron", "torus?m=8&n=4", "hypar?n=4", "icosahedron"])
@pytest.mark.parametrize("every", [2, 3, 7])
def test_every_thread_has_its_share_of_the_crossings_at_which_it_is_on_top(shape, every):
    some, weave = wanted(shape, f"every:{every}")
    threads = weave.threads
    over = np.bincount(threads.thread_of_pass[weave.over], minlength=threads.n_threads)
    assert some.sum() == np.ceil(over / every).sum()


def test_the_rim_of_a_grid_are_the_edges_that_end_on_it():
    # On a grid of 6 by 10 quads, 5 edges stand on either short side and 9 on either long one.
    some, weave = wanted("hypar?n=6", "rim")
    assert weave.threads.n_crossings == 6 * 9 + 10 * 5
    assert some.sum() == 2 * (5 + 9)
    assert not wanted("octahedron", "rim")[0].any()


def pieces(**options: object):
    return fw.weave("shape:torus?m=8&n=4", size="200mm", force=True).ribbons().pieces(**options)


def drilled(made) -> int:
    return len(
        {crossing for piece in made for crossing in piece.crossings[~np.isnan(piece.hole_mm)]}
    )


@pytest.mark.slow
def test_only_what_is_fastened_has_holes_unless_all_are_to_have_them():
    joints = {int(piece.crossings[-1]) for piece in pieces(fasten="joints")}
    assert drilled(pieces(fasten="joints")) == len(joints)
    assert drilled(pieces(fasten="joints", holes="all")) == 64
    assert drilled(pieces(fasten="none")) == 0
    assert drilled(pieces(fasten="all")) == 64


@pytest.mark.parametrize(
    ("options", "found"),
    [({}, 16), ({"width": 0.3}, 64), ({"material": "wool-felt-3"}, 64)],
    ids=["tight", "loose", "soft"],
)
def test_a_tight_and_stiff_weave_is_fastened_at_its_joints_alone(options, found):
    planned = (
        fw.weave("shape:torus?m=8&n=4", size="400mm", force=True, **options)
        .ribbons()
        .pieces(max_length="300mm")
        .planned
    )
    every = found == 64
    assert planned.fasten == ("all" if every else "joints")
    assert every == (planned.piece_set.fastened.sum() > len(planned.piece_set.joints))


def test_where_few_are_fastened_a_little_smaller_hole_leaves_none_out():
    plan = SimpleNamespace(rule=JointRule())
    rules = [HoleRule(hole, 2 * hole) for hole in (4.1, 3.3, 2.5, 1.3)]
    room = np.array([7.0] * 19 + [5.2])

    def chosen(room, **told):
        return choose_rule(room, rules, None, None, plan, **told).hole_mm

    assert chosen(room) == 3.3
    assert chosen(room, few=True) == 2.5
    # Where only a much smaller one would do for all, nine in ten are enough.
    room[-1] = 2.7
    assert chosen(room, few=True) == 3.3
