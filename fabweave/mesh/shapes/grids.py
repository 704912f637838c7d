"""Build shapes of quads by closed formulas."""

import math

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.mesh.polymesh import PolyMesh, without_loose


def torus(m: int, n: int, ring: float, tube: float) -> PolyMesh:
    """Return an m × n quad torus around the z axis.

    Parameters
    ----------
    m, n : int
        Quads around the ring and around the tube.
    ring, tube : float
        Radius of the circle in the middle of the tube, and of the tube.

    Returns
    -------
    PolyMesh
        Vertex ``i * n + j`` stands at the angle i·360°/m of the ring and j·360°/n of the tube.

    Examples
    --------
    >>> torus(4, 3, 2.0, 1.0).vertices[0].tolist()
    [3.0, 0.0, 0.0]
    """
    around, across = _angles(m), _angles(n)
    reach = ring + tube * np.cos(across)
    vertices = np.empty((m, n, 3))
    vertices[..., 0] = np.cos(around)[:, None] * reach
    vertices[..., 1] = np.sin(around)[:, None] * reach
    vertices[..., 2] = tube * np.sin(across)
    return PolyMesh.from_faces(vertices.reshape(-1, 3), grid_quads(m, n, wrap=(True, True)))


def tube(m: int, n: int, radius: float, height: float) -> PolyMesh:
    """Return an open cylinder around the z axis, m quads around and n along.

    Examples
    --------
    >>> tube(3, 1, 1.0, 2.0).vertices[:, 2].tolist()
    [-1.0, 1.0, -1.0, 1.0, -1.0, 1.0]
    """
    around = _angles(m)
    vertices = np.empty((m, n + 1, 3))
    vertices[..., 0] = radius * np.cos(around)[:, None]
    vertices[..., 1] = radius * np.sin(around)[:, None]
    vertices[..., 2] = np.linspace(-height / 2, height / 2, n + 1)
    return PolyMesh.from_faces(vertices.reshape(-1, 3), grid_quads(m, n, wrap=(True, False)))


def hypar(m: int, n: int, side: float, height: float) -> PolyMesh:
    """Return the saddle z = height · 2xy / side² over a square, m × n quads, outside up.

    Its grid lines are straight; the corners stand at z = ±height / 2.

    Examples
    --------
    >>> hypar(1, 1, 2.0, 2.0).vertices.tolist()
    [[-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [1.0, 1.0, 1.0]]
    """
    x = np.linspace(-side / 2, side / 2, m + 1)
    y = np.linspace(-side / 2, side / 2, n + 1)
    vertices = np.empty((m + 1, n + 1, 3))
    vertices[..., 0] = x[:, None]
    vertices[..., 1] = y
    vertices[..., 2] = height * 2 * np.outer(x, y) / side**2
    return PolyMesh.from_faces(vertices.reshape(-1, 3), grid_quads(m, n, wrap=(False, False)))


def cube(n: int, size: float) -> PolyMesh:
    """Return a cube of 6 n² squares.

    Examples
    --------
    >>> box = cube(2, 1.0)
    >>> box.n_vertices, box.n_faces, box.vertices[0].tolist()
    (26, 24, [-0.5, -0.5, -0.5])
    """
    lattice, faces = _cube_lattice(n)
    return PolyMesh.from_faces((lattice / n - 0.5) * size, faces)


def sphere(n: int, radius: float) -> PolyMesh:
    """Return a sphere of 6 n² quads: a cube's grid, blown up.

    Grid lines stand at equal angles, which spreads the quads evenly; eight vertices have three
    quads, all others four.

    Examples
    --------
    >>> ball = sphere(1, 3**0.5)
    >>> ball.n_vertices, ball.n_faces, ball.vertices[0].round(9).tolist()
    (8, 6, [-1.0, -1.0, -1.0])
    """
    lattice, faces = _cube_lattice(n)
    return _blown_up(lattice, faces, n, radius)


def hemisphere(n: int, radius: float) -> PolyMesh:
    """Return the upper half of a sphere of quads, open below: n rows, 12 n² quads.

    Examples
    --------
    >>> dome = hemisphere(1, 1.0)
    >>> dome.n_faces, dome.vertices[:, 2].min().tolist()
    (12, 0.0)
    """
    lattice, faces = _cube_lattice(2 * n)
    upper = faces[(lattice[faces][:, :, 2] >= n).all(axis=1)]
    return without_loose(_blown_up(lattice, upper, 2 * n, radius))


def grid_quads(m: int, n: int, *, wrap: tuple[bool, bool]) -> IntArray:
    """Return the quads of an m × n grid, counter-clockwise where the first axis points right.

    Parameters
    ----------
    m, n : int
        Quads along the first and the second axis.
    wrap : (bool, bool)
        Whether each axis closes to a ring.

    Returns
    -------
    (m n, 4) int array
        Vertex numbers; vertices are numbered along the second axis first.

    Examples
    --------
    >>> grid_quads(1, 1, wrap=(False, False)).tolist()
    [[0, 2, 3, 1]]
    """
    columns = n if wrap[1] else n + 1
    i = np.arange(m)[:, None]
    j = np.arange(n)[None, :]
    right = (i + 1) % m if wrap[0] else i + 1
    up = (j + 1) % n if wrap[1] else j + 1
    corners = [i * columns + j, right * columns + j, right * columns + up, i * columns + up]
    return np.stack(corners, axis=-1).reshape(-1, 4).astype(np.int64)


def _angles(count: int) -> FloatArray:
    return np.arange(count, dtype=np.float64) * (2 * math.pi / count)


def _cube_lattice(n: int) -> tuple[IntArray, IntArray]:
    """Return the surface points of an n × n × n lattice and its quads, turned outward."""
    quads = grid_quads(n, n, wrap=(False, False))
    u, v = (values.ravel() for values in np.meshgrid(range(n + 1), range(n + 1), indexing="ij"))
    sides = []
    for axis in range(3):
        for level in (0, n):
            points = np.empty((len(u), 3), dtype=np.int64)
            # Swapping the two directions turns the side at level 0 outward.
            first, second = (u, v) if level else (v, u)
            points[:, axis] = level
            points[:, (axis + 1) % 3] = first
            points[:, (axis + 2) % 3] = second
            sides.append(points)
    points = np.concatenate(sides)
    side = n + 1
    code = (points[:, 2] * side + points[:, 1]) * side + points[:, 0]
    known, number = np.unique(code, return_inverse=True)
    lattice = np.column_stack([known % side, known // side % side, known // side**2])
    faces = np.concatenate([quads + k * side**2 for k in range(6)])
    return lattice.astype(np.int64), number[faces].astype(np.int64)


def _blown_up(lattice: IntArray, faces: IntArray, n: int, radius: float) -> PolyMesh:
    """Put lattice points on the sphere, at equal angles along each side of the cube."""
    steps = np.tan((np.arange(n + 1) * 2 - n) * (math.pi / (4 * n)))
    points = steps[lattice]
    length = np.linalg.norm(points, axis=1, keepdims=True)
    return PolyMesh.from_faces(radius * points / length, faces)
