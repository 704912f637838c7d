"""Check that the drawings have the version, units, colours and widths that are stated."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import Cut
from fabweave.verify.drawing import LAYERS, NOTES, Drawing
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

_VERSIONS = {"R2010": "AC1024", "R2000": "AC1015", "R12": "AC1009"}
_UNITS_MM = {"mm": 1.0, "px96": 25.4 / 96.0}
#: Only R2010 has exact colours.
_EXACT = "R2010"
#: Widths in the file are rounded.
_WIDTH_MM = 1e-4


def check_looks(job: Job, tally: Tally) -> None:
    """Check every sheet's looks against the map, and the map against the settings."""
    plan = job.map
    if plan is None:
        return
    cut = plan.cut
    _check_settings(cut, job.options, tally)
    tally.expect(
        set(cut.colours) == set(LAYERS),
        f"the map has colours for {', '.join(cut.colours)}, and the layers are {', '.join(LAYERS)}",
    )
    for sheet in plan.sheets:
        # What could not be read is told where its outlines are checked.
        if (drawing := job.dxf.get(sheet.number)) is not None:
            check_dxf_looks(f"{sheet.name}.dxf", drawing, cut, cut.colours, tally)
        if (drawing := job.svg.get(sheet.number)) is not None:
            check_svg_looks(f"{sheet.name}.svg", drawing, cut, cut.colours, tally)


def _check_settings(cut: Cut, told: dict[str, Any], tally: Tally) -> None:
    """Check that the map states what the settings do, where they say anything."""
    for key in ("profile", "dxf", "svg_units"):
        stated = getattr(cut, key)
        tally.expect(
            told.get(key, stated) == stated,
            f"{key} is {stated!r} in the map, and {told.get(key)!r} in job.toml",
        )
    preset = told.get("preset", cut.preset)
    own = preset if isinstance(preset, dict) else {"name": preset}
    tally.expect(
        own.get("name") == cut.preset,
        f"the preset is {cut.preset!r} in the map, and {own.get('name')!r} in job.toml",
    )
    layers = own.get("layers")
    if isinstance(layers, dict):
        same = {key: (entry["colour"], entry["aci"]) for key, entry in layers.items()}
        tally.expect(same == cut.colours, "the colours of the map are not those of job.toml")
    width = told.get("hairline", own.get("hairline_mm"))
    if width is not None:
        tally.measure(
            "hairline_mm",
            abs(float(str(width).removesuffix("mm")) - cut.hairline_mm),
            _WIDTH_MM,
            f"lines are {cut.hairline_mm:g} mm wide in the map, and {width} in job.toml",
        )


def check_dxf_looks(
    where: str,
    drawing: Drawing,
    cut: Cut,
    colours: Mapping[str, tuple[str | None, int]],
    tally: Tally,
) -> None:
    """Check the version and the layers of a DXF file."""
    tally.expect(
        drawing.version == _VERSIONS.get(cut.dxf),
        f"{where} is of version {drawing.version}, not {cut.dxf}",
    )
    for layer, (colour, aci) in colours.items():
        looks = list(drawing.looks.get(layer, ()))
        if not tally.expect(len(looks) == 1, f"{where} has {len(looks)} layers called {layer}"):
            continue
        tally.expect(
            looks[0].aci == aci and looks[0].colour == (colour if cut.dxf == _EXACT else None),
            f"{where}: layer {layer} has colour {looks[0].colour}, index {looks[0].aci}, instead "
            f"of {colour}, {aci}",
        )


def check_svg_looks(
    where: str,
    drawing: Drawing,
    cut: Cut,
    colours: Mapping[str, tuple[str | None, int]],
    tally: Tally,
) -> None:
    """Check the unit, the colours and the line widths of an SVG file."""
    unit = _UNITS_MM.get(cut.svg_units, np.nan)
    tally.expect(
        drawing.unit_mm is not None and abs(drawing.unit_mm / unit - 1.0) < 1e-4,
        f"{where} counts {drawing.unit_mm} mm, not {cut.svg_units}",
    )
    # What is on no layer, or another, is told where its outlines are checked.
    for layer in sorted({*drawing.looks} & {*colours}):
        wanted = colours[layer][0]
        for look in sorted(drawing.looks[layer], key=str):
            tally.expect(
                look.colour == wanted,
                f"{where}: lines on {layer} have colour {look.colour} instead of {wanted}",
            )
            # The code on NOTES is drawn as wide as its dots.
            thin = look.width_mm is not None and abs(look.width_mm - cut.hairline_mm) < _WIDTH_MM
            tally.expect(
                thin or layer == NOTES,
                f"{where}: lines on {layer} are {look.width_mm} mm wide instead of "
                f"{cut.hairline_mm:g}",
            )
