"""Remesh a surface as ``--remesh`` asks."""

from fabweave.core.arrays import Progress, no_progress
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.coarse import remesh_coarse
from fabweave.mesh.remesh.direction import Along
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.remesh.remeshed import Remeshed
from fabweave.mesh.remesh.request import Remesh
from fabweave.mesh.remesh.triangles import remesh_triangles


def remesh(
    mesh: PolyMesh,
    wanted: Remesh,
    *,
    seed: int = 0,
    along: Along | None = None,
    progress: Progress = no_progress,
) -> Remeshed:
    """Remesh a surface.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    wanted : Remesh
        What to make of it.
    seed : int
        The first seed of remeshers that have one.
    along : Direction, "curvature" or None
        For quads: which way strands should run.
    progress : callable
        Told about each step.

    Raises
    ------
    InputError, CannotMakeError
        If the mesh cannot be remeshed so.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> remesh(sphere(8, 50.0), Remesh("triangles", 100)).mesh.n_faces
    100
    """
    if wanted.kind == "triangles" and wanted.count is not None:
        return remesh_triangles(mesh, wanted.count, progress=progress)
    if wanted.kind == "coarse":
        return remesh_coarse(mesh, wanted.count, progress=progress)
    return remesh_quads(mesh, wanted.count, seed=seed, along=along, progress=progress)
