"""Check the labels that prove a twill over a and under b, or a satin."""

import math
import re
from itertools import pairwise

import numpy as np

from fabweave.verify.crossing_map import CrossingMap
from fabweave.verify.measure.twill import gap_orbits
from fabweave.verify.measure.walks import LoadedMesh
from fabweave.verify.statement import Place, Tally

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


def check_fabric(
    plan: CrossingMap, mesh: LoadedMesh, edges: dict[int, int], keys: list[int], tally: Tally
) -> None:
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
    fabric = read_fabric(plan.weave.pattern)
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
    for orbits in gap_orbits(mesh):
        for orbit, closed in orbits:
            around = [by_edge.get(keys[side]) for side in orbit]
            if not closed or len(around) != 4 or None in around:
                continue
            a, b, c, d = (value for value in around if value is not None)
            place = tally.at(f"gap with the labels {a}, {b}, {c}, {d}")
            place.expect((a + c - b - d) % size == 0, "neighbours run apart around it")
            if handed:
                first, second = (edges_inverse[keys[side]] for side in orbit[:2])
                along = frozenset((first, second))
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
