"""Build regular meshes: one number of sides for all faces, one of edges for all vertices."""

from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.bundles import bundle, slit_columns
from fabweave.mesh.shapes.tube_nets import necklace


def regular(face: int, valence: int, genus: int, refine: int, size: float) -> PolyMesh:
    """Return a smooth quad mesh that refines a regular mesh (face, valence, genus).

    Where one of ``face`` and ``valence`` is 4 and the other ``4 k``, the coarse mesh consists of k
    tori of 2 c × 1 squares each, slit from square centre to square centre (or, for the dual, from
    vertex to vertex) c times, and glued in a cycle: its genus is ``1 + c (k - 1)``. Where both are
    ``4 k``, it lies on a ring of 2 c nodes, each joined to the next by k tubes, or on a lantern of
    2 k tubes between two poles: its genus is ``1 + 2 c (k - 1)``. Faces are cut into grids of
    quads, so the middles of big faces, and the vertices of high valence, are what keeps ``4 k``
    edges.

    Parameters
    ----------
    face, valence : int
        Sides of every coarse face, and edges of every coarse vertex; multiples of 4.
    genus : int
        Genus.
    refine : int
        Rows around each torus are ``2 ** refine``; columns in proportion.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        The refined mesh, all quads.

    Raises
    ------
    InputError
        If no such mesh is known here; the message says which are.

    Examples
    --------
    >>> import numpy as np
    >>> mesh = regular(8, 4, 3, 2, 100.0)
    >>> np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    [120, 4]
    >>> mesh = regular(12, 12, 5, 2, 100.0)
    >>> np.bincount(np.bincount(mesh.indices))[[4, 12]].tolist()
    [180, 4]

    References
    ----------
    Akleman, Chen, "Regular mesh construction algorithms using regular handles", SMI 2006, for
    the notion; the construction is our own.
    """
    big, small = max(face, valence), min(face, valence)
    sheets = big // 4
    known = (
        "there are only (4, 4, 1) and, with k = 2, 3 or 4, (4k, 4, g) and (4, 4k, g) where g - 1 "
        "is a multiple of k - 1, such as (8, 4, 3), (16, 4, 4) and (4, 12, 5), and (4k, 4k, g) "
        "where g - 1 is an even multiple of k - 1, such as (8, 8, 3) and (12, 12, 5)"
    )
    asked = f"the shape regular: there is no mesh ({face}, {valence}, {genus})"
    if face % 4 or valence % 4 or small not in (4, big):
        raise InputError(f"{asked}; {known}")
    both = 2 if small > 4 else 1
    if (genus - 1) % (both * max(sheets - 1, 1)) or (genus == 1) != (sheets == 1):
        raise InputError(f"{asked}; {known}")
    rows = 2**refine
    if small > 4:
        nodes = (genus - 1) // (sheets - 1)
        along = (sheets + 1 if nodes == 2 else sheets) * rows // 2
        return necklace(sheets, nodes, along, rows // 2, size)
    if sheets == 1:
        return resize_mesh(grids.torus(4 * rows, rows, 4.0, 1.5), size_mm=size)[0]
    slits = (genus - 1) // (sheets - 1)
    slit, window = _columns(sheets, slits, rows)
    inside = slit_columns(slits * (slit + window), slits, slit)
    return bundle(sheets, inside, rows, size)


def _columns(sheets: int, slits: int, rows: int) -> tuple[int, int]:
    """Return even numbers of columns of a slit and of a window for about square quads."""
    if slits == 1:
        return rows // 2, 3 * rows
    return rows, rows if sheets == 2 or slits > 2 else 2 * rows
