"""Show what is being done."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.progress import Progress


class Report:
    """Takes what is being done, and shows it as a bar if there is one.

    Parameters
    ----------
    bar : rich.progress.Progress, optional
        Running; without it, nothing is shown.
    """

    def __init__(self, bar: "Progress | None" = None) -> None:
        self._bar = bar
        self._task = bar.add_task("start", total=1) if bar is not None else None

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show how much of something is done."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=what, completed=done, total=max(total, 1))

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Take the bar away while something is printed: else they would stand in one line."""
        if self._bar is None:
            yield
            return
        self._bar.stop()
        yield
        self._bar.start()

    def say(self, text: str) -> None:
        """Print a line."""
        with self.aside():
            click.echo(text)


@contextmanager
def progress_bar(silent: bool) -> Iterator[Report]:
    """Show on the error stream what is being done, or show nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if silent or not console.is_terminal:  # in a log, a bar would be but an empty line
        yield Report()
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f}/{task.total:.0f}"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, transient=True) as bar:
        yield Report(bar)
