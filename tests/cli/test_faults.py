"""A full disk, a killed process, a terminal that knows few letters: each ends in words."""

import errno
import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from dying import die
from jobs import contents_of
from jobs import run as run_here

from fabweave.design.inspection import facts as facts_module
from fabweave.nest import nesting as batches
from fabweave.piece.split import split_plan
from fabweave.verify.proof import verify_job

pytestmark = pytest.mark.usefixtures("quick_jobs")


def run(*arguments, limit=None, **environment):
    """Run the command line in a process of its own, perhaps with a limit of the system's."""
    prepare = None
    if limit is not None:
        resource = pytest.importorskip("resource")
        kind, most = limit
        prepare = partial(resource.setrlimit, getattr(resource, kind), (most, most))
    ended = subprocess.run(
        [sys.executable, "-m", "fabweave", *arguments],
        capture_output=True,
        check=False,
        timeout=300,
        env=os.environ | environment,
        preexec_fn=prepare,
    )
    return ended.returncode, ended.stdout, " ".join(ended.stderr.decode("ascii", "replace").split())


# The system's answer to a file that grows beyond a limit is that of a full disk, with another word.
FULL = ("RLIMIT_FSIZE", 20_000)


@pytest.mark.slow
def test_a_full_disk_is_told_with_the_path_and_nothing_is_left(tmp_path):
    folder = tmp_path / "out"
    code, _, said = run(
        "make", "shape:tetrahedron", "--size", "120mm", "--effort", "quick", "-o", str(folder),
        limit=FULL,
    )  # fmt: skip
    assert (code, list(tmp_path.iterdir())) == (2, [])
    assert f"{folder}: File too large; nothing was kept" in said


def test_too_little_memory_is_told(monkeypatch, capsys):
    def exhausted(*_arguments, **_options):
        np.zeros(2**50)

    monkeypatch.setattr(facts_module, "inspect_mesh", exhausted)
    assert run_here("inspect", "shape:cube") == 1
    assert capsys.readouterr().err.startswith("fabweave: ")


TETRAHEDRON = ("make", "shape:tetrahedron", "--size", "120mm", "--effort", "quick", "-q")


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="permissions do not bind this user"
)
@pytest.mark.parametrize("below", ["out", "new/out"])
def test_a_folder_that_is_for_reading_only(below, tmp_path, capsys):
    folder = tmp_path / "shelf"
    folder.mkdir(mode=0o555)
    for words in (TETRAHEDRON, ("model", "shape:tetrahedron", "-q")):
        name = below if words is TETRAHEDRON else f"{below}.glb"
        assert run_here(*words, "-o", folder / name) == 2
        said = capsys.readouterr().err
        assert str(folder) in said
        assert "Traceback" not in said
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("below", ["out", "new/out"])
def test_a_file_where_a_folder_is_wanted(below, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fabweave.job.stations.load_asked", None)  # nothing is made in vain
    (tmp_path / "shelf").write_text("mine")
    assert run_here(*TETRAHEDRON, "-o", tmp_path / "shelf" / below) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"fabweave: {tmp_path / 'shelf'} is a file, not a folder")
    assert (tmp_path / "shelf").read_text() == "mine"


def read_only(monkeypatch, when):
    """Have the system say from some time on that a volume is for reading only."""
    calls = 0

    def refused(function):
        def call(*arguments, **options):
            nonlocal calls
            calls += 1
            if calls > when:
                raise OSError(errno.EROFS, os.strerror(errno.EROFS))
            return function(*arguments, **options)

        return call

    for name in ("mkdtemp", "mkstemp"):
        monkeypatch.setattr(tempfile, name, refused(getattr(tempfile, name)))
    for name in ("mkdir", "write_bytes", "write_text", "rename"):
        monkeypatch.setattr(Path, name, refused(getattr(Path, name)))


@pytest.mark.slow
@pytest.mark.parametrize("when", [0, 1, 2, 5, 10])
def test_a_volume_that_becomes_read_only_keeps_the_older_job(when, tmp_path, monkeypatch, capsys):
    assert run_here(*TETRAHEDRON, "-o", tmp_path / "out") == 0
    before = contents_of(tmp_path)
    with monkeypatch.context() as patch:
        read_only(patch, when)
        assert run_here(*TETRAHEDRON, "-o", tmp_path / "out") == 2
    said = capsys.readouterr().err
    assert "Read-only file system" in said
    assert contents_of(tmp_path) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", [("inspect", "--png", "a.png"), ("model", "-o", "a.glb")], ids=lambda c: c[0]
)
def test_single_files_on_a_read_only_volume_are_named(command, tmp_path, monkeypatch, capsys):
    name, option, file = command
    with monkeypatch.context() as patch:
        read_only(patch, 0)
        assert run_here(name, "shape:tetrahedron", option, tmp_path / file) == 2
    said = capsys.readouterr().err
    assert f"cannot write {tmp_path / file}: Read-only file system" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="closes a POSIX pipe")
@pytest.mark.parametrize(("said", "code"), [(("materials",), 0), (("inspect", "none.obj"), 2)])
def test_a_reader_that_is_gone_changes_no_exit_code(said, code):
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, "-m", "fabweave", *said]
    ended = subprocess.run(command, stdout=write, stderr=write, timeout=60, check=False)
    os.close(write)
    assert ended.returncode == code


@pytest.mark.slow
def test_two_runs_at_once_into_one_folder(tmp_path):
    folder = tmp_path / "out"
    command = [sys.executable, "-m", "fabweave", *TETRAHEDRON, "-o", str(folder)]
    runs = [
        subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) for _ in range(2)
    ]
    said = [run.communicate(timeout=300)[1].decode("utf-8", "replace") for run in runs]
    codes = [run.returncode for run in runs]
    # Each makes the same job; whichever comes late replaces it, or says that it cannot.
    assert 0 in codes, said
    assert set(codes) <= {0, 2}, said
    assert "Traceback" not in "".join(said)
    assert list(tmp_path.iterdir()) == [folder]
    assert verify_job(folder).ok


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends a POSIX signal")
@pytest.mark.usefixtures("shipped")
@pytest.mark.parametrize("what", ["portrait_png", "order_of", "_greedy"])
def test_processes_that_are_killed_end_a_run_in_words(what, tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    if what == "_greedy":
        # A small job is nested in batches, as very large ones are.
        monkeypatch.setattr(batches, what, die)
        # Sheets are foretold by nesting in this process, which is not to be killed.
        monkeypatch.setattr(split_plan, "rough_nesting", lambda *_: None)
        monkeypatch.setattr("fabweave.nest.nesting.batch_count", lambda _: 2)
    else:
        room = "papers" if what == "portrait_png" else "draw"
        monkeypatch.setattr(f"fabweave.job.{room}.{what}", die)
    assert run_here(*TETRAHEDRON, "-o", tmp_path / "out") == 1
    said = capfd.readouterr().err
    assert said.startswith("fabweave: part of the work was lost (3 processes ended before")
    assert "Traceback" not in said
    assert list(tmp_path.iterdir()) == []
