"""Say that a rule does not hold: which, how bad it is, what would cure it, and where."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

#: Whether a thing cannot be made with what was found, or can with care.
Level: TypeAlias = Literal["refuse", "warn"]


@dataclass(frozen=True)
class Finding:
    """One rule that does not hold.

    Parameters
    ----------
    rule : str
        A fixed name for programs, such as ``non-manifold-edge``.
    level : "refuse" or "warn"
        Whether the thing cannot be made with it, or can with care.
    text : str
        What is wrong, in a maker's words, with the count.
    cure : str
        What to do about it.
    where : str
        The first few places; empty where there is none.

    Examples
    --------
    >>> print(Finding("lone-face", "warn", "1 face has no neighbour", "delete it", "face 3"))
    1 face has no neighbour (face 3): delete it
    """

    rule: str
    level: Level
    text: str
    cure: str
    where: str = ""

    def __str__(self) -> str:
        """Return one line: what, where, and what to do."""
        at = f" ({self.where})" if self.where else ""
        return f"{self.text}{at}: {self.cure}"
