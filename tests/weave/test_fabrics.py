"""Twills over a and under b, and satins: exact where and only where they exist."""

import itertools
import math

import numpy as np
import pytest
from fabric_oracle import broken_floats
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import merged, shuffled
from weaving_meshes import meshes

from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.weave.fabric.fabrics import (
    FabricWeave,
    Labelling,
    label_body,
    sort_crossings,
    weave_fabric,
)
from fabweave.weave.fabric.repeat import Fabric, parse_fabric
from fabweave.weave.fabric.warp_and_weft import part_strands
from fabweave.weave.pattern import over_of_passes, plain_weave
from fabweave.weave.thread_labels import thread_labels
from fabweave.weave.threads import Threads, trace_threads
from fabweave.weave.twill.conditions import count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill

FABRICS = ("2/1", "1/2", "2/2", "3/1", "1/3", "2/2/2", "3/2", "4/1", "satin:5/2", "sateen:5/2",
           "3/3", "3/3/3", "4/2/2", "satin:8/3")  # fmt: skip


def woven(mesh: PolyMesh, fabric: Fabric, **options) -> tuple[Halfedges, Threads, FabricWeave]:
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
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


def hands_of(mesh: PolyMesh, fabric: Fabric) -> tuple[dict[tuple[int, str], bool], set]:
    """Which hands close with each bunch as the warp; and the steps of all threads of bunch 0."""
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    names = thread_labels(threads.n_threads)
    strands = part_strands(halfedges, threads, names)
    crossings = sort_crossings(threads, strands.warp)
    ends = np.column_stack((halfedges.tail, halfedges.head))[threads.crossing_halfedge]
    places = [frozenset(pair) for pair in ends[threads.crossing].tolist()]
    steps = {
        frozenset((places[k], places[k + 1]))
        for t in np.flatnonzero(strands.warp).tolist()
        for k in range(threads.offsets[t], threads.offsets[t + 1] - 1)
    }
    closes = {}
    for number, side in enumerate((crossings, crossings.swapped())):
        for hand in "SZ":
            found = label_body(threads, strands, side, fabric, hand, names)
            closes[number, hand] = isinstance(found, Labelling)
            if not closes[number, hand]:
                assert found.text == f"the pattern closes, but not with the hand {hand} everywhere"
    return closes, steps


def test_hands_are_mirror_images_and_a_quarter_turn_exchanges_them():
    fabric = Fabric(2, 2)
    for m, n in itertools.product(range(3, 9), repeat=2):
        if m % 2 and n % 2:
            continue
        mesh = torus(m, n)
        closes, steps = hands_of(mesh, fabric)
        # One hand wants m to be even, the other one n.
        assert sorted((closes[0, "S"], closes[0, "Z"])) == sorted((m % 2 == 0, n % 2 == 0))
        assert closes[0, "S"] == closes[1, "Z"]
        assert closes[0, "Z"] == closes[1, "S"]
        turned = PolyMesh.from_faces(mesh.vertices * [1, 1, -1], [f[::-1] for f in mesh.faces()])
        mirrored, mirrored_steps = hands_of(turned, fabric)
        same = len(steps & mirrored_steps) > 0
        for (bunch, hand), good in closes.items():
            assert mirrored[bunch if same else 1 - bunch, "SZ"[hand == "S"]] == good
        if math.gcd(m, n) < 5:
            assert len(torus_takes(m, n, fabric)) == 2
        for hand in "SZ":
            assert woven(mesh, fabric, hand=hand)[2].hand == hand


