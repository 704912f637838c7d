"""Paint a picture of a sheet for people: where each piece lies, and what it is called."""

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from types import MappingProxyType
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fabweave.core.arrays import FloatArray, offsets_of
from fabweave.sheet.drawing import (
    Circle,
    Entity,
    Layer,
    PieceDrawing,
    Polyline,
    SheetDrawing,
    check_drawing,
)
from fabweave.sheet.labels.texts import Title, place_titles
from fabweave.sheet.presets import Preset, preset_named

_Colour: TypeAlias = tuple[int, int, int]
# x, y, x, y and so on, pixels; those of a circle are two corners of its box.
_Places: TypeAlias = list[float]

_TABLE: _Colour = (236, 238, 241)
#: The colour of an empty sheet.
SHEET: _Colour = (255, 255, 255)
_EDGE: _Colour = (150, 156, 166)
_FILLS: tuple[_Colour, ...] = ((253, 240, 221), (227, 240, 250), (232, 245, 228), (246, 233, 247))
_NOTE: _Colour = (160, 165, 173)
# Chords of arcs are painted; they stand off by no more than this, millimetres.
_FLAT_MM = 0.01
# Pictures are flat areas, so that harder compression gains little.
_COMPRESSION = 4


class Painter:
    """Paint areas and lines, enlarged; widths are in pixels of the finished picture.

    What is painted are numbers of colours, one byte a pixel: it is a quarter of the memory.

    Parameters
    ----------
    frame : PreviewFrame
        Where the sheet stands in the finished picture.
    factor : int
        How many times larger it is painted, so that its lines are smooth.
    preset : Preset
        The colours of the layers.
    """

    def __init__(self, frame: "PreviewFrame", factor: int, preset: Preset) -> None:
        size = (frame.width_px * factor, frame.height_px * factor)
        lines = {layer: preset.colours[layer].rgb for layer in Layer} | {Layer.NOTES: _NOTE}
        self._colours = [_TABLE, SHEET, _EDGE, *_FILLS, *lines.values()]
        self._lines = {layer: self._colours.index(colour) for layer, colour in lines.items()}
        self._fills = [self._colours.index(colour) for colour in _FILLS]
        self._image = Image.new("L", size, self._colours.index(_TABLE))
        self._draw = ImageDraw.Draw(self._image)
        self._frame = frame
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
        for note, place in zip(drawing.notes, places, strict=False):
            self._line(note, place, self._lines[Layer.NOTES], 1.0)

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
        pixels = self._frame.pixels(np.concatenate(points)) * self._factor
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


_Font: TypeAlias = ImageFont.FreeTypeFont | ImageFont.ImageFont

_INK = (38, 43, 51)

# Measures of a sheet of up to half a metre; on a larger one they grow with it, because its
# picture is looked at from farther away.
_BORDER_MM, _HEADING_MM, _TITLE_MM = 8.0, 16.0, 9.0
_PLAIN_SHEET_MM = 500.0
_BAR_MM = 100.0
#: Lanes of a roll are so many times its width apart.
_LANE = 2.0
#: A picture is painted this many times larger, then shrunk, so that its lines are smooth.
_SUPERSAMPLING = 2
_MAX_PIXELS = 100_000_000
_PIXELS_PER_MM = 4.0
# Letters as high as this can be read.
_READABLE_PX = 9.0


@dataclass(frozen=True)
class PreviewFrame:
    """How a preview maps millimetres on the sheet to pixels of the picture.

    Parameters
    ----------
    width_px, height_px : int
        Size of the picture.
    pixels_per_mm : float
        Scale.
    left_px, bottom_px : float
        Where the lower left corner of the sheet stands in the picture, y counted from the top.
    growth : float
        How much larger than on a small sheet heading and titles are.
    """

    width_px: int
    height_px: int
    pixels_per_mm: float
    left_px: float
    bottom_px: float
    growth: float = 1.0

    def pixels(self, points: FloatArray) -> FloatArray:
        """Return where points of the sheet stand in the picture, (N, 2), y from the top.

        Examples
        --------
        >>> frame = preview_frame(SheetDrawing("s", 100.0, 50.0, (), ()))
        >>> frame.pixels(np.array([[0.0, 50.0]])).tolist()
        [[32.0, 96.0]]
        """
        return points * (self.pixels_per_mm, -self.pixels_per_mm) + (self.left_px, self.bottom_px)


