"""Build rings of strands that flow together again and again: cyclic slit sums of quad tori."""

import math

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags
from fabweave.core.errors import InputError
from fabweave.mesh.one_rings import mean_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.shapes.soft_tubes import settle, soft_tubes
from fabweave.mesh.upright import resize_mesh

# In radii of a strand: width of the bell that rounds it off; half the distance at which two
# strands flow together, which follows from that width; half the distance where they are closest.
_BLEND = 0.8
_MERGE = (1 + _BLEND**2 * math.log(2)) ** 0.5
_TOUCH = 0.8
# How much larger the ring is than what runs around it, at least.
_ROOM = 1.35


def slit_columns(m: int, slits: int, slit: int) -> BoolArray:
    """Return which columns of a torus are slit, spread evenly around, (m,).

    Examples
    --------
    >>> slit_columns(8, 2, 2).astype(int).tolist()
    [1, 1, 0, 0, 1, 1, 0, 0]
    """
    first = np.arange(slits) * m // slits
    return flags(m, (first[:, None] + np.arange(slit)) % m)


def bundle_quads(sheets: int, inside: BoolArray, n: int) -> tuple[IntArray, IntArray]:
    """Return the quads of tori glued along slits, and where their vertices come from.

    Torus ``i`` has a slit along its line 0 wherever ``inside`` says so. The bank of the slit that
    ends row ``n - 1`` is glued to the bank that begins row 0 of torus ``i + 1``, so each end of a
    slit becomes one vertex of valence ``4 · sheets`` and all other vertices keep four edges.

    Parameters
    ----------
    sheets : int
        Number of tori.
    inside : (m,) bool array
        Which of the columns are slit.
    n : int
        Rows around each torus.

    Returns
    -------
    quads : (sheets · m · n, 4) int array
        Vertex numbers, counter-clockwise where columns run right and rows run up.
    corners : (sheets · m · n, 4) int array
        For the same corners, the number in the uncut tori: ``(i · m + x) · (n + 1) + y``.

    Examples
    --------
    Two tori and two slits have genus 3:

    >>> quads, _ = bundle_quads(2, slit_columns(8, 2, 2), 4)
    >>> len(quads) - 2 * len(quads) + len(np.unique(quads))
    -4
    """
    m = len(inside)
    grid = grid_quads(m, n, wrap=(True, False))
    corners = (np.arange(sheets)[:, None, None] * (m * (n + 1)) + grid).reshape(-1, 4)
    number = np.arange(sheets * m * (n + 1)).reshape(sheets, m, n + 1)
    before = np.roll(inside, 1)
    middle, ends = inside & before, inside != before
    number[:, :, n] = number[:, :, 0]
    number[:, middle, n] = np.roll(number[:, :, 0], -1, axis=0)[:, middle]
    number[:, ends, 0] = number[:1, ends, 0]
    number[:, ends, n] = number[:1, ends, 0]
    known = np.unique(number.reshape(-1)[corners])
    return np.searchsorted(known, number.reshape(-1)[corners]), corners


def bundle(sheets: int, inside: BoolArray, n: int, size: float) -> PolyMesh:
    """Return strands in a ring that flow together at every slit and part at every window.

    The combinatorics are those of `bundle_quads`: a cyclic slit sum, of genus
    ``1 + slits · (sheets - 1)``. In space, strands run side by side around a ring; with a single
    slit, each strand is a ring of its own, and all meet at the axis between them.

    Parameters
    ----------
    sheets : int
        Number of strands, 2 or more.
    inside : (m,) bool array
        Which of the m columns are slit; slits and windows each at least two columns wide.
    n : int
        Rows around each strand.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``sheets · m · n`` quads.

    Examples
    --------
    >>> mesh = bundle(2, slit_columns(16, 2, 4), 6, 100.0)
    >>> mesh.n_faces, np.ptp(mesh.vertices, axis=0).max().round(6)
    (192, np.float64(100.0))
    """
    quads, corners = bundle_quads(sheets, inside, n)
    before = np.roll(inside, 1)
    single = np.count_nonzero(inside & ~before) == 1
    curves, inward, across = (_petals if single else _waves)(sheets, inside, n)
    radius = n / (2 * math.pi)
    # The banks of a slit lie on one line as yet; turned apart, each knows its side.
    first = np.where(inside & before, math.pi / 2 - math.pi / sheets + 0.4, 0.0)[:, None]
    angles = first + (1 - first / math.pi) * np.arange(n + 1) * (2 * math.pi / n)
    places = (
        curves[:, :, None]
        + radius * np.cos(angles)[None, :, :, None] * inward[:, :, None]
        - radius * np.sin(angles)[None, :, :, None] * across[:, :, None]
    )
    # Each vertex is put at the mean of the places in the uncut tori that it comes from.
    vertex, source = np.unique(np.stack([quads.ravel(), corners.ravel()]), axis=1)
    mesh = PolyMesh.from_faces(mean_at(vertex, places.reshape(-1, 3)[source]), quads)
    blend = _BLEND * radius
    surface = soft_tubes(list(curves), radius=radius, blend=blend, closed=True)
    if sheets > 2:
        # Without a core, neighbours would meet before the middle closes, and leave a dimple.
        cores = _cores(curves.mean(axis=0), inside)
        surface |= soft_tubes(cores, radius=radius, blend=blend, closed=False)
    return resize_mesh(settle(mesh, surface), size_mm=size)[0]


