"""Hold back what ends a process where it would do harm, and tell other runs that it lives."""

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

if sys.platform == "win32":
    import msvcrt
else:
    try:
        import fcntl
    except ImportError:  # as in a web page, where there is no other process to keep out
        fcntl = None  # type: ignore[assignment]


def lock_file(path: Path) -> int | None:
    """Lock a file, made if it is not there; None if another process has locked it.

    The lock ends when the descriptor that is returned is closed, or with the process, whatever
    ends that.
    """
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        if sys.platform == "win32":
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        elif fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


#: What ends a process: a terminal that is closed, a system that shuts down, Ctrl-C at last.
_STOPPING = tuple(
    getattr(signal, name) for name in ("SIGHUP", "SIGTERM", "SIGINT") if hasattr(signal, name)
)


@contextmanager
def held_back() -> Iterator[None]:
    """Let Ctrl-C and its like take effect when the block ends, and not within it.

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
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in _STOPPING}
    for number, handler in before.items():
        if handler is not None:  # else it is none of Python's, and cannot be put back
            signal.signal(number, lambda number, _frame: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None:
                signal.signal(number, handler)
        for number in came:
            signal.raise_signal(number)


def exit_when_ended() -> None:
    """Have the signals that end a process raise SystemExit, as Ctrl-C raises KeyboardInterrupt.

    So what the process has begun is cleared up. Signals that are ignored stay so.
    """

    def leave(number: int, _frame: object) -> None:
        raise SystemExit(128 + number)

    if threading.current_thread() is threading.main_thread():
        for number in _STOPPING:
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, leave)
