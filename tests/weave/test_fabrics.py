"""Twills over a and under b, and satins: exact where and only where they exist."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from fabric_oracle import broken_floats
from hypothesis import given
from hypothesis import strategies as st
from strategies import merged
from weaving_meshes import meshes, slit_sum, walked

from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.fabrics import Fabric, FabricWeave, parse_fabric, weave_fabric
from fabweave.weave.pattern import over_of_passes, plain_weave
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill

FABRICS = ("2/1", "1/2", "2/2", "3/1", "1/3", "2/2/2", "3/2", "4/1", "satin:5/2", "sateen:5/2",
           "3/3", "3/3/3", "4/2/2", "satin:8/3")  # fmt: skip


def woven(mesh: PolyMesh, fabric: Fabric, **options) -> tuple[Halfedges, Threads, FabricWeave]:
    halfedges, threads = walked(mesh)
    return halfedges, threads, weave_fabric(halfedges, threads, fabric, **options)


def torus(m: int, n: int) -> PolyMesh:
    return grids.torus(m, n, 35.0, 15.0)


# An independent model: the crossings of a torus of m × n squares are the middles of its edges.
# With sides doubled they are the points (x, y) with x + y odd, x modulo 2m and y modulo 2n; threads
# run along the diagonals (1, 1) and (1, -1).


def diagonals(m: int, n: int, step: tuple[int, int]) -> list[list[tuple[int, int]]]:
    points = [(x, y) for x in range(2 * m) for y in range(2 * n) if (x + y) % 2]
    lines, seen = [], set()
    for start in points:
        if start in seen:
            continue
        point, line = start, []
        while point not in seen:
            seen.add(point)
            line.append(point)
            point = ((point[0] + step[0]) % (2 * m), (point[1] + step[1]) % (2 * n))
        lines.append(line)
    return lines


def torus_takes(m: int, n: int, fabric: Fabric) -> set[int]:
    """Try all phases of the weft on a torus by brute force; return the hands that work.

    Every weft thread repeats the sequence. Its neighbour, one step along the warp, repeats the
    same sequence shifted; which way is the hand.
    """
    size = fabric.repeat
    hands = set()
    for weft_step, warp_step in (((1, 1), (1, -1)), ((1, -1), (1, 1))):
        lines = diagonals(m, n, weft_step)
        if len(lines[0]) % size:
            continue
        for sign, phases in itertools.product(
            (1, -1), itertools.product(range(size), repeat=len(lines) - 1)
        ):
            label = {}
            for line, phase in zip(lines, (0, *phases), strict=True):
                label.update({point: (phase + k) % size for k, point in enumerate(line)})
            if all(
                label[(x + warp_step[0]) % (2 * m), (y + warp_step[1]) % (2 * n)]
                == (value + sign * fabric.shift) % size
                for (x, y), value in label.items()
            ):
                # The turn from weft to warp is clockwise for one choice and not for the other.
                hands.add(sign * (1 if weft_step == (1, 1) else -1))
    return hands


def torus_rule(m: int, n: int, fabric: Fabric) -> bool:
    """The sides as ways over the crossings: m steps along both diagonals, n there and n back."""
    size, shift = fabric.repeat, fabric.shift
    return any(
        m * (1 + sign * shift) % size == 0 and n * (1 - sign * shift) % size == 0
        for sign in (1, -1)
    )


@pytest.mark.parametrize("text", ["2/1", "2/2", "3/1", "2/2/2", "3/2", "satin:5/2", "3/3"])
def test_tori_take_a_fabric_where_brute_force_finds_one(text):
    fabric = parse_fabric(text)
    for m, n in itertools.product(range(3, 9), repeat=2):
        if fabric.repeat ** math.gcd(m, n) > 2000:
            continue
        exists = bool(torus_takes(m, n, fabric))
        assert exists == torus_rule(m, n, fabric)
        _, threads, found = woven(torus(m, n), fabric)
        assert (found.weave is not None) == exists, (m, n)
        if exists:
            assert broken_floats(threads, found.weave.over, found.warp, fabric) == 0


@pytest.mark.parametrize("text", FABRICS)
def test_tori_take_a_fabric_where_the_sides_close(text):
    fabric = parse_fabric(text)
    for m, n in itertools.product((3, 4, 5, 6, 8, 10, 15), repeat=2):
        _, _, found = woven(torus(m, n), fabric)
        assert (found.weave is not None) == torus_rule(m, n, fabric), (m, n)


@pytest.mark.parametrize("text", ["3/1", "1/3", "2/2", "2/1", "3/3", "4/2"])
@pytest.mark.parametrize(
    ("mesh", "sides", "columns"),
    [(grids.hypar(8, 8, 100.0, 0.0), (99, 99), 9), (torus(24, 12), (24, 12), 12)],
    ids=["cloth", "torus"],
)
def test_the_hand_is_how_lines_rise_seen_from_outside(mesh, sides, columns, text):
    # Columns and rows run to the right and up, seen from outside, or else to the left and up.
    (x, y), (u, v) = (np.subtract(divmod(k, columns), divmod(mesh.indices[0], columns))
                      for k in mesh.indices[[1, 3]])  # fmt: skip
    sense = x * v - y * u
    assert abs(sense) == 1
    for hand, rise in (("Z", 1), ("S", -1)):
        halfedges, threads, found = woven(mesh, parse_fabric(f"{text}/{rise}"))
        assert (found.weave.pattern, found.hand) == (f"{text}/{rise}", hand)
        plain = woven(mesh, replace(parse_fabric(text), hand=hand))[2]
        assert plain.weave.twist.tolist() == found.weave.twist.tolist()
        # The middles of edges, doubled: one step along a thread is (1, 1) or (1, -1).
        tail, head = (
            np.column_stack(divmod(ends[threads.crossing_halfedge], columns))
            for ends in (halfedges.tail, halfedges.head)
        )
        size = 2 * np.array(sides)
        place = (2 * tail + (head - tail + 1) % sides - 1) % size
        label = {tuple(p): v for p, v in zip(place.tolist(), found.label.tolist(), strict=True)}
        # A warp thread, drawn upright, and what is to the right of it.
        thread = int(np.argmax(np.where(found.warp, threads.lengths, 0)))
        one, two = threads.crossing[threads.offsets[thread] + np.array([0, 1])]
        up = (place[two] - place[one] + 1) % size - 1
        right = sense * np.array([up[1], -up[0]])
        for way, same in ((right + rise * up, True), (right - rise * up, False)):
            beside = [(value, label.get(tuple((p + way) % size))) for p, value in label.items()]
            found_there = [value == other for value, other in beside if other is not None]
            assert len(found_there) > 50
            assert all(found_there) if same else not any(found_there)


@given(st.integers(3, 12), st.integers(3, 12))
def test_two_over_two_is_the_twill_of_definition_5_1_on_tori(m, n):
    halfedges, threads, found = woven(torus(m, n), Fabric(2, 2))
    conditions = twill_conditions(halfedges, threads)
    assert (found.weave is not None) == decide_twill(conditions).twillable == (m * n % 2 == 0)
    if found.weave is not None:
        assert count_broken(conditions, found.weave.twist).total == 0
        spoiled = found.weave.twist.copy()
        spoiled[0] = ~spoiled[0]
        assert count_broken(conditions, spoiled).total > 0


@pytest.mark.parametrize("text", ["2/2", "3/1", "2/1", "satin:5/2", "2/2/2"])
def test_slit_sums_take_fabrics_where_definition_and_theory_say(text):
    fabric = parse_fabric(text)
    seen = set()
    for m, n, slit in [(8, 8, 2), (8, 8, 4), (6, 6, 2), (6, 6, 3), (10, 10, 4), (10, 10, 5)]:
        halfedges, threads, found = woven(slit_sum(m, n, slit), fabric)
        seen.add(found.weave is not None)
        if found.weave is not None:
            assert broken_floats(threads, found.weave.over, found.warp, fabric) == 0
            if text == "2/2":
                conditions = twill_conditions(halfedges, threads)
                assert count_broken(conditions, found.weave.twist).total == 0
    assert True in seen


@given(st.integers(1, 9), st.integers(1, 9), st.sampled_from(FABRICS))
def test_open_cloths_take_every_fabric(m, n, text):
    fabric = parse_fabric(text)
    _, threads, found = woven(grids.hypar(m, n, 100.0, 10.0), fabric)
    assert found.weave is not None
    assert broken_floats(threads, found.weave.over, found.warp, fabric) == 0
    assert found.hand in ("", "S", "Z")


@given(st.integers(3, 12), st.integers(1, 8), st.sampled_from(FABRICS))
def test_tubes_take_a_fabric_where_once_round_closes(m, n, text):
    # Once round is m steps along each diagonal; nothing closes in the other direction. With one
    # row, no thread meets the same one twice.
    fabric = parse_fabric(text)
    closes = any(m * (1 + sign * fabric.shift) % fabric.repeat == 0 for sign in (1, -1))
    _, threads, found = woven(grids.tube(m, n, 25.0, 100.0), fabric)
    if closes:
        assert found.weave is not None
    elif n > m:
        assert found.weave is None
    if found.weave is not None:
        assert broken_floats(threads, found.weave.over, found.warp, fabric) == 0


@given(meshes(), st.sampled_from(FABRICS))
def test_every_weave_keeps_the_labels_and_every_refusal_has_words(mesh, text):
    fabric = parse_fabric(text)
    _, threads, found = woven(mesh, fabric)
    assert (found.weave is None) == (found.obstruction is not None)
    if found.weave is None:
        assert found.obstruction.text
        return
    thread = threads.thread_of_pass
    label = found.label[threads.crossing]
    assert np.array_equal(found.weave.over, (label < fabric.over) == found.warp[thread])
    warp_of = np.zeros((threads.n_crossings, 2), dtype=bool)
    warp_of[threads.crossing, found.weave.over.astype(int)] = found.warp[thread]
    assert (warp_of.sum(axis=1) == 1).all()  # warp crosses weft
    for t in range(threads.n_threads):
        own = label[threads.offsets[t] : threads.offsets[t + 1]]
        steps = np.diff(own, append=own[:1]) if threads.closed[t] else np.diff(own)
        width = fabric.shift if found.warp[t] else 1
        assert any(
            (steps % fabric.repeat == sign * width % fabric.repeat).all() for sign in (1, -1)
        )
    assert broken_floats(threads, found.weave.over, found.warp, fabric) == 0


@given(meshes())
def test_one_over_one_is_plain_weave_on_every_mesh(mesh):
    _, threads, found = woven(mesh, Fabric(1, 1))
    assert np.array_equal(found.weave.over, plain_weave(threads).over)
    assert (
        broken_floats(threads, found.weave.over, np.ones(threads.n_threads, bool), Fabric(1, 1))
        == 0
    )


def test_bodies_are_labelled_apart():
    both = merged(torus(4, 5), torus(5, 4))
    for hand in "SZ":
        assert woven(both, Fabric(3, 1, hand=hand))[2].hand == hand
    assert woven(merged(torus(4, 4), torus(5, 5)), Fabric(3, 1))[2].weave is None
    three = merged(torus(4, 4), grids.hypar(3, 3, 10.0, 1.0), torus(8, 4))
    assert woven(three, Fabric(3, 1, hand="Z"))[2].hand == "Z"


# Obstructions, each in words that name the place.


def fan(valence: int) -> PolyMesh:
    """Squares in three rings around a vertex of any valence."""
    rings = 3
    points, number = [], {}

    def corner(sector: int, i: int, j: int) -> int:
        """Corner (i, j) of a sector, whose sides it shares with its neighbours."""
        ring, turn = i + j, 2 * math.pi / valence * (sector + (j / (i + j) if i + j else 0))
        key = (round(ring * math.cos(turn), 9) + 0.0, round(ring * math.sin(turn), 9) + 0.0, 0.0)
        if key not in number:
            number[key] = len(points)
            points.append(key)
        return number[key]

    faces = [
        [corner(s, i, j), corner(s, i + 1, j), corner(s, i + 1, j + 1), corner(s, i, j + 1)]
        for s in range(valence)
        for i in range(rings)
        for j in range(rings)
    ]
    return PolyMesh.from_faces(np.array(points), faces)


@pytest.mark.parametrize("text", ["3/1", "2/2", "satin:5/2", "2/1"])
def test_vertices_of_wrong_valence_are_named(text):
    fabric = parse_fabric(text)
    assert woven(fan(4), fabric)[2].weave is not None
    assert woven(fan(8), fabric)[2].weave is not None
    for valence in (3, 5, 6, 7, 10):
        found = woven(fan(valence), fabric)[2]
        assert found.weave is None
        assert found.obstruction.vertices == (0,)


def test_threads_and_faces_that_obstruct_are_named():
    assert woven(torus(5, 7), Fabric(3, 1))[2].obstruction.threads == (0, 1)
    # Rings of 40 crossings take five steps, the ways over several rings do not.
    assert len(woven(torus(5, 4), parse_fabric("satin:5/2"))[2].obstruction.threads) == 2
    assert woven(solids.icosahedron(), Fabric(2, 1))[2].obstruction.vertices
    assert woven(solids.octahedron(), Fabric(2, 2))[2].obstruction.faces
    # A thread that turns back crosses itself.
    halfedges, threads = walked(grids.hypar(2, 3, 1.0, 0.0), turn=True)
    assert weave_fabric(halfedges, threads, Fabric(3, 1)).obstruction.threads == (0,)


# Fabrics, and the count of broken floats.


@pytest.mark.parametrize(
    ("text", "fabric"),
    [
        ("3/1", Fabric(3, 1)),
        ("2/2/1", Fabric(2, 2, hand="Z")),
        (" 2/2/3 ", Fabric(2, 2, 1, hand="S")),
        ("4/2/-2", Fabric(4, 2, 2, hand="S")),
        ("2/2/2", Fabric(2, 2, 2)),
        ("satin:5/2", Fabric(4, 1, 2)),
        ("sateen:8/3", Fabric(1, 7, 3)),
    ],
)
def test_fabrics_are_read(text, fabric):
    assert parse_fabric(text) == fabric
    assert parse_fabric(str(fabric)) == fabric


@pytest.mark.parametrize(
    "text", ["plain", "3/1/1/1", "٣/1", "3/-1", "50/20", "3/1/2", "satin:6/2", "satin:2/1"]
)
def test_wrong_fabrics_are_refused_in_words(text):
    with pytest.raises(InputError):
        parse_fabric(text)


@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 20))
def test_a_fabric_is_refused_exactly_if_a_thread_would_lie_on_one_side(over, under, shift):
    # On an endless cloth, warp i meets weft j at label i + shift × j.
    size = over + under
    warps = [[(i + shift * j) % size < over for j in range(size)] for i in range(size)]
    holds = all(any(warp) and not all(warp) for warp in warps)
    try:
        Fabric(over, under, shift)
    except InputError:
        assert not holds
    else:
        assert holds


@given(st.sampled_from(FABRICS), st.integers(0, 2**32 - 1))
def test_spoiled_weaves_have_broken_floats(text, seed):
    fabric = parse_fabric(text)
    _, threads, found = woven(torus(fabric.repeat, 2 * fabric.repeat), fabric)
    twist = found.weave.twist.copy()
    twist[np.random.default_rng(seed).integers(len(twist))] ^= True
    over = over_of_passes(threads, twist)
    # One crossing lies in a window of each length for each of its two passes.
    broken = broken_floats(threads, over, found.warp, fabric)
    assert 1 <= broken <= 2 * fabric.repeat
    # A window around the wrong pass has another number of passes on top, unless all have any.
    assert broken == 2 * fabric.repeat or math.gcd(fabric.shift, fabric.repeat) > 1
    if fabric.over != fabric.under:
        assert broken_floats(threads, found.weave.over, ~found.warp, fabric) > 0
