"""Time whole jobs, station by station, with the peak memory after each; run by hand.

    python tests/benchmarks/bench_job.py [--effort quick] [MESH=SIZE ...]

Without arguments: built-in shapes, and spot from the shared meshes where they are. Letters are
placed by another process while pieces are nested, as on the command line; ``--workers 0`` does all
in one process. The last line compares everything but nesting with the whole.
"""

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

from fabweave.app.job_files import write_job
from fabweave.app.pipeline import make_job
from fabweave.app.settings import Settings
from fabweave.core.parallel.executors import side_workers
from fabweave.core.units import parse_length
from fabweave.verify import verify_job

SPOT = Path(__file__).resolve().parents[3] / "shared" / "meshes" / "quad/spot_quadrangulated.obj"
JOBS = ("shape:octahedron=300mm", "shape:torus?m=24&n=12=400mm", "shape:sphere?n=8=400mm")


class Stopwatch:
    """Sum the time between reports of progress under the station that was named before."""

    def __init__(self) -> None:
        """Start with nothing."""
        self.times: dict[str, float] = {}
        self.peaks: dict[str, float] = {}
        self._station = "start"
        self._since = time.perf_counter()

    def __call__(self, what: str, _done: int = 0, _total: int = 1) -> None:
        """Take the time of the station that ends here."""
        now = time.perf_counter()
        self.times[self._station] = self.times.get(self._station, 0.0) + now - self._since
        self.peaks[self._station] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        self._station, self._since = what.partition(":")[0], now


def main() -> None:
    """Print one table for each job."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("jobs", nargs="*", help="MESH=SIZE")
    parser.add_argument("--effort", default="quick")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    jobs = options.jobs or [*JOBS, *([f"{SPOT}=400mm"] if SPOT.exists() else [])]
    for job in jobs:
        mesh, _, size = job.rpartition("=")
        workers = options.workers
        watch = Stopwatch()
        settings = Settings(mesh=mesh, size_mm=parse_length(size), effort=options.effort)
        with side_workers(workers) as start, tempfile.TemporaryDirectory() as folder:
            made = make_job(settings, watch, start=start)
            write_job(made, Path(folder), watch, start=start)
            watch("verify")
            proof = verify_job(Path(folder))
            watch("end")
        total = sum(watch.times.values())
        rest = total - watch.times.get("nesting", 0.0)
        print(
            f"\n{Path(mesh).name} at {size}: {made.weave.threads.n_crossings} crossings, "
            f"{len(made.piece_set.pieces)} pieces, {len(made.layout.sheets)} sheets, "
            f"{'proved' if proof.ok else 'NOT PROVED'}"
        )
        for station, spent in watch.times.items():
            if station != "start":
                print(f"  {station:<10} {spent:8.2f} s   peak {watch.peaks[station]:6.0f} MB")
        print(f"  {'all':<10} {total:8.2f} s   without nesting {rest:.2f} s ({rest / total:.0%})")


if __name__ == "__main__":
    main()
