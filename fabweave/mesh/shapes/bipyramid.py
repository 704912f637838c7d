"""Build bipyramids whose opposite faces are joined by handles through the body."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, places_in_groups
from fabweave.core.errors import InputError
from fabweave.mesh.one_rings import mean_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids
from fabweave.mesh.shapes.bundles import bundle, slit_columns
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.shapes.soft_tubes import SoftTubes, settle, soft_tubes
from fabweave.mesh.shapes.tube_nets import necklace
from fabweave.mesh.upright import resize_mesh


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


# Width of the bell that rounds the body off, in radii of the rim.
_BLEND = 0.8


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
    places = _first_places(n, edge, handle, height, radius)
    flat = np.concatenate([number.reshape(-1) for number in numbers])
    return np.concatenate(quads), mean_at(flat, places)


def _first_places(n: int, edge: int, handle: int, height: float, radius: float) -> FloatArray:
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
