"""Join vertices that are at the same place."""

import math

import numpy as np
from scipy.spatial import KDTree

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, offsets_of
from fabweave.core.messages import agree
from fabweave.core.units import parse_length
from fabweave.mesh.halfedge import EdgeGroups, group_edges
from fabweave.mesh.polymesh import PolyMesh, face_of_corner, previous_corner
from fabweave.mesh.topology import label_links, orient_faces

#: Vertices closer than this share of the bounding box's diagonal are one vertex.
WELD_TOLERANCE = 1e-8


def weld_mesh(
    mesh: PolyMesh, among: BoolArray | None = None, reach: float | None = None
) -> tuple[PolyMesh, int, int]:
    """Join vertices that are at the same place, and drop what collapses.

    Vertices that are linked by a chain of short steps become one, at the place of the first. A
    corner that repeats the vertex before it is dropped from its face; a face that then has fewer
    than three corners is dropped.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh whose faces name vertices that exist.
    among : (V,) bool array, optional
        Only these vertices are joined.
    reach : float, optional
        How long a step is at most; `WELD_TOLERANCE` of the bounding box's diagonal if not given.

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
    leader, label = _first_of_each(coincident_groups(mesh.vertices, among, reach))
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


def coincident_groups(
    vertices: FloatArray, among: BoolArray | None = None, reach: float | None = None
) -> IntArray:
    """Label vertices so that those at the same place share a label, (V,).

    If only some are chosen, each of the others has a label of its own.
    """
    if among is not None:
        group = np.arange(len(vertices))
        chosen = np.flatnonzero(among)
        part = coincident_groups(vertices[chosen], reach=reach)
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
    if reach is None:
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


#: Boundaries are welded within this share of the bounding box's diagonal, which is more than single
#: precision and six decimals leave; and a wider distance is proposed if it is below the other.
NEAR, _PROPOSED = 5e-6, 1e-3


def parse_weld(text: str) -> float:
    """Return within how many millimetres vertices are joined: 0 for none, infinity for equal ones.

    Raises
    ------
    InputError
        If the text is not all, none, or a length.

    Examples
    --------
    >>> parse_weld("none"), parse_weld("all"), parse_weld("0.01mm")
    (0.0, inf, 0.01)
    """
    if text in _WORDS:
        return _WORDS[text]
    return parse_length(text)


_WORDS = {"none": 0.0, "all": math.inf}


def weld_seams(
    mesh: PolyMesh, wanted: str | None, scale_mm: float = 1.0
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Join vertices at the same place, where that is wanted or closes boundaries.

    Programs write a vertex once for each normal or texture coordinate that it has. The faces along
    such a seam then share no edge, and the mesh falls apart into many pieces with boundaries that
    lie on one another. Two boundary edges whose ends lie at the same places become one. Where parts
    only touch at vertices, nothing is joined unless it is wanted.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh whose faces name vertices that exist.
    wanted : str or None
        As ``--weld`` says it: all vertices at the same place, or within a length, or none; with
        None, the seams of boundaries.
    scale_mm : float
        How many millimetres one unit of the mesh will be.

    Returns
    -------
    mesh : PolyMesh
        The same object if nothing was joined.
    notes : tuple of str
        What was done, or could be.

    Examples
    --------
    >>> two = PolyMesh.from_faces(
    ...     [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
    ...     [[0, 1, 2], [3, 4, 5]])
    >>> weld_seams(two, None)[0].n_vertices, weld_seams(two, "none")[0].n_vertices
    (4, 6)
    """
    within_mm = None if wanted is None else parse_weld(wanted)
    if within_mm == 0.0 or not mesh.n_faces:
        return mesh, ()
    diagonal = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    among: BoolArray | None = None
    reach: float | None = None
    notes = []
    if within_mm is None:
        edges = group_edges(mesh)
        reach = NEAR * diagonal
        among = _seam_ends(mesh, edges, reach)
        left = np.count_nonzero(flags(mesh.n_vertices, edges.rim) & ~among)
        if left > np.count_nonzero(among):
            wider = _seam_ends(mesh, edges, _PROPOSED * diagonal)
            notes += _proposal(mesh, edges, wider & ~among, diagonal, scale_mm)
    elif np.isfinite(within_mm):
        reach = within_mm / scale_mm
    welded, joined, dropped = weld_mesh(mesh, among, reach)
    if not joined or (wanted is None and _is_one_sided(welded) and not _is_one_sided(mesh)):
        # A surface that its maker cut open can be woven; one-sided as it would be, it cannot.
        return mesh, tuple(notes)
    said = agree(
        joined, "{n} [vertex was|vertices were] at the same place as another and merged with it"
    )
    if wanted is None:
        said += " where boundaries lie on one another (--weld none leaves them apart)"
    notes.insert(0, said)
    if dropped:
        notes.append(
            agree(
                dropped, "{n} [face|faces] collapsed to a line or a point and [was|were] left out"
            )
        )
    return welded, tuple(notes)


def _seam_ends(mesh: PolyMesh, edges: EdgeGroups, reach: float) -> BoolArray:
    """Return which vertices are ends of two boundary edges that lie on one another, (V,).

    Or of one that is a point, as at the poles of a sphere.
    """
    half = edges.first[edges.sizes == 1]
    group = coincident_groups(mesh.vertices, flags(mesh.n_vertices, edges.rim), reach)
    tail, head = group[edges.tail[half]], group[edges.head[half]]
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    _, number, copies = np.unique(
        low * mesh.n_vertices + high, return_inverse=True, return_counts=True
    )
    met = half[(copies[number] == 2) | (low == high)]
    return flags(mesh.n_vertices, np.concatenate([edges.tail[met], edges.head[met]]))


def _proposal(
    mesh: PolyMesh, edges: EdgeGroups, ends: BoolArray, diagonal: float, scale_mm: float
) -> list[str]:
    """Return the distance that would close most of what is open, if there is one."""
    count = int(np.count_nonzero(ends))
    if 2 * count < len(edges.rim):
        return []
    points = mesh.vertices[ends]
    pairs = KDTree(points).query_pairs(_PROPOSED * diagonal, output_type="ndarray")
    apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    nearest = np.full(count, np.inf)
    for side in pairs.T:
        np.minimum.at(nearest, side, apart)
    nearest = nearest[np.isfinite(nearest)]
    if 2 * len(nearest) < len(edges.rim):
        return []
    count, most_mm = len(nearest), float(nearest.max()) * scale_mm
    # A round length, so much above that chains of three are within it.
    step = 10.0 ** np.floor(np.log10(most_mm))
    wide_mm = next(step * k for k in (1, 2, 5, 10, 20) if step * k >= 1.5 * most_mm)
    return [
        f"{count} of {len(edges.rim)} vertices at boundaries have another within {most_mm:.2g} mm; "
        f"--weld {wide_mm:.2g}mm merges them"
    ]


def _is_one_sided(mesh: PolyMesh) -> bool:
    """Tell whether a surface has no outside, like a Möbius strip."""
    edges = group_edges(mesh)
    return bool(len(edges.same_way) and orient_faces(edges, mesh.n_faces)[1].any())
