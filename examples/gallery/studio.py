"""Show every object of the gallery in the same way: camera, light, scale, and its figures.

An object is a frozen value: its title, the values of the front door that made it, and the one
number that its script is about. ``exhibit.tell()`` prints the figures and, where a path is named on
the command line, writes the picture.
"""

import sys
from dataclasses import dataclass
from typing import Any

from PIL import Image, ImageDraw

import fabweave as fw

#: What all objects measure at most, and what all pictures show across, at this size.
SIZE, ACROSS, TILE_PX = "300mm", "440mm", (960, 780)
#: From where all are seen: azimuth and elevation in degrees.
VIEW = (-60.0, 30.0)
#: Colours that the files of the gallery are reduced to.
PALETTE = 256
_PAPER, _EDGE = (246, 244, 239), (150, 150, 150)


@dataclass(frozen=True)
class Exhibit:
    """An object of the gallery.

    Parameters
    ----------
    title : str
        What it is.
    key : str
        The number that its script is about, in words.
    mesh, ribbons, layout
        What the front door gives; no layout where nothing is cut, as of yarns.
    parts : tuple of str
        What its picture shows, side by side: "mesh", "woven", "sheet".
    """

    title: str
    key: str
    mesh: fw.Mesh
    ribbons: fw.Ribbons | fw.Yarns
    layout: fw.Layout | None = None
    parts: tuple[str, ...] = ("woven",)

    def figures(self) -> dict[str, Any]:
        """Return what the page tells of it, in the order of its columns."""
        stations = self.ribbons.stations
        weave = fw.Weave(stations, stations.weave)
        pattern = weave.pattern if weave.exact else f"{weave.pattern}, inexact"
        row = {"weave": pattern, "threads": len(weave.threads), "crossings": len(weave.crossings)}
        if self.layout is None:
            return row | dict.fromkeys(("pieces", "kinds", "sheets", "hours"), "–")
        pieces = self.layout.pieces
        low, high = pieces.costs.assembly.hours
        return row | {
            "pieces": len(pieces),
            "kinds": len(set(pieces.kinds.tolist())),
            "sheets": len(self.layout.sheets),
            "hours": f"{low:.0f}–{high:.0f}",
        }

    def picture(self) -> Image.Image:
        """Return its picture, its parts side by side, in few colours."""
        look = {"size_px": TILE_PX, "view": VIEW, "across": ACROSS, "samples": 3}
        tiles = {
            "mesh": lambda: self.mesh.picture(**look),
            "woven": lambda: self.ribbons.picture(**look),
            "sheet": lambda: _sheet(self.layout),
        }
        wide, high = TILE_PX
        whole = Image.new("RGB", (wide * len(self.parts), high), "white")
        for number, part in enumerate(self.parts):
            whole.paste(tiles[part](), (number * wide, 0))
        # A palette keeps the file small; its means, found twice, keep soft shadows free of steps.
        return whole.quantize(PALETTE, kmeans=1, dither=Image.Dither.NONE)

    def tell(self) -> None:
        """Print the key number and the figures; write the picture if a path is named for it."""
        print(self.key)
        print("; ".join(f"{name} {value}" for name, value in self.figures().items()))
        paths = [path for path in sys.argv[1:] if path.endswith(".png")]
        for path in paths:
            self.picture().save(path, optimize=True)


def _sheet(layout: fw.Layout) -> Image.Image:
    """Draw the first sheet with its pieces, each in the colour that it has in the object."""
    size, finer = layout.sheets[0], 3
    wide, high = TILE_PX[0] * finer, TILE_PX[1] * finer
    scale = 0.9 * min(wide / size.width_mm, high / size.height_mm)
    left, low = (wide - scale * size.width_mm) / 2, (high + scale * size.height_mm) / 2

    def pixels(points: Any) -> list[tuple[float, float]]:
        return [(left + scale * x, low - scale * y) for x, y in points]

    picture = Image.new("RGB", (wide, high), "white")
    draw = ImageDraw.Draw(picture)
    (x0, y1), (x1, y0) = pixels([(0, 0), (size.width_mm, size.height_mm)])
    draw.rectangle((x0, y0, x1, y1), fill=_PAPER, outline=_EDGE, width=finer)
    lying = zip(layout.rows(), layout.polygons, layout.colours.tolist(), strict=True)
    for row, polygon, colour in lying:
        if row["sheet"] == 1:
            draw.polygon(pixels(polygon.exterior.coords), fill=tuple(colour))
            for hole in polygon.interiors:
                draw.polygon(pixels(hole.coords), fill=_PAPER)
    return picture.resize(TILE_PX, Image.Resampling.LANCZOS)
