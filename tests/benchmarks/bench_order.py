"""Compare assembly orders with naive ones, model by model; run by hand.

    python tests/benchmarks/bench_order.py [--effort quick normal best] [MODEL ...]

Effort 1 is a strand laid over another, see ``fabweave/assembly/effort.py``. "below" counts the
times that a piece slides below a strand in place, "last" is the mean effort of the last tenth of
the pieces against that of all. ``large`` is a torus of ten thousand pieces.
"""

import argparse
import runpy
import time
from pathlib import Path
from typing import Any

from fabweave.assembly.order.contacts import find_contacts
from fabweave.assembly.order.greedy import measure_order
from fabweave.assembly.order.planning import Order, order_by_number, plan_order
from fabweave.assembly.steps import build_steps, last_tenth

HERE = Path(__file__).resolve()
MESHES = HERE.parents[3] / "shared" / "meshes"
MODELS: dict[str, tuple[str, float, dict[str, Any]]] = {
    "torus": ("shape:torus?m=24&n=12", 400.0, {}),
    "slit": ("shape:slit?genus=3", 400.0, {}),
    "cube": ("shape:cube", 400.0, {"refine": "catmull-clark:3"}),
    "twill": ("shape:slit?genus=2", 400.0, {"pattern": "twill"}),
    "triaxial": ("shape:icosahedron", 400.0, {"pattern": "triaxial", "refine": "loop:2"}),
    "hypar": ("shape:hypar?m=16&n=16", 400.0, {}),
    "spot": (str(MESHES / "quad/spot_quadrangulated.obj"), 400.0, {}),
    "bob": (str(MESHES / "quad/bob_quad.obj"), 400.0, {}),
    "hexa": (str(MESHES / "ngon/hexaSphere.off"), 400.0, {}),
    "torus-twill": ("shape:torus?m=24&n=12", 400.0, {"pattern": "twill"}),
    "large": ("shape:torus?m=160&n=120", 6000.0, {}),
}


def main() -> None:
    """Print one line for each model and effort."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", default=[name for name in MODELS if name != "large"])
    parser.add_argument("--effort", nargs="+", default=["quick", "normal"])
    options = parser.parse_args()
    model_of = runpy.run_path(str(HERE.parents[1] / "support" / "assembly_models.py"))["model_of"]
    print(
        f"{'model':12}{'pieces':>7}{'steps':>7}  {'effort':8}{'by thread':>10}{'by number':>10}"
        f"{'ours':>9}{'saved':>7}{'below':>7}{'naive':>7}{'last':>6}{'naive':>7}{'seconds':>9}"
        f"{'cpu':>7}"
    )
    for name in options.models:
        mesh, size_mm, changed = MODELS[name]
        if mesh.startswith(str(MESHES)) and not Path(mesh).exists():
            print(f"{name}: the shared meshes are not there")
            continue
        model = model_of(mesh, size_mm, **changed)
        pieces = model.made.pieces
        contacts = find_contacts(pieces)
        naive = min(
            (
                measure_order(contacts, some, enclosed=model.enclosed)
                for some in (range(len(pieces)), order_by_number(pieces).tolist())
            ),
            key=lambda measured: measured.total,
        )
        naive_steps = build_steps(
            model.made, Order(naive.order, naive.effort, naive.total, naive.total)
        )
        for effort in options.effort:
            start, cpu = time.perf_counter(), time.process_time()
            order = plan_order(
                pieces, model.centres, model.normals, enclosed=model.enclosed, effort=effort, seed=0
            )
            seconds, cpu = time.perf_counter() - start, time.process_time() - cpu
            steps = build_steps(model.made, order)
            below = [sum(len(step.under) for step in some) for some in (steps, naive_steps)]
            mean = order.total / naive.total
            last = last_tenth(steps), last_tenth(naive_steps) / mean
            print(
                f"{name:12}{len(pieces):7}{len(steps):7}  {effort:8}{order.by_thread:10.0f}"
                f"{order.by_number:10.0f}{order.total:9.0f}{order.saved:7.1%}{below[0]:7}"
                f"{below[1]:7}{last[0]:6.1f}{last[1]:7.1f}{seconds:9.1f}{cpu:7.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
