"""Say how hard it is to put a piece into its place: the model behind the assembly order.

The unit is laying a strand over one that is in place, hole on hole. The other figures are
judgements, in the proportions of the craft that knows the task best, the six-way caning of chairs.
There the first three layers are laid one upon the other, and only the fourth is woven, over one
and under the other strands that lie there; per hole that takes six to ten times as long, with one
hand above the seat and one below, the strand drawn through at its full length, and where it is
tight one strand at a time.

What is left out: a strand whose end is still free may be lifted instead, so an order may be easier
than its figure says, never harder.

References
----------
Wayne Sharp, "Chair Caning", steps 1 to 4, Minnesota State University, Mankato; Dean B., "Caning
progress", rollingonone.com (six or ten times as long). For strips that drag at every bend: the
capstan equation, by which friction grows with each.
"""

from dataclasses import dataclass

#: Lay the piece over a strand that is in place.
LAY = 1.0
#: Slide the tip of the piece, at its first or last station, below a strand that is in place.
TUCK = 2.0
#: Slide the piece below a strand in place anywhere else: lift the strand, find the tip again.
THREAD = 6.0
#: Draw the piece on by one more station: added for each between the strand and the piece's tip.
PULL = 0.25
#: Draw the piece on below one more strand that holds it: added for each between there and the tip.
DRAG = 1.0
#: Lap an end on its mate and fasten it.
JOIN = 1.0
#: Both ends have their mates in place: the piece must be bowed in, and fit.
CLOSE = 3.0
#: Hold a piece in place that touches nothing, or one, two or three things; four hold it well.
LOOSE = (8.0, 6.0, 3.0, 1.0)
#: At the last piece of a closed surface no hand comes to the inside: sliding below and joining cost
#: this much more, from nothing when half of the pieces are in place.
REACH = 1.0


@dataclass(frozen=True)
class State:
    """What is in place where a piece is to go, as bits of one integer.

    Each thing has a bit of its own, so things come and go by exclusive or. A strand has two bits,
    because two pieces may carry it, lapped at a joint.

    Parameters
    ----------
    n_stations : int
        How many stations the piece has.
    """

    n_stations: int

    def strand(self, station: int, *, over: bool, second: bool) -> int:
        """Return the bit of a strand at a station; ``over``: the piece goes over that strand."""
        return 1 << (station + self.n_stations * (2 * over + second))

    def mate(self, *, end: bool) -> int:
        """Return the bit of the mate at the piece's beginning or end."""
        return 1 << (4 * self.n_stations + end)


def piece_effort(n_stations: int, state: int) -> tuple[float, float]:
    """Return the effort to place a piece, and the part of it that reaching adds to.

    Parameters
    ----------
    n_stations : int
        How many stations the piece has.
    state : int
        What is in place, see ``State``.

    Returns
    -------
    plain : float
        Laying over, closing, holding.
    behind : float
        What a hand on the inside helps: joining, and sliding below strands, each of which costs
        more the farther it is from the nearer end, and the more strands hold the piece on the way.

    Examples
    --------
    >>> bits = State(5)
    >>> alone = piece_effort(5, 0)
    >>> laid = piece_effort(5, sum(bits.strand(k, over=True, second=False) for k in range(5)))
    >>> tips = piece_effort(5, sum(bits.strand(k, over=False, second=False) for k in (0, 4)))
    >>> middle = piece_effort(5, bits.strand(2, over=False, second=False))
    >>> alone, laid, tips, middle
    ((8.0, 0.0), (5.0, 0.0), (3.0, 4.0), (6.0, 6.5))
    """
    all_stations = (1 << n_stations) - 1
    under = (state | state >> n_stations) & all_stations
    over = (state >> 2 * n_stations | state >> 3 * n_stations) & all_stations
    joined = (state >> 4 * n_stations).bit_count()
    met = over.bit_count() + under.bit_count() + joined
    plain = over.bit_count() * LAY
    plain += CLOSE * (joined == 2) + (LOOSE[met] if met < len(LOOSE) else 0.0)
    behind = joined * JOIN
    half = (n_stations + 1) // 2
    for stations, from_end in ((under & (1 << half) - 1, False), (under >> half, True)):
        held, left = 0, stations
        while left:
            bit = left.bit_length() - 1 if from_end else (left & -left).bit_length() - 1
            left ^= 1 << bit
            away = n_stations - 1 - half - bit if from_end else bit
            behind += (THREAD + PULL * away if away else TUCK) + DRAG * held
            held += 1
    return plain, behind


def reach(place: float) -> float:
    """Return the factor of work behind strands when a share ``place`` of a closed surface is there.

    Examples
    --------
    >>> reach(0.3), reach(0.75), reach(1.0)
    (1.0, 1.5, 2.0)
    """
    return 1.0 + REACH * max(0.0, 2.0 * place - 1.0)
