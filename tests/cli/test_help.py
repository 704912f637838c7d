"""The help of the commands: complete, in sections, and with examples that can be typed."""

import re
import shlex

import click
import pytest

from fabweave.cli.commands import cli
from fabweave.cli.sections import REST, SECTIONS

COMMANDS = ("make", "inspect")


def help_of(command: str) -> str:
    found = cli.commands[command]
    return found.get_help(click.Context(found, info_name=command))


def options_of(command: str) -> dict[str, click.Option]:
    context = click.Context(cli.commands[command])
    params = cli.commands[command].get_params(context)
    return {param.name: param for param in params if isinstance(param, click.Option)}


@pytest.mark.parametrize("command", COMMANDS)
def test_every_option_stands_once_in_its_section(command: str) -> None:
    titles = [title for title in (*SECTIONS, REST) if f"\n{title}:\n" in help_of(command)]
    # In the order of the stations, and nothing under any other heading.
    _, *parts = re.split(r"^([A-Z][a-z ]+):\n(?=  -)", help_of(command), flags=re.MULTILINE)
    assert parts[::2] == titles
    assert titles[0] == "Mesh"
    assert titles[-1] == REST
    for name, option in options_of(command).items():
        home = next((title for title, names in SECTIONS.items() if name in names), REST)
        at = rf"^  (?:-\w, )?{option.opts[-1]}\b(?!-)"
        where = [title for title, text in zip(parts[::2], parts[1::2], strict=True)
                 if re.search(at, text, flags=re.MULTILINE)]  # fmt: skip
        assert where == [home], name


def test_sections_name_real_options_once() -> None:
    named = [name for names in SECTIONS.values() for name in names]
    assert len(named) == len(set(named))
    assert set(named) <= set(options_of("make"))


@pytest.mark.parametrize("command", COMMANDS)
def test_no_mark_of_the_formatter_is_left(command: str) -> None:
    assert "\\b" not in help_of(command)
    assert "\b" not in help_of(command)


@pytest.mark.parametrize("command", COMMANDS)
def test_examples_parse(command: str) -> None:
    lines = re.findall(r"^ +(fabweave (?:make|inspect) .*--.*)$", help_of(command), re.MULTILINE)
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
