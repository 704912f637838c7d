"""Part the threads of a mesh into warp and weft, and let neighbours run the same way."""

from collections.abc import Sequence

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, frozen_value
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.topology import ParityClasses, solve_parity
from fabweave.weave.threads import Threads
from fabweave.weave.twill.obstruction import Obstruction

_NAMED = 4
#: So many irregular gaps are looked at, one by one, for one that obstructs by itself.
_LOOKED_AT = 40


@frozen_value
class Strands:
    """Warp and weft, with directions.

    Parameters
    ----------
    warp : (T,) bool array
        Whether each thread belongs to the warp (which of two bunches that is, is a free choice in
        each body of the weave).
    group : (T,) int array
        Threads of one group have directions relative to one another; threads whose direction does
        not matter are one group together.
    reversed : (T,) bool array
        Whether a thread runs against the way it is walked, if the first thread of its group does
        not.
    """

    warp: BoolArray
    group: IntArray
    reversed: BoolArray


def part_strands(
    halfedges: Halfedges,
    threads: Threads,
    labels: Sequence[str],
    *,
    warp_runs: bool = True,
    weft_runs: bool = True,
) -> Strands | Obstruction:
    """Part the threads into warp and weft, and give neighbours the same direction.

    Every thread of the one crosses only threads of the other. Two threads are neighbours where
    they run along opposite sides of a gap of four crossings. The parting is a two-colouring, the
    directions are another; both are solved exactly.

    Parameters
    ----------
    halfedges, threads
        The mesh and its threads.
    labels : sequence of str
        Names of the threads, for the words.
    warp_runs, weft_runs : bool
        Whether directions matter in the warp and in the weft.

    Returns
    -------
    Strands or Obstruction
        The obstruction names a gap that an odd number of threads surround, a thread that crosses
        itself, threads that cross one another in an odd ring, or a gap around which a strand
        turns back to front.

    Examples
    --------
    >>> from fabweave.mesh.shapes import grids, solids
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.weave.threads import trace_threads
    >>> halfedges = build_halfedges(grids.torus(6, 4, 35.0, 15.0))
    >>> part_strands(halfedges, trace_threads(halfedges), "ABCD").warp.tolist()
    [True, False, True, False]
    >>> halfedges = build_halfedges(solids.cube())
    >>> part_strands(halfedges, trace_threads(halfedges), "ABCD").text
    'around vertex 0 (valence 3) 3 strands cross in a ring (threads A, C, D), so warp and \
weft do not exist; in all, 8 vertices have an odd valence'
    """
    bunches = _two_bunches(halfedges, threads, labels)
    if isinstance(bunches, Obstruction):
        return bunches
    warp = ~bunches.opposite
    runs = np.where(warp, warp_runs, weft_runs)
    passed, ways = _corner_walks(halfedges, threads)
    side, other = _opposite_sides(halfedges)
    first, second = passed[side], passed[other]
    matters = runs[first]
    # Round a gap, opposite sides are passed in opposite senses by threads that run the same way.
    turned = ways[side] == ways[other]
    solution = solve_parity(threads.n_threads, first[matters], second[matters], turned[matters])
    if solution.odd_ring:
        return _turned_about(halfedges, threads, solution, labels)
    group = np.where(runs, solution.classes, solution.n_classes)
    return Strands(warp, group, solution.opposite & runs)


