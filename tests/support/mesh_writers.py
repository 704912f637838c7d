"""Write meshes in kinds of files that the package only reads."""

import base64
import io
import json
import struct
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.polymesh import PolyMesh


def write_mesh(path: str | Path, mesh: PolyMesh) -> None:
    """Write a mesh as an OBJ file."""
    Path(path).write_bytes(obj_bytes(mesh))


def binary_ply(mesh: PolyMesh, *, big_endian: bool = False) -> bytes:
    """Return the bytes of a binary PLY file with double precision."""
    order, name = (">", "big") if big_endian else ("<", "little")
    small = max(mesh.face_sizes, default=0) < 256
    count = "uchar" if small else "int"
    head = (
        f"ply\nformat binary_{name}_endian 1.0\ncomment by hand\n"
        f"element vertex {mesh.n_vertices}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {mesh.n_faces}\nproperty list {count} int vertex_indices\nend_header\n"
    )
    faces = b"".join(
        struct.pack(f"{order}{'B' if small else 'i'}{len(face)}i", len(face), *face)
        for face in mesh.faces()
    )
    return head.encode() + mesh.vertices.astype(f"{order}f8").tobytes() + faces


def off_bytes(mesh: PolyMesh) -> bytes:
    """Return the bytes of an OFF file."""
    return _text(["OFF", f"{mesh.n_vertices} {mesh.n_faces} 0"], mesh)


def ply_bytes(mesh: PolyMesh) -> bytes:
    """Return the bytes of a PLY text file."""
    head = ["ply", "format ascii 1.0", f"element vertex {mesh.n_vertices}"]
    head += [f"property double {axis}" for axis in "xyz"]
    head += [f"element face {mesh.n_faces}", "property list int int vertex_indices", "end_header"]
    return _text(head, mesh)


def _text(head: list[str], mesh: PolyMesh) -> bytes:
    rows = [*mesh.vertices.tolist(), *([len(face), *face] for face in mesh.faces())]
    return "\n".join([*head, *(" ".join(map(repr, row)) for row in rows), ""]).encode("ascii")


_COMPONENTS = {"b": 5120, "B": 5121, "h": 5122, "H": 5123, "I": 5125, "f": 5126}
_TYPES = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}


def add_accessor(document: dict[str, Any], rows: npt.NDArray[Any], **more: Any) -> int:
    """Add an array to a glTF document, in a data URI, and return its number."""
    data = rows.tobytes()
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    number = len(document["accessors"])
    document["buffers"].append({"byteLength": len(data), "uri": uri})
    document["bufferViews"].append({"buffer": number, "byteLength": len(data)})
    accessor = {"bufferView": number, "count": len(rows), "type": _TYPES[rows.shape[1:]]}
    accessor["componentType"] = _COMPONENTS[rows.dtype.char]
    document["accessors"].append(accessor | more)
    return number


def gltf_of(mesh: PolyMesh) -> dict[str, Any]:
    """Return a glTF document with one node for a mesh of triangles."""
    document: dict[str, Any] = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "accessors": [], "bufferViews": [], "buffers": [],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    }  # fmt: skip
    add_accessor(document, mesh.vertices.astype("f"))
    add_accessor(document, mesh.indices.astype("H"))
    return document


def glb_bytes(document: Mapping[str, Any], binary: bytes = b"") -> bytes:
    """Return a glTF document as a binary file."""
    text = json.dumps(document).encode()
    chunks = b""
    for kind, chunk, pad in ((b"JSON", text, b" "), (b"BIN\0", binary, b"\0")):
        padded = chunk + pad * (-len(chunk) % 4)
        chunks += struct.pack("<I4s", len(padded), kind) + padded
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


_3MF = "http://schemas.microsoft.com/3dmanufacturing"


def model_xml(resources: str, build: str, more: str = "") -> str:
    """Return a model of a 3MF file; the prefix p is that of the production extension."""
    return (
        f'<model xmlns="{_3MF}/core/2015/02" xmlns:p="{_3MF}/production/2015/06" {more}>'
        f"<resources>{resources}</resources><build>{build}</build></model>"
    )


def object_xml(number: int, mesh: PolyMesh, more: str = "") -> str:
    """Return an object of a 3MF file: a mesh of triangles."""
    vertices = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
    faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces())
    return (
        f'<object id="{number}" {more}><mesh><vertices>{vertices}</vertices>'
        f"<triangles>{faces}</triangles></mesh></object>"
    )


def packed_3mf(model: str | bytes, others: Mapping[str, str] | None = None) -> bytes:
    """Return a 3MF file: its model, which a relation names, and other parts by their names."""
    relation = f'<Relationship Id="r" Target="/3D/a.model" Type="{_3MF}/2013/01/3dmodel"/>'
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("_rels/.rels", f"<Relationships>{relation}</Relationships>")
        archive.writestr("3D/a.model", model)
        for name, text in (others or {}).items():
            archive.writestr(name, text)
    return file.getvalue()


def binary_stl(mesh: PolyMesh) -> bytes:
    """Return a binary STL file of a mesh of triangles."""
    rows = np.zeros(mesh.n_faces, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("c", "<u2")])
    rows["corners"] = mesh.vertices[mesh.indices].reshape(-1, 3, 3)
    return b"solid or not".ljust(80) + struct.pack("<I", mesh.n_faces) + rows.tobytes()
