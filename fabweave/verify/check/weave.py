"""Check threads, over and under, and the pattern of the weave."""

import math
import re
from collections import Counter, defaultdict
from itertools import pairwise

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.drawing import Ints
from fabweave.verify.measure.walks import Pass, turns_back
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.mesh import LoadedMesh, edge_keys
from fabweave.verify.report import Place, Tally


def broken_conditions(
    job: Job, sense: dict[int, bool], tally: Tally
) -> tuple[tuple[int, int, int], int]:
    """Count the broken edge, face and vertex conditions of a 2/2 twill, and what breaks at turns.

    Three consecutive edges of a thread want the first and last to differ. Four consecutive edges
    of a face or around a vertex want: where the middle two differ, the outer two agree. Windows
    with a boundary edge do not count, also where a thread turns back at one; nor do those of
    triangles and three-valent vertices, whose outer edges are the same. Three crossings in a row
    with a turn between them are no condition, but break the rhythm in the same way.

    References
    ----------
    Akleman et al., "Cyclic twill-woven objects" (2011), definition 5.1.
    """
    mesh, (passes, _) = required(job.mesh), job.passes
    twist = np.array([sense.get(key, -1) for key in edge_keys(mesh).tolist()], dtype=np.int64)
    broken = turned = 0
    for thread in required(job.map).threads:
        along = [sense.get(job.edges.get(crossing, -1), -1) for crossing in thread.crossings]
        count = len(along)
        turns = turns_back(passes[thread.id], mesh) if thread.id in passes else [False] * count
        for at in range(count if thread.closed else count - 2):
            tally.count()
            alike = along[at] == along[(at + 2) % count]
            if turns[at] or turns[(at + 1) % count]:
                turned += alike
            else:
                broken += alike
    totals = [broken]
    for turn in gap_turns(mesh):
        windows = twist[four_along(turn)]
        a, b, c, d = windows[(windows >= 0).all(axis=1)].T
        tally.count(len(a))
        totals.append(int(np.count_nonzero((b != c) & (a != d))))
    return (totals[0], totals[1], totals[2]), turned


def gap_turns(mesh: LoadedMesh) -> tuple[Ints, Ints]:
    """Return what follows each side in its face, and around the vertex it leaves, or -1."""
    return mesh.next, mesh.twin[mesh.prev]


def four_along(turn: Ints) -> Ints:
    """Return all four sides that follow one another, (N, 4), but where every second one is one."""
    columns = [np.arange(len(turn))]
    for _ in range(3):
        columns.append(np.where(columns[-1] < 0, -1, turn[columns[-1]]))
    windows = np.stack(columns, axis=1)
    return windows[(windows[:, 3] >= 0) & (windows[:, 0] != windows[:, 2])]


_TWILL = re.compile(r"(\d+)/(\d+)(?:/(-?\d+))?", re.ASCII)
_SATIN = re.compile(r"(satin|sateen):(\d+)/(\d+)", re.ASCII)


def read_fabric(pattern: str) -> tuple[int, int, int] | None:
    """Return over, under and shift of a pattern's name, or None if it names no fabric.

    Examples
    --------
    >>> read_fabric("3/1"), read_fabric("2/2/-1"), read_fabric("satin:5/2"), read_fabric("knit")
    ((3, 1, 1), (2, 2, -1), (4, 1, 2), None)
    """
    if match := _TWILL.fullmatch(pattern):
        over, under, shift = (int(word) for word in match.groups(default="1"))
    elif match := _SATIN.fullmatch(pattern):
        size, shift = int(match[2]), int(match[3])
        over, under = (size - 1, 1) if match[1] == "satin" else (1, size - 1)
    else:
        return None
    if over < 1 or under < 1 or math.gcd(shift, over + under) > min(over, under):
        return None
    return over, under, shift


