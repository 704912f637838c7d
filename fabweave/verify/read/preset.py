"""Know how lines are to look to a machine: the presets, stated once more, and what job.toml has."""

from dataclasses import dataclass
from typing import Any

from fabweave.verify.drawing import HOLES, LAYERS, OUTLINES
from fabweave.verify.read.job_files import length_of
from fabweave.verify.report import Place

#: By the name of a preset: the colours and AutoCAD indices of the layers, in their order.
_KNOWN = {
    "boxes": "#00FF00 3, #00FF00 3, #0000FF 5, #000000 7, #FF0000 1",
    "epilog": "#00FF00 3, #00FFFF 4, #0000FF 5, #FF0000 1, #FFFF00 2",
    "glowforge": "#000000 7, #000000 7, #0000FF 5, #FF0000 1, #00FF00 3",
    "lightburn": "#000000 7, #000000 7, #0000FF 5, #FF0000 1, #F36926 30",
    "snijlab": "#000000 7, #000000 7, #0000FF 5, #0000FF 5, #00FF00 3",
    "trotec": "#000000 7, #000000 7, #FF0000 1, #0000FF 5, #FFFF00 2",
    "xtool": "#000000 7, #000000 7, #0000FF 5, #FF0000 1, #00FF00 3",
}
_LINE_MM = {"epilog": 0.0254}
_USUAL_LINE_MM = 0.025
#: Wider lines are no lines to any machine.
_WIDEST_MM = 1.0
#: What job.toml leaves open.
_USUAL = {"profile": "maker", "preset": "lightburn", "dxf": "R2010", "svg_units": "mm"}


@dataclass(frozen=True)
class Preset:
    """What the settings want of the drawings for a machine.

    ``colours`` has of each layer its exact colour and its AutoCAD index. ``profile``, ``dxf`` and
    ``svg_units`` are words of job.toml.
    """

    name: str
    colours: dict[str, tuple[str, int]]
    line_mm: float
    profile: str
    dxf: str
    svg_units: str


def wanted_preset(options: dict[str, Any], place: Place) -> Preset | None:
    """Return what job.toml wants; one that no machine can obey is told, and None."""
    words = {key: options.get(key, usual) for key, usual in _USUAL.items()}
    stated = words["preset"]
    if isinstance(stated, dict):
        name, line = str(stated.get("name")), stated.get("hairline_mm", _USUAL_LINE_MM)
        layers = stated.get("layers", {})
        colours = {layer: (one["colour"], one["aci"]) for layer, one in layers.items()}
    elif stated in _KNOWN:
        name, line = stated, _LINE_MM.get(stated, _USUAL_LINE_MM)
        pairs = [pair.split() for pair in _KNOWN[stated].split(",")]
        colours = dict(zip(LAYERS, ((one, int(aci)) for one, aci in pairs), strict=True))
    else:
        place.fail(f"there is no preset {stated!r}")
        return None
    if "hairline" in options:
        line = length_of(str(options["hairline"]))
    good = place.same("layers of the preset", colours, LAYERS)
    good &= place.expect(
        isinstance(line, float) and 0.0 < line <= _WIDEST_MM,
        f"lines are {line!r} mm wide, which no machine takes for a line",
    )
    for cut in (HOLES, OUTLINES) if good else ():
        for other in (layer for layer in LAYERS if layer not in (HOLES, OUTLINES)):
            apart = all(a != b for a, b in zip(colours[cut], colours[other], strict=True))
            good &= place.expect(apart, f"the preset gives {cut} and {other} one colour")
    if not good or line is None:
        return None
    return Preset(
        name, colours, line, str(words["profile"]), str(words["dxf"]), str(words["svg_units"])
    )
