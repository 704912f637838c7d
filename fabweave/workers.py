"""Run work beside the main process, with the same result as without."""

import multiprocessing
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from multiprocessing.pool import Pool
from typing import Any, TypeAlias

#: Called as ``start(function, *arguments)``; returns a function that waits for the result.
Start: TypeAlias = Callable[..., Callable[[], Any]]


@contextmanager
def side_workers(count: int) -> Iterator[Start]:
    """Give a way to start work: in ``count`` processes, or at once in this one if it is 0.

    When the block ends, by its end or by an exception, no process is left. Functions and
    arguments must be picklable; a script that asks for processes needs the usual guard,
    ``if __name__ == "__main__"``.

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
    with ExitStack() as stack:
        pools: list[Pool] = []

        def start(function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
            if not pools:  # bad input is told without waiting for processes
                pool = multiprocessing.Pool(count, _leave_interrupts_to_the_main_process)
                pools.append(stack.enter_context(pool))
            return pools[0].apply_async(function, arguments).get

        yield start


def at_once(function: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
    """Do the work now and hand out its result: the way to start work without other processes."""
    result = function(*arguments)
    return lambda: result


def _leave_interrupts_to_the_main_process() -> None:
    """Ignore Ctrl-C, which reaches every process of the group: the main process ends the rest."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
