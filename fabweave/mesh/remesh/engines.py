"""Start remeshers in child processes, with a limit, and take their results."""

import contextlib
import importlib.util
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import zipfile
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fabweave.core.arrays import FloatArray
from fabweave.mesh.polymesh import PolyMesh

# -P keeps the folder of the script, whose modules have everyday names, off the import path.
_CHILD = (sys.executable, "-P", str(Path(__file__).with_name("child.py")))
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
    quads_per_count: int = 1
    seeded: bool = True
    most_runs: int = 4
    command: tuple[str, ...] = field(default=_CHILD)
    limit_s: float | None = None

    @property
    def installed(self) -> bool:
        """Whether its package is there."""
        return not self.package or importlib.util.find_spec(self.package) is not None


#: The remeshers in the order of preference.
ENGINES = (
    Engine("quadriflow", "QuadriFlow", "pyQuadriFlow"),
    Engine(
        "instant-meshes", "Instant Meshes", "pynanoinstantmeshes", quads_per_count=4, seeded=False
    ),
)
#: What takes triangles away: libigl, which is always there.
QSLIM = Engine("qslim", "Decimation by quadric error", "igl", seeded=False, most_runs=1)


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
    engine: Engine, surface: PolyMesh, run: Run, stop: threading.Event | None = None
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
        Triangles.
    run : Run
        What to ask for.
    stop : Event, optional
        Set by another thread when the result is no longer wanted.

    Returns
    -------
    PolyMesh
        What it made, at the place and size of the surface; not checked.

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
            triangles=surface.indices.reshape(-1, 3),
            count=max(1, round(run.n_faces / engine.quads_per_count)),
            seed=run.seed,
            rim=run.rim,
        )
        code = _run_child(
            [*engine.command, engine.name, str(task), str(result)], limit, stop or threading.Event()
        )
        return _read_result(result, code, centre, size)


def _run_child(command: list[str], limit: float, stop: threading.Event) -> int:
    """Run a command to its end, silently; kill it, and all that it started, at the limit."""
    try:
        child = subprocess.Popen(  # noqa: S603 -- our own script, or the caller's command
            command,
            stdin=subprocess.PIPE,  # closing it tells the child that nobody is waiting any more
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=os.name == "posix",
        )
    except OSError as error:
        raise AttemptFailedError(f"it could not be started: {error.strerror}") from error
    try:
        return _wait(child, limit, stop)
    finally:
        _kill(child)


def _wait(child: "subprocess.Popen[bytes]", limit: float, stop: threading.Event) -> int:
    """Wait for a child process, and return its code."""
    end = time.monotonic() + limit
    while not stop.is_set():
        try:
            return child.wait(max(0.0, min(_GLANCE_S, end - time.monotonic())))
        except subprocess.TimeoutExpired:
            if time.monotonic() >= end:
                raise LimitReachedError(
                    f"it was stopped at its time limit, {limit:.0f} s (a faster machine might give "
                    "another mesh)"
                ) from None
    raise AttemptFailedError("it was stopped, as its result was no longer needed")


def _kill(child: "subprocess.Popen[bytes]") -> None:
    """End a child process and its group, if they still run, and collect it."""
    if child.poll() is None:
        with contextlib.suppress(ProcessLookupError, PermissionError):
            if os.name == "posix":
                os.killpg(child.pid, signal.SIGKILL)
            else:
                child.kill()
        child.wait()
    if child.stdin is not None:
        child.stdin.close()


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
    return PolyMesh.from_faces(vertices * size + centre, faces)
