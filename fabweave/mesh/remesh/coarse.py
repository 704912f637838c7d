"""Turn a refined mesh back into one of its cages."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray, Progress, flags, no_progress, places_in_groups
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.one_rings import corners_in_turn
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.fit import fit, model_of
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.remesh.remeshed import Remeshed, finished_quads, ready_source, sound_faults
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.topology import solve_parity

#: Cages of cages are looked for so often.
_MOST_STEPS = 12


def cages(mesh: PolyMesh) -> list[PolyMesh]:
    """Return the cages of which a mesh is a refinement, the finest first.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    list of PolyMesh
        Each has about a quarter of the faces of the one before; empty if the mesh is no refinement.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> from fabweave.mesh.subdivide import parse_refinements, refine_mesh
    >>> fine = refine_mesh(cube(), parse_refinements("catmull-clark:3"))
    >>> [cage.n_faces for cage in cages(fine)]
    [96, 24, 6]
    """
    found: list[PolyMesh] = []
    while len(found) < _MOST_STEPS:
        coarser = unrefined(found[-1] if found else mesh)
        if coarser is None:
            break
        found.append(coarser)
    return found


def unrefined(mesh: PolyMesh) -> PolyMesh | None:
    """Undo one step of a subdivision that cuts faces into quads around their centres.

    In such a mesh (Catmull-Clark, or the same cuts without rounding) neighbours along edges are of
    two classes: edge points, which have four edges inside and three on the boundary, and others.
    The others, along the diagonals of quads, again are of two: old vertices, and face points, which
    are inside. The quads around a face point were a face. Where several choices hold, as on grids,
    the one whose faces are nearest to quads in the mean is taken, and of equals the one that keeps
    the first vertex.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.

    Returns
    -------
    PolyMesh or None
        The old faces on the old vertices, where these are now; None if there are none.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import icosahedron
    >>> from fabweave.mesh.subdivide import catmull_clark
    >>> unrefined(catmull_clark(icosahedron())).n_faces, unrefined(icosahedron())
    (20, None)

    References
    ----------
    Taubin, "Detecting and reconstructing subdivision connectivity", The Visual Computer 18, 2002,
    does the same for triangles.
    """
    if not mesh.n_faces or np.any(mesh.face_sizes != 4):
        return None
    halfedges = build_halfedges(mesh)
    count = mesh.n_vertices
    rim = flags(count, halfedges.tail[halfedges.twin < 0])
    valence = np.bincount(halfedges.tail, minlength=count) + rim
    apart = np.ones(halfedges.n_halfedges, dtype=bool)
    edges = solve_parity(count, halfedges.tail, halfedges.head, apart)
    if edges.odd_ring:
        return None
    is_face_point = np.zeros(count, dtype=bool)
    kept = np.zeros(count, dtype=bool)
    for body in np.unique(edges.classes[halfedges.tail]):
        choice = _best_choice(mesh, edges.classes == body, edges.opposite, valence, rim)
        if choice is None:
            return None
        is_face_point |= choice
    first_old = mesh.indices.reshape(-1, 4)
    # Opposite a face point, each of its quads has an old vertex.
    for corner in range(4):
        kept[first_old[is_face_point[first_old[:, (corner + 2) % 4]], corner]] = True
    return _parent(mesh, halfedges, is_face_point, kept)


def _best_choice(
    mesh: PolyMesh, body: BoolArray, side: BoolArray, valence: IntArray, rim: BoolArray
) -> BoolArray | None:
    """Return which vertices of a body are face points, (V,); None if there is no choice."""
    quads = mesh.indices.reshape(-1, 4)
    quads = quads[body[quads[:, 0]]]
    options: list[tuple[float, bool, BoolArray]] = []
    for edge_side in (1, 0):
        on_edges = body & (side == edge_side)
        if np.any(valence[on_edges] != np.where(rim[on_edges], 3, 4)):
            continue
        # Of each quad the diagonal between the two corners that are no edge points.
        start = np.where(on_edges[quads[:, 0]], 1, 0)
        row = np.arange(len(quads))
        ends = quads[row, start], quads[row, start + 2]
        diagonal = solve_parity(mesh.n_vertices, *ends, np.ones(len(quads), dtype=bool))
        linked = flags(mesh.n_vertices, np.concatenate(ends))
        if diagonal.odd_ring or len(np.unique(diagonal.classes[linked])) != 1:
            continue
        for face_side in (1, 0):
            centres = linked & (diagonal.opposite == face_side)
            if rim[centres].any() or np.any(valence[centres] < 3):
                continue
            first = int(np.flatnonzero(body)[0])
            uneven = float(np.abs(valence[centres] - 4).mean())
            kept = bool(not centres[first] and not on_edges[first])
            options.append((uneven, not kept, centres))
    return min(options, key=lambda option: option[:2])[2] if options else None


def _parent(
    mesh: PolyMesh, halfedges: Halfedges, is_face_point: BoolArray, kept: BoolArray
) -> PolyMesh | None:
    """Gather the quads around each face point into a face; None if that is no surface."""
    offsets, corners = corners_in_turn(halfedges, mesh.n_vertices)
    sizes = np.diff(offsets)
    centres = np.flatnonzero(is_face_point)
    size = sizes[centres]
    around = corners[np.repeat(offsets[centres], size) + places_in_groups(size)]
    # From the face point over an edge point to the old vertex.
    old = halfedges.tail[halfedges.next[halfedges.next[around]]]
    if int(size.sum()) != mesh.n_faces or not kept[old].all():
        return None
    number = np.cumsum(kept) - 1
    bounds = np.concatenate([[0], np.cumsum(size)])
    parent = PolyMesh(mesh.vertices[kept], bounds, number[old])
    before, after = check_mesh(mesh), check_mesh(parent)
    same = before.kind == after.kind and after.oriented
    return parent if same and not after.fatal else None


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
    return finished_quads(fitted, "unrefining", notes)


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
    return fitted, sound_faults(source, fitted, None)


def cage_note(paired: PolyMesh, cage: PolyMesh, steps: int) -> str:
    """Say of what the mesh was a refinement."""
    return (
        f"the mesh is a refined cage: undoing {agree(steps, '{n} [step|steps]')} turned its "
        f"{paired.n_faces} faces into {cage.n_faces}, and these were fitted to it"
    )