def test_the_hand_is_how_the_line_rises():
    # A flat cloth seen from above. One step along a thread is (½, ½) or (½, -½) of a square.
    mesh = grids.hypar(8, 8, 100.0, 0.0)
    for hand in "SZ":
        halfedges, threads, found = woven(mesh, Fabric(3, 1), hand=hand)
        ends = np.column_stack((halfedges.tail, halfedges.head))[threads.crossing_halfedge]
        middle = mesh.vertices[ends].mean(axis=1)[:, :2]
        normal = np.cross(*(mesh.vertices[mesh.faces()[0][k]] - mesh.vertices[mesh.faces()[0][0]]
                            for k in (1, 2)))  # fmt: skip
        assert normal[2] > 0
        # A warp thread, drawn upright: turn its direction to (0, 1).
        thread = int(np.argmax(np.where(found.warp, threads.lengths, 0)))
        own = threads.crossing[threads.offsets[thread] : threads.offsets[thread + 1]]
        way = middle[own[1]] - middle[own[0]]
        way /= np.hypot(*way)
        right = np.array([way[1], -way[0]])
        place = np.column_stack((middle @ right, middle @ way))
        step = np.hypot(*(middle[own[1]] - middle[own[0]]))
        place = np.rint((place - place[own[0]]) / step).astype(int)
        label = {tuple(p): v for p, v in zip(place.tolist(), found.label.tolist(), strict=True)}
        rise = 1 if hand == "Z" else -1
        along = [label[x + 1, y + rise] == v for (x, y), v in label.items()
                 if (x + 1, y + rise) in label]  # fmt: skip
        other = [label[x + 1, y - rise] == v for (x, y), v in label.items()
                 if (x + 1, y - rise) in label]  # fmt: skip
        assert len(along) > 50
        assert all(along)
        assert not any(other)


def leanings(mesh: PolyMesh, threads: Threads, found: FabricWeave) -> set[int]:
    """Return to which side lines lean, seen from outside of the mesh with the warp upright.

    A line leads from a crossing at which a float of the warp begins
    over a corner of a gap to the next such crossing; all is taken from points in space.
    """
    halfedges = build_halfedges(mesh)
    ends = np.column_stack((halfedges.tail, halfedges.head))[threads.crossing_halfedge]
    middle = mesh.vertices[ends].mean(axis=1)
    corners = mesh.vertices[np.array(mesh.faces())]
    outward = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    outward = outward[halfedges.face[threads.crossing_halfedge]]
    beside: dict[tuple[int, bool], tuple[int, int]] = {}
    raised = np.zeros(threads.n_crossings, dtype=bool)
    for thread in range(threads.n_threads):
        passes = slice(threads.offsets[thread], threads.offsets[thread + 1])
        own, warp = threads.crossing[passes].tolist(), bool(found.warp[thread])
        if warp:
            raised[own] = found.weave.over[passes]
        for before, here, after in zip(np.roll(own, 1), own, np.roll(own, -1), strict=True):
            beside[here, warp] = int(before), int(after)

    def begins(crossing: int, below: int) -> bool:
        return bool(raised[crossing] and not raised[below])

    leans = set()
    for crossing in range(threads.n_crossings):
        for down, upper in (beside[crossing, True], beside[crossing, True][::-1]):
            if not begins(crossing, down):
                continue
            up = middle[upper] - middle[down]
            right = np.cross(up, outward[crossing])
            for there in beside[upper, False]:
                # Which of its two neighbours along the warp lies below.
                low = min(beside[there, True], key=lambda k: np.dot(middle[k] - middle[there], up))
                if begins(there, low):
                    leans.add(int(np.sign(np.dot(middle[there] - middle[upper], right))))
    return leans


# Tori whose squares are not too oblong to tell up from across in space.
@pytest.mark.parametrize(("m", "n"), [(24, 12), (36, 12)])
@pytest.mark.parametrize("fabric", ["3/1", "1/3", "2/2", "2/1", "3/3", "4/2"])
def test_a_shift_and_its_negative_are_mirror_images(m, n, fabric):
    mesh = torus(m, n)
    for shift, side in ((1, 1), (-1, -1)):
        _, threads, found = woven(mesh, parse_fabric(f"{fabric}/{shift}"))
        assert found.weave.pattern == f"{fabric}/{shift}"
        assert found.hand == {1: "Z", -1: "S"}[shift]
        assert leanings(mesh, threads, found) == {side}


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