def check_fabric(job: Job, tally: Tally) -> None:
    """Check that the labels of the crossings make the fabric that the map claims.

    Warp crosses weft and nothing else. Labels modulo the repeat step by one along the weft and by
    the shift along the warp, in one direction all along a thread. Around every gap of four
    crossings, opposite labels have equal sums, so that neighbours run the same way. The warp lies
    on top where the label is less than the number it passes over. If the name has a shift, its sign
    says whether the diagonal rises to the right or to the left, and each gap must agree.

    References
    ----------
    Grünbaum and Shephard, "Satins and twills: an introduction to the geometry of fabrics",
    Mathematics Magazine 53(3), 1980.
    """
    plan, mesh, edges = required(job.map), required(job.mesh), job.edges
    keys, fabric = edge_keys(mesh).tolist(), read_fabric(plan.weave.pattern)
    if fabric is None:
        tally.fail(f"no rule is known to prove the pattern {plan.weave.pattern!r}")
        return
    over, under, shift = fabric
    size = over + under
    if len(plan.weave.labels) != len(plan.crossings):
        tally.fail(
            f"a fabric needs a label for each of the {len(plan.crossings)} crossings, and the map "
            f"has {len(plan.weave.labels)}"
        )
        return
    label = {
        crossing.id: value
        for crossing, value in zip(plan.crossings, plan.weave.labels, strict=True)
    }
    warp = set(plan.weave.warp)
    tally.at("warp").expect(
        warp <= set(plan.thread), f"it names threads that do not exist: {sorted(warp)[:4]}"
    )
    for crossing in plan.crossings:
        place, on_top = tally.at(f"crossing {crossing.id}"), crossing.over.thread in warp
        name = "warp" if on_top else "weft"
        place.expect(on_top != (crossing.under.thread in warp), f"it is of two {name} threads")
        place.expect(
            on_top == (label[crossing.id] % size < over),
            f"it has label {label[crossing.id]}, but {name} lies on top",
        )
    for thread in plan.threads:
        step = shift if thread.id in warp else 1
        values = np.array([label.get(key, 0) for key in thread.crossings], dtype=np.int64)
        following = np.roll(values, -1) if thread.closed else values[1:]
        steps = (following - values[: len(following)]) % size
        tally.at(f"thread {thread.label}").expect(
            np.all(steps == step % size) or np.all(steps == -step % size),
            f"its labels do not step by {step} from crossing to crossing",
        )
    # In a fabric that is its own mirror image, and where any shift will do, there is no hand.
    handed = plan.weave.pattern.count("/") == 2 and 2 * shift % size != 0
    edges_inverse = {edge: key for key, edge in edges.items()}
    links: dict[bool, set[frozenset[int]]] = {True: set(), False: set()}
    for thread in plan.threads:
        around_it = thread.crossings + thread.crossings[:1] * thread.closed
        links[thread.id in warp] |= {frozenset(pair) for pair in pairwise(around_it)}
    by_edge = {edges[key]: value for key, value in label.items() if key in edges}
    for turn in gap_turns(mesh):
        sides = four_along(turn)
        # Gaps of four crossings, each once.
        closed = (turn[sides[:, 3]] == sides[:, 0]) & (sides[:, 0] == sides.min(axis=1))
        for around in sides[closed].tolist():
            labels = [by_edge.get(keys[side]) for side in around]
            if None in labels:
                continue
            a, b, c, d = (value for value in labels if value is not None)
            place = tally.at(f"gap with the labels {a}, {b}, {c}, {d}")
            place.expect((a + c - b - d) % size == 0, "neighbours run apart around it")
            if handed:
                along = frozenset(edges_inverse[keys[side]] for side in around[:2])
                if (along in links[True]) != (along in links[False]):
                    _check_hand(place, (b - a, c - b), along in links[True], shift, size)


def _check_hand(
    place: Place, steps: tuple[int, int], warp_first: bool, shift: int, size: int
) -> None:
    """Check which way the diagonal rises, by two steps counter-clockwise round a gap.

    With the warp upright, the weft step leads to the right and the warp step up, or to the left
    and up; labels that fall to the right and rise upwards by as much repeat right above.
    """
    up, across = steps if warp_first else steps[::-1]
    right = -across if warp_first else across
    place.expect(
        (up + shift * right) % size == 0,
        f"its diagonal rises to the {'left' if shift > 0 else 'right'}",
    )


_TWILLS = ("twill", "triaxial", "twists")


