"""Make a test coupon, alone or for a finished job."""

import json
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

from fabweave.app.preflight_job import supplies_of
from fabweave.app.settings import read_job_options
from fabweave.core.errors import InputError
from fabweave.core.output_files import write_files
from fabweave.cut.coupon import Coupon, coupon_text, draw_coupon, plan_coupon
from fabweave.cut.write.dxf import dxf_bytes
from fabweave.cut.write.preview import png_bytes
from fabweave.cut.write.svg import svg_text
from fabweave.stock.material import Material, with_thickness
from fabweave.stock.supplies import Supplies
from fabweave.stock.supply_plan import sort_of_material


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
    told = _read_job(directory) if directory is not None else {}
    own: Supplies | None = told.get("supplies")
    if material is not None:
        sheet = sort_of_material(material, user_materials)
    elif own is None:
        raise InputError("no material: say --material NAME, or name a finished job's folder")
    elif own.several:
        # A coupon is cut from one sheet.
        raise InputError(
            f"the job has {len(own.each)} materials, and a coupon is of one: say which, with "
            + " or ".join(
                f"--material {m.name} --thickness {m.thickness_mm:g}mm" for m in own.materials
            )
        )
    else:
        sheet = own.only
    sheet = sheet if thickness_mm is None else with_thickness(sheet, thickness_mm)
    return plan_coupon(
        sheet,
        hole_mm=hole_mm if hole_mm is not None else told.get("hole_mm"),
        lap_mm=told.get("lap_mm"),
        width_mm=told.get("width_mm"),
        bend_mm=told.get("bend_mm"),
    )


def _read_job(directory: Path) -> dict[str, Any]:
    """Return what a finished job says; None where it has nothing of the kind."""
    options = read_job_options(directory / "job.toml")
    try:
        plan = json.loads((directory / "crossing_map.json").read_text(encoding="utf-8"))
        ribbons = json.loads((directory / "ribbons.json").read_text(encoding="utf-8"))
        holes = [
            station["hole_mm"]
            for piece in plan["pieces"]
            for station in piece["stations"]
            if station["hole_mm"] is not None
        ]
        laps = [joint["lap_mm"] for joint in plan["joints"] if joint["lap_mm"] > 0.0]
        widths = [thread["narrowest_mm"] for thread in ribbons["threads"]]
        bends = [one["bend_mm"] for one in ribbons["threads"] if one["bend_mm"] is not None]
        return {
            "supplies": supplies_of(options),
            "hole_mm": max(holes, default=None),
            "lap_mm": median(laps) if laps else None,
            "width_mm": median(widths) if widths else None,
            "bend_mm": min(bends, default=None),
        }
    except (OSError, LookupError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{directory} is no finished job that a coupon can be made for "
            f"({type(error).__name__}: {error}); fabweave verify tells what is wrong with it"
        ) from error


def write_coupon(coupon: Coupon, directory: Path, *, dxf: str = "R2010") -> None:
    """Write ``coupon.dxf``, ``.svg``, ``.png`` and ``.txt`` into a folder, made if it is not there.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    drawing = draw_coupon(coupon)
    contents = {
        "coupon.dxf": dxf_bytes(drawing, version=dxf),
        "coupon.svg": svg_text(drawing).encode(),
        "coupon.png": png_bytes(drawing, titles={}),  # its pieces are engraved with what they are
        "coupon.txt": coupon_text(coupon).encode(),
    }
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {directory}: {error.strerror}") from error
    write_files({directory / name: content for name, content in contents.items()})
