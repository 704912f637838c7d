"""A process that works for the pages: it tells as it goes, can be interrupted, and is replaced."""

import asyncio
import json
import os
import signal
import struct
import sys
import time
import traceback
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, TypeAlias

import numpy as np

from fabweave.core.errors import FabweaveError
from fabweave.core.parallel.executors import start_process
from fabweave.core.parallel.interrupt import held_back

#: What is told of a wish: values for JSON, and arrays by name.
Told: TypeAlias = tuple[dict[str, Any], dict[str, np.ndarray[Any, Any]]]
#: Called with what the process keeps, what is wished, and to tell something.
Work: TypeAlias = Callable[[dict[str, Any], dict[str, Any], Callable[[Told], None]], None]


def framed(values: dict[str, Any], arrays: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    """Return values and arrays as one message, as pages read it.

    It is the length of the values, the values as JSON, which list the arrays, and the arrays; each
    part begins at a multiple of four bytes.
    """
    listed = [
        {"name": name, "type": array.dtype.name, "length": array.size}
        for name, array in arrays.items()
    ]
    head = json.dumps({**values, "arrays": listed}).encode()
    parts = (head, *(array.tobytes() for array in arrays.values()))
    return struct.pack("<I", len(head)) + b"".join(
        part + b"\0" * (-len(part) % 4) for part in parts
    )


#: A process that does not heed an interrupt for so long is ended.
_HEED_S = 4.0


class Worker:
    """A process that does one thing at a time, and keeps what it knows from one to the next."""

    def __init__(self) -> None:
        """Start nothing yet."""
        self._process: BaseProcess | None = None
        self._link: Connection | None = None
        self._busy, self._since, self._stopped, self._closed = False, 0.0, False, False
        #: The meshes that its process was given, by their keys.
        self.given: set[str] = set()

    @property
    def started(self) -> bool:
        """Whether it has a process."""
        return self._link is not None

    async def do(self, work: Work, wish: dict[str, Any]) -> AsyncIterator[Told]:
        """Yield what the work tells, until it ends.

        What goes wrong is told, too: ``error`` in words, ``stopped`` if it was interrupted. Where
        the process is lost, another does the work once more.
        """
        self._stopped = False
        for again in (False, True):
            try:
                async for told in self._done(work, wish):
                    yield told
            except (EOFError, OSError):
                self.end()
                if self._stopped or self._closed:
                    yield {"stopped": True}, {}
                elif not again:
                    continue
                else:
                    yield {"error": "The process that worked on this ended twice, maybe for lack "
                           "of memory. A coarser mesh needs less."}, {}  # fmt: skip
            return

    async def _done(self, work: Work, wish: dict[str, Any]) -> AsyncIterator[Told]:
        """Yield what the work tells; EOFError or OSError if the process is lost."""
        try:
            link = self._link if self._link is not None else await asyncio.to_thread(self._start)
            self._busy, self._since = True, time.monotonic()
            await asyncio.to_thread(link.send, (work, wish))
            while (told := await asyncio.to_thread(link.recv)) is not None:
                yield told
        finally:
            self._busy = False

    def _start(self) -> Connection:
        process, link = start_process(_serve, daemon=False)
        self._process, self._link = process, link
        if self._closed:
            # Nobody waits for it any more, and this process would wait for its end.
            self.end()
            raise EOFError
        return link

    def interrupt(self) -> None:
        """Stop what it does, as Ctrl-C would; end it if it does not heed that."""
        process = self._process
        if not self._busy or process is None or process.pid is None:
            return
        if sys.platform == "win32":
            self._stopped = True
            process.terminate()
        else:
            with suppress(ProcessLookupError):
                os.kill(process.pid, signal.SIGINT)
            late = partial(self._end_if, process, time.monotonic())
            asyncio.get_running_loop().call_later(_HEED_S, late)

    def _end_if(self, process: BaseProcess, since: float) -> None:
        """End a process that is still at what it was to stop."""
        if self._busy and process is self._process and self._since < since:
            self._stopped = True
            process.kill()

    def close(self) -> None:
        """End the process, and start none any more."""
        self._closed = True
        self.end()

    def end(self) -> None:
        """End the process, if there is one."""
        process, self._process, self._link = self._process, None, None
        self.given.clear()
        if process is not None:
            process.terminate()
            process.join(1.0)


class _Stop:
    """Raises KeyboardInterrupt while something is done, and at no other time."""

    busy = False

    def __call__(self, _number: int, _frame: object) -> None:
        if self.busy:
            self.busy = False
            raise KeyboardInterrupt


def _serve(link: Connection) -> None:
    """Do what comes through a link until it closes."""
    stop = _Stop()
    signal.signal(signal.SIGINT, stop)
    kept: dict[str, Any] = {}

    def tell(told: Told) -> None:
        with held_back():
            link.send(told)

    while True:
        try:
            work, wish = link.recv()
        except (EOFError, OSError):
            return
        told: Told | None = None
        try:
            stop.busy = True
            work(kept, wish, tell)
            stop.busy = False
        except KeyboardInterrupt:
            told = {"stopped": True}, {}
        except FabweaveError as error:
            told = {"error": str(error)}, {}
        except MemoryError:
            told = {"error": "There is not enough memory for this: take a coarser mesh."}, {}
        except OSError as error:
            where = f" {error.filename}" if error.filename else ""
            told = {"error": f"Cannot read or write{where}: {error.strerror or error}"}, {}
        except Exception:
            if stop.busy:
                traceback.print_exc()
                told = {"error": "This failed by a defect of fabweave. Please report it with what "
                        "the terminal says."}, {}  # fmt: skip
            else:  # It was to stop: what runs in C may raise an error of its own in place of that.
                told = {"stopped": True}, {}
        stop.busy = False
        if told is not None:
            link.send(told)
        link.send(None)