def _two_bunches(
    halfedges: Halfedges, threads: Threads, labels: Sequence[str]
) -> ParityClasses | Obstruction:
    """Two-colour the threads, or say why not."""
    # An odd gap tells a person more than the threads do: it is a place that can be remeshed.
    odd = _odd_gap(halfedges, threads, labels)
    if odd is not None:
        return odd
    thread = threads.thread_of_pass
    pairs = thread[np.argsort(threads.crossing, kind="stable")].reshape(-1, 2)
    itself = pairs[pairs[:, 0] == pairs[:, 1], 0]
    if len(itself):
        name, often = labels[itself[0]], int(np.count_nonzero(itself == itself[0]))
        times = "once" if often == 1 else f"{often} times"
        others = len(np.unique(itself)) - 1
        more = f", and so {'does' if others == 1 else 'do'} {others} more" if others else ""
        return Obstruction(
            f"thread {name} crosses itself ({times}{more}), so warp and weft do not exist",
            threads=(int(itself[0]),),
        )
    distinct = np.unique(np.sort(pairs, axis=1), axis=0)
    solution = solve_parity(
        threads.n_threads, distinct[:, 0], distinct[:, 1], np.ones(len(distinct), dtype=bool)
    )
    if not solution.odd_ring:
        return solution
    ring = solution.odd_ring
    how = "cross pairwise" if len(ring) == 3 else f"cross in a ring of {len(ring)}"
    named = ", ".join(labels[t] for t in ring[:7]) + (" …" if len(ring) > 7 else "")
    return Obstruction(f"warp and weft do not exist: threads {named} {how}", threads=ring)


def _odd_gap(halfedges: Halfedges, threads: Threads, labels: Sequence[str]) -> Obstruction | None:
    """Find a gap with an odd number of crossings: the threads around it cannot take turns."""
    (vertices, valence), (faces, sides) = (
        _closed_gaps(halfedges, owner) for owner in (halfedges.head, halfedges.face)
    )
    vertices, valence = vertices[valence % 2 == 1], valence[valence % 2 == 1]
    faces, sides = faces[sides % 2 == 1], sides[sides % 2 == 1]
    if not len(vertices) and not len(faces):
        return None
    if len(vertices):
        size, where = int(valence[0]), f"vertex {vertices[0]} (valence {valence[0]})"
        corners = halfedges.head == vertices[0]
    else:
        size, where = int(sides[0]), f"face {faces[0]} ({sides[0]} sides)"
        corners = halfedges.face == faces[0]
    around = np.unique(_corner_walks(halfedges, threads)[0][corners])
    named = ", ".join(labels[t] for t in around[:7].tolist()) + (" …" if len(around) > 7 else "")
    whose = f"thread{'s' * (len(around) > 1)} {named}"
    kinds = (
        (len(vertices), "{n} [vertex has|vertices have] an odd valence"),
        (len(faces), "{n} [face has|faces have] an odd number of sides"),
    )
    in_all = " and ".join(agree(number, text) for number, text in kinds if number)
    more = f"; in all, {in_all}" if len(vertices) + len(faces) > 1 else ""
    return Obstruction(
        f"around {where} {size} strands cross in a ring ({whose}), so warp and weft do not "
        f"exist{more}",
        vertices=tuple(vertices[:_NAMED].tolist()),
        faces=tuple(faces[:_NAMED].tolist()),
    )


def _closed_gaps(halfedges: Halfedges, owner: IntArray) -> tuple[IntArray, IntArray]:
    """Return the vertices or faces with crossings all round, and how many."""
    sizes = np.bincount(owner)
    rim = halfedges.twin < 0
    for at in (rim, rim[halfedges.next]):  # a corner lies between an edge and the next one
        sizes[owner[at]] = 0
    return np.flatnonzero(sizes), sizes[sizes > 0]


def _corner_walks(halfedges: Halfedges, threads: Threads) -> tuple[IntArray, BoolArray]:
    """Return the thread through each corner, -1 where no pass leads there, and which way."""
    twin = halfedges.twin[threads.halfedge]
    # After its crossing a thread that arrived forward passes a corner backward.
    corner = np.where(threads.forward, halfedges.prev[twin], twin)
    passed = np.full(halfedges.n_halfedges, -1, dtype=np.int64)
    ways = np.zeros(halfedges.n_halfedges, dtype=bool)
    passed[corner] = threads.thread_of_pass
    ways[corner] = ~threads.forward
    return passed, ways


