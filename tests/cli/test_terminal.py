"""In a pipe, lines say what is being done; a silent command says nothing."""

import time

from fabweave.cli import terminal
from fabweave.cli.terminal import progress_bar


def test_a_line_says_now_and_then_what_is_being_done(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "_EVERY_S", 0.02)
    for silent in (False, True):
        with progress_bar(silent) as progress:
            progress("nesting", 3, 9)
            time.sleep(0.2)
        told = capsys.readouterr()
        assert told.out == ""
        lines = told.err.splitlines()
        assert all("nesting" in line and {"3", "9"} < set(line.split()) for line in lines)
        assert (len(lines) > 1) is not silent
    time.sleep(0.1)
    assert capsys.readouterr().err == ""  # nothing is told when all is done
