"""Find what is left of a sheet in one piece, and whether it is worth keeping."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.core.arrays import FloatArray, frozen, frozen_value
from fabweave.nest.layout import Layout
from fabweave.nest.place.raster import largest_rectangle
from fabweave.stock.sheet_size import SheetSize

#: Narrower arms of an offcut, millimetres, are of no use.
_ARM_MM = 10.0
#: Kept beyond the gap, millimetres, so that roundings and short sides do not count.
_SPARE_MM = 0.25
#: No side is shorter, millimetres: drawings have no segment below 0.1 mm.
_SHORT_MM = 0.12
#: How far its border may be from where it might be, millimetres.
_SIMPLE_MM = 0.5
#: Coordinates are rounded to this, millimetres, as in drawings.
_GRAIN_MM = 1e-4
#: Chords in a quarter circle.
_ARC_STEPS = 8
#: An offcut is worth keeping if it holds a square of this side,
KEPT_SIDE_MM = 100.0
#: or if it is this share of its sheet, and
KEPT_SHARE = 0.05
#: holds a square of this side.
KEPT_WIDTH_MM = 50.0


@frozen_value
class Offcut:
    """What is left of a sheet in one piece.

    Parameters
    ----------
    sheet : int
        Number of the sheet in the layout.
    outline : (K, 2) float array
        In the frame of the sheet, millimetres; the gap from every piece.
    holes : tuple of (H, 2) float arrays
        What cannot be used in it: defects, and pieces that stand in its midst.
    rectangle : (2, 2) float array
        Least and greatest corner of the largest rectangle in it.
    name : str
        What its file is called, without suffix; empty until it is known to be kept.
    """

    sheet: int
    outline: FloatArray
    holes: tuple[FloatArray, ...]
    rectangle: FloatArray
    name: str = ""

    def mirrored(self, width_mm: float) -> "Offcut":
        """Return it as it is drawn on a sheet of this width that is drawn mirrored."""
        flip, shift = np.array([-1.0, 1.0]), np.array([width_mm, 0.0])
        outline, *holes = (
            frozen((ring * flip + shift)[::-1].copy()) for ring in (self.outline, *self.holes)
        )
        rectangle = frozen(np.sort(self.rectangle * flip + shift, axis=0))
        return replace(self, outline=outline, holes=tuple(holes), rectangle=rectangle)

    @property
    def area_mm2(self) -> float:
        """Its area, holes not counted."""
        return float(shapely.Polygon(self.outline, self.holes).area)

    @property
    def rectangle_mm(self) -> tuple[float, float]:
        """Width and height of its largest rectangle."""
        wide, high = (self.rectangle[1] - self.rectangle[0]).tolist()
        return wide, high


def offcut_of(
    sheet: SheetSize, number: int, placed: Sequence[FloatArray], gap_mm: float
) -> Offcut | None:
    """Return the largest rest of a sheet; None if there is none to speak of.

    The pieces grow by the gap; crevices narrower than 10 mm are closed; and the border is
    simplified so that it only moves away from the pieces. The edges of the sheet stay. Defects are
    left out as holes, if they do not lie at the border.

    Parameters
    ----------
    sheet : SheetSize
    number : int
        Of the sheet in its layout.
    placed : sequence of (K, 2) float arrays
        The outlines of the pieces on it.
    gap_mm : float
        How far the rest stays from them.

    Examples
    --------
    >>> left = np.array([[10.0, 10.0], [90.0, 10.0], [90.0, 190.0], [10.0, 190.0]])
    >>> rest = offcut_of(SheetSize(300.0, 200.0), 0, [left], 2.0)
    >>> [round(side) for side in rest.rectangle_mm], 41000 < rest.area_mm2 < 42000
    ([207, 200], True)
    """
    usable = shapely.Polygon(sheet.ring)
    if sheet.outline:
        # Short sides of a bent edge are left out, which must not lead beyond it.
        usable = shapely.buffer(usable, -2.0 * _SHORT_MM, join_style="mitre")
    pieces = np.array([shapely.polygons(outline) for outline in placed])
    grown = shapely.union_all(shapely.buffer(pieces, gap_mm + _SPARE_MM, quad_segs=_ARC_STEPS))
    # Closing: what is nearer than this to pieces on both sides is no longer free.
    arm = _ARM_MM / 2.0
    closed = shapely.buffer(
        shapely.buffer(grown, arm + _SIMPLE_MM, quad_segs=_ARC_STEPS), -arm, quad_segs=_ARC_STEPS
    )
    covered = shapely.simplify(shapely.union(closed, grown), _SIMPLE_MM - _SPARE_MM)
    rest = shapely.difference(usable, shapely.union(covered, grown))
    # Opening, with corners kept: arms along the edge of the sheet go, too.
    core = shapely.buffer(rest, -arm, join_style="mitre")
    parts = shapely.get_parts(core)
    if len(parts) == 0:
        return None
    opened = shapely.intersection(shapely.buffer(_largest(parts), arm, join_style="mitre"), rest)
    defects = [shapely.make_valid(shapely.Polygon(ring)) for ring in sheet.defects]
    if defects:
        spoilt = shapely.union_all(shapely.buffer(np.array(defects), _SPARE_MM))
        opened = shapely.difference(opened, spoilt)
    parts = shapely.get_parts(_rounded(opened))
    parts = parts[shapely.area(parts) > _ARM_MM**2]
    if len(parts) == 0:
        return None
    simple = shapely.simplify(_largest(parts), _SHORT_MM)
    outline, *holes = (_tidy(ring) for ring in (simple.exterior, *simple.interiors))
    tidy = shapely.Polygon(outline, holes)
    size = (sheet.width_mm, sheet.height_mm)
    beside = shapely.difference(shapely.box(0.0, 0.0, *size), shapely.make_valid(tidy))
    rectangle = largest_rectangle(size, beside)
    if rectangle is None or not tidy.is_valid:
        return None
    return Offcut(number, outline, tuple(holes), rectangle)


def _rounded(shape: shapely.Geometry) -> shapely.Geometry:
    """Return a shape with its corners on the grain; those that all but touch may fall together."""
    try:
        return shapely.set_precision(shape, _GRAIN_MM)
    except shapely.GEOSException:  # a sliver that GEOS cannot round as a whole
        return shapely.make_valid(shapely.set_precision(shape, _GRAIN_MM, mode="pointwise"))


def _largest(polygons: npt.NDArray[np.object_]) -> shapely.Polygon:
    """Return the first of the largest polygons."""
    return polygons[int(np.argmax(np.round(shapely.area(polygons), 6)))]


def _tidy(ring: shapely.LinearRing) -> FloatArray:
    """Return the corners of a ring, counter-clockwise from the lowest, with no short side."""
    points = shapely.get_coordinates(ring)[:-1]
    if not shapely.is_ccw(ring):
        points = points[::-1]
    points = np.roll(points, -int(np.lexsort(points.T)[0]), axis=0)
    kept = thinned(points, _SHORT_MM)
    if np.hypot(*(kept[-1] - kept[0])) < _SHORT_MM:
        kept.pop()
    return frozen(np.array(kept))


def thinned(points: FloatArray, short_mm: float) -> list[FloatArray]:
    """Return the points of a run that are far enough from the one before."""
    kept = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) >= short_mm:
            kept.append(point)
    return kept


def worth_keeping(offcut: Offcut, sheet: SheetSize) -> bool:
    """Return whether an offcut is worth keeping: large enough for pieces of a later job.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [120.0, 0.0], [120.0, 120.0], [0.0, 120.0]])
    >>> worth_keeping(Offcut(0, square, (), square[[0, 2]]), SheetSize(3000.0, 1500.0))
    True
    """
    narrow = min(offcut.rectangle_mm)
    share = offcut.area_mm2 / sheet.area_mm2
    return narrow >= KEPT_SIDE_MM or (share >= KEPT_SHARE and narrow >= KEPT_WIDTH_MM)


def usable_offcuts(layout: Layout, outlines: Sequence[FloatArray]) -> tuple[Offcut, ...]:
    """Return the largest rest of each sheet that leaves one worth keeping, in order of the sheets.

    They are named ``offcut_01`` and so on.

    Parameters
    ----------
    layout : Layout
    outlines : sequence of (K, 2) float arrays
        The pieces in their own coordinates.
    """
    placed: list[list[FloatArray]] = [[] for _ in layout.sheets]
    for placement in layout.placements:
        placed[placement.sheet].append(placement.apply(outlines[placement.piece]))
    kept: list[Offcut] = []
    for number, (sheet, pieces) in enumerate(zip(layout.sheets, placed, strict=True)):
        taken_mm2 = float(shapely.area([shapely.polygons(outline) for outline in pieces]).sum())
        # A sheet without room for the least square need not be looked at.
        if sheet.area_mm2 - taken_mm2 < KEPT_WIDTH_MM**2:
            continue
        offcut = offcut_of(sheet, number, pieces, layout.gap_mm)
        if offcut is not None and worth_keeping(offcut, sheet):
            kept.append(replace(offcut, name=f"offcut_{len(kept) + 1:02d}"))
    return tuple(kept)