def slit_sum(m: int, n: int, slit: int) -> PolyMesh:
    """Two tori of m × n squares, cut along a slit and glued crosswise: genus 2, two valences 8."""
    one = torus(m, n)
    both = merged(one, one)
    # Faces above the slit, along the row of vertices j = 0 of columns 1 … slit: exchange the row.
    faces = both.faces()
    shift = one.n_vertices
    links = build_halfedges(one)
    start = 0
    line = [start]
    half = int(np.flatnonzero(links.tail == start)[0])
    for _ in range(slit):
        line.append(int(links.head[half]))
        # Straight on over a vertex of valence 4.
        half = int(links.next[links.twin[links.next[half]]])
    # The faces on the left of the line keep their inner vertices, those on the right swap.
    inner = set(line[1:-1])
    half = int(np.flatnonzero(links.tail == start)[0])
    right = set()
    for _ in range(slit):
        right.add(int(links.face[links.twin[half]]))
        half = int(links.next[links.twin[links.next[half]]])
    ends = {line[0], line[-1]}
    glued = []
    for number, face in enumerate(faces):
        own = number % one.n_faces
        glued.append([
            v if v % shift not in inner or own not in right else (v + shift) % (2 * shift)
            for v in face
        ])  # fmt: skip
    # Both copies of an end become one vertex.
    glued = [[v % shift if v % shift in ends else v for v in face] for face in glued]
    used = sorted({v for face in glued for v in face})
    number = {v: i for i, v in enumerate(used)}
    return PolyMesh.from_faces(both.vertices[used], [[number[v] for v in face] for face in glued])


@pytest.mark.parametrize("text", ["2/2", "3/1", "2/1", "satin:5/2", "2/2/2"])
def test_slit_sums_take_fabrics_where_definition_and_theory_say(text):
    fabric = parse_fabric(text)
    seen = set()
    for m, n, slit in [(8, 8, 2), (8, 8, 4), (6, 6, 2), (6, 6, 3), (10, 10, 4), (10, 10, 5)]:
        mesh = slit_sum(m, n, slit)
        halfedges, threads, found = woven(mesh, fabric)
        valence = np.bincount(halfedges.tail)
        assert sorted(valence[valence != 4].tolist()) == [8, 8]
        assert mesh.n_vertices - halfedges.n_edges + mesh.n_faces == -2
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
        assert "does not match up around loops" in found.obstruction.text
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


@settings(max_examples=30)
@given(st.integers(3, 8), st.integers(3, 8), st.integers(0, 2**32 - 1),
       st.sampled_from(FABRICS))  # fmt: skip
def test_numbering_does_not_decide(m, n, seed, text):
    fabric = parse_fabric(text)
    mesh = torus(m, n)
    one, other = (woven(x, fabric)[2] for x in (mesh, shuffled(mesh, seed)))
    assert (one.weave is None) == (other.weave is None)


def test_bodies_are_labelled_apart():
    both = merged(torus(4, 5), torus(5, 4))
    for hand in "SZ":
        assert woven(both, Fabric(3, 1), hand=hand)[2].hand == hand
    assert woven(merged(torus(4, 4), torus(5, 5)), Fabric(3, 1))[2].weave is None
    three = merged(torus(4, 4), grids.hypar(3, 3, 10.0, 1.0), torus(8, 4))
    assert woven(three, Fabric(3, 1), hand="Z")[2].hand == "Z"


# Obstructions, each in words that name the place.


def fan(valence: int) -> PolyMesh:
    """Squares in three rings around a vertex of any valence."""
    rings = 3
    points, number = [(0.0, 0.0, 0.0)], {}

    def corner(sector: int, i: int, j: int) -> int:
        """Corner (i, j) of a sector, whose sides it shares with its neighbours."""
        if j == 0 and i > 0:
            key = ("spoke", sector % valence, i)
        elif i == 0 and j > 0:
            key = ("spoke", (sector + 1) % valence, j)
        else:
            key = ("inside", sector, i, j) if i else None
        if key is None:
            return 0
        if key not in number:
            number[key] = len(points)
            angle = 2 * math.pi * (sector + j / (i + j)) / valence
            points.append(((i + j) * math.cos(angle), (i + j) * math.sin(angle), 0.0))
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
        assert f"vertex 0 (valence {valence})" in found.obstruction.text
        words = "warp and weft do not exist" if valence % 2 else "the pattern cannot close"
        assert words in found.obstruction.text


