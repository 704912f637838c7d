"""Build shapes of tubes that carry an exact twill.

Rings of strands flow together again and again (cyclic slit sums of quad tori). Nets of tubes on a
sphere have nodes at which an even number of tubes meet. The opposite faces of a bipyramid are
joined by handles through its body.
"""

import math

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    any_normals,
    flags,
    places_in_groups,
    unit,
)
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.one_rings import mean_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.shapes.soft_tubes import SoftTubes, settle, soft_tubes
from fabweave.mesh.upright import resize_mesh

# In radii of a tube: width of the bell that rounds it off; half the distance at which two strands
# flow together, which follows from that width; half the distance where they are closest.
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


#: Samples of each curve from node to node.
_SAMPLES = 33
#: Radius of tubes: of those between nodes on a polyhedron, of meridians, and of tubes between nodes
#: on the equator; all as shares of how far curves are from one another.
_ON_SOLID, _ON_POLES, _ON_EQUATOR = 0.12, 0.17, 0.13
#: Over this share of a tube's length it widens to its node.
_FLARE = 0.5
#: By number of faces; the dual of a solid has the same edges' middles.
_SOLIDS = {4: solids.tetrahedron, 6: solids.cube, 12: solids.dodecahedron}


def cage(faces: int, m: int, n: int, size: float) -> PolyMesh:
    """Return tubes that join the middles of neighbouring edges of a regular polyhedron.

    Four tubes meet at each of the E nodes, where E is the number of edges, so the genus is E + 1.
    Each tube has a line along its outside and one along its inside, and these lines meet in two
    vertices of valence 8 at each node, outside and inside; between them the tube's two sides are
    quads: a regular mesh (4, 8, E + 1). Neighbouring tubes can be given opposite directions (around
    the solid's faces one way, around its vertices the other), so quads keep theirs around every
    loop, and the mesh has an exact 2/2 twill if m or n / 2 is even.

    Parameters
    ----------
    faces : int
        Faces of the polyhedron: 4, 6 or 12. Tubes run along the edges of an octahedron, of a
        cuboctahedron or of an icosidodecahedron.
    m, n : int
        Quads along and around each tube, n even; m may be 0, for quads that are about square.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``2 E · m · n`` quads.

    Raises
    ------
    InputError
        If there is no such polyhedron, or the counts do not fit.

    Examples
    --------
    >>> mesh = cage(4, 6, 8, 100.0)
    >>> mesh.n_vertices - mesh.n_faces, np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    (-12, [552, 12])
    """
    if faces not in _SOLIDS:
        raise InputError(
            f"the shape cage: no regular polyhedron with {faces} faces is known here; choose 4, 6 "
            "or 12 (8 gives the same net as 6, and 20 the same as 12)"
        )
    m = m or n
    if n % 2 or (m % 2 and n % 4):
        raise InputError(
            f"the shape cage: n ({n}) must be even, and for a twill m ({m}) or n / 2 as well; make "
            "n a multiple of 4"
        )
    solid = _SOLIDS[faces]()
    half = build_halfedges(solid)
    heads = half.tail[half.next]
    middle = unit(solid.vertices[half.tail] + solid.vertices[heads])
    nodes = np.zeros((half.n_edges, 3))
    nodes[half.edge] = middle
    ends = np.column_stack((half.edge, half.edge[half.next]))
    curves = _great_arcs(nodes[ends[:, 0]], nodes[ends[:, 1]])
    apart = math.acos(float(nodes[ends[0, 0]] @ nodes[ends[0, 1]]))
    mesh = tube_net(nodes, ends, curves, _ON_SOLID * apart, along=m, across=n // 2)
    return resize_mesh(mesh, size_mm=size)[0]


def necklace(tubes: int, nodes: int, along: int, across: int, size: float) -> PolyMesh:
    """Return nodes in a ring, each joined to the next one by some tubes.

    With an even number of nodes, the outer vertex of one node and the inner one of the next can be
    of one sort, and the others of the other: each quad between them joins two of either sort. One
    sort are the vertices of a regular mesh, the other are the middles of its faces:
    (4 k, 4 k, 1 + nodes (k - 1)), where k is the number of tubes. Two nodes are the poles of a
    lantern of 2 k tubes.

    Parameters
    ----------
    tubes : int
        Tubes between neighbours, 2 or more.
    nodes : int
        Number of nodes, even.
    along, across : int
        Quads along each tube, and over half of its circumference.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``2 · nodes · tubes · along · across`` quads.

    Examples
    --------
    >>> mesh = necklace(2, 4, 8, 4, 100.0)
    >>> mesh.n_vertices - mesh.n_faces, np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    (-8, [496, 8])
    """
    share = np.linspace(0.0, 1.0, _SAMPLES)
    if nodes == 2:
        radius = _ON_POLES * math.pi / tubes
        turn: FloatArray = np.arange(2.0 * tubes)[:, None] * (math.pi / tubes)
        places = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
        ends = np.tile([0, 1], (2 * tubes, 1))
        curves = _on_sphere(turn, math.pi * (0.5 - share))
    else:
        step = 2.0 * math.pi / nodes
        radius = 2.0 * _ON_EQUATOR * step / tubes
        first = step * np.repeat(np.arange(nodes), tubes)
        # Tubes leave a node with equal angles between them.
        way = (np.arange(tubes) - (tubes - 1) / 2) * (math.pi / tubes)
        rise = np.tile(np.tan(way), nodes) * step / math.pi
        ends = np.repeat(np.arange(nodes), tubes)
        ends = np.column_stack((ends, (ends + 1) % nodes))
        turn = first[:, None] + step * share
        curves = _on_sphere(turn, rise[:, None] * np.sin(math.pi * share))
        places = _on_sphere(step * np.arange(float(nodes)), np.zeros(nodes))
    mesh = tube_net(places, ends, curves, radius, along=along, across=across)
    return resize_mesh(mesh, size_mm=size)[0]


def tube_net(
    nodes: FloatArray, ends: IntArray, curves: FloatArray, radius: float, *, along: int, across: int
) -> PolyMesh:
    """Return the surface of tubes along curves on the unit sphere, as quads.

    Each tube is two strips, left and right of its line along the outside. Strips that are
    neighbours at a node share a line there, from the outer vertex of the node to the inner one.

    Parameters
    ----------
    nodes : (N, 3) float array
        Places on the unit sphere.
    ends : (T, 2) int array
        The nodes that each tube joins.
    curves : (T, S, 3) float array
        Places along each tube on the unit sphere, from node to node.
    radius : float
        Radius of tubes, where the sphere has 1.
    along, across : int
        Quads along each strip, and across it.

    Returns
    -------
    PolyMesh
        Two vertices at each node with twice as many edges as tubes, and all others with four.
    """
    count, tubes = len(nodes), len(ends)
    # Half-tubes leave their nodes, 2 t the first end of tube t, and 2 t + 1 the other.
    leaving = np.stack((curves[:, 1] - curves[:, 0], curves[:, -2] - curves[:, -1]), axis=1)
    node = ends.reshape(-1)
    after, wedge = _around_nodes(nodes[node], leaving.reshape(-1, 3), node)
    before = np.argsort(after)
    # The corner of a half-tube lies to its left, as seen from outside.
    first, last = 2 * np.arange(tubes), 2 * np.arange(tubes) + 1
    inner = across - 1
    number = np.empty((2, tubes, along + 1, across + 1), dtype=np.int64)
    crotch = 2 * count + inner * np.arange(2 * tubes)[:, None] + np.arange(inner)
    total = 2 * count + 2 * tubes * inner
    lines = total + np.arange(2 * tubes * (along - 1)).reshape(2, tubes, -1)
    total += lines.size
    number[:, :, 1:-1, 1:-1] = total + np.arange(2 * tubes * (along - 1) * inner).reshape(
        2, tubes, along - 1, inner
    )
    for side, corners in enumerate(((first, before[last]), (before[first], last))):
        for end, corner in zip((0, -1), corners, strict=True):
            number[side, :, end, 0] = ends[:, end]
            number[side, :, end, -1] = count + ends[:, end]
            number[side, :, end, 1:-1] = crotch[corner]
        number[side, :, 1:-1, 0], number[side, :, 1:-1, -1] = lines
    grid = grid_quads(along, across, wrap=(False, False))
    quads = number.reshape(2, tubes, -1)[:, :, grid]
    quads = np.concatenate((quads[0], quads[1][..., ::-1])).reshape(-1, 4)
    ways = np.stack((wedge[first], wedge[before[last]], wedge[before[first]], wedge[last]))
    places = _net_places(curves, ways.reshape(2, 2, tubes, 3), radius, along, across)
    mesh = PolyMesh.from_faces(mean_at(number.reshape(-1), places), quads)
    surface = soft_tubes(list(curves), radius=radius, blend=_BLEND * radius, closed=False)
    return settle(mesh, surface)


def _around_nodes(
    nodes: FloatArray, leaving: FloatArray, node: IntArray
) -> tuple[IntArray, FloatArray]:
    """Return the half-tube to the left of each, and the way to the corner between, in radii."""
    first = any_normals(nodes)
    up = np.cross(nodes, first)
    angle = np.arctan2((leaving * up).sum(axis=1), (leaving * first).sum(axis=1))
    order = np.lexsort((angle, node))
    starts = np.flatnonzero(np.diff(node[order], prepend=-1))
    following = np.roll(order, -1)
    following[np.append(starts[1:], len(order)) - 1] = order[starts]
    after = np.empty_like(order)
    after[order] = following
    half = np.mod(angle[after] - angle, 2.0 * math.pi) / 2.0
    turn = angle + half
    way = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * up
    return after, way / np.sin(half)[:, None]


def _net_places(
    curves: FloatArray, ways: FloatArray, radius: float, along: int, across: int
) -> FloatArray:
    """Return where the corners of the quads of all strips stand at first, left strips first."""
    share = np.linspace(0.0, _SAMPLES - 1.0, along + 1)
    low = np.minimum(share.astype(np.int64), _SAMPLES - 2)
    part = (share - low)[:, None]
    middle = curves[:, low] * (1.0 - part) + curves[:, low + 1] * part
    out = unit(middle)
    left = unit(np.cross(out, curves[:, low + 1] - curves[:, low]))
    turn = np.linspace(0.0, math.pi, across + 1)[:, None]
    near = np.maximum(0.0, 1.0 - np.linspace(0.0, 1.0 / _FLARE, along + 1))[:, None]
    places = []
    for side, (begin, end) in zip((left, -left), ways, strict=True):
        wide = side + near * (begin[:, None] - side) + near[::-1] * (end[:, None] - side)
        ring = np.cos(turn) * out[:, :, None] + np.sin(turn) * wide[:, :, None]
        places.append(middle[:, :, None] + radius * ring)
    return np.concatenate(places).reshape(-1, 3)


def _great_arcs(start: FloatArray, stop: FloatArray) -> FloatArray:
    """Return places along the shorter great arcs between places on the unit sphere."""
    angle = np.arccos((start * stop).sum(axis=1))[:, None, None]
    share = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    parts = np.sin((1.0 - share) * angle) * start[:, None] + np.sin(share * angle) * stop[:, None]
    return np.asarray(parts / np.sin(angle))


def _on_sphere(turn: FloatArray, rise: FloatArray) -> FloatArray:
    """Return places on the unit sphere by longitude and latitude, in radians."""
    turn, rise = np.broadcast_arrays(turn, rise)
    flat = np.cos(rise)
    return np.stack((flat * np.cos(turn), flat * np.sin(turn), np.sin(rise)), axis=-1)


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


def handled_bipyramid(n: int, edge: int, handle: int, height: float, size: float) -> PolyMesh:
    """Return a 2n-gonal bipyramid with a handle from each upper face to the face below.

    The coarse mesh has the 2n + 2 vertices of the bipyramid, and three quads along each of its
    2n handles, which replace all triangles: the tips have valence 4n, the other vertices 8, and
    the genus is 2n. Each quad is cut into ``edge × handle`` small ones. In space, handles are
    tunnels straight through, so that a wheel with 2n fins remains; each rim segment is a handle's
    outer wall. Faces of the bipyramid fall into two classes like a chess board's squares, and
    handles join the two: hence quads keep their directions around every loop, and the mesh has an
    exact 2/2 twill if ``edge`` or ``handle`` is even.

    Parameters
    ----------
    n : int
        Half the number of sides, 2 or more.
    edge, handle : int
        Small quads along each edge of the bipyramid and along each handle, one of them even.
    height : float
        Distance between the tips, relative to the diameter of the rim.
    size : float
        Largest dimension.

    Returns
    -------
    PolyMesh
        A closed surface of ``6 n · edge · handle`` quads.

    Raises
    ------
    InputError
        If edge and handle are both odd.

    Examples
    --------
    >>> import numpy as np
    >>> mesh = handled_bipyramid(2, 4, 4, 0.6, 100.0)
    >>> np.bincount(np.bincount(mesh.indices))[[4, 8]].tolist()
    [180, 6]

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects", Computers & Graphics 35
    (2011), figure 16.
    """
    if edge % 2 and handle % 2:
        raise InputError(
            f"the shape bipyramid: edge ({edge}) and handle ({handle}) are both odd, so it cannot "
            "be woven in twill; make one of them even"
        )
    radius = min(0.13, 0.6 / n)
    quads, places = _walls(n, edge, handle, height, radius)
    mesh = settle(PolyMesh.from_faces(places, quads), _wheel(n, height, radius))
    return resize_mesh(mesh, size_mm=size)[0]


def _walls(
    n: int, edge: int, handle: int, height: float, radius: float
) -> tuple[IntArray, FloatArray]:
    """Return the quads, and the mean of the first places of each vertex."""
    sides = 2 * n
    side = np.arange(sides)
    following = (side + 1) % sides
    inner, between = np.arange(1, edge), np.arange(1, handle)
    # Numbers of the vertices: tips, rim, ridges above and below, equator, then the three edges
    # that run down each handle, then the inside of its three walls.
    counter = iter(np.cumsum([0, 2, sides, *[sides * (edge - 1)] * 3, *[sides * (handle - 1)] * 3]))
    tips = np.arange(2) + next(counter)
    rim = side + next(counter)
    upper, lower, equator = (
        next(counter) + np.arange(sides * (edge - 1)).reshape(sides, -1) for _ in range(3)
    )
    hub, left, right = (
        next(counter) + np.arange(sides * (handle - 1)).reshape(sides, -1) for _ in range(3)
    )
    total = next(counter)
    grid = grid_quads(edge, handle, wrap=(False, False))
    quads: list[IntArray] = []
    numbers: list[IntArray] = []
    for wall in range(3):
        number = np.empty((sides, edge + 1, handle + 1), dtype=np.int64)
        number[:, 1:-1, 1:-1] = total + np.arange(sides * len(inner) * len(between)).reshape(
            sides, len(inner), len(between)
        )
        total += sides * len(inner) * len(between)
        near, far = (rim if wall == 2 else None), (rim if wall == 0 else rim[following])
        number[:, 0, 0] = tips[0] if near is None else near
        number[:, 0, -1] = tips[1] if near is None else near
        number[:, 0, 1:-1] = left if wall == 2 else hub
        number[:, -1, 0] = number[:, -1, -1] = far
        number[:, -1, 1:-1] = left if wall == 0 else right
        spoke = side if wall == 0 else following
        number[:, 1:-1, 0] = equator if wall == 2 else upper[spoke]
        number[:, 1:-1, -1] = equator if wall == 2 else lower[spoke]
        faces = number.reshape(sides, -1)[:, grid].reshape(-1, 4)
        quads.append(faces[:, ::-1] if wall == 1 else faces)
        numbers.append(number)
    places = _wall_places(n, edge, handle, height, radius)
    flat = np.concatenate([number.reshape(-1) for number in numbers])
    return np.concatenate(quads), mean_at(flat, places)


def _wall_places(n: int, edge: int, handle: int, height: float, radius: float) -> FloatArray:
    """Return where the corners of the walls of all handles stand at first, wall after wall."""
    sides = 2 * n
    step = 2 * math.pi / sides
    along = np.linspace(0, 1, edge + 1)[:, None, None]
    down = np.linspace(0, 1, handle + 1)[:, None]
    angle: FloatArray = step * np.arange(sides, dtype=np.float64)[:, None, None, None]

    def turned(out: FloatArray, left: FloatArray, up: FloatArray, by: FloatArray) -> FloatArray:
        x, y = np.cos(by) * out - np.sin(by) * left, np.sin(by) * out + np.cos(by) * left
        return np.concatenate(np.broadcast_arrays(x, y, up), axis=-1)

    wide = 1.2 * radius
    loop = 2 * math.pi * down
    tip_up = (height + radius) * np.cos(math.pi * down)
    tip_out = wide / math.sin(step / 2) * np.sin(math.pi * down)
    tip = turned(tip_out, 0 * down, tip_up, angle + step / 2)
    corner = (1 + radius * np.cos(loop), wide * np.sin(math.pi * down) ** 2, radius * np.sin(loop))
    left = turned(corner[0], corner[1], corner[2], angle)
    right = turned(corner[0], -corner[1], corner[2], angle + step)
    bent = turned(corner[0], (1 - 2 * along) * corner[1], corner[2], angle + step * along)
    walls = [(1 - along) * tip + along * left, (1 - along) * tip + along * right, bent]
    return np.concatenate([wall.reshape(-1, 3) for wall in walls])


def _wheel(n: int, height: float, radius: float) -> SoftTubes:
    """Return the smooth body: a rim, and 2n fins whose ridges are those of the bipyramid."""
    sides = 2 * n
    blend = _BLEND * radius
    angle = np.arange(sides) * (math.pi / n)
    turn = np.linspace(0, 2 * math.pi, 40 * sides, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn), np.zeros_like(turn)])
    axis = np.array([[0, 0, -height], [0, 0, height]])
    # Fins are sampled in columns; each sample stands for its area, as a curve's for its length.
    columns = math.ceil(1 / (0.9 * blend))
    out = (np.arange(columns) + 0.5) / columns
    tall = np.maximum(1, np.ceil(2 * height * (1 - out) / (0.9 * blend))).astype(int)
    out = np.repeat(out, tall)
    place = places_in_groups(tall)
    up = height * (1 - out) * (2 * (place + 0.5) / np.repeat(tall, tall) - 1)
    area = 2 * height * (1 - out) / np.repeat(tall, tall) / columns
    fins = np.stack(
        [np.outer(np.cos(angle), out), np.outer(np.sin(angle), out), np.tile(up, (sides, 1))], -1
    ).reshape(-1, 3)
    sheet = SoftTubes(fins, np.tile(area / (math.pi * blend**2), sides), radius, blend)
    rim = soft_tubes([ring], radius=radius, blend=blend, closed=True)
    return rim | soft_tubes([axis], radius=radius, blend=blend, closed=False) | sheet
