"""Whole jobs for tests: made quickly, and those that several tests look at made once."""

import hashlib
import os
import shlex
import shutil
import time
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from unittest import mock

from fabweave.cli import inspect
from fabweave.cli.main import cli, main
from fabweave.cli.options import job_settings
from fabweave.design import choice, making
from fabweave.job import papers
from fabweave.job import run as pipeline
from fabweave.job.draw import Job
from fabweave.job.planned import PlannedJob
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings
from fabweave.picture import object_picture
from fabweave.piece.split import split_plan
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.rules.remedy import Depth

#: A job of eight pieces on one sheet, for whoever needs just any job.
OCTAHEDRON = ("shape:octahedron", "--size", "90mm", "--sheet", "230x225mm", "--effort", "quick")
#: A job of straight strips of few kinds, with holes, slots, spares, and pieces turned round.
STRAIGHT = (
    "shape:octahedron", "--refine", "loop:1", "--pattern", "kagome", "--strips", "straight",
    "--size", "250mm", "--joint", "rivet:2,slots", "--spares", "1", "--effort", "quick",
    "--template", "none",
)  # fmt: skip
#: A job with a ring outside and inside along a rim with corners.
DOUBLED = (
    "shape:hypar?m=6&n=5", "--size", "300mm", "--rim", "double", "--boundary", "end",
    "--effort", "quick",
)  # fmt: skip
#: A job with a ring around an opening, and one with a former, both with kerf.
RINGED = (
    "shape:sphere?n=3", "--size", "200mm", "--leave-out", "top:80mm", "--rim", "ring",
    "--effort", "quick", "--kerf", "0.15", "--hang", "bottom:3",
)  # fmt: skip
FORMED = (
    "shape:sphere?n=3", "--size", "250mm", "--former", "auto", "--effort", "quick",
    "--kerf", "0.15",
)  # fmt: skip
#: Longer than any job takes, on whatever machine; it only ends waiting for what never comes.
_PATIENCE_S = 900.0


def run(*words: object) -> int:
    """Run the command line in this process and return its exit code."""
    try:
        main([str(word) for word in words])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def typed(text: str) -> Settings:
    """Return the settings that a command line means."""
    words = shlex.split(text)
    assert words[:2] == ["fabweave", "make"]
    context = cli.commands["make"].make_context("make", words[2:])
    with context:
        return job_settings(context.params.pop("mesh"), context.params)


def laid(asked, given_mesh=None, **options):
    """Lay ribbons as a job does; return them, and the settings and supplies that were completed."""
    asked = asked if isinstance(asked, Settings) else Settings.of(asked, **options)
    job = Stations(asked, given_mesh)
    return job.ribbons, *job.completed


def stations_of(woven: WovenObject, settings: Settings, depth=Depth.SEARCHED) -> Stations:
    """Return the stations of settings whose ribbons are laid."""
    return Stations(settings, depth=depth).know(loaded=woven.source, weave=woven, ribbons=woven)


def plan_job(woven: WovenObject, settings: Settings, depth=Depth.SEARCHED) -> PlannedJob:
    """Return the pieces of an object; NotMakeableError if it cannot be built."""
    return stations_of(woven, settings, depth).buildable


def make_job(settings: Settings, mesh: PolyMesh | None = None) -> Job:
    """Make everything that a job writes."""
    return pipeline.draw_stations(Stations(settings, mesh))


def _small_portrait(ribbons, colours, state) -> bytes:
    with mock.patch.object(object_picture, "SIDE_PX", (72, 72)):
        return object_picture.portrait_png(ribbons, colours, state)


def _small_likeness(loss, like) -> bytes:
    with mock.patch.object(object_picture, "SIDE_PX", (72, 72)):
        return object_picture.likeness_png(loss, like)


#: What makes jobs quick: a module, a name in it, what it is in tests, and what it is for users.
_QUICK = [
    (module, name, quick, getattr(module, name))
    for module, name, quick in (
        (pipeline, "_MOST_WORKERS", 0),
        (papers, "portrait_png", _small_portrait),
        (papers, "likeness_png", _small_likeness),
        (split_plan, "rough_nesting", lambda *_, **__: None),
        (making, "_TRIES", 4),
        (choice, "_MESHES", 2),
        (inspect, "_DESIGNS", 1),
    )
]


@contextmanager
def _patched(values: Iterable[tuple[object, str, object]]) -> Iterator[None]:
    with ExitStack() as stack:
        for module, name, value in values:
            stack.enter_context(mock.patch.object(module, name, value))
        yield


def quick_jobs() -> AbstractContextManager[None]:
    """Have jobs made by this process alone, with a small picture, and few designs tried.

    Sheets are foretold by their area alone, in place of nesting pieces roughly.

    Most of a small job's time goes to its picture, and to processes that make it meanwhile.
    Nothing else is changed by either.
    """
    return _patched((module, name, quick) for module, name, quick, _ in _QUICK)


def shipped_jobs() -> AbstractContextManager[None]:
    """Have jobs made as users make them, whatever ``quick_jobs`` did."""
    return _patched((module, name, shipped) for module, name, _, shipped in _QUICK)


class JobStore:
    """Folders of finished jobs, each made once, and quickly, by whoever asks first.

    The folders are for all: who wants to spoil one takes a copy.
    """

    def __init__(self, folder: Path) -> None:
        """Keep them there; all processes of one run share that folder."""
        self._folder = folder
        self._digests: dict[Path, dict[str, str]] = {}
        folder.mkdir(parents=True, exist_ok=True)

    def __call__(self, *words: object) -> Path:
        """Return the folder of ``fabweave make`` with these words, but without ``-o``."""
        typed = [str(word) for word in words]
        name = hashlib.sha256("\0".join(typed).encode()).hexdigest()[:16]
        folder = self._folder / name
        with self._alone(name):
            if not folder.exists():
                with quick_jobs():
                    assert run("make", *typed, "-q", "-o", folder) == 0, typed
                self._digests[folder] = contents_of(folder)
        return folder

    def copy(self, target: Path, *words: object) -> Path:
        """Copy such a folder to one that is not there yet, and return that."""
        return Path(shutil.copytree(self(*words), target))

    def require_unspoiled(self) -> None:
        """Raise unless every folder that was made here is as it was made."""
        spoiled = [
            folder for folder, digest in self._digests.items() if contents_of(folder) != digest
        ]
        assert not spoiled, f"a test changed finished jobs that are for all: {spoiled}"

    @contextmanager
    def _alone(self, name: str) -> Iterator[None]:
        """Keep other processes out while a job is looked for, and made."""
        lock = self._folder / f"{name}.lock"
        until = time.monotonic() + _PATIENCE_S
        while True:
            try:
                lock.mkdir()
                break
            except FileExistsError:
                if time.monotonic() > until:
                    raise TimeoutError(f"another process makes {name} for ever") from None
                time.sleep(0.1)
        try:
            yield
        finally:
            os.rmdir(lock)


def contents_of(folder: Path) -> dict[str, str]:
    """Return a digest of each file in a folder, by its name."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
