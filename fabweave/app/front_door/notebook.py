"""Show values in notebooks: a picture, and the figures that count."""

import base64
import html
import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from PIL import Image

#: So many outlines stand in a row.
_COLUMNS = 6


def face(title: str, figures: Mapping[str, Any], picture: Image.Image | str | None = None) -> str:
    """Return HTML that shows a value in a notebook: a picture, and its key figures.

    Parameters
    ----------
    title : str
    figures : mapping
        Names and what they come to.
    picture : image or str, optional
        A picture, or SVG.
    """
    if isinstance(picture, Image.Image):
        small = picture.copy()
        small.thumbnail((480, 400))
        data = io.BytesIO()
        small.save(data, "PNG")
        picture = f'<img src="data:image/png;base64,{base64.b64encode(data.getvalue()).decode()}">'
    rows = "".join(
        f"<tr><th style='text-align:left'>{html.escape(name)}</th>"
        f"<td style='text-align:left'>{html.escape(str(value))}</td></tr>"
        for name, value in figures.items()
    )
    return (
        f"<div><b>{html.escape(title)}</b><div style='display:flex;gap:1em;align-items:start'>"
        f"{picture or ''}<table>{rows}</table></div></div>"
    )


def outlines_svg(polygons: Sequence[shapely.Polygon], colours: npt.NDArray[np.integer]) -> str:
    """Return SVG of polygons side by side, in rows, each in its colour.

    Parameters
    ----------
    polygons : sequence of N polygons
    colours : (N, 3) int array
        Red, green and blue, 0 to 255.
    """
    boxes = np.array([polygon.bounds for polygon in polygons]).reshape(-1, 4)
    wide, high = 1.1 * np.ptp(boxes.reshape(-1, 2, 2), axis=1).max(axis=0, initial=1.0)
    at = np.arange(len(polygons))
    places = np.column_stack((at % _COLUMNS * wide, at // _COLUMNS * high)) - boxes[:, :2]
    rows = -(-len(polygons) // _COLUMNS)
    return _svg(min(_COLUMNS, len(polygons)) * wide, rows * high, polygons, places, colours)


def sheet_svg(
    size_mm: tuple[float, float],
    polygons: Sequence[shapely.Polygon],
    colours: npt.NDArray[np.integer],
) -> str:
    """Return SVG of a sheet with the pieces that lie on it, each in its colour."""
    return _svg(*size_mm, polygons, np.zeros((len(polygons), 2)), colours)


def _svg(
    width_mm: float,
    height_mm: float,
    polygons: Sequence[shapely.Polygon],
    places: npt.NDArray[np.floating],
    colours: npt.NDArray[np.integer],
) -> str:
    """Return SVG of polygons, each moved to its place; y points up."""
    paths = []
    for polygon, place, colour in zip(polygons, places, colours.tolist(), strict=True):
        rings = (polygon.exterior, *polygon.interiors)
        outline = "".join(_path(shapely.get_coordinates(ring) + place, height_mm) for ring in rings)
        paths.append(
            f'<path d="{outline}" fill="rgb({",".join(map(str, colour))})" fill-rule="evenodd"/>'
        )
    shown_px = min(480.0, 300.0 * width_mm / height_mm)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{shown_px:.0f}" '
        f'viewBox="0 0 {width_mm:.1f} {height_mm:.1f}">'
        f'<rect width="100%" height="100%" fill="#f6f4ef"/>{"".join(paths)}</svg>'
    )


def _path(points: npt.NDArray[np.floating], height_mm: float) -> str:
    steps = " ".join(f"{x:.1f},{height_mm - y:.1f}" for x, y in points[:-1].tolist())
    return f"M{steps}z"
