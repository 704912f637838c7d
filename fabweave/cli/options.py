"""The options of the main job on the command line, made of the table of options."""

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from fabweave.app.options.option import MESH, SECTIONS, Option
from fabweave.app.options.table import OPTIONS, option_named
from fabweave.app.settings import Settings, settings_from_job, settings_from_options
from fabweave.core.errors import InputError

Decorator: TypeAlias = Callable[[Any], Any]

#: The section of options that are not in the table.
REST = "Output"
#: The section of what a person wishes a design to come to.
WISHES = "Wishes (a design is looked for that meets them)"


class Typed(click.ParamType[Any]):
    """What an option of the table takes. It stays as it was typed: settings are made of it."""

    def __init__(self, option: Option) -> None:
        self.option = option
        self.name = option.name

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Check what was typed."""
        try:
            self.option.kind.parse(value)
        except InputError as error:
            self.fail(str(error), param, ctx)
        return value

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer the words that the option takes, or files."""
        words = [word for word in self.option.kind.choices if word.startswith(incomplete)]
        if "FILE" in self.option.metavar:
            return click.Path().shell_complete(ctx, param, incomplete)
        return [CompletionItem(word) for word in words]


class SectionedOption(click.Option):
    """An option whose help stands in a section."""

    def __init__(self, declarations: Sequence[str], *, section: str, **rest: Any) -> None:
        super().__init__(declarations, **rest)
        self.section = section


class TableOption(SectionedOption):
    """An option of the table; its words are looked up when its help is asked for."""

    def __init__(self, declarations: Sequence[str], *, option: Option) -> None:
        kind = option.kind
        super().__init__(
            declarations,
            section=option.section,
            # With False, click takes a value that begins with a hyphen for another option.
            is_flag=kind.flag or None,
            type=None if kind.flag else Typed(option),
            multiple=kind.repeatable,
            # Where nothing is said, fabweave decides.
            **({"default": None} if kind.denied else {}),
        )
        self.option = option

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:  # noqa: ARG002
        """Return what help says of it: name and value, and what it is."""
        usual = f" [default: {self.option.usual}]" if self.option.usual else ""
        return self.option.shown, self.option.text + usual


class SectionedCommand(click.Command):
    """A command whose help lists its options in sections, in the order of the table."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write each section that has options, and the rest."""
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in (*SECTIONS, WISHES, REST)}
        for parameter in self.get_params(ctx):
            # Newer versions of click have a line for arguments, too; the text above names those.
            record = parameter.get_help_record(ctx) if isinstance(parameter, click.Option) else None
            if record is not None:
                rows[getattr(parameter, "section", REST)].append(record)
        for title, records in rows.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


def job_options(*, making: bool = False) -> Decorator:
    """Return what gives a command the mesh, and the options that decide its weave, or the job."""
    parameters: list[Decorator] = [
        click.argument("mesh", required=False),
        click.option(
            "--config",
            cls=SectionedOption,
            section=MESH,
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="Take the settings of a finished job from its job.toml; what is typed wins.",
        ),
        *(table_option(option.name) for option in OPTIONS[1:] if making or not option.making),
    ]

    def give(command: Any) -> Any:
        for parameter in reversed(parameters):
            command = parameter(command)
        return command

    return give


class _Folder(click.Path):
    """A folder to write; where none is named, the message has an example."""

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:  # noqa: ARG002
        """Return an example, named after the mesh if there is one."""
        mesh = (ctx.params.get("mesh") if ctx is not None else None) or ""
        stem = Path(mesh.partition("?")[0].removeprefix("shape:")).stem
        return f"Name a folder to write, for example: -o {shlex.quote(stem or 'out')}"


def folder_option(text: str) -> Decorator:
    """Return what gives a command the folder that it writes."""
    return click.option(
        "-o",
        "--output",
        type=_Folder(path_type=Path),
        metavar="DIR",
        required=True,
        help=text,
    )


def cluster_option(work: str) -> Decorator:
    """Return what gives a command other computers to do its work, told as in "Nest them"."""
    return click.option(
        "--cluster",
        metavar="ADDRESS",
        help=f"{work} on the Dask cluster whose scheduler has this address, such as "
        "tcp://192.168.1.20:8786; needs the extra cluster. The files are the same. [default: the "
        "processors of this computer]",
    )


json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
verbose_option = click.option(
    "-v", "--verbose", is_flag=True, help="Print everything that is known, not only what matters."
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")


def table_option(name: str) -> Decorator:
    """Return what gives a command an option of the table."""
    option = option_named(name)
    names = f"{option.flag}/{option.denial}" if option.kind.denied else option.flag
    return click.option(names, cls=TableOption, option=option)


def job_settings(mesh: str | None, options: dict[str, Any]) -> Settings:
    """Turn the options of the command line into settings."""
    context = click.get_current_context()
    typed = {
        option.name: options[option.name]
        for option in OPTIONS[1:]
        if option.name in options
        and context.get_parameter_source(option.name) is not ParameterSource.DEFAULT
    }
    if mesh:
        typed["mesh"] = mesh
    if options["config"] is not None:
        return settings_from_job(options["config"], **typed)
    return settings_from_options(typed.pop("mesh", None), **typed)
