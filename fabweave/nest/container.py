"""Say where on a sheet pieces may be: within margins, off defects, at allowed angles."""

import math
from dataclasses import dataclass

import shapely
from shapely.affinity import translate

from fabweave.nest.place.raster import largest_rectangle
from fabweave.stock.rotations import FREE, Rotations
from fabweave.stock.sheet_size import SheetSize, usable_size

#: A region with less area, mm², is none.
_NOTHING_MM2 = 1e-6
#: Chords in a quarter circle.
_ARC_STEPS = 16
#: The largest side of pixels at any effort, millimetres.
_PIXEL_MM = 2.0
#: What rounding may take of a room, millimetres.
_SLACK_MM = 1e-3
#: Pixels of one sheet: a larger one gets larger pixels.
MAX_PIXELS = 2_000_000


@dataclass(frozen=True)
class Container:
    """The usable area of a sheet, from its own corner.

    Parameters
    ----------
    size_mm : (float, float)
        Width and height of the rectangle in which pieces stay.
    barred : polygons or None
        Where no piece may be: pieces keep the gap from it as from one another. None if there is no
        such place.
    rotations : Rotations
        The angles at which they may lie.
    """

    size_mm: tuple[float, float]
    barred: shapely.Geometry | None = None
    rotations: Rotations = FREE

    @property
    def open_mm2(self) -> float:
        """The area that is not barred."""
        usable_mm2 = self.size_mm[0] * self.size_mm[1]
        if self.barred is None:
            return usable_mm2
        return usable_mm2 - float(
            shapely.box(0.0, 0.0, *self.size_mm).intersection(self.barred).area
        )


def clear_rectangle(container: Container, gap_mm: float) -> tuple[float, float]:
    """Return width and height of a rectangle such that nesting has a place for whatever fits it.

    Where nothing is barred it is all of the usable area; else the largest rectangle at the gap from
    what is barred, less what pixels may take of it. It may have no size.

    Examples
    --------
    >>> clear_rectangle(Container((80.0, 40.0)), 2.0)
    (80.0, 40.0)
    >>> clear_rectangle(Container((80.0, 40.0), shapely.box(60.0, 0.0, 80.0, 40.0)), 2.0)[0] < 58.0
    True
    """
    if container.barred is None:
        return container.size_mm
    # A position of pixels is free where they are a diagonal beyond the gap, at both ends; and there
    # is one in a room that is wider by a pixel.
    width, height = container.size_mm
    pixel = max(_PIXEL_MM, math.sqrt(width * height / MAX_PIXELS))
    lost = (2.0 * math.sqrt(2.0) + 1.0) * pixel + 4.0 * _SLACK_MM
    around = shapely.buffer(container.barred, gap_mm / math.cos(1.5 * math.pi / (4.0 * _ARC_STEPS)))
    corners = largest_rectangle(container.size_mm, around)
    wide, high = (0.0, 0.0) if corners is None else (corners[1] - corners[0] - lost).tolist()
    return max(wide, 0.0), max(high, 0.0)


def container_of(
    sheet: SheetSize, margin_mm: float, gap_mm: float, rotations: Rotations = FREE
) -> Container:
    """Return the usable area of a sheet.

    The margin holds along the outline. Pieces keep the gap from what is barred, so the outside of
    the outline is barred as far as the margin is more than the gap; along an outline that is no
    rectangle, a smaller margin counts as the gap.

    Parameters
    ----------
    sheet : SheetSize
        With its outline, defects and grain.
    margin_mm, gap_mm : float
        Distance from the border, and between pieces.
    rotations : Rotations
        The rule for angles, on a sheet without grain.

    Examples
    --------
    >>> container_of(SheetSize(100.0, 60.0), 10.0, 2.0).size_mm
    (80.0, 40.0)
    >>> knot = ((40.0, 20.0), (50.0, 20.0), (50.0, 30.0), (40.0, 30.0))
    >>> container_of(SheetSize(100.0, 60.0, defects=(knot,)), 10.0, 2.0).barred.bounds
    (30.0, 10.0, 40.0, 20.0)
    """
    if sheet.is_roll:
        # The strips of a roll are as wide as it is, so that only their length matters.
        return Container((max(sheet.width_mm - 2.0 * margin_mm, 0.0),) * 2)
    size = usable_size(sheet, margin_mm)
    if rotations.step_deg is not None:
        rotations = rotations.along(sheet.grain_deg)
    parts = [shapely.make_valid(shapely.Polygon(ring)) for ring in sheet.defects]
    if sheet.outline:
        inside = shapely.Polygon(sheet.outline)
        # Beyond the sheet's rectangle nothing need be barred: the usable one keeps the margin.
        beside = shapely.box(0.0, 0.0, sheet.width_mm, sheet.height_mm).difference(inside)
        # So much that chords of arcs are outside their arc.
        reach = max(margin_mm - gap_mm, 0.0) / math.cos(1.5 * math.pi / (4.0 * _ARC_STEPS))
        parts.append(shapely.buffer(beside, reach, quad_segs=_ARC_STEPS))
    barred = shapely.union_all(parts)
    if not barred.area > _NOTHING_MM2:
        return Container(size, rotations=rotations)
    return Container(size, translate(barred, -margin_mm, -margin_mm), rotations)
