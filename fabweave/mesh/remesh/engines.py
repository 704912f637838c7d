"""Start remeshers in child processes, with a limit, and take their results."""

import contextlib
import ctypes
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from fabweave.core.arrays import FloatArray, Progress, frozen_value, no_progress
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.core.parallel.executors import result_of, threads
from fabweave.core.parallel.interrupt import held_back
from fabweave.mesh.check import check_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import likeness
from fabweave.mesh.one_rings import find_irregular
from fabweave.mesh.polymesh import PolyMesh, without_loose
from fabweave.mesh.remesh import child
from fabweave.mesh.remesh.fit import Model, fit, model_of
from fabweave.mesh.remesh.limbs import drawn_out, with_limbs
from fabweave.mesh.remesh.remeshed import check_remeshed, surface_faults
from fabweave.mesh.remesh.reopen import reopened

# -P keeps the folder of the script, whose modules have everyday names, off the import path.
_CHILD = (
    (sys.executable, child.FLAG)
    if getattr(sys, "frozen", False)
    else (sys.executable, "-P", child.__file__)
)
#: Seconds between two looks at whether a result is still wanted.
_GLANCE_S = 0.1


class AttemptFailedError(Exception):
    """Say why one run of a remesher gave nothing; caught where runs are compared."""


class LimitReachedError(AttemptFailedError):
    """Say that a run was stopped at its limit."""


@dataclass(frozen=True)
class Engine:
    """A remesher that can be started.

    Parameters
    ----------
    name : str
        What the child process calls it.
    title : str
        What people call it.
    package : str
        The package that must be importable; empty if none.
    library : str
        A library of the system that the package needs on Linux; empty if none.
    quads_per_count : int
        How many quads it gives for each face that it is asked for.
    seeded : bool
        Whether its results differ by seed; else the count is varied.
    most_runs : int
        How many of its results are compared at most.
    command : tuple of str
        What starts it; the engine's name, the task file and the result file are appended.
    limit_s : float or None
        Seconds after which it is stopped; by default generous, by the size of the task.
    """

    name: str
    title: str
    package: str
    library: str = ""
    quads_per_count: int = 1
    seeded: bool = True
    most_runs: int = 4
    command: tuple[str, ...] = field(default=_CHILD)
    limit_s: float | None = None

    @property
    def lack(self) -> str:
        """What keeps this platform from running it; empty if nothing does."""
        if self.package and importlib.util.find_spec(self.package) is None:
            return f"no wheel of {self.package}"
        if self.library and sys.platform == "linux" and not _loads(self.library):
            return f"no {self.library} for {self.package}"
        return ""


@cache
def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


#: The remeshers in the order of preference.
ENGINES = (
    Engine("quadriflow", "QuadriFlow", "pyQuadriFlow"),
    Engine(
        "instant-meshes", "Instant Meshes", "pynanoinstantmeshes", quads_per_count=4, seeded=False
    ),
)
#: What finds the skeleton of a surface, and what makes tubes of quads around one.
SKELETON = Engine("skeleton", "PyGEL", "pygel3d", "libGL.so.1", seeded=False, most_runs=1)
EXTRUSION = replace(SKELETON, name="extrusion")
#: What takes triangles away: libigl, which is always there.
QSLIM = Engine("qslim", "Decimation by quadric error", "igl", seeded=False, most_runs=1)
#: The engines of each kind of remeshing, any of which will do; triangles need none of them.
_ENGINES_OF: dict[str, tuple[Engine, ...]] = {
    "quads": ENGINES, "tubes": (SKELETON,), "triangles": (),
}  # fmt: skip


def lacking(kind: str) -> str:
    """Say in one line why a kind of remeshing is not there, and what is; empty if it is there.

    Examples
    --------
    >>> lacking("triangles")
    ''
    """
    lacks = {
        name: " and ".join(engine.lack for engine in engines)
        for name, engines in _ENGINES_OF.items()
        if engines and all(engine.lack for engine in engines)
    }
    if kind not in lacks:
        return ""
    others = [name for name in _ENGINES_OF if name not in lacks]
    there = f"{' and '.join(others)} {'is' if len(others) == 1 else 'are'}"
    return f"{lacks[kind]} on this platform: --remesh {kind} is not there; --remesh {there}"


@dataclass(frozen=True)
class Run:
    """One run of a remesher: how many faces to aim at, the seed, whether to follow the rim."""

    n_faces: int
    seed: int
    rim: bool


def time_limit_s(n_triangles: int, n_quads: int) -> float:
    """Return the seconds after which a run is taken to hang; ten times what was measured.

    Examples
    --------
    >>> time_limit_s(6000, 1500)
    96.0
    """
    return 60.0 + 0.02 * n_quads + 0.001 * n_triangles


