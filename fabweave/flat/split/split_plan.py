"""Hold where the threads of a job are cut."""

from fabweave.core.arrays import frozen_value
from fabweave.flat.split.length_curve import Choice
from fabweave.flat.split.runs import Runs


@frozen_value
class SplitPlan:
    """Where a job's threads are cut.

    Parameters
    ----------
    runs : Runs
        The passes of each piece.
    length_mm : float
        The greatest length that was chosen or asked for.
    choices : tuple of Choice
        What several greatest lengths come to, as predicted.
    chosen : Choice
        What the length that was taken comes to: as these runs are, before anything is nested.
    prefer : str or None
        By which preference one of the choices was taken; None if a length was asked for.
    likes : bool
        Whether threads are cut so that pieces repeat that no rotation carries onto one another.
    """

    runs: Runs
    length_mm: float
    choices: tuple[Choice, ...]
    chosen: Choice
    prefer: str | None
    likes: bool = False
