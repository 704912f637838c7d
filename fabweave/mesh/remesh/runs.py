"""Run a remesher a few times, and take the result with the fewest irregular vertices."""

import os
import threading
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager

import numpy as np

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.core.parallel.executors import SignalSafeExecutor, result_of
from fabweave.core.parallel.interrupt import held_back
from fabweave.mesh.check import check_mesh
from fabweave.mesh.irregular import find_irregular
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import (
    AttemptFailedError,
    Engine,
    LimitReachedError,
    Run,
    run_engine,
)
from fabweave.mesh.remesh.remesh_check import Fit, check_remeshed

#: Runs compared for tasks up to so many quads; by counts, not by time, so that results are the
#: same on every machine.
_RUNS = ((3000, 4), (8000, 2))
#: Tasks with more triangles than this have one run.
_LARGE = 200_000
#: By how much the count changes from run to run where there are no seeds.
_SPREAD = 0.04
#: A result with more or fewer quads than wanted by this factor is rejected.
_FAR = 3.0
#: Runs at the same time.
_AT_ONCE = 2


@frozen_value
class Candidate:
    """A result that passed the check, and the run that gave it."""

    engine: Engine
    mesh: PolyMesh
    run: Run
    fit: Fit

    @property
    def note(self) -> str:
        """What was made, and how far it is off."""
        seed = f", seed {self.run.seed}" if self.engine.seeded else ""
        return (
            f"{self.engine.title} made {self.mesh.n_faces} quads ({self.run.n_faces} were wanted"
            f"{seed}); they are up to {self.fit.off_max:.2g} mm off the given surface, and given "
            f"vertices are up to {self.fit.lost_max:.2g} mm off them"
        )


def best_run(
    engine: Engine,
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
) -> tuple[Candidate | None, list[str]]:
    """Run a remesher a few times and take the result with the fewest irregular vertices.

    On an open mesh new edges must follow the boundary, unless no such run passes the check.

    Parameters
    ----------
    engine : Engine
        The remesher.
    source, surface : PolyMesh
        The given surface, and its triangles.
    wanted : int
        About how many quads.
    seed : int
        The first seed; following runs take the following ones.
    progress : callable
        Told about each run.

    Returns
    -------
    best : Candidate or None
        Among equals, the one nearest to the wanted number of quads, and the first of those.
    failures : list of str
        Why the runs that gave nothing failed.
    """
    report = check_mesh(source)
    # Around a closed surface the differences from four edges sum to four times its Euler
    # characteristic: where each is one, there is no result with fewer.
    enough = 4 * abs(report.euler) if report.closed else 0
    large = surface.n_faces > _LARGE
    failures: list[str] = []
    hung: list[str] = []
    for rim in (False,) if report.closed else (True, False):
        good: list[tuple[tuple[int, int], Candidate]] = []
        runs = _runs(engine, wanted, seed, rim=rim, large=large)
        with _started(engine, surface, runs) as results:
            for number, run in enumerate(runs):
                progress(f"remeshing with {engine.title}", number, len(runs))
                try:
                    result = _without_loose_vertices(result_of(results[number]))
                except LimitReachedError as error:
                    hung.append(str(error))
                    continue
                except AttemptFailedError as error:
                    failures.append(str(error))
                    continue
                fit = check_remeshed(source, result)
                faults = fit.faults + _count_faults(result.n_faces, wanted)
                if faults:
                    failures.append("; ".join(faults))
                    continue
                irregular = len(find_irregular(result))
                candidate = Candidate(engine, result, run, fit)
                good.append(((irregular, abs(result.n_faces - wanted)), candidate))
                if irregular <= enough:
                    break
        progress(f"remeshing with {engine.title}", len(runs), len(runs))
        if good:
            best = min(good, key=lambda item: item[0])[1]
            return best, _summed_up(engine, hung) + _summed_up(engine, failures)
    return None, _summed_up(engine, hung) + _summed_up(engine, failures)


@contextmanager
def _started(
    engine: Engine, surface: PolyMesh, runs: list[Run]
) -> Iterator[list[Future[PolyMesh]]]:
    """Start runs of a remesher, two at a time; none is left running when the block ends."""
    stop = threading.Event()
    pool = SignalSafeExecutor(ThreadPoolExecutor(max_workers=min(_AT_ONCE, os.cpu_count() or 1)))
    try:
        yield [pool.submit(run_engine, engine, surface, run, stop) for run in runs]
    finally:
        with held_back():
            stop.set()
        pool.shutdown(wait=True, cancel_futures=True)


def _summed_up(engine: Engine, failures: list[str]) -> list[str]:
    """Say in one line why several runs failed; where reasons differ, the shortest one."""
    if not failures:
        return []
    runs = f", {len(failures)} runs" if len(failures) > 1 else ""
    differ = "; other runs failed for other reasons" if len(set(failures)) > 1 else ""
    return [f"{engine.title}{runs}: {min(failures, key=len)}{differ}"]


def _count_faults(made: int, wanted: int) -> tuple[str, ...]:
    """Say if there are far more or far fewer quads than wanted."""
    far = not wanted / _FAR <= made <= wanted * _FAR
    return (f"{made} quads, far from the {wanted} wanted",) if far else ()


def _runs(engine: Engine, wanted: int, seed: int, *, rim: bool, large: bool) -> list[Run]:
    """Return the runs to compare."""
    number = 1 if large else next((runs for most, runs in _RUNS if wanted <= most), 1)
    runs = []
    for k in range(min(number, engine.most_runs)):
        # 0, +1, -1, +2 times the spread
        share = 1 + _SPREAD * ((k + 1) // 2) * (1 if k % 2 else -1)
        aim = wanted if engine.seeded else round(wanted * share)
        runs.append(Run(aim, seed + k, rim=rim))
    return runs


def _without_loose_vertices(mesh: PolyMesh) -> PolyMesh:
    """Drop vertices that no face uses; leave a mesh with wrong indices to the check."""
    if mesh.indices.min() < 0 or mesh.indices.max() >= mesh.n_vertices:
        return mesh
    used, indices = np.unique(mesh.indices, return_inverse=True)
    return PolyMesh(mesh.vertices[used], mesh.offsets, indices.reshape(-1))
