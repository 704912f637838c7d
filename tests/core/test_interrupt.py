"""Ctrl-C is taken where nothing is half done, and only there."""

import gc
import os
import signal
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from fabweave.core import job_folder
from fabweave.core.job_folder import clear_abandoned, finished_folder, is_complete, write_contents
from fabweave.core.parallel.executors import SignalSafeExecutor, finished, result_of
from fabweave.core.parallel.interrupt import held_back, lock_file


@pytest.fixture(autouse=True)
def usual_signal():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    # What other tests left is not to be collected now: an interrupt of a finaliser is lost.
    gc.collect()
    gc.disable()
    yield
    gc.enable()
    signal.signal(signal.SIGINT, before)


def interrupted_at(step, work):
    """Do some work and send SIGINT at one of its steps; return whether it has so many."""
    count, sent = 0, False

    def trace(_frame, _event, _argument):
        nonlocal count, sent
        count += 1
        if count == step:
            sent = True
            sys.settrace(None)
            signal.raise_signal(signal.SIGINT)
        return trace

    before = sys.gettrace()
    try:
        sys.settrace(trace)
        work()
    except KeyboardInterrupt:
        assert sent
    else:
        assert not sent, "an interrupt was lost"
    finally:
        sys.settrace(before)
    return sent


def test_an_interrupt_waits_for_the_end_of_the_block():
    done = []
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - the point is where in the block
        with held_back():
            signal.raise_signal(signal.SIGINT)
            done.append("rest")
        done.append("after")
    assert done == ["rest"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_blocks_within_blocks_and_errors_keep_their_meaning():
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012 - the point is where in the block
        with held_back():
            with held_back():
                signal.raise_signal(signal.SIGINT)
            inner_is_over = True
        raise AssertionError("not reached")
    assert inner_is_over
    with pytest.raises(ZeroDivisionError), held_back():
        1 / 0  # noqa: B018 - raises
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_other_threads_are_left_alone():
    results = []

    def work():
        with held_back():
            results.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert results == [signal.default_int_handler]


@pytest.mark.parametrize("stride", [23, pytest.param(1, marks=pytest.mark.slow)])
def test_whatever_is_interrupted_no_lock_stays_taken(stride):
    # At each step of handing work over and taking its result, in turn (or at some of them). Where
    # Ctrl-C leaves a lock of an executor taken, the next to hand work over waits for ever.
    executor = SignalSafeExecutor(ThreadPoolExecutor(2))

    def work():
        assert result_of(executor.submit(max, 2, 3)) == 3
        assert sorted(finished(executor, max, [(2, 3), (5, 4)])) == [(0, 3), (1, 5)]

    still, step = [], 1
    while interrupted_at(step, work):
        tried = len(still)
        after = threading.Thread(target=lambda: still.append(work()), daemon=True)
        after.start()
        after.join(300)
        assert len(still) == tried + 1, f"stuck after an interrupt at step {step}"
        step += stride
    assert step > 100
    executor.shutdown()


# A listing that is interrupted is closed when it is collected, which is soon enough.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("stride", [41, pytest.param(7, marks=pytest.mark.slow)])
def test_a_folder_is_old_or_new_but_never_between(stride, tmp_path, monkeypatch):
    old, new = "an older job", "a newer job"
    job = tmp_path / "job"
    locks = []
    monkeypatch.setattr(
        job_folder, "lock_file", lambda path: locks.append(lock_file(path)) or locks[-1]
    )

    def work():
        with finished_folder(job) as folder, held_back():
            (folder / "job.toml").write_text(new)

    step, sent, replaced, left = 1, True, 0, 0
    while sent:
        job.mkdir(exist_ok=True)
        (job / "job.toml").write_text(old)
        write_contents(job)
        sent = interrupted_at(step, work)
        assert is_complete(job)
        if list(tmp_path.iterdir()) != [job]:
            # The clearing up was interrupted before it began: the next run does it.
            os.close(locks[-1])  # as the end of the process does
            assert len(clear_abandoned(job)) == 1
            assert list(tmp_path.iterdir()) == [job]
            left += 1
        found = (job / "job.toml").read_text()
        assert found in (old, new)
        replaced += found == new
        step += stride
    assert found == new
    # Interrupts came before and after the folder was put in place, but not within.
    assert 1 < replaced < (step - 50) / stride
    assert left < 0.05 * step / stride
