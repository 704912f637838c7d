"""Hold Ctrl-C back where it would do harm."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def held_back() -> Iterator[None]:
    """Let Ctrl-C take effect when the block ends, and not within it.

    Python raises KeyboardInterrupt between any two steps of the main thread: also between the
    taking of a lock by `threading` or `concurrent.futures` and the place that would give it back,
    so that another thread waits for that lock for ever; and between two files that only make sense
    together. Keep blocks short, and never wait for work in one. Other threads are never
    interrupted: there, this does nothing.

    Examples
    --------
    >>> with held_back():
    ...     1 + 1
    2
    """
    before = signal.getsignal(signal.SIGINT)
    if before is None or threading.current_thread() is not threading.main_thread():
        yield
        return
    came = False

    def later(_number: int, _frame: object) -> None:
        nonlocal came
        came = True

    signal.signal(signal.SIGINT, later)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            signal.raise_signal(signal.SIGINT)
