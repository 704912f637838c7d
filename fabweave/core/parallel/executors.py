"""Open executors (`concurrent.futures`) for long work in parts: in processes, or here.

A part of the work is a function of the package and its arguments, both picklable; its result does
not depend on who does it. A worker that is lost costs the part it had, which is done again. Where
neither processes nor threads can be started, as in a web page, all is done here.
"""

import gc
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    InvalidStateError,
    ThreadPoolExecutor,
    wait,
)
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache, partial
from queue import SimpleQueue
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    # Importing it fails where no process can be started.
    from multiprocessing.connection import Connection


_Task = TypeVar("_Task")
_Result = TypeVar("_Result")
#: Opens an executor; nothing that it started is left when the block ends.
Executors: TypeAlias = Callable[[], AbstractContextManager[Executor]]

_TRIES = 3  # how many workers one part of the work may cost
_PATIENCE_S = 0.1  # how long Ctrl-C may wait while results are waited for
_STARTING = threading.Lock()  # held while a process is started: one at a time


class HereExecutor(Executor):
    """Does the work at once, in this process.

    Examples
    --------
    >>> with here() as executor:
    ...     executor.submit(max, 2, 3).result()
    3
    """

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Do the work and return a future that is done."""
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


class SignalSafeExecutor(Executor):
    """Pass work on to another executor, with Ctrl-C held back while that one holds its locks."""

    def __init__(self, executor: Executor) -> None:
        """Take one whose ``submit`` and ``shutdown`` do not wait for work."""
        self._executor = executor

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule work there."""
        with held_back():
            return self._executor.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Shut that one down."""
        with held_back():
            self._executor.shutdown(wait, cancel_futures=cancel_futures)


class ProcessesExecutor(ThreadPoolExecutor):
    """Hand work to processes; one that dies is replaced, and its part is done again.

    Each process belongs to one thread at a time, so that the loss of one is known at once and
    touches no other. Ctrl-C is left to the main thread.
    """

    def __init__(self, count: int) -> None:
        """Start nothing yet."""
        super().__init__(count, initializer=_leave_interrupts)
        self._closing = threading.Event()
        self._helpers = [_Helper(self._closing) for _ in range(count)]
        self._idle: SimpleQueue[_Helper] = SimpleQueue()
        for helper in self._helpers:
            self._idle.put(helper)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule work; a BrokenExecutor says that it cost too many processes."""
        return super().submit(self._handed, partial(fn, *args, **kwargs))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Wait for what is running, or stop it (``cancel_futures``); then end the processes."""
        if not cancel_futures:
            super().shutdown(wait=wait)
        self._closing.set()
        for helper in self._helpers:
            helper.stop()
        super().shutdown(wait=wait, cancel_futures=True)

    def _handed(self, work: Callable[[], Any]) -> Any:
        helper = self._idle.get()
        try:
            for _ in range(_TRIES):
                try:
                    return helper.do(work)
                except _LostError:
                    helper.stop()
                    if self._closing.is_set():
                        raise BrokenExecutor("the executor was closed") from None
            raise BrokenExecutor(f"{_TRIES} processes ended before they had finished this part")
        finally:
            self._idle.put(helper)


class _LostError(Exception):
    """Say that a process ended before it was done."""


class _Helper:
    """A process that does one thing after another; started when there is something to do."""

    def __init__(self, closing: threading.Event) -> None:
        self._closing = closing
        self._process: multiprocessing.process.BaseProcess | None = None
        self._link: Connection | None = None

    def do(self, work: Callable[[], Any]) -> Any:
        """Return what the process computes; _LostError if it ends before that.

        Where none can be started, this one does it.
        """
        if self._link is None:
            try:
                self._process, self._link = start_process(_serve)
            except (ImportError, OSError):
                return work()
        if self._closing.is_set():
            self.stop()
            raise _LostError
        try:
            self._link.send(work)
            answer = self._link.recv()
        except (EOFError, OSError) as error:
            raise _LostError from error
        good, result = answer
        if not good:
            raise result
        return result

    def stop(self) -> None:
        """End the process, if there is one."""
        process, self._process, self._link = self._process, None, None
        if process is not None:
            process.terminate()
            process.join()


def _leave_interrupts() -> None:
    """Block Ctrl-C in this thread, and in what it starts: the main thread ends the processes.

    Ctrl-C reaches every process of a terminal, also those that are still importing.
    """
    if sys.platform != "win32":
        with suppress(ImportError, OSError):
            from multiprocessing import resource_tracker  # noqa: PLC0415 - not there everywhere

            # It starts with the first process, and unblocks the signal after that.
            resource_tracker.ensure_running()
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _context() -> Any:
    """Return how processes are started: with threads about, a fork of this one is not safe."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    # The server imports what this process has of the package once, so no process need do it again.
    package = __name__.partition(".")[0]
    context.set_forkserver_preload([m for m in list(sys.modules) if m.partition(".")[0] == package])
    return context


