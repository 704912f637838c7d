"""Check that the drawings have the version, units, colours and widths that are stated."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fabweave.verify.crossing_map import Cut
from fabweave.verify.drawing import LAYERS, NOTES, Drawing
from fabweave.verify.read.job_files import Job, required, sheet_drawings
from fabweave.verify.statement import Place, Tally

_VERSIONS = {"R2010": "AC1024", "R2000": "AC1015", "R12": "AC1009"}
_UNITS_MM = {"mm": 1.0, "px96": 25.4 / 96.0}
#: Only R2010 has exact colours.
_EXACT = "R2010"
#: Widths in the file are rounded.
_WIDTH_MM = 1e-4


def check_looks(job: Job, tally: Tally) -> None:
    """Check every sheet's looks against the map, and the map against the settings."""
    cut, place = required(job.map).cut, tally.at("crossing_map.json", "cut")
    _check_settings(cut, job.options, place.against("job.toml"))
    place.same("layers with colours", cut.colours, LAYERS)
    for kind, check in (("dxf", check_dxf_looks), ("svg", check_svg_looks)):
        for _, drawing, place in sheet_drawings(job, kind, tally):
            check(drawing, cut, cut.colours, place.against("crossing_map.json"))


def _check_settings(cut: Cut, options: dict[str, Any], place: Place) -> None:
    """Check that the map states what the settings do, where they say anything."""
    for key in ("profile", "dxf", "svg_units"):
        stated = getattr(cut, key)
        place.equal(key, stated, options.get(key, stated))
    preset = options.get("preset", cut.preset)
    entry = preset if isinstance(preset, dict) else {"name": preset}
    place.equal("preset", cut.preset, entry.get("name"))
    layers = entry.get("layers")
    if isinstance(layers, dict):
        wanted = {key: (layer["colour"], layer["aci"]) for key, layer in layers.items()}
        place.equal("the list of its colours", cut.colours, wanted)
    width = options.get("hairline", entry.get("hairline_mm"))
    if width is not None:
        place.at_most(
            "hairline_mm",
            abs(float(str(width).removesuffix("mm")) - cut.hairline_mm),
            _WIDTH_MM,
            f"lines are {cut.hairline_mm:g} mm wide, and in job.toml {width}: {{}} off",
        )


def check_dxf_looks(
    drawing: Drawing, cut: Cut, colours: Mapping[str, tuple[str | None, int]], place: Place
) -> None:
    """Check the version and the layers of a DXF file."""
    place.equal("its version", drawing.version, _VERSIONS.get(cut.dxf))
    for layer, (colour, aci) in colours.items():
        looks = list(drawing.looks.get(layer, ()))
        if place.equal(f"the number of layers called {layer}", len(looks), 1):
            place.equal(
                f"the colour of {layer}, with its index,",
                (looks[0].colour, looks[0].aci),
                (colour if cut.dxf == _EXACT else None, aci),
            )


def check_svg_looks(
    drawing: Drawing, cut: Cut, colours: Mapping[str, tuple[str | None, int]], place: Place
) -> None:
    """Check the unit, the colours and the line widths of an SVG file."""
    unit = _UNITS_MM.get(cut.svg_units, np.nan)
    place.number("its unit in mm", drawing.unit_mm, unit, within=1e-4 * unit)
    # What is on no layer, or another, is told where its outlines are checked.
    for layer in sorted({*drawing.looks} & {*colours}):
        wanted = colours[layer][0]
        for look in sorted(drawing.looks[layer], key=str):
            place.equal(f"the colour of lines on {layer}", look.colour, wanted)
            # The code on NOTES is drawn as wide as its dots.
            thin = look.width_mm is not None and abs(look.width_mm - cut.hairline_mm) < _WIDTH_MM
            place.expect(
                thin or layer == NOTES,
                f"lines on {layer} are {look.width_mm} mm wide instead of {cut.hairline_mm:g} mm",
            )
