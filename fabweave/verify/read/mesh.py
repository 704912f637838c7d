"""Read the mesh that a job was made from, where it is at hand: an OBJ file, as loose polygons."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fabweave.verify.drawing import Floats, Ints, ReadError, read_content


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
        return read(name, _source)
    if not path.is_absolute() and Path.cwd() not in directory.resolve().parents:
        return None
    try:
        newer = path.stat().st_mtime > woven.stat().st_mtime
        return None if newer else _source(path)
    except (OSError, ReadError):
        return None


def _source(path: Path) -> SourceMesh:
    """Read a file as loose polygons."""
    places, faces = read_polygons(path)
    return SourceMesh(path.name, tuple(places[face] for face in faces))


def read_polygons(path: Path) -> tuple[Floats, list[list[int]]]:
    """Read the vertices of an OBJ file and the corners of its faces, whatever they are.

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
    return np.array(places), faces


@dataclass(frozen=True, eq=False)
class LoadedMesh:
    """A polygon mesh; corner ``c`` is also the side from its vertex to the next corner's."""

    vertices: Floats
    corner: Ints
    face: Ints
    next: Ints
    prev: Ints
    twin: Ints
    centres: Floats

    @property
    def inner(self) -> Ints:
        """One side of each inner edge."""
        sides = np.arange(len(self.corner))
        return np.flatnonzero(sides < self.twin)


def read_obj(path: Path) -> LoadedMesh:
    """Read vertices and faces of an OBJ file as an oriented manifold mesh.

    Raises
    ------
    ReadError
        If a line is malformed, or an edge has more than two faces or two that run the same way.
    """
    positions, faces = read_polygons(path)
    if not np.all(np.isfinite(positions)):
        raise ReadError("a vertex is not finite")
    sizes = np.array([len(face) for face in faces])
    corner = np.array([vertex for face in faces for vertex in face], dtype=np.int64)
    if sizes.min() < 3:
        raise ReadError("a face has fewer than three corners")
    ends = np.cumsum(sizes)
    starts = ends - sizes
    following = np.arange(1, len(corner) + 1)
    following[ends - 1] = starts
    preceding = np.empty_like(following)
    preceding[following] = np.arange(len(corner))
    return LoadedMesh(
        vertices=positions,
        corner=corner,
        face=np.repeat(np.arange(len(faces)), sizes),
        next=following,
        prev=preceding,
        twin=_twins(corner, corner[following], len(positions)),
        centres=np.add.reduceat(positions[corner], starts) / sizes[:, None],
    )


def _twins(tail: Ints, head: Ints, count: int) -> Ints:
    """Pair the sides of each edge; -1 along the boundary."""
    forward = tail * count + head
    if len(np.unique(forward)) < len(forward):
        raise ReadError("two faces run the same way along an edge")
    order = np.argsort(forward)
    place = np.searchsorted(forward, head * count + tail, sorter=order)
    candidate = order[np.minimum(place, len(order) - 1)]
    return np.where(forward[candidate] == head * count + tail, candidate, -1)


def edge_keys(mesh: LoadedMesh) -> Ints:
    """Return for each side a number of its edge: the lesser of the two sides."""
    sides = np.arange(len(mesh.corner))
    return np.where(mesh.twin >= 0, np.minimum(sides, mesh.twin), sides)