def get_ready() -> None:
    """Begin to load what processes are forked from, so that the first of them waits for less."""
    if _context().get_start_method() == "forkserver":
        from multiprocessing.forkserver import ensure_running  # noqa: PLC0415 - not on all systems

        ensure_running()


def start_process(
    serve: "Callable[[Connection], None]", *, daemon: bool = True
) -> "tuple[multiprocessing.process.BaseProcess, Connection]":
    """Start a process that serves a link, and return it with this end of the link.

    One that is no ``daemon`` may start processes of its own; whoever starts it ends it.

    ImportError or OSError is raised where none can be started.
    """
    context = _context()
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(there,), daemon=daemon)
    with _without_main():
        process.start()
    there.close()  # so that the end of the process closes the link
    return process, here


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the script that runs: a process needs nothing of it, and would run it once more."""
    with _STARTING:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


def collect_seldom() -> None:
    """Look for rings of objects less often: arrays need none of it, which takes 2 % of a job."""
    gc.set_threshold(50_000)


def _serve(link: "Connection") -> None:
    """Do what comes through a link until it closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # where it cannot be blocked
    collect_seldom()
    while True:
        try:
            work = link.recv()
        except EOFError:
            return
        answer = _answer(work)
        with suppress(BrokenPipeError):  # whoever asked is gone; so the link is closed
            link.send(answer)


#: What a part of the work came to: whether it went well, and its result or what it raised.
_Answer: TypeAlias = tuple[bool, Any]


def _answer(work: Callable[[], Any]) -> _Answer:
    """Do some work for another process: what it raises is not taken for the loss of who does it."""
    try:
        return True, work()
    except Exception as error:
        error.add_note(traceback.format_exc())
        return False, error


class GuestExecutor(Executor):
    """Pass work on to somebody else's executor, and what that one loses to one of ours.

    Where an executor loses one worker, it may lose all, and what they were at.
    """

    def __init__(self, given: Executor, spare: Executor) -> None:
        """Take both; neither is shut down."""
        self._given, self._spare = given, spare

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Schedule work; a BrokenExecutor says that it was lost."""
        work, result = partial(_answer, partial(fn, *args, **kwargs)), Future[Any]()

        def hand(executor: Executor, *others: Executor) -> None:
            def take(done: Future[_Answer]) -> None:
                lost = CancelledError() if done.cancelled() else done.exception()
                if isinstance(lost, BrokenExecutor) and others:
                    hand(*others)
                    return
                with suppress(InvalidStateError):  # nobody waits for it any more
                    if lost is not None:
                        result.set_exception(BrokenExecutor(f"{type(lost).__name__}: {lost}"))
                    elif done.result()[0]:
                        result.set_result(done.result()[1])
                    else:
                        result.set_exception(done.result()[1])

            try:
                with held_back():
                    handed = executor.submit(work)
                    result.add_done_callback(lambda _: handed.cancel())
                    handed.add_done_callback(take)
            except BrokenExecutor:
                if not others:
                    raise
                hand(*others)
            except RuntimeError as error:
                raise InputError(f"the executor takes no work: {error}") from error

        hand(self._given, self._spare)
        return result


#: Opens an executor that does the work at once, in this process.
here: Executors = HereExecutor


def processes(count: int) -> Executors:
    """Return what opens an executor of processes beside this one; with none, it works here."""

    @contextmanager
    def opened() -> Iterator[Executor]:
        executor = SignalSafeExecutor(ProcessesExecutor(count))
        try:
            yield executor
        finally:
            executor.shutdown(cancel_futures=True)

    return opened if count > 0 and can_thread() else here


def guest(executor: Executor) -> Executors:
    """Return what hands work to somebody else's executor, and to processes if that breaks."""

    @contextmanager
    def opened() -> Iterator[Executor]:
        with processes(os.cpu_count() or 1)() as spare:
            yield GuestExecutor(executor, spare)

    return opened


