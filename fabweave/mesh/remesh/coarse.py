"""Turn a refined mesh back into one of its cages."""

import numpy as np

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.irregular import find_irregular, irregular_note
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.fit import fit
from fabweave.mesh.remesh.model import model_of
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.remesh.remesh_check import check_remeshed
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.source import Remeshed, ready_source
from fabweave.mesh.remesh.unrefine import cages

#: Faces to aim at by default: what a patient person weaves in a week.
_DEFAULT = 300
#: Asked for quads, a cage is taken if it has about as many, up to this factor either way.
_ABOUT = 1.5
#: Rounds of fitting.
_ROUNDS = 10


def remesh_coarse(
    mesh: PolyMesh, n_faces: int | None = None, *, progress: Progress = no_progress
) -> Remeshed:
    """Undo the refinement of a mesh, as often as brings it nearest to a number of faces.

    Triangles that are split quads are paired first. The vertices of the cage are then moved so
    that its surface follows the model.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_faces : int or None
        About how many faces; None for about 300.
    progress : callable
        Told about each step.

    Returns
    -------
    Remeshed
        Not always quads alone: a cage has the faces that were refined.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If it is no refinement, or the cage is not the surface that was given.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import sphere
    >>> remesh_coarse(sphere(16, 50.0), 100).mesh.n_faces
    96
    """
    if n_faces is not None:
        checked_count("coarse", n_faces)
    source, notes = ready_source(mesh)
    paired = paired_quads(source)
    progress("undoing the refinement", 0, 1)
    found = cages(paired)
    if not found:
        raise CannotMakeError(
            f"the mesh is no refinement of another ({paired.n_faces} faces): its vertices are not "
            "the corners, the edge points and the face points of larger faces; --remesh quads:N or "
            "triangles:N makes a coarser mesh of any"
        )
    cage, steps = nearest_cage(found, n_faces or _DEFAULT)
    fitted, faults = fitted_cage(source, cage)
    if faults:
        raise CannotMakeError(
            f"the cage of {cage.n_faces} faces is not the surface that was given: "
            f"{'; '.join(faults)}\nWhat may help: more faces, such as --remesh "
            f"coarse:{4 * cage.n_faces}"
        )
    others = ", ".join(str(other.n_faces) for other in found if other is not cage)
    notes.append(
        cage_note(paired, fitted, steps) + (f"; other cages have {others} faces" if others else "")
    )
    irregular = find_irregular(fitted)
    return Remeshed(fitted, "unrefining", (*notes, irregular_note(irregular)), irregular)


def cage_of_quads(source: PolyMesh, n_quads: int) -> tuple[PolyMesh, str] | None:
    """Return the cage of a mesh that has about a number of faces, all of them quads, and a note.

    Parameters
    ----------
    source : PolyMesh
        An oriented manifold surface.
    n_quads : int
        How many are wanted; a cage has about as many up to a factor of 1.5.

    Returns
    -------
    (PolyMesh, str) or None
        The cage, fitted to the surface; None if there is none, or it is not the same surface.
    """
    paired = paired_quads(source)
    found = [cage for cage in cages(paired) if np.all(cage.face_sizes == 4)]
    if not found:
        return None
    cage, steps = nearest_cage(found, n_quads)
    if not n_quads / _ABOUT <= cage.n_faces <= n_quads * _ABOUT:
        return None
    fitted, faults = fitted_cage(source, cage)
    return None if faults else (fitted, cage_note(paired, fitted, steps))


def paired_quads(source: PolyMesh) -> PolyMesh:
    """Return a mesh with split quads paired; as it is if its triangles are none."""
    if not np.any(source.face_sizes == 3):
        return source
    pairing = pair_triangles(source)
    return merge_pairs(source, pairing) if pairing.split else source


def nearest_cage(found: list[PolyMesh], n_faces: int) -> tuple[PolyMesh, int]:
    """Return the cage whose number of faces is nearest, as a ratio, and how many steps it takes."""
    ratios = [abs(np.log(cage.n_faces / n_faces)) for cage in found]
    best = int(np.argmin(ratios))
    return found[best], best + 1


def fitted_cage(source: PolyMesh, cage: PolyMesh) -> tuple[PolyMesh, tuple[str, ...]]:
    """Fit a cage to the refined surface; say what is wrong with it."""
    fitted = fit(model_of(source, cage.n_vertices), cage, _ROUNDS)
    faults = check_remeshed(source, fitted, None).faults
    pairs = self_intersections(fitted)
    if len(pairs) and not len(self_intersections(source)):
        faults += (agree(len(pairs), "{n} [pair|pairs] of faces run[s|] through one another"),)
    return fitted, faults


def cage_note(paired: PolyMesh, cage: PolyMesh, steps: int) -> str:
    """Say of what the mesh was a refinement."""
    return (
        f"the mesh is a refined cage: undoing {agree(steps, '{n} [step|steps]')} turned its "
        f"{paired.n_faces} faces into {cage.n_faces}, and these were fitted to it"
    )
