"""Run work beside the main process, with the same result as without."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, TypeAlias

from fabweave.core.parallel.executors import processes, result_of

#: Called as ``start(function, *arguments, **options)``; gives a function that waits for the result.
Start: TypeAlias = Callable[..., Callable[[], Any]]


@contextmanager
def side_workers(count: int) -> Iterator[Start]:
    """Give a way to start work: in ``count`` processes, or at once in this one if it is 0.

    When the block ends, by its end or by an exception, no process is left, whatever it was doing.
    Functions and arguments must be picklable.

    Examples
    --------
    >>> with side_workers(0) as start:
    ...     later = start(max, 2, 3)
    ...     later()
    3
    """
    if count <= 0:
        yield at_once
        return
    with processes(count)() as executor:

        def start(
            function: Callable[..., Any], *arguments: Any, **options: Any
        ) -> Callable[[], Any]:
            return partial(result_of, executor.submit(function, *arguments, **options))

        yield start


def at_once(function: Callable[..., Any], *arguments: Any, **options: Any) -> Callable[[], Any]:
    """Do the work now and hand out its result: the way to start work without other processes."""
    result = function(*arguments, **options)
    return lambda: result