def check_walks(job: Job, tally: Tally) -> None:
    """Check that threads are the walks of the mesh and crossings its inner edges."""
    plan, mesh = required(job.map), required(job.mesh)
    tally.at("job.toml").expect(
        job.boundary in ("end", "turn"),
        f"threads {job.boundary!r} at the boundary, which is neither 'end' nor 'turn'",
    )
    edges = job.edges
    for crossing in plan.crossings:
        tally.at(f"crossing {crossing.id}").expect(
            crossing.id in edges, f"{crossing.edge} is no inner edge of the woven mesh"
        )
    taken = Counter(edges.values())
    for side in mesh.inner.tolist():
        place = tally.at(f"edge {_edge_name(mesh, side)}")
        place.equal("its number of crossings", taken.get(side, 0), 1)
    passes, rest = job.passes
    for thread in plan.threads:
        kind = "closed" if thread.closed else "open"
        tally.at(f"thread {thread.label}").expect(
            thread.id in passes,
            f"{kind}, with {len(thread.crossings)} crossings, it is no walk of the woven mesh that "
            "another thread has not taken",
        )
    for walk in rest:
        first = _edge_name(mesh, walk.passes[0].side) if walk.passes else "none"
        tally.fail(
            f"a walk of {len(walk.passes)} crossings (first edge {first}) is no thread of the map"
        )


def _edge_name(mesh: LoadedMesh, side: int) -> str:
    """Name an edge by its vertices."""
    return f"{mesh.corner[side]}-{mesh.corner[mesh.next[side]]}"


def _way(over: bool) -> str:
    """Return the word for how a strand lies."""
    return "over" if over else "under"


def check_over_under(job: Job, tally: Tally) -> None:
    """Check that threads, crossings and stations agree on who is on top."""
    plan = required(job.map)
    strands: dict[int, list[tuple[int, bool]]] = defaultdict(list)
    for thread in plan.threads:
        for key, over in zip(thread.crossings, thread.over, strict=False):
            strands[key].append((thread.id, over))
    named: dict[tuple[str, int], tuple[int, bool]] = {}
    for crossing in plan.crossings:
        place = tally.at(f"crossing {crossing.id}")
        passes = sorted(strands[crossing.id], key=lambda strand: not strand[1])
        place.equal("the way it is passed", [_way(over) for _, over in passes], ["over", "under"])
        place.equal(
            "threads over and under",
            [crossing.over.thread, crossing.under.thread],
            [thread for thread, _ in passes],
        )
        for strand, over in ((crossing.over, True), (crossing.under, False)):
            name, at = strand.piece, strand.station
            place.expect((name, at) not in named, f"another names station {at} of {name}, too")
            named[name, at] = (crossing.id, over)
    _check_stations(plan, named, tally)


def _check_stations(
    plan: CrossingMap, named: dict[tuple[str, int], tuple[int, bool]], tally: Tally
) -> None:
    """Check that every station is named by its crossing, and the partners mutually."""
    for piece in plan.pieces:
        for at, station in enumerate(piece.stations):
            place = tally.at(f"piece {piece.id}", f"station {at} (crossing {station.crossing})")
            crossing = plan.crossing[station.crossing]
            strand = crossing.over if station.over else crossing.under
            other = crossing.under if station.over else crossing.over
            # Where a piece begins, the crossing names the piece that ends there.
            joint = plan.joint.get(station.joint) if at == 0 else None
            begins = joint is not None and joint.pieces == (strand.piece, piece.id)
            named_here = named.get((piece.id, at)) == (station.crossing, station.over)
            place.expect(
                strand.thread == piece.thread and (named_here or begins),
                f"it lies {_way(station.over)} in thread {piece.thread}, but the crossing names "
                f"thread {strand.thread}, station {strand.station} of piece {strand.piece} there",
            )
            place.equal("its partner", station.partner, other.piece)


def check_pattern(job: Job, tally: Tally) -> None:
    """Check the pattern that is claimed against over and under along the walks."""
    plan, mesh = required(job.map), required(job.mesh)
    passes, _ = job.passes
    for thread in plan.threads:
        if thread.id not in passes:
            tally.fail(f"thread {thread.label} is not checked, because it is no walk of the mesh")
    weave = tally.at("crossing_map.json", "weave")
    sense, torn = _senses(plan, mesh, passes)
    weave.expect(not torn, f"crossings have two strands over or two under: {torn[:4]}")
    counts, turned = (0, 0, 0), 0
    if plan.weave.pattern == "plain":
        _check_plain(plan, sense, tally)
    elif plan.weave.pattern in _TWILLS:
        counts, turned = broken_conditions(job, sense, tally)
        if plan.weave.rows:
            _check_rows(job, sense, tally)
    else:
        check_fabric(job, tally)
    for (name, claimed), counted in zip(sorted(plan.weave.broken.items()), counts, strict=True):
        weave.equal(f"the number of broken {name} conditions", claimed, counted)
    weave.equal("the rhythm broken at turns", plan.weave.broken_at_turns, turned)
    weave.equal("exact", plan.weave.exact, sum(counts) == 0)