def finished(
    executor: Executor,
    function: Callable[..., Any],
    tasks: Sequence[tuple[Any, ...]],
    lost: Callable[[CannotMakeError], Any] | None = None,
) -> Iterator[tuple[int, Any]]:
    """Yield the number and the result of each task as it is done, in any order.

    Parameters
    ----------
    executor : Executor
        Who does it.
    function : callable
        What is done.
    tasks : sequence of tuple
        The arguments for each time.
    lost : callable, optional
        Makes the result of a task that was lost again and again, with the worker that did it.

    Raises
    ------
    CannotMakeError
        If a task was lost so, and nothing is made of that.

    Examples
    --------
    >>> with here() as executor:
    ...     sorted(finished(executor, max, [(2, 3), (5, 4)]))
    [(0, 3), (1, 5)]
    """
    waiting: dict[Future[Any], int] = {}

    def taken(most_s: float) -> Iterator[tuple[int, Any]]:
        for future in _done(waiting, most_s):
            number = waiting.pop(future)
            try:
                result = result_of(future)
            except CannotMakeError as error:
                if lost is None:
                    raise
                result = lost(error)
            yield number, result

    try:
        for number, task in enumerate(tasks):
            waiting[executor.submit(function, *task)] = number
            # Where work is done here, it is done by now: it need not wait for the rest.
            yield from taken(0.0)
        while waiting:
            yield from taken(_PATIENCE_S)
    finally:
        with held_back():
            for future in waiting:
                future.cancel()


def _done(waiting: Collection[Future[Any]], most_s: float) -> list[Future[Any]]:
    """Return which are done, after no more than some seconds, in the order given."""
    with held_back():
        done = wait(waiting, most_s, FIRST_COMPLETED).done
    return [future for future in waiting if future in done]


def result_of(future: Future[Any]) -> Any:
    """Wait for a result and return it; raise CannotMakeError if it was lost."""
    while not _done([future], _PATIENCE_S):
        pass
    try:
        with held_back():
            return future.result()
    except (BrokenExecutor, CancelledError) as error:
        raise CannotMakeError(
            f"part of the work was lost ({error}); make sure that there is enough memory, and try "
            "again"
        ) from error


@cache
def can_thread() -> bool:
    """Tell whether this process can start threads."""
    try:
        threading.Thread(target=int).start()
    except RuntimeError:
        return False
    return True


def threads(count: int) -> Executor:
    """Return threads of this process, or what works at once where none can be started."""
    return SignalSafeExecutor(ThreadPoolExecutor(count)) if can_thread() else HereExecutor()


#: Threads that wait for work as long as this process lives.
_threads = cache(threads)


def in_threads(
    function: Callable[[_Task], _Result], tasks: Sequence[_Task], count: int
) -> list[_Result]:
    """Return the results for all tasks, in their order, from threads of this process.

    They gain where the function spends its time in arrays. None is left working after an exception.

    Parameters
    ----------
    function : callable
    tasks : sequence
    count : int
        How many threads; -1 for one for each core.

    Examples
    --------
    >>> in_threads(abs, [-2, 3], 2)
    [2, 3]
    """
    count = (os.cpu_count() or 1) if count < 0 else count
    if min(count, len(tasks)) <= 1:
        return [function(task) for task in tasks]
    executor, futures = _threads(count), list[Future[_Result]]()
    try:
        for task in tasks:
            futures.append(executor.submit(function, task))
        return [result_of(future) for future in futures]
    finally:
        with held_back():
            for future in futures:
                future.cancel()


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
