"""Weave the mesh of a job: threads, bunches, and who is on top where they cross."""

from pathlib import Path

import numpy as np

from fabweave.core.arrays import IntArray, Progress, frozen_value, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.files import read_input
from fabweave.core.finding import Note
from fabweave.core.search import Search
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.load import LoadedMesh
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.upright import largest_dimension
from fabweave.stock.supplies import Supplies
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave
from fabweave.weave.settings import WeaveSettings
from fabweave.weave.threads import thread_labels, trace_threads
from fabweave.weave.twill.conditions import parse_weights
from fabweave.weave.twill.weaving import TwillSearch
from fabweave.weave.weave_pattern import WeaveResult, read_twists, twisted_weave, weave_pattern


@frozen_value
class WovenMesh:
    """A mesh and its weave; nothing has a width or a thickness yet.

    Parameters
    ----------
    source : LoadedMesh
        The mesh.
    result : WeaveResult
        The weave, in the pattern that was asked for.
    labels : tuple of str
        Names of the threads.
    bunches : (T,) int array
        The bunch of each thread.
    """

    source: LoadedMesh
    result: WeaveResult
    labels: tuple[str, ...]
    bunches: IntArray

    @property
    def mesh(self) -> PolyMesh:
        """The mesh that is woven, in millimetres."""
        return self.source.mesh

    @property
    def halfedges(self) -> Halfedges:
        """The connectivity of the mesh."""
        return self.source.halfedges

    @property
    def title(self) -> str:
        """What to call the object."""
        return self.source.title

    @property
    def notes(self) -> tuple[Note, ...]:
        """What is worth knowing about the mesh and its weave."""
        return (*self.source.notes, *self.result.notes)

    @property
    def weave(self) -> Weave:
        """The weave."""
        return self.result.weave

    @property
    def size_mm(self) -> float:
        """Largest dimension."""
        return largest_dimension(self.source.mesh)


#: A boundary edge has room for a turn if the middle of its face is so far off it, by its length.
_ROOM = 0.02


def may_turn(mesh: PolyMesh, halfedges: Halfedges) -> bool:
    """Tell whether threads can turn back at the boundary: there is one, with room at each edge.

    A thread that turned around a face that hangs by one edge only would meet itself at once.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> from fabweave.mesh.shapes.solids import cube
    >>> [may_turn(mesh, build_halfedges(mesh)) for mesh in (cube(), hypar(3, 3, 1.0, 0.0))]
    [False, True]
    """
    edge = np.flatnonzero(halfedges.twin < 0)
    if not len(edge):
        return False
    centre = face_centres(mesh)[halfedges.face[edge]]
    tail, head = mesh.vertices[halfedges.tail[edge]], mesh.vertices[halfedges.head[edge]]
    area = np.linalg.norm(np.cross(tail - centre, head - centre), axis=1)
    room = area > _ROOM * np.einsum("ij,ij->i", head - tail, head - tail)
    return bool(room.all() and not halfedges.hanging.any())


def turns_back(settings: WeaveSettings, mesh: PolyMesh, halfedges: Halfedges) -> bool:
    """Tell whether threads turn back at the boundary of a mesh."""
    return settings.boundary == "turn" or (
        settings.boundary == "auto" and may_turn(mesh, halfedges)
    )


def weave_mesh(
    source: LoadedMesh,
    settings: WeaveSettings,
    search: Search,
    supplies: Supplies | None = None,
    progress: Progress = no_progress,
) -> WovenMesh:
    """Weave a mesh in the pattern that the settings ask for.

    Parameters
    ----------
    source : LoadedMesh
    settings : WeaveSettings
    search : Search
        How hard a twill is looked for.
    supplies : Supplies, optional
        What the bunches are cut from. That every bunch has a supply is known once threads are
        traced, and is said before the search for a pattern begins.
    progress : callable

    Raises
    ------
    InputError
        If a bunch has no supply, or a supply no bunch.
    CannotMakeError
        If nothing crosses anything, or the pattern cannot be woven on this mesh.
    """
    progress("weave", 0, 1)
    turn = turns_back(settings, source.mesh, source.halfedges)
    threads = trace_threads(source.halfedges, turn=turn)
    labels = thread_labels(threads.n_threads)
    bunches = part_bunches(threads)
    if supplies is not None:
        supplies.require(bunches)
    if settings.twists is not None:
        path = Path(settings.twists)
        twist = read_twists(read_input(path, "list of twists"), source.halfedges, threads)
        weave = twisted_weave(source.halfedges, threads, twist)
        result = WeaveResult(weave, (Note("twists", f"twists: as {path.name} has them"),))
    else:
        result = weave_pattern(
            settings.pattern,
            source.halfedges,
            threads,
            bunches,
            labels,
            n_old_vertices=source.n_old_vertices,
            how=TwillSearch(
                settings.twill_method,
                parse_weights(settings.twill_weights),
                search.effort,
                search.seed,
            ),
            progress=progress,
        )
    if threads.n_crossings == 0:
        raise CannotMakeError(
            "no threads cross on this mesh, because no edge lies between two faces; weaving needs "
            "faces that share edges"
        )
    return WovenMesh(source, result, labels, bunches)
