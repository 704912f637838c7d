"""The command that shows the guide."""

from collections.abc import Callable
from functools import partial

import click

from fabweave.core.parallel.interrupt import held_back

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
        from fabweave.guide.pages import for_terminal, summary

    console = Console(highlight=False)
    console.width = min(console.width, _WIDEST)
    pages = _pages()
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


def _pages() -> dict[str, Callable[[], str]]:
    """Return what gives the page of each topic; the reference of options is made when asked for."""
    from fabweave.app.options.page import options_page
    from fabweave.guide.pages import TOPICS, page

    return {**{topic: partial(page, topic) for topic in TOPICS}, "options": options_page}