def test_threads_that_obstruct_are_named():
    found = woven(torus(5, 7), Fabric(3, 1))[2]
    assert "70 crossings are not a multiple of 4" in found.obstruction.text
    assert found.obstruction.threads == (0, 1)
    # Rings of 40 crossings take five steps, the ways over several rings do not.
    found = woven(torus(5, 4), parse_fabric("satin:5/2"))[2]
    assert "does not match up around loops" in found.obstruction.text
    assert len(found.obstruction.threads) == 2
    assert woven(solids.icosahedron(), Fabric(2, 1))[2].obstruction.vertices
    assert woven(solids.dodecahedron(), Fabric(2, 1))[2].obstruction.vertices
    found = woven(grids.hypar(2, 3, 1.0, 0.0), Fabric(2, 1), labels="XYZUVWabcdefghijk")[2]
    assert found.weave is not None


def test_a_thread_that_turns_back_crosses_itself():
    halfedges = build_halfedges(grids.hypar(2, 3, 1.0, 0.0))
    threads = trace_threads(halfedges, turn=True)
    found = weave_fabric(halfedges, threads, Fabric(3, 1))
    assert found.obstruction.text == (
        "thread A crosses itself (7 times), so warp and weft do not exist"
    )


def test_an_odd_face_is_named_where_no_vertex_is():
    found = woven(solids.octahedron(), Fabric(2, 2))[2]
    assert "around face 0 (3 sides)" in found.obstruction.text
    assert found.obstruction.faces


# Fabrics, and the count of broken floats.


@pytest.mark.parametrize(
    ("text", "fabric"),
    [
        ("3/1", Fabric(3, 1)),
        ("1/3", Fabric(1, 3)),
        ("2/2", Fabric(2, 2)),
        ("2/2/1", Fabric(2, 2, hand="Z")),
        (" 2/2/3 ", Fabric(2, 2, 1, hand="S")),
        ("2/2/-1", Fabric(2, 2, 1, hand="S")),
        ("4/2/2", Fabric(4, 2, 2, hand="Z")),
        ("4/2/-2", Fabric(4, 2, 2, hand="S")),
        ("2/2/2", Fabric(2, 2, 2)),
        ("satin:5/2", Fabric(4, 1, 2)),
        ("satin:5/3", Fabric(4, 1, 2)),
        ("sateen:8/3", Fabric(1, 7, 3)),
        ("satin:4/1", Fabric(3, 1, 1)),
    ],
)
def test_fabrics_are_read(text, fabric):
    assert parse_fabric(text) == fabric
    assert parse_fabric(str(fabric)) == fabric


@pytest.mark.parametrize(
    "text",
    [
        "plain",
        "3",
        "3/1/1/1",
        "٣/1",
        "3/-1",
        "0/2",
        "50/20",
        "3/1/2",
        "2/2/4",
        "satin:6/2",
        "satin:8/4",
        "satin:2/1",
        "satin:999999/2",
    ],
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


def test_broken_floats_on_open_threads_count_windows_that_fit():
    _, threads, found = woven(grids.hypar(9, 9, 100.0, 0.0), Fabric(3, 1))
    none = np.zeros_like(found.weave.over)
    windows = np.maximum(threads.lengths - 3, 0).sum()
    assert broken_floats(threads, none, found.warp, Fabric(3, 1)) == windows


def test_wrong_hands_are_refused():
    with pytest.raises(InputError, match="the hand must be S or Z"):
        woven(torus(4, 4), Fabric(3, 1), hand="left")
    with pytest.raises(InputError, match="its own mirror image"):
        woven(torus(4, 4), Fabric(2, 2, 2), hand="S")
