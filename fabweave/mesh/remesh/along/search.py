"""Lay quads along a direction: compare what remeshers make of grooved surfaces."""

import math
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace

from fabweave.core.arrays import Progress, frozen_value, no_progress
from fabweave.mesh.check import check_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.along.direction import Alignment, Direction, mean_turn_deg
from fabweave.mesh.remesh.along.grooves import (
    Groove,
    fine_enough,
    groove_spacing,
    grooved,
)
from fabweave.mesh.remesh.engines import AttemptFailedError, Engine, Run
from fabweave.mesh.remesh.fit import fit
from fabweave.mesh.remesh.model import Model, model_of
from fabweave.mesh.remesh.remesh_check import check_remeshed
from fabweave.mesh.remesh.runs import (
    LARGE,
    MUCH_ALIKE,
    Candidate,
    Task,
    as_near,
    candidate_of,
    count_faults,
    fitted_to,
    results_of,
    summed_up,
)
from fabweave.mesh.triangulate import surface_area

#: Grooves that are tried: on spot, bob and a sphere, along x and y, each was the best of some.
#: Instant Meshes makes holes of all but the gentlest.
_GENTLE = Groove(0.5, 1.0)
_GROOVES = (Groove(0.8, 1.0), Groove(0.8, 0.5), _GENTLE, Groove(1.2, 0.7))
#: Results with as many quads as wanted up to this factor are taken first.
_ABOUT = 1.3
#: Rounds of fitting in which edges turn.
_ROUNDS = 8
#: More quads than these are as fine as the grooves can be, and go their own ways between them.
_MOST_GROOVED = 2500
#: Results follow the direction as well as one another up to this difference, in degrees.
_ALIKE_DEG = 1.0


@frozen_value
class _Result:
    """A result, and how far its edges turn from the direction in the end, and before they turned.

    Parameters
    ----------
    candidate : Candidate
    on : PolyMesh
        What the remesher saw.
    turn_deg, plain_deg : float
    """

    candidate: Candidate
    on: PolyMesh
    turn_deg: float
    plain_deg: float


def best_along(
    engines: Sequence[Engine],
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    direction: Direction,
    *,
    seed: int = 0,
    fewest: bool = False,
    progress: Progress = no_progress,
) -> tuple[Candidate | None, Alignment | None, list[str]]:
    """Lay quads over a surface whose edges run along a direction.

    Remeshers are run on the surface as it is, and on the surface with fine grooves along the
    direction, which they follow (see `grooves`). All results are fitted to the given surface, and
    their edges turned into the direction as far as that goes. Of those that pass the check, do not
    run through themselves, have about as many quads as wanted (30 %), and are nearly as near to the
    given surface as the nearest one (root mean square; half as far again, or 0.02 % of the size),
    the one with the least mean angle is taken; of those within one degree of it, the one with the
    fewest irregular vertices.

    Parameters
    ----------
    engines : sequence of Engine
        The remeshers; all that are installed are compared.
    source, surface : PolyMesh
        The given surface, and triangles that the remeshers see.
    wanted : int
        About how many quads.
    direction : Direction
    seed : int
        The first seed; following runs take the following ones.
    fewest : bool
        Whether irregular vertices come first, and the angle second.
    progress : callable
        Told about each run.

    Returns
    -------
    best : Candidate or None
    alignment : Alignment or None
        How well it follows the direction.
    failures : list of str
        Why the runs that gave nothing failed.
    """
    engines = [engine for engine in engines if engine.installed]
    rim = not check_mesh(source).closed
    progress("grooving the surface", 0, 1)
    tasks = _tasks(engines, surface, wanted, direction, seed, rim=rim)
    model = model_of(source, wanted)
    good: list[_Result] = []
    failures: dict[str, list[str]] = {engine.name: [] for engine in engines}
    with closing(results_of(tasks, progress)) as found:
        for task, result in found:
            one = (
                str(result)
                if isinstance(result, AttemptFailedError)
                else _result(model, source, result, task, direction, wanted)
            )
            if isinstance(one, str):
                failures[task.engine.name].append(one)
            else:
                good.append(one)
    told = [text for engine in engines for text in summed_up(engine, failures[engine.name])]
    if not good:
        return None, None, told
    best = _best(good, wanted, fewest=fewest)
    return best.candidate, _alignment(direction, good, best, surface), told


def _tasks(
    engines: Sequence[Engine],
    surface: PolyMesh,
    wanted: int,
    direction: Direction,
    seed: int,
    *,
    rim: bool,
) -> list[Task]:
    """Return the runs to compare: first those on the surface as it is."""
    runs = {engine.name: [(surface, wanted)] for engine in engines}
    if wanted <= _MOST_GROOVED and surface.n_faces <= LARGE:
        spacing = groove_spacing(surface, wanted)
        fine = fine_enough(surface, spacing)
        for groove in _GROOVES:
            rough = grooved(fine, direction, groove, spacing)
            # Remeshers see flanks as more surface to cover.
            aim = round(wanted * surface_area(rough) / surface_area(fine))
            for engine in engines:
                if engine.seeded or groove is _GENTLE:
                    runs[engine.name].append((rough, aim))
    return [
        Task(engine, one, Run(aim, seed + number, rim=rim))
        for engine in engines
        for number, (one, aim) in enumerate(runs[engine.name])
    ]


def _result(
    model: Model,
    source: PolyMesh,
    result: PolyMesh,
    task: Task,
    direction: Direction,
    wanted: int,
) -> _Result | str:
    """Fit and turn a result and measure it; say what is wrong with it instead."""
    plain, faults = fitted_to(model, source, result)
    faults += count_faults(plain.n_faces, wanted)
    if faults:
        return "; ".join(faults)
    turned = fit(model, plain, _ROUNDS, along=direction)
    if check_remeshed(source, turned).faults:
        turned = plain
    return _Result(
        candidate_of(task.engine, source, turned, replace(task.run, n_faces=wanted)),
        task.surface,
        mean_turn_deg(turned, direction),
        mean_turn_deg(plain, direction),
    )


def _best(good: Sequence[_Result], wanted: int, *, fewest: bool) -> _Result:
    """Return the best of some results (see best_along)."""
    number = [one.candidate.mesh.n_faces / wanted for one in good]
    about = [one for one, ratio in zip(good, number, strict=True) if 1 / _ABOUT <= ratio <= _ABOUT]
    good = about or good
    near = set(map(id, as_near([one.candidate for one in good], MUCH_ALIKE)))
    alike = [one for one in good if id(one.candidate) in near]
    if fewest:
        return min(alike, key=lambda one: (one.candidate.irregular, one.turn_deg))
    least = min(one.turn_deg for one in alike)
    close = [one for one in alike if one.turn_deg <= least + _ALIKE_DEG]
    return min(close, key=lambda one: (one.candidate.irregular, one.turn_deg))


def _alignment(
    direction: Direction, good: Sequence[_Result], best: _Result, surface: PolyMesh
) -> Alignment:
    """Compare the best result with the first that nothing was done for."""
    plain = next((one.plain_deg for one in good if one.on is surface), math.nan)
    return Alignment(direction.title, best.turn_deg, plain, len(good))
