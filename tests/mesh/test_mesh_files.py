"""Reading and writing: the traps of each format, exact round trips, and broken files."""

import json
import struct
import zipfile

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import run
from mesh_writers import binary_off, binary_ply
from strategies import any_meshes

from fabweave.app.mesh_source import load_mesh
from fabweave.app.settings import Settings
from fabweave.core.errors import InputError
from fabweave.mesh import weld
from fabweave.mesh.check import check_mesh
from fabweave.mesh.io.files import READABLE, WRITABLE, read_mesh, write_mesh
from fabweave.mesh.io.obj import obj_bytes, read_obj
from fabweave.mesh.io.off import off_bytes, read_off
from fabweave.mesh.io.ply import ply_bytes, read_ply
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.weld import weld_mesh

READERS = {"obj": read_obj, "off": read_off, "ply": read_ply}
HOUSE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]]
HOUSE_FACES = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
V = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\n"


def read(kind, text):
    data = text.encode("latin-1") if isinstance(text, str) else text
    return READERS[kind](data, f"a.{kind}")[0]


def same(mesh, other):
    return (
        np.array_equal(mesh.vertices, other.vertices, equal_nan=True)
        and np.array_equal(np.signbit(mesh.vertices), np.signbit(other.vertices))
        and np.array_equal(mesh.offsets, other.offsets)
        and np.array_equal(mesh.indices, other.indices)
    )


OBJ_TRAPS = {
    "plain": V + "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
    "negative": V + "f -5 -2 -3 -4\nf -5 -4 -1\nf -4 -3 -1\nf -3 -2 -1\nf -2 -5 -1\n",
    "negative, mixed with positive": V + "f 1 -2 3 -4\nf 1 2 -1\nf -4 3 5\nf 3 4 5\nf 4 1 5\n",
    "texture and normals": V
    + "vt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 4/2/1 3/1/1 2/2/1\nf 1/1 2/2 5/1\nf 2//1 3//1 5//1\n"
    "f 3/-1/-1 4/1/1 5/2/1\nf 4/ 1// 5\n",
    "continuation": V
    + "f 1 \\\n4 3 \\\n 2\nf 1 2\\\n 5\nf 2 3 5\\\n\nf 3 4 5\nf 4 1 5\n# path C:\\\n",
    "comment with a backslash before a face": V
    + "# C:\\tmp\\\nf 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5",
    "CRLF": (V + "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n").replace("\n", "\r\n"),
    "CR only": (V + "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n").replace("\n", "\r"),
    "CRLF continuation": V.replace("\n", "\r\n")
    + "f 1 4 \\\r\n3 2\r\nf 1 2 5\r\nf 2 3 5\r\nf 3 4 5\r\nf 4 1 5\r\n",
    "colours": "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 1\nv 0.5 0.5 1 0 0 0\n"
    "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
    "weights and colours on some": "v 0 0 0 1\nv 1 0 0\nv 1 1 0 0.1 0.2 0.3\nv 0 1 0\n"
    "v 0.5 0.5 1 1.0\nf 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n",
    "faces before their vertices": "f 1 4 3 2\nf 1 2 5\n" + V + "f 2 3 5\nf 3 4 5\nf 4 1 5\n",
    "comments, blanks, tabs, indents": "\ufeff".encode().decode("latin-1")
    + "# a house\n\n  "
    + V.replace(" ", "\t").replace("\n", " # corner\n \t")
    + "\n\tf  1\t4 3  2   # floor\n#f 1 2 3\nf 1 2 5\nf 2 3 5\n\n\nf 3 4 5\nf 4 1 5#end",
    "other statements": "mtllib a_b.mtl\no H\xc3\x85\x85user\n"
    + V
    + "g a b\nusemtl x\ns off\nvp 1 2\nl 1 2\np 3\ncurv 0 1 1 2\nvnoise 1\nfoo 1\nf 1 4 3 2\n"
    "s 1\nf 1 2 5\nf 2 3 5\no Other\nf 3 4 5\nf 4 1 5\n",
    "exponents and signs": "v 0e0 -0 +0\nv 1.0E+00 .0 0.\nv 1 1 0\nv 0 10e-1 0\nv .5 5.E-1 1\n"
    "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf +4 1 5\n",
}


@pytest.mark.parametrize("text", OBJ_TRAPS.values(), ids=OBJ_TRAPS)
def test_obj_traps(text):
    mesh = read("obj", text)
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES


def test_obj_relative_numbers_count_from_the_vertices_so_far():
    square = "v {0} 0 0\nv {0} 1 0\nv {0} 1 1\nf -3 -2 -1\n"
    mesh = read("obj", square.format(1) + square.format(2) + square.format(3))
    assert mesh.faces() == [[0, 1, 2], [3, 4, 5], [6, 7, 8]]


def test_obj_values_that_are_no_numbers():
    text = "v 1.#IND -1.#IND 1.#QNAN # x\nv 1.#INF -1.#INF00 1.#SNAN\nv nan -inf inf\nf 1 2 3\n"
    mesh = read("obj", text)
    nan, inf = np.nan, np.inf
    assert np.array_equal(
        mesh.vertices, [[nan, nan, nan], [inf, -inf, nan], [nan, -inf, inf]], equal_nan=True
    )


OFF_V = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n"
OFF_F = "4 0 3 2 1\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n"
OFF_TRAPS = {
    "plain": "OFF\n5 5 0\n" + OFF_V + OFF_F,
    "counts on the line of the keyword": "OFF 5 5 8\n" + OFF_V + OFF_F,
    "no edge count": "OFF\n5 5\n" + OFF_V + OFF_F,
    "no keyword": "5 5 0\n" + OFF_V + OFF_F,
    "comments everywhere": "# a\nOFF # b\n# c\n\n5 5 0 # d\n"
    + OFF_V.replace("\n", " # v\n#\n")
    + "\n"
    + OFF_F.replace("\n", "# f\n"),
    "CRLF, no end": ("OFF\n5 5 0\n" + OFF_V + OFF_F).replace("\n", "\r\n").rstrip(),
    "COFF": "COFF\n5 5 0\n" + OFF_V.replace("\n", " 255 0 0 255\n") + OFF_F,
    "COFF of three": "COFF\n5 5 0\n" + OFF_V.replace("\n", " 0.5 0 1\n") + OFF_F,
    "NOFF": "NOFF\n5 5 0\n" + OFF_V.replace("\n", " 0 0 1\n") + OFF_F,
    "CNOFF": "CNOFF\n5 5 0\n" + OFF_V.replace("\n", " 0 0 1 1 0 0 1\n") + OFF_F,
    "STOFF": "STOFF\n5 5 0\n" + OFF_V.replace("\n", " 0.25 0.75\n") + OFF_F,
    "STCNOFF": "STCNOFF 5 5 0\n" + OFF_V.replace("\n", " 0 0 1 1 0 0 1 0 0\n") + OFF_F,
    "face colours": "OFF\n5 5 0\n"
    + OFF_V
    + "4 0 3 2 1 255 0 0\n3 0 1 4 0.1 0.2 0.3 1.0\n3 1 2 4 7\n3 2 3 4\n3 3 0 4 0.5 0.5 0.5\n",
    "whole face colours": "OFF\n5 5 0\n" + OFF_V + OFF_F.replace("\n", " 200 100 0\n"),
    "all on one line": ("OFF\n5 5 0\n" + OFF_V.replace("\n", " ") + "\n" + OFF_F),
    "faces on one line": ("OFF\n5 5 0\n" + OFF_V + OFF_F.replace("\n", " ")),
    "normals on one line": "NOFF 5 5 0\n" + OFF_V.replace("\n", " 0 0 1 ") + "\n" + OFF_F,
}


@pytest.mark.parametrize("text", OFF_TRAPS.values(), ids=OFF_TRAPS)
def test_off_traps(text):
    mesh = read("off", text)
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES


def house_off(order, keyword, extra, colours):
    data = f"{keyword}OFF BINARY\n".encode() + struct.pack(f"{order}3i", 5, 5, 0)
    for vertex in HOUSE:
        data += struct.pack(f"{order}{3 + extra}f", *vertex, *[0.5] * extra)
    for number, face in enumerate(HOUSE_FACES):
        colour = colours[number % len(colours)] if colours else 0
        data += struct.pack(f"{order}{len(face) + 1}i", len(face), *face)
        data += struct.pack(f"{order}i{colour}f", colour, *[0.25] * colour)
    return data


