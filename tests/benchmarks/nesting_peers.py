"""What nesting is compared with: bounding rectangles, and a strip packer.

Each returns how many sheets it fills, as a fraction: the last one counts up to where it is used.
"""

import math

import numpy as np
import rectpack
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.nest.container import Container
from fabweave.nest.item_shape import rotated, shape_of
from fabweave.nest.separate.fewer_sheets import shortfall_mm
from fabweave.nest.separate.separation import ItemField, item_field

#: By how much outlines are inflated, and simplified, for spyrrow.
OUTLINE_MM = 0.1
#: A strip that is longer than the sheet by this much may still be pushed together.
LONGER_MM = 2.0


def sheets_by_rectpack(pieces: list[FloatArray], usable: tuple[float, float], gap: float) -> float:
    """Return the fewest sheets that rectpack needs for the least rectangles of the pieces."""
    sizes = []
    for piece in pieces:
        box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(shapely.polygons(piece)))
        sizes.append([math.dist(box[0], box[1]), math.dist(box[1], box[2])])
    counts = []
    for algorithm in (
        rectpack.MaxRectsBssf,
        rectpack.MaxRectsBaf,
        rectpack.MaxRectsBlsf,
        rectpack.GuillotineBssfSas,
        rectpack.SkylineMwfl,
    ):
        packer = rectpack.newPacker(pack_algo=algorithm, rotation=True)
        for number, size in enumerate(sizes):
            # Whole hundredths of a millimetre, rounded up; the gap goes with every piece.
            packer.add_rect(*(math.ceil((side + gap) * 100) for side in size), number)
        packer.add_bin(*(int((side + gap) * 100) for side in usable), float("inf"))
        packer.pack()
        if len(packer.rect_list()) == len(pieces):
            ends = [
                min(
                    max(rect.x + rect.width for rect in sheet) / sheet.width,
                    max(rect.y + rect.height for rect in sheet) / sheet.height,
                )
                for sheet in packer
            ]
            counts.append(len(ends) - 1 + min(ends))
    return min(counts, default=math.inf)


def sheets_by_spyrrow(
    pieces: list[FloatArray], usable: tuple[float, float], gap: float, seconds: float
) -> float:
    """Return how many sheets spyrrow needs, one after another, longest pieces first.

    Each sheet takes three tries to find how many pieces it holds, and more until it holds some; the
    time is shared evenly by the first three.
    """
    items = [item_field(shape_of(piece)[0], gap) for piece in pieces]
    left = sorted(items, key=lambda item: -float(np.ptp(item.outline, axis=0).max()))
    area = sum(item.area_mm2 for item in items)
    guess = max(1, math.ceil(area / (0.45 * usable[0] * usable[1])))
    each = max(1, round(seconds / (3 * guess)))
    share, count, end = 0.45, 0, 1.0
    while left:
        placed, tries, end = 0, 0, 1.0
        while tries < 3 or placed == 0:
            tries += 1
            total = np.cumsum([item.area_mm2 for item in left]) / (usable[0] * usable[1])
            number = max(1, int(np.searchsorted(total, share)))
            chosen = left[:number]
            poses = _spyrrow_poses(chosen, usable, gap, each)
            if poses is not None and shortfall_mm(chosen, poses, Container(usable), gap) < 1.0:
                placed = max(placed, number)
                if number == len(left):
                    end = _end(chosen, poses) / usable[0]
                    break
                share *= 1.06
            elif number == 1:
                placed = 1  # one piece always fits: the peer is given that
            else:
                share *= 0.9 if tries < 3 else 0.7
        left = left[placed:]
        count += 1
    return count - 1 + min(end, 1.0)


def _spyrrow_poses(
    items: list[ItemField], usable: tuple[float, float], gap: float, seconds: int
) -> FloatArray | None:
    """Return the poses (N, 3) that spyrrow finds on one sheet; None if it finds no room.

    It panics at outlines that are not simple or just fit: so they are simplified, and a panic
    counts as no room.
    """
    import spyrrow  # noqa: PLC0415 -- the other peers do without

    outlines = []
    for item in items:
        grown = shapely.buffer(shapely.polygons(item.outline), OUTLINE_MM, quad_segs=2)
        simple = shapely.simplify(shapely.polygons(grown.exterior.coords), OUTLINE_MM)
        outlines.append(shapely.get_coordinates(shapely.normalize(simple))[:-1])
    strip_items = [
        spyrrow.Item(str(number), [tuple(point) for point in outline], 1, None)
        for number, outline in enumerate(outlines)
    ]
    config = spyrrow.StripPackingConfig(
        early_termination=True,
        min_items_separation=gap or None,
        total_computation_time=seconds,
        seed=1,
    )
    # It keeps the gap from the borders of the strip, too.
    strip = spyrrow.StripPackingInstance("sheet", usable[1] + 2.0 * gap, strip_items)
    try:
        packing = strip.solve(config)
    except BaseException as panic:
        if type(panic).__name__ != "PanicException":
            raise
        return None
    if packing.width > usable[0] + 2.0 * gap + LONGER_MM:
        return None
    poses = np.zeros((len(items), 3))
    for placed in packing.placed_items:
        x, y = placed.translation
        poses[int(placed.id)] = [x - gap, y - gap, np.deg2rad(placed.rotation)]
    return poses


def _end(items: list[ItemField], poses: FloatArray) -> float:
    """Return how far to the right items come."""
    return max(
        float((rotated(item.outline, np.rad2deg(pose[2:]))[0, :, 0] + pose[0]).max())
        for item, pose in zip(items, poses, strict=True)
    )
