"""Join vertices that are at the same place."""

import numpy as np
from scipy.spatial import KDTree

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, offsets_of
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import group_edges
from fabweave.mesh.polymesh import PolyMesh, face_of_corner, previous_corner
from fabweave.mesh.topology import label_links, orient_faces

#: Vertices closer than this share of the bounding box's diagonal are one vertex.
WELD_TOLERANCE = 1e-8


def weld_mesh(mesh: PolyMesh, among: BoolArray | None = None) -> tuple[PolyMesh, int, int]:
    """Join vertices that are at the same place, and drop what collapses.

    Vertices that are linked by a chain of steps within `WELD_TOLERANCE` become one, at the place of
    the first. A corner that repeats the vertex before it is dropped from its face; a face that then
    has fewer than three corners is dropped.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh whose faces name vertices that exist.
    among : (V,) bool array, optional
        Only these vertices are joined.

    Returns
    -------
    mesh : PolyMesh
        Vertices in the order of the first of each group.
    joined : int
        How many vertices disappeared.
    dropped : int
        How many faces disappeared.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> mesh, joined, dropped = weld_mesh(two)
    >>> mesh.faces(), joined, dropped
    ([[0, 1, 2], [1, 3, 2]], 2, 0)
    """
    leader, label = _first_of_each(coincident_groups(mesh.vertices, among))
    indices = label[mesh.indices]
    face = face_of_corner(mesh)
    previous = previous_corner(mesh)
    # What was repeated in the input is the checker's affair: only drop what welding repeats.
    keep = (indices != indices[previous]) | (mesh.indices == mesh.indices[previous])
    sizes = np.bincount(face[keep], minlength=mesh.n_faces)
    stays = (sizes >= 3) | (sizes == mesh.face_sizes)
    keep &= stays[face]
    welded = PolyMesh(mesh.vertices[leader], offsets_of(sizes[stays]), indices[keep])
    return welded, mesh.n_vertices - len(leader), int(np.count_nonzero(~stays))


def coincident_groups(vertices: FloatArray, among: BoolArray | None = None) -> IntArray:
    """Label vertices so that those at the same place share a label, (V,).

    If only some are chosen, each of the others has a label of its own.
    """
    if among is not None:
        group = np.arange(len(vertices))
        chosen = np.flatnonzero(among)
        part = coincident_groups(vertices[chosen])
        leader, label = _first_of_each(part)
        group[chosen] = chosen[leader][label]
        compact: IntArray = np.unique(group, return_inverse=True)[1].astype(np.int64)
        return compact
    group = same_position_groups(vertices)
    leader, label = _first_of_each(group)
    finite = np.flatnonzero(np.isfinite(vertices[leader]).all(axis=1))
    points = vertices[leader[finite]]
    if len(points) < 2:
        return group
    with np.errstate(over="ignore"):
        reach = WELD_TOLERANCE * float(np.linalg.norm(np.ptp(points, axis=0)))
    if not 0 < reach < np.inf:
        return group
    pairs = finite[KDTree(points).query_pairs(reach, output_type="ndarray")]
    if not len(pairs):
        return group
    return label_links(pairs[:, 0], pairs[:, 1], len(leader))[1][label]


def same_position_groups(vertices: FloatArray) -> IntArray:
    """Label vertices so that those at exactly the same position share a label, (V,).

    Positions that are not numbers are all different.

    Examples
    --------
    >>> import numpy as np
    >>> same_position_groups(np.array([[0.0, 0, 1], [2, 0, 1], [-0.0, 0, 1]])).tolist()
    [0, 1, 0]
    """
    points = vertices + 0.0  # minus zero is zero
    order = np.lexsort(points.T[::-1])
    rows = points[order]
    new = np.ones(len(rows), dtype=np.int64)
    new[1:] = np.any(rows[1:] != rows[:-1], axis=1)
    group = np.empty(len(rows), dtype=np.int64)
    group[order] = np.cumsum(new) - 1
    return group


def _first_of_each(group: IntArray) -> tuple[IntArray, IntArray]:
    """Return the first member of each group in order, and each member's place in that list."""
    _, first, number = np.unique(group, return_index=True, return_inverse=True)
    leader = np.sort(first)
    return leader, np.searchsorted(leader, first)[number]


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
        among = flags(mesh.n_vertices, group_edges(mesh).rim)
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
