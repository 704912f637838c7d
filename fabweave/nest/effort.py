"""Say how hard nesting looks, in counts, so that a result never depends on the machine."""

from dataclasses import dataclass

from fabweave.core.errors import InputError


@dataclass(frozen=True)
class Effort:
    """How hard to look: all counts, so that a result never depends on the machine.

    Parameters
    ----------
    pixel_mm : float
        Side of a pixel.
    angles : int
        How many angles are tried, evenly spread: a divisor of 720 and a multiple of 4.
    failures : int
        How many pieces may fail on a sheet before it is closed.
    same_size : float
        A piece at least this share as long and as wide as one that failed is not tried.
    rounds : int
        How many rounds are spent on emptying a sheet, at most.
    patience : int
        How many of them may pass without any success.
    density : float
        No sheet is emptied if the pieces, grown by half the gap, would take more than this share
        of the others.
    halvings : int
        How often what may be left of a side of the last sheet is halved, so that more of it is left
        over.
    """

    pixel_mm: float
    angles: int
    failures: int
    same_size: float
    rounds: int
    patience: int
    density: float
    halvings: int


#: By name. The figures are choices of ours, between what they gain on the piece sets of
#: tests/benchmarks/bench_nesting.py and what they cost.
EFFORTS = {
    "quick": Effort(
        pixel_mm=2.0, angles=20, failures=40, same_size=0.9,
        rounds=0, patience=0, density=0.0, halvings=0,
    ),
    "normal": Effort(
        pixel_mm=1.25, angles=24, failures=40, same_size=0.9,
        rounds=200, patience=40, density=0.7, halvings=0,
    ),
    "best": Effort(
        pixel_mm=1.0, angles=24, failures=60, same_size=0.93,
        rounds=900, patience=120, density=0.8, halvings=4,
    ),
}  # fmt: skip

#: To say how many sheets will be needed, and not to cut: twice as fast as ``quick``. Of 17 jobs of
#: 12 to 80 pieces it took as many sheets as that for 15, one more for one, and one less for one.
ROUGH = Effort(
    pixel_mm=3.0, angles=20, failures=20, same_size=0.9,
    rounds=0, patience=0, density=0.0, halvings=0,
)  # fmt: skip


def effort_named(name: str) -> Effort:
    """Return the settings of an effort: ``quick``, ``normal`` or ``best``.

    Raises
    ------
    InputError
        If there is no such effort.

    Examples
    --------
    >>> effort_named("quick").pixel_mm
    2.0
    """
    if name not in EFFORTS:
        raise InputError(f"no effort is called {name!r}: choose one of {', '.join(EFFORTS)}")
    return EFFORTS[name]
