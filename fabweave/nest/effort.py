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
    rotations : int
        Angles that are tried, evenly spread; a divisor of 720 and a multiple of 4.
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
        How often what is left of a side of the last sheet is halved, to leave a larger rest.
    """

    pixel_mm: float
    rotations: int
    failures: int
    same_size: float
    rounds: int
    patience: int
    density: float
    halvings: int


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
    efforts = {
        "quick": Effort(2.0, 20, 40, 0.9, 0, 0, 0.0, 0),
        "normal": Effort(1.25, 24, 40, 0.9, 200, 40, 0.7, 0),
        "best": Effort(1.0, 24, 60, 0.93, 900, 120, 0.8, 4),
    }
    if name not in efforts:
        raise InputError(f"no effort is called {name!r}: choose one of {', '.join(efforts)}")
    return efforts[name]
