"""Take meshes in: from files, from memory, or as built-in shapes."""

import operator
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from fabweave.app.front_door.look import seen_from
from fabweave.app.front_door.notebook import face
from fabweave.app.front_door.stations import Request, Stations, loaded
from fabweave.core.arrays import FloatArray, IntArray, frozen, frozen_value
from fabweave.core.errors import InputError
from fabweave.core.messages import shown
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import PREFIX
from fabweave.mesh.triangulate import triangulate

if TYPE_CHECKING:
    import trimesh
    from PIL import Image

#: What a file is called in a job's folder, so it must be a plain name.
_PLAIN = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_- ")
_LONGEST_NAME = 80


@frozen_value
class Mesh:
    """A polygon mesh that is ready to be woven, in millimetres.

    Made by :func:`read`, :func:`mesh` and :func:`shape`; :func:`fabweave.weave` takes it on.
    """

    stations: Stations

    @property
    def vertices(self) -> FloatArray:
        """Positions in millimetres, (V, 3), read-only."""
        return self.stations.loaded.mesh.vertices

    @property
    def faces(self) -> list[list[int]]:
        """The vertices of each face, counter-clockwise seen from outside."""
        return self.stations.loaded.mesh.faces()

    @property
    def edges(self) -> IntArray:
        """The two vertices of each edge, (E, 2)."""
        halfedges = self.stations.loaded.halfedges
        first = halfedges.edge_halfedge
        return frozen(np.column_stack((halfedges.tail[first], halfedges.head[first])))

    @property
    def size_mm(self) -> tuple[float, float, float]:
        """Extent along x, y and z, millimetres."""
        x, y, z = np.ptp(self.vertices, axis=0).tolist()
        return x, y, z

    @property
    def title(self) -> str:
        """What the mesh is called."""
        return self.stations.loaded.title

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done to the mesh, and what is worth knowing about it."""
        return self.stations.loaded.notes

    def to_trimesh(self) -> "trimesh.Trimesh":
        """Return the mesh as ``trimesh.Trimesh``; faces with more corners are cut to triangles.

        Examples
        --------
        >>> import fabweave as fw
        >>> fw.shape("cube").to_trimesh().is_watertight
        True
        """
        import trimesh  # noqa: PLC0415 - slow to import, and seldom wanted

        triangles = triangulate(self.stations.loaded.mesh)
        faces = triangles.indices.reshape(-1, 3)
        return trimesh.Trimesh(triangles.vertices, faces, process=False)

    def picture(
        self, *, size_px: tuple[int, int] = (1000, 800), view: tuple[float, float] | None = None,
        across: Any = None, samples: int = 2,
    ) -> "Image.Image":  # fmt: skip
        """Return a picture of the mesh, with its irregular vertices marked.

        The arguments are those of ``Ribbons.picture``.
        """
        from fabweave.picture.object_picture import irregular_marks, mesh_picture  # noqa: PLC0415

        mesh = self.stations.loaded.mesh
        corners = triangulate(mesh)
        triangles = corners.indices.reshape(-1, 3)
        return mesh_picture(
            mesh,
            size_px=size_px,
            view=seen_from(view, across, corners.vertices, triangles),
            marks=irregular_marks(mesh),
            samples=samples,
        )

    def __repr__(self) -> str:
        counts = f"{len(self.vertices)} vertices, {len(self.edges)} edges, {len(self.faces)} faces"
        return f"Mesh({self.title!r}: {counts}, {' × '.join(f'{s:.1f}' for s in self.size_mm)} mm)"

    def _repr_html_(self) -> str:
        figures = {
            "vertices": len(self.vertices),
            "edges": len(self.edges),
            "faces": len(self.faces),
            "size, mm": " × ".join(f"{side:.1f}" for side in self.size_mm),
        }
        return face(self.title, figures, self.picture())


def read(path: str | Path, **options: Any) -> Mesh:
    """Read a mesh file: OBJ, OFF or PLY with its polygons, STL, GLB or 3MF as triangles.

    Parameters
    ----------
    path : str or Path
    options
        Of the mesh, as on the command line: ``size="400mm"``, ``up="y"``,
        ``remesh="quads:300"``, ``refine="catmull-clark:1"``, ``fair=50``. A number without a unit
        is in millimetres.

    Raises
    ------
    InputError
        If the file cannot be read or the mesh cannot be woven; it says where and what to do.
    CannotMakeError
        If it cannot be remeshed or refined as asked.

    Examples
    --------
    >>> import fabweave as fw, tempfile, pathlib
    >>> folder = pathlib.Path(tempfile.mkdtemp())
    >>> _ = fw.shape("cube").to_trimesh().export(folder / "cube.stl")
    >>> fw.read(folder / "cube.stl", size="30cm").size_mm
    (300.0, 300.0, 300.0)
    """
    return Mesh(loaded(Request(str(path), options)))


def mesh(
    vertices: Any,
    faces: Sequence[Sequence[int]] | npt.NDArray[np.integer] | None = None,
    *,
    name: str = "mesh",
    **options: Any,
) -> Mesh:
    """Take a mesh from memory.

    Parameters
    ----------
    vertices : (V, 3) array, or anything with ``vertices`` and ``faces``
        Positions in millimetres; or a mesh, such as ``trimesh.Trimesh`` or our own.
    faces : (F, k) int array or sequence of sequences of int
        Corners of each face, counter-clockwise seen from outside; faces may differ in size. Left
        out where a mesh is given.
    name : str
        What the object is called. A job keeps the mesh as ``NAME.obj`` in its folder, so that its
        ``job.toml`` can make it again.
    options
        As for :func:`read`.

    Raises
    ------
    InputError
        If these are no vertices and faces, or the mesh cannot be woven.

    Examples
    --------
    >>> import fabweave as fw
    >>> corners = [[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]
    >>> tetrahedron = fw.mesh(corners, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], size=100)
    >>> tetrahedron
    Mesh('Mesh': 4 vertices, 6 edges, 4 faces, 100.0 × 100.0 × 100.0 mm)
    """
    plain = isinstance(name, str) and name == name.strip() and not set(name) - _PLAIN
    if not (plain and 0 < len(name) <= _LONGEST_NAME):
        raise InputError(
            f"{shown(name)} is no plain name: use letters, digits, spaces, - and _, "
            f"{_LONGEST_NAME} at most"
        )
    if name == "woven_mesh":
        raise InputError("woven_mesh.obj is a file of the job itself: name the mesh otherwise")
    return Mesh(loaded(Request(f"{name}.obj", options, _polymesh(vertices, faces))))


def shape(name: str, *, size: Any = None, **parameters: Any) -> Mesh:
    """Build a built-in shape.

    Parameters
    ----------
    name : str
        One of those that ``fabweave shapes`` lists.
    size : length, optional
        The largest dimension, such as ``"400mm"``; a number is in millimetres.
    parameters
        Of the shape, such as ``m=24, n=12``; and options of the mesh, as for :func:`read`.

    Raises
    ------
    InputError
        If there is no such shape or parameter; it lists those that there are.

    Examples
    --------
    >>> import fabweave as fw
    >>> fw.shape("torus", m=24, n=12, size="400mm")
    Mesh('Torus, 24 by 12': 288 vertices, 576 edges, 288 faces, 400.0 × 400.0 × 120.0 mm)
    """
    from fabweave.app.options.table import OPTIONS  # noqa: PLC0415

    known = {option.name.replace("-", "_") for option in OPTIONS}
    options = {key: value for key, value in parameters.items() if key in known}
    if size is not None:
        options["size"] = size
    query = "&".join(f"{key}={value}" for key, value in parameters.items() if key not in known)
    return Mesh(loaded(Request(f"{PREFIX}{name}{'?' * bool(query)}{query}", options)))


def stations_of(source: Any, options: Mapping[str, Any]) -> Stations:
    """Return the stations of what stands for a mesh, with more options."""
    return source.stations if isinstance(source, Mesh) else loaded(request_of(source, options))


def request_of(source: Any, options: Mapping[str, Any]) -> Request:
    """Return the request for what stands for a mesh: a path, a shape's name, or any mesh."""
    if isinstance(source, Mesh):
        return source.stations.request.also(options)
    if isinstance(source, str | Path):
        return Request(str(source), options)
    return Request("mesh.obj", options, _polymesh(source, None))


