"""Find the pages of the guide, and make them ready for a terminal."""

import re
from importlib import resources

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
    """Return the page of one of the ``TOPICS``, as Markdown.

    Examples
    --------
    >>> page("weaves").splitlines()[0]
    '# Weaves'
    """
    return resources.files(__package__).joinpath(f"{topic}.md").read_text("utf-8")


def summary(markdown: str) -> str:
    r"""Return what a page is about: the first sentence under its title.

    Examples
    --------
    >>> summary("# Joints\n\nHow pieces\nare joined. More.\n\nAnd more.")
    'How pieces are joined.'
    """
    sentence, stop, _ = " ".join(markdown.split("\n\n")[1].split()).partition(". ")
    return sentence + stop.strip()


def for_terminal(markdown: str) -> str:
    r"""Return a page without what only a web page can show.

    Examples
    --------
    >>> for_terminal("See [joints](joints.md).\n\n<!-- not run: slow -->\n```sh\n")
    'See joints.\n\n```sh\n'
    """
    return _LINK.sub(r"\1", _HIDDEN.sub("", markdown))
