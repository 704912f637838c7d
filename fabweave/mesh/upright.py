"""Turn a mesh upright, and scale it to its size."""

import math
from typing import Literal, TypeAlias

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from fabweave.core.arrays import FloatArray
from fabweave.core.errors import InputError
from fabweave.core.messages import shown
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.rim_cut import boundary_walks
from fabweave.mesh.triangulate import area_samples, plain_triangles

#: The axes that may point up, by name.
AXES = {
    "z": (0.0, 0.0, 1.0), "y": (0.0, 1.0, 0.0), "x": (1.0, 0.0, 0.0),
    "-z": (0.0, 0.0, -1.0), "-y": (0.0, -1.0, 0.0), "-x": (-1.0, 0.0, 0.0),
}  # fmt: skip
#: Directions are written with so many decimals, where the largest coordinate is 1.
_DECIMALS = 10


def resize_mesh(
    mesh: PolyMesh, *, size_mm: float | None = None, scale: float | None = None
) -> tuple[PolyMesh, float]:
    """Scale a mesh to a size, or by a factor; with neither, leave it as it is.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh; only vertices that faces use count for its size.
    size_mm : float, optional
        The largest dimension of the bounding box afterwards.
    scale : float, optional
        Factor for all coordinates.

    Returns
    -------
    mesh : PolyMesh
        The scaled mesh.
    factor : float
        What the coordinates were multiplied by.

    Raises
    ------
    InputError
        If both are given, one is not a positive number, or the mesh has no size.

    Examples
    --------
    >>> mesh, factor = resize_mesh(
    ...     PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]]), size_mm=100)
    >>> factor, mesh.vertices.max()
    (50.0, np.float64(100.0))
    """
    if size_mm is not None and scale is not None:
        raise InputError("a size and a scale were both given; give one of them")
    for name, value in (("size", size_mm), ("scale", scale)):
        if value is not None and not (math.isfinite(value) and value > 0):
            raise InputError(f"the {name} must be a positive number, but is {value}")
    if size_mm is None and scale is None:
        return mesh, 1.0
    factor = scale if scale is not None else float(size_mm or 0.0) / largest_dimension(mesh)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = mesh.vertices * factor
    if not math.isfinite(factor) or factor <= 0 or np.isinf(vertices[mesh.indices]).any():
        raise InputError("the mesh is too small or too large to be scaled; check its units")
    return mesh.with_vertices(vertices), float(factor)


def largest_dimension(mesh: PolyMesh) -> float:
    """Return the largest side of the bounding box of the faces.

    Raises
    ------
    InputError
        If the mesh has no faces, no size, or coordinates that are not numbers.

    Examples
    --------
    >>> largest_dimension(PolyMesh.from_faces([[0, 0, 0], [2, 0, 0], [0, 1, 0]], [[0, 1, 2]]))
    2.0
    """
    points = mesh.vertices[mesh.indices]
    if not len(points):
        raise InputError("the mesh has no faces, so it has no size")
    with np.errstate(all="ignore"):
        largest = float(np.ptp(points, axis=0).max())
    if not math.isfinite(largest):
        raise InputError("the mesh has coordinates that are not numbers, so it has no size")
    if largest == 0:
        raise InputError("all vertices of the mesh are at one point, so it has no size")
    return largest


def parse_up(text: str) -> str:
    """Return a direction in its usual form: an axis by name, or three numbers, the largest 1 or -1.

    Raises
    ------
    InputError
        If it is none.

    Examples
    --------
    >>> parse_up("0.4,-2,0.2"), parse_up("0,0,-3"), parse_up("y")
    ('0.2,-1,0.1', '-z', 'y')
    """
    if text in AXES:
        return text
    try:
        x, y, z = (float(number) for number in text.split(","))
    except ValueError:
        x = y = z = math.nan
    largest = max(abs(x), abs(y), abs(z))
    if not (all(map(math.isfinite, (x, y, z))) and largest > 0.0):
        raise InputError(
            f"{shown(text)} is no direction: write {', '.join(AXES)}, or three numbers that are "
            "not all 0, such as 0.2,-1,0.1"
        )
    way = tuple(round(value / largest, _DECIMALS) + 0.0 for value in (x, y, z))
    named = [name for name, axis in AXES.items() if axis == way]
    return named[0] if named else ",".join(f"{value:.{_DECIMALS}g}" for value in way)


