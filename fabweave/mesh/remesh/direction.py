"""Say which way strands should run on a surface, and how far the edges of a mesh turn from it."""

import math
from dataclasses import replace
from typing import Literal, TypeAlias

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from fabweave.core.arrays import FloatArray, frozen_value, unit
from fabweave.core.errors import InputError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import sparse_rows
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_centres,
    face_normals,
    face_of_corner,
    next_corner,
)

#: The words that name a direction; anything else is the name of a file.
AXES = ("x", "y", "z")
CURVATURE: Literal["curvature"] = "curvature"
#: Rings of neighbours that curvature is fitted to.
_RINGS = 5
#: Numbers of a line in a list of directions: a place and a vector.
_NUMBERS = 6


@frozen_value
class Direction:
    """The direction that strands, or edges, should have near some places.

    It is a line: a vector and its opposite mean the same, and so does what is at right angles to
    both it and the normal, as strands run both ways.

    Parameters
    ----------
    title : str
        What people call it.
    points : (P, 3) float array
        Places, in the unit of the mesh.
    vectors : (P, 3) float array
        The direction there, no longer than one; its length says how much it matters.
    diagonal : bool
        Whether the edges of quads should run at 45° to it. Strands go from the middle of one side
        of a quad to that of the next, so they run along its diagonals.
    """

    title: str
    points: FloatArray
    vectors: FloatArray
    diagonal: bool = False

    def on(self, places: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction of edges at places of a surface, in its planes, (N, 3).

        Parameters
        ----------
        places, normals : (N, 3) float arrays
            Of the named places the nearest counts. Normals are unit vectors.
        """
        nearest = cKDTree(self.points).query(places)[1]
        vector = self.vectors[nearest]
        flat = vector - np.einsum("nd,nd->n", vector, normals)[:, None] * normals
        return (flat + np.cross(normals, flat)) * math.sqrt(0.5) if self.diagonal else flat


#: What is wished for: a direction, or that of the surface's own curvature.
Along: TypeAlias = Direction | Literal["curvature"]


@frozen_value
class Alignment:
    """How well a mesh of quads follows a direction.

    Parameters
    ----------
    title : str
        What people call the direction.
    mean_deg : float
        How far its strands turn from the direction in the mean, as its edges do from theirs (see
        `mean_turn_deg`).
    plain_deg : float
        The same of the mesh that would have been made without the wish; NaN if there was none.
    runs : int
        How many results were compared.
    """

    title: str
    mean_deg: float
    plain_deg: float
    runs: int

    @property
    def note(self) -> str:
        """The alignment in words."""
        else_ = "" if math.isnan(self.plain_deg) else f"; {self.plain_deg:.1f}° without that wish"
        return (
            f"strands along {self.title}: they turn from it by {self.mean_deg:.1f}° in the mean, "
            f"the best of {self.runs} results (22.5° would be chance{else_})"
        )

    def record(self) -> dict[str, float | int | str | None]:
        """Return what JSON has of it."""
        plain = None if math.isnan(self.plain_deg) else round(self.plain_deg, 2)
        return {
            "along": self.title,
            "mean_deg": round(self.mean_deg, 2),
            "plain_deg": plain,
            "runs": self.runs,
        }


def axis_direction(axis: str) -> Direction:
    """Return the direction of an axis everywhere.

    Examples
    --------
    >>> axis_direction("y").vectors.tolist()
    [[0.0, 1.0, 0.0]]
    """
    vector = np.array([[float(axis == name) for name in AXES]])
    return Direction(axis, np.zeros((1, 3)), vector)


def read_directions(text: str, title: str) -> Direction:
    """Read a list of directions: in each line a place and a vector, ``x y z dx dy dz``.

    Spaces or commas part the numbers; what follows a ``#`` is a remark.

    Parameters
    ----------
    text : str
    title : str
        What the list is called.

    Raises
    ------
    InputError
        If a line is none such, a vector is zero, or there is no line at all.

    Examples
    --------
    >>> read_directions("0 0 0  0 0 2  # up", "own.txt").vectors.tolist()
    [[0.0, 0.0, 1.0]]
    """
    rows = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            row = []
        if len(row) != _NUMBERS or not all(math.isfinite(value) for value in row):
            raise InputError(
                f"line {number} of the list of directions is {line.strip()[:40]!r}, but should "
                "have six numbers, a place and a vector, such as 10 0 25 0 0 1"
            )
        if not any(row[3:]):
            raise InputError(
                f"line {number} of the list of directions has a vector of no length; it must say "
                "which way strands run there"
            )
        rows.append(row)
    if not rows:
        raise InputError(
            "the list of directions is empty; write a place and a vector in each line, such as "
            "10 0 25 0 0 1"
        )
    table = np.array(rows)
    largest = np.abs(table[:, 3:]).max(axis=1, keepdims=True)
    return Direction(title, table[:, :3], unit(table[:, 3:] / largest))


def curvature_direction(surface: PolyMesh) -> Direction:
    """Return the directions in which a surface bends most and least.

    They matter as the difference of the principal curvatures does, over the sum of their sizes and
    of that of a sphere as large as the surface: not at all on spheres and planes.

    Parameters
    ----------
    surface : PolyMesh
        An oriented manifold of triangles.

    References
    ----------
    Panozzo, Puppo, Rocca, "Efficient multi-scale curvature and crease estimation", GraVisMa 2010,
    as libigl has it.
    """
    # igl takes a while to import, and most jobs never need it.
    from igl import principal_curvature  # noqa: PLC0415 -- see above

    used, triangles = np.unique(surface.indices, return_inverse=True)
    points = np.ascontiguousarray(surface.vertices[used])
    most, _, high, low, _ = principal_curvature(
        points, np.ascontiguousarray(triangles.reshape(-1, 3), dtype=np.int64), _RINGS
    )
    round_ = 2.0 / float(np.ptp(points, axis=0).max())
    with np.errstate(invalid="ignore"):
        weight = np.abs(high - low) / (np.abs(high) + np.abs(low) + round_)
    vectors = unit(np.asarray(most, dtype=np.float64)) * weight[:, None]
    vectors[~np.isfinite(vectors).all(axis=1)] = 0.0
    return Direction("the curvature", points, vectors)


def direction_on(along: Along, surface: PolyMesh) -> Direction:
    """Return a direction of strands, where it is that of the curvature of triangles, too."""
    wished = curvature_direction(surface) if isinstance(along, str) else along
    return replace(wished, diagonal=True)


def mean_turn_deg(mesh: PolyMesh, direction: Direction) -> float:
    """Return by how much the edges of a mesh turn from a direction in the mean, in degrees.

    Each side of a face is compared with the direction projected onto the face, or its normal there,
    whichever is nearer. Sides weigh as their share of the face's area, and as much as the direction
    matters: where it stands upright on the surface, not at all.

    Parameters
    ----------
    mesh : PolyMesh
        Any faces.
    direction : Direction

    Returns
    -------
    float
        From 0 to 45; 22.5 if edges run any way. 0 where the direction matters nowhere.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> round(mean_turn_deg(cube(), axis_direction("z")), 9)
    0.0
    >>> slanted = Direction("slanted", np.zeros((1, 3)), unit(np.array([[1.0, 1.0, 0.0]])))
    >>> top = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    >>> round(mean_turn_deg(top, slanted), 9)
    45.0
    """
    face = face_of_corner(mesh)
    centre, normal = face_centres(mesh)[face], face_normals(mesh)[face]
    here = mesh.vertices[mesh.indices]
    there = here[next_corner(mesh)]
    wished = direction.on((here + there) / 2.0, normal)
    area = np.linalg.norm(np.cross(here - centre, there - centre), axis=1)
    weight = area * np.linalg.norm(wished, axis=1)
    total = float(weight.sum())
    turn = np.degrees(np.abs(_turns(there - here, wished, normal)))
    return float(weight @ turn) / total if total > 0 else 0.0


def turning_rows(
    mesh: PolyMesh, halfedges: Halfedges, direction: Direction
) -> tuple[sparse.csr_array, FloatArray, FloatArray]:
    """Return rows that give the edges of a mesh, the edges as they should be, and weights.

    An edge should keep its length and its height over the surface, and run along the direction, or
    at right angles to it if that is nearer.

    Returns
    -------
    rows : (E, V) sparse array
    wanted : (E, 3) float array
    weights : (E,) float array
    """
    first = halfedges.edge_halfedge
    tail, head = halfedges.tail[first], halfedges.head[first]
    twin = np.where(halfedges.twin[first] >= 0, halfedges.twin[first], first)
    normals = face_normals(mesh)
    normal = unit(normals[halfedges.face[first]] + normals[halfedges.face[twin]])
    edge = mesh.vertices[head] - mesh.vertices[tail]
    wished = direction.on((mesh.vertices[head] + mesh.vertices[tail]) / 2.0, normal)
    back = -_turns(edge, wished, normal)[:, None]
    height = np.einsum("nd,nd->n", edge, normal)[:, None] * normal
    flat = edge - height
    wanted = np.cos(back) * flat + np.sin(back) * np.cross(normal, flat) + height
    ends = np.column_stack([head, tail])
    rows = sparse_rows(ends, np.array([1.0, -1.0]), mesh.n_vertices)
    return rows, wanted, np.linalg.norm(wished, axis=1)


def _turns(edges: FloatArray, wished: FloatArray, normals: FloatArray) -> FloatArray:
    """Return the angles from directions, or their normals, to edges, in radians up to pi / 4."""
    ahead = np.einsum("nd,nd->n", edges, wished)
    aside = np.einsum("nd,nd->n", np.cross(wished, edges), normals)
    angle = np.arctan2(aside, ahead)
    return np.asarray(angle - np.round(angle / (np.pi / 2)) * (np.pi / 2))


def triangle_directions(surface: PolyMesh, direction: Direction) -> FloatArray:
    """Return the direction on each triangle of a surface, (T, 3)."""
    return direction.on(face_centres(surface), face_normals(surface))
