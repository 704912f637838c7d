"""Model files, read back by others: names, counts, units, colours and closed surfaces."""

import io
import struct
import zipfile
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import trimesh
from jobs import laid

from fabweave.picture.bodies import ribbon_bodies, yarn_bodies
from fabweave.picture.model_files import model_bytes
from fabweave.picture.yarns import spin_yarns
from fabweave.weave.strand_colours import thread_colours

FORMATS = (".glb", ".obj", ".ply", ".stl", ".3mf")
THICKNESS = 0.8


def woven(shape: str, boundary: str = "end"):
    return laid(f"shape:{shape}", size_mm=200.0, boundary=boundary)[0]


def bodies_of(kind: str):
    woven_object = woven("hypar?m=4&n=3" if kind == "open" else "torus?m=8&n=6")
    colours = thread_colours(woven_object.bunches)
    if kind == "sheets":
        return ribbon_bodies(woven_object.ribbons, woven_object.labels, colours)
    if kind in ("solids", "open"):
        return ribbon_bodies(
            woven_object.ribbons, woven_object.labels, colours, thickness_mm=THICKNESS
        )
    yarns = spin_yarns(
        woven_object.mesh, woven_object.halfedges, woven_object.weave, woven_object.labels, sides=6
    )
    return yarn_bodies(yarns, woven_object.labels, colours)


@pytest.fixture(scope="module", params=["sheets", "solids", "open", "yarns"])
def model(request):
    bodies = bodies_of(request.param)
    points = np.concatenate([body.vertices for body in bodies])
    return SimpleNamespace(
        kind=request.param,
        bodies=bodies,
        bounds=np.array([points.min(axis=0), points.max(axis=0)]),
        n_triangles=sum(len(body.all_triangles) for body in bodies),
    )


def loaded(model, suffix):
    data = model_bytes(suffix, model.bodies)
    return trimesh.load_scene(io.BytesIO(data), file_type=suffix[1:])


@pytest.mark.parametrize("suffix", FORMATS)
def test_others_find_the_same_triangles_in_the_same_place(model, suffix):
    scene = loaded(model, suffix)
    millimetres = 1000.0 if suffix == ".glb" else 1.0
    assert np.allclose(scene.bounds * millimetres, model.bounds, atol=1e-4)
    assert sum(len(mesh.faces) for mesh in scene.geometry.values()) == model.n_triangles


def test_glb_has_the_colours_in_linear_light_and_normals_where_round(model):
    data = model_bytes(".glb", model.bodies)
    length = struct.unpack_from("<I", data, 12)[0]
    import json  # noqa: PLC0415 - only here

    tree = json.loads(data[20 : 20 + length])
    colours = {
        mesh["name"]: tree["materials"][mesh["primitives"][0]["material"]]["pbrMetallicRoughness"]
        for mesh in tree["meshes"]
    }
    for body in model.bodies:
        share = body.colours[0] / 255
        linear = np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4)
        assert np.allclose(colours[body.label]["baseColorFactor"][:3], linear, atol=0.003)
    has = ["NORMAL" in mesh["primitives"][0]["attributes"] for mesh in tree["meshes"]]
    assert has == [model.kind == "yarns"] * len(model.bodies)


def test_stl_solids_are_watertight_once_welded(model):
    mesh = trimesh.load(io.BytesIO(model_bytes(".stl", model.bodies)), file_type="stl")
    assert mesh.is_watertight == (model.kind != "sheets")
    if model.kind == "sheets":
        return
    assert mesh.is_winding_consistent
    assert mesh.body_count == len(model.bodies)
    assert mesh.volume > 0
    data = model_bytes(".stl", model.bodies)
    # A header that begins with "solid" would pass for a text file.
    assert not data.startswith(b"solid")
    assert len(data) == 84 + 50 * model.n_triangles
    assert struct.unpack_from("<I", data, 80)[0] == model.n_triangles


