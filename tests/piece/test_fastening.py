"""Fasteners go where they are wanted: counts that the weave gives, and holes only there."""

from types import SimpleNamespace

import numpy as np
import pytest
from random_jobs import ring

import fabweave as fw
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.piece.joint.fastening import (
    Fastening,
    fastened_crossings,
    loose_shares,
    parse_fastening,
    spread_fasteners,
)
from fabweave.piece.joint.holes import HoleRule, choose_rules
from fabweave.weave.pattern import plain_weave
from fabweave.weave.threads import trace_threads

NO_JOINTS = np.zeros(0, dtype=np.int64)


def wanted(shape: str, text: str, joints=NO_JOINTS):
    halfedges = build_halfedges(parse_shape(f"shape:{shape}"))
    weave = plain_weave(trace_threads(halfedges))
    return fastened_crossings(parse_fastening(text), weave, halfedges, joints), weave


@pytest.mark.parametrize("text", ["every:1", "every:0", "every", "some", "", "all:2", "every:-2"])
def test_what_names_no_crossings_is_refused(text):
    with pytest.raises(InputError):
        parse_fastening(text)
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


def test_what_is_soft_is_fastened_everywhere():
    made = fw.weave("shape:torus?m=8&n=4", size="400mm", force=True, material="wool-felt-3")
    assert made.ribbons().pieces().planned.piece_set.fastened.all()


def test_looser_weaves_have_more_fasteners():
    dice = np.random.default_rng(8)
    vertices, faces = ring(dice)
    woven = fw.mesh(vertices + 0.03 * dice.normal(size=vertices.shape), faces)
    counts, spared = [], []
    for width in (0.65, 0.5, 0.35):
        ribbons = fw.weave(woven, size="400mm", force=True, width=width).ribbons()
        made = ribbons.pieces(max_length="500mm").planned.piece_set
        counts.append(int(made.fastened.sum()))
        spared.append(int((~made.fastened).sum()))
        assert all(made.fastened[joint.crossing] for joint in made.joints)
    assert counts == sorted(counts)
    assert spared[0] > 0.6 * len(made.fastened)


@pytest.mark.parametrize(
    ("cover", "share"), [(0.9, 0.0), (0.6, 0.0), (0.4, 0.5), (0.3, 0.75), (0.2, 1.0), (0.1, 1.0)]
)
def test_what_wants_a_fastener_goes_down_as_ribbons_cover_more(cover, share):
    # Squares in a plane: the middles of their sides are equally far apart along a thread.
    mesh = parse_shape("shape:hypar?m=6&n=6")
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    edge = threads.crossing_halfedge
    ends = mesh.vertices[halfedges.tail[edge]], mesh.vertices[halfedges.tail[halfedges.next[edge]]]
    centre = (ends[0] + ends[1]) / 2.0 * (1.0, 1.0, 0.0)
    longest = np.argmax(threads.lengths)
    first, second = threads.crossing[threads.offsets[longest] + np.arange(2)]
    step = np.linalg.norm(centre[first] - centre[second])
    rails = np.zeros((2 * len(threads.crossing), 3))
    ribbons = SimpleNamespace(
        entry=np.arange(0, len(rails), 2),
        right=rails,
        left=np.add(rails, (0.0, 0.0, cover * step)),
        centre=centre,
    )
    assert loose_shares(ribbons, threads, 50.0) == pytest.approx(share)
    assert np.all(loose_shares(ribbons, threads, 10.0) == 1.0)


def test_fasteners_are_spread_over_threads_and_alike_where_pieces_are():
    weave = wanted("torus?m=16&n=8", "none")[1]
    each, none = np.arange(256), np.zeros(256, dtype=bool)
    before = none
    for share in (0.1, 0.25, 0.5, 0.75, 1.0):
        found = spread_fasteners(np.full(256, share), each, weave, none)
        assert np.all(before <= found)
        assert found.sum() == pytest.approx(256 * share, abs=1)
        # No run of a dozen crossings of a thread lies on top with fewer than it is due, less one.
        over = found[weave.threads.crossing[weave.over]]
        for start in range(0, len(over) - 12):
            assert abs(over[start : start + 12].sum() - 12 * share) <= 3
        before = found
    pairs = each // 2
    found = spread_fasteners(np.full(256, 0.3), pairs, weave, none)
    assert np.array_equal(found[::2], found[1::2])


def test_the_ends_of_threads_are_fastened():
    some, weave = wanted("hypar?n=4", "loose")
    threads = weave.threads
    assert not threads.closed.any()
    ends = {*threads.crossing[threads.offsets[:-1]], *threads.crossing[threads.offsets[1:] - 1]}
    assert set(np.flatnonzero(some)) == ends
    assert not wanted("octahedron", "loose")[0].any()


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