def turn_of(up: str) -> FloatArray:
    """Return the rotation after which a direction points up.

    It is the least rotation that carries the direction to z, and then one about z by -90° times the
    direction's share along x. So it changes little where the direction does, except near -z, which
    is turned over about x. With y up, x stays and what looked along z looks along -y, to the front,
    as graphics programs do it; with x up, y becomes x.

    Parameters
    ----------
    up : str
        As ``parse_up`` returns it.

    Returns
    -------
    (3, 3) float array
        It is applied to columns. For axes, all is exactly 0, 1 or -1.

    Examples
    --------
    >>> turn_of("y").tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    >>> turn_of("0,0.75,1").round(12).tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.8, -0.6], [0.0, 0.6, 0.8]]
    """
    if up == "-z":
        return np.diag((1.0, -1.0, -1.0))
    way = np.array(AXES.get(up) or [float(number) for number in up.split(",")])
    x, y, z = (way / math.hypot(*way)).tolist()
    # 1 / (1 + z), without loss of digits where z is negative.
    share = 1.0 / (1.0 + z) if z > 0.0 else (1.0 - z) / (x * x + y * y)
    right = np.array([1.0 - x * x * share, -x * y * share, -x])
    back = np.array([-x * y * share, 1.0 - y * y * share, -y])
    cosine, sine = math.cos(0.5 * math.pi * x), -math.sin(0.5 * math.pi * x)
    turn = np.stack([cosine * right - sine * back, sine * right + cosine * back, (x, y, z)])
    return (np.rint(turn) if up in AXES else turn) + 0.0


def turn_upright(mesh: PolyMesh, up: str) -> PolyMesh:
    """Turn a mesh so that the direction that points up becomes z.

    Parameters
    ----------
    mesh : PolyMesh
    up : str
        As ``turn_of`` takes it.

    Returns
    -------
    PolyMesh

    Examples
    --------
    >>> mesh = PolyMesh.from_faces([[1, 2, 3], [4, 5, 6], [7, 8, 10]], [[0, 1, 2]])
    >>> turn_upright(mesh, "y").vertices[0].tolist(), turn_upright(mesh, "x").vertices[0].tolist()
    ([1.0, -3.0, 2.0], [2.0, 3.0, 1.0])
    """
    if up == "z":
        return mesh
    # Summed one by one, so that the same comes out everywhere; what has no part is left out. A zero
    # has no sign worth writing.
    columns = [
        sum(part * column for part, column in zip(row, mesh.vertices.T, strict=True) if part) + 0.0
        for row in turn_of(up).tolist()
    ]
    return mesh.with_vertices(np.column_stack(columns))


#: What was guessed, and from what.
Guess: TypeAlias = tuple[Literal["y", "z"], Literal["base", "rim", "symmetry"]]

#: What lies lower than this share of the height touches the ground.
_SOLE = 0.03
#: The middle of what stands is so far inside its base, as a share of the width seen from above.
_INSIDE = 0.03
#: The base of what stands is this share of what is seen from above, and so many times the base on
#: any other axis.
_LEAST_BASE, _CLEARLY = 0.2, 1.6
#: Where a mesh is so thin, as a share of its length, or so large that squares of its areas are no
#: numbers, nothing is guessed.
_THIN, _FAR = 1e-9, 1e75
#: A rim is flat if it is no thicker than this share of its width, and across an axis where its
#: normal has such a share along it; it is at an end within this share of the height.
_FLAT, _ACROSS, _END = 0.35, 0.9, 0.2
#: Files of programs in which y mostly points up; those for printers have z.
_OF_MODELS = ("obj", "off", "ply")
#: Samples of the surface.
_SAMPLES = 4000
#: A surface is its own mirror image if that is so near, as a share of its size, on the root mean
#: square; and it is none if that is farther.
_MIRRORED, _NOT = 0.025, 0.04


