"""Show where ribbons keep clear of one another, at 400 mm and at the size proposed, and how fast.

Run by hand: ``python tests/benchmarks/bench_ribbons.py [mesh ...]``. Every good shared mesh is
laid at 400 mm in card as a job lays it; then again at the size that the findings propose. Prints
pairs that are too near, pairs of facets that libigl finds to run through one another, seconds of
processor time, and which rules do not hold at the size proposed. With ``--large`` it lays and
checks a torus of 102,400 crossings instead, and prints the most memory that was used.
"""

import sys
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from time import process_time

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests"))

from clear_ribbons import laid  # noqa: E402 - found beside the tests
from meshes_shared import FOLDER, known_meshes  # noqa: E402 - found beside the tests

from fabweave.app.joined_object import check_joined  # noqa: E402 - after the path is set
from fabweave.app.request import complete_settings  # noqa: E402 - after the path is set
from fabweave.app.settings import Settings  # noqa: E402 - after the path is set
from fabweave.app.woven_object import keep_clear, weave_object  # noqa: E402 - as above
from fabweave.mesh.intersections import self_intersections  # noqa: E402 - after the path is set
from fabweave.mesh.io.files import read_mesh  # noqa: E402 - after the path is set

SIZE_MM = 400.0


def timed(mesh: str, size_mm: float) -> tuple[float, int]:
    """Return the processor time of ribbons and checks, and the number of crossings."""
    settings, supplies = complete_settings(Settings(mesh=mesh, size_mm=size_mm))
    woven = weave_object(settings, supplies)
    start = process_time()
    laps = np.arange(0, woven.weave.threads.n_crossings, 12)
    woven = keep_clear(woven, settings, supplies, laps)
    check_joined(woven, settings, supplies, None)
    return process_time() - start, woven.weave.threads.n_crossings


def show(name: str) -> None:
    """Print one row."""
    mesh = str(FOLDER / name)
    before = laid(mesh, SIZE_MM)
    seconds, crossings = timed(mesh, SIZE_MM)
    row = f"{name:36}{crossings:7}{before.n_near:7}{before.n_through:8}{seconds:8.1f}"
    size = before.check.smallest_mm
    if before.n_near and len(self_intersections(read_mesh(mesh).mesh)):
        row += "   the mesh runs through itself"
    elif before.n_near and size is not None:
        after = laid(mesh, float(size))
        rules = ", ".join(sorted({found.rule for found in after.check.findings}))
        row += f"{size:8}{after.n_near:7}{after.n_through:8}  {rules or 'all rules hold'}"
    print(row, flush=True)


def main() -> None:
    """Print the table."""
    if sys.argv[1:] == ["--large"]:
        seconds, crossings = timed("shape:torus?m=320&n=160", 20_000.0)
        peak = getrusage(RUSAGE_SELF).ru_maxrss / 2**20
        print(f"{crossings} crossings: {seconds:.1f} s, {peak:.2f} GiB at most")
        return
    print(f"{'at 400 mm in card':36}{'cross.':>7}{'near':>7}{'through':>8}{'CPU s':>8}", end="")
    print(f"{'size':>8}{'near':>7}{'through':>8}")
    for name in sys.argv[1:] or [mesh.name for mesh in known_meshes() if not mesh.bad]:
        show(name)


if __name__ == "__main__":
    main()
