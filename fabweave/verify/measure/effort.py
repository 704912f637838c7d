"""Work out again what it takes to place each piece, in any order of assembly.

The unit is laying a strand over one that is in place. The proportions are a judgement, taken over;
what they come to is counted here by placing one piece after another.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from itertools import zip_longest

from fabweave.verify.crossing_map import CrossingMap, Piece

#: Slide a tip below a strand; slide below any other strand, and so much more for each station from
#: there to the tip, and for each strand that is on the way.
_TIP, _INNER, _STATION, _HELD = 2.0, 6.0, 0.25, 1.0
#: Join an end; fit a piece whose ends both have their mates in place.
_JOIN, _FIT = 1.0, 3.0
#: Hold a piece that meets nothing, or one, two or three things.
_HOLD = (8.0, 6.0, 3.0, 1.0)


def parts_of(plan: CrossingMap) -> dict[str, str]:
    """Return for each piece the piece that stands for all that it hangs together with."""
    above = {piece.id: piece.id for piece in plan.pieces}

    def top(name: str) -> str:
        while above[name] != name:
            above[name] = above[above[name]]
            name = above[name]
        return name

    at: dict[int, str] = {}
    for piece in plan.pieces:
        for station in piece.stations:
            above[top(piece.id)] = top(at.setdefault(station.crossing, piece.id))
    for joint in plan.joints:
        above[top(joint.pieces[0])] = top(joint.pieces[1])
    return {name: top(name) for name in above}


def thread_by_thread(plan: CrossingMap) -> list[str]:
    """Return the naive order: all pieces of the first thread, then those of the next."""
    return [name for thread in plan.threads for name in thread.pieces]


def number_by_number(plan: CrossingMap) -> list[str]:
    """Return the naive order: the first pieces of all threads, then the second ones."""
    rounds = zip_longest(*(thread.pieces for thread in plan.threads))
    return [name for names in rounds for name in names if name is not None]


def efforts_of_order(
    plan: CrossingMap, order: Iterable[str], parts: Mapping[str, str], *, enclosed: bool
) -> list[float]:
    """Return the effort of each piece of an order, in units of laying over one strand.

    Parameters
    ----------
    plan : CrossingMap
    order : iterable of str
        Names of pieces, each once.
    parts : mapping
        As :func:`parts_of` returns them.
    enclosed : bool
        Whether the surface is closed: from the middle of each part on, hands come to its inside
        ever less, and at its last piece work there takes twice as much.
    """
    carriers: dict[tuple[int, bool], set[str]] = {}
    for piece in plan.pieces:
        for station in piece.stations:
            carriers.setdefault((station.crossing, station.over), set()).add(piece.id)
    sizes, done = Counter(parts.values()), Counter[str]()
    there: set[str] = set()
    efforts = []
    for name in order:
        there.add(name)
        outside, inside = _work(plan, plan.piece[name], carriers, there)
        part = parts[name]
        done[part] += 1
        late = max(0.0, 2.0 * done[part] / sizes[part] - 1.0) if enclosed else 0.0
        efforts.append(outside + inside * (1.0 + late))
    return efforts


def _work(
    plan: CrossingMap,
    piece: Piece,
    carriers: Mapping[tuple[int, bool], set[str]],
    there: set[str],
) -> tuple[float, float]:
    """Return the effort in front of a piece that is placed, and that behind strands."""
    met = [
        at
        for at, station in enumerate(piece.stations)
        if not there.isdisjoint(carriers.get((station.crossing, not station.over), ()))
    ]
    under = [at for at in met if not piece.stations[at].over]
    joined = sum(
        joint is not None and plan.joint[joint].pieces[side] in there
        for side, joint in enumerate(piece.joints)
    )
    things = len(met) + joined
    outside = len(met) - len(under) + (_FIT if joined == 2 else 0.0)
    outside += _HOLD[things] if things < len(_HOLD) else 0.0
    count = len(piece.stations)
    inside = _JOIN * joined
    from_start = [at for at in under if 2 * at < count]
    from_end = [count - 1 - at for at in reversed(under) if 2 * at >= count]
    for depths in (from_start, from_end):
        for held, depth in enumerate(depths):
            inside += (_INNER + _STATION * depth if depth else _TIP) + _HELD * held
    return outside, inside
