"""Work in parts is done wherever it can be, and again where a worker was lost."""

import multiprocessing
import os
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest

from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel import executors
from fabweave.core.parallel.executors import finished, guest, here, processes, side_workers


@pytest.mark.parametrize("opens", [here, processes(0), processes(2)])
def test_executors_do_work_and_hand_on_errors(opens):
    with opens() as executor:
        assert isinstance(executor, Executor)
        assert sorted(finished(executor, divmod, [(7, 2), (9, 4)])) == [(0, (3, 1)), (1, (2, 1))]
        with pytest.raises(ZeroDivisionError):
            list(finished(executor, divmod, [(7, 0)]))
        # What the work itself raises is not taken for the loss of who does it.
        with pytest.raises(EOFError, match="its own"):
            executor.submit(exec, "raise EOFError('its own')").result()
        assert executor.submit(max, 2, 3, key=abs).result() == 3


def test_a_killed_process_costs_only_its_part_which_is_done_again(tmp_path):
    # The part kills the process that does it, unless that has been done before.
    once = (
        "import os, pathlib, signal\n"
        f"mark = pathlib.Path({str(tmp_path / 'mark')!r})\n"
        "if not mark.exists():\n"
        "    mark.touch()\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    with processes(2)() as executor:
        first = {executor.submit(os.getpid).result() for _ in range(4)}
        parts = [executor.submit(exec, once), executor.submit(time.sleep, 0.2)]
        assert [part.result() for part in parts] == [None, None]
        after = {executor.submit(os.getpid).result() for _ in range(8)}
    assert (tmp_path / "mark").exists()
    assert len(first & after) == len(first) - 1 or len(first) == 1
    assert os.getpid() not in first | after


def test_processes_run_nothing_of_the_script_that_asks_for_them(tmp_path):
    script = tmp_path / "unguarded.py"
    script.write_text(
        "import os\n"
        "from fabweave.core.parallel.executors import finished, processes\n"
        "print('once')\n"
        "with processes(2)() as executor:\n"
        "    found = sorted(finished(executor, max, [(2, 3), (5, 4), (6, 7)]))\n"
        "    pid = executor.submit(os.getpid).result()\n"
        "print(found, pid == os.getpid())\n"
    )
    ended = subprocess.run(
        [sys.executable, script], capture_output=True, check=False, timeout=300, text=True
    )
    assert (ended.returncode, ended.stderr) == (0, "")
    assert ended.stdout.splitlines() == ["once", "[(0, 3), (1, 5), (2, 7)] False"]


def test_a_part_that_costs_every_process_is_given_up():
    with processes(1)() as executor:
        with pytest.raises(BrokenExecutor, match="3 processes ended"):
            executor.submit(os._exit, 1).result()
        with pytest.raises(CannotMakeError, match=r"was lost .* memory"):
            list(finished(executor, os._exit, [(1,)]))
        assert executor.submit(abs, -2).result() == 2  # others are done all the same


def test_no_process_is_left_when_the_block_ends_by_an_exception():
    pids = set()

    def interrupted():
        with processes(2)() as executor:
            pids.update(executor.submit(os.getpid).result() for _ in range(4))
            executor.submit(time.sleep, 600)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert pids
    for pid in pids:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_work_that_is_not_wanted_any_more_is_dropped_however_large_it_is(tmp_path):
    # More is handed over than a pipe holds, to processes that are busy: nobody waits for it.
    large = np.zeros(4_000_000)
    slept = tmp_path / "slept"
    sleep = f"import pathlib, time; time.sleep(60); pathlib.Path({str(slept)!r}).touch()"
    with side_workers(2) as start:
        assert start(max, 2, 3)() == 3
        for _ in range(4):
            start(exec, sleep)
            start(np.sum, large)
    assert not slept.exists()


@pytest.mark.parametrize("kind", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_a_guest_does_work_and_hands_on_errors_and_is_left_open(kind):
    with kind(2, **START.get(kind, {})) as given:
        for _ in range(2):
            with guest(given)() as executor:
                assert sorted(finished(executor, divmod, [(7, 2), (9, 4)])) == [
                    (0, (3, 1)),
                    (1, (2, 1)),
                ]
                with pytest.raises(ZeroDivisionError):
                    list(finished(executor, divmod, [(7, 0)]))
                # It is the work that raises it, and not the executor that breaks.
                with pytest.raises(BrokenExecutor, match="its own"):
                    executor.submit(exec, BROKEN).result()
        assert given.submit(max, 2, 3).result() == 3
    with guest(given)() as executor, pytest.raises(InputError, match="takes no work"):
        executor.submit(max, 2, 3)


BROKEN = "from concurrent.futures import BrokenExecutor\nraise BrokenExecutor('its own')"
START = {ProcessPoolExecutor: {"mp_context": multiprocessing.get_context("spawn")}}


def test_what_a_broken_guest_loses_is_done_again(tmp_path):
    once = f"import os, pathlib\nif not (m := pathlib.Path({str(tmp_path / 'm')!r})).exists():\n"
    with ProcessPoolExecutor(2, **START[ProcessPoolExecutor]) as given, guest(given)() as executor:
        tasks = [("1",), (once + "    m.touch()\n    os._exit(1)\n",), *([("2",)] * 6)]
        assert sorted(finished(executor, exec, tasks)) == [(at, None) for at in range(8)]
        with pytest.raises(BrokenExecutor):  # it lost all its workers, and starts no more
            given.submit(max, 2, 3)
        assert dict(finished(executor, max, [(2, 3), (5, 4)])) == {0: 3, 1: 5}
        with pytest.raises(CannotMakeError, match="was lost"):
            list(finished(executor, os._exit, [(1,)]))


def test_where_no_process_can_be_started_this_one_does_the_work(monkeypatch):
    def refuse(*_arguments):
        raise OSError

    monkeypatch.setattr(executors, "start_process", refuse)
    with processes(2)() as executor:
        assert {executor.submit(os.getpid).result() for _ in range(4)} == {os.getpid()}
        with pytest.raises(EOFError, match="its own"):
            executor.submit(exec, "raise EOFError('its own')").result()
