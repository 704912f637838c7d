"""Reading and writing: the traps of each format, exact round trips, and broken files."""

import json
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from jobs import run
from mesh_writers import (
    binary_ply,
    off_bytes,
    packed_3mf,
    ply_bytes,
)
from strategies import any_meshes

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.mesh import weld
from fabweave.mesh.check import check_mesh
from fabweave.mesh.io.files import read_mesh
from fabweave.mesh.io.gltf import read_gltf
from fabweave.mesh.io.ply import read_ply
from fabweave.mesh.io.stl import read_stl
from fabweave.mesh.io.text import obj_bytes, read_obj, read_off
from fabweave.mesh.io.threemf import read_3mf
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes import grids, solids
from fabweave.mesh.weld import weld_mesh
from fabweave.options.settings import Settings

READERS = {
    "obj": read_obj,
    "off": read_off,
    "ply": read_ply,
    "stl": read_stl,
    "gltf": lambda data, name: read_gltf(data, Path(name)),
    "3mf": lambda model, name: read_3mf(packed_3mf(model), name),
}
HOUSE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]]
HOUSE_FACES = [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
V = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\n"
F = "f 1 4 3 2\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"


def read(kind, text):
    data = text.encode("latin-1") if isinstance(text, str) else text
    return READERS[kind](data, f"a.{kind}").mesh


def same(mesh, other):
    return (
        np.array_equal(mesh.vertices, other.vertices, equal_nan=True)
        and np.array_equal(np.signbit(mesh.vertices), np.signbit(other.vertices))
        and np.array_equal(mesh.offsets, other.offsets)
        and np.array_equal(mesh.indices, other.indices)
    )


OBJ_TRAPS = {
    "negative, mixed with positive": V + "f 1 -2 3 -4\nf 1 2 -1\nf -4 3 5\nf 3 4 5\nf 4 1 5\n",
    "texture and normals": V
    + "vt 0 0\nvt 1 0\nvn 0 0 1\nf 1/1/1 4/2/1 3/1/1 2/2/1\nf 1/1 2/2 5/1\nf 2//1 3//1 5//1\n"
    "f 3/-1/-1 4/1/1 5/2/1\nf 4/ 1// 5\n",
    "continuation": V
    + "f 1 \\\n4 3 \\\n 2\nf 1 2\\\n 5\nf 2 3 5\\\n\nf 3 4 5\nf 4 1 5\n# path C:\\\n",
    "comment with a backslash before a face": V + "# C:\\tmp\\\n" + F.rstrip(),
    "CRLF": (V + F).replace("\n", "\r\n"),
    "CR only": (V + F).replace("\n", "\r"),
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


OFF_V = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 1\n"
OFF_F = "4 0 3 2 1\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n"
OFF_TRAPS = {
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
    "STCNOFF": "STCNOFF 5 5 0\n" + OFF_V.replace("\n", " 0 0 1 1 0 0 1 0 0\n") + OFF_F,
    "face colours": "OFF\n5 5 0\n"
    + OFF_V
    + "4 0 3 2 1 255 0 0\n3 0 1 4 0.1 0.2 0.3 1.0\n3 1 2 4 7\n3 2 3 4\n3 3 0 4 0.5 0.5 0.5\n",
    "faces on one line": ("OFF\n5 5 0\n" + OFF_V + OFF_F.replace("\n", " ")),
    "normals on one line": "NOFF 5 5 0\n" + OFF_V.replace("\n", " 0 0 1 ") + "\n" + OFF_F,
}


@pytest.mark.parametrize("text", OFF_TRAPS.values(), ids=OFF_TRAPS)
def test_off_traps(text):
    mesh = read("off", text)
    assert mesh.vertices.tolist() == HOUSE
    assert mesh.faces() == HOUSE_FACES


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
@pytest.mark.parametrize("extras", [False, True])
@pytest.mark.parametrize("other", [False, True])
@pytest.mark.parametrize("position", ["float", "double"])
@pytest.mark.parametrize("kinds", [*zip(PLY_CODES, reversed(PLY_CODES), strict=True)])
def test_ply_of_every_list_type_with_and_without_other_things(
    order, extras, other, position, kinds
):
    count, index = kinds
    data = ply_house(order, extras=extras, other=other, position=position, count=count, index=index)
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
    # Text has no sign for "not a number".
    unsigned = np.where(np.isnan(mesh.vertices), np.nan, mesh.vertices)
    assert same(read(kind, data), mesh.with_vertices(unsigned))


@pytest.mark.parametrize("big", [False, True])
@given(mesh=any_meshes())
def test_binary_ply_gives_back_every_bit(big, mesh):
    again = read("ply", binary_ply(mesh, big_endian=big))
    assert again.vertices.tobytes() == mesh.vertices.tobytes()
    assert again.faces() == mesh.faces()


HEAD = "ply\nformat ascii 1.0\n"
XYZ = "element vertex 1\nproperty int x\nproperty int y\nproperty int z\n"
TRIANGLE = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n"
TEXT_CUBE = ply_bytes(solids.cube())
#: What is wrong: the kind, the file, and the place that the message names.
BROKEN = (
    ("obj", V + "f 1 2 three\n", "line 6"),
    ("obj", V + "f 1 2 3.5\n", "line 6"),
    ("obj", "v 1-2 3 0\nv 0 0 zero\n", "line 1"),
    ("obj", V + "\n\nv 0 zero 0\n", "line 8"),
    ("obj", V + "f 1 2 3\nf 1 2 6\n", "line 7"),
    ("obj", V + "f 0 1 2\n", "line 6"),
    ("obj", V + "f -1 -2 -6\n", "line 6"),
    ("obj", V + "f 1 2 99999999999999999999\n", "line 6"),
    ("obj", V + "f /\n", "line 6"),
    ("obj", V + "f 1 \\\n2 \\\n 3\nf 1 2 x\n", "line 9"),
    ("off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 x 0\n3 0 1 2\n", "line 5"),
    ("off", TRIANGLE + "3 0 1 3\n", "line 6"),
    ("off", TRIANGLE + "4 0 1 2\n", "line 6"),
    ("off", TRIANGLE + "9223372036854775807 0 1 2\n", "line 6"),
    ("off", TRIANGLE + "3 0 1.5 2\n", "line 6"),
    ("off", TRIANGLE.replace("3 1", "3 2") + "3 0 1 2\n", "end of the file"),
    ("off", "OFF\n999999999999 2 0\n0 0 0\n", "end of the file"),
    ("off", "OFF\n-3 2 0\n0 0 0\n", "line 2"),
    ("off", "OFF\n", "line 1"),
    ("off", "4OFF\n3 1 0\n", "line 1"),
    ("off", "nOFF\n3\n3 1 0\n", "line 1"),
    ("off", "\n# only\n", "blank"),
    ("off", b"OFF BINARY\n\0\0\0\1", "binary OFF"),
    ("ply", "plx\n", "line 1"),
    ("ply", HEAD, "end_header"),
    ("ply", "ply\nelement vertex 0\nend_header\n", "format"),
    ("ply", "ply\nformat binary 1.0\nend_header\n", "line 2"),
    ("ply", HEAD + "element vertex -1\nend_header\n", "line 3"),
    ("ply", HEAD + "element vertex 1\nproperty quad x\nend_header\n", "line 4"),
    ("ply", HEAD + "property int x\nend_header\n", "line 3"),
    ("ply", HEAD + XYZ[:-15] + "end_header\n0 0\n", "x, y"),
    ("ply", HEAD + XYZ + "end_header\n0 x 0\n", "line 8"),
    ("ply", ply_house("<")[:-40], "row 3 of 5 of element 'face'"),
    ("ply", ply_house(None)[:-60], "of element 'face'"),
    ("ply", binary_ply(solids.cube()).replace(b"face 6", b"face 999999999999999"), "'face'"),
    ("ply", TEXT_CUBE.replace(b"\n4 0 2 3 1", b"\n4 0 2 3 8"), "face 0"),
    ("ply", TEXT_CUBE.replace(b"\n4 0 2 3 1", b"\n5 0 2 3 1"), "line 18"),
)


@pytest.mark.parametrize(("kind", "data", "place"), BROKEN)
def test_broken_file_is_named_with_its_place(kind, data, place):
    with pytest.raises(InputError, match=place) as caught:
        read(kind, data)
    assert str(caught.value).startswith(f"a.{kind}")


@pytest.mark.parametrize(
    "mesh",
    [
        PolyMesh.from_faces([[0, 0, 0]], [[0, 0, 1]]),
        PolyMesh.from_faces([[0, 0, 0]], [[0], []]),
    ],
)
def test_unwritable(mesh):
    with pytest.raises(InputError):
        obj_bytes(mesh)


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
    assert report.findings == ()
    assert report.n_vertices == 2 * 48
    assert found.unit_mm == unit_mm
    assert str(2 * 96 * 3 - 96) in found.notes[0]
    assert found.mesh.vertices[:, 0].max() == pytest.approx(24)
    # Both are outside out: the mirrored one was turned.
    points = found.mesh.vertices[found.mesh.indices.reshape(-1, 3)]
    half = np.linalg.det(points - [[[10.0, 0, 0]]])[points[:, 0, 0] < 10].sum() / 6
    assert half > 0
    assert np.linalg.det(points).sum() / 6 == pytest.approx(2 * half, rel=1e-6)


def test_collapsed_triangles_are_dropped_and_counted(tmp_path):
    path = tmp_path / "a.stl"
    facet = "facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n"
    corners = [f"vertex 0 0 0\nvertex 1 0 0\nvertex {last}\n" for last in ("0 1 0", "1 0 0")]
    path.write_text("solid a\n" + "".join(facet.format(c) for c in corners) + "endsolid a\n")
    found = read_mesh(path)
    assert found.mesh.n_faces == 1
    assert len(found.notes) == 2


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
    loaded = Stations(Settings.of(str(path), up=up, size_mm=70.0)).loaded
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
        loaded = Stations(Settings.of(str(tmp_path / "own.glb"))).loaded
        assert np.argmin(np.ptp(loaded.mesh.vertices, axis=0)) == 2  # it lies flat, as the torus
        assert not any("points up" in note for note in loaded.notes)
