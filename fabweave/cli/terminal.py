"""Write text to terminals and files that cannot show every letter."""

import codecs
from typing import TextIO

#: Signs that we write, and what they become where only ASCII is known.
_PLAIN = {
    "×": "x",
    "…": "...",
    "→": "->",
    "–": "-",
    "—": "-",
    "−": "-",
    "·": "-",
    "•": "-",
    "°": " deg",
    "µ": "u",
    "²": "2",
    "³": "3",
    "≥": ">=",
    "≤": "<=",
    "‘": "'",
    "’": "'",
    "“": '"',
    "”": '"',
}
_NAME = "fabweave.plain"
#: How a verdict looks where there is colour.
VERDICT_STYLES = {
    "makeable": "bold green",
    "with care": "bold yellow",
    "not makeable": "bold red",
}


def plain_letters(error: UnicodeError) -> tuple[str, int]:
    """Return plain signs for what an encoding does not have, as codecs ask for it.

    Bytes of a file's name that are not UTF-8, and letters that have no like, become numbers.

    Examples
    --------
    >>> codecs.register_error("doctest.plain", plain_letters)
    >>> "3 × 4 mm² … ж\\udcff".encode("ascii", "doctest.plain")
    b'3 x 4 mm2 ... \\\\u0436\\\\udcff'
    """
    if not isinstance(error, UnicodeEncodeError):
        raise error
    letters = error.object[error.start : error.end]
    plain = "".join(
        _PLAIN.get(letter) or letter.encode("ascii", "backslashreplace").decode()
        for letter in letters
    )
    return plain, error.end


def speak_plainly(stream: TextIO) -> None:
    """Let a stream write something legible for letters that its encoding does not have."""
    codecs.register_error(_NAME, plain_letters)
    reconfigure = getattr(stream, "reconfigure", None)  # what stands in for a stream may lack it
    if reconfigure is not None:
        reconfigure(errors=_NAME)
