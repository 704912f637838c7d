"""Hold where the threads of a job are cut."""

from dataclasses import dataclass

from fabweave.flat.split.length_curve import Choice
from fabweave.flat.split.runs import Runs


@dataclass(frozen=True, eq=False)
class Plan:
    """Where a job's threads are cut.

    Parameters
    ----------
    runs : Runs
        The passes of each piece.
    length_mm : float
        The greatest length that was chosen or asked for.
    choices : tuple of Choice
        What several greatest lengths come to, as predicted.
    """

    runs: Runs
    length_mm: float
    choices: tuple[Choice, ...]
