"""The command that opens the studio."""

from pathlib import Path

import click

from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.argument("model", required=False, metavar="[MESH|job.toml]")
@click.option(
    "-o", "--output", type=click.Path(file_okay=False, path_type=Path), default="studio",
    show_default=True, metavar="DIR", help="Folder for jobs and for dropped files.",
)  # fmt: skip
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port; 0 for a free one.")
@click.option("--browser/--no-browser", default=True, help="Whether to open a browser.")
@click.option(
    "--lan", is_flag=True,
    help="Let tablets and phones of your network in, by an address that the terminal prints.",
)  # fmt: skip
def studio(model: str | None, output: Path, port: int, browser: bool, lan: bool) -> None:
    """Open a page on which MESH is changed and seen at once: form, weave, pieces, sheets, hours.

    Only this machine can open it, unless --lan says otherwise. Ctrl-C, or the button End, ends it.

    \b
    Examples:
      fabweave studio
      fabweave studio cow.obj
      fabweave studio cow/job.toml -o cows
    """
    with held_back():
        from fabweave.studio.server import serve

    serve(model, output, port, browser=browser, lan=lan)
