"""Every example runs and prints what it says."""

import runpy
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_count_threads(capsys):
    runpy.run_path(str(EXAMPLES / "count_threads.py"))
    told = capsys.readouterr().out.splitlines()
    assert [line.split(": ")[1].split()[::3] for line in told] == [
        ["3", "4"],
        ["4", "6"],
        ["4", "6"],
        ["6", "10"],
        ["6", "10"],
    ]


def test_make_a_job(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["make_a_job.py", str(tmp_path / "out")])
    runpy.run_path(str(EXAMPLES / "make_a_job.py"))
    assert capsys.readouterr().out == "8 pieces on 1 sheet\nproved by 16 checks\n"
    assert (tmp_path / "out" / "verify.json").is_file()


def test_no_example_is_left_out():
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"count_threads.py", "make_a_job.py"}
