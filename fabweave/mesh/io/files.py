"""Read and write mesh files by their extension."""

from pathlib import Path, PurePath
from typing import Literal

from fabweave.core.arrays import frozen_value
from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input
from fabweave.mesh.io.ply import read_ply
from fabweave.mesh.io.scenes import has_z_up, read_scene
from fabweave.mesh.io.text import obj_bytes, read_obj, read_off
from fabweave.mesh.polymesh import PolyMesh

#: Millimetres in each unit that a mesh file can state.
UNIT_MM = (("um", 0.001), ("mm", 1.0), ("cm", 10.0), ("m", 1000.0), ("in", 25.4), ("ft", 304.8))

_READERS = {"obj": read_obj, "off": read_off, "ply": read_ply}
_SCENES = ("stl", "glb", "gltf", "3mf")
#: Formats whose standard says which way is up, and that it is y.
_Y_UP = ("glb", "gltf")

#: Formats that can be read.
READABLE = (*_READERS, *_SCENES)


@frozen_value
class MeshFile:
    """A mesh as it was read from a file.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh, in the file's own unit.
    format : str
        The format: one of `READABLE`.
    unit : str or None
        The unit that the file states (one of those in `UNIT_MM`), or None if it states none.
    notes : tuple of str
        What a person should know about the reading.
    up : {"z", "y"}
        The axis that points up by the format's standard; z where it has none.
    """

    mesh: PolyMesh
    format: str
    unit: str | None = None
    notes: tuple[str, ...] = ()
    up: Literal["z", "y"] = "z"

    @property
    def unit_mm(self) -> float | None:
        """Millimetres in the stated unit, or None if the file states none."""
        return None if self.unit is None else dict(UNIT_MM)[self.unit]


def read_mesh(path: str | Path) -> MeshFile:
    """Read a mesh file.

    OBJ, OFF and PLY keep their polygons and vertices as they are; STL, GLB, glTF and 3MF hold
    triangles, whose vertices are joined where they are at the same place.

    Parameters
    ----------
    path : str or Path
        The file; its extension tells the format.

    Returns
    -------
    MeshFile
        The mesh, and what the file says about it.

    Raises
    ------
    InputError
        If the file is missing, of another format, cannot be understood, or has no faces.
    """
    path = Path(path)
    kind = path.suffix[1:].lower()
    if kind not in READABLE:
        what = f"format {path.suffix!r}" if kind else "a file without an extension"
        raise InputError(
            f"{path.name}: {what} cannot be read; formats that can be read: "
            + ", ".join(item.upper() for item in READABLE)
        )
    data = read_input(path, "the mesh", MOST_BYTES)
    if not data:
        raise InputError(f"{path.name}: the file is empty")
    unit: str | None = None
    if kind in _SCENES:
        mesh, unit, notes = read_scene(data, path, kind)
    else:
        mesh, notes = _READERS[kind](data, path.name)
    if not mesh.n_faces:
        raise InputError(
            f"{path.name}: the file has {mesh.n_vertices} vertices and no faces; export it again "
            "as a polygon mesh"
        )
    up: Literal["z", "y"] = "y" if kind in _Y_UP and not has_z_up(data) else "z"
    return MeshFile(mesh, kind, unit, notes, up)


def states_up(name: str) -> bool:
    """Tell whether a file's format says which way is up; in others anything may be.

    Examples
    --------
    >>> states_up("cow.glb"), states_up("cow.OBJ")
    (True, False)
    """
    return PurePath(name).suffix[1:].lower() in _Y_UP


def write_mesh(path: str | Path, mesh: PolyMesh) -> None:
    """Write a mesh as an OBJ file; the same mesh gives the same bytes.

    Reading the file gives the same faces and exactly the same positions.

    Parameters
    ----------
    path : str or Path
        Where to; it ends in ``.obj``.
    mesh : PolyMesh
        What to write.

    Raises
    ------
    InputError
        If the name ends otherwise, the file cannot be made, a face has no corners, or it names a
        vertex that does not exist.
    """
    path = Path(path)
    if path.suffix.lower() != ".obj":
        raise InputError(f"{path.name}: meshes are written as OBJ; choose a name such as cow.obj")
    data = obj_bytes(mesh)
    try:
        path.write_bytes(data)
    except OSError as error:
        raise InputError(f"{path}: cannot write the file: {error.strerror}") from error
