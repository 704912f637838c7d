"""Work in parts is done wherever it can be, and again where a worker was lost."""

import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Executor
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fabweave.cli.main import main
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.parallel import cluster
from fabweave.core.parallel.cluster import cluster_at, versions
from fabweave.core.parallel.executors import finished, here, processes, side_workers
from fabweave.design import making
from fabweave.nest import nesting as batches
from fabweave.nest.nesting import nest
from fabweave.stock.sheet_size import SheetSize

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("executors", [here, processes(0), processes(2)])
def test_executors_do_work_and_hand_on_errors(executors):
    with executors() as executor:
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


def free_port() -> int:
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


@pytest.fixture
def dask_cluster(tmp_path, monkeypatch):
    """Start a scheduler and two workers; give the address and the workers' processes."""
    distributed = pytest.importorskip("distributed", reason="the extra cluster is not installed")
    monkeypatch.setattr(cluster, "_ANSWER_S", 60.0)  # for a busy machine
    address = f"tcp://127.0.0.1:{free_port()}"
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = os.environ | {"PYTHONPATH": paths, "OMP_NUM_THREADS": "1"}

    def started(*command: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "distributed.cli." + command[0], *command[1:]],
            cwd=tmp_path, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    port = address.rsplit(":", 1)[1]
    common = ("--host", "127.0.0.1", "--no-dashboard")
    running = [started("dask_scheduler", *common, "--port", port)]
    running += [
        started("dask_worker", address, *common, "--nthreads", "1", "--no-nanny", "--name", name)
        for name in ("one", "two")
    ]
    try:
        with distributed.Client(address, timeout=60, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=60)
        yield address, running[1:]
    finally:
        for process in running:
            process.kill()
            process.wait()


@pytest.mark.slow
# Dask's own clean-up when a worker dies is no business of ours.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore:.*unclosed.*")
def test_a_cluster_comes_to_the_same_bytes_though_a_worker_is_killed(
    dask_cluster, piece_sets, monkeypatch
):
    address, (worker, _) = dask_cluster
    monkeypatch.setattr(batches, "_PIECES", 25)
    monkeypatch.setattr(batches, "_LEAST_SHEETS", 1)
    pieces = [0.2 * piece for piece in piece_sets["measured_set"](200)]
    rules = {"margin_mm": 3.0, "gap_mm": 1.0, "effort": "quick"}
    stock = [SheetSize(120, 80)]
    expected = nest(pieces, stock, **rules)
    said = []

    def killing(_what, done, _total):
        said.append(done)
        if len(said) == 2:  # two batches are done, and six are not
            worker.send_signal(signal.SIGKILL)

    layout = nest(pieces, stock, executors=cluster_at(address), progress=killing, **rules)
    assert worker.wait(300) == -signal.SIGKILL
    assert layout == expected


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore:.*unclosed.*")
def test_a_cluster_that_would_come_to_something_else_is_refused(dask_cluster):
    address, _ = dask_cluster
    with cluster_at(address)() as executor:
        assert executor.submit(divmod, 7, 2).result() == (3, 1)
        found = executor.submit(versions).result()
    from distributed import KilledWorker  # noqa: PLC0415 -- an extra

    def lost():
        with cluster_at(address)():
            raise KilledWorker("batch", SimpleNamespace(address="tcp://one"), 3)

    with pytest.raises(CannotMakeError, match=r"lost on the cluster .* memory"):
        lost()
    cluster.require_same(address, {"tcp://one": found})
    for other in ({**found, "numpy": "1.0"}, ModuleNotFoundError("No module")):
        with pytest.raises(InputError, match="tcp://two"):
            cluster.require_same(address, {"tcp://one": found, "tcp://two": other})


def test_what_is_done_here_is_handed_on_before_the_next_begins():
    done = []

    def work(number):
        done.append(number)
        return number

    with here() as executor:
        for number, result in finished(executor, work, [(0,), (1,), (2,)]):
            assert done == list(range(number + 1))
            assert result == number


def test_the_command_line_hands_the_cluster_on(monkeypatch, tmp_path, capsys):
    pytest.importorskip("distributed", reason="the extra cluster is not installed")
    monkeypatch.setattr(cluster, "_ANSWER_S", 0.3)

    def run_job(*_arguments, executors, **_options):
        with executors():
            raise AssertionError("nobody answers there")

    monkeypatch.setattr(making, "run_job", run_job)
    with pytest.raises(SystemExit) as stop:
        main(["make", "shape:cube", "--cluster", "tcp://127.0.0.1:1", "-o", str(tmp_path / "x")])
    assert stop.value.code == 2
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:1'" in capsys.readouterr().err


def test_without_dask_it_is_said_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'fabweave\[cluster\]'"):
        cluster_at("tcp://127.0.0.1:1")


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
