"""Paint a picture of a sheet for people: where each piece lies, and what it is called."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from fabweave.arrays import FloatArray
from fabweave.cut.check import check_drawing
from fabweave.cut.drawing import Circle, Entity, Layer, Polyline, SheetDrawing
from fabweave.cut.presets import Preset, preset_named
from fabweave.cut.titles import Title, place_titles
from fabweave.errors import InputError

_Colour: TypeAlias = tuple[int, int, int]

_TABLE: _Colour = (236, 238, 241)
_SHEET: _Colour = (255, 255, 255)
_EDGE: _Colour = (150, 156, 166)
_INK: _Colour = (38, 43, 51)
_FILLS: tuple[_Colour, ...] = ((253, 240, 221), (227, 240, 250), (232, 245, 228), (246, 233, 247))
_NOTE: _Colour = (160, 165, 173)

# Measures of a sheet of up to half a metre; on a larger one they grow with it, because its
# picture is looked at from farther away.
_BORDER_MM, _HEADING_MM, _TITLE_MM = 8.0, 16.0, 9.0
_PLAIN_SHEET_MM = 500.0
_BAR_MM = 100.0
#: A picture is painted this many times larger, then shrunk, so that its lines are smooth.
_SUPERSAMPLING = 2
_MAX_PIXELS = 100_000_000


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
        >>> frame = preview_frame(SheetDrawing("s", 100.0, 50.0, (), ()), pixels_per_mm=2.0)
        >>> frame.pixels(np.array([[0.0, 50.0]])).tolist()
        [[16.0, 48.0]]
        """
        return points * (self.pixels_per_mm, -self.pixels_per_mm) + (self.left_px, self.bottom_px)


def preview_frame(drawing: SheetDrawing, *, pixels_per_mm: float = 4.0) -> PreviewFrame:
    """Return how ``write_png`` maps a sheet to pixels.

    Raises
    ------
    InputError
        If the scale is not positive, or the picture would be larger than 100 megapixels.
    """
    if not (np.isfinite(pixels_per_mm) and pixels_per_mm > 0.0):
        raise InputError(f"the scale is {pixels_per_mm} pixels per mm; it must be positive")
    growth = max(1.0, max(drawing.width_mm, drawing.height_mm) / _PLAIN_SHEET_MM)
    border, heading = _BORDER_MM * growth, _HEADING_MM * growth
    wide = (drawing.width_mm + 2.0 * border) * pixels_per_mm
    high = (drawing.height_mm + 2.0 * border + heading) * pixels_per_mm
    if not wide * high <= _MAX_PIXELS:
        raise InputError(
            f"the picture of sheet {drawing.name!r} would have {wide:.0f} x {high:.0f} pixels, "
            f"over {_MAX_PIXELS // 1_000_000} million; take fewer pixels per mm"
        )
    return PreviewFrame(
        width_px=max(round(wide), 1),
        height_px=max(round(high), 1),
        pixels_per_mm=pixels_per_mm,
        left_px=border * pixels_per_mm,
        bottom_px=(drawing.height_mm + border + heading) * pixels_per_mm,
        growth=growth,
    )


def write_png(
    path: Path | str,
    drawing: SheetDrawing,
    *,
    pixels_per_mm: float = 4.0,
    titles: Mapping[str, Title] | None = None,
    colours: Preset | None = None,
) -> None:
    """Write a picture of a sheet as PNG.

    Pieces are filled lightly; outlines, holes and engraving have the colours that the laser
    program shows. Each piece carries its id in large letters, along the piece where it is
    widest. The heading names the sheet and its size; beside it stands a bar of 100 mm.

    Parameters
    ----------
    path : path
        The file to write.
    drawing : SheetDrawing
        One sheet, millimetres.
    pixels_per_mm : float
        Scale.
    titles : mapping from piece id to Title, or None
        Where the ids stand; None finds places. A piece that is not in the mapping has none.
    colours : Preset or None
        The colours of the layers; None takes the default preset.

    Raises
    ------
    InputError
        If the picture would be too large, or the drawing cannot be cut (see ``check_drawing``).
    """
    Path(path).write_bytes(
        png_bytes(drawing, pixels_per_mm=pixels_per_mm, titles=titles, colours=colours)
    )