def preview_frame(drawing: SheetDrawing) -> PreviewFrame:
    """Return how ``png_bytes`` maps a sheet to pixels: 4 a millimetre, fewer on huge ones."""
    growth = max(1.0, max(drawing.width_mm, drawing.height_mm) / _PLAIN_SHEET_MM)
    border, heading = _BORDER_MM * growth, _HEADING_MM * growth
    wide = drawing.width_mm + 2.0 * border
    high = drawing.height_mm + 2.0 * border + heading
    pixels_per_mm = min(_PIXELS_PER_MM, float(np.sqrt(_MAX_PIXELS / wide / high)) * 0.99)
    wide, high = wide * pixels_per_mm, high * pixels_per_mm
    return PreviewFrame(
        width_px=max(round(wide), 1),
        height_px=max(round(high), 1),
        pixels_per_mm=pixels_per_mm,
        left_px=border * pixels_per_mm,
        bottom_px=(drawing.height_mm + border + heading) * pixels_per_mm,
        growth=growth,
    )


def png_bytes(
    drawing: SheetDrawing,
    *,
    titles: Mapping[str, Title] | None = None,
    colours: Preset | None = None,
    lettered: Mapping[str, float] = MappingProxyType({}),
) -> bytes:
    """Return a picture of a sheet as the content of a PNG file.

    Pieces are filled lightly; outlines, holes and engraving have the colours that the laser
    program shows. A piece whose engraved id cannot be read in the picture carries it in large
    letters, along the piece where it is widest. The heading names the sheet and its size; beside
    it stands a bar of 100 mm.

    Parameters
    ----------
    drawing : SheetDrawing
        One sheet, millimetres.
    titles : mapping from piece id to Title, or None
        Where the ids stand; None finds places. A piece that is not in the mapping has none.
    colours : Preset or None
        The colours of the layers; None takes the default preset.
    lettered : mapping from piece id to float
        How high the letters of ids are that are engraved, millimetres.

    Raises
    ------
    InputError
        If the drawing cannot be cut (see ``check_drawing``).
    """
    check_drawing(drawing)
    frame = preview_frame(drawing)
    if titles is None:
        bare = [
            piece
            for piece in drawing.pieces
            if lettered.get(piece.piece_id, 0.0) * frame.pixels_per_mm < _READABLE_PX
        ]
        titles = place_titles(bare, largest_mm=_TITLE_MM * frame.growth)
    factor = _SUPERSAMPLING
    if frame.width_px * frame.height_px * factor**2 > _MAX_PIXELS:
        factor = 1
    painter = Painter(frame, factor, preset_named() if colours is None else colours)
    painter.paint(drawing)
    letterer = _Letterer(painter.picture(), frame)
    letterer.heading(drawing)
    for piece in drawing.pieces:
        if piece.piece_id in titles:
            letterer.title(piece.title, titles[piece.piece_id])
    return png_encoded(letterer.image)


def in_lanes(drawing: SheetDrawing) -> SheetDrawing:
    """Return the drawing of a roll as people can look at it: in lanes, as a text in its lines.

    Strips stay whole, and as many stand in a lane as have room there.

    Examples
    --------
    >>> from fabweave.sheet.drawing import Layer, Polyline
    >>> strip = np.array([[0.0, 0.0], [400.0, 0.0], [400.0, 10.0], [0.0, 10.0]])
    >>> pieces = tuple(PieceDrawing(f"A{at}", (Polyline(Layer.CUT_OUTER, strip + (at, 0.0), True),))
    ...     for at in (0.0, 400.0, 800.0))
    >>> lanes = in_lanes(SheetDrawing("roll", 1200.0, 10.0, pieces, ()))
    >>> lanes.width_mm, lanes.height_mm
    (400.0, 60.0)
    """
    spans = np.array(
        [
            (corners[:, 0].min(), corners[:, 0].max())
            for piece in drawing.pieces
            for corners in [np.concatenate(piece.outlines(_FLAT_MM))]
        ]
    )
    step = _LANE * drawing.height_mm
    room = max(float(np.ptp(spans, axis=1).max()), float(np.sqrt(drawing.width_mm * step)))
    lanes: list[list[int]] = []
    for at in np.argsort(spans[:, 0]).tolist():
        if not lanes or spans[at, 1] - spans[lanes[-1][0], 0] > room:
            lanes.append([])
        lanes[-1].append(at)
    pieces = [
        _moved(drawing.pieces[at], -spans[lane[0], 0], (len(lanes) - number + 0.25) * step)
        for number, lane in enumerate(lanes, start=1)
        for at in lane
    ]
    wide = max(float(spans[lane[-1], 1] - spans[lane[0], 0]) for lane in lanes)
    name = f"{drawing.name}: {drawing.width_mm / 1000:.2f} m of a roll"
    return SheetDrawing(name, round(wide, 1), len(lanes) * step, tuple(pieces), ())


