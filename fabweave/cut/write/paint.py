"""Paint the areas and lines of a sheet, and encode the picture."""

import struct
import zlib
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.cut.drawing import Entity, Layer, Polyline, SheetDrawing
from fabweave.cut.presets import Preset

_Colour: TypeAlias = tuple[int, int, int]
# x, y, x, y and so on, pixels; those of a circle are two corners of its box.
_Places: TypeAlias = list[float]
# Takes points to pixels.
_Map: TypeAlias = Callable[[FloatArray], FloatArray]

_TABLE: _Colour = (236, 238, 241)
#: The colour of an empty sheet.
SHEET: _Colour = (255, 255, 255)
_EDGE: _Colour = (150, 156, 166)
_FILLS: tuple[_Colour, ...] = ((253, 240, 221), (227, 240, 250), (232, 245, 228), (246, 233, 247))
_NOTE: _Colour = (160, 165, 173)
_DARK: _Colour = (38, 43, 51)
# Chords of arcs are painted; they stand off by no more than this, millimetres.
_FLAT_MM = 0.01
# Pictures are flat areas, so that harder compression gains little.
_COMPRESSION = 4


class Painter:
    """Paint areas and lines, enlarged; widths are in pixels of the finished picture.

    What is painted are numbers of colours, one byte a pixel: it is a quarter of the memory.

    Parameters
    ----------
    width_px, height_px : int
        Size of the finished picture.
    pixels : callable
        Takes points of the sheet, (N, 2), to pixels of the finished picture.
    factor : int
        How many times larger it is painted, so that its lines are smooth.
    preset : Preset
        The colours of the layers.
    """

    def __init__(
        self, width_px: int, height_px: int, pixels: _Map, factor: int, preset: Preset
    ) -> None:
        size = (width_px * factor, height_px * factor)
        lines = {layer: preset.colours[layer].rgb for layer in Layer} | {Layer.NOTES: _NOTE}
        self._colours = [_TABLE, SHEET, _EDGE, _DARK, *_FILLS, *lines.values()]
        self._dark = self._colours.index(_DARK)
        self._lines = {layer: self._colours.index(colour) for layer, colour in lines.items()}
        self._fills = [self._colours.index(colour) for colour in _FILLS]
        self._image = Image.new("L", size, self._colours.index(_TABLE))
        self._draw = ImageDraw.Draw(self._image)
        self._pixels = pixels
        self._factor = factor

    def paint(self, drawing: SheetDrawing) -> None:
        """Paint the sheet and all that is on it."""
        frame = Polyline(Layer.NOTES, drawing.edge, True)
        entities = [entity for piece in drawing.pieces for entity in piece.entities]
        places = self._places([frame, *entities, *drawing.notes])
        edge = next(places)
        self._draw.polygon(edge, fill=self._colours.index(SHEET))
        self._line(frame, edge, self._colours.index(_EDGE), 2.0)
        for index, piece in enumerate(drawing.pieces):
            fill = self._fills[index % len(self._fills)]
            # Places come last: zip must not take those of the next piece.
            self._piece(list(zip(piece.entities, places, strict=False)), fill)
        scale = float(np.ptp(self._pixels(np.array([[0.0, 0.0], [1.0, 0.0]]))[:, 0]))
        for note, place in zip(drawing.notes, places, strict=False):
            width_mm = note.width_mm if isinstance(note, Polyline) else None
            if width_mm is None:
                self._line(note, place, self._lines[Layer.NOTES], 1.0)
            else:
                self._block(place, width_mm * scale * self._factor)

    def picture(self) -> Image.Image:
        """Return what was painted in its colours and its size."""
        channels = []
        for values in zip(*self._colours, strict=True):
            table = [*values, *[0] * (256 - len(values))]
            channels.append(self._image.point(table).reduce(self._factor))
        return Image.merge("RGB", channels)

    def _places(self, entities: list[Entity]) -> Iterator[_Places]:
        """Yield where the points of each entity stand: all are mapped at once."""
        points = [
            entity.flattened(_FLAT_MM)
            if isinstance(entity, Polyline)
            else np.array(
                [
                    (entity.x - entity.radius, entity.y + entity.radius),
                    (entity.x + entity.radius, entity.y - entity.radius),
                ]
            )
            for entity in entities
        ]
        pixels = self._pixels(np.concatenate(points)) * self._factor
        numbers = pixels.ravel().tolist()
        ends = (offsets_of(np.array([len(run) for run in points])) * 2).tolist()
        return (numbers[start:end] for start, end in pairwise(ends))

    def _piece(self, drawn: list[tuple[Entity, _Places]], fill: int) -> None:
        """Paint a piece: its area, holes as the sheet shows through, then all its lines."""
        for layer, colour in (
            (Layer.CUT_OUTER, fill),
            (Layer.CUT_INNER, self._colours.index(SHEET)),
        ):
            for entity, places in drawn:
                if entity.layer is not layer:
                    continue
                if isinstance(entity, Polyline):
                    self._draw.polygon(places, fill=colour)
                else:
                    self._draw.ellipse(places, fill=colour)
        for entity, places in drawn:
            cut = entity.layer in (Layer.CUT_INNER, Layer.CUT_OUTER)
            self._line(entity, places, self._lines[entity.layer], 2.0 if cut else 1.0)

    def _block(self, places: _Places, thick: float) -> None:
        """Paint a level line as dark as a code must be, and exactly as thick as it is."""
        left, y, right, _ = places
        low, high = round(y - thick / 2.0), round(y + thick / 2.0)
        self._draw.rectangle((round(left), low, round(right) - 1, high - 1), self._dark)

    def _line(self, entity: Entity, places: _Places, colour: int, width: float) -> None:
        """Paint the line of an entity."""
        thick = max(round(width * self._factor), 1)
        if not isinstance(entity, Polyline):
            self._draw.ellipse(places, outline=colour, width=thick)
            return
        # A closed line goes over its first two points again, so that its corner is joined too.
        run = places + places[:4] if entity.closed else places
        self._draw.line(run, fill=colour, width=thick)


def png_encoded(image: Image.Image) -> bytes:
    """Return the bytes of a picture as PNG.

    Flat areas need no filters; Pillow, which tries them all, takes three times as long.
    """
    rows = np.asarray(image).reshape(image.height, -1)
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", image.width, image.height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(np.pad(rows, ((0, 0), (1, 0))).tobytes(), _COMPRESSION)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )
