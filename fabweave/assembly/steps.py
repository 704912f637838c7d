"""Write down the steps of the assembly: what goes where, over and under what, in words."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from fabweave.assembly.order.planning import Order
from fabweave.flat.pieces import PieceSet

#: Pieces that are only laid down go into one step while it makes at most so many connections ...
_MOST_TOGETHER = 8
#: ... and has at most so many pieces.
_MOST_PIECES = 4


@dataclass
class _Placed:
    """What happens when a piece is placed; lists are in the order of its stations."""

    piece: int
    effort: float
    made: list[int] = field(default_factory=list)
    over: list[int] = field(default_factory=list)
    under: list[int] = field(default_factory=list)
    joints: list[int] = field(default_factory=list)
    fasten: list[int] = field(default_factory=list)
    closes: bool = False
    text: str = ""

    @property
    def connections(self) -> int:
        """How many crossings and joints are made."""
        return len(self.over) + len(self.under) + len(self.joints)


def build_steps(made: PieceSet, order: Order) -> list[dict[str, Any]]:
    """Build the steps of an order: one piece each, or a few that are only laid down.

    Parameters
    ----------
    made : PieceSet
        All pieces and joints of the job.
    order : Order
        The order of its pieces.

    Returns
    -------
    list of dict
        For each step: ``step``, ``pieces`` in the order in which they are placed, ``crossings``
        that are made (both strands are there for the first time), ``over`` and ``under``: crossings
        at which a new piece lies over, or slides below, what is in place; ``joints`` that are made;
        ``fasten``: crossings at which the last layer has come; ``closes``: a piece is joined at
        both ends; ``effort``; and ``text``.
    """
    steps: list[dict[str, Any]] = []
    for group in _grouped(_place_all(made, order)):
        steps.append(
            {
                "step": len(steps) + 1,
                "pieces": [made.pieces[one.piece].id for one in group],
                "crossings": [key for one in group for key in one.made],
                "over": [key for one in group for key in one.over],
                "under": [key for one in group for key in one.under],
                "joints": [key for one in group for key in one.joints],
                "fasten": [key for one in group for key in one.fasten],
                "closes": any(one.closes for one in group),
                "effort": round(sum(one.effort for one in group), 2),
                "text": " ".join(one.text for one in group),
            }
        )
    return steps


def _grouped(placed: Sequence[_Placed]) -> list[list[_Placed]]:
    """Put pieces that follow one another and are only laid down together."""
    groups: list[list[_Placed]] = []
    for one in placed:
        last = groups[-1] if groups else None
        if (
            last is None
            or one.under
            or any(other.under for other in last)
            or len(last) == _MOST_PIECES
            or sum(other.connections for other in last) + one.connections > _MOST_TOGETHER
        ):
            groups.append([one])
        else:
            last.append(one)
    return groups


def _place_all(made: PieceSet, order: Order) -> list[_Placed]:
    """Place the pieces one after another."""
    pieces = made.pieces
    carriers: dict[tuple[int, bool], set[int]] = {}
    layers: dict[int, int] = {}
    for number, piece in enumerate(pieces):
        for strand in zip(piece.crossings.tolist(), piece.over.tolist(), strict=True):
            carriers.setdefault(strand, set()).add(number)
            layers[strand[0]] = layers.get(strand[0], 0) + 1
    joints = {joint.id: joint for joint in made.joints}
    there: set[int] = set()
    crossed: set[int] = set()
    result = []
    for number, effort in zip(order.order.tolist(), order.effort.tolist(), strict=True):
        piece = pieces[number]
        there.add(number)
        one = _Placed(number, effort)
        names: dict[str, list[str]] = {"over": [], "start": [], "end": []}
        half = len(piece.crossings) / 2
        for station, (crossing, over) in enumerate(
            zip(piece.crossings.tolist(), piece.over.tolist(), strict=True)
        ):
            layers[crossing] -= 1
            if layers[crossing] == 0:
                one.fasten.append(crossing)
            others = sorted(carriers.get((crossing, not over), set()) & there)
            if not others:
                continue
            if crossing not in crossed:
                crossed.add(crossing)
                one.made.append(crossing)
            listed = one.over if over else one.under
            if crossing not in listed:
                listed.append(crossing)
            way = "over" if over else "start" if station < half else "end"
            names[way] += [pieces[other].id for other in others]
        ways = []
        for joint, mate in ((piece.start_joint, 0), (piece.end_joint, 1)):
            if joint is None or joints[joint].pieces[mate] not in there:
                continue
            if joint not in one.joints:
                one.joints.append(joint)
            other = joints[joint].pieces[mate]
            name = (
                f"its own {'end' if mate == 0 else 'start'}"
                if other == number
                else pieces[other].id
            )
            ways.append(f"{joints[joint].kind.ties[1 - mate].format(name)} at joint #{joint}")
        one.closes = len(ways) == 2
        names["start"].reverse()  # a tip that is pushed outward meets the inner strands first
        # A piece that is joined to itself is joined once.
        one.text = _say(piece.id, names, ways[: len(one.joints)], closes=one.closes)
        result.append(one)
    return result


def _say(piece: str, names: dict[str, list[str]], joined: Sequence[str], *, closes: bool) -> str:
    """Say in plain words how a piece is placed."""
    if not joined and not any(names.values()):
        return f"Begin with {piece}, its engraved side outward."
    over = list(dict.fromkeys(names["over"]))
    said = [f"Lay {piece} over {_list(over)}" if over else f"Take {piece}"]
    for end in ("start", "end"):
        if names[end]:
            said.append(f"slide its {end} under {_list(list(dict.fromkeys(names[end])))}")
    said += joined
    if closes:
        said.append("this closes the gap")
    return "; ".join(said) + "."


def _list(names: Sequence[str]) -> str:
    """Join names with commas and a last 'and'."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def last_tenth(steps: Sequence[dict[str, Any]]) -> float:
    """Return how hard the last pieces are: their mean effort, as a multiple of that of all.

    The last pieces are those of the fewest last steps that have a tenth of all pieces.

    Examples
    --------
    >>> steps = [{"pieces": ["A1"] * 9, "effort": 9.0}, {"pieces": ["A2"], "effort": 4.0}]
    >>> round(last_tenth(steps), 4)
    3.0769
    """
    pieces = sum(len(step["pieces"]) for step in steps)
    effort = sum(step["effort"] for step in steps)
    count, spent = 0, 0.0
    for step in reversed(steps):
        if 10 * count >= pieces:
            break
        count += len(step["pieces"])
        spent += step["effort"]
    return float(spent / count / (effort / pieces)) if effort else 1.0


def order_note(order: Order, steps: Sequence[dict[str, Any]]) -> str:
    """Say what the order costs, what naive orders would, and how hard the end is."""
    return (
        f"assembly: effort {order.total:.0f}, where 1 is a strand laid over another, "
        f"{order.saved:.0%} less than the better of two naive orders ({order.by_thread:.0f} "
        f"thread by thread, {order.by_number:.0f} by piece number); a piece of the last tenth "
        f"takes {last_tenth(steps):.1f} times the mean"
    )
