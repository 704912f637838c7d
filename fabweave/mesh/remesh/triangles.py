"""Turn a mesh into few triangles that keep its shape."""

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.irregular import find_irregular, interior_valences
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.engines import QSLIM, AttemptFailedError, Engine, Run, run_engine
from fabweave.mesh.remesh.fit import fit
from fabweave.mesh.remesh.flips import REGULAR, flip_edges
from fabweave.mesh.remesh.model import Model, model_of
from fabweave.mesh.remesh.remesh_check import check_remeshed
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.source import Remeshed, cut_surface, ready_source

#: Rounds of flips, each with one of fitting, and rounds of fitting after them; and how much
#: evenness weighs in either.
_FLIPPING, _FITTING = 6, 6
_EVEN_FLIPPING, _EVEN_FITTING = 0.4, 0.1


def remesh_triangles(
    mesh: PolyMesh,
    n_triangles: int,
    *,
    progress: Progress = no_progress,
    engine: Engine = QSLIM,
) -> Remeshed:
    """Turn a mesh into few triangles that keep its shape, fit for a kagome weave.

    1. Vertices at the same place are joined, and faces are turned to agree.
    2. Edges are collapsed in the order of the error that this makes (quadric error metric), in a
       process of its own; limbs and horns stay.
    3. Edges are flipped so that more vertices have six, and vertices are moved so that the surface
       follows the model; sharp edges of the model stay edges.
    4. The result has the topology of the model, every vertex inside has three edges or more, and
       it does not run through itself if the model does not; else it is refused.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_triangles : int
        About how many triangles.
    progress : callable
        Told about each step.
    engine : Engine
        What takes triangles away.

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If the result is not the surface that was given.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> remeshed = remesh_triangles(torus(24, 12, 35.0, 15.0), 200)
    >>> remeshed.mesh.n_faces, set(remeshed.mesh.face_sizes.tolist())
    (200, {3})

    References
    ----------
    Garland, Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.
    """
    checked_count("triangles", n_triangles)
    source, notes = ready_source(mesh)
    surface = cut_surface(source)
    if surface.n_faces <= n_triangles:
        coarse = surface
        notes.append(
            f"the mesh has {surface.n_faces} triangles, no more than the {n_triangles} asked for, "
            "so none were taken away; --refine gives more"
        )
    else:
        progress("taking triangles away", 0, 1)
        coarse = _decimated(surface, n_triangles, engine)
    result = even_triangles(model_of(source, coarse.n_vertices), coarse, progress)
    faults = triangle_faults(source, result)
    if faults:
        raise _refused("; ".join(faults))
    irregular = find_irregular(result, REGULAR)
    made = f"{engine.title} and flips of edges made {result.n_faces} triangles"
    return Remeshed(result, engine.name, (*notes, made, _valence_note(result)), irregular)


def even_triangles(model: Model, mesh: PolyMesh, progress: Progress = no_progress) -> PolyMesh:
    """Make triangles more even and their valences more regular, and fit them to a model.

    Parameters
    ----------
    model : Model
    mesh : PolyMesh
        An oriented manifold of triangles near it.
    progress : callable
        Told about each round.

    Returns
    -------
    PolyMesh
        As many triangles and vertices.
    """
    for number in range(_FLIPPING):
        progress("evening triangles", number, _FLIPPING)
        mesh = fit(model, flip_edges(model, mesh), 1, _EVEN_FLIPPING)
    return fit(model, mesh, _FITTING, _EVEN_FITTING)


def triangle_faults(source: PolyMesh, result: PolyMesh) -> tuple[str, ...]:
    """Return what is wrong with triangles that stand in for a surface; empty if nothing is.

    Parameters
    ----------
    source : PolyMesh
        The given surface.
    result : PolyMesh
        Any mesh.
    """
    faults = list(check_remeshed(source, result, 3).faults)
    if faults:
        return tuple(faults)
    pairs = self_intersections(result)
    if len(pairs) and not len(self_intersections(source)):
        faults.append(agree(len(pairs), "{n} [pair|pairs] of faces run[s|] through one another"))
    return tuple(faults)


def _decimated(surface: PolyMesh, n_triangles: int, engine: Engine) -> PolyMesh:
    """Take triangles away in a process of its own."""
    try:
        return run_engine(engine, surface, Run(n_triangles, 0, rim=False))
    except AttemptFailedError as error:
        raise _refused(f"{engine.title}: {error}") from error


def _refused(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"the mesh could not be turned into triangles: {why}\nWhat may help: more triangles; "
        "smoothing the scan first; closing small holes; or --remesh quads:N"
    )


def _valence_note(mesh: PolyMesh) -> str:
    """Say how many edges meet in the vertices."""
    valence = interior_valences(build_halfedges(mesh))[1]
    if not len(valence):
        return "no vertex is inside the surface"
    share = float(np.mean(valence == REGULAR))
    return (
        f"{share:.0%} of the vertices inside have six edges, as in a regular kagome weave; the "
        f"others have from {valence.min()} to {valence.max()}"
    )
