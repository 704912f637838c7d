"""Fasteners go where they are wanted: counts that the weave gives, and holes only there."""

import numpy as np
import pytest

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.piece.joint.fastening import (
    Fastening,
    Hanging,
    fastened_crossings,
    parse_fastening,
    parse_load,
)
from fabweave.piece.joint.holes import HoleRule, choose_rules
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads

pytestmark = pytest.mark.usefixtures("quick_jobs")

NO_JOINTS = np.zeros(0, dtype=np.int64)


def wanted(shape: str, text: str, joints=NO_JOINTS):
    halfedges = build_halfedges(parse_shape(f"shape:{shape}"))
    weave = plain_weave(trace_threads(halfedges))
    return fastened_crossings(parse_fastening(text), weave, halfedges, joints), weave


@pytest.mark.parametrize(
    "text",
    [
        "every:1",
        "every:0",
        "every",
        "some",
        "",
        "all:2",
        "every:-2",
        "form:",
        "form:0mm",
        "loose",
        "5",
        "rim,",
        "rim,x",
    ],
)
def test_what_names_no_crossings_is_refused(text):
    with pytest.raises(InputError):
        parse_fastening(text)
    assert parse_fastening(" Every:3 ") == Fastening("every", 3)
    assert parse_fastening("form:3 mm") == Fastening("form", bound_mm=3.0)
    assert parse_fastening("form") == Fastening("form")


@pytest.mark.parametrize("rule", ["joints", "none", "all", "rim", "every:3", "form"])
def test_crossings_that_are_named_are_fastened_besides(rule):
    shape, joints = "hypar?n=4", np.array([1])
    alone, _ = wanted(shape, rule, joints)
    also, _ = wanted(shape, f"{rule}, 7,3", joints)
    assert set(np.flatnonzero(also)) == {3, 7, *np.flatnonzero(alone)}
    with pytest.raises(InputError, match=str(len(alone))):
        wanted(shape, f"{rule},{len(alone)}", joints)


def test_loads_have_units_and_hang_at_the_top_unless_said():
    assert parse_load("200g") == (0.2, Hanging((), top=1))
    assert parse_load("1.5 kg @ bottom:3") == (1.5, Hanging((), bottom=3))
    assert parse_load("16oz@7")[0] == pytest.approx(parse_load("1lb@7")[0])


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
    alone = pieces(fasten="joints", holes="fastened")
    assert drilled(alone) == len(joints)
    # By default repeated pieces keep the same holes, and are of fewer kinds.
    alike = pieces(fasten="joints")
    assert len(joints) < drilled(alike) < 64
    assert alike.planned.piece_set.kinds.count <= alone.planned.piece_set.kinds.count
    assert drilled(pieces(fasten="joints", holes="all")) == 64
    assert drilled(pieces(fasten="none")) == 0
    assert drilled(pieces(fasten="all")) == 64


def test_the_ends_of_threads_are_fastened():
    some, weave = wanted("hypar?n=4", "form")
    threads = weave.threads
    assert not threads.closed.any()
    ends = {*threads.crossing[threads.offsets[:-1]], *threads.crossing[threads.offsets[1:] - 1]}
    assert set(np.flatnonzero(some)) == ends
    assert not wanted("octahedron", "form")[0].any()


HOLES = [HoleRule(hole, 2 * hole) for hole in (4.1, 3.3, 2.5, 2.0, 1.6, 1.3, 1.0)]


def chosen(room, joined=None):
    fits = np.greater_equal.outer(np.array(room, dtype=float), [rule.edge_mm for rule in HOLES])
    return [HOLES[at].hole_mm for at in choose_rules(fits, HOLES, joined)]


def test_as_large_holes_as_have_room_in_few_sizes():
    assert chosen([7.0] * 20) == [3.3]
    assert chosen([7.0] * 10 + [2.0] * 10) == [3.3, 1.0]
    # A size more has to be worth its purchase: a hole that is a little larger is not.
    assert chosen([7.0] * 10 + [5.2] * 10) == [2.5]
    assert chosen([9.0] * 30 + [2.0] * 30) == [4.1, 1.0]
    assert len(chosen(np.geomspace(2.0, 9.0, 90))) == 2
    # One of a hundred goes without, but not if it is a joint.
    assert chosen([7.0] * 99 + [2.0]) == [3.3]
    assert chosen([7.0] * 99 + [2.0], np.arange(100) == 99) == [3.3, 1.0]
    assert chosen([1.0] * 5) == chosen([]) == []


def uneven_ring():
    """Return a torus of quads whose tube is nine times as thick on one side as on the other."""
    m, n = 18, 6
    u, v = np.meshgrid(np.arange(m) * 2 * np.pi / m, np.arange(n) * 2 * np.pi / n, indexing="ij")
    away = (0.5 + 0.4 * np.cos(u)) * np.cos(v) + 1.2
    points = np.stack(
        (away * np.cos(u), away * np.sin(u), (0.5 + 0.4 * np.cos(u)) * np.sin(v)), axis=2
    )
    faces = [
        [i * n + j, (i + 1) % m * n + j, (i + 1) % m * n + (j + 1) % n, i * n + (j + 1) % n]
        for i in range(m)
        for j in range(n)
    ]
    return fw.mesh(points.reshape(-1, 3), faces)


def test_where_ribbons_are_wide_holes_are_larger():
    ribbons = fw.weave(uneven_ring(), size="500mm", force=True).ribbons()
    planned = ribbons.pieces(fasten="all").planned
    made, centre = planned.piece_set, planned.woven.ribbons.centre
    assert len(made.rules) == 2
    holed = ~np.isnan(made.size_mm)
    large = made.size_mm == made.rules[0].hole_mm
    assert set(made.size_mm[holed]) == {rule.hole_mm for rule in made.rules}
    # The thick side is that of large x.
    assert centre[large, 0].mean() > centre[holed & ~large, 0].mean() + 50.0
    assert made.room_mm[large].min() >= made.rules[0].edge_mm
    assert made.room_mm[holed].min() >= made.rules[-1].edge_mm
    assert min(large.sum(), (holed & ~large).sum()) > 20


@pytest.mark.parametrize("options", [{"width": "12mm"}, {"fastener": "1.6mm"}])
def test_ribbons_as_wide_everywhere_have_holes_of_one_size(options):
    assert len(pieces(fasten="all", **options).planned.piece_set.rules) == 1
