"""The options of commands: those of the main job are made of the table of options."""

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from fabweave.core.errors import InputError
from fabweave.core.messages import closest_first
from fabweave.options.kinds import length
from fabweave.options.option import SECTIONS, Option
from fabweave.options.settings import Settings, settings_from_job, settings_from_options
from fabweave.options.table import OPTIONS, option_named


class Parsed(click.ParamType[Any]):
    """What a function reads, which raises InputError where it cannot."""

    def __init__(self, name: str, read: Callable[[Any], Any]) -> None:
        self.name, self.read = name, read

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Read what was typed."""
        try:
            return self.read(value)
        except InputError as error:
            self.fail(str(error), param, ctx)


def length_up_to(most_mm: float) -> Parsed:
    """Return the type of a length with a unit."""
    return Parsed("length", length(most_mm).parse)


def read_view(value: Any) -> Any:
    """Read from where a picture is taken: two angles."""
    from fabweave.picture.camera import View

    if not isinstance(value, str):
        return value
    try:
        azimuth, elevation = map(float, value.split(","))
        view = View(azimuth, elevation)
        view.axes()
    except ValueError as error:  # an InputError is a ValueError, too
        told = str(error) if isinstance(error, InputError) else "write it as -60,30 (degrees)"
        raise InputError(f"{value[:40]!r} is no view: {told}") from error
    return view


Decorator: TypeAlias = Callable[[Any], Any]

#: The sections of options that are not in the table: they stand before and after all others.
OUTPUT, REST = "Output", "Besides"
#: What few have: ``--help-all`` shows it.
_RARE = ("goal",)
#: Longer rows of words give way to a name for them in the first help, and longer defaults to none.
_LONGEST_METAVAR = 16
#: How ``--set`` says what has no value.
_FLAGS = {"true": True, "false": False}


class Typed(Parsed):
    """What an option of the table takes. It stays as it was typed: settings are made of it."""

    def __init__(self, option: Option) -> None:
        super().__init__(option.name, option.kind.parse)
        self.option = option

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Check what was typed."""
        super().convert(value, param, ctx)
        return value

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Offer the words that the option takes, or files."""
        words = [word for word in self.option.kind.choices if word.startswith(incomplete)]
        if "FILE" in self.option.metavar:
            return click.Path().shell_complete(ctx, param, incomplete)
        return [CompletionItem(word) for word in words]


class TableOption(click.Option):
    """An option of the table; its words are looked up when its help is asked for."""

    def __init__(self, declarations: Sequence[str], *, option: Option) -> None:
        kind = option.kind
        super().__init__(
            declarations,
            # With False, click takes a value that begins with a hyphen for another option.
            is_flag=kind.flag or None,
            type=None if kind.flag else Typed(option),
            multiple=kind.repeatable,
            default=False if kind.flag else None,
        )
        self.option = option

    def get_help_record(self, ctx: click.Context) -> tuple[str, str]:
        """Return what help says of it: name and value, and what it is, in a line or in full."""
        usual = self.option.usual
        if _asks_all(ctx):
            return self.option.shown, self.option.text + f" [default: {usual}]" * bool(usual)
        metavar = "" if self.option.kind.flag else self.option.metavar
        if len(metavar) > _LONGEST_METAVAR:
            metavar = "NAME"
        brief = (self.option.brief or self.option.text) + f" [{usual}]" * (
            0 < len(usual) < _LONGEST_METAVAR
        )
        return f"{self.option.flag} {metavar}".rstrip(), brief


def _asks_all(ctx: click.Context) -> bool:
    """Tell whether all of the help is asked for."""
    return bool(ctx.meta.get("help_all"))


class SectionedCommand(click.Command):
    """A command whose help is one screen, and all of it in sections with ``--help-all``."""

    def __init__(self, *args: Any, **rest: Any) -> None:
        super().__init__(*args, **rest)
        self.params.append(
            click.Option(
                ["--help-all"],
                is_flag=True,
                is_eager=True,
                expose_value=False,
                callback=_show_all,
                help="Show all options, each in full.",
            )
        )

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options that makers change from job to job; or all, in their sections."""
        parameters = [one for one in self.get_params(ctx) if isinstance(one, click.Option)]
        rows: dict[str, list[tuple[str, str]]] = {title: [] for title in (OUTPUT, *SECTIONS, REST)}
        for one in parameters:
            if isinstance(one, TableOption):
                section, first = one.option.section, one.option.first
            else:
                section = OUTPUT if one.name == "output" else REST
                first = one.name not in _RARE
            record = one.get_help_record(ctx) if first or _asks_all(ctx) else None
            if record is not None:
                rows[section].append(record)
        if not _asks_all(ctx):
            rows = {"Options": [record for records in rows.values() for record in records]}
        for title, records in rows.items():
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)