def png_bytes(
    drawing: SheetDrawing,
    *,
    pixels_per_mm: float = 4.0,
    titles: Mapping[str, Title] | None = None,
    colours: Preset | None = None,
) -> bytes:
    """Return the bytes of the file that ``write_png`` writes; see there."""
    check_drawing(drawing)
    frame = preview_frame(drawing, pixels_per_mm=pixels_per_mm)
    if titles is None:
        titles = place_titles(drawing.pieces, largest_mm=_TITLE_MM * frame.growth)
    factor = _SUPERSAMPLING
    if frame.width_px * frame.height_px * factor**2 > _MAX_PIXELS:
        factor = 1
    large = PreviewFrame(
        frame.width_px * factor,
        frame.height_px * factor,
        frame.pixels_per_mm * factor,
        frame.left_px * factor,
        frame.bottom_px * factor,
        frame.growth,
    )
    picture = _Painter(large, factor, preset_named() if colours is None else colours)
    picture.sheet(drawing)
    for index, piece in enumerate(drawing.pieces):
        picture.piece(piece.entities, _FILLS[index % len(_FILLS)])
    for note in drawing.notes:
        picture.line(note, _NOTE, 1.0)
    for piece in drawing.pieces:
        if piece.piece_id in titles:
            picture.title(piece.piece_id, titles[piece.piece_id])
    image = picture.image
    if factor > 1:
        image = image.reduce(factor)
    stream = io.BytesIO()
    image.save(stream, format="PNG", compress_level=6)
    return stream.getvalue()


