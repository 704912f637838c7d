"""The help of the commands comes from the table, and its examples can be typed."""

import re
import shlex
import subprocess
import sys

import click
import pytest
from jobs import run

from fabweave.cli.main import cli
from fabweave.options.table import OPTIONS


def help_of(command: str, wide: int = 10_000) -> str:
    found = cli.commands[command]
    context = click.Context(found, info_name=command, terminal_width=wide)
    context.meta["help_all"] = True
    return found.get_help(context)


def test_every_option_of_the_table_is_in_help_with_its_text_and_its_default() -> None:
    rows = re.split(r"\n  (?=-)", help_of("make"))
    told = {row.split()[0]: " ".join(row.split()) for row in rows}
    for option in OPTIONS[1:]:
        row = told[option.flag]
        assert option.text in row, option.name
        assert row.count("[default") == bool(option.usual), option.name
        assert option.usual in row, option.name


@pytest.mark.parametrize("command", cli.commands)
def test_every_command_has_help_and_examples_that_parse(command: str) -> None:
    text = help_of(command)
    assert text.startswith("Usage: ")
    assert cli.commands[command].get_short_help_str()
    # No mark of the formatter is left.
    assert "\\b" not in text
    assert "\b" not in text
    lines = re.findall(r"^ +fabweave ((?:make|inspect|model) .*--.*)$", text, re.MULTILINE)
    assert len(lines) >= 3 * (command in ("make", "inspect", "model"))
    for line in lines:
        name, *typed = shlex.split(line)
        context = cli.commands[name].make_context(name, list(typed))
        assert context.params["mesh"] == typed[0]
        with pytest.raises(click.NoSuchOption):
            cli.commands[name].make_context(name, [*typed, "--colors", "safe"])


def test_help_does_not_load_what_jobs_are_made_with() -> None:
    # Numbers of arrays, geometry, tables on the terminal: all of it waits for a job.
    script = "import sys, fabweave.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    loaded = set(done.stdout.decode().split())
    assert "fabweave.options.table" in loaded
    assert not loaded & {"numpy", "scipy", "shapely", "trimesh", "ezdxf", "rich", "platformdirs"}


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("make cow.obj --siz 400mm", "--size"),
        ("make 'my cow.obj' --size 400mm", "-o 'my cow'"),
        ("make 'shape:torus?m=8&n=4'", "-o torus"),
        ("guide asembly", "assembling"),
        ("inspect {folder}/cwo.obj", "{folder}/cow.obj"),
    ],
)
def test_what_is_nearly_right_is_answered_with_what_is_meant(typed, meant, tmp_path, capsys):
    (tmp_path / "cow.obj").touch()
    assert run(*(word.format(folder=tmp_path) for word in shlex.split(typed))) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert meant.format(folder=tmp_path) in told.err