@pytest.mark.parametrize("order", [">", "<"])
@pytest.mark.parametrize(("keyword", "extra"), [("", 0), ("C", 4), ("N", 3), ("STCN", 9)])
@pytest.mark.parametrize("colours", [(), (3,), (0, 4, 1, 3, 0)])
def test_off_binary(order, keyword, extra, colours):
    mesh = read("off", house_off(order, keyword, extra, colours))
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES


def test_off_in_the_other_byte_order_is_said():
    assert read_off(house_off(">", "", 0, ()), "a.off")[1] == ()
    assert "little-endian" in read_off(house_off("<", "", 0, ()), "a.off")[1][0]


#: Two strips: a band of four triangles, and one of a triangle, a detour and two more.
STRIPS = ([0, 1, 2, 3, 4, 0], [2, 1, 0, -1, 4, 3, 2, 2, 1])
STRIP_FACES = [
    [0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 0], [2, 1, 0], [4, 3, 2],
]  # fmt: skip


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("empty_faces", [False, True])
def test_ply_strips(order, empty_faces):
    kind = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = ["ply", f"format {kind} 1.0", f"element vertex {len(HOUSE)}"]
    head += [f"property float {axis}" for axis in "xyz"]
    if empty_faces:
        head += ["element face 0", "property list uchar int vertex_indices"]
    head += ["element tristrips 2", "property list int int vertex_indices", "end_header", ""]
    data = "\n".join(head).encode()
    for row in (*HOUSE, *STRIPS):
        values = row if row in HOUSE else [len(row), *row]
        if order:
            data += struct.pack(f"{order}{len(values)}{'f' if row in HOUSE else 'i'}", *values)
        else:
            data += " ".join(map(str, values)).encode() + b"\n"
    mesh, notes = read_ply(data, "a.ply")
    assert mesh.faces() == STRIP_FACES
    assert notes == ("the file has 2 rows of triangle strips, which were read as 6 triangles",)


def test_off_says_what_it_left_out():
    _, notes = read_off(("OFF\n5 4 0\n" + OFF_V + OFF_F).encode(), "a.off")
    assert notes == ("1 lines after the last face were ignored",)


PLY_CODES = {
    "char": "b",
    "uchar": "B",
    "int16": "h",
    "ushort": "H",
    "int": "i",
    "uint32": "I",
    "int64": "q",
}


def ply_house(order, *, count="uchar", index="int", position="float", extras=True, other=True):
    """Build a PLY file of the house by hand; order is ``>``, ``<`` or None for text."""
    name = {">": "binary_big_endian", "<": "binary_little_endian", None: "ascii"}[order]
    head = ["ply", f"format {name} 1.0", "comment made by hand", "obj_info none"]
    rows = []
    if other:
        head += ["element camera 2", "property double fov", "property list uchar float lens"]
        rows += [("dB2f", 1.5, 2, 3.0, 4.0), ("dB0f", 1.5, 0)]
    head += ["element vertex 5"] + ["property uchar flag"] * extras
    head += [f"property {position} {axis}" for axis in "xyz"] + ["property float q"] * extras
    kind = {"float": "f", "double": "d"}[position]
    for vertex in HOUSE:
        rows.append(
            ("B" * extras + f"3{kind}" + "f" * extras, *[7] * extras, *vertex, *[9.0] * extras)
        )
    head += ["element face 5"] + ["property short group", "property list uchar float uv"] * extras
    head += [f"property list {count} {index} vertex_indices"] + ["property uchar red"] * extras
    c, i = PLY_CODES[count], PLY_CODES[index]
    for number, face in enumerate(HOUSE_FACES):
        uv = [0.5] * (number % 3)
        before = (f"hB{len(uv)}f", -1, len(uv), *uv) if extras else ("",)
        after = ("B", 200) if extras else ("",)
        rows.append(
            (before[0] + f"{c}{len(face)}{i}" + after[0], *before[1:], len(face), *face, *after[1:])
        )
    head += ["element tail 1", "property int x", "end_header", ""]
    rows.append(("i", 5))
    start = "\n".join(head).encode()
    if order is None:
        return start + "".join(" ".join(map(str, row[1:])) + "\n" for row in rows).encode()
    return start + b"".join(struct.pack(order + row[0], *row[1:]) for row in rows)


@pytest.mark.parametrize("order", [None, "<", ">"])
@pytest.mark.parametrize("count", PLY_CODES)
@pytest.mark.parametrize("index", PLY_CODES)
def test_ply_of_every_list_type(order, count, index):
    mesh = read("ply", ply_house(order, count=count, index=index))
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES


@pytest.mark.parametrize("order", [None, "<", ">"])
@pytest.mark.parametrize("extras", [False, True])
@pytest.mark.parametrize("other", [False, True])
@pytest.mark.parametrize("position", ["float", "double"])
def test_ply_with_and_without_other_things(order, extras, other, position):
    data = ply_house(order, extras=extras, other=other, position=position)
    mesh = read("ply", data)
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES
    end = data.index(b"end_header\n")
    windows = data[:end].replace(b"\n", b"\r\n") + b"end_header\r\n" + data[end + 11 :]
    assert same(read("ply", windows), mesh)


def test_ply_vertex_index_is_a_name_too_and_faces_may_come_first():
    text = (
        "ply\nformat ascii 1.0\nelement face 1\nproperty list int int vertex_index\n"
        "element vertex 3\nproperty int x\nproperty int y\nproperty int z\nend_header\n"
        "3 2 1 0\n0 0 0\n1 0 0\n0 1 0\n"
    )
    assert read("ply", text).faces() == [[2, 1, 0]]


@pytest.mark.parametrize("kind", ["obj", "off", "ply"])
@given(mesh=any_meshes())
def test_text_gives_back_every_bit(kind, mesh):
    make = {"obj": obj_bytes, "off": off_bytes, "ply": ply_bytes}[kind]
    data = make(mesh)
    assert data == make(mesh)
    assert data.isascii()
    again = read(kind, data)
    # Text has no sign for "not a number".
    expected = mesh.with_vertices(np.where(np.isnan(mesh.vertices), np.nan, mesh.vertices))
    assert np.array_equal(again.vertices, expected.vertices, equal_nan=True)
    number = ~np.isnan(mesh.vertices)
    assert np.array_equal(np.signbit(again.vertices[number]), np.signbit(mesh.vertices[number]))
    assert again.faces() == mesh.faces()


@pytest.mark.parametrize("big", [False, True])
@given(mesh=any_meshes())
def test_binary_ply_gives_back_every_bit(big, mesh):
    again = read("ply", binary_ply(mesh, big_endian=big))
    assert again.vertices.tobytes() == mesh.vertices.tobytes()
    assert again.faces() == mesh.faces()


@given(mesh=any_meshes())
def test_binary_off_gives_back_faces_and_rounded_positions(mesh):
    again = read("off", binary_off(mesh))
    with np.errstate(over="ignore"):
        rounded = mesh.vertices.astype(np.float32).astype(np.float64)
    assert np.array_equal(again.vertices, rounded, equal_nan=True)
    assert again.faces() == mesh.faces()


def test_face_of_300_corners():
    rim = [[np.cos(a), np.sin(a), 0] for a in np.arange(300) * np.pi / 150]
    mesh = PolyMesh.from_faces(rim, [list(range(300)), [0, 2, 1]])
    for kind, data in (
        ("obj", obj_bytes(mesh)),
        ("off", off_bytes(mesh)),
        ("ply", ply_bytes(mesh)),
        ("ply", binary_ply(mesh)),
    ):
        assert same(read(kind, data), mesh)


@pytest.mark.parametrize(
    ("kind", "first", "comment"),
    [("obj", b"", b"# a\n"), ("off", b"OFF\n", b"# a\n"), ("ply", b"1.0\n", b"comment a\n")],
)
def test_comments_are_passed_over(kind, first, comment):
    make = {"obj": obj_bytes, "off": off_bytes, "ply": ply_bytes}[kind]
    head, _, rest = (
        make(solids.cube()).partition(first) if first else (b"", b"", make(solids.cube()))
    )
    assert same(read(kind, head + first + 2 * comment + rest), solids.cube())


@pytest.mark.parametrize("extension", WRITABLE)
def test_files_on_disk(tmp_path, extension):
    path = tmp_path / f"solid.{extension.upper()}"
    mesh = solids.cube()
    write_mesh(path, mesh)
    found = read_mesh(str(path))
    assert same(found.mesh, mesh)
    assert (found.format, found.unit, found.unit_mm, found.notes) == (extension, None, None, ())