def run_engine(
    engine: Engine,
    surface: PolyMesh,
    run: Run,
    stop: threading.Event | None = None,
    radii: FloatArray | None = None,
) -> PolyMesh:
    """Run a remesher once, in a process of its own.

    The surface is brought to the unit box for it, as remeshers compute in single precision. The
    process is ended when the limit is reached, when this function is left early (Ctrl-C), and
    when it is told to stop.

    Parameters
    ----------
    engine : Engine
        The remesher.
    surface : PolyMesh
        Triangles; for what makes a surface of a graph, its edges.
    run : Run
        What to ask for.
    stop : Event, optional
        Set by another thread when the result is no longer wanted.
    radii : (V,) float array, optional
        How thick the surface is to be at each vertex of a graph.

    Returns
    -------
    PolyMesh
        What it made (the edges of a graph are faces of two corners), at the place and size of the
        surface; not checked.

    Raises
    ------
    AttemptFailedError
        If it failed, ended without a result or (LimitReachedError) hung.
    """
    lower, upper = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    centre, size = (lower + upper) / 2, float((upper - lower).max()) or 1.0
    limit = engine.limit_s or time_limit_s(surface.n_faces, run.n_faces)
    with tempfile.TemporaryDirectory(prefix="fabweave-") as folder:
        task, result = Path(folder) / "task.npz", Path(folder) / "result.npz"
        np.savez(
            task,
            vertices=(surface.vertices - centre) / size,
            triangles=surface.indices.reshape(surface.n_faces, -1),
            count=max(1, round(run.n_faces / engine.quads_per_count)),
            seed=run.seed,
            rim=run.rim,
            radii=np.zeros(0) if radii is None else radii / size,
        )
        code = _run_child(
            [*engine.command, engine.name, str(task), str(result)], limit, stop or threading.Event()
        )
        return _read_result(result, code, centre, size)


def _run_child(command: list[str], limit: float, stop: threading.Event) -> int:
    """Run a command to its end, silently; kill it, and all that it started, at the limit.

    Where no process can be started, this one does what the child would.
    """
    try:
        started = subprocess.Popen(  # noqa: S603 -- our own script, or the caller's command
            command,
            stdin=subprocess.PIPE,  # closing it tells the child that nobody is waiting any more
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=sys.platform != "win32",
        )
    except OSError as error:
        if tuple(command[:-3]) == _CHILD:
            return child.remesh_file(*command[-3:])
        raise AttemptFailedError(f"it could not be started: {error.strerror}") from error
    try:
        return _wait(started, limit, stop)
    finally:
        _kill(started)


def _wait(started: "subprocess.Popen[bytes]", limit: float, stop: threading.Event) -> int:
    """Wait for a child process, and return its code."""
    end = time.monotonic() + limit
    while not stop.is_set():
        try:
            return started.wait(max(0.0, min(_GLANCE_S, end - time.monotonic())))
        except subprocess.TimeoutExpired:
            if time.monotonic() >= end:
                raise LimitReachedError(
                    f"it was stopped at its time limit, {limit:.0f} s (a faster machine might give "
                    "another mesh)"
                ) from None
    raise AttemptFailedError("it was stopped, as its result was no longer needed")


def _kill(started: "subprocess.Popen[bytes]") -> None:
    """End a child process and its group, if they still run, and collect it."""
    if started.poll() is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if sys.platform != "win32":
                os.killpg(started.pid, signal.SIGKILL)
            else:
                started.kill()
        started.wait()
    if started.stdin is not None:
        started.stdin.close()


def _read_result(path: Path, code: int, centre: FloatArray, size: float) -> PolyMesh:
    """Take the result of a child process that ended with a code."""
    if not path.is_file():
        how = f"by signal {-code}" if code < 0 else f"with code {code}"
        raise AttemptFailedError(f"it ended {how} and left no result")
    try:
        with np.load(path, allow_pickle=False) as stored:
            result = dict(stored)
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise AttemptFailedError("it left a result that cannot be read") from error
    if "error" in result:
        raise AttemptFailedError(str(result["error"]))
    try:
        vertices = np.asarray(result["vertices"], dtype=np.float64)
        faces = np.asarray(result["faces"], dtype=np.int64)
    except (KeyError, ValueError, TypeError) as error:
        raise AttemptFailedError("it left a result that is not a mesh") from error
    if vertices.shape[1:] != (3,) or faces.ndim != 2 or not faces.size:
        raise AttemptFailedError("it made a mesh without faces")
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise AttemptFailedError("it made faces of vertices that do not exist")
    return without_loose(PolyMesh.from_faces(vertices * size + centre, faces))


