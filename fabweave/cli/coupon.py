"""The command that draws a test coupon."""

from pathlib import Path

import click

from fabweave.cli.options import folder_option, length_up_to, table_option
from fabweave.core.parallel.interrupt import held_back


@click.command()
@click.argument("directory", required=False, type=click.Path(path_type=Path))
@click.option("--material", metavar="NAME", help="The material to test. [default: the job's]")
@table_option("library")
@click.option(
    "--thickness", type=length_up_to(100.0), help="Measured thickness. [default: the job's]"
)
@table_option("fastener")
@folder_option(
    "A folder of its own for coupon.dxf, .svg, .png and .txt. It replaces an older coupon."
)
def coupon(
    directory: Path | None,
    material: str | None,
    library: tuple[str, ...],
    thickness: float | None,
    fastener: str | None,
    output: Path,
) -> None:
    """Draw a test coupon to cut first: holes, kerf, a lap, letters, a bend, a mat to practise on.

    In the folder of a finished job it finds material, hole, laps, ribbons and tightest bend.
    coupon.txt says what to measure, and which option to set.
    """
    with held_back():
        from fabweave.job.coupon import check_coupon_folder, coupon_for, write_coupon
        from fabweave.options.user_files import user_entries
        from fabweave.stock.hardware import parse_fastener

    check_coupon_folder(output)
    own = () if material is None else user_entries("library", library)
    hole_mm = parse_fastener(fastener).hole_mm
    planned = coupon_for(directory, material, thickness, hole_mm, own)
    write_coupon(planned, output)
    click.echo(
        f"coupon: {planned.material.description}; hole "
        f"{planned.hole_mm:g} mm, lap {planned.lap_mm:.1f} mm, ribbon {planned.width_mm:.1f} mm, "
        f"bend radius {planned.bend_mm:.1f} mm"
    )
    click.echo(f"Cut {output / 'coupon.dxf'} or .svg, and read {output / 'coupon.txt'}")
