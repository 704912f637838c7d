"""Time half-edges, check, threads, subdivision on tori of 10k, 100k and 1M edges; run by hand.

Each size runs in a process of its own, so that the peak memory is its own. The ratio is against
a bound measured in the same run: one stable sort of as many 64-bit keys as there are half-edges,
which any construction of twins by sorting needs.
"""

import multiprocessing
import resource
import time
from collections.abc import Callable

import numpy as np

from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.subdivide.catmull_clark import catmull_clark
from fabweave.weave.threads import trace_threads

SIDES = {"10k": (100, 50), "100k": (500, 100), "1M": (1000, 500)}


def seconds(action: Callable[[], object]) -> float:
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def measure(sides: tuple[int, int]) -> tuple[int, dict[str, float], float]:
    """Return edges, the times of the stations, and the peak memory in MB."""
    mesh = parse_shape(f"shape:torus?m={sides[0]}&n={sides[1]}")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    times: dict[str, float] = {}
    times["half-edges"] = seconds(lambda: build_halfedges(mesh))
    halfedges = build_halfedges(mesh)
    times["check"] = seconds(lambda: check_mesh(mesh))
    times["threads"] = seconds(lambda: trace_threads(halfedges))
    times["catmull-clark"] = seconds(lambda: catmull_clark(mesh))
    keys = np.random.default_rng(0).integers(0, 2**40, halfedges.n_halfedges)
    times["one sort"] = seconds(lambda: np.sort(keys, kind="stable"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return halfedges.n_edges, times, max(peak, before) / 1024


def main() -> None:
    """Print one row for each size."""
    print(f"{'edges':>9} {'half-edges':>11} {'check':>8} {'threads':>8} {'sum s':>8} "
          f"{'one sort':>9} {'ratio':>6} {'catmull-clark':>14} {'peak MB':>8}")  # fmt: skip
    context = multiprocessing.get_context("spawn")
    for sides in SIDES.values():
        with context.Pool(1) as pool:
            edges, times, peak = pool.apply(measure, (sides,))
        total = times["half-edges"] + times["check"] + times["threads"]
        print(
            f"{edges:>9} {times['half-edges']:>11.3f} {times['check']:>8.3f} "
            f"{times['threads']:>8.3f} {total:>8.3f} {times['one sort']:>9.3f} "
            f"{total / times['one sort']:>6.1f} {times['catmull-clark']:>14.3f} {peak:>8.0f}"
        )


if __name__ == "__main__":
    main()
