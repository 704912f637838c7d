"""Build regular meshes: one number of sides for all faces, one of edges for all vertices."""

from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.bundles import bundle, slit_columns


def regular(face: int, valence: int, genus: int, refine: int, size: float) -> PolyMesh:
    """Return a smooth quad mesh that refines a regular mesh (face, valence, genus).

    One of ``face`` and ``valence`` is 4, the other ``4 k``. The coarse mesh consists of k tori of
    2 c × 1 squares each, slit from square centre to square centre (or, for the dual, from vertex
    to vertex) c times, and glued in a cycle: its genus is ``1 + c (k - 1)``. Its faces are cut
    into grids of quads, so the middles of the big faces, or the vertices of high valence, are
    what keeps ``4 k`` edges.

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

    References
    ----------
    Akleman, Chen, "Regular mesh construction algorithms using regular handles", SMI 2006, for
    the notion; the construction is our own.
    """
    big, small = max(face, valence), min(face, valence)
    sheets = big // 4
    known = (
        "there are only (4, 4, 1) and, with k = 2, 3 or 4, (4k, 4, g) and (4, 4k, g) where g - 1 "
        "is a multiple of k - 1, such as (8, 4, 3), (16, 4, 4) and (4, 12, 5)"
    )
    asked = f"the shape regular: there is no mesh ({face}, {valence}, {genus})"
    if face % 4 or valence % 4 or small != 4:
        raise InputError(f"{asked}; {known}")
    if (genus - 1) % max(sheets - 1, 1) or (genus == 1) != (sheets == 1):
        raise InputError(f"{asked}; {known}")
    rows = 2**refine
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
