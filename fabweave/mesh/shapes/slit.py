"""Build slit sums: surfaces of any genus from 1 that are exactly twillable."""

import math

from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.bundles import bundle, slit_columns


def slit_sum(genus: int, m: int, n: int, slit: int, size: float) -> PolyMesh:
    """Return the sum of two m × n quad tori along ``genus - 1`` slits.

    Each slit of one torus is glued crosswise to a slit of the other, so its ends become vertices
    of valence 8 and all others keep four edges. Two tori glued once have genus 2, and every
    further slit adds one. The surface has an exact 2/2 twill: along every closed way over its
    quads, directions come back to themselves as on the tori, and so does the pattern, as m or n
    is even.

    Parameters
    ----------
    genus : int
        Genus, 1 for the torus itself.
    m, n : int
        Quads along and around each torus, one of them even; 0 chooses.
    slit : int
        Edges of each slit, 2 or more; 0 chooses.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        Two rings side by side (genus 2), or a bracelet of two strands with windows between.

    Raises
    ------
    InputError
        If the counts do not fit together.

    Examples
    --------
    >>> mesh = slit_sum(3, 32, 8, 8, 100.0)
    >>> mesh.n_faces - mesh.n_vertices
    4

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), section 8, claims exact biaxial twill for every genus; this construction is our own.
    """
    slits = genus - 1
    m = m or max(4, 2 * math.ceil(16 / max(slits, 1))) * max(slits, 1)
    n = n or min(12, max(8, m // 20 * 2))
    if m % 2 and n % 2:
        raise InputError(
            f"the shape slit: m ({m}) and n ({n}) are both odd, so it cannot be woven in twill; "
            "make one of them even"
        )
    for name, count in (("m", m), ("n", n)):
        if count < 3:
            raise InputError(f"the shape slit: {name} must be 0, or 3 or more, but is {count}")
    if not slits:
        ring, tube = m / (2 * math.pi), min(n / (2 * math.pi), 0.3 * m / math.pi)
        return resize_mesh(grids.torus(m, n, ring, tube), size_mm=size)[0]
    if not slit and slits == 1:
        slit = max(2, round(0.285 * (m * n) ** 0.5))
    slit = slit or max(2, m // slits // 2)
    if slit < 2 or m // slits < slit + 2:
        raise InputError(
            f"the shape slit: {slits} slits of {slit} edges, with two or more between them, do "
            f"not fit on a ring of {m} quads; choose slit=2 or more, and m={slits * (slit + 2)} or "
            "more"
        )
    return bundle(2, slit_columns(m, slits, slit), n, size)
