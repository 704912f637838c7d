"""GLB, glTF, 3MF and STL: what each means is read, and what cannot be is refused by its name."""

import base64
import json
from pathlib import Path

import numpy as np
import pytest
from mesh_writers import (
    add_accessor,
    binary_stl,
    glb_bytes,
    gltf_of,
    model_xml,
    object_xml,
    packed_3mf,
)
from meshes_shared import shared_mesh

from fabweave.core.errors import InputError
from fabweave.mesh.bodies import bodies_of
from fabweave.mesh.io.files import read_file, read_mesh
from fabweave.mesh.io.gltf import read_gltf
from fabweave.mesh.io.stl import read_stl
from fabweave.mesh.io.threemf import read_3mf
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import triangulate

#: A body without any symmetry, so that a mirror or a turn shows.
_CORNERS = np.array([[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]], dtype=float)
BODY = PolyMesh.from_faces(_CORNERS, [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def moved(matrix, shift=(0, 0, 0)):
    """Return the corners of the faces of the body where a matrix and a shift put it."""
    faces = np.array(BODY.faces())
    if np.linalg.det(matrix) < 0:
        faces = faces[:, ::-1]
    return (_CORNERS @ np.transpose(matrix) + shift)[faces]


def triangles_of(mesh):
    """Return the corners of the triangles of a mesh, in an order that only they tell."""
    corners = np.asarray(mesh if isinstance(mesh, np.ndarray) else mesh.vertices[mesh.indices])
    rows = []
    for triangle in corners.reshape(-1, 3, 3).round(5).tolist():
        first = triangle.index(min(triangle))
        rows.append(triangle[first:] + triangle[:first])
    return np.array(sorted(rows))


def require_same(mesh, *bodies):
    expected = triangles_of(np.concatenate(bodies))
    found = triangles_of(mesh)
    assert found.shape == expected.shape
    assert np.abs(found - expected).max() < 1e-4


def read_document(document):
    return read_gltf(json.dumps(document).encode(), Path("a.gltf"))


# ---------------------------------------------------------------- files of strangers

CUBE = (100.0, 100.0, 100.0)
TWO = (200.0, 100.0, 100.0)
#: The file, its format, its box in millimetres, its faces, its bodies, and how many notes.
RIGHT = (
    ("glb_sparse.glb", "glb", CUBE, 12, 1, 0),
    ("glb_norm_short.glb", "glb", CUBE, 12, 1, 0),
    ("glb_fans.glb", "glb", (200.0, 200.0, 200.0), 8, 1, 0),
    ("glb_gpu_inst.glb", "glb", (250.0, 100.0, 100.0), 24, 2, 0),
    ("glb_skinned.glb", "glb", CUBE, 12, 1, 0),
    ("gltf_space.gltf", "gltf", CUBE, 12, 1, 0),
    ("gp_vpn.glb", "glb", (2000.0, 989.6, 600.0), 1974, 2, 0),
    ("gt_inst.glb", "glb", (2000.0, 989.6, 600.0), 1974, 2, 0),
    ("gt_quant.glb", "glb", (2000.0, 989.6, 600.0), 1974, 2, 0),
    ("3mf_production2.3mf", "3mf", TWO, 24, 2, 0),
    ("3mf_path_twice.3mf", "3mf", (250.0, 100.0, 100.0), 24, 2, 0),
    ("3mf_item_path.3mf", "3mf", CUBE, 12, 1, 0),
    ("3mf_othername.3mf", "3mf", CUBE, 12, 1, 0),
    ("stl_bin_extra.stl", "stl", CUBE, 12, 1, 1),
    ("stl_bin_zero_count.stl", "stl", CUBE, 12, 1, 1),
    ("stl_no_endsolid.stl", "stl", CUBE, 12, 1, 1),
    ("stl_quad_loop.stl", "stl", CUBE, 6, 1, 0),
    ("stl_as_obj.obj", "stl", CUBE, 12, 1, 1),
    ("obj_as_stl.stl", "obj", CUBE, 6, 1, 1),
    ("zip_as_stl.stl", "3mf", CUBE, 12, 1, 1),
    ("obj_utf16.obj", "obj", CUBE, 6, 1, 0),
    ("obj_backslash_name.obj", "obj", CUBE, 6, 1, 0),
    ("obj_cont_trailing_space.obj", "obj", CUBE, 6, 1, 0),
    ("obj_nan_ind_colour.obj", "obj", CUBE, 6, 1, 0),
    ("ply_indices_other.ply", "ply", CUBE, 6, 1, 0),
    ("ply_onerow.ply", "ply", CUBE, 6, 1, 0),
    ("ply_tristrips.ply", "ply", CUBE, 12, 1, 0),
)


@pytest.mark.parametrize(("name", "kind", "box", "faces", "bodies", "notes"), RIGHT)
def test_what_strangers_write_is_read(name, kind, box, faces, bodies, notes):
    path = shared_mesh(f"strangers/{name}")
    found = read_mesh(path)
    assert found.format == kind
    assert np.ptp(found.mesh.vertices, axis=0) * (found.unit_mm or 1.0) == pytest.approx(
        box, rel=1e-4
    )
    assert found.mesh.n_faces == faces
    part, _ = bodies_of(found.mesh)
    assert part.max() + 1 == bodies
    if box == CUBE:  # closed, and all faces the same way around
        assert abs(signed_volume(found.mesh)) * (found.unit_mm or 1.0) ** 3 == pytest.approx(
            1e6, rel=1e-4
        )
    assert len(read_file(path).notes) == notes


def signed_volume(mesh):
    triangles = triangulate(mesh)
    corners = triangles.vertices[triangles.indices.reshape(-1, 3)]
    return np.linalg.det(corners).sum() / 6


@pytest.mark.parametrize(
    ("name", "figure"),
    [
        ("glb_draco.glb", "Draco"),
        ("glb_draco_mixed.glb", "KHR_draco_mesh_compression"),
        ("glb_meshopt.glb", "EXT_meshopt_compression"),
        ("gt_draco.glb", "Draco"),
        ("gt_meshopt.glb", "meshopt"),
        ("gp_cc.glb", "meshopt"),
        ("stl_bin_short.stl", "11 of 12"),
    ],
)
def test_what_strangers_write_is_refused_by_name(name, figure):
    with pytest.raises(InputError, match=rf"^{name}.*{figure}"):
        read_mesh(shared_mesh(f"strangers/{name}"))


# ---------------------------------------------------------------- glTF

QUARTER = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])  # about z
_HALF = float(np.sqrt(0.5))


