"""Find what is left of a sheet in one piece, and whether it is worth keeping."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray, frozen, frozen_value
from fabweave.nest.layout import Layout
from fabweave.nest.place.rectangle import largest_rectangle
from fabweave.stock.sheet_size import SheetSize

_ARM_MM = 10.0  # narrower arms of an offcut are of no use
_SPARE_MM = 0.25  # beyond the gap, so that roundings and short sides do not count
_SHORT_MM = 0.12  # no side is shorter
_SIMPLE_MM = 0.5  # how far its border may be from where it might be
_GRAIN_MM = 1e-4  # coordinates are rounded to this, as in drawings
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
        What is no good in it: defects, and pieces that stand in its midst.
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
    whole = shapely.Polygon(sheet.ring)
    if sheet.outline:
        # Short sides of a bent edge are left out, which must not lead beyond it.
        whole = shapely.buffer(whole, -2.0 * _SHORT_MM, join_style="mitre")
    taken = [shapely.polygons(outline) for outline in placed]
    grown = shapely.union_all(shapely.buffer(np.array(taken), gap_mm + _SPARE_MM, quad_segs=8))
    # Closing: what is nearer than this to pieces on both sides is no longer free.
    arm = _ARM_MM / 2.0
    closed = shapely.buffer(shapely.buffer(grown, arm + _SIMPLE_MM, quad_segs=8), -arm, quad_segs=8)
    covered = shapely.simplify(shapely.union(closed, grown), _SIMPLE_MM - _SPARE_MM)
    rest = shapely.difference(whole, shapely.union(covered, grown))
    # Opening, with corners kept: arms along the edge of the sheet go, too.
    core = shapely.buffer(rest, -arm, join_style="mitre")
    parts = shapely.get_parts(core)
    if len(parts) == 0:
        return None
    largest = parts[int(np.argmax(np.round(shapely.area(parts), 6)))]
    body = shapely.intersection(shapely.buffer(largest, arm, join_style="mitre"), rest)
    flaws = [shapely.make_valid(shapely.Polygon(ring)) for ring in sheet.defects]
    spoilt = shapely.union_all(shapely.buffer(np.array(flaws), _SPARE_MM)) if flaws else None
    body = body if spoilt is None else shapely.difference(body, spoilt)
    bodies = shapely.get_parts(shapely.set_precision(body, _GRAIN_MM))
    bodies = bodies[shapely.area(bodies) > _ARM_MM**2]
    if len(bodies) == 0:
        return None
    body = bodies[int(np.argmax(np.round(shapely.area(bodies), 6)))]
    simple = shapely.simplify(body, _SHORT_MM)
    outline, *holes = (_tidy(ring) for ring in (simple.exterior, *simple.interiors))
    tidy = shapely.Polygon(outline, holes)
    size = (sheet.width_mm, sheet.height_mm)
    beside = shapely.difference(shapely.box(0.0, 0.0, *size), shapely.make_valid(tidy))
    rectangle = largest_rectangle(size, beside)
    if rectangle is None or not tidy.is_valid:
        return None
    return Offcut(number, outline, tuple(holes), rectangle)


def _tidy(ring: shapely.LinearRing) -> FloatArray:
    """Return the corners of a ring, counter-clockwise from the lowest, with no short side."""
    points = shapely.get_coordinates(ring)[:-1]
    if not shapely.is_ccw(ring):
        points = points[::-1]
    points = np.roll(points, -int(np.lexsort(points.T)[0]), axis=0)
    kept = [points[0]]
    for point in points[1:]:
        if np.hypot(*(point - kept[-1])) >= _SHORT_MM:
            kept.append(point)
    if np.hypot(*(kept[-1] - kept[0])) < _SHORT_MM:
        kept.pop()
    return frozen(np.array(kept))


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
    for number, (sheet, here) in enumerate(zip(layout.sheets, placed, strict=True)):
        free = sheet.area_mm2 - float(shapely.area([shapely.polygons(one) for one in here]).sum())
        # What leaves no room for the least square need not be looked at.
        if free < KEPT_WIDTH_MM**2:
            continue
        offcut = offcut_of(sheet, number, here, layout.gap_mm)
        if offcut is not None and worth_keeping(offcut, sheet):
            kept.append(replace(offcut, name=f"offcut_{len(kept) + 1:02d}"))
    return tuple(kept)
