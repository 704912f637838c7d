"""Find vertices that a file splits although the surface goes on there, and join them."""

import numpy as np

from fabweave.core.arrays import BoolArray
from fabweave.core.messages import agree
from fabweave.mesh.orient import orient_faces
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import group_edges
from fabweave.mesh.weld import coincident_groups, weld_mesh

#: Boundaries are welded if more than this share of their vertices have another at the same place.
_MOST = 0.5


def weld_seams(mesh: PolyMesh, wanted: bool | None) -> tuple[PolyMesh, tuple[str, ...]]:
    """Join vertices at the same place, where that is wanted or the mesh looks as if it were.

    Programs write a vertex once for each normal or texture coordinate that it has. The faces along
    such a seam then share no edge, and the mesh falls apart into many pieces with boundaries that
    lie on one another. Where parts only touch, few vertices of boundaries coincide, and nothing is
    joined unless it is wanted.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh.
    wanted : bool or None
        Join all vertices at the same place, or none; with None, those of boundaries, if most of
        them have another one at the same place.

    Returns
    -------
    mesh : PolyMesh
        The same object if nothing was joined.
    notes : tuple of str
        What was done.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> weld_seams(two, None)[0].n_vertices, weld_seams(two, False)[0].n_vertices
    (4, 6)
    """
    names_what_is_not = (mesh.indices < 0) | (mesh.indices >= mesh.n_vertices)
    if wanted is False or not mesh.n_faces or names_what_is_not.any():
        return mesh, ()
    among: BoolArray | None = None
    if wanted is None:
        among = np.zeros(mesh.n_vertices, dtype=bool)
        edges = group_edges(mesh)
        among[edges.ends(np.flatnonzero(edges.sizes == 1)).ravel()] = True
        group = coincident_groups(mesh.vertices[among])
        alike = int(np.count_nonzero(np.bincount(group)[group] > 1)) if len(group) else 0
        if alike <= _MOST * len(group):
            return mesh, ()  # the check of the mesh says how many there are
    welded, joined, dropped = weld_mesh(mesh, among)
    if not joined or (wanted is None and _is_one_sided(welded) and not _is_one_sided(mesh)):
        # A surface that its maker cut open can be woven; one-sided as it would be, it cannot.
        return mesh, ()
    note = agree(
        joined, "{n} [vertex was|vertices were] at the same place as another and merged with it"
    )
    if wanted is None:
        note += (
            f": {alike} of {len(group)} vertices at boundaries coincided, as where normals or "
            "textures change (--no-weld leaves them apart)"
        )
    notes = [note]
    if dropped:
        notes.append(
            agree(
                dropped, "{n} [face|faces] collapsed to a line or a point and [was|were] left out"
            )
        )
    return welded, tuple(notes)


def _is_one_sided(mesh: PolyMesh) -> bool:
    """Tell whether a surface has no outside, like a Möbius strip."""
    edges = group_edges(mesh)
    return bool(len(edges.same_way) and orient_faces(edges, mesh.n_faces)[1].any())