def _petals(sheets: int, inside: BoolArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return rings that stand around an axis and nearly touch there, in the middle of the slit.

    Also return the directions in which line 0 of each torus lies, and across them; all
    (sheets, m, 3).
    """
    m = len(inside)
    radius, ring = n / (2 * math.pi), m / (2 * math.pi)
    start = np.flatnonzero(inside & ~np.roll(inside, 1))[0]
    turn = (np.arange(m) - start - np.count_nonzero(inside) / 2) * (2 * math.pi / m)
    side = np.arange(sheets) * (2 * math.pi / sheets)
    # Two rings lie flat; more stand upright.
    axis, other = (1, 2) if sheets == 2 else (2, 1)
    out, across = np.zeros((2, sheets, 1, 3))
    out[:, 0, 0], out[:, 0, other] = np.cos(side), np.sin(side)
    up = np.zeros(3)
    up[axis] = 1.0 if sheets > 2 else -1.0
    across[:] = np.cross(out, -up)
    inward = -np.cos(turn)[:, None] * out - np.sin(turn)[:, None] * up
    near = _TOUCH * radius / math.sin(math.pi / sheets)
    curves = (near + ring) * out + ring * inward
    return curves, inward, np.broadcast_to(across, curves.shape)


def _waves(sheets: int, inside: BoolArray, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return strands around a circle, apart at windows and close together at slits.

    Also return the directions in which line 0 of each torus lies, and across them; all
    (sheets, m, 3).
    """
    m = len(inside)
    radius = n / (2 * math.pi)
    apart = (_MERGE * radius + _bulge(inside, radius)) / math.sin(math.pi / sheets)
    ring = max(m / (2 * math.pi), _ROOM * (apart.max() + radius))
    turn = np.arange(m) * (2 * math.pi / m)
    side = (np.arange(sheets) / sheets + 0.25)[:, None, None] * (2 * math.pi)
    outer = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(m)])
    up = np.array([0.0, 0.0, 1.0])
    out = np.cos(side) * outer + np.sin(side) * up
    across = np.cos(side) * up - np.sin(side) * outer
    return ring * outer + apart[:, None] * out, -out, across


def _bulge(inside: BoolArray, radius: float) -> FloatArray:
    """Return a wave over the columns: 0 at the ends of slits, below in slits, above in windows."""
    m = len(inside)
    bounds = np.flatnonzero(inside != np.roll(inside, 1))
    wave = np.zeros(m)
    for start, stop in zip(bounds, np.append(bounds[1:], bounds[0] + m), strict=True):
        place = np.arange(start, stop)
        high = 0.2 * (stop - start)
        if inside[start]:
            depth = -min(high, 0.6 * radius)
        else:
            depth = min(max(high, 0.9 * radius), 2 * radius)
        wave[place % m] = depth * np.sin(np.pi * (place - start) / (stop - start))
    return wave


def _cores(middle: FloatArray, inside: BoolArray) -> list[FloatArray]:
    """Return the middle of all strands along each slit, without the ends of the slit."""
    m = len(inside)
    bounds = np.flatnonzero(inside != np.roll(inside, 1))
    cores = []
    for start, stop in zip(bounds, np.append(bounds[1:], bounds[0] + m), strict=True):
        if inside[start]:
            along = start + (stop - start) * np.linspace(0.2, 0.8, 9)
            ring = [np.interp(along, np.arange(2 * m), np.tile(middle[:, k], 2)) for k in range(3)]
            cores.append(np.column_stack(ring))
    return cores


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