def _opposite_sides(halfedges: Halfedges) -> tuple[IntArray, IntArray]:
    """Return the pairs of corners that are opposite sides of a gap of four crossings."""
    around_vertex = halfedges.twin[halfedges.next]
    pairs = []
    for turn in (halfedges.next, around_vertex):
        inner = halfedges.twin >= 0
        corner = np.flatnonzero(inner)
        at = [corner]
        good = np.ones(len(corner), dtype=bool)
        for _ in range(4):
            following = turn[at[-1]]
            good &= (following >= 0) & inner[following]
            at.append(following)
        good &= (at[4] == corner) & (at[2] > corner)
        pairs.append((corner[good], at[2][good]))
    return (
        np.concatenate([first for first, _ in pairs]),
        np.concatenate([second for _, second in pairs]),
    )


def _turned_about(
    halfedges: Halfedges, threads: Threads, solution: ParityClasses, labels: Sequence[str]
) -> Obstruction:
    """Name a gap around which a strand turns back to front, or threads that do elsewhere."""
    odd: list[tuple[str, int, int]] = []
    for kind, owner in (("vertex", halfedges.head), ("face", halfedges.face)):
        gaps, sizes = _closed_gaps(halfedges, owner)
        bad = sizes % 4 != 0
        odd += [
            (kind, gap, size)
            for gap, size in zip(gaps[bad].tolist(), sizes[bad].tolist(), strict=True)
        ]
    for kind, gap, size in odd[:_LOOKED_AT]:
        if _turns_around(halfedges, threads, kind, gap):
            what = f"valence {size}" if kind == "vertex" else f"{size} sides"
            text = (
                f"around {kind} {gap} ({what}) the pattern cannot close: strands that "
                "start side by side in the same direction come back running against one another"
            )
            if len(odd) > 1:
                text += (
                    f"; in all, {len(odd)} gaps have a valence or a number of sides that is not "
                    "a multiple of 4"
                )
            named = {"vertices": (gap,)} if kind == "vertex" else {"faces": (gap,)}
            return Obstruction(text, **named)
    ring = solution.odd_ring
    if len(ring) == 1:
        text = f"thread {labels[ring[0]]} comes to lie beside itself, running the opposite way"
    else:
        named_threads = ", ".join(labels[t] for t in ring[:7]) + (" …" if len(ring) > 7 else "")
        text = (
            f"threads {named_threads} lie side by side but cannot all run the same way: the last "
            "comes back beside the first, running against it"
        )
    return Obstruction(text, threads=ring)


def _turns_around(halfedges: Halfedges, threads: Threads, kind: str, gap: int) -> bool:
    """Return whether the gaps of four around a gap, by themselves, turn a strand about."""
    # A corner is a side of the gap of its face and of the gap of its head.
    tail, head, face = halfedges.tail, halfedges.head, halfedges.face
    near_vertex = np.zeros(int(tail.max()) + 1, dtype=bool)
    near_face = np.zeros(int(face.max()) + 1, dtype=bool)
    if kind == "vertex":
        near_vertex[tail[head == gap]] = True
        near_face[face[(head == gap) | (tail == gap)]] = True
    else:
        near_vertex[head[face == gap]] = True
        near_face[face[halfedges.twin[face == gap]]] = True
    near = near_vertex[head] | near_face[face]
    side, other = _opposite_sides(halfedges)
    kept = near[side] & near[other]
    side, other = side[kept], other[kept]
    _, ways = _corner_walks(halfedges, threads)
    # Sides are followed along their threads from crossing to crossing.
    here = threads.halfedge
    twin = halfedges.twin[here]
    after = np.where(threads.forward, halfedges.prev[twin], twin)
    before = np.where(threads.forward, halfedges.prev[here], here)
    joined = near[before] & near[after]
    before, after = before[joined], after[joined]
    solution = solve_parity(
        halfedges.n_halfedges,
        np.concatenate((side, before)),
        np.concatenate((other, after)),
        np.concatenate((ways[side] == ways[other], np.zeros(len(before), dtype=bool))),
    )
    return bool(solution.odd_ring)