def _moved(piece: PieceDrawing, x: float, y: float) -> PieceDrawing:
    """Return a piece that is drawn elsewhere."""
    entities = [
        replace(entity, x=entity.x + x, y=entity.y + y)
        if isinstance(entity, Circle)
        else replace(entity, points=entity.points + np.array([x, y]))
        for entity in piece.entities
    ]
    return replace(piece, entities=tuple(entities))


class _Letterer:
    """Write texts on a picture."""

    def __init__(self, image: Image.Image, frame: PreviewFrame) -> None:
        self.image = image
        self._draw = ImageDraw.Draw(image)
        self._frame = frame
        self._fonts: dict[float, _Font] = {}

    def heading(self, drawing: SheetDrawing) -> None:
        """Write the name of the sheet and draw the reference bar."""
        scale, left = self._frame.pixels_per_mm, self._frame.left_px
        right = left + drawing.width_mm * scale
        unit = scale * self._frame.growth
        top = self._frame.bottom_px - drawing.height_mm * scale
        middle = top - (_HEADING_MM / 2.0 + 1.0) * unit
        # On a sheet narrower than two bars, whole centimetres that leave room for the heading.
        bar = min(_BAR_MM, drawing.width_mm / 2.0 // 10.0 * 10.0) * scale
        heading = (
            f"{drawing.name}   {drawing.width_mm:g} x {drawing.height_mm:g} mm   "
            f"{len(drawing.pieces)} piece{'' if len(drawing.pieces) == 1 else 's'}"
        )
        font = self._fit(heading, 7.0 * unit, right - left - bar - (6.0 * unit if bar else 0.0))
        self._draw.text((left, middle), heading, fill=_INK, font=font, anchor="lm")
        if bar:
            self._bar(right - bar, right, middle)

    def _bar(self, start: float, end: float, middle: float) -> None:
        """Draw the reference bar with its length above it."""
        unit = self._frame.pixels_per_mm * self._frame.growth
        y, tick = middle + 2.6 * unit, 1.4 * unit
        for run in (
            [(start, y - tick), (start, y + tick)],
            [(start, y), (end, y)],
            [(end, y - tick), (end, y + tick)],
        ):
            self._draw.line(run, fill=_INK, width=2)
        name = f"{(end - start) / self._frame.pixels_per_mm:.0f} mm"
        font = self._fit(name, 4.5 * unit, end - start)
        place = ((start + end) / 2.0, y - 0.8 * unit)
        self._draw.text(place, name, fill=_INK, font=font, anchor="mb")

    def title(self, text: str, title: Title) -> None:
        """Write a title, upright or turned, with a halo that keeps it legible on lines."""
        # Turned letters are smooth if they are turned enlarged.
        size = max(title.height_mm * self._frame.pixels_per_mm, 1.0) * _SUPERSAMPLING
        font = self._font(size)
        halo = max(round(size * 0.12), 1)
        left, top, right, bottom = font.getbbox(text, anchor="mm", stroke_width=halo)
        wide, high = int(np.ceil(right - left)) + 4, int(np.ceil(bottom - top)) + 4
        # The letters are painted on a mask, which is turned about the middle of what it shows.
        middle = (wide / 2.0 - (left + right) / 2.0, high / 2.0 - (top + bottom) / 2.0)
        ((x, y),) = self._frame.pixels(np.array([[title.x, title.y]])).tolist()
        for colour, stroke in ((SHEET, halo), (_INK, 0)):
            mask = Image.new("L", (wide, high), 0)
            ImageDraw.Draw(mask).text(
                middle, text, fill=255, font=font, anchor="mm", stroke_width=stroke
            )
            turned = mask.rotate(title.angle_deg, Image.Resampling.BICUBIC, expand=True)
            turned = turned.reduce(_SUPERSAMPLING)
            self.image.paste(
                colour, (round(x - turned.width / 2.0), round(y - turned.height / 2.0)), turned
            )

    def _fit(self, text: str, size: float, room: float) -> _Font:
        """Return the font of the largest size, up to ``size``, at which a text fits the room."""
        wide = self._font(size).getlength(text)
        return self._font(size * min(1.0, room / wide))

    def _font(self, size: float) -> _Font:
        """Return Pillow's own font: it is the same everywhere."""
        if size not in self._fonts:
            self._fonts[size] = ImageFont.load_default(size=max(size, 1.0))
        return self._fonts[size]
