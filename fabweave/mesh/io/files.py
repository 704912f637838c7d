"""Read mesh files by what they hold, and write them."""

import re
from collections.abc import Callable
from pathlib import Path

from fabweave.core.errors import InputError
from fabweave.core.files import MOST_BYTES, read_input
from fabweave.core.messages import agree
from fabweave.mesh.io.gltf import read_gltf
from fabweave.mesh.io.mesh_file import MeshFile
from fabweave.mesh.io.ply import read_ply
from fabweave.mesh.io.stl import is_binary_stl, read_stl
from fabweave.mesh.io.text import read_obj, read_off
from fabweave.mesh.io.threemf import has_model, read_3mf
from fabweave.mesh.weld import weld_mesh

_READERS: dict[str, Callable[[bytes, Path], MeshFile]] = {
    "obj": lambda data, path: read_obj(data, path.name),
    "off": lambda data, path: read_off(data, path.name),
    "ply": lambda data, path: read_ply(data, path.name),
    "stl": lambda data, path: read_stl(data, path.name),
    "glb": read_gltf,
    "gltf": read_gltf,
    "3mf": lambda data, path: read_3mf(data, path.name),
}
#: Formats that hold triangles whose corners may be vertices of their own.
_TRIANGLES = ("stl", "glb", "gltf", "3mf")

#: Formats that can be read.
READABLE = tuple(_READERS)

#: How files begin that hold a mesh in a format that can be read.
_BEGINNINGS = (
    ("glb", rb"glTF"),
    ("ply", rb"ply\s"),
    ("stl", rb"(?i:solid)\b(?s:.*?)\b(?i:facet|endsolid)\b"),
    ("gltf", rb"\{(?s:.*)\"asset\""),
    ("off", rb"(ST|C|N)*OFF\s"),
    ("obj", rb"(?m:(?s:.*?)^v[ \t]+[-+.\d](?s:.*?)^v[ \t]+[-+.\d])"),
)
#: How other files begin, what they are, and what to do.
_OTHERS = (
    (rb"version https://git-lfs", "a pointer of Git LFS, and not the mesh", "run git lfs pull"),
    (rb"(?i:<!doctype html|<html)", "a web page", "download the file itself"),
    (rb"<", "an XML file", ""),
    (rb"Kaydara FBX|; FBX", "an FBX file", ""),
    (rb"BLENDER", "a Blender file", ""),
    (rb"ISO-10303-21", "a STEP file", ""),
    (rb"#usda|PXR-USDC", "a USD file", ""),
    (rb"3D Geometry File Format", "a Rhino file", ""),
    (rb"%PDF|\x89PNG|\xff\xd8\xff|GIF8", "a picture or a document", ""),
    (rb"\x1f\x8b|7z\xbc\xaf|Rar!|\x28\xb5\x2f\xfd", "a packed file", "unpack it"),
)
#: Where in a file its kind shows.
_HEAD = 100_000


def read_mesh(path: str | Path) -> MeshFile:
    """Read a mesh file; in formats that hold triangles, vertices at the same place become one.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    MeshFile
        The mesh, and what the file says about it.

    Raises
    ------
    InputError
        If the file is missing, of another format, cannot be understood, or has no faces.
    """
    file = read_file(path)
    if file.format not in _TRIANGLES:
        return file
    mesh, joined, dropped = weld_mesh(file.mesh)
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
        raise InputError(
            f"{Path(path).name}: every face in the file has collapsed to a line or a point"
        )
    return MeshFile(mesh, file.format, file.unit, (*file.notes, *notes), file.up, file.objects)


def read_file(path: str | Path) -> MeshFile:
    """Read what a mesh file says, and change nothing.

    What the file holds tells its format; its name does where that leaves it open.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        As for :func:`read_mesh`.
    """
    path = Path(path)
    if str(path) == "-":
        raise InputError(
            "a mesh cannot be read from standard input, because job.toml names its file, so that "
            "the job can be made again; save it in a file first"
        )
    data = read_input(path, "the mesh", MOST_BYTES)
    if not data:
        raise InputError(f"{path.name}: the file is empty")
    named = path.suffix[1:].lower()
    data, kind = _kind_of(data, path)
    file = _READERS[kind](data, path)
    if not file.mesh.n_faces:
        said = "".join(f"; {note}" for note in file.notes)
        raise InputError(
            f"{path.name}: the file has {file.mesh.n_vertices} vertices and no faces{said}; export "
            "it again as a polygon mesh"
        )
    if kind == named:
        return file
    note = f"{path.name} is {_called(kind)}, whatever its name says, and was read as one"
    return MeshFile(file.mesh, kind, file.unit, (note, *file.notes), file.up, file.objects)


def _kind_of(data: bytes, path: Path) -> tuple[bytes, str]:
    """Return a file's bytes, as UTF-8 where they are text with another mark, and its format."""
    named = path.suffix[1:].lower()
    if is_binary_stl(data):
        return data, "stl"
    for mark, codec in (
        (b"\xff\xfe\0\0", "utf-32"), (b"\0\0\xfe\xff", "utf-32"),
        (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16"),
    ):  # fmt: skip
        if data.startswith(mark):
            data = data.decode(codec, "replace").encode()
            break
    head = data[:_HEAD].removeprefix(b"\xef\xbb\xbf").lstrip()
    if head.startswith((b"PK\3\4", b"PK\5\6")):
        if named == "3mf" or has_model(data):
            return data, "3mf"
        raise InputError(f"{path.name} is a ZIP archive; unpack it, and name the mesh in it")
    for kind, begins in _BEGINNINGS:
        # Anything may stand before the first vertex of OBJ: its name says that it is one.
        if (kind != "obj" or (named != "obj" and b"\0" not in head)) and re.match(begins, head):
            return data, kind
    for begins, what, cure in _OTHERS:
        if re.match(begins, head):
            raise InputError(f"{path.name} is {what}; {cure or 'export the mesh as OBJ'}")
    if named not in READABLE:
        what = f"format {path.suffix!r}" if named else "a file without an extension"
        raise InputError(
            f"{path.name}: {what} cannot be read; formats that can be read: "
            + ", ".join(item.upper() for item in READABLE)
        )
    return data, named


def _called(kind: str) -> str:
    """Return what a file of a format is called.

    Examples
    --------
    >>> _called("stl"), _called("3mf")
    ('an STL file', 'a 3MF file')
    """
    return f"{'an' if kind in ('obj', 'off', 'stl') else 'a'} {kind.upper()} file"