#: Runs compared for tasks up to so many quads; by counts, not by time, so that results are the
#: same on every machine.
_RUNS = ((3000, 4), (8000, 2))
#: Tasks with more triangles than this have one run.
LARGE = 200_000
#: By how much the count changes from run to run where there are no seeds.
_SPREAD = 0.04
#: A result with more or fewer quads than wanted by this factor is rejected.
_FAR = 3.0
#: Results are as near to the given surface as one another up to this factor, or this difference.
_ALIKE, _ALIKE_PERCENT = 1.1, 0.02
#: Rounds of fitting, at first and after a change; results of more quads follow the surface well
#: enough without.
_ROUNDS, _REFIT, _MOST_FITTED = 10, 4, 20_000
#: Runs at the same time.
_AT_ONCE = 2


@frozen_value
class Task:
    """A remesher, what it is to remesh, and how."""

    engine: Engine
    surface: PolyMesh
    run: Run


@frozen_value
class Candidate:
    """A result that passed the check, and the run that gave it.

    Parameters
    ----------
    engine : Engine
    mesh : PolyMesh
        What it made, fitted to the given surface.
    run : Run
        What it was asked for.
    off : float
        Root mean square of the distances from the given surface to the mesh, in per cent of the
        size.
    irregular, clashes : int
        How many irregular vertices, and pairs of faces that run through one another, there are.
    drawn : bool
        Whether it has long edges (see `drawn_out`).
    closed : int
        How many openings and handles of the given surface it lacks.
    """

    engine: Engine
    mesh: PolyMesh
    run: Run
    off: float
    irregular: int
    clashes: int
    drawn: bool = False
    closed: int = 0

    @property
    def note(self) -> Note:
        """What was made."""
        seed = f", seed {self.run.seed}" if self.engine.seeded else ""
        text = (
            f"{self.engine.title} made {self.mesh.n_faces} quads ({self.run.n_faces} were wanted"
            f"{seed})"
        )
        if self.clashes:
            text += agree(self.clashes, "; {n} [pair|pairs] of them run[s|] through one another")
            text += ": more quads, or --remesh triangles:N, would keep limbs apart"
        if self.closed:
            told = "{n} opening[|s] or handle[|s] too small for its quads [was|were] closed"
            text += f"; {agree(self.closed, told)}"
        return Note("quads", text, detail=not self.closed)


def best_run(
    engine: Engine,
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    *,
    seed: int = 0,
    most: int | None = None,
    progress: Progress = no_progress,
) -> tuple[Candidate | None, list[str]]:
    """Run a remesher a few times and take the result that keeps the shape best.

    Each result is fitted to the given surface, and checked. On an open mesh new edges must follow
    the boundary, unless no such run passes the check. Of the results that pass:

    1. those that do not run through themselves are taken first, then those without long edges;
    2. of these, those that are nearest to the given surface: all that are nearly as near as the
       nearest one (root mean square; 10 %, or 0.02 % of the size) are equally good;
    3. of these, the one with the fewest irregular vertices, and then the one nearest to the number
       wanted.

    A result with as few irregular vertices as its topology allows ends the search. Where none keeps
    all openings and handles, the best of those that close fewest is taken.

    Parameters
    ----------
    engine : Engine
        The remesher.
    source, surface : PolyMesh
        The given surface, and triangles that the remesher sees.
    wanted : int
        About how many quads.
    seed : int
        The first seed; following runs take the following ones.
    most : int, optional
        No more runs than these; by default as many as are worth their time.
    progress : callable
        Told about each run.

    Returns
    -------
    best : Candidate or None
        Among equals the first.
    failures : list of str
        Why the runs that gave nothing failed.
    """
    report = check_mesh(source)
    # Around a closed surface the differences from four edges sum to four times its Euler
    # characteristic: where each is one, there is no result with fewer.
    enough = 4 * abs(report.euler) if report.closed else 0
    large = surface.n_faces > LARGE
    model = model_of(source, wanted) if wanted <= _MOST_FITTED else None
    failures: list[str] = []
    hung: list[str] = []
    simpler: list[Candidate] = []
    for rim in (False,) if report.closed else (True, False):
        good: list[Candidate] = []
        runs = runs_of(engine, wanted, seed, rim=rim, large=large)[:most]
        tasks = [Task(engine, surface, run) for run in runs]
        judge = partial(_fitted, model, source, wanted)
        with closing(results_of(tasks, judge, progress)) as found:
            for task, result in found:
                if isinstance(result, AttemptFailedError):
                    (hung if isinstance(result, LimitReachedError) else failures).append(
                        str(result)
                    )
                    continue
                one = candidate_of(engine, source, result, task.run)
                (simpler if one.closed else good).append(one)
                if not one.closed and one.irregular <= enough:
                    break
        if good:
            return best_of(good, wanted), _summed_up(engine, hung) + _summed_up(engine, failures)
    failed = _summed_up(engine, hung) + _summed_up(engine, failures)
    least = min((one.closed for one in simpler), default=0)
    alike = [one for one in simpler if one.closed == least]
    return (best_of(alike, wanted) if alike else None), failed


