"""Compare nesting with two other ways and the area bound; run by hand.

    python tests/benchmarks/bench_nesting.py [--effort quick normal] [--set strips jobs]

``jobs`` are the pieces of five jobs on two sizes of sheets, gap 2 mm, at normal effort; ``strips``
is a generated set (sheets 600 × 400 mm, margin 10 mm, gap 3 mm), at all efforts.
Peers: rectpack on bounding rectangles;
spyrrow, one sheet after another, in the time of normal effort, or else of the last. The bound
counts every piece inflated by half the gap, which no layout can beat. A fraction of sheets
counts the last one up to where it is used; the rest of it is an offcut. Seconds are of the
processor: other work does not count.
"""

import argparse
import importlib.util
import resource
import runpy
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from fabweave.core.arrays import FloatArray
from fabweave.job.run import draw_stations
from fabweave.job.stations import Stations
from fabweave.nest.layout import Layout
from fabweave.nest.nesting import nest
from fabweave.options.settings import Settings
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.sheet_size import SheetSize

HERE = Path(__file__)
ROOT = HERE.resolve().parents[2]
MARGIN = 10.0
JOBS = {
    "torus 24x12": Settings.of("shape:torus?m=24&n=12", size_mm=400.0),
    "lampshade": Settings.of(
        str(ROOT / "examples" / "lampshade.obj"), size_mm=300.0, pattern="twill"
    ),
    "koala": Settings.of(
        str(ROOT / "examples" / "meshes" / "koala.obj"), size_mm=400.0, remesh="quads:350"
    ),
    "slit genus 3": Settings.of("shape:slit?genus=3", size_mm=400.0),
    "veneer torus": Settings.of("shape:torus?m=16&n=8", size_mm=800.0, material="birch-veneer"),
}
#: Sheets that three hundred strips may take at each effort, and seconds at quick.
WANTED, WANTED_SECONDS = {"quick": 16, "normal": 15, "best": 14}, 20.0
SHEETS = (SheetSize(600.0, 400.0), SheetSize(1000.0, 600.0))


@dataclass(frozen=True)
class Result:
    """What one way came to: sheets as a fraction, and seconds of the processor.

    A way that has no place for a piece takes infinitely many.
    """

    sheets: float
    seconds: float

    @property
    def count(self) -> float:
        """Whole sheets."""
        return float(np.ceil(round(self.sheets, 9)))


def seconds() -> float:
    """Return the time of the processor, of this process and of those it has started and ended."""
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in spent)


def timed(way: Callable[[], float]) -> Result:
    """Do something that returns a number of sheets."""
    start = seconds()
    sheets = way()
    return Result(sheets, seconds() - start)


def sheets_of(layout: Layout, pieces: list[FloatArray]) -> float:
    """Return how many sheets a layout fills, the last one up to where it is used; checked."""
    faults = check_layout(layout, pieces)
    if faults:
        raise SystemExit("\n".join(faults))
    last = len(layout.sheets) - 1
    ends = [p.apply(pieces[p.piece])[:, 0].max() for p in layout.placements if p.sheet == last]
    return last + (max(ends) - MARGIN) / (layout.sheets[last].width_mm - 2 * MARGIN)


def fill_of_rectangles(pieces: list[FloatArray]) -> float:
    """Return the share of their least rectangles that pieces fill."""
    polygons = shapely.polygons([shapely.linearrings(piece) for piece in pieces])
    boxes = [shapely.minimum_rotated_rectangle(polygon).area for polygon in polygons]
    return float(shapely.area(polygons).sum() / sum(boxes))


