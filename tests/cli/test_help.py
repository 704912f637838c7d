"""The help of the commands: complete, in the table's sections, with examples that can be typed."""

import re
import shlex
import subprocess
import sys

import click
import pytest
from jobs import run

from fabweave.app.options.option import SECTIONS
from fabweave.app.options.table import OPTIONS
from fabweave.cli.main import cli
from fabweave.cli.options import REST, WISHES

COMMANDS = ("make", "inspect", "model")
#: In help, but no setting.
OTHERS = {"config": "Mesh"}


def help_of(command: str, wide: int = 100) -> str:
    found = cli.commands[command]
    return found.get_help(click.Context(found, info_name=command, terminal_width=wide))


def sections_of(text: str) -> dict[str, list[str]]:
    """Return the options that each section of a help lists, in their order."""
    _, *parts = re.split(r"^([A-Z][a-z ()]+):\n(?=  -)", text, flags=re.MULTILINE)
    listed = zip(parts[::2], parts[1::2], strict=True)
    return {title: re.findall(r"^  (?:-\w, )?--([a-z-]+)", rows, re.MULTILINE)
            for title, rows in listed}  # fmt: skip


@pytest.mark.parametrize("command", COMMANDS)
def test_help_has_the_options_of_the_table_in_its_sections(command: str) -> None:
    found = sections_of(help_of(command))
    for title in SECTIONS:
        wanted = [
            option.name
            for option in OPTIONS[1:]
            if option.section == title and (command == "make" or not option.making)
        ]
        others = [name for name, section in OTHERS.items() if section == title]
        told = [name.replace("-", "_") for name in found.pop(title, [])]
        assert told == [*others, *wanted], title
    # What is left is no setting, nor are wishes.
    wishes = found.pop(WISHES, [])
    assert bool(wishes) == (command == "make")
    assert list(found) == [REST]
    assert not set(wishes) & {option.flag[2:] for option in OPTIONS}
    assert not set(found[REST]) & {option.flag[2:] for option in OPTIONS}


def test_every_option_is_told_with_its_default() -> None:
    rows = re.split(r"\n  (?=-)", help_of("make", 10_000))
    told = {row.split()[0]: " ".join(row.split()) for row in rows}
    for option in OPTIONS[1:]:
        usual = f" [default: {option.usual}]" if option.usual else ""
        value = "" if option.kind.flag else f" {option.metavar}"
        if option.kind.denied:
            value = f" / --no-{option.flag[2:]}"
        row = told[option.flag]
        assert row.startswith(f"{option.flag}{value} {option.text}{usual}"), option.name
        assert row.count("[default") == bool(usual), option.name


@pytest.mark.parametrize("command", COMMANDS)
def test_no_mark_of_the_formatter_is_left(command: str) -> None:
    assert "\\b" not in help_of(command)
    assert "\b" not in help_of(command)


@pytest.mark.parametrize("command", COMMANDS)
def test_examples_parse(command: str) -> None:
    lines = re.findall(
        r"^ +(fabweave (?:make|inspect|model) .*--.*)$", help_of(command), re.MULTILINE
    )
    assert len(lines) >= 3
    for line in lines:
        _, name, *typed = shlex.split(line)
        assert name == command
        context = cli.commands[name].make_context(name, list(typed))
        assert context.params["mesh"] == typed[0]


@pytest.mark.parametrize("command", COMMANDS)
def test_an_example_with_an_unknown_option_would_be_found(command: str) -> None:
    with pytest.raises(click.NoSuchOption):
        cli.commands[command].make_context(command, ["shape:cube", "--colors", "safe"])


@pytest.mark.parametrize("command", cli.commands)
def test_every_command_has_help_that_says_what_it_does(command: str) -> None:
    text = help_of(command)
    assert text.startswith("Usage: ")
    assert cli.commands[command].get_short_help_str()


def test_help_does_not_load_what_jobs_are_made_with() -> None:
    # Numbers of arrays, geometry, tables on the terminal: all of it waits for a job.
    script = "import sys, fabweave.cli.main; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    loaded = set(done.stdout.decode().split())
    assert "fabweave.app.options.table" in loaded
    assert not loaded & {"numpy", "scipy", "shapely", "trimesh", "ezdxf", "rich", "platformdirs"}


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        (("make", "cow.obj", "--siz", "400mm"), "Did you mean '--size'?"),
        (("make", "my cow.obj", "--size", "400mm"), "for example: -o 'my cow'"),
        (("make", "shape:torus?m=8&n=4"), "for example: -o torus"),
        (("guide", "asembly"), "did you mean assembling?"),
        (("inspect", "{folder}/cwo.obj"), "did you mean {folder}/cow.obj?"),
    ],
)
def test_what_is_nearly_right_is_answered_with_what_is_meant(
    typed, words, tmp_path, capsys
) -> None:
    (tmp_path / "cow.obj").touch()
    (tmp_path / "job.toml").touch()
    assert run(*(word.format(folder=tmp_path) for word in typed)) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.rstrip().endswith(words.format(folder=tmp_path))