BROKEN = {
    "obj word": ("obj", V + "f 1 2 three\n", "line 6: found 'three' instead of a whole number"),
    "obj fraction": ("obj", V + "f 1 2 3.5\n", "line 6: found '3.5' instead of a whole number"),
    "obj underscore": ("obj", V + "f 1 2 1_0\n", "line 6: found '1_0'"),
    "obj number glued": (
        "obj",
        "v 1-2 3 0\nv 0 0 1_0\n",
        "line 1: found '1-2' instead of a number",
    ),
    "obj two numbers": ("obj", "v 0 0\n" + V, "line 1: found 2 numbers, but expected at least 3"),
    "obj vertex word": ("obj", V + "\n\nv 0 zero 0\n", "line 8: found 'zero' instead of a number"),
    "obj out of range": (
        "obj",
        V + "f 1 2 3\nf 1 2 6\n",
        "line 7: a face names vertex 6, but there are only 5",
    ),
    "obj zero": ("obj", V + "f 0 1 2\n", "line 6: a face names vertex 0, but OBJ counts from 1"),
    "obj too negative": ("obj", V + "f -1 -2 -6\n", "line 6: a face names vertex -6.* 5 vertices"),
    "obj huge": ("obj", V + "f 1 2 99999999999999999999\n", "line 6: "),
    "obj no corners": ("obj", V + "f\n", "line 6: a face has no corners"),
    "obj after continuation": ("obj", V + "f 1 \\\n2 \\\n 3\nf 1 2 x\n", "line 9: found 'x'"),
    "off word": (
        "off",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 x 0\n3 0 1 2\n",
        "line 5: found 'x' instead of a number",
    ),
    "off range": ("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 6: .*vertex 3"),
    "off below": ("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "line 6: .*x -1"),
    "off short face": (
        "off",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n",
        "the list should have 4 numbers",
    ),
    "off huge face": (
        "off",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9223372036854775807 0 1 2\n",
        "the list should have 9223372036854775807 numbers",
    ),
    "off fraction": (
        "off",
        "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1.5 2\n",
        "6: found 1.5 instead",
    ),
    "off cut": (
        "off",
        "OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
        "ends before its 3 ver",
    ),
    "off huge counts": ("off", "OFF\n999999999999 2 0\n0 0 0\n", "ends before its 999999999999"),
    "off negative counts": (
        "off",
        "OFF\n-3 2 0\n0 0 0\n",
        "line 2: expected the numbers of vertices",
    ),
    "off no counts": ("off", "OFF\n", "the numbers of vertices"),
    "off other": ("off", "ply\n3 1 0\n", "line 1: found 'ply' instead of the word OFF"),
    "off 4": ("off", "4OFF\n3 1 0\n", "not in three dimensions"),
    "off n": ("off", "nOFF\n3\n3 1 0\n", "not in three dimensions"),
    "off blank": ("off", "\n# only\n", "nothing but blank lines"),
    "off binary header": (
        "off",
        b"OFF BINARY\n\0\0\0\1",
        "byte 11: the file ends inside its header",
    ),
    "off binary counts": (
        "off",
        b"OFF BINARY\n\x7f\0\0\0\0\0\0\1\0\0\0\0",
        "but only 12 bytes",
    ),
    "off binary face": (
        "off",
        binary_off(solids.cube())[:-8],
        "face 5 of 6 is broken or cut short",
    ),
    "ply head": ("ply", "plx\n", "line 1: expected the word ply"),
    "ply no end": ("ply", "ply\nformat ascii 1.0\n", "no line end_header"),
    "ply no format": (
        "ply",
        "ply\nelement vertex 0\nend_header\n",
        "no line that begins",
    ),
    "ply format": ("ply", "ply\nformat binary 1.0\nend_header\n", "line 2: .*format must be ascii"),
    "ply count": ("ply", "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "line 3: "),
    "ply type": (
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\nend_header\n",
        "line 4: .*unknown type 'quad'; the types are char",
    ),
    "ply stray property": (
        "ply",
        "ply\nformat ascii 1.0\nproperty int x\nend_header\n",
        "line 3: ",
    ),
    "ply strips": (
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n3 0 1 2\n",
        "a face names vertex 1, but there are only 1",
    ),
    "ply no z": (
        "ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nend_header\n",
        "no properties x, y and z.*it gives x, y",
    ),
    "ply float index": (
        "ply",
        ply_bytes(solids.cube()).replace(b"uchar int", b"uchar float"),
        "not whole numbers",
    ),
    "ply cut": ("ply", ply_house("<")[:-40], r"the file ends in row \d of 5 of element 'face'"),
    "ply cut vertices": ("ply", ply_house(">", other=False)[:-180], "of element 'vertex'"),
    "ply text cut": ("ply", ply_house(None)[:-60], "rows of element 'face' are there"),
    "ply huge count": (
        "ply",
        binary_ply(solids.cube()).replace(b"face 6", b"face 999999999999999"),
        "of element 'face'",
    ),
    "ply range": (
        "ply",
        ply_bytes(solids.cube()).replace(b"\n4 0 2 3 1", b"\n4 0 2 3 8"),
        "face 0: a face names vertex 8, but there are only 8",
    ),
    "ply text list": (
        "ply",
        ply_bytes(solids.cube()).replace(b"\n4 0 2 3 1", b"\n5 0 2 3 1"),
        "line 18: the list should have 5 numbers, but 4 follow",
    ),
}


@pytest.mark.parametrize(("kind", "data", "message"), BROKEN.values(), ids=BROKEN)
def test_broken_file_is_named_with_its_place(kind, data, message):
    with pytest.raises(InputError, match=message) as caught:
        read(kind, data)
    assert str(caught.value).startswith(f"a.{kind}")


def test_ply_line_numbers_are_those_of_the_file():
    lines = ply_house(None).decode().split("\n")
    row = lines.index("end_header") + 1 + 2 + 3  # two cameras, then the fourth vertex
    lines[row] = "7 0 x 0 9"
    with pytest.raises(InputError, match=f"line {row + 1}: found 'x' instead of a number"):
        read("ply", "\n".join(lines))


def test_unreadable_paths(tmp_path):
    cases = {
        tmp_path / "a.obj": "no such file",
        tmp_path
        / "a.xyz": "format '.xyz' cannot be read; formats that can be read: OBJ, OFF, PLY, STL",
        tmp_path / "a": "without an extension",
    }
    (tmp_path / "folder.ply").mkdir()
    cases[tmp_path / "folder.ply"] = "it is a folder"
    for extension in READABLE:
        empty = tmp_path / f"empty.{extension}"
        empty.write_bytes(b"")
        cases[empty] = "the file is empty"
    (tmp_path / "points.obj").write_text("v 0 0 0\n")
    cases[tmp_path / "points.obj"] = "1 vertices and no faces"
    (tmp_path / "points.ply").write_bytes(ply_bytes(PolyMesh.from_faces([[0, 0, 0]], [])))
    cases[tmp_path / "points.ply"] = "1 vertices and no faces"
    for path, message in cases.items():
        with pytest.raises(InputError, match=message):
            read_mesh(path)
    with pytest.raises(InputError, match="cannot read"):
        read_mesh(tmp_path / "nul\0l.obj")


def test_unwritable(tmp_path):
    mesh = solids.cube()
    with pytest.raises(
        InputError, match="cannot be written; formats that can be written: OBJ, OFF, PLY"
    ):
        write_mesh(tmp_path / "a.stl", mesh)
    with pytest.raises(InputError, match="cannot write"):
        write_mesh(tmp_path / "absent" / "a.obj", mesh)
    with pytest.raises(InputError, match="1 corners name vertices that do not exist"):
        write_mesh(tmp_path / "a.obj", PolyMesh.from_faces([[0, 0, 0]], [[0, 0, 1]]))
    with pytest.raises(InputError, match=r"1 faces have no corners \(first: face 1\)"):
        write_mesh(tmp_path / "a.obj", PolyMesh.from_faces([[0, 0, 0]], [[0], []]))


def triangulated(mesh):
    faces = mesh.indices.reshape(-1, 4)
    return trimesh.Trimesh(
        mesh.vertices, np.concatenate([faces[:, :3], faces[:, [0, 2, 3]]]), process=False
    )


def in_inches(path):
    """Let a 3MF file, which is a zip of XML, state another unit."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    assert any(b'unit="millimeter"' in data for data in files.values())
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in files.items():
            archive.writestr(name, data.replace(b'unit="millimeter"', b'unit="inch"'))


@pytest.mark.parametrize(("extension", "unit_mm"), [("stl", None), ("glb", 1000.0), ("3mf", 25.4)])
def test_triangle_files_are_placed_and_welded(tmp_path, extension, unit_mm):
    ring = triangulated(grids.torus(8, 6, 3.0, 1.0))
    ring.unmerge_vertices()
    scene = trimesh.Scene()
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[:3, 3] = [20, 0, 0]
    scene.add_geometry(ring, geom_name="ring", node_name="a")
    scene.add_geometry(ring, geom_name="ring", node_name="b", transform=mirror)
    path = tmp_path / f"two.{extension}"
    if extension == "stl":
        scene.to_mesh().export(path)
    else:
        scene.export(path)
    if extension == "3mf":
        in_inches(path)
    found = read_mesh(path)
    report = check_mesh(found.mesh)
    assert report.component_genus == (1, 1)
    assert report.oriented
    assert report.problems == ()
    assert report.n_vertices == 2 * 48
    assert found.unit_mm == unit_mm
    assert f"{2 * 96 * 3 - 96} vertices were at the same place as another" in found.notes[0]
    assert found.mesh.vertices[:, 0].max() == pytest.approx(24)
    # Both are outside out: the mirrored one was turned.
    points = found.mesh.vertices[found.mesh.indices.reshape(-1, 3)]
    half = np.linalg.det(points - [[[10.0, 0, 0]]])[points[:, 0, 0] < 10].sum() / 6
    assert half > 0
    assert np.linalg.det(points).sum() / 6 == pytest.approx(2 * half, rel=1e-6)


def test_collapsed_triangles_are_dropped_and_counted(tmp_path):
    path = tmp_path / "a.stl"
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    corners = ["vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n", "vertex 0 0 0\nvertex 1 0 0\n" * 2]
    corners[1] = "vertex 0 0 0\nvertex 1 0 0\nvertex 1 0 0\n"
    path.write_text("solid a\n" + "".join(facet.format(c) for c in corners) + "endsolid a\n")
    found = read_mesh(path)
    assert found.mesh.n_faces == 1
    assert found.notes[1] == "1 face collapsed to a line or a point and was left out"


@given(st.integers(0, 2**32), st.floats(1e-3, 1e3))
def test_weld_rejoins_a_soup_that_was_shaken_a_little(seed, scale):
    rng = np.random.default_rng(seed)
    mesh = grids.torus(5, 4, 3.0, 1.0)
    soup = mesh.vertices[mesh.indices] * scale
    soup += rng.uniform(-1, 1, soup.shape) * 1e-9 * scale
    apart = PolyMesh(soup, mesh.offsets, np.arange(mesh.n_corners))
    welded, joined, dropped = weld_mesh(apart)
    assert (joined, dropped) == (mesh.n_corners - mesh.n_vertices, 0)
    assert check_mesh(welded).component_genus == (1,)
    assert weld_mesh(welded)[1] == 0
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(weld, "WELD_TOLERANCE", 0.0)
        assert check_mesh(weld_mesh(apart)[0]).n_components == mesh.n_faces


def test_weld_leaves_what_was_wrong_before():
    mesh = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0]], [[0, 0, 1], [1], []])
    assert weld_mesh(mesh)[0].faces() == mesh.faces()


SEEDS = {
    "obj": [OBJ_TRAPS["texture and normals"].encode(), OBJ_TRAPS["continuation"].encode()],
    "off": [
        OFF_TRAPS["face colours"].encode(),
        OFF_TRAPS["faces on one line"].encode(),
        binary_off(solids.cube()),
    ],
    "ply": [ply_house(None), ply_house("<"), ply_house(">", extras=False)],
}
PIECES = [
    b"\n",
    b" ",
    b"-1",
    b"9" * 30,
    b"#",
    b"\\\n",
    b"1e400",
    b"nan",
    b"/",
    b"\0",
    b"list",
    b"\xff",
]


@st.composite
def mutated(draw, kind):
    data = draw(st.sampled_from(SEEDS[kind]))
    for _ in range(draw(st.integers(1, 4))):
        at = draw(st.integers(0, len(data)))
        end = draw(st.integers(at, min(len(data), at + 12)))
        piece = draw(st.one_of(st.sampled_from(PIECES), st.binary(max_size=6)))
        data = data[:at] + piece + data[end:]
    return data


def mesh_or_input_error(kind, data):
    message = f"a.{kind}"
    try:
        mesh = read(kind, data)
    except InputError as error:
        message = str(error)
    else:
        assert mesh.offsets[0] == 0
        assert mesh.offsets[-1] == mesh.n_corners
        assert np.all(mesh.face_sizes >= 0)
        assert not mesh.n_corners or 0 <= mesh.indices.min() <= mesh.indices.max() < mesh.n_vertices
    assert message.startswith(f"a.{kind}")


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=200)
@given(data=st.data())
def test_spoiled_file_gives_a_mesh_or_an_input_error(kind, data):
    mesh_or_input_error(kind, data.draw(mutated(kind)))


HEADS = {
    "obj": [b"", b"v 0 0 0\nf "],
    "off": [b"OFF\n", b"OFF BINARY\n", b"OFF\n2 1 0\n"],
    "ply": [
        b"ply\n",
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty int x\nproperty int y\nproperty int z\n"
        b"element face 2\nproperty list int int vertex_indices\nend_header\n",
        b"ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty char x\nproperty char y\n"
        b"property char z\nelement face 2\nproperty list short int a\n"
        b"property list char char vertex_indices\nend_header\n",
    ],
}


@pytest.mark.parametrize("kind", READERS)
@settings(max_examples=100)
@given(data=st.data())
def test_any_bytes_give_a_mesh_or_an_input_error(kind, data):
    text = st.text("0123456789 -+.e\n#/\\vf_", max_size=60).map(str.encode)
    body = data.draw(st.one_of(st.binary(max_size=60), text))
    mesh_or_input_error(kind, data.draw(st.sampled_from(HEADS[kind])) + body)


@pytest.mark.parametrize("extension", ["stl", "glb", "gltf", "3mf"])
def test_spoiled_triangle_file_gives_a_mesh_or_an_input_error(tmp_path, extension):
    rng = np.random.default_rng(5)
    good = tmp_path / f"good.{extension}"
    scene = trimesh.Scene(triangulated(solids.cube()))
    if extension == "gltf":
        files = scene.export(file_type="gltf")
        for name, data in files.items():
            (tmp_path / name).write_bytes(data)
        good = tmp_path / "model.gltf"
    else:
        scene.export(good)
    assert check_mesh(read_mesh(good).mesh).genus == 0
    data = good.read_bytes()
    bad = tmp_path / f"bad.{extension}"
    messages = []
    for trial in range(25):
        spoilt = bytearray(data)
        for at in rng.integers(0, len(data), size=3):
            spoilt[at] = rng.integers(256)
        if trial % 5 == 0:
            spoilt = spoilt[: int(rng.integers(1, len(data)))]
        if trial == 1:
            spoilt = bytearray(rng.bytes(200))
        bad.write_bytes(spoilt)
        try:
            assert read_mesh(bad).mesh.n_faces > 0
        except InputError as error:
            messages.append(str(error))
    assert messages
    assert all(message.startswith(bad.name) for message in messages)


@pytest.mark.parametrize("extension", ["glb", "gltf"])
@pytest.mark.parametrize(("up", "tall"), [(None, 2), ("y", 2), ("z", 1), ("x", 0)])
def test_gltf_has_y_up_unless_said_otherwise(extension, up, tall, tmp_path):
    # Tall along y, as the standard of glTF has it.
    box = trimesh.creation.box((1.0, 7.0, 2.0))
    path = tmp_path / f"box.{extension}"
    path.write_bytes(
        box.export(file_type="glb")
        if extension == "glb"
        else json.dumps(gltf_in_one_file(box)).encode()
    )
    assert read_mesh(path).up == "y"
    loaded = load_mesh(Settings(str(path), up=up, size_mm=70.0))
    size = np.ptp(loaded.mesh.vertices, axis=0)
    # With x up, y becomes x.
    assert size[tall] == pytest.approx(70.0)
    assert any("y axis points up" in note for note in loaded.notes) == (up is None)


def gltf_in_one_file(box):
    files = trimesh.exchange.gltf.export_gltf(box.scene(), embed_buffers=True)
    return json.loads(files["model.gltf"])


def test_our_own_models_are_read_as_they_were_written(tmp_path):
    torus = ("shape:torus?m=8&n=4", "--size", "200mm")
    for extra in ((), ("--yarn",)):
        assert run("model", *torus, *extra, "-o", tmp_path / "own.glb") == 0
        found = read_mesh(tmp_path / "own.glb")
        assert found.up == "z"
        loaded = load_mesh(Settings(str(tmp_path / "own.glb")))
        assert np.argmin(np.ptp(loaded.mesh.vertices, axis=0)) == 2  # it lies flat, as the torus
        assert not any("points up" in note for note in loaded.notes)