def compare(
    name: str,
    pieces: list[FloatArray],
    sheet: SheetSize,
    gap: float,
    efforts: list[str],
    seed: int = 0,
) -> dict[str, Result]:
    """Print one table and return what is in it."""
    peers = runpy.run_path(str(HERE.with_name("nesting_peers.py")))
    usable = (sheet.width_mm - 2 * MARGIN, sheet.height_mm - 2 * MARGIN)
    area = sum(shapely.polygons(piece).area for piece in pieces)
    grown = sum(shapely.polygons(piece).buffer(gap / 2).area for piece in pieces)
    share = fill_of_rectangles(pieces)
    print(f"\n{name}: {len(pieces)} pieces, {area / 1e6:.3f} m², {share:.2f} of their rectangles, "
          f"on sheets of {sheet.width_mm:g} × {sheet.height_mm:g} mm")  # fmt: skip
    print(f"{'way':24}{'sheets':>7}{'used':>7}{'to its end':>12}{'used':>7}{'seconds':>9}")
    found: dict[str, Result] = {}

    def row(way: str, result: Result) -> None:
        found[way] = result
        whole, whole_used = f"{result.count:7.0f}", area / (result.count * usable[0] * usable[1])
        used = area / (result.sheets * usable[0] * usable[1])
        print(f"{way:24}{whole}{whole_used:7.2f}{result.sheets:12.2f}{used:7.2f}"
              f"{result.seconds:9.1f}", flush=True)  # fmt: skip

    row("area bound", Result(grown / ((usable[0] + gap) * (usable[1] + gap)), 0.0))
    row("rectpack", timed(lambda: peers["sheets_by_rectpack"](pieces, usable, gap)))
    walls: dict[str, float] = {}
    for effort in efforts:
        start = time.perf_counter()
        row(effort, timed(lambda effort=effort: sheets_of(nest(
            pieces, [sheet], margin_mm=MARGIN, gap_mm=gap, effort=effort, seed=seed), pieces
        )))  # fmt: skip
        walls[effort] = time.perf_counter() - start
    if importlib.util.find_spec("spyrrow") is not None:
        wall = walls.get("normal", walls[efforts[-1]])
        row("spyrrow", timed(lambda: peers["sheets_by_spyrrow"](pieces, usable, gap, wall)))
    return found


def compare_jobs(names: list[str], efforts: list[str]) -> None:
    """Print a table for each job and size of sheets, and then what does not hold."""
    against_spyrrow: list[float] = []
    for name in names:
        made = draw_stations(Stations(JOBS[name]))
        pieces = [np.asarray(piece.outline) for piece in made.piece_set.pieces]
        bent = fill_of_rectangles(pieces) < 0.5
        for sheet in SHEETS:
            found = compare(name, pieces, sheet, 2.0, efforts)
            ours = found[efforts[-1]]
            peers = [way for way in ("rectpack", "spyrrow") if way in found]
            for way in peers:
                if ours.count > found[way].count:
                    print(f"DOES NOT HOLD: {ours.count} sheets, {way} {found[way].count}")
            ratio, wanted = found["rectpack"].sheets / ours.sheets, 1.4 if bent else 1.0
            verdict = "" if ratio > wanted else f"; DOES NOT HOLD: {wanted} is wanted"
            print(f"{ratio:.2f} x the utilisation of rectpack{verdict}")
            if "spyrrow" in found:
                against_spyrrow.append(found["spyrrow"].sheets / ours.sheets)
    if against_spyrrow:
        mean = float(np.exp(np.log(against_spyrrow).mean()))
        verdict = "" if mean >= 1.1 else "; DOES NOT HOLD: 1.1 is wanted"
        print(f"\n{mean:.3f} x the utilisation of spyrrow, geometric mean{verdict}")


def compare_strips(pieces: list[FloatArray], efforts: list[str], seed: int) -> None:
    """Print a table, and then what does not hold."""
    found = compare("strips", pieces, SHEETS[0], 3.0, efforts, seed)
    for effort in efforts:
        if found[effort].count > WANTED[effort]:
            print(f"DOES NOT HOLD: {found[effort].count} sheets, {effort} {WANTED[effort]}")
    if "quick" in found and found["quick"].seconds > WANTED_SECONDS:
        print(f"DOES NOT HOLD: quick takes {WANTED_SECONDS:g} s or less")


def main() -> None:
    """Print a table for each set of pieces."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--effort", nargs="+", default=[])
    parser.add_argument("--set", nargs="+", default=["strips", "jobs"])
    parser.add_argument("--job", nargs="+", default=list(JOBS))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    efforts = options.effort
    sets = runpy.run_path(str(HERE.parents[1] / "support" / "pieces_set.py"))
    for name in options.set:
        if name == "strips":
            compare_strips(
                sets["measured_set"](seed=options.seed), efforts or list(WANTED), options.seed
            )
        elif name == "jobs":
            compare_jobs(options.job, efforts or ["normal"])
        else:
            parser.error(f"no set is called {name}")


if __name__ == "__main__":
    main()
