"""The command that shows the guide."""

import re
import textwrap
from collections.abc import Callable
from functools import partial
from importlib import resources

import click

from fabweave.core.parallel.interrupt import held_back
from fabweave.options.option import SECTIONS, Option
from fabweave.options.table import OPTIONS

#: In the order in which a reader needs them. The page of a topic is the file of its name.
TOPICS = (
    "studio",
    "design",
    "meshes",
    "openings",
    "materials",
    "weaves",
    "twill",
    "straight",
    "pieces",
    "joints",
    "fasteners",
    "form",
    "stock",
    "machines",
    "services",
    "assembling",
    "former",
    "batch",
    "files",
    "map",
    "python",
    "mending",
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
    return (resources.files("fabweave") / "guide" / f"{topic}.md").read_text("utf-8")


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


#: Longer lines are hard to read, however wide the terminal is.
_WIDEST = 100


@click.command()
@click.argument("topic", required=False)
def guide(topic: str | None) -> None:
    """Show the page of the guide about TOPIC, or list the topics."""
    with held_back():
        from rich.console import Console
        from rich.markdown import Markdown
        from rich.table import Table

        from fabweave.core.messages import one_named

    console = Console(highlight=False)
    console.width = min(console.width, _WIDEST)
    pages: dict[str, Callable[[], str]] = {name: partial(page, name) for name in TOPICS}
    pages["options"] = options_page
    if topic is None:
        table = Table("topic", "what it is about", box=None)
        for name, write in pages.items():
            table.add_row(f"[bold]{name}[/]", summary(write()))
        console.print(table)
        click.echo("fabweave guide TOPIC shows a page.")
        return
    text = for_terminal(one_named("topic of the guide", topic, pages)())
    if console.is_terminal:
        console.print(Markdown(text))
    else:
        click.echo(text, nl=False)


_HEAD = """\
# Options

What `fabweave make` takes. Those that change the mesh, the weave or the ribbons are also options of
`fabweave inspect` and `fabweave model`. A length is a number and a unit (`mm`, `cm`, `m`, `um`,
`in`, `ft`); a plain number counts millimetres. In `job.toml`, and as arguments in Python, options
have underscores for hyphens; the fields of `Settings` hold their values, lengths as numbers.
"""


def options_page() -> str:
    """Return the reference of all options as Markdown: by sections, as help has them.

    Examples
    --------
    >>> "### `--manual-paper [a4|letter]`" in options_page().partition("## Machine")[2]
    True
    """
    parts = [_HEAD]
    for section in SECTIONS:
        parts.append(f"## {section}\n")
        parts += [_entry(option) for option in OPTIONS if option.section == section]
    return "\n".join(parts)


def _entry(option: Option) -> str:
    """Return the entry of one option."""
    kind = option.kind
    text = textwrap.fill(option.text, _WIDEST, break_on_hyphens=False, break_long_words=False)
    facts = ["takes no value" if kind.flag else f"takes {kind.told}"]
    if kind.unit:
        facts.append(f"unit: {kind.unit}")
    if option.usual:
        facts.append(f"default: {option.usual}")
    if kind.repeatable:
        facts.append("may be repeated")
    if option.making:
        facts.append("for `fabweave make` only")
    facts.append(f"`Settings.{option.field}`")
    return "\n".join([f"### `{option.shown}`", "", text, "", *(f"- {fact}" for fact in facts), ""])