def _polymesh(vertices: Any, faces: Any) -> PolyMesh:
    """Return vertices and faces, or any mesh that has them, as a polygon mesh of its own."""
    if isinstance(vertices, PolyMesh):
        return vertices
    if faces is None:
        vertices, faces = getattr(vertices, "vertices", None), getattr(vertices, "faces", None)
        faces = faces() if callable(faces) else faces
    if vertices is None or faces is None:
        raise InputError(
            "this is no mesh: give vertices and faces, or something that has both, such as "
            "trimesh.Trimesh"
        )
    try:
        return PolyMesh.from_faces(_positions(vertices), _corners(faces))
    except (OverflowError, TypeError, ValueError) as error:
        raise InputError(f"this is no mesh of vertices and faces: {error}") from error


def _positions(vertices: Any) -> FloatArray:
    """Return a copy of vertices, so that the caller's array stays as it is; else raise TypeError.

    A complex number has a part that would be lost.
    """
    positions = np.array(vertices)
    if positions.dtype.kind == "c" or positions.ndim != 2 or positions.shape[1] != 3:
        told = f"{positions.dtype} of shape {positions.shape}"
        raise TypeError(f"vertices are {told}, and must be real numbers (V, 3)")
    return positions.astype(np.float64)


def _corners(faces: Any) -> Any:
    """Return faces as they are, if their corners are whole numbers; else raise TypeError."""
    if hasattr(faces, "__array__") or isinstance(faces, memoryview):
        faces = np.asarray(faces)  # rows of a matrix are matrices again
        if faces.dtype.kind not in "iu" or faces.ndim != 2:
            raise TypeError(f"faces are {faces.ndim}-dimensional {faces.dtype}, not whole numbers")
        return faces
    return [[operator.index(corner) for corner in corners] for corners in faces]
