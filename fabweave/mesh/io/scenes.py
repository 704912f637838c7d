"""Read triangle files (STL, GLB, glTF, 3MF) through trimesh.

What a 3MF archive unpacks to is bounded before any memory is taken for it, and so is what objects
that are placed over and over come to.
"""

import io
import json
import warnings
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.core.arrays import offsets_of
from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input, silenced
from fabweave.core.messages import agree
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.weld import weld_mesh

#: Meshes of many more triangles than can be woven, even after a remeshing.
MOST_TRIANGLES = 10_000_000
#: Such a mesh takes about as many bytes, unpacked from 3MF.
MOST_UNPACKED = 512 * 2**20
#: The text of a mesh packs to a tenth or a twentieth; only a bomb packs so well ...
_MOST_RATIO = 200
#: ... and is worth the word from so many bytes on.
_SMALL = 16 * 2**20
#: Objects that are placed, in all; each becomes a part of its own.
_MOST_PLACED = 100_000

#: What trimesh calls the units of 3MF, and what fabweave calls them.
_UNITS = {
    "micron": "um",
    "millimeter": "mm",
    "centimeter": "cm",
    "meter": "m",
    "inch": "in",
    "foot": "ft",
}


def read_scene(data: bytes, path: Path, kind: str) -> tuple[PolyMesh, str | None, tuple[str, ...]]:
    """Read a file of triangles as one mesh, its objects placed and its vertices welded.

    Parameters
    ----------
    data : bytes
        The file.
    path : Path
        Where it is: a glTF file may name others beside it.
    kind : {"stl", "glb", "gltf", "3mf"}
        Its format.

    Returns
    -------
    mesh : PolyMesh
        Triangles; vertices at the same place are one vertex.
    unit : str or None
        The unit that the file states.
    notes : tuple of str
        What was joined and dropped.

    Raises
    ------
    InputError
        If the file cannot be read, holds no triangles, or unpacks to more than can be meant.
    """
    # trimesh takes half a second to import; most jobs never need it.
    import trimesh  # noqa: PLC0415 -- see above

    more: dict[str, Any] = {}
    try:
        if kind in ("glb", "gltf"):
            # If this is not JSON, trimesh would quietly read model.gltf beside it instead.
            _gltf_document(data)
            more = {"resolver": _files_beside(path), "skip_materials": True}
        elif kind == "3mf":
            _require_bounded(data, path.name)
        with warnings.catch_warnings(), np.errstate(all="ignore"), silenced("trimesh"):
            warnings.simplefilter("ignore")
            scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, **more)
            parts = _placed_parts(scene, trimesh.Trimesh, path.name)
            unit = _UNITS.get(str(scene.units))
    except InputError:
        raise
    except ImportError as error:
        raise InputError(
            f"{path.name}: reading {kind.upper()} needs the Python package {error.name!r}; install "
            "fabweave[threemf], or export the mesh as OBJ"
        ) from None
    except MemoryError:
        raise
    except Exception as error:  # whatever a broken file makes the library do is a broken file
        raise InputError(
            f"{path.name}: this cannot be read as a {kind.upper()} file "
            f"({type(error).__name__}: {str(error)[:200]}); export it again, preferably as OBJ"
        ) from error
    if not parts:
        raise InputError(f"{path.name}: the file has no faces; export it again as a mesh")
    points = np.concatenate([vertices for vertices, _ in parts])
    shift = offsets_of(np.array([len(vertices) for vertices, _ in parts]))
    triangles = np.concatenate(
        [faces + start for (_, faces), start in zip(parts, shift[:-1], strict=True)]
    )
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise InputError(f"{path.name}: a face names a vertex that does not exist; export it again")
    soup = PolyMesh.from_triangles(points, triangles)
    mesh, joined, dropped = weld_mesh(soup)
    notes = [
        agree(count, what)
        for count, what in (
            (
                joined,
                "{n} [vertex was|vertices were] at the same place as another vertex and merged "
                "with it",
            ),
            (dropped, "{n} [face|faces] collapsed to a line or a point and [was|were] left out"),
        )
        if count
    ]
    if not mesh.n_faces:
        raise InputError(f"{path.name}: every face in the file has collapsed to a line or a point")
    return mesh, "m" if kind in ("glb", "gltf") else unit, tuple(notes)


