"""Show what fairing does to waviness, to strips and to waste, on irregular meshes.

Run by hand: ``python tests/benchmarks/bench_fair.py``. Each mesh is woven at 400 mm in card, as it
is and faired; prints the mean turn of threads over a crossing, the width that 5 % of the portals
fall short of (of the median), what whole strips and pieces fill of their smallest rectangles, and
what the pieces fill of their sheets at quick effort.
"""

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import shapely

from fabweave.app.job import Job
from fabweave.app.mesh_source import load_mesh
from fabweave.app.pipeline import make_job
from fabweave.app.settings import Settings
from fabweave.core.errors import FabweaveError
from fabweave.mesh.fair.fairness import Fairness
from fabweave.stock.sheet_size import SheetSize

MESHES = Path(__file__).resolve().parents[2].parent / "shared" / "meshes"
CASES = (
    "quad/spot_quadrangulated.obj",
    "quad/bob_quad.obj",
    "ngon/hexaSphere.off",
    "open/mixedFaring.off",
    "open/tubemesh.off",
)
ITERATIONS = 50


def fill(job: Job) -> float:
    """Return the pieces' area over that of their smallest rectangles."""
    polygons = [shapely.Polygon(piece.outline) for piece in job.piece_set.pieces]
    boxes = shapely.area(shapely.oriented_envelope(polygons))
    return float(shapely.area(polygons).sum() / boxes.sum())


def utilisation(job: Job) -> float:
    """Return the pieces' area over that of the sheets."""
    area = sum(shapely.Polygon(piece.outline).area for piece in job.piece_set.pieces)
    return area / sum(sheet.width_mm * sheet.height_mm for sheet in job.layout.sheets)


def main() -> None:
    """Print the table."""
    print(
        f"{'mesh':32}{'fair':>6}{'turn':>8}{'spread':>8}{'pieces':>8}{'fill':>7}{'sheets':>8}"
        f"{'used':>7}{'holes':>7}{'s':>7}"
    )
    for name in CASES:
        if not (MESHES / name).exists():
            print(f"{name}: not there", file=sys.stderr)
            continue
        for fair in (0, ITERATIONS):
            settings = Settings(
                mesh=str(MESHES / name),
                size_mm=400.0,
                fair=fair,
                effort="quick",
                sheets=(SheetSize(600.0, 400.0),),
            )
            start = perf_counter()
            woven = load_mesh(settings)
            fairing = perf_counter() - start
            measure = Fairness(woven.mesh, woven.halfedges)
            turn = measure.turning_deg(woven.mesh.vertices).mean()
            widths = measure.widths(woven.mesh.vertices)
            spread = np.quantile(widths, 0.05) / np.median(widths)
            try:
                job = make_job(settings)
            except FabweaveError as error:
                print(f"{name:32}{fair:6}{turn:7.1f}°{spread:8.0%}  {error}")
                continue
            holes = np.mean([np.mean(~np.isnan(piece.hole_mm)) for piece in job.piece_set.pieces])
            print(
                f"{name:32}{fair:6}{turn:7.1f}°{spread:8.0%}{len(job.piece_set.pieces):8}"
                f"{fill(job):7.1%}{len(job.layout.sheets):8}{utilisation(job):7.1%}{holes:7.0%}"
                f"{fairing:7.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
