"""The command line: its commands, and what becomes of errors."""

import logging
import sys
import warnings

import click

from fabweave import __version__
from fabweave.cli.batch import batch
from fabweave.cli.coupon import coupon
from fabweave.cli.guide import guide
from fabweave.cli.inspect import inspect
from fabweave.cli.machine import machine
from fabweave.cli.make import make
from fabweave.cli.materials import materials, shapes, targets
from fabweave.cli.model import model
from fabweave.cli.studio import studio
from fabweave.cli.terminal import speak_plainly, speak_to_nobody
from fabweave.cli.verify import verify
from fabweave.core.errors import CannotMakeError, FabweaveError
from fabweave.core.parallel.executors import collect_seldom
from fabweave.core.parallel.interrupt import exit_when_ended


@click.group(
    commands=[
        batch, coupon, guide, inspect, machine, make, materials, model, shapes, studio, targets,
        verify,
    ],
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip
@click.version_option(__version__, prog_name="fabweave")
def cli() -> None:
    """Turn a polygon mesh into a woven object that a person can cut and assemble.

    Try:   fabweave make "shape:torus?m=24&n=12" --size 300mm -o out

    Read:  fabweave guide
    """


def _be_a_child() -> None:
    """Do what a frozen program was started for by itself, if it was, and exit."""
    import multiprocessing

    multiprocessing.freeze_support()
    from fabweave.mesh.remesh import child

    if sys.argv[1:2] == [child.FLAG]:
        sys.exit(child.main(*sys.argv[2:5]))


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; exit with 0, 1 (cannot be made) or 2 (wrong usage or input).

    A signal that ends it gives 128 and its number, as in shells.
    """
    if getattr(sys, "frozen", False):
        _be_a_child()
    speak_to_nobody()
    for stream in (sys.stdout, sys.stderr):
        speak_plainly(stream)
    # What libraries log is for their developers; what matters of it, errors say in our words.
    logging.getLogger().addHandler(logging.NullHandler())
    warnings.simplefilter("ignore", RuntimeWarning)
    exit_when_ended()
    collect_seldom()
    try:
        cli.main(arguments, standalone_mode=False)
    except (click.exceptions.Abort, KeyboardInterrupt):
        click.echo("stopped; fabweave wrote nothing", err=True)
        sys.exit(130)
    except click.NoSuchOption as error:
        # Of those that resemble it, click tells all by the alphabet; the nearest is meant.
        near = (error.possibilities or [])[:1]
        click.NoSuchOption(error.option_name, possibilities=near, ctx=error.ctx).show()
        sys.exit(2)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FabweaveError as error:
        click.echo(f"fabweave: {error}", err=True)
        sys.exit(1 if isinstance(error, CannotMakeError) else 2)
    except OSError as error:  # what no module foresaw: a full disk, a folder that may not be made
        where = f" {error.filename}" if error.filename else ""
        why = error.strerror or error
        click.echo(f"fabweave: cannot read or write{where}: {why}", err=True)
        sys.exit(2)
    except MemoryError:
        click.echo(
            "fabweave: there is not enough memory for this; use a coarser mesh, fewer steps of "
            "refinement or a lower --effort, or close other programs",
            err=True,
        )
        sys.exit(1)
