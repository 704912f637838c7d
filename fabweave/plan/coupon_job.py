"""Make a test coupon, alone or for a finished job."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from fabweave.core.errors import InputError
from fabweave.core.files import write_files
from fabweave.core.messages import few_of
from fabweave.options.settings import read_job_options
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.plan.preflight import finished_job, supplies_of
from fabweave.plan.ribbon_report import read_ribbon_report
from fabweave.sheet.coupon import FIRST_WORDS, Coupon, coupon_text, draw_coupon, plan_coupon
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.preview import png_bytes
from fabweave.sheet.write.svg import svg_text
from fabweave.stock.material import Material, with_thickness
from fabweave.stock.supplies import Supplies, sort_of_material


def coupon_for(
    directory: Path | None,
    material: str | None = None,
    thickness_mm: float | None = None,
    hole_mm: float | None = None,
    user_materials: Sequence[Material] = (),
) -> Coupon:
    """Plan a coupon: for a finished job, with its material, hole, laps, widths and bends.

    Parameters
    ----------
    directory : Path or None
        A finished job's folder.
    material, thickness_mm, hole_mm
        What is asked for wins over what the job says.
    user_materials : sequence of Material
        Beside those of the library, if it is asked for a material.

    Raises
    ------
    InputError
        If there is neither a material nor a job, or a job's file cannot be read.
    """
    figures = _JobFigures() if directory is None else _read_job(directory)
    supplies = figures.supplies
    if material is not None:
        sheet = sort_of_material(material, user_materials)
    elif supplies is None:
        raise InputError(
            "there is no material: use --material NAME, or give the folder of a finished job"
        )
    elif supplies.several:
        # A coupon is cut from one sheet.
        raise InputError(
            f"the job has {len(supplies.each)} materials, but a coupon tests one: choose it with "
            + " or ".join(
                f"--material {m.name} --thickness {m.thickness_mm:g}mm" for m in supplies.materials
            )
        )
    else:
        sheet = supplies.only
    sheet = sheet if thickness_mm is None else with_thickness(sheet, thickness_mm)
    return plan_coupon(
        sheet,
        hole_mm=hole_mm if hole_mm is not None else figures.hole_mm,
        lap_mm=figures.lap_mm,
        width_mm=figures.width_mm,
        bend_mm=figures.bend_mm,
    )


class _JobFigures(NamedTuple):
    """What a finished job says, in millimetres; None where it has nothing of the kind."""

    supplies: Supplies | None = None
    hole_mm: float | None = None
    lap_mm: float | None = None
    width_mm: float | None = None
    bend_mm: float | None = None


def _read_job(directory: Path) -> _JobFigures:
    """Return what a finished job says."""
    options = read_job_options(directory / "job.toml")
    with finished_job(directory, "a coupon can be made for"):
        crossing_map = read_crossing_map(directory / "crossing_map.json")
        threads = read_ribbon_report(directory / "ribbons.json").threads
        holes = [
            station.hole_mm
            for piece in crossing_map.pieces
            for station in piece.stations
            if station.hole_mm is not None
        ]
        laps = [joint.lap_mm for joint in crossing_map.joints if joint.lap_mm > 0.0]
        widths = [thread.narrowest_mm for thread in threads if thread.narrowest_mm is not None]
        bends = [thread.bend_mm for thread in threads if thread.bend_mm is not None]
        return _JobFigures(
            supplies_of(options),
            max(holes, default=None),
            median(laps) if laps else None,
            median(widths) if widths else None,
            min(bends, default=None),
        )


#: The files of a coupon.
_FILES = ("coupon.dxf", "coupon.png", "coupon.svg", "coupon.txt")


def check_coupon_folder(directory: Path) -> None:
    """Raise InputError unless a folder is new, empty, or has nothing but an older coupon's files.

    A link to a folder stands for that folder.
    """
    if directory.is_symlink() and not directory.exists():
        raise InputError(f"{directory} is a link to nowhere; name another folder with -o")
    if not directory.exists():
        return
    if not directory.is_dir():
        raise InputError(f"{directory} is a file; name a folder with -o")
    names = sorted(path.name for path in directory.iterdir())
    foreign = [name for name in names if name not in _FILES]
    if not foreign and names:
        text = directory / "coupon.txt"
        known = text.is_file() and text.read_bytes().startswith(FIRST_WORDS.encode())
        foreign = [] if known else names
    if foreign:
        raise InputError(
            f"a coupon needs a folder of its own, and {directory} has other files "
            f"({few_of(foreign)}); name a new folder, such as -o {directory / 'coupon'}"
        )


def write_coupon(coupon: Coupon, directory: Path) -> None:
    """Write ``coupon.dxf``, ``.svg``, ``.png`` and ``.txt`` into a folder, made if it is not there.

    Raises
    ------
    InputError
        If a file cannot be written, or the folder has any other file.
    """
    check_coupon_folder(directory)
    drawing = draw_coupon(coupon)
    contents = {
        "coupon.dxf": dxf_bytes(drawing),
        "coupon.svg": svg_text(drawing).encode(),
        "coupon.png": png_bytes(drawing, titles={}),  # its pieces are engraved with what they are
        "coupon.txt": coupon_text(coupon).encode(),
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {directory}: {error.strerror}") from error
    write_files({directory / name: content for name, content in contents.items()})
