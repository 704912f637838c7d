"""Show how time and memory grow with the number of crossings; run by hand.

    python tests/benchmarks/bench_scale.py [SIZE ...]

Makes and proves a torus in plain weave of about 1,000, 4,600 and 20,000 crossings (100,000 is
SIZE 4), each in one process of its own, at quick effort and with ribbons of the same width. Prints
seconds of the processor and the peak of memory, and for each part of the work its seconds and the
exponent with which they grow from the size before: 1 is linear. The profiler's own seconds are
in all of them.
"""

import argparse
import cProfile
import math
import multiprocessing
import pstats
import resource
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings

#: Quads around the ring and around the tube; each quad has two crossings.
SIZES = ((32, 16), (72, 32), (144, 70), (320, 156))
_QUAD_MM = 19.0
#: The parts of the work: each with the functions that do it, not one within another.
PARTS = {
    "weave": ("weave_mesh",),
    "ribbons": ("lay_strips", "keep_clear", "check_joined"),
    "pieces": ("split_object", "joined_pieces"),
    "order": ("order_of",),
    "nest": ("nest_pieces",),
    "form": ("form_hold", "let_job_go"),
    "sheets": ("draw_sheets", "write_plan"),
    "proof": ("prove_plan",),
    "papers": ("start_pictures", "show_job"),
}


class Measured(NamedTuple):
    """What a job took: its crossings, seconds of the processor, memory, and seconds by part."""

    crossings: int
    seconds: float
    peak_mb: float
    parts: dict[str, float]


def measured(m: int, n: int) -> Measured:
    """Make and prove a job."""
    empty = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    settings = Settings.of(f"shape:torus?m={m}&n={n}", size_mm=_QUAD_MM * m, effort="quick")
    profile = cProfile.Profile(time.process_time)
    with tempfile.TemporaryDirectory() as folder:
        start = time.process_time()
        made = profile.runcall(run_job, Stations(settings), Path(folder) / "job")
        seconds = time.process_time() - start
    spent = dict.fromkeys(PARTS, 0.0)
    for (_, _, function), (_, _, _, total, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        for part, functions in PARTS.items():
            spent[part] += total if function in functions else 0.0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - empty
    rest = {"rest": seconds - sum(spent.values())}
    return Measured(made.job.weave.threads.n_crossings, seconds, peak, spent | rest)


def main() -> None:
    """Print a block for each size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("size", nargs="*", type=int, default=[1, 2, 3], help="1 to 4")
    before: Measured | None = None
    for size in parser.parse_args().size:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            now = pool.apply(measured, SIZES[size - 1])
        print(f"{now.crossings} crossings: {now.seconds:.1f} s, {now.peak_mb:.0f} MB", flush=True)
        for part, seconds in now.parts.items():
            line = f"  {part:8} {seconds:8.1f} s {seconds / now.seconds:5.0%}"
            if before is not None and min(seconds, before.parts[part]) > 0.0:
                times = now.crossings / before.crossings
                line += f"  n^{math.log(seconds / before.parts[part]) / math.log(times):.2f}"
            print(line, flush=True)
        before = now


if __name__ == "__main__":
    main()
