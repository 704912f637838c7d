"""A full disk, too little memory, a terminal that knows few letters: each ends in words."""

import io
import os
import re
import subprocess
import sys
from functools import partial

import numpy as np
import pytest

from fabweave.cli.main import main
from fabweave.cli.terminal import speak_plainly


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


def test_a_full_disk_is_told_with_the_path_and_nothing_is_left(tmp_path):
    folder = tmp_path / "out"
    code, _, said = run(
        "make", "shape:tetrahedron", "--size", "120mm", "--effort", "quick", "-o", str(folder),
        limit=FULL,
    )  # fmt: skip
    assert (code, list(tmp_path.iterdir())) == (2, [])
    assert said.endswith(
        f"cannot write the job in {folder}: File too large; nothing was kept. Free some space, or "
        "name another folder with -o"
    )


@pytest.mark.parametrize(
    "command", [("inspect", "--png", "a.png"), ("model", "-o", "a.glb")], ids=lambda c: c[0]
)
def test_single_files_on_a_full_disk_are_named(command, tmp_path):
    name, option, file = command
    path = tmp_path / file
    code, _, said = run(
        name, "shape:tetrahedron", "--size", "120mm", option, str(path), limit=("RLIMIT_FSIZE", 500)
    )
    assert (code, list(tmp_path.iterdir())) == (2, [])
    assert said.endswith(f"cannot write {path}: File too large")


def test_too_little_memory_is_told(monkeypatch, capsys):
    def exhausted(*_arguments, **_options):
        np.zeros(2**50)

    monkeypatch.setattr("fabweave.app.inspection.inspect_mesh", exhausted)
    with pytest.raises(SystemExit) as stop:
        main(["inspect", "shape:cube"])
    assert stop.value.code == 1
    said = capsys.readouterr().err
    assert said.startswith("fabweave: there is not enough memory for this; use a coarser mesh")


def test_a_terminal_that_knows_ascii_alone_gets_plain_letters():
    code, shown, said = run("inspect", "shape:cube", LC_ALL="C", PYTHONIOENCODING="ascii")
    assert (code, said) == (0, "")
    assert b"100.0 x 100.0 x 100.0 mm" in re.sub(rb"\s+", b" ", shown)


def test_letters_that_have_no_like_become_numbers():
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    speak_plainly(stream)
    stream.write("3 × 4 m² … ж\udcff")
    stream.flush()
    assert stream.buffer.getvalue() == rb"3 x 4 m2 ... \u0436\udcff"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--hole", "0.01mm"), "is too small for a laser"),
        (("--margin", "1m"), "leaves nothing of a sheet"),
        (("--layout", "/dev/zero"), "it is a device; name a file"),
        (("--kerf", "9mm"), "a kerf of 9 mm needs twice its width"),
    ],
)
def test_what_is_refused_is_refused_before_the_work(options, words, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("fabweave.app.pipeline.load_mesh", None)
    with pytest.raises(SystemExit) as stop:
        main(["make", "shape:cube", *options, "-o", str(tmp_path / "out")])
    assert stop.value.code == 2
    assert words in " ".join(capsys.readouterr().err.split())