def primitive_of(document):
    return document["meshes"][0]["primitives"][0]


def interleaved(document):
    rows = np.concatenate([_CORNERS, _CORNERS + 9], axis=1).astype("f")
    uri = f"data:;base64,{base64.b64encode(b'1234' + rows.tobytes()).decode()}"
    document["buffers"][0] = {"byteLength": 100, "uri": uri}
    document["bufferViews"][0] |= {"byteOffset": 4, "byteStride": 24, "byteLength": 96}


def as_integers(kind):
    def change(document):
        most = np.iinfo(kind).max
        rows = np.round(_CORNERS / 3 * most).astype(kind)
        primitive_of(document)["attributes"]["POSITION"] = add_accessor(
            document, rows, normalized=True
        )
        document["nodes"][0]["scale"] = [3, 3, 3]
        document["extensionsRequired"] = ["KHR_mesh_quantization", "KHR_texture_transform"]

    return change


def without_indices(document):
    primitive_of(document).pop("indices")
    rows = _CORNERS[BODY.indices].astype("f")
    primitive_of(document)["attributes"]["POSITION"] = add_accessor(document, rows)


def sparse(document):
    rows = _CORNERS.astype("f")
    rows[2] = 99
    accessor = add_accessor(document, rows)
    at = add_accessor(document, np.array([2], "B"))
    values = add_accessor(document, _CORNERS[2:3].astype("f"))
    document["accessors"][accessor]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": at, "componentType": 5121},
        "values": {"bufferView": values},
    }
    primitive_of(document)["attributes"]["POSITION"] = accessor


def morphed(document):
    steps = np.zeros((4, 3), "f")
    steps[1, 0] = 4
    primitive_of(document)["targets"] = [{"POSITION": add_accessor(document, steps)}]
    document["meshes"][0]["weights"] = [0.5]
    document["nodes"][0]["weights"] = [0]


