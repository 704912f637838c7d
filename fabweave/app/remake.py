"""Make a finished job again from its job.toml, and compare it byte for byte."""

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from fabweave.app.pipeline import run_job
from fabweave.app.settings import read_job_options, settings_from_job
from fabweave.core.arrays import Progress, no_progress
from fabweave.mesh.io.files import read_mesh


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


def remake_job(directory: Path, progress: Progress = no_progress, *, workers: int = 0) -> Remake:
    """Make a job again from the settings in its folder, elsewhere, and compare all its files.

    Parameters
    ----------
    directory : Path
        The folder of a finished job; the mesh that it names has to be where it was.
    progress : callable
    workers : int
        Processes beside this one; they change no byte.

    Raises
    ------
    InputError
        If the settings or the mesh cannot be read.
    CannotMakeError
        If the job cannot be made again.
    """
    path = directory / "job.toml"
    settings, mesh = settings_from_job(path), None
    name = str(read_job_options(path).get("mesh"))
    kept = directory / name
    if Path(name).name == name and settings.mesh == str(kept):
        # It came from memory, and was kept under this name.
        mesh, settings = read_mesh(kept).mesh, replace(settings, mesh=kept.name)
    with tempfile.TemporaryDirectory(prefix="fabweave-remake-") as folder:
        again = Path(folder) / "job"
        run_job(settings, again, progress, mesh=mesh, workers=workers)
        files, others = _files(directory), _files(again)
        both = sorted(files.keys() & others.keys())
        same = [name for name in both if files[name].read_bytes() == others[name].read_bytes()]
    return Remake(
        tuple(same),
        tuple(name for name in both if name not in set(same)),
        tuple(sorted(files.keys() - others.keys())),
        tuple(sorted(others.keys() - files.keys())),
    )


def _files(directory: Path) -> dict[str, Path]:
    """Return all files of a folder by their names in it."""
    return {
        path.relative_to(directory).as_posix(): path
        for path in directory.rglob("*")
        if path.is_file()
    }
