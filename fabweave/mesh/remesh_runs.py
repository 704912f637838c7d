"""Run a remesher a few times, and take the result with the fewest irregular vertices."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from fabweave.arrays import Progress, no_progress
from fabweave.mesh.check import check_mesh
from fabweave.mesh.irregular import find_irregular
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh_check import Fit, check_remeshed
from fabweave.mesh.remesh_engines import AttemptFailedError, Engine, Run, run_engine

#: Runs compared for tasks up to so many quads; by counts, not by time, so that results are the
#: same on every machine.
_RUNS = ((3000, 4), (8000, 2))
#: Tasks with more triangles than this have one run.
_LARGE = 200_000
#: By how much the count changes from run to run where there are no seeds.
_SPREAD = 0.04


@dataclass(frozen=True, eq=False)
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
            f"{self.engine.title} made {self.mesh.n_faces} quads (aim {self.run.n_quads}{seed}); "
            f"they are up to {self.fit.off_max:.2g} mm off the given surface, and given vertices "
            f"up to {self.fit.lost_max:.2g} mm off them"
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

    On an open mesh new edges are to follow the boundary; only if no such run passes the check
    they need not.

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
        Of equals the one nearest to the wanted number of quads, and the first of those.
    failures : list of str
        What the runs that gave nothing failed of.
    """
    failures: list[str] = []
    for rim in (False,) if check_mesh(source).closed else (True, False):
        good: list[tuple[tuple[int, int], Candidate]] = []
        runs = _runs(engine, wanted, seed, rim=rim, large=surface.n_faces > _LARGE)
        for number, run in enumerate(runs):
            progress(f"remeshing with {engine.title}", number, len(runs))
            found = _attempt(engine, source, surface, run)
            if isinstance(found, str):
                failures.append(found)
                continue
            irregular = len(find_irregular(found.mesh))
            good.append(((irregular, abs(found.mesh.n_faces - wanted)), found))
        progress(f"remeshing with {engine.title}", len(runs), len(runs))
        if good:
            return min(good, key=lambda item: item[0])[1], _summed_up(engine, failures)
    return None, _summed_up(engine, failures)


def _summed_up(engine: Engine, failures: list[str]) -> list[str]:
    """Say once what several runs failed of."""
    return [
        f"{engine.title}" + (f", {runs} runs" if runs > 1 else "") + f": {reason}"
        for reason, runs in Counter(failures).items()
    ]


def _attempt(engine: Engine, source: PolyMesh, surface: PolyMesh, run: Run) -> Candidate | str:
    """Run a remesher once; return the checked result, or what was wrong with it."""
    try:
        made = run_engine(engine, surface, run)
    except AttemptFailedError as error:
        return str(error)
    result = _without_loose_vertices(made)
    fit = check_remeshed(source, result)
    return "; ".join(fit.faults) if fit.faults else Candidate(engine, result, run, fit)


def _runs(engine: Engine, wanted: int, seed: int, *, rim: bool, large: bool) -> list[Run]:
    """Return the runs to compare."""
    number = 1 if large else next((runs for most, runs in _RUNS if wanted <= most), 1)
    runs = []
    for k in range(number):
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