def with_fallback(document):
    primitive_of(document)["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    document["extensionsUsed"] = ["KHR_draco_mesh_compression"]


def without_scene(document):
    document.pop("scenes")
    document.pop("scene")


def without_nodes(document):
    without_scene(document)
    document.pop("nodes")


SAME = {
    "interleaved": interleaved,
    "bytes": as_integers("B"),
    "signed bytes": as_integers("b"),
    "shorts": as_integers("H"),
    "signed shorts": as_integers("h"),
    "no indices": without_indices,
    "sparse": sparse,
    "morph targets at rest": morphed,
    "another compression, not required": with_fallback,
    "no scene": without_scene,
    "no nodes": without_nodes,
}


@pytest.mark.parametrize("change", SAME.values(), ids=SAME)
def test_gltf_says_one_body_in_many_ways(change):
    document = gltf_of(BODY)
    change(document)
    tolerance = 3 / 127 if change is SAME["signed bytes"] else 3 / 255
    found = read_document(document).mesh
    assert np.abs(triangles_of(found) - triangles_of(moved(np.eye(3)))).max() < tolerance
    if "integers" not in change.__qualname__:
        require_same(found, moved(np.eye(3)))


def test_gltf_nodes_place_a_mesh_as_often_as_they_say():
    document = gltf_of(BODY)
    document["nodes"] = [
        {"children": [1, 2], "translation": [10, 0, 0], "rotation": [0, 0, _HALF, _HALF]},
        {"mesh": 0, "name": "stretched", "scale": [2, 1, 1], "translation": [0, 5, 0]},
        {"mesh": 0, "name": "mirrored",
         "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1]},
        {"mesh": 0, "name": "elsewhere"},
    ]  # fmt: skip
    document["scenes"] = [{"nodes": [3]}, {"nodes": [0]}]
    document["scene"] = 1
    found = read_document(document)
    require_same(
        found.mesh,
        moved(QUARTER @ np.diag([2, 1, 1]), QUARTER @ [0, 5, 0] + [10, 0, 0]),
        moved(QUARTER @ np.diag([-1, 1, 1]), QUARTER @ [1, 2, 3] + [10, 0, 0]),
    )
    assert found.objects == (("stretched", 4), ("mirrored", 4))
    assert len(found.notes) == 1  # of the scene that was left out
    assert (found.unit, found.up) == ("m", "y")


def test_gltf_instances_are_placed_in_their_node():
    document = gltf_of(BODY)
    attributes = {
        "TRANSLATION": add_accessor(document, np.array([[0, 0, 0], [5, 0, 0]], "f")),
        "ROTATION": add_accessor(document, np.array([[0, 0, 0, 1], [0, 0, _HALF, _HALF]], "f")),
        "SCALE": add_accessor(document, np.array([[1, 1, 1], [1, 1, -1]], "f")),
    }
    document["nodes"][0] |= {
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}},
        "translation": [0, 0, 7],
    }
    document["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    require_same(
        read_document(document).mesh,
        moved(np.eye(3), [0, 0, 7]),
        moved(QUARTER @ np.diag([1, 1, -1]), [5, 0, 7]),
    )


def test_gltf_skins_stand_where_their_joints_are():
    document = gltf_of(BODY)
    joint = np.eye(4)
    joint[:3, :3], joint[:3, 3] = QUARTER, [1, 2, 3]
    inverse = np.diag([2.0, 2, 2, 1])
    skin = {
        "joints": [1],
        "inverseBindMatrices": add_accessor(document, inverse.T[None].astype("f")),
    }
    document["skins"] = [skin]
    document["nodes"] = [
        {"mesh": 0, "skin": 0, "scale": [7, 7, 7]},
        {"matrix": joint.T.reshape(-1).tolist()},
    ]
    document["scenes"][0]["nodes"] = [0, 1]
    weights = np.zeros((4, 4), "f")
    weights[:, 1] = 0.5  # only what they are to one another matters
    primitive_of(document)["attributes"] |= {
        "JOINTS_0": add_accessor(document, np.zeros((4, 4), "B")),
        "WEIGHTS_0": add_accessor(document, weights),
    }
    require_same(read_document(document).mesh, moved(2 * QUARTER, [1, 2, 3]))


