"""Write a sheet as SVG for laser programs that know layers by their colours.

Importers of laser programs differ in what they understand, so the file says everything in the
plainest way: a size in millimetres, a view box, presentation attributes, absolute coordinates;
no transforms, no style sheets, no units but one. The y axis of SVG points down: a point (x, y) of
the sheet stands at (x, height - y), so that the file looks like the DXF.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import islice, pairwise
from typing import TypeAlias
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.core.errors import InputError
from fabweave.sheet.drawing import (
    Circle,
    Entity,
    Layer,
    Polyline,
    SheetDrawing,
    check_drawing,
    on_grid,
)
from fabweave.sheet.presets import HAIRLINE_MM, Preset, preset_named

#: What a coordinate may count: millimetres, or pixels of 1/96 inch for importers that ignore the
#: size of the page.
SVG_UNITS = ("mm", "px96")

_PIXELS_PER_MM = 96.0 / 25.4
_WORDS = {
    Layer.ENGRAVE_LABEL: "label",
    Layer.ENGRAVE_MARK: "mark",
    Layer.CUT_INNER: "hole",
    Layer.CUT_OUTER: "outline",
    Layer.NOTES: "note",
}

_INNER, _OUTER = Layer.CUT_INNER, Layer.CUT_OUTER

# Takes points of the sheet to points of the file.
_Map: TypeAlias = Callable[[FloatArray], FloatArray]


def svg_text(
    drawing: SheetDrawing,
    *,
    colours: Preset | None = None,
    units: str = "mm",
    stroke_width_mm: float = HAIRLINE_MM,
    plain: bool = False,
) -> str:
    """Return a sheet as the text of an SVG file.

    Every layer is an Inkscape layer group, in the order of the cut and NOTES last. An outline is
    a closed ``path`` with the id ``A3.outline``; holes are ``circle`` elements (``A3.hole.1``,
    ``A3.hole.2`` and so on), or closed paths where they are not round; all labels of a piece are
    one path (``A3.label``), all its marks another (``A3.mark``). Each element of a piece has the
    piece id as its title. Arcs are arcs (``A``). Coordinates have four decimals; the same drawing
    gives the same bytes.

    Parameters
    ----------
    drawing : SheetDrawing
        One sheet, millimetres.
    colours : Preset or None
        The colours of the layers; None takes the default preset.
    units : str
        One of ``SVG_UNITS``; the width and height of the page are in millimetres in both.
    stroke_width_mm : float
        Width of the lines; drivers take thin lines for cuts and thick ones for pictures.
    plain : bool
        Whether there are no layers and no titles, and everything has the colour of outlines.

    Raises
    ------
    InputError
        If the units are unknown, the width is not positive, or the drawing cannot be cut (see
        ``check_drawing``).

    Examples
    --------
    >>> from fabweave.sheet.drawing import PieceDrawing
    >>> square = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [9, 0], [9, 9], [0, 9]]), True)
    >>> sheet = SheetDrawing("sheet 1", 20.0, 10.0, (PieceDrawing("A1", (square,)),), ())
    >>> 'd="M0,10L9,10L9,1L0,1Z"' in svg_text(sheet)
    True
    """
    if units not in SVG_UNITS:
        raise InputError(f"SVG units {units!r} are unknown; choose one of {', '.join(SVG_UNITS)}")
    if not (np.isfinite(stroke_width_mm) and stroke_width_mm > 0.0):
        raise InputError(f"the stroke width is {stroke_width_mm} mm; it must be a positive length")
    check_drawing(drawing)
    preset = preset_named() if colours is None else colours
    scale = 1.0 if units == "mm" else _PIXELS_PER_MM
    height = drawing.height_mm

    def mapped(points: FloatArray) -> FloatArray:
        # Rounded before it is turned over, so that both formats hold the same numbers.
        return (on_grid(points) * (1.0, -1.0) + (0.0, height)) * scale

    width_number, height_number = _number(drawing.width_mm), _number(height)
    box = f"0 0 {_number(drawing.width_mm * scale)} {_number(height * scale)}"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg"'
        ' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" version="1.1"'
        f' width="{width_number}mm" height="{height_number}mm" viewBox="{box}">',
    ]
    if not plain:
        lines.append(f"<title>{escape(drawing.name)}</title>")
    width, outline = _number(stroke_width_mm * scale), preset.colours[_OUTER]
    looks = {
        layer: f'fill="none" stroke="{(outline if plain else entry).colour}" stroke-width="{width}"'
        for layer, entry in preset.colours.items()
    }
    for layer, elements in _layers(drawing, mapped, scale, looks, titled=not plain).items():
        if plain:
            lines.extend(elements)
            continue
        lines.append(
            f'<g id="{layer.value}" inkscape:groupmode="layer" inkscape:label="{layer.value}">'
        )
        lines.extend(elements)
        lines.append("</g>")
    lines.append("</svg>\n")
    return "\n".join(lines)


def _layers(
    drawing: SheetDrawing,
    mapped: _Map,
    scale: float,
    looks: Mapping[Layer, str],
    *,
    titled: bool,
) -> dict[Layer, list[str]]:
    """Return the elements of every layer, pieces in their order.

    Each element carries its own colours: some importers do not look at the group.
    """
    layers: dict[Layer, list[str]] = {layer: [] for layer in Layer}
    entities = [entity for piece in drawing.pieces for entity in piece.entities]
    written = _written([*entities, *drawing.notes], mapped, scale)
    for piece in drawing.pieces:
        title = f"><title>{escape(piece.piece_id)}</title></" if titled else None
        texts = islice(written, len(piece.entities))
        for layer, name, (tag, attributes) in _shapes(piece.entities, texts):
            identity = quoteattr(f"{piece.piece_id}.{name}")
            end = "/>" if title is None else f"{title}{tag}>"
            layers[layer].append(f"<{tag} id={identity} {looks[layer]} {attributes}{end}")
    for layer, name, (tag, attributes) in _shapes(drawing.notes, written):
        layers[layer].append(f'<{tag} id="notes.{name}" {looks[layer]} {attributes}/>')
    return layers


def _shapes(
    entities: tuple[Entity, ...], written: Iterator[str]
) -> Iterator[tuple[Layer, str, tuple[str, str]]]:
    """Yield layer, id without its owner, and (tag, attributes) for each element."""
    numbers: Counter[Layer] = Counter()
    runs: dict[Layer, list[str]] = {}
    for entity, text in zip(entities, written, strict=True):
        layer = entity.layer
        if isinstance(entity, Polyline) and layer is not _INNER and layer is not _OUTER:
            runs.setdefault(layer, []).append(text)
            continue
        numbers[layer] += 1
        # One outline is the rule; it has no number then.
        only = layer is _OUTER and numbers[layer] == 1
        name = _WORDS[layer] if only else f"{_WORDS[layer]}.{numbers[layer]}"
        if isinstance(entity, Circle):
            yield layer, name, ("circle", text)
        else:
            yield layer, name, ("path", f'd="{text}"')
    for layer, parts in runs.items():
        yield layer, _WORDS[layer], ("path", f'd="{"".join(parts)}"')


def _written(entities: list[Entity], mapped: _Map, scale: float) -> Iterator[str]:
    """Yield the path data of each polyline and the attributes of each circle.

    All numbers are written at once: a sheet may have a million.
    """
    if not entities:
        return
    # A circle has its middle here.
    points = [
        entity.points if isinstance(entity, Polyline) else np.array([[entity.x, entity.y]])
        for entity in entities
    ]
    pairs = _pairs(mapped(np.concatenate(points)))
    ends: list[int] = offsets_of(np.array([len(run) for run in points])).tolist()
    for entity, (start, end) in zip(entities, pairwise(ends), strict=True):
        if isinstance(entity, Polyline) and entity.bulges is not None:
            yield _bent_path(entity, entity.bulges, pairs[start:end], scale)
        elif isinstance(entity, Polyline):
            # Move to the first point, line to the others, close.
            yield f"M{'L'.join(pairs[start:end])}{'Z' if entity.closed else ''}"
        else:
            x, y = pairs[start].split(",")
            radius = on_grid(np.array([entity.radius])).item() * scale
            yield f'cx="{x}" cy="{y}" r="{_number(radius)}"'


def _bent_path(line: Polyline, bulges: FloatArray, pairs: list[str], scale: float) -> str:
    """Return the path data of a run with arcs, given its points as text.

    No arc is the greater part of its circle. What turns left turns left in the picture too, so
    that in the file, where y points down, its angles fall: the sweep flag is 0.
    """
    points = on_grid(line.points)
    chords = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    bent = np.abs(bulges)
    radii = np.divide(
        chords * (1.0 + bent**2), 4.0 * bent, out=np.zeros(len(bent)), where=bent > 0.0
    )
    count = len(pairs) if line.closed else len(pairs) - 1
    goals = [*pairs[1:], pairs[0]]
    parts = [f"M{pairs[0]}"]
    for goal, bulge, radius in zip(
        goals[:count], bulges[:count].tolist(), (radii * scale).tolist(), strict=False
    ):
        r = _number(radius, 6)
        parts.append(f"A{r},{r} 0 0 {int(bulge < 0)} {goal}" if bulge else f"L{goal}")
    if line.closed:
        # What closes a path is a straight side; an arc has to be drawn back to the beginning.
        if not bulges[-1]:
            parts.pop()
        parts.append("Z")
    return "".join(parts)


def _pairs(points: FloatArray) -> list[str]:
    """Return each point as two numbers with at most four decimals and no needless zeros."""
    values = on_grid(points)
    # Ten digits hold all that ``check_drawing`` admits to four decimals, and %g drops zeros.
    return ("%.10g,%.10g " * len(values) % tuple(values.ravel().tolist())).split()


def _number(value: float, decimals: int = 4) -> str:
    """Return a number with at most so many decimals and no needless zeros."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
