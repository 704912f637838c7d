"""Hold what was found wrong with a mesh or a job, whoever found it, and how grave that is."""

from typing import Literal, TypeAlias

from fabweave.core.records import record

Level: TypeAlias = Literal["makeable", "with care", "not makeable"]


@record
class Finding:
    """A rule that is not kept, what that means to whoever builds the object, and what cures it.

    Parameters
    ----------
    rule : str
        A fixed name for programs, such as ``non-manifold-edge``.
    level : "makeable", "with care" or "not makeable"
        What can be made in spite of it.
    text : str
        What is wrong, in a maker's words, with the count.
    cure : str
        What to do about it.
    where : str
        The piece and the place on its sheet, the thread and the crossing, or the first few faces;
        empty where the whole object is meant.

    Examples
    --------
    >>> lone = Finding(rule="lone-face", level="with care", text="1 face has no neighbour",
    ...                cure="delete it", where="face 3")
    >>> print(lone)
    1 face has no neighbour (face 3): delete it
    >>> lone.told
    '1 face has no neighbour (delete it)'
    """

    rule: str
    level: Level
    text: str
    cure: str = ""
    where: str = ""

    def __str__(self) -> str:
        """Return one line: what, where, and what to do."""
        at = f" ({self.where})" if self.where else ""
        return f"{self.text}{at}: {self.cure}"

    @property
    def told(self) -> str:
        """The finding in words, and what cures it."""
        return f"{self.text} ({self.cure})" if self.cure else self.text
