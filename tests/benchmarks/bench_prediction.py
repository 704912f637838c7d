"""Compare what is predicted of pieces, joints and sheets with what is made; run by hand.

    python tests/benchmarks/bench_prediction.py [NAME ...]

For each job: the pieces and joints that its choice predicts over those that it has; and the area of
sheet that is predicted over the one that is used, at quick effort, where of the last sheet only
what is left of the last piece's end counts.
"""

import argparse
from pathlib import Path

import numpy as np
import shapely

from fabweave.app.pipeline import make_job
from fabweave.app.settings import settings_from_options

SHARED = Path(__file__).resolve().parents[3] / "shared" / "meshes" / "quad"
SHEET = ["600x400mm"]
JOBS = {
    "torus": ("shape:torus?m=24&n=12", {"size": "400mm", "pattern": "twill"}),
    "torus 8": ("shape:torus?m=8&n=4", {"size": "400mm"}),
    "torus 16": ("shape:torus?m=16&n=8", {"size": "300mm"}),
    "cube": ("shape:cube", {"refine": "catmull-clark:2", "size": "300mm"}),
    "cube 3": ("shape:cube", {"refine": "catmull-clark:3", "size": "400mm"}),
    "icosahedron": ("shape:icosahedron", {"refine": "catmull-clark:1", "size": "300mm"}),
    "dodecahedron": ("shape:dodecahedron", {"refine": "catmull-clark:1", "size": "400mm"}),
    "triaxial": ("shape:icosahedron", {"refine": "loop:2", "pattern": "triaxial", "size": "400mm"}),
    "spot": (str(SHARED / "spot_quadrangulated.obj"), {"size": "500mm"}),
    "bob": (str(SHARED / "bob_quad.obj"), {"size": "400mm"}),
}


def used_mm2(job) -> float:
    """Return the area of sheets, of the last one only as far as pieces reach along one side."""
    areas = [sheet.area_mm2 for sheet in job.layout.sheets]
    placed = [
        shapely.Polygon(place.apply(job.piece_set.pieces[place.piece].outline))
        for place in job.layout.placements
        if place.sheet == len(areas) - 1
    ]
    low_x, low_y, high_x, high_y = shapely.total_bounds(placed)
    last, margin = job.layout.sheets[-1], job.settings.margin_mm
    share = min(
        (high_x - low_x + 2 * margin) / last.width_mm,
        (high_y - low_y + 2 * margin) / last.height_mm,
    )
    return sum(areas[:-1]) + share * areas[-1]


def compare(name: str) -> list[float]:
    """Print one row, and return predicted over made: pieces, joints, sheet area."""
    mesh, options = JOBS[name]
    settings = settings_from_options(mesh, sheet=SHEET, effort="quick", force=True, **options)
    job = make_job(settings)
    chosen = job.split_plan.chosen
    choice = next((c for c in job.split_plan.choices if c.length_mm == chosen.length_mm), chosen)
    made = len(job.piece_set.pieces), len(job.piece_set.joints)
    used = used_mm2(job)
    ratios = [choice.pieces / made[0], choice.joints / max(made[1], 1), choice.sheet_mm2 / used]
    print(
        f"{name:14}{choice.length_mm:7.0f}{choice.pieces:7}{made[0]:6}{choice.joints:7}{made[1]:6}"
        f"{choice.sheets:5}{len(job.layout.sheets):4}{ratios[2]:7.2f}",
        flush=True,
    )
    return [*ratios, choice.sheets / len(job.layout.sheets)]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    options = parser.parse_args()
    print(f"{'job':14}{'mm':>7}{'pieces':>13}{'joints':>13}{'sheets':>9}{'area':>7}")
    rows = []
    for name in options.names or JOBS:
        if JOBS[name][0].startswith("shape:") or Path(JOBS[name][0]).is_file():
            rows.append(compare(name))
    means = np.exp(np.log(rows).mean(axis=0))
    print("geometric means of predicted over made: " + ", ".join(f"{mean:.3f}" for mean in means))


if __name__ == "__main__":
    main()
