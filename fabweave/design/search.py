"""Search designs of a model in rounds, each chosen by what the last came to, and keep them all."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, TypeAlias

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import FabweaveError
from fabweave.core.parallel.executors import Executors, finished, here
from fabweave.design.tried import Tried, try_design
from fabweave.design.variety import is_free, name_of
from fabweave.design.wishes import NO_WISHES, UNBUILT, Wishes, rank, score
from fabweave.job.stations import Stations, given_by, remeshed_by
from fabweave.mesh.given import GivenMesh
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.settings import MeshSettings
from fabweave.options.settings import Settings

#: Told of each design.
Told: TypeAlias = Callable[[Tried], None]


#: Said where Ctrl-C ends a search that has something to go on with.
STOPPED = "stopped searching; going on with the best so far (Ctrl-C again ends it all)"


def tell_nobody(_found: object) -> None:
    """Keep to oneself what was found."""


class Search:
    """The designs of a model that were tried, each once, and what each came to.

    Whoever chooses, chooses among these: ``make``, ``inspect``, wishes, Python, the studio. The
    result is the same however many work at it.

    Parameters
    ----------
    asked : Settings
        What is stated there stays.
    given : PolyMesh, optional
        A mesh from memory, in place of the file that the settings name.
    progress : callable
    executors : callable
        Opens the executor that tries designs.
    told : callable
        Called with each design as soon as it and all before it were tried: in their order.
    at_once : bool
        Whether each is told as soon as it was tried: where somebody waits for any to see, and
        nothing depends on which comes first.
    better : callable
        Called with a line for each that is better than all before it.
    wishes : Wishes
        What is better.
    partly : bool
        Whether Ctrl-C ends the search with what it has, where any of that can be built.
    looks : bool
        Whether pictures are wanted.
    """

    def __init__(
        self,
        asked: Settings,
        given: PolyMesh | None = None,
        *,
        progress: Progress = no_progress,
        executors: Executors = here,
        told: Told = tell_nobody,
        better: Callable[[str], None] = tell_nobody,
        wishes: Wishes = NO_WISHES,
        partly: bool = False,
        looks: bool = False,
        at_once: bool = False,
    ) -> None:
        self.asked, self.given, self.wishes = asked, given, wishes
        self.progress, self.executors, self.looks = progress, executors, looks
        self.told, self.better, self._partly, self._at_once = told, better, partly, at_once
        self._known: dict[str, Tried] = {}
        self._given: dict[MeshSettings, GivenMesh | None] = {}
        self._best = UNBUILT
        #: Whether Ctrl-C ended it.
        self.stopped = False

    @property
    def tried(self) -> list[Tried]:
        """All that were tried, in the order in which they were chosen."""
        return list(self._known.values())

    @property
    def ranked(self) -> list[Tried]:
        """Those that can be built, the best first; without wishes, what does not stand, too."""
        built = [one for one in self.tried if one.makeable or (one.soft and not self.wishes)]
        return sorted(built, key=lambda one: rank(one, self.wishes))

    def model(self) -> LoadedMesh:
        """Return the model as it is loaded, before anything is done to it, at its size."""
        self.progress("mesh", 0, 1)
        plain = self.asked.but(remesh=None, refine=None, fair=0, pattern="plain")
        job = Stations(plain, self.given)
        given_mesh = self._given_mesh(plain)
        return (job if given_mesh is None else job.know(given_mesh=given_mesh)).loaded

    def run(self, rounds: Iterable[Sequence[Settings]], *, behind: float = math.inf) -> None:
        """Try round after round, each chosen when the one before is done.

        No pieces are planned of what is sure to be so many points ``behind`` the best of the rounds
        before.
        """
        for some in rounds:
            best = next(iter(self.ranked), None)
            sure = best is not None and best.like and not best.soft
            least = score(best) - behind if best is not None and sure else -math.inf
            self.add(some, least=least)
            if self.stopped:
                break

    def add(self, designs: Iterable[Settings], *, least: float = -math.inf) -> list[Tried]:
        """Try designs, those that were not, and return what all of them came to.

        Of what is sure to have a lower grade than ``least``, no pieces are planned.
        """
        names = {name_of(one, self.asked): one for one in designs}
        known = {
            name for name, one in self._known.items() if least > -math.inf or not one.passed_over
        }
        left = {name: one for name, one in names.items() if name not in known}
        found: dict[str, Tried] = {}
        untold, total = list(left), len(self._known) + len(left)
        self.progress("designs", len(self._known), total)
        trying = partial(try_design, looks=self.looks, opens=is_free(self.asked), least=least)
        try:
            with self.executors() as executor:
                while left:
                    now = self._one_of_each_mesh(left, found)
                    tasks = [
                        (one, name, self.given, mesh, self._given_mesh(one))
                        for name, (one, mesh) in now.items()
                    ]
                    for _, tried in finished(executor, trying, tasks):
                        found[tried.name] = tried
                        del left[tried.name]
                        self.progress("designs", len(self._known) + len(found), total)
                        if self._at_once:
                            untold.sort(key=found.__contains__, reverse=True)
                        while untold and untold[0] in found:
                            self._tell(found[untold.pop(0)])
        except KeyboardInterrupt:
            some = [*self._known.values(), *found.values()]
            if not (self._partly and any(one.makeable for one in some)):
                raise
            self.stopped = True
            self.better(STOPPED)
        self._known |= {name: found[name] for name in names if name in found}
        return [self._known[name] for name in names if name in self._known]

    def _tell(self, tried: Tried) -> None:
        """Tell what a design came to, and whether it is the best so far."""
        self.told(tried)
        if (away := rank(tried, self.wishes)) < self._best:
            self._best = away
            self.better(f"best so far: {tried.brief}")

    def share(self, job: Stations) -> None:
        """Take the mesh that a job is given, so that it is read once for all."""
        self._given.setdefault(given_by(job.asked), job.given_mesh)

    def _given_mesh(self, design: Settings) -> GivenMesh | None:
        """Return the mesh that a design is given, read once for all; None if it is refused."""
        key = given_by(design)
        if key not in self._given:
            try:
                self._given[key] = Stations(design, self.given).given_mesh
            except FabweaveError:
                self._given[key] = None
        return self._given[key]

    def _one_of_each_mesh(
        self, left: dict[str, Settings], found: dict[str, Tried]
    ) -> dict[str, tuple[Settings, Any]]:
        """Return the designs whose mesh is known, with it, or that are the first of theirs."""
        known = {
            remeshed_by(one.design): one.loaded.remeshed
            for one in (*self._known.values(), *found.values())
            if one.loaded is not None
        }
        now: dict[str, tuple[Settings, Any]] = {}
        begun: set[Any] = set()
        for name, one in left.items():
            mesh = remeshed_by(one)
            if one.mesh.remesh is None or mesh in known or mesh not in begun:
                now[name] = one, known.get(mesh)
                begun.add(mesh)
        return now
