"""Build bipyramids whose opposite faces are joined by handles through the body."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray, places_in_groups
from fabweave.core.errors import InputError
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.resize import resize_mesh
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.shapes.soft_tubes import SoftTubes, settle, soft_tubes

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
    shares = np.bincount(flat, minlength=int(total))
    sums = [np.bincount(flat, places[:, k], len(shares)) for k in range(3)]
    return np.concatenate(quads), np.column_stack(sums) / shares[:, None]


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