def results_of(
    tasks: Sequence[Task],
    judge: Callable[[PolyMesh], tuple[PolyMesh, tuple[str, ...]]],
    progress: Progress = no_progress,
) -> Generator[tuple[Task, PolyMesh | AttemptFailedError]]:
    """Yield what came of each run, or why nothing did.

    Close it to end runs that are no longer wanted.

    Parameters
    ----------
    tasks : sequence of Task
    judge : callable
        Takes what a remesher gave, and returns what is made of it and what is wrong with that.
    progress : callable
        Told about each run.
    """
    with _started(tasks) as waiting:
        for number, task in enumerate(tasks):
            progress(f"remeshing with {task.engine.title}", number, len(tasks))
            outcome: PolyMesh | AttemptFailedError
            try:
                outcome, faults = judge(result_of(waiting[number]))
                if faults:
                    outcome = AttemptFailedError("; ".join(faults))
            except AttemptFailedError as error:
                outcome = error
            yield task, outcome
    if tasks:
        progress(f"remeshing with {tasks[-1].engine.title}", len(tasks), len(tasks))


def _fitted(
    model: Model | None, source: PolyMesh, wanted: int, result: PolyMesh
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Fit a result to the surface, unless only the unfitted one passes; say what is wrong.

    What fills an opening goes first.
    """
    result = reopened(source, result)
    spikes: tuple[str, ...] = ()
    if model is not None and not surface_faults(source, result, simpler=True):
        fitted = fit(model, result, _ROUNDS)
        fitted, spikes = with_limbs(source, fitted, partial(fit, model, rounds=_REFIT), wanted)
        if not spikes and not check_remeshed(source, fitted, simpler=True):
            result = fitted
    faults = check_remeshed(source, result, simpler=True)
    faults = (*spikes, *faults) if faults else ()
    if not wanted / _FAR <= result.n_faces <= wanted * _FAR:
        faults += (f"{result.n_faces} quads, far from the {wanted} wanted",)
    return result, faults


def candidate_of(engine: Engine, source: PolyMesh, result: PolyMesh, run: Run) -> Candidate:
    """Measure a result."""
    like = likeness(source, result)
    irregular, clashes = len(find_irregular(result)), len(self_intersections(result))
    off, drawn = like.percent(like.in_rms_mm), drawn_out(result)
    # Each opening and each handle more takes one, and two, from the Euler characteristic.
    before, after = check_mesh(source), check_mesh(result)
    openings = before.n_boundary_loops - after.n_boundary_loops
    closed = openings + (after.euler - before.euler - openings) // 2
    return Candidate(engine, result, run, off, irregular, clashes, drawn, closed)


def best_of(good: Sequence[Candidate], wanted: int) -> Candidate:
    """Return the best of some results (see best_run)."""
    sound = [item for item in good if not item.clashes] or good
    sound = [item for item in sound if not item.drawn] or sound
    near = min(item.off for item in sound)
    alike = [item for item in sound if item.off <= max(near * _ALIKE, near + _ALIKE_PERCENT)]
    return min(alike, key=lambda item: (item.irregular, abs(item.mesh.n_faces - wanted)))


@contextmanager
def _started(tasks: Sequence[Task]) -> Iterator[list[Future[PolyMesh]]]:
    """Start runs of a remesher, two at a time; none is left running when the block ends."""
    stop = threading.Event()
    pool = threads(min(_AT_ONCE, os.cpu_count() or 1))
    try:
        yield [pool.submit(run_engine, task.engine, task.surface, task.run, stop) for task in tasks]
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


def runs_of(
    engine: Engine, wanted: int, seed: int, *, rim: bool, large: bool, times: int = 1
) -> list[Run]:
    """Return the runs of a remesher to compare, or several times as many of what is quick."""
    number = 1 if large else next((runs for most, runs in _RUNS if wanted <= most), 1)
    number = min(number, engine.most_runs) * (1 if large else times)
    runs = []
    for k in range(number):
        # 0, +1, -1, +2 times the spread
        share = 1 + _SPREAD * ((k + 1) // 2) * (1 if k % 2 else -1)
        aim = wanted if engine.seeded else round(wanted * share)
        runs.append(Run(aim, seed + k, rim=rim))
    return runs