class _Painter:
    """Paint on one image; widths are in pixels of the finished picture."""

    def __init__(self, frame: PreviewFrame, factor: int, preset: Preset) -> None:
        self.image = Image.new("RGB", (frame.width_px, frame.height_px), _TABLE)
        self._draw = ImageDraw.Draw(self.image)
        self._frame = frame
        self._factor = factor
        self._preset = preset

    def sheet(self, drawing: SheetDrawing) -> None:
        """Paint the empty sheet, its heading and the reference bar."""
        scale, left = self._frame.pixels_per_mm, self._frame.left_px
        right, bottom = left + drawing.width_mm * scale, self._frame.bottom_px
        top = bottom - drawing.height_mm * scale
        self._draw.rectangle((left, top, right, bottom), fill=_SHEET)
        self._polyline([(left, top), (right, top), (right, bottom), (left, bottom)], _EDGE, 2, True)
        unit = scale * self._frame.growth
        middle = top - (_HEADING_MM / 2.0 + 1.0) * unit
        # On a sheet narrower than two bars, whole centimetres that leave room for the heading.
        bar = min(_BAR_MM, drawing.width_mm / 2.0 // 10.0 * 10.0) * scale
        heading = (
            f"{drawing.name}   {drawing.width_mm:g} x {drawing.height_mm:g} mm   "
            f"{len(drawing.pieces)} piece{'' if len(drawing.pieces) == 1 else 's'}"
        )
        room = right - left - bar - (6.0 * unit if bar else 0.0)
        size = self._fit(heading, 7.0 * unit, room)
        self._draw.text((left, middle), heading, fill=_INK, font=_font(size), anchor="lm")
        if bar:
            self._bar(right - bar, right, middle)

    def _bar(self, start: float, end: float, middle: float) -> None:
        """Paint the reference bar with its length above it."""
        unit = self._frame.pixels_per_mm * self._frame.growth
        y, tick = middle + 2.6 * unit, 1.4 * unit
        self._polyline([(start, y - tick), (start, y + tick)], _INK, 2)
        self._polyline([(start, y), (end, y)], _INK, 2)
        self._polyline([(end, y - tick), (end, y + tick)], _INK, 2)
        name = f"{(end - start) / self._frame.pixels_per_mm:.0f} mm"
        size = self._fit(name, 4.5 * unit, end - start)
        place = ((start + end) / 2.0, y - 0.8 * unit)
        self._draw.text(place, name, fill=_INK, font=_font(size), anchor="mb")

    def piece(self, entities: tuple[Entity, ...], fill: _Colour) -> None:
        """Paint a piece: its area, holes as the sheet shows through, then all its lines."""
        for layer, colour in ((Layer.CUT_OUTER, fill), (Layer.CUT_INNER, _SHEET)):
            for entity in entities:
                if entity.layer is layer:
                    self._area(entity, colour)
        for entity in entities:
            cut = entity.layer in (Layer.CUT_INNER, Layer.CUT_OUTER)
            self.line(entity, self._preset.colours[entity.layer].rgb, 2.0 if cut else 1.0)

    def _area(self, entity: Entity, colour: _Colour) -> None:
        if isinstance(entity, Circle):
            self._draw.ellipse(self._box(entity), fill=colour)
        else:
            self._draw.polygon(self._places(entity), fill=colour)

    def line(self, entity: Entity, colour: _Colour, width: float) -> None:
        """Paint the line of an entity."""
        if isinstance(entity, Circle):
            self._draw.ellipse(self._box(entity), outline=colour, width=self._width(width))
        else:
            self._polyline(self._places(entity), colour, width, entity.closed)

    def title(self, text: str, title: Title) -> None:
        """Paint a title, upright or turned, with a halo that keeps it legible on lines."""
        size = max(title.height_mm * self._frame.pixels_per_mm, 1.0)
        font = _font(size)
        halo = max(round(size * 0.12), 1)
        left, top, right, bottom = font.getbbox(text, anchor="mm", stroke_width=halo)
        wide, high = int(np.ceil(right - left)) + 4, int(np.ceil(bottom - top)) + 4
        # The letters are painted on a mask, which is turned about the middle of what it shows.
        middle = (wide / 2.0 - (left + right) / 2.0, high / 2.0 - (top + bottom) / 2.0)
        ((x, y),) = self._frame.pixels(np.array([[title.x, title.y]])).tolist()
        for colour, stroke in ((_SHEET, halo), (_INK, 0)):
            mask = Image.new("L", (wide, high), 0)
            ImageDraw.Draw(mask).text(
                middle, text, fill=255, font=font, anchor="mm", stroke_width=stroke
            )
            turned = mask.rotate(title.angle_deg, Image.Resampling.BICUBIC, expand=True)
            corner = (round(x - turned.width / 2.0), round(y - turned.height / 2.0))
            self.image.paste(
                colour, (*corner, corner[0] + turned.width, corner[1] + turned.height), turned
            )

    def _polyline(
        self, places: list[tuple[float, float]], colour: _Colour, width: float, closed: bool = False
    ) -> None:
        # A closed line goes over its first two points again, so that its corner is joined too.
        run = [*places, *places[:2]] if closed else places
        self._draw.line(run, fill=colour, width=self._width(width), joint="curve")

    def _places(self, line: Polyline) -> list[tuple[float, float]]:
        return [(x, y) for x, y in self._frame.pixels(line.points).tolist()]

    def _box(self, circle: Circle) -> tuple[float, float, float, float]:
        ((x, y),) = self._frame.pixels(np.array([[circle.x, circle.y]])).tolist()
        radius = circle.radius * self._frame.pixels_per_mm
        return x - radius, y - radius, x + radius, y + radius

    def _width(self, width: float) -> int:
        return max(round(width * self._factor), 1)

    def _fit(self, text: str, size: float, room: float) -> float:
        """Return the largest font size, up to ``size``, at which a text fits the room."""
        wide = _font(size).getlength(text)
        return max(size * min(1.0, room / wide), 1.0)


def _font(size: float) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    """Return Pillow's own font: it is the same everywhere."""
    return ImageFont.load_default(size=max(size, 1.0))