def has_z_up(data: bytes) -> bool:
    """Tell whether a GLB or glTF file states that z points up, as those of fabweave do.

    Examples
    --------
    >>> has_z_up(b'{"asset": {"version": "2.0", "extras": {"up": "z"}}}')
    True
    """
    try:
        stated = _gltf_document(data)["asset"]["extras"]["up"]
    except (ValueError, LookupError, TypeError, RecursionError):
        return False
    return bool(stated == "z")


def _placed_parts(scene: Any, mesh_type: Any, name: str) -> list[tuple[Any, Any]]:
    """Return vertices and faces of every instance in the scene, at its place."""
    parts: list[tuple[Any, Any]] = []
    triangles = 0
    for node in sorted(scene.graph.nodes_geometry):
        transform, geometry_name = scene.graph[node]
        geometry = scene.geometry[geometry_name]
        if not isinstance(geometry, mesh_type) or not len(geometry.faces):
            continue
        triangles += len(geometry.faces)
        if len(parts) == _MOST_PLACED or triangles > MOST_TRIANGLES:
            raise InputError(
                f"{name}: its objects, each as often as it is placed, come to {len(parts) + 1:,} "
                f"objects with {triangles:,} triangles or more; at most {_MOST_PLACED:,} and "
                f"{MOST_TRIANGLES:,} are read. Export one coarser mesh"
            )
        vertices = np.asarray(geometry.vertices, dtype=np.float64)
        faces = np.asarray(geometry.faces, dtype=np.int64)
        if not np.array_equal(transform, np.eye(4)):
            vertices = vertices @ transform[:3, :3].T + transform[:3, 3]
            if np.linalg.det(transform[:3, :3]) < 0:
                faces = faces[:, ::-1]  # a mirror turns the faces inside out
        parts.append((vertices, faces))
    return parts


def _require_bounded(data: bytes, name: str) -> None:
    """Raise InputError for a 3MF archive that would unpack to more than its share."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        unpacked = sum(entry.file_size for entry in archive.infolist())
    ratio = unpacked / len(data)
    if unpacked > MOST_UNPACKED or (unpacked > _SMALL and ratio > _MOST_RATIO):
        raise InputError(
            f"{name}: its {len(data):,} bytes would unpack to {unpacked:,}, {ratio:.0f} times "
            f"as many; at most {MOST_UNPACKED:,} are unpacked, and {_MOST_RATIO} times as "
            "many. Export the mesh again, coarser, or as OBJ"
        )


def _gltf_document(data: bytes) -> Any:
    """Return the JSON of a glTF file, text or binary.

    Raises
    ------
    ValueError, RecursionError
        If there is none.
    """
    if data[:4] == b"glTF":
        length = int.from_bytes(data[12:16], "little")
        if data[16:20] != b"JSON" or 20 + length > len(data):
            raise ValueError("it does not begin as a GLB file of version 2")
        data = data[20 : 20 + length]
    document = json.loads(data)
    if not isinstance(document, dict):
        raise ValueError("its JSON is not an object")  # noqa: TRY004 -- as all else that is wrong
    return document


def _files_beside(path: Path) -> Any:
    """Return what finds the files that a glTF file names beside it: ordinary, bounded ones."""
    import trimesh  # noqa: PLC0415 -- it takes long to import

    class Beside(trimesh.resolvers.FilePathResolver):
        def get(self, name: str) -> bytes:
            part = path.parent / name
            if not part.resolve().is_relative_to(path.parent.resolve()):
                raise InputError(f"it names {name[:60]!r}, which is not beside it")
            return read_input(part, "a part of the mesh", MOST_BYTES)

    return Beside(str(path))