def test_glb_is_cut_short_or_whole(tmp_path):
    document = gltf_of(BODY)
    document["buffers"][0].pop("uri")
    data = glb_bytes(document, _CORNERS.astype("f").tobytes())
    (tmp_path / "a.glb").write_bytes(data + b"more")
    require_same(read_mesh(tmp_path / "a.glb").mesh, moved(np.eye(3)))
    for length in range(4, len(data), 7):
        with pytest.raises(InputError, match=r"^a\.glb"):
            read_gltf(data[:length], Path("a.glb"))


def refused(**changes):
    """Return what a glTF document cannot be, and what must be said of it."""
    return gltf_of(BODY) | changes


REFUSED = {
    "Draco": refused(extensionsRequired=["KHR_draco_mesh_compression"]),
    "VENDOR_splines": refused(extensionsRequired=["VENDOR_splines"]),
    "CESIUM_RTC": refused(extensionsRequired=["KHR_materials_unlit", "CESIUM_RTC"]),
    "1.0": refused(asset={"version": "1.0"}, nodes={"a": {}}),
    "two parents": refused(nodes=[{"children": [1, 1]}, {"mesh": 0}]),
    "own parents": refused(nodes=[{"children": [1]}, {"children": [0], "mesh": 0}]),
    "node 3": refused(scenes=[{"nodes": [3]}]),
    "mesh 9": refused(nodes=[{"mesh": 9}]),
    "not beside it": refused(buffers=[{"uri": "../a.bin", "byteLength": 48}] * 2),
    "http": refused(buffers=[{"uri": "http://a/b.bin", "byteLength": 48}] * 2),
    "absent.bin": refused(buffers=[{"uri": "absent.bin", "byteLength": 48}] * 2),
    "base64": refused(buffers=[{"uri": "data:;base64,AAA", "byteLength": 48}] * 2),
    "vertex 3": refused(
        accessors=[
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            gltf_of(BODY)["accessors"][1],
        ]
    ),
    "without data": refused(
        accessors=[
            {"componentType": 5126, "count": 10**9, "type": "VEC3"},
            gltf_of(BODY)["accessors"][1],
        ]
    ),
    "is cut short": refused(
        accessors=[
            {"bufferView": 0, "componentType": 5126, "count": 10**6, "type": "VEC3"},
            gltf_of(BODY)["accessors"][1],
        ]
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_gltf_that_cannot_be_read_names_what_is_wrong(what):
    with pytest.raises(InputError, match=rf"^a\.gltf.*{what}"):
        read_document(REFUSED[what])


# ---------------------------------------------------------------- 3MF

OBJECT = object_xml(1, BODY, 'name="body"')


def read_model(model, others=None):
    return read_3mf(packed_3mf(model, others), "a.3mf")


def test_3mf_components_are_placed_in_one_another():
    group = (
        '<object id="2"><components>'
        '<component objectid="1" transform="2 0 0 0 1 0 0 0 1 5 0 0"/>'
        '<component objectid="1" transform="-1 0 0 0 1 0 0 0 1 0 0 0"/>'
        "</components></object>"
    )
    turned = '<item objectid="2" transform="0 1 0 -1 0 0 0 0 1 0 0 9"/>'
    found = read_model(model_xml(OBJECT + group, turned, 'unit="inch"'))
    require_same(
        found.mesh,
        moved(QUARTER @ np.diag([2, 1, 1]), QUARTER @ [5, 0, 0] + [0, 0, 9]),
        moved(QUARTER @ np.diag([-1, 1, 1]), [0, 0, 9]),
    )
    assert (found.unit, found.objects) == ("in", (("body", 4), ("body", 4)))


ITEM = '<item objectid="1"/>'
RING = "".join(
    f'<object id="{n}"><components><component objectid="{3 - n}"/></components></object>'
    for n in (1, 2)
)
#: Each object holds the one before it twice: more placed than there are atoms in the world.
DOUBLING = '<object id="0"><components></components></object>' + "".join(
    f'<object id="{n}"><components>{f"""<component objectid="{n - 1}"/>""" * 2}</components>'
    "</object>"
    for n in range(1, 300)
)
LATTICE = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
SLICES = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"
LAUGHS = (
    '<!DOCTYPE a [<!ENTITY b "ha"><!ENTITY c "&b;&b;&b;">]>' + model_xml(OBJECT, ITEM)
).replace("<resources>", "<resources>&c;")
REFUSED_3MF = {
    "beamlattice": model_xml(OBJECT, ITEM, f'xmlns:b="{LATTICE}" requiredextensions="b"'),
    "slice": model_xml(
        object_xml(1, BODY, 's:meshresolution="lowres"'), ITEM, f'xmlns:s="{SLICES}"'
    ),
    "entities": LAUGHS,
    "component of itself": model_xml(RING, ITEM),
    "100,000 times": model_xml(DOUBLING, '<item objectid="299"/>'),
    "furlong": model_xml(OBJECT, ITEM, 'unit="furlong"'),
    "object '7'": model_xml(OBJECT, '<item objectid="7"/>'),
    "vertex 9": model_xml(OBJECT.replace('v1="0"', 'v1="9"'), ITEM),
    "vertex -1": model_xml(OBJECT.replace('v1="0"', 'v1="-1"'), ITEM),
    "x.model": model_xml(OBJECT, '<item objectid="1" p:path="/x.model"/>'),
    "damaged": model_xml(OBJECT, ITEM)[:-9],
    "11 numbers": model_xml(OBJECT, f'<item objectid="1" transform="{"1 " * 11}"/>'),
    "line 1": model_xml(OBJECT.replace('v1="0"', 'v1="o"'), ITEM),
}


@pytest.mark.parametrize("what", REFUSED_3MF)
def test_3mf_that_cannot_be_read_names_what_is_wrong(what):
    with pytest.raises(InputError, match=rf"^a\.3mf.*{what}"):
        read_model(REFUSED_3MF[what])


# ---------------------------------------------------------------- STL, and what is something else


def test_stl_is_binary_by_its_size_whatever_its_head_says():
    data = binary_stl(BODY)
    assert data.startswith(b"solid")
    require_same(read_stl(data, "a.stl").mesh, moved(np.eye(3)))
    unknown = data[:80] + b"\xff" * 4 + data[84:]
    for more, notes in ((b"", 1), (b"12345", 2)):
        found = read_stl(unknown + more, "a.stl")
        require_same(found.mesh, moved(np.eye(3)))
        assert len(found.notes) == notes
    for length in range(84, len(data)):
        with pytest.raises(InputError, match="is cut short"):
            read_stl(data[:length], "a.stl")


@pytest.mark.parametrize(
    ("data", "what"),
    [
        (b"<!DOCTYPE html><html>", "web page"),
        (b"\n <html lang=en>", "web page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:1\nsize 9\n", "Git LFS"),
        (b"<?xml version='1.0'?><COLLADA>", "XML"),
        (b"Kaydara FBX Binary  \0", "FBX"),
        (b"\x1f\x8b\x08\0", "packed"),
        (b"PK\3\4", "ZIP"),
    ],
)
@pytest.mark.parametrize("name", ["a.obj", "a.stl", "a.glb"])
def test_what_is_no_mesh_is_called_by_its_name(data, what, name, tmp_path):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=f"^{name} is an? .*{what}"):
        read_mesh(tmp_path / name)


def test_what_a_file_holds_tells_its_format(tmp_path):
    texts = {
        "stl": binary_stl(BODY),
        "glb": glb_bytes(gltf_of(BODY)),
        "gltf": json.dumps(gltf_of(BODY)).encode(),
        "3mf": packed_3mf(model_xml(OBJECT, ITEM)),
        "obj": b"# a\nv 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n",
        "off": b"OFF\n4 4 0\n0 0 0\n3 0 0\n0 2 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n",
    }
    for kind, data in texts.items():
        for name in texts.keys() | {"txt"}:
            path = tmp_path / f"a.{name}"
            path.write_bytes(data)
            found = read_mesh(path)
            assert found.format == kind
            assert len(read_file(path).notes) == (kind != name)
            require_same(found.mesh, moved(np.eye(3)))
