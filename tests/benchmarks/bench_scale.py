"""Show how time and memory grow with the number of crossings; run by hand.

    python tests/benchmarks/bench_scale.py [--all]

Makes and proves a torus in plain weave of about 1,000 and 10,000 crossings, and with ``--all`` of
100,000, each in a process of its own, at quick effort and with ribbons of the same width. Prints
seconds of the processor and the peak of memory for each crossing, and how that compares with the
smallest: 1 is linear.
"""

import argparse
import multiprocessing
import resource
import tempfile
import time
from pathlib import Path

from fabweave.job.run import draw_stations
from fabweave.job.stations import Stations
from fabweave.job.write import write_plan
from fabweave.options.settings import Settings
from fabweave.verify.proof import verify_job

#: Quads around the ring and around the tube; each quad has two crossings.
SIZES = ((32, 16), (100, 50), (400, 125))
_QUAD_MM = 19.0


def measured(m: int, n: int) -> tuple[int, int, float, float]:
    """Make and prove a job; return its crossings and sheets, its seconds, and its peak in MB."""
    empty = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    start = time.process_time()
    settings = Settings.of(f"shape:torus?m={m}&n={n}", size_mm=_QUAD_MM * m, effort="quick")
    with tempfile.TemporaryDirectory() as folder:
        job = draw_stations(Stations(settings))
        write_plan(job, Path(folder))
        if not verify_job(Path(folder)).ok:
            raise AssertionError("the job was not proved")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - empty
    crossings = job.weave.threads.n_crossings
    return crossings, len(job.drawings), time.process_time() - start, peak


def main() -> None:
    """Print one line for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--all", action="store_true", help="100,000 crossings, too")
    sizes = SIZES if parser.parse_args().all else SIZES[:2]
    first: tuple[float, float] | None = None
    print("crossings  sheets     CPU s    MB    ms and kB a crossing   times the smallest")
    for m, n in sizes:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            crossings, sheets, seconds, peak = pool.apply(measured, (m, n))
        each = 1000 * seconds / crossings, 1000 * peak / crossings
        first = first or each
        print(
            f"{crossings:9}  {sheets:6}  {seconds:8.1f}  {peak:5.0f}  {each[0]:9.2f}  "
            f"{each[1]:9.1f}  {each[0] / first[0]:8.2f}  {each[1] / first[1]:8.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
