"""Scene files that unpack to more than their share are refused before memory is taken for it."""

import json
import tracemalloc
import zipfile

import pytest
import trimesh

from fabweave.core.errors import InputError
from fabweave.mesh.io import mesh_file
from fabweave.mesh.io.files import read_mesh


def require_refused(path, data: bytes, match: str | None = None) -> None:
    """Read a file that must be refused, before it takes much memory."""
    path.write_bytes(data)
    tracemalloc.start()
    with pytest.raises(InputError, match=match):
        read_mesh(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5 * len(data) + 20e6


def test_an_archive_that_unpacks_to_a_thousand_times_its_size_is_refused(tmp_path):
    path = tmp_path / "a.3mf"
    trimesh.creation.box().export(path)
    assert read_mesh(path).mesh.n_faces == 12
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/more.model", " " * 110_000_000)
    require_refused(path, path.read_bytes(), "110,0")
    require_refused(path, b"PK nothing")


def gltf(change) -> bytes:
    """Return the JSON of a box whose arrays are all zeros, changed."""
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"componentType": 5126, "count": 9, "type": "VEC3"}],
    }
    change(document)
    return json.dumps(document).encode()


def test_a_mesh_that_is_placed_very_often_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_file, "MOST_PLACED", 10)
    scene = trimesh.Scene([trimesh.creation.box()])
    for n in range(20):
        scene.add_geometry(trimesh.creation.box(), node_name=f"n{n}", geom_name="box")
    data = scene.export(file_type="glb")
    require_refused(tmp_path / "a.glb", data, "11 objects")


def test_parts_are_ordinary_files_beside_the_mesh(tmp_path):
    def elsewhere(document):
        document["buffers"] = [{"uri": "../../../../dev/zero", "byteLength": 108}]
        document["bufferViews"] = [{"buffer": 0, "byteLength": 108}]
        document["accessors"][0]["bufferView"] = 0

    require_refused(tmp_path / "a.gltf", gltf(elsewhere), "not beside it")
    (tmp_path / "part.bin").symlink_to("/dev/zero")
    inside = gltf(elsewhere).replace(b"../../../../dev/zero", b"part.bin")
    require_refused(tmp_path / "b.gltf", inside, "part.bin")


def test_libraries_log_nothing(tmp_path, capfd):
    (tmp_path / "a.glb").write_bytes(trimesh.creation.box().export(file_type="glb")[:-300])
    with pytest.raises(InputError):
        read_mesh(tmp_path / "a.glb")
    assert capfd.readouterr() == ("", "")
