"""Hold what was found wrong with a job, whoever found it, and how grave that is."""

from typing import Literal, TypeAlias

from fabweave.core.records import record

Level: TypeAlias = Literal["makeable", "with care", "not makeable"]


@record
class Finding:
    """A rule that is not kept, what that means to whoever builds the object, and what cures it.

    ``where`` names the piece and the place on its sheet, or the thread and the crossing; it is
    empty where the whole object is meant.

    Examples
    --------
    >>> Finding(rule="bodies", level="with care", text="there are 2 bodies", cure="keep one").told
    'there are 2 bodies (keep one)'
    """

    rule: str
    level: Level
    text: str
    cure: str = ""
    where: str = ""

    @property
    def told(self) -> str:
        """The finding in words, and what cures it."""
        return f"{self.text} ({self.cure})" if self.cure else self.text
