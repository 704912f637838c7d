"""The command that writes the woven object as a model or a picture."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fabweave.cli.options import (
    Parsed,
    SectionedCommand,
    job_options,
    job_settings,
    json_option,
    length_up_to,
    quiet_option,
    read_view,
)
from fabweave.cli.terminal import progress_bar
from fabweave.core.parallel.interrupt import held_back

if TYPE_CHECKING:
    from fabweave.picture.camera import View


@click.command(cls=SectionedCommand)
@job_options()
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    required=True,
    help="What to write: .glb (metres), .obj, .ply, .stl, .3mf or .png (a picture). "
    "All but .glb are in millimetres.",
)
@click.option(
    "--yarn", is_flag=True, help="Make round yarns, as thick as they have room, not ribbons."
)
@click.option(
    "--yarn-radius", type=length_up_to(1000.0), help="One radius for all yarns (implies --yarn)."
)
@click.option(
    "--sides", type=int, default=12, show_default=True, help="Sides of the yarns' cross-section."
)
@click.option(
    "--view",
    "views",
    type=Parsed("AZIMUTH,ELEVATION", read_view),
    multiple=True,
    help="View of a picture: degrees around the upward axis and above the horizon, e.g. -60,30. "
    "Repeat it for several side by side. [default: fabweave chooses]",
)
@click.option(
    "--show",
    type=click.Choice(("weave", "twists", "faults")),
    default="weave",
    show_default=True,
    help="What a picture shows: the weave, edges by the sense of their twist, or the "
    "broken conditions of a 2/2 twill.",
)
@json_option
@quiet_option
def model(
    output: Path,
    yarn: bool,
    yarn_radius: float | None,
    sides: int,
    views: "tuple[View, ...]",
    show: Literal["weave", "twists", "faults"],
    as_json: bool,
    quiet: bool,
    mesh: str | None,
    **options: Any,
) -> None:
    """Weave MESH and write the woven object as a 3-D model or a picture; nothing is cut.

    Ribbons are sheets. In .stl and .3mf, which are for printing, they are solids as thick as the
    material. Yarns are closed tubes that do not touch.

    \b
    Examples:
      fabweave model spot.obj --size 400mm --pattern twill -o spot.glb
      fabweave model "shape:torus?m=24&n=12" --size 120mm --yarn -o torus.3mf
      fabweave model shape:tetrahedron --size 60mm --yarn-radius 3mm --sides 24 -o rings.stl
      fabweave model "shape:slit?genus=2" --size 300mm --view -60,30 --view 95,52 -o slit.png
      fabweave model spot.obj --size 400mm --pattern twill --show faults -o faults.png
    """
    with held_back():
        from fabweave.job.model import YarnOptions, check_suffix, write_model

    check_suffix(output)
    spun = YarnOptions(yarn_radius, sides) if yarn or yarn_radius is not None else None
    settings = job_settings(mesh, options)
    with progress_bar(quiet or as_json) as progress:
        facts = write_model(settings, output, yarn=spun, views=views, show=show, progress=progress)
    if as_json:
        click.echo(json.dumps(facts, indent=1))
    elif not quiet:
        _tell(facts)


def _tell(facts: dict[str, Any]) -> None:
    """Print what was written."""
    from rich.console import Console

    console = Console(highlight=False, soft_wrap=True)
    for note in facts["notes"]:
        console.print(f"  {note}", markup=False)
    console.print(
        f"{facts['threads']} threads, {facts['crossings']} crossings, {facts['kind']}: "
        f"{facts['file']}",
        markup=False,
    )
    radius = facts.get("radius_mm")
    if radius is not None:
        console.print(
            f"radius {radius['least']:.3g} to {radius['greatest']:.3g} mm; up to "
            f"{radius['greatest_possible']:.3g} mm has room",
            markup=False,
        )