def guess_up(mesh: PolyMesh, kind: str = "") -> Guess | None:
    """Guess whether y or z of a mesh points up.

    What stands has a base: near its lowest end the surface spreads out below its middle. That axis
    points up at an end of which the base is much larger than at the ends of the others. Where none
    is, what is open stands on its rim, or has it above, if that is flat and at an end of an axis.
    Else y points up if nothing can stand along z, and z is the only axis along which left and right
    mirror one another: a mirror plane mostly contains what points up. Where x is that axis, and
    nothing can stand along y or z, y points up in files of programs for modelling. x is never
    guessed: hardly a file has it.

    Parameters
    ----------
    mesh : PolyMesh
        With any unit.
    kind : str
        The format of its file, such as ``obj``.

    Returns
    -------
    (str, str) or None
        The axis, and what tells it; None where nothing does.

    Examples
    --------
    >>> from fabweave.mesh.shapes.catalogue import parse_shape
    >>> bowl = parse_shape("shape:hemisphere")
    >>> guess_up(bowl), guess_up(bowl.with_vertices(bowl.vertices[:, [1, 2, 0]]))
    (('z', 'base'), ('y', 'base'))
    """
    points, triangles = plain_triangles(mesh)
    used = points[np.unique(triangles)]
    if not len(used) or not np.all(np.isfinite(used)):
        return None
    extent = np.ptp(used, axis=0)
    if extent.min() <= _THIN * extent.max() or extent.max() > _FAR:
        return None
    places, _ = area_samples(points, triangles, _SAMPLES)
    middle = places.mean(axis=0)
    x, y, z = (_base(used, middle, axis) for axis in range(3))
    if max(y, z) > max(_LEAST_BASE, _CLEARLY * max(x, min(y, z))):
        return ("y" if y > z else "z"), "base"
    ends = _rim_ends(mesh, used)
    if ends is not None:
        return ends, "rim"
    surface = Surface(points, triangles)
    off = [_off_mirror(surface, places, axis) for axis in range(3)]
    along_x, along_z = (
        off[axis] < _MIRRORED and min(off[:axis] + off[axis + 1 :]) > _NOT for axis in (0, 2)
    )
    if (along_z and z == 0.0) or (along_x and kind in _OF_MODELS and max(y, z) < _LEAST_BASE):
        return "y", "symmetry"
    return None


def _rim_ends(mesh: PolyMesh, used: FloatArray) -> Literal["y", "z"] | None:
    """Return the axis at one end of which the only rim lies, wide, nearly in a plane across it."""
    loops = boundary_walks(mesh)
    if len(loops) != 1 or len(loops[0]) < 3:
        return None
    rim = mesh.vertices[loops[0]]
    middle, low, high = rim.mean(axis=0), used.min(axis=0), used.max(axis=0)
    sizes, axes = np.linalg.svd(rim - middle, full_matrices=False)[1:]
    axis = int(np.argmax(np.abs(axes[2])))
    height = float(((middle - low) / (high - low))[axis])
    wide = np.ptp(rim @ axes[:2].T, axis=0) > 0.5 * (high - low).min()
    flat = sizes[2] < _FLAT * sizes[1] and abs(axes[2, axis]) > _ACROSS and wide.all()
    if axis == 0 or not flat or _END < height < 1.0 - _END:
        return None
    return "y" if axis == 1 else "z"


def _off_mirror(surface: Surface, places: FloatArray, axis: int) -> float:
    """Return how far places mirrored along an axis are off the surface, as a share of its size."""
    low, high = places.min(axis=0), places.max(axis=0)
    image = places.copy()
    image[:, axis] = low[axis] + high[axis] - image[:, axis]
    away = surface.feet(image).distances
    return float(np.sqrt(np.mean(away**2)) / (high - low).max())


def _base(points: FloatArray, middle: FloatArray, axis: int) -> float:
    """Return the larger base of both ends of an axis, as a share of what is seen along it."""
    across = [other for other in range(3) if other != axis]
    whole = _hull(points[:, across])
    if whole is None:
        return 0.0
    height = points[:, axis]
    sole = _SOLE * np.ptp(height)
    largest = 0.0
    for touching in (height < height.min() + sole, height > height.max() - sole):
        base = _hull(points[touching][:, across])
        if base is None:
            continue
        inside = -float((base.equations @ [*middle[across], 1.0]).max())
        if inside > _INSIDE * np.sqrt(whole.volume):
            largest = max(largest, float(base.volume / whole.volume))
    return largest


def _hull(points: FloatArray) -> ConvexHull | None:
    """Return the convex hull of points of a plane, None if they lie on a line."""
    try:
        return ConvexHull(points) if len(points) > 2 else None
    except QhullError:
        return None
