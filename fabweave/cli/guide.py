"""The command that shows the guide."""

from collections.abc import Callable

import click
from rich.console import Console
from rich.markdown import Markdown
from rich.table import Table

from fabweave.core.messages import one_named
from fabweave.guide.pages import TOPICS, for_terminal, page, summary

#: Longer lines are hard to read, however wide the terminal is.
_WIDEST = 100


def _pages() -> dict[str, Callable[[], str]]:
    """Return what writes the page of each topic."""
    return {topic: lambda topic=topic: page(topic) for topic in TOPICS}  # type: ignore[misc]


@click.command()
@click.argument("topic", required=False)
def guide(topic: str | None) -> None:
    """Show the page of the guide about TOPIC, or list the topics."""
    console = Console(highlight=False)
    if console.width > _WIDEST:
        console.width = _WIDEST
    pages = _pages()
    if topic is None:
        table = Table("topic", "what it is about", box=None)
        for name, write in pages.items():
            table.add_row(f"[bold]{name}[/]", summary(write()))
        console.print(table)
        console.print("fabweave guide TOPIC shows a page.")
        return
    text = for_terminal(one_named("topic of the guide", topic, pages)())
    if console.is_terminal:
        console.print(Markdown(text))
    else:
        click.echo(text, nl=False)