def _show_all(ctx: click.Context, _parameter: click.Parameter, asked: bool) -> None:
    """Print the whole help."""
    if asked:
        ctx.meta["help_all"] = True
        click.echo(ctx.get_help(), color=ctx.color)
        ctx.exit()


def job_options(*, making: bool = False) -> Decorator:
    """Return what gives a command the mesh, and the options that decide its weave, or the job."""
    parameters: list[Decorator] = [
        click.argument("mesh", required=False),
        click.option(
            "--machine",
            metavar="NAME|FILE",
            help="Profile of your machine: colours, kerf, bed ... (fabweave machine).",
        ),
        click.option(
            "--config",
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="The job.toml of a finished job; what you type wins.",
        ),
        click.option(
            "--set",
            "set_",
            multiple=True,
            metavar="NAME=VALUE",
            help="Any other option, such as ribbons.clearance=0.2mm.",
        ),
        table_options(option for option in OPTIONS[1:] if making or not option.making),
    ]
    return _all_of(parameters)


def _all_of(parameters: Sequence[Decorator]) -> Decorator:
    """Return what gives a command all of some parameters, in their order."""

    def give(command: Any) -> Any:
        for parameter in reversed(parameters):
            command = parameter(command)
        return command

    return give


def table_options(options: Iterable[Option]) -> Decorator:
    """Return what gives a command some options of the table."""
    return _all_of([table_option(option.name) for option in options])


class _Folder(click.Path):
    """A folder to write; where none is named, the message has an example."""

    def get_missing_message(self, param: click.Parameter, ctx: click.Context | None) -> str:  # noqa: ARG002
        """Return an example, named after the mesh if there is one."""
        mesh = ctx.params.get("mesh") if ctx is not None else None
        # Where no mesh is named either, click has a mark of its own for it.
        named = mesh if isinstance(mesh, str) else ""
        stem = Path(named.partition("?")[0].removeprefix("shape:")).stem
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


json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
verbose_option = click.option(
    "-v", "--verbose", is_flag=True, help="Print everything that is known."
)
quiet_option = click.option("-q", "--quiet", is_flag=True, help="Print nothing but errors.")


def table_option(name: str) -> Decorator:
    """Return what gives a command an option of the table."""
    option = option_named(name)
    return click.option(option.flag, option.name, cls=TableOption, option=option)


def job_settings(
    mesh: str | None, options: dict[str, Any], unsaid: Mapping[str, Any] = MappingProxyType({})
) -> Settings:
    """Turn the options of the command line into settings; ``unsaid`` are those not said there."""
    context = click.get_current_context()
    typed = {
        option.name: options[option.name]
        for option in OPTIONS[1:]
        if option.name in options
        and context.get_parameter_source(option.name) is not ParameterSource.DEFAULT
    }
    typed = {**unsaid, **typed, **_set(options["set_"])}
    if mesh:
        typed["mesh"] = mesh
    if options["machine"] is not None:
        typed["machine"] = options["machine"]
    if options["config"] is not None:
        return settings_from_job(options["config"], **typed)
    return settings_from_options(typed.pop("mesh", None), **typed)


def _set(told: Sequence[str]) -> dict[str, Any]:
    """Return the options that ``--set`` names, each with what it is set to.

    Examples
    --------
    >>> _set(["ribbons.clearance=0.2mm", "symmetrise=true"])
    {'clearance': '0.2mm', 'symmetrise': True}
    """
    found: dict[str, Any] = {}
    named = {path: option for option in OPTIONS[1:] for path in (option.path, option.name)}
    for one in told:
        name, equals, value = one.partition("=")
        option = named.get(name.strip().replace("-", "_"))
        if option is None:
            key = name.rpartition(".")[2].replace("-", "_")
            # The name is surer than the section before it.
            near = closest_first(key, [known.name for known in OPTIONS[1:]])[0]
            raise InputError(
                f"--set {one}: there is no option {name}; did you mean {named[near].path}?"
            )
        if not equals:
            raise InputError(f"--set {one}: write a value, too, as in {option.path}=VALUE")
        if option.kind.flag:
            if value not in _FLAGS:
                raise InputError(f"--set {one}: {option.name} is true or false")
            found[option.name] = _FLAGS[value]
        elif option.kind.repeatable:
            found.setdefault(option.name, []).append(value)
        else:
            found[option.name] = value
    return found
