"""Write to terminals: letters that they may not have, and what is being done."""

import codecs
import io
import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TextIO

import click

from fabweave.core.parallel.executors import can_thread

if TYPE_CHECKING:
    from rich.progress import Progress


#: Where there is no terminal, a line says so often what is being done.
_EVERY_S = 5.0


class Report:
    """Takes what is being done, and shows it as a bar if there is one, or as a line now and then.

    Parameters
    ----------
    bar : rich.progress.Progress, optional
        Running.
    """

    def __init__(self, bar: "Progress | None" = None) -> None:
        self._bar = bar
        self._task = bar.add_task("start", total=1) if bar is not None else None
        self._now = ("start", 0, 1)

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show how much of something is done."""
        self._now = what, done, total
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, description=what, completed=done, total=max(total, 1))

    @contextmanager
    def in_lines(self) -> Iterator["Report"]:
        """Print every few seconds what is being done."""
        over, began = threading.Event(), time.monotonic()

        def tell() -> None:
            while not over.wait(_EVERY_S):
                what, done, total = self._now
                share = f" {done} of {total}" if total > 1 else ""
                click.echo(f"{time.monotonic() - began:4.0f} s: {what}{share}", err=True)

        # Where no thread can be started, it is done in silence.
        telling = threading.Thread(target=tell, daemon=True) if can_thread() else None
        if telling is not None:
            telling.start()
        try:
            yield self
        finally:
            over.set()
            if telling is not None:
                telling.join()

    @contextmanager
    def aside(self) -> Iterator[None]:
        """Take the bar away while something is printed: else they would stand in one line."""
        if self._bar is None:
            yield
            return
        self._bar.stop()
        yield
        self._bar.start()

    def say(self, text: str, *, err: bool = False) -> None:
        """Print a line; on the error stream, if it is no result."""
        with self.aside():
            click.echo(text, err=err)


@contextmanager
def progress_bar(silent: bool) -> Iterator[Report]:
    """Show on the error stream what is being done: a bar, lines in a pipe, or nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    if silent:
        yield Report()
        return
    if not console.is_terminal:  # in a log, a bar would be but an empty line
        with Report().in_lines() as report:
            yield report
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


class _Patient(io.FileIO):
    """A stream that nobody may read to its end, as ``head`` does not: the rest goes nowhere."""

    def write(self, data: Any) -> int:
        """Write, or pass over what nobody reads any more."""
        try:
            return super().write(data) or 0
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self.fileno())
            os.close(nowhere)
            return len(memoryview(data).cast("B"))


def speak_to_nobody() -> None:
    """Let this process go on, and end with the code that it would, where its reader is gone."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is not getattr(sys, f"__{name}__") or stream is None:
            continue
        raw = getattr(stream.buffer, "raw", stream.buffer)
        if type(raw) is io.FileIO:
            patient = io.TextIOWrapper(
                io.BufferedWriter(_Patient(raw.fileno(), "w", closefd=False)),
                encoding=stream.encoding,
                errors=stream.errors,
                line_buffering=stream.line_buffering or stream.write_through,
            )
            setattr(sys, name, patient)


def speak_plainly(stream: TextIO) -> None:
    """Let a stream write something legible for letters that its encoding does not have."""
    codecs.register_error(_NAME, plain_letters)
    reconfigure = getattr(stream, "reconfigure", None)  # what stands in for a stream may lack it
    if reconfigure is not None:
        reconfigure(errors=_NAME)
