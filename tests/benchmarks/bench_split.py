"""Compare ways to cut threads into pieces; run by hand.

    python tests/benchmarks/bench_split.py [MODEL ...]

"fill" is the sum of the pieces' areas over the sum of their least rectangles; "sheet" the area of
sheet that they are predicted to take. Whole strips are not cut at all; "greedy" takes the longest
piece that is possible, again and again, from the first site of each thread; "ours" is the least
cost. All keep to one greatest length, the longer usable side of the sheet; "ours, as few" is the
least waste among all ways with the fewest joints that there can be. "ratio" is the fill over that
of greedy.
"""

import argparse
import runpy
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely

from fabweave.app.request import complete_settings
from fabweave.app.settings import Settings
from fabweave.app.woven_object import WovenObject, weave_object
from fabweave.core.arrays import IntArray
from fabweave.flat.outline import strip_outlines
from fabweave.flat.split.candidate_costs import Bed, Candidates, list_candidates, price_candidates
from fabweave.flat.split.preferences import sheet_area
from fabweave.flat.split.runs import Runs, unfold_runs
from fabweave.flat.split.shortest_path import cheapest_ring, cheapest_row
from fabweave.flat.split.splitting import choose_runs
from fabweave.flat.unfold.development import Strips, unfold_threads
from fabweave.mesh.io.files import write_mesh
from fabweave.nest.container import Container
from fabweave.nest.fits import fits_rectangle
from fabweave.nest.item_shape import shape_of
from fabweave.stock.sheet_size import SheetSize

SHEET, MARGIN, GAP = SheetSize(600.0, 400.0), 10.0, 2.0
USABLE = (580.0, 380.0)


BED = Bed(lambda outline: fits_rectangle(shape_of(outline)[0], Container(USABLE)), (USABLE,), GAP)
SHARED = Path(__file__).resolve().parents[3] / "shared" / "meshes"
#: Worth of a joint in crossings of ribbon, where joints are to be few.
DEAR = 1000.0


def models(folder: Path) -> dict[str, Settings]:
    """Return the models of the issue; those whose mesh is not there are left out."""
    twill = runpy.run_path(str(Path(__file__).with_name("bench_twill.py")))
    block = folder / "block.obj"
    write_mesh(block, twill["refined"](twill["block"](twill["TWO_HOLES"]), 2))
    base = Settings("shape:torus", sheets=(SHEET,), gap_mm=GAP, margin_mm=MARGIN)
    found = {
        "torus": replace(base, mesh="shape:torus?m=24&n=12", size_mm=400.0),
        "cube": replace(base, mesh="shape:cube", refine="catmull-clark:3", size_mm=400.0),
        "block": replace(base, mesh=str(block), size_mm=500.0),
        "spot": replace(base, mesh=str(SHARED / "quad" / "spot_quadrangulated.obj"), size_mm=600.0),
        "bob": replace(base, mesh=str(SHARED / "quad" / "bob_quad.obj"), size_mm=600.0),
    }
    return {
        name: one
        for name, one in found.items()
        if one.mesh.startswith("shape:") or Path(one.mesh).is_file()
    }


def greedy(found: Candidates, longest_mm: float) -> list[IntArray]:
    """Return the sites where pieces begin if each is as long as it can be."""
    cost = price_candidates(found, BED, longest_mm)
    reach = np.where(np.isfinite(cost), np.arange(1, cost.shape[1] + 1), 0).max(axis=1)
    cuts = []
    for thread in range(len(found.sites.closed)):
        own = found.sites.offsets[thread]
        count = int(found.sites.offsets[thread + 1] - own)
        end = count if found.sites.closed[thread] else count - 1
        begins, at = [], 0
        while at < end:
            begins.append(at)
            at += max(int(reach[own + at]), 1)
        cuts.append(np.array(begins or [0]))
    return cuts


def runs_of(found: Candidates, cuts: list[IntArray]) -> Runs:
    """Turn the sites where pieces begin into runs."""
    thread, first, last = [], [], []
    sites = found.sites
    for number, cut in enumerate(cuts):
        own = sites.position[sites.offsets[number] : sites.offsets[number + 1]]
        if not len(own):
            continue
        count, begin = int(sites.lengths[number]), own[cut]
        end = begin[0] + count if sites.closed[number] else count - 1
        thread.append(np.full(len(begin), number))
        first.append(begin)
        last.append(np.append(begin[1:], end))
    return Runs(np.concatenate(thread), np.concatenate(first), np.concatenate(last))


def dear(found: Candidates, longest_mm: float) -> list[IntArray]:
    """Return the cuts of least cost where a joint costs a great deal."""
    windows = found.windows
    cell = windows.area_mm2[windows.passes > 1].sum() / windows.passes[windows.passes > 1].sum()
    cost = price_candidates(found, BED, longest_mm) + DEAR * cell
    cuts = []
    for thread, ring in enumerate(found.sites.closed):
        own = slice(found.sites.offsets[thread], found.sites.offsets[thread + 1])
        _, cut = (cheapest_ring if ring else cheapest_row)(cost[own])
        cuts.append(cut)
    return cuts


def facts(strips: Strips) -> tuple[int, float, float]:
    """Return how many pieces there are, their fill and the predicted sheet area in m²."""
    polygons = [shapely.Polygon(one) for one in strip_outlines(strips) if len(one) > 2]
    area = np.array([strip.area for strip in polygons])
    rim = np.array([strip.length for strip in polygons])
    hull = shapely.area(shapely.convex_hull(polygons))
    box = shapely.area([shapely.minimum_rotated_rectangle(one) for one in polygons])
    sheet = float(sheet_area(area, rim, hull, area < 0, gap_mm=GAP, askew_mm2=0.0).sum()) / 1e6
    return len(polygons), float(area.sum() / box.sum()), sheet


def compare(name: str, settings: Settings) -> None:
    """Print one table row for each way."""
    completed, supplies = complete_settings(settings)
    woven: WovenObject = weave_object(completed, supplies)
    weave, ribbons = woven.weave, woven.ribbons
    longest = max(USABLE)
    every = np.arange(weave.threads.n_threads)
    found = list_candidates(ribbons, weave, BED, longest, every)
    whole = greedy(found, longest)
    start = time.process_time()
    ours = choose_runs(found, weave, BED, woven.labels, longest, longest, None)
    seconds = time.process_time() - start
    ways = {
        "greedy": unfold_runs(ribbons, runs_of(found, whole)),
        "ours, as few": unfold_runs(ribbons, runs_of(found, dear(found, longest))),
        f"ours ({seconds:.1f} s)": unfold_runs(ribbons, ours),
    }
    _, fill, _ = facts(unfold_threads(ribbons))
    print(f"\n{name}: {weave.threads.n_crossings} crossings; whole strips fill {fill:.3f}")
    print(f"  {'way':16}{'pieces':>7}{'fill':>7}{'ratio':>7}{'sheet, m²':>11}")
    base = 0.0
    for way, strips in ways.items():
        count, fill, sheet = facts(strips)
        base = base or fill
        print(f"  {way:16}{count:7}{fill:7.3f}{fill / base:7.2f}{sheet:11.3f}", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        known = models(Path(folder))
        for name in options.models or list(known):
            compare(name, known[name])


if __name__ == "__main__":
    main()
