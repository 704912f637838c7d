"""Let words agree with a number."""

import re

_CHOICE = re.compile(r"\[([^|\[\]]*)\|([^|\[\]]*)\]")


def agree(count: int, text: str) -> str:
    """Return a text in which words agree with a number.

    Parameters
    ----------
    count : int
        The number.
    text : str
        ``{n}`` becomes the number, and each ``[one|many]`` the word for one or for any other
        number.

    Examples
    --------
    >>> agree(1, "{n} [face has|faces have] no area"), agree(2, "{n} [face has|faces have] no area")
    ('1 face has no area', '2 faces have no area')
    """
    one = count == 1
    chosen = _CHOICE.sub(lambda found: found[1] if one else found[2], text)
    return chosen.replace("{n}", str(count))
