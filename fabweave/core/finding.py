"""Hold what was found of a mesh or a job, whoever found it, and who has to know it."""

from collections.abc import Iterable
from typing import Any, Literal, Self, TypeAlias

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


class Note(str):
    """What a maker should know of a job: a text, the rule that it is of, and who must read it.

    It is its text, whole, so that files hold it and Python users read it as such. Nobody changes
    it.

    Parameters
    ----------
    rule : str
        A fixed name for programs, such as ``fairing``.
    text : str
        What everybody should read.
    more : str
        Further sentences, for those who ask for them.
    detail : bool
        Whether all of it is for those: figures, what verdict and totals say again, and advice that
        changes nothing in the job.

    Examples
    --------
    >>> note = Note("fasteners", "fasteners (joints): at 8 of 20 crossings", "The weave holds")
    >>> note, note.text
    ('fasteners (joints): at 8 of 20 crossings. The weave holds', \
'fasteners (joints): at 8 of 20 crossings')
    """

    __slots__ = ("detail", "more", "rule", "text")
    rule: str
    text: str
    more: str
    detail: bool

    def __new__(cls, rule: str, text: str, more: str = "", detail: bool = False) -> Self:
        """Join what everybody should read, and the rest."""
        note = super().__new__(cls, f"{text}. {more}" if more else text)
        note.rule, note.text, note.more, note.detail = rule, text, more, detail
        return note

    @classmethod
    def each(cls, rule: str, texts: Iterable[str]) -> list[Self]:
        """Return texts as notes of a rule; those that are notes already stay what they are."""
        return [text if isinstance(text, cls) else cls(rule, text) for text in texts]

    def __getnewargs__(self) -> tuple[Any, ...]:
        """Return what it is made of, for processes."""
        return self.rule, self.text, self.more, self.detail