def test_3mf_states_millimetres_names_and_colours(model):
    with zipfile.ZipFile(io.BytesIO(model_bytes(".3mf", model.bodies))) as archive:
        assert archive.testzip() is None
        root = ET.fromstring(archive.read("3D/3dmodel.model"))  # noqa: S314 - written above
        types = ET.fromstring(archive.read("[Content_Types].xml"))  # noqa: S314 - the same
        target = ET.fromstring(archive.read("_rels/.rels"))[0].get("Target")  # noqa: S314
    space = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    assert root.get("unit") == "millimeter"
    assert target == "/3D/3dmodel.model"
    assert {item.get("Extension") for item in types} == {"rels", "model"}
    bases = root.findall(f".//{space}base")
    objects = root.findall(f".//{space}object")
    assert [base.get("name") for base in bases] == [body.label for body in model.bodies]
    for number, (body, found) in enumerate(zip(model.bodies, objects, strict=True)):
        assert found.get("name") == body.label
        assert (found.get("pid"), found.get("pindex")) == ("1", str(number))
        assert bytes.fromhex(bases[number].get("displaycolor")[1:]) == bytes(body.colours[0])
    items = [item.get("objectid") for item in root.findall(f".//{space}item")]
    assert items == [found.get("id") for found in objects]


def test_obj_keeps_quads_and_names_its_groups(model):
    lines = model_bytes(".obj", model.bodies).decode("ascii").splitlines()
    assert "millimetres" in lines[0]
    for kind in ("g ", "o "):
        names = [line[2:] for line in lines if line.startswith(kind)]
        assert names == [body.label for body in model.bodies]
    faces = [list(map(int, line.split()[1:])) for line in lines if line.startswith("f ")]
    assert sum(len(face) == 4 for face in faces) == sum(len(body.quads) for body in model.bodies)
    assert sum(len(face) == 3 for face in faces) == sum(
        len(body.triangles) for body in model.bodies
    )
    points = [line.split()[1:] for line in lines if line.startswith("v ")]
    assert max(map(max, faces)) == len(points)
    assert min(map(min, faces)) == 1
    assert np.allclose(
        np.array(points, dtype=float)[:, :3],
        np.concatenate([body.vertices for body in model.bodies]),
        atol=1e-6,
    )
    first = np.round(np.array(points[0][3:], dtype=float) * 255).astype(int)
    assert np.array_equal(first, model.bodies[0].colours[0])


# --- thick ribbons ----------------------------------------------------------------------------

SOLID = ["torus?m=8&n=6", "octahedron", "sphere?n=3", "hypar?m=4&n=3"]


def solid_and_sheet(shape: str, boundary: str = "end", thickness: float = THICKNESS):
    woven_object = woven(shape, boundary)
    colours = thread_colours(woven_object.bunches)
    return (
        woven_object,
        ribbon_bodies(woven_object.ribbons, woven_object.labels, colours, thickness_mm=thickness),
        ribbon_bodies(woven_object.ribbons, woven_object.labels, colours),
    )


@pytest.mark.parametrize("boundary", ["end", "turn"])
@pytest.mark.parametrize("shape", SOLID)
def test_solid_ribbons_are_closed_and_as_heavy_as_their_sheets(shape, boundary):
    _, solids, sheets = solid_and_sheet(shape, boundary)
    for solid, sheet in zip(solids, sheets, strict=True):
        mesh = trimesh.Trimesh(solid.vertices, solid.all_triangles, process=False)
        assert mesh.is_watertight
        assert mesh.is_winding_consistent
        assert mesh.body_count == 1
        area = trimesh.Trimesh(sheet.vertices, sheet.all_triangles, process=False).area
        assert mesh.volume == pytest.approx(area * THICKNESS, rel=0.05)


def test_a_solid_panel_is_exactly_as_thick_as_asked():
    woven_object, solids, _ = solid_and_sheet("torus?m=8&n=6")
    ribbons = woven_object.ribbons
    crossing = woven_object.weave.threads.crossing
    for thread, body in enumerate(solids):
        own = slice(*ribbons.pass_offsets[thread : thread + 2])
        entry = ribbons.entry[own] - ribbons.offsets[thread]
        half = len(body.vertices) // 2
        normal = ribbons.normal[crossing[own]]
        for corner in (0, 1, 2, 3):
            across = body.vertices[2 * entry + corner] - body.vertices[half + 2 * entry + corner]
            assert np.allclose(np.einsum("ij,ij->i", across, normal), THICKNESS)
