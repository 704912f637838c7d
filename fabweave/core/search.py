"""Hold how hard a job looks for good answers."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Search:
    """How hard the searches of a job look, and from where they begin.

    Parameters
    ----------
    effort : str
        ``quick``, ``normal`` or ``best``.
    seed : int
        Of all random numbers.
    layout : str or None
        A crossing map whose layout is kept instead of looking for one.
    pin : str or None
        Pieces that stay where they were put, see :func:`fabweave.nest.pins.parse_pins`.
    """

    effort: str
    seed: int
    layout: str | None = None
    pin: str | None = None
