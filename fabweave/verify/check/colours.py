"""Check what a machine obeys beside the lines: the colours, widths and layers of every drawing."""

from fabweave.verify.crossing_map import Cut
from fabweave.verify.drawing import LAYERS, OUTLINES, PLAIN_LAYER, Drawing
from fabweave.verify.read.job_files import SERVICE, Job, required
from fabweave.verify.read.preset import Preset, wanted_preset
from fabweave.verify.report import Place, Tally

#: What files of each version of DXF say that they are.
_VERSIONS = {"R2010": "AC1024", "R2000": "AC1015", "R12": "AC1009"}
#: The colour and the width of a layer without any of its own, in DXF.
_NO_COLOUR, _NO_WIDTH = "7", "-3"
#: Widths in the SVG have four decimals, in millimetres or in pixels.
_ROUNDED_MM = 6e-5


def check_colours(job: Job, tally: Tally) -> None:
    """Hold every drawing that a machine may get to the preset that the settings name."""
    settings = tally.at("job.toml")
    if job.settings is None:
        settings.fail("colours are not checked, because it could not be read")
        return
    preset = wanted_preset(job.options, settings)
    if preset is None:
        return
    _check_map(required(job.map).cut, preset, tally.at("crossing_map.json", "cut"))
    each = [*job.drawings, *([job.service] if job.service is not None else [])]
    files = [(name, drawing) for drawings in each for _, name, drawing in drawings.drawn()]
    for name, drawing in (*files, *job.offcuts.items()):
        place = tally.at(name).against(f"the preset {preset.name}")
        plain = name.startswith(f"{SERVICE}/")
        if name.endswith(".dxf"):
            _check_dxf(drawing, preset, place, plain=plain)
        else:
            _check_svg(drawing, preset, place, plain=plain)


def _check_map(cut: Cut, preset: Preset, place: Place) -> None:
    """Check that the plan says the same of the drawings as the settings."""
    place = place.against("job.toml")
    place.equal("profile", cut.profile, preset.profile)
    place.equal("preset", cut.preset, preset.name)
    place.equal("dxf", cut.dxf, preset.dxf)
    place.equal("svg_units", cut.svg_units, preset.svg_units)
    place.number("hairline_mm", cut.hairline_mm, preset.line_mm)
    for one in cut.layers:
        place.at(one.layer).equal(
            "its colour", (one.colour, one.aci), preset.colours.get(one.layer)
        )
    place.same("layers", (one.layer for one in cut.layers), LAYERS)


def _check_dxf(drawing: Drawing, preset: Preset, place: Place, *, plain: bool) -> None:
    """Check version and layers; what stands on a layer has its colour, or is a problem."""
    place.equal("its version", drawing.form, _VERSIONS.get(preset.dxf))
    bare = {"colour": _NO_COLOUR, "line type": "Continuous"}
    lines = {} if preset.dxf == "R12" else {"line width": "0"}
    wanted = {PLAIN_LAYER: bare | ({"line width": _NO_WIDTH} if lines else {})}
    for layer, (colour, index) in ({} if plain else preset.colours).items():
        exact = {"true colour": str(int(colour[1:], 16))} if preset.dxf == "R2010" else {}
        wanted[layer] = bare | {"colour": str(index)} | exact | lines
    for look in drawing.looks:
        here, due = place.at(f"layer {look.layer}"), wanted.get(look.layer)
        if not here.expect(due is not None, "it may not be there") or due is None:
            continue
        for key in sorted({*look.stated, *due}):
            here.equal(key, look.stated.get(key), due.get(key))
    needed = {PLAIN_LAYER} if plain else set(preset.colours)
    lacking = sorted(needed - {look.layer for look in drawing.looks})
    place.expect(not lacking, f"it does not say how the layers {', '.join(lacking)} are drawn")


def _check_svg(drawing: Drawing, preset: Preset, place: Place, *, plain: bool) -> None:
    """Check the unit, and the colour and the width of each element."""
    place.equal("what a coordinate counts", drawing.form, preset.svg_units)
    for look in drawing.looks:
        layer = OUTLINES if plain else look.layer
        if layer not in preset.colours:
            continue  # which other checks tell
        more = f" and {look.count - 1} more" if look.count > 1 else ""
        one = place.at(look.layer, f"{look.name}{more}") if look.layer else place.at(look.name)
        one.equal("stroke", look.stated.get("stroke"), preset.colours[layer][0])
        one.number("stroke-width, in mm,", look.width_mm, preset.line_mm, within=_ROUNDED_MM)
