"""Compare planning the order of assembly with how an older commit does it; run by hand.

    python tests/benchmarks/bench_order.py [--against 81a05753] [--job koala ...] [--seeds 6]

Both plan the same pieces in the same run, in turn, each in a process of its own. Prints seconds of
the processor and their ratio, and of each order the effort, how many pieces lie loose, summed over
all steps, and how many clips hold them; means over seeds.
"""

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve()
ROOT = HERE.parents[2]
#: The commit before orders were annealed many at once.
BEFORE = "81a05753"
EXAMPLES = ROOT / "examples"
FOUND = {"size": "400mm", "remesh": "quads:350"}
SHORT = {"pattern": "twill", "max_length": "300mm"}
JOBS: dict[str, tuple[str, dict[str, str]]] = {
    "torus demo": ("shape:torus?m=24&n=12", {"size": "400mm", "pattern": "twill"}),
    "ball": ("shape:sphere?n=6", {"size": "400mm"}),
    "straight ball": ("shape:sphere?n=6", {"size": "400mm", "strips": "straight"}),
    "lampshade": (
        str(EXAMPLES / "lampshade.obj"),
        {"size": "300mm", "pattern": "twill", "effort": "quick"},
    ),
    "koala": (str(EXAMPLES / "meshes" / "koala.obj"), FOUND),
    "spot": (str(EXAMPLES / "meshes" / "spot.obj"), FOUND),
    "torus, 650 pieces": ("shape:torus?m=50&n=26", {"size": "1000mm", **SHORT}),
    "torus, 2304 pieces": ("shape:torus?m=96&n=50", {"size": "1900mm", **SHORT}),
}

#: What each process does, with the package that it finds: plan a job's order, once a seed.
_PLAN = """
import pickle, sys, time
from fabweave.plan.loose import find_clips, find_holds
from fabweave.plan.order import plan_order
with open(sys.argv[1], "rb") as file:
    pieces, options, fastened = pickle.load(file)
rows = []
for seed in range(int(sys.argv[2])):
    start = time.process_time()
    order = plan_order(pieces, seed=seed, **options)
    seconds = time.process_time() - start
    clips = find_clips(pieces, find_holds(pieces, fastened), order.order.tolist(), to_the_end=False)
    rows.append((seconds, order.total, float(order.loose.sum()), len(clips)))
print(repr(rows))
"""


def save_pieces(mesh: str, options: dict[str, str], file: Path) -> int:
    """Save the pieces of a job, and what else its order is planned from; return their number."""
    from fabweave.job.stations import Stations  # noqa: PLC0415 -- the other tree does without

    planned = Stations.read(mesh, {"sheet": "600x400mm", **options}).planned
    woven, pieces = planned.woven, planned.piece_set
    given: dict[str, Any] = {
        "centres": np.array(woven.ribbons.centre),
        "normals": np.array(woven.ribbons.normal),
        "fastened": np.array(pieces.fastened),
        "enclosed": bool(np.all(woven.halfedges.twin >= 0)),
        "effort": planned.settings.search.effort,
    }
    file.write_bytes(pickle.dumps((pieces.pieces, given, given["fastened"])))
    return len(pieces.pieces)


def planned_by(tree: Path, file: Path, seeds: int) -> np.ndarray:
    """Return the mean seconds, effort, loose pieces and clips, with the package of a tree."""
    told = subprocess.run(
        [sys.executable, "-c", _PLAN, str(file), str(seeds)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree), "OMP_NUM_THREADS": "1"},
    ).stdout
    rows: list[tuple[float, ...]] = eval(told)  # noqa: S307 -- written above
    return np.mean(rows, axis=0)


def main() -> None:
    """Print two lines for each job, and the ratio of seconds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--against", default=BEFORE)
    parser.add_argument("--job", nargs="+", default=list(JOBS), choices=list(JOBS))
    parser.add_argument("--seeds", type=int, default=6)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        older, file = Path(folder) / "older", Path(folder) / "pieces"
        older.mkdir()
        packed = subprocess.run(
            ["git", "archive", options.against, "fabweave"],  # noqa: S607
            cwd=ROOT,
            capture_output=True,
            check=False,
        )
        if packed.returncode:
            print(f"no order to compare with: the commit {options.against} is not there")
            return
        subprocess.run(["tar", "x"], cwd=older, input=packed.stdout, check=True)  # noqa: S607
        print(f"{'job':24}{'pieces':>7}{'':>8}{'CPU s':>8}{'effort':>10}{'loose':>9}{'clips':>8}")
        for name in options.job:
            count = save_pieces(*JOBS[name], file)
            before, after = (planned_by(tree, file, options.seeds) for tree in (older, ROOT))
            for what, row in (("before", before), ("after", after)):
                print(f"{name:24}{count:7}  {what:6}{row[0]:8.2f}{row[1]:10.1f}{row[2]:9.1f}"
                      f"{row[3]:8.1f}")  # fmt: skip
            print(f"{'':39}{after[0] / before[0]:8.2f}{after[1] / before[1]:10.2f}"
                  f"{after[2] / max(before[2], 1):9.2f}{after[3] / max(before[3], 1):8.2f}",
                  flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
