"""Write meshes in kinds of files that the package only reads."""

import struct

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
