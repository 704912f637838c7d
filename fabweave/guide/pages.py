"""Find the pages of the guide, and make them ready for a terminal."""

import re
from importlib import resources

from fabweave.core.messages import one_named

#: In the order in which a reader needs them. The page of a topic is the file of its name.
TOPICS = (
    "design",
    "weaves",
    "joints",
    "stock",
    "machines",
    "assembling",
    "files",
    "python",
    "troubleshooting",
)
#: Notes to whoever tests the pages, and pictures; a terminal shows neither.
_HIDDEN = re.compile(r"(?:<!--.*?-->|!\[[^\]]*\]\([^)]*\))\n*", re.DOTALL)
#: Links to other pages and to files of the repository lead nowhere from a terminal.
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:)[^)]*\)")


def page(topic: str) -> str:
    """Return the page of a topic, as Markdown.

    Raises
    ------
    InputError
        If there is no such topic; the message lists all, the closest first.

    Examples
    --------
    >>> page("weaves").splitlines()[0]
    '# Weaves'
    """
    name = one_named("topic of the guide", topic, {name: name for name in TOPICS})
    return resources.files(__package__).joinpath(f"{name}.md").read_text("utf-8")


def summary(markdown: str) -> str:
    """Return what a page is about: the paragraph under its title, in one line.

    Examples
    --------
    >>> summary("# Joints\\n\\nHow pieces\\nare joined.\\n\\nMore.")
    'How pieces are joined.'
    """
    return " ".join(markdown.split("\n\n")[1].split())


def for_terminal(markdown: str) -> str:
    """Return a page without what only a web page can show.

    Examples
    --------
    >>> for_terminal("See [joints](joints.md).\\n\\n<!-- not run: slow -->\\n```sh\\n")
    'See joints.\\n\\n```sh\\n'
    """
    return _LINK.sub(r"\1", _HIDDEN.sub("", markdown))
