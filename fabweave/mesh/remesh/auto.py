"""Take the better of two ways to make quads: those of a remesher, or tubes along a skeleton."""

from dataclasses import replace
from functools import partial

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.fair.energy import Wish
from fabweave.mesh.fair.fairing import fair_mesh
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import likeness
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.fit import model_of
from fabweave.mesh.remesh.quads import remesh_quads
from fabweave.mesh.remesh.remeshed import Remeshed, edge_lengths
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.tubes import remesh_tubes

#: Steps of fairing before the two are compared: these have nine tenths of the gain.
_STEPS = 6
#: Energy of a face that is as bad as being off the model by an edge in the mean.
_OFF = 10.0


def remesh_auto(
    mesh: PolyMesh,
    n_quads: int,
    *,
    seed: int = 0,
    wish: Wish | None = None,
    course: str = "auto",
    progress: Progress = no_progress,
) -> Remeshed:
    """Make quads in both ways, fair both, and take the better.

    That is the one that does not run through itself; if neither or both do, the one with the lesser
    sum of the energy of fairing for each face, and of how much of the model is lost and added in
    the mean.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_quads : int
        About how many quads.
    seed, wish, course, progress
        As for `remesh_quads` and `fair_mesh`.

    Raises
    ------
    CannotMakeError
        If neither way gives a mesh.
    """
    checked_count("auto", n_quads)
    ways = {
        "quads": partial(remesh_quads, mesh, n_quads, seed=seed, progress=progress),
        "tubes": partial(remesh_tubes, mesh, n_quads, progress=progress),
    }
    made: list[tuple[bool, float, str, Remeshed]] = []
    failed: list[CannotMakeError] = []
    told = []
    for kind, way in ways.items():
        try:
            found = way()
        except CannotMakeError as error:
            failed.append(error)
            told.append(
                f"--remesh {kind}:{n_quads} failed: {str(error).splitlines()[0].rstrip(':')}"
            )
            continue
        near = model_of(mesh, found.mesh.n_vertices)
        faired = fair_mesh(found.mesh, near, _STEPS, wish=wish, course=course, progress=progress)
        like = likeness(mesh, faired.mesh)
        off = (like.in_mean_mm + like.out_mean_mm) / float(edge_lengths(faired.mesh).mean())
        energy = faired.energies[-1] / found.mesh.n_faces
        through = len(self_intersections(faired.mesh)) > 0
        made.append((through, energy + _OFF * off, kind, found))
        told.append(
            f"--remesh {kind}:{n_quads} {'runs through itself, ' * through}has an energy of "
            f"{energy:.2f} a face, {like.in_mean_mm:.1f} mm of the model lost and "
            f"{like.out_mean_mm:.1f} mm added in the mean"
        )
    if not made:
        raise CannotMakeError("\n".join(str(error) for error in failed))
    *_, kind, best = min(made, key=lambda one: one[:2])
    chosen = f"--remesh auto took {kind}: " + "; ".join(told)
    return replace(best, notes=(chosen, *best.notes))
