"""Compare nesting with three other ways and the area bound; run by hand.

    python tests/benchmarks/bench_nesting.py [--effort quick normal] [--set strips thin jobs many]

``strips`` and ``thin`` are generated sets (sheets 600 × 400 mm, margin 10 mm, gap 3 mm); ``jobs``
are the pieces of five jobs on two sizes of sheets, gap 2 mm; ``many`` compares 500 pieces with
5000. Peers: rectpack on bounding rectangles; spyrrow, one sheet after another, in the time of the
last effort; a plain raster greedy (2 mm, 24 rotations). The bound counts every piece inflated by
half the gap, which no layout can beat. Seconds are of the processor: other work does not count.
"""

import argparse
import math
import resource
import runpy
import time
from pathlib import Path

import numpy as np
import shapely

from fabweave.arrays import FloatArray
from fabweave.job import make_job
from fabweave.settings import JobSettings
from fabweave.sheet.check import check_layout
from fabweave.sheet.engine import engine_is_there
from fabweave.sheet.layout import Layout, SheetSize
from fabweave.sheet.nest import nest

HERE = Path(__file__)
MESHES = HERE.resolve().parents[3] / "shared" / "meshes" / "quad"
MARGIN = 10.0
JOBS = {
    "torus 24x12": JobSettings("shape:torus?m=24&n=12", size_mm=400.0),
    "cube, 3 steps": JobSettings("shape:cube", size_mm=300.0, refine="catmull-clark:3"),
    "slit genus 3": JobSettings("shape:slit?genus=3", size_mm=400.0),
    "spot 400 mm": JobSettings(str(MESHES / "spot_quadrangulated.obj"), size_mm=400.0),
    "bob 600 mm": JobSettings(str(MESHES / "bob_quad.obj"), size_mm=600.0),
}
SHEETS = (SheetSize(600.0, 400.0), SheetSize(1000.0, 600.0))


def fill_of(layout: Layout, pieces: list[FloatArray]) -> float:
    """Return the utilisation up to where the last sheet is used."""
    last = len(layout.sheets) - 1
    ends = [p.apply(pieces[p.piece])[:, 0].max() for p in layout.placements if p.sheet == last]
    area = sum((s.width_mm - 2 * MARGIN) * (s.height_mm - 2 * MARGIN) for s in layout.sheets[:last])
    area += (max(ends) - MARGIN) * (layout.sheets[last].height_mm - 2 * MARGIN)
    return float(shapely.area([shapely.polygons(piece) for piece in pieces]).sum()) / area


def compare(
    name: str, pieces: list[FloatArray], sheet: SheetSize, gap: float, efforts: list[str]
) -> None:
    """Print one table."""
    peers = runpy.run_path(str(HERE.with_name("nesting_peers.py")))
    usable = (sheet.width_mm - 2 * MARGIN, sheet.height_mm - 2 * MARGIN)
    area = sum(shapely.polygons(piece).area for piece in pieces)
    inflated = sum(shapely.polygons(piece).buffer(gap / 2).area for piece in pieces)
    print(f"\n{name}: {len(pieces)} pieces, {area / 1e6:.3f} m², on {sheet.width_mm:g} mm sheets")
    print(f"{'method':24}{'sheets':>7}{'used':>7}{'to end':>8}{'seconds':>9}", flush=True)

    def row(method: str, count: int | None, seconds: float, fill: float = math.nan) -> None:
        used = area / (count * usable[0] * usable[1]) if count else math.nan
        print(f"{method:24}{count or 'none':>7}{used:7.2f}{fill:8.2f}{seconds:9.1f}", flush=True)

    row("area bound", math.ceil(inflated / ((usable[0] + gap) * (usable[1] + gap))), 0.0)
    start = time.process_time()
    count = peers["sheets_by_rectpack"](pieces, usable, gap)
    row("rectpack, best of 5", count, time.process_time() - start)
    start = time.process_time()
    row("plain raster greedy", peers["sheets_by_raster"](pieces, usable, gap)[0],
        time.process_time() - start)  # fmt: skip
    seconds = 0.0
    for effort in efforts:
        start, wall = time.process_time(), time.perf_counter()
        layout = nest(pieces, [sheet], margin_mm=MARGIN, gap_mm=gap, effort=effort)
        spent, seconds = time.process_time() - start, time.perf_counter() - wall
        faults = check_layout(layout, pieces)
        if faults:
            raise SystemExit("\n".join(faults))
        row(f"fabweave {effort}", len(layout.sheets), spent, fill_of(layout, pieces))
    if engine_is_there():
        row("spyrrow, equal time", peers["sheets_by_spyrrow"](pieces, usable, gap, seconds),
            seconds)  # fmt: skip


def main() -> None:
    """Print a table for each set of pieces."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", nargs="+", default=["quick", "normal"])
    parser.add_argument("--set", nargs="+", default=["strips", "jobs"])
    parser.add_argument("--job", nargs="+", default=list(JOBS))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    sets = runpy.run_path(str(HERE.parents[1] / "sheet" / "pieces_set.py"))
    for name in options.set:
        if name in ("strips", "thin"):
            make = sets["measured_set" if name == "strips" else "thin_set"]
            compare(name, make(seed=options.seed), SHEETS[0], 3.0, options.effort)
        elif name == "jobs":
            for job in options.job:
                if not JOBS[job].mesh.startswith("shape:") and not Path(JOBS[job].mesh).exists():
                    print(f"\n{job}: {JOBS[job].mesh} is not there")
                    continue
                made = make_job(JOBS[job]).made
                pieces = [np.asarray(piece.outline) for piece in made.pieces]
                for sheet in SHEETS:
                    compare(job, pieces, sheet, 2.0, options.effort)
        elif name == "many":
            for count in (500, 5000):
                pieces = [0.5 * piece for piece in sets["measured_set"](count, seed=options.seed)]
                start = time.process_time()
                layout = nest(pieces, [SHEETS[0]], margin_mm=MARGIN, gap_mm=2.0, effort="quick")
                peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
                print(f"{count} pieces: {len(layout.sheets)} sheets, utilisation to the end "
                      f"{fill_of(layout, pieces):.3f}, {time.process_time() - start:.0f} s, "
                      f"{peak:.2f} GB", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
