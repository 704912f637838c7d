"""Compare assembly orders with naive ones, model by model; run by hand.

    python tests/benchmarks/bench_order.py [--effort quick normal best] [MODEL ...]

Effort 1 is a strand laid over another, see ``fabweave/assembly/effort.py``. "below" counts the
times that a piece slides below a strand in place, "last" is the mean effort of the last tenth of
the pieces against that of all. ``large`` is a torus of ten thousand pieces.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from fabweave.assembly.contacts import find_contacts
from fabweave.assembly.grow import measure_order
from fabweave.assembly.order import order_by_number, plan_order
from fabweave.assembly.steps import build_steps
from fabweave.flat.pieces import build_pieces
from fabweave.job import complete_settings, hole_rules, lay_ribbons, plan_runs, weave_object
from fabweave.settings import JobSettings

SPOT = Path(__file__).resolve().parents[3] / "shared" / "meshes" / "quad/spot_quadrangulated.obj"
MODELS = {
    "torus": JobSettings("shape:torus?m=24&n=12", size_mm=400.0),
    "slit": JobSettings("shape:slit?genus=3", size_mm=400.0),
    "cube": JobSettings("shape:cube", size_mm=400.0, refine="catmull-clark:3"),
    "twill": JobSettings("shape:slit?genus=2", size_mm=400.0, pattern="twill"),
    "triaxial": JobSettings(
        "shape:icosahedron", size_mm=400.0, pattern="triaxial", refine="loop:2"
    ),
    "hypar": JobSettings("shape:hypar?m=16&n=16", size_mm=400.0),
    "spot": JobSettings(str(SPOT), size_mm=400.0),
    "large": JobSettings("shape:torus?m=140&n=140", size_mm=6000.0),
}


def main() -> None:
    """Print one line for each model and effort."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=[name for name in MODELS if name != "large"])
    parser.add_argument("--effort", nargs="+", default=["quick", "normal"])
    options = parser.parse_args()
    print(
        f"{'model':10}{'pieces':>7}{'steps':>7}  {'effort':8}{'by thread':>10}{'by number':>10}"
        f"{'ours':>9}{'saved':>7}{'below':>7}{'naive':>7}{'last':>6}{'naive':>7}{'seconds':>9}"
    )
    for name in options.models:
        settings, material = complete_settings(MODELS[name])
        if name == "spot" and not SPOT.exists():
            print("spot: the shared meshes are not there")
            continue
        thing = weave_object(settings, material)
        runs = plan_runs(thing, settings)
        laps = runs.laps(thing.weave.threads)
        ribbons = lay_ribbons(thing.woven, thing.weave, settings, material, laps)
        rules = hole_rules(settings, material)
        made = build_pieces(ribbons, thing.weave, runs, thing.labels, rules)
        enclosed = bool(np.all(thing.woven.halfedges.twin >= 0))
        for effort in options.effort:
            start = time.perf_counter()
            order = plan_order(
                made.pieces, ribbons.centre, enclosed=enclosed, effort=effort, seed=0
            )
            seconds = time.perf_counter() - start
            steps = build_steps(made, order)
            contacts = find_contacts(made.pieces)
            naive = min(
                (
                    measure_order(contacts, pieces, enclosed=enclosed)
                    for pieces in (range(len(made.pieces)), order_by_number(made.pieces).tolist())
                ),
                key=lambda measured: measured.total,
            )
            naive_steps = build_steps(
                made, type(order)(naive.order, naive.effort, naive.total, naive.total)
            )
            below = [sum(len(step["under"]) for step in some) for some in (steps, naive_steps)]
            tenth = max(1, len(made.pieces) // 10)
            last = [
                one[-tenth:].mean() / order.effort.mean() for one in (order.effort, naive.effort)
            ]
            print(
                f"{name:10}{len(made.pieces):7}{len(steps):7}  {effort:8}{order.by_thread:10.0f}"
                f"{order.by_number:10.0f}{order.total:9.0f}{order.saved:7.1%}{below[0]:7}"
                f"{below[1]:7}{last[0]:6.1f}{last[1]:7.1f}{seconds:9.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
