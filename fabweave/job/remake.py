"""Make a finished job again from its job.toml, and compare it byte for byte."""

import tempfile
from pathlib import Path
from typing import NamedTuple

from fabweave.core.arrays import Progress, no_progress
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings, read_job_options, settings_from_job


class Remake(NamedTuple):
    """Which files came out the same, which differ, and which only one of both jobs has."""

    same: tuple[str, ...]
    differing: tuple[str, ...]
    only_there: tuple[str, ...]
    only_again: tuple[str, ...]

    @property
    def ok(self) -> bool:
        """Whether both jobs are equal, byte for byte."""
        return not (self.differing or self.only_there or self.only_again)


def remake_job(
    directory: Path, progress: Progress = no_progress, *, nest: bool = True, workers: int = 0
) -> Remake:
    """Make a job again from the settings in its folder, elsewhere, and compare all its files.

    Parameters
    ----------
    directory : Path
        The folder of a finished job; the mesh that it names has to be where it was.
    progress : callable
    nest : bool
        Whether pieces are nested again, too; else they lie as the crossing map says.
    workers : int
        Processes beside this one; they change no byte.

    Raises
    ------
    InputError
        If the settings or the mesh cannot be read.
    CannotMakeError
        If the job cannot be made again.
    """
    settings, mesh = asked_of(directory)
    with tempfile.TemporaryDirectory(prefix="fabweave-remake-") as folder:
        again = Path(folder) / "job"
        recorded = None if nest else directory / "crossing_map.json"
        job = Stations(settings, mesh, recorded=recorded, progress=progress)
        run_job(job, again, workers=workers)
        files, others = _files(directory), _files(again)
        both = sorted(files.keys() & others.keys())
        same = [name for name in both if _equal(files[name], others[name])]
    return Remake(
        tuple(same),
        tuple(name for name in both if name not in set(same)),
        tuple(sorted(files.keys() - others.keys())),
        tuple(sorted(others.keys() - files.keys())),
    )


def asked_of(directory: Path) -> tuple[Settings, PolyMesh | None]:
    """Return what a finished job was asked for, and its mesh where that came from memory.

    InputError is raised if it cannot be read.
    """
    path = directory / "job.toml"
    settings, name = settings_from_job(path), str(read_job_options(path).get("mesh"))
    kept = directory / name
    if Path(name).name == name and settings.mesh.source == str(kept):
        return settings.but(source=kept.name), read_mesh(kept).mesh
    return settings, None


def _equal(one: Path, other: Path) -> bool:
    """Return whether two files hold the same; of unlike size, neither is read."""
    return one.stat().st_size == other.stat().st_size and one.read_bytes() == other.read_bytes()


def _files(directory: Path) -> dict[str, Path]:
    """Return all files of a folder by their names in it."""
    return {
        path.relative_to(directory).as_posix(): path
        for path in directory.rglob("*")
        if path.is_file()
    }
