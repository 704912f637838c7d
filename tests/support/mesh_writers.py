"""Write meshes in binary kinds of files, which the package only reads."""

import struct

import numpy as np

from fabweave.mesh.polymesh import PolyMesh


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


def binary_off(mesh: PolyMesh) -> bytes:
    """Return the bytes of a binary OFF file, which holds 32-bit floats by definition."""
    faces = b"".join(
        # No colours follow the corners.
        struct.pack(f">{len(face) + 2}i", len(face), *face, 0)
        for face in mesh.faces()
    )
    counts = struct.pack(">3i", mesh.n_vertices, mesh.n_faces, 0)
    with np.errstate(over="ignore"):
        vertices = mesh.vertices.astype(">f4").tobytes()
    return b"OFF BINARY\n" + counts + vertices + faces
