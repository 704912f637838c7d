"""Turn the faces of a mesh so that neighbours agree."""

import numpy as np

from fabweave.core.arrays import BoolArray, IntArray
from fabweave.mesh.polymesh import PolyMesh, face_of_corner
from fabweave.mesh.topology import EdgeGroups, label_links


def face_patches(edges: EdgeGroups, n_faces: int) -> IntArray:
    """Return the component, by shared edges, of each face, (F,).

    Examples
    --------
    >>> from fabweave.mesh.topology import group_edges
    >>> mesh = PolyMesh.from_faces([[0, 0, 0]] * 6, [[0, 1, 2], [3, 4, 5], [1, 0, 3]])
    >>> face_patches(group_edges(mesh), 3).tolist()
    [0, 1, 0]
    """
    first, second = edges.pairs
    return label_links(edges.face[first], edges.face[second], n_faces)[1]


def orient_faces(edges: EdgeGroups, n_faces: int) -> tuple[BoolArray, BoolArray]:
    """Find which faces to turn so that neighbours run along a common edge in opposite directions.

    The double cover holds every face twice, as it is and turned; neighbours that agree are
    linked on each sheet, neighbours that disagree across the sheets. A component of the mesh is
    orientable exactly if its cover falls into two components; on a Möbius strip it is one.
    Edges with more than two faces link nothing.

    Parameters
    ----------
    edges : EdgeGroups
        The edges.
    n_faces : int
        Number of faces.

    Returns
    -------
    turned : (F,) bool array
        Faces to turn; in each component the majority stays, and in a tie its first face.
    one_sided : (F,) bool array
        Faces of components that cannot be oriented.

    Examples
    --------
    >>> from fabweave.mesh.topology import group_edges
    >>> flipped = PolyMesh.from_faces([[0, 0, 0]] * 5, [[0, 1, 2], [0, 1, 3], [1, 4, 3]])
    >>> [values.tolist() for values in orient_faces(group_edges(flipped), 3)]
    [[True, False, False], [False, False, False]]
    """
    first, second = edges.pairs
    one, two = edges.face[first], edges.face[second]
    patch = face_patches(edges, n_faces)
    across = np.where(edges.tail[first] == edges.tail[second], n_faces, 0)
    links_from = np.concatenate([one, one + n_faces])
    links_to = np.concatenate([two + across, two + n_faces - across])
    label = label_links(links_from, links_to, 2 * n_faces)[1]
    one_sided = label[:n_faces] == label[n_faces:]
    # Labels grow with the first node, so the first face of each patch is never turned here.
    turned = label[:n_faces] > label[n_faces:]
    minority_stays = 2 * np.bincount(patch, weights=turned) > np.bincount(patch)
    return (turned ^ minority_stays[patch]) & ~one_sided, one_sided


def turn_faces(mesh: PolyMesh, turned: BoolArray) -> PolyMesh:
    """Reverse some faces; each keeps its first corner.

    Examples
    --------
    >>> import numpy as np
    >>> quad = PolyMesh.from_faces([[0, 0, 0]] * 4, [[0, 1, 2, 3]])
    >>> turn_faces(quad, np.array([True])).faces()
    [[0, 3, 2, 1]]
    """
    face = face_of_corner(mesh)
    start = mesh.offsets[:-1][face]
    size = mesh.face_sizes[face]
    place = np.arange(mesh.n_corners) - start
    mirrored = start + (size - place) % np.maximum(size, 1)
    source = np.where(turned[face], mirrored, np.arange(mesh.n_corners))
    return PolyMesh(mesh.vertices, mesh.offsets, mesh.indices[source])
