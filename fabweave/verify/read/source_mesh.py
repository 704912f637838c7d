"""Read the mesh that a job was made from, where it is at hand: an OBJ file, as loose polygons."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.verify.drawing import Floats, ReadError
from fabweave.verify.read.content import read_content


@dataclass(frozen=True, eq=False)
class SourceMesh:
    """The faces of a mesh, each the (K, 3) places of its corners, in the file's own unit."""

    name: str
    faces: tuple[Floats, ...]


def read_source(
    directory: Path,
    options: dict[str, Any],
    read: Callable[[str, Callable[[Path], SourceMesh]], SourceMesh | None],
) -> SourceMesh | None:
    """Read the mesh that job.toml names, if it is an OBJ file and can be found.

    A mesh that came from memory is kept in the job's folder, and belongs to the job. A file
    elsewhere may be gone, or be another one by now. It is read only if it is not newer than the
    job, and by a relative path only if the job is below the folder in which that path begins.
    Nothing is said where it cannot be read.

    Parameters
    ----------
    directory : Path
        The job's folder.
    options : dict
        What job.toml says the job was asked for.
    read : callable
        Reads a file of the folder, or tells why not.
    """
    name = options.get("mesh")
    # Whoever wrote job.toml may not have us ask other machines for files.
    strange = ("//", "\\\\")
    if not isinstance(name, str) or "\0" in name or name.startswith(strange):
        return None
    path, woven = Path(name), directory / "woven_mesh.obj"
    if path.suffix.lower() != ".obj":
        return None
    if path.name == name != woven.name and (directory / name).is_file():
        return read(name, read_polygons)
    if not path.is_absolute() and Path.cwd() not in directory.resolve().parents:
        return None
    try:
        newer = path.stat().st_mtime > woven.stat().st_mtime
        return None if newer else read_polygons(path)
    except (OSError, ReadError):
        return None


def read_polygons(path: Path) -> SourceMesh:
    """Read the faces of an OBJ file, whatever they are.

    Raises
    ------
    ReadError
        If a vertex or face cannot be understood.
    OSError
        If the file cannot be read.
    """
    text = read_content(path).decode("latin-1").replace("\\\r\n", " ").replace("\\\n", " ")
    places: list[list[float]] = []
    faces: list[list[int]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].split()
        try:
            if words[:1] == ["v"]:
                x, y, z = map(float, words[1:4])
                places.append([x, y, z])
            elif words[:1] == ["f"]:
                numbers = [int(word.partition("/")[0]) for word in words[1:]]
                faces.append([n - 1 if n > 0 else len(places) + n for n in numbers])
        except ValueError as error:
            raise ReadError(f"line {number} is malformed: {error}") from error
    corners = [corner for face in faces for corner in face]
    if not corners or min(corners) < 0 or max(corners) >= len(places):
        raise ReadError("it has no faces, or one that names a vertex that is not there")
    vertices, sizes = np.array(places), [len(face) for face in faces]
    return SourceMesh(path.name, tuple(np.split(vertices[corners], np.cumsum(sizes)[:-1])))
