"""Compare nesting with bounding rectangles and the area bound; run by hand.

    python tests/benchmarks/bench_nesting.py [--effort quick normal best] [--set strips thin]

Sheets 600 × 400 mm, margin 10 mm, gap 3 mm. The area bound counts every piece inflated by half
the gap, which no layout can beat.
"""

import argparse
import math
import runpy
import time
from pathlib import Path

import rectpack
import shapely

from fabweave.arrays import FloatArray
from fabweave.sheet.check import check_layout
from fabweave.sheet.layout import SheetSize
from fabweave.sheet.nest import nest

SHEET, MARGIN, GAP = SheetSize(600.0, 400.0), 10.0, 3.0
USABLE = (SHEET.width_mm - 2 * MARGIN, SHEET.height_mm - 2 * MARGIN)


def sheets_by_rectpack(pieces: list[FloatArray]) -> int:
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
            packer.add_rect(*(math.ceil((side + GAP) * 100) for side in size), number)
        packer.add_bin(*(int((side + GAP) * 100) for side in USABLE), float("inf"))
        packer.pack()
        if len(packer.rect_list()) == len(pieces):
            counts.append(len(packer))
    return min(counts)


def main() -> None:
    """Print one table for each set of pieces."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", nargs="+", default=["quick", "normal"])
    parser.add_argument("--set", nargs="+", default=["strips", "thin"])
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    sets = runpy.run_path(str(Path(__file__).parents[1] / "sheet" / "pieces_set.py"))
    for name in options.set:
        make = sets["measured_set" if name == "strips" else "thin_set"]
        pieces = make(seed=options.seed)
        area = sum(shapely.polygons(piece).area for piece in pieces)
        inflated = sum(shapely.polygons(piece).buffer(GAP / 2).area for piece in pieces)
        bound = math.ceil(inflated / ((USABLE[0] + GAP) * (USABLE[1] + GAP)))
        start = time.perf_counter()
        rows = [("area bound", bound, 0.0)]
        rows.append(
            ("rectpack, best of 5", sheets_by_rectpack(pieces), time.perf_counter() - start)
        )
        for effort in options.effort:
            start = time.perf_counter()
            layout = nest(pieces, [SHEET], margin_mm=MARGIN, gap_mm=GAP, effort=effort)
            seconds = time.perf_counter() - start
            faults = check_layout(layout, pieces)
            if faults:
                raise SystemExit("\n".join(faults))
            rows.append((f"fabweave {effort}", len(layout.sheets), seconds))
        rectangles = rows[1][1]
        print(f"\n{name}: {len(pieces)} pieces, {area / 1e6:.3f} m²")
        print(f"{'method':22}{'sheets':>7}{'used':>7}{'/rectpack':>11}{'/bound':>8}{'seconds':>9}")
        for method, count, seconds in rows:
            used = area / (count * USABLE[0] * USABLE[1])
            print(
                f"{method:22}{count:7}{used:7.2f}{count / rectangles:11.2f}"
                f"{count / bound:8.2f}{seconds:9.1f}"
            )


if __name__ == "__main__":
    main()