#: Of each row modulo 4, how its edges are twisted: rows one and two against nought and three.
_TWISTED = (False, True, True, False)


def _check_rows(job: Job, sense: dict[int, bool], tally: Tally) -> None:
    """Check that the rows of crossings are those of rings, and that they give the twists.

    Rows around a quad are an even one, the odd one above it, the even one above that, and the odd
    one again; around a triangle an even one and twice the odd one above it; around any other
    polygon, or that at a minimum, all are the same even one. Sides at the boundary have no row.
    """
    plan, mesh, edges = required(job.map), required(job.mesh), job.edges
    rows = plan.weave.rows
    if len(rows) != len(plan.crossings) or not set(rows) <= {0, 1, 2, 3}:
        tally.fail(
            f"rings need a row from 0 to 3 for each of the {len(plan.crossings)} crossings, and "
            f"the map has {len(rows)}"
        )
        return
    row_of = {
        edges[crossing.id]: row
        for crossing, row in zip(plan.crossings, rows, strict=True)
        if crossing.id in edges
    }
    for edge, row in row_of.items():
        tally.at(f"edge {_edge_name(mesh, edge)}").expect(
            sense.get(edge) == _TWISTED[row], f"it is in row {row}, but twisted the other way"
        )
    keys = edge_keys(mesh).tolist()
    done: set[int] = set()
    for first in range(len(keys)):
        if first in done:
            continue
        sides = [first]
        while (side := int(mesh.next[sides[-1]])) != first:
            sides.append(side)
        done.update(sides)
        around = tuple(row_of.get(keys[side], -1) for side in sides)
        tally.at(f"face at side {_edge_name(mesh, first)}").expect(
            _ringed(around), f"its rows {around} are not those of a ring"
        )


def _ringed(rows: tuple[int, ...]) -> bool:
    """Tell whether rows around a face are those of rings; -1 stands for a side without a row.

    Examples
    --------
    >>> _ringed((0, 1, 2, 1)), _ringed((3, 2, 3)), _ringed((2, 2, 2, 2, 2)), _ringed((0, 1, 0, 1))
    (True, True, True, False)
    """
    size = len(rows)
    allowed = [(even,) * size for even in (0, 2)]
    if size == 4:
        allowed += [(low, low + 1, (low + 2) % 4, low + 1) for low in (0, 2)]
    if size == 3:
        allowed += [(low, low + 1, low + 1) for low in (0, 2)]
    turned = [one[turn:] + one[:turn] for one in allowed for turn in range(size)]
    return any(all(a in (-1, b) for a, b in zip(rows, one, strict=True)) for one in turned)


def _senses(
    plan: CrossingMap, mesh: LoadedMesh, passes: dict[int, tuple[Pass, ...]]
) -> tuple[dict[int, bool], list[int]]:
    """Return each edge's twist sense (true: forward strand on top) and the torn crossings."""
    keys = edge_keys(mesh)
    sense: dict[int, bool] = {}
    torn = []
    for thread in plan.threads:
        steps = passes.get(thread.id, ())
        for step, over, crossing in zip(steps, thread.over, thread.crossings, strict=False):
            value = step.forward == over
            if sense.setdefault(int(keys[step.side]), value) != value:
                torn.append(crossing)
    return sense, torn


def _check_plain(plan: CrossingMap, sense: dict[int, bool], tally: Tally) -> None:
    """Check that every thread alternates and that all crossings have one helical sense."""
    for thread in plan.threads:
        flags = np.array(thread.over, dtype=bool)
        following = np.roll(flags, -1) if thread.closed else flags[1:]
        same = np.flatnonzero(flags[: len(following)] == following)
        tally.at(f"thread {thread.label}").expect(
            len(same) == 0,
            f"it does not alternate over and under at {len(same)} places, first after crossing "
            f"{thread.crossings[same[0]] if len(same) else None}",
        )
    tally.count(len(sense))
    ones = sum(sense.values())
    if 0 < ones < len(sense):
        tally.fail(f"{ones} crossings twist one way and {len(sense) - ones} the other")
