"""Read texts in order and hold each to what it should say."""

import re
from collections.abc import Collection, Sequence

from fabweave.verify.statement import Place

#: So many letters of a text are told in a finding.
_LETTERS = 100


def printed(text: str) -> str:
    """Return a text as fonts with the Latin alphabet of Windows have it.

    Examples
    --------
    >>> printed("12 mm²"), printed("π")
    ('12 mm²', '?')
    """
    return text.encode("cp1252", "replace").decode("cp1252")


class RunningText:
    """Texts in order, each of which is to be the one that is due.

    The first that is not is a finding, and what follows it is not looked at.

    Examples
    --------
    >>> from fabweave.verify.statement import Tally
    >>> tally = Tally("manual")
    >>> text = RunningText(["Lay A1", "over B2.", "Step 7"], tally.at("Steps"))
    >>> text.block("Lay A1 over B2.")
    True
    >>> text.block("Step 2")
    False
    >>> tally.result().findings
    ("Steps: it says 'Step 7', but should say 'Step 2'",)
    """

    def __init__(self, texts: Sequence[str], place: Place) -> None:
        self._texts, self.place = texts, place
        self._at, self._lost = 0, False

    @property
    def lost(self) -> bool:
        """Whether something else was said than was due."""
        return self._lost

    @property
    def next(self) -> str:
        """The text that comes next; empty at the end, or after something that was not due."""
        return "" if self._lost or self._at >= len(self._texts) else self._texts[self._at]

    def block(self, *wanted: str) -> bool:
        """Read one of some texts, which may be broken into lines between its words."""
        return self._go_on(self._end_of(wanted), " or ".join(map(repr, wanted)))

    def skip(self, *wanted: str) -> bool:
        """Read one of some texts if it comes next."""
        end = None if self._lost else self._end_of(wanted)
        return end is not None and self._go_on(end, "")

    def match(self, pattern: str, due: str) -> re.Match[str] | None:
        """Read one text that has a pattern; ``due`` says in findings what it is."""
        found = re.fullmatch(pattern, self.next)
        self._go_on(self._at + 1 if found else None, due)
        return None if self._lost else found

    def some_of(self, names: Collection[str]) -> list[str]:
        """Read texts as long as they are among some names."""
        start = self._at
        while self.next in names:
            self._at += 1
        return list(self._texts[start : self._at])

    def end(self) -> bool:
        """Require that nothing more is said."""
        return self._go_on(self._at if self._at >= len(self._texts) else None, "nothing more")

    def _end_of(self, wanted: Sequence[str]) -> int | None:
        """Return where the lines of one of some texts end; None if none of them comes next."""
        for text in map(printed, wanted):
            said, end = "", self._at
            while end < len(self._texts) and len(said) < len(text):
                said, end = f"{said} {self._texts[end]}" if said else self._texts[end], end + 1
                if said == text:
                    return end
                if not text.startswith(f"{said} "):
                    break
        return None

    def _go_on(self, end: int | None, due: str) -> bool:
        """Go on behind what was due, or tell that it is not there."""
        if self._lost:
            return False
        self.place.count()
        if end is None:
            said = repr(self.next[:_LETTERS]) if self._at < len(self._texts) else "nothing more"
            self.place.fail(f"it says {said}, but should say {due[: 2 * _LETTERS]}")
            self._lost = True
            return False
        self._at = end
        return True
