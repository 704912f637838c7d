"""Bodies that run into one another become the surface of what they enclose together."""

import numpy as np
import pytest
import trimesh
from mesh_writers import write_mesh
from strategies import merged, volume

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.mesh.bodies import join_bodies
from fabweave.mesh.check import check_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.options.settings import Settings

pytest.importorskip("manifold3d", reason="the package manifold3d is absent")


def box(low, high):
    """Return a box of quads."""
    solid = trimesh.creation.box(bounds=[low, high])
    return PolyMesh.from_faces(solid.vertices.tolist(), solid.faces.tolist())


def test_four_bars_make_a_frame_of_genus_one_whichever_way_they_look():
    bars = [
        box([0, 0, 0], [9, 1, 1]), box([0, 8, 0], [9, 9, 1]),
        box([0, 0.5, 0.2], [1, 8.5, 0.8]), box([8, 0.5, 0.2], [9.3, 8.5, 0.8]),
    ]  # fmt: skip
    outward = join_bodies(merged(*bars)).mesh
    inside_out = [PolyMesh.from_faces(b.vertices, [f[::-1] for f in b.faces()]) for b in bars]
    inward = join_bodies(merged(bars[0], *inside_out[1:])).mesh
    for mesh in (outward, inward):
        assert check_mesh(mesh).component_genus == (1,)
    assert volume(outward) == pytest.approx(volume(inward), rel=1e-12)


def test_what_is_inside_goes_and_what_is_apart_stays_as_it_is():
    one, inside, apart = (
        box([0, 0, 0], [4, 4, 4]), box([1, 1, 1], [2, 2, 2]), box([9, 0, 0], [10, 1, 1])
    )  # fmt: skip
    kept = join_bodies(merged(one, inside)).mesh
    assert volume(kept) == pytest.approx(64.0, rel=1e-9)
    assert kept.n_faces == 12
    both = merged(one, apart)
    assert join_bodies(both).mesh is both
    assert join_bodies(one).mesh is one


def test_an_open_body_is_named():
    cube = box([0, 0, 0], [1, 1, 1])
    lidless = PolyMesh.from_faces(cube.vertices + 0.5, cube.faces()[:-1])
    with pytest.raises(InputError, match=r"body 2 of 2, with 11 triangles, is not closed"):
        join_bodies(merged(cube, lidless))


def test_a_joined_model_is_loaded_as_one_body(tmp_path):
    path = tmp_path / "two.obj"
    one = box([0, 0, 0], [2, 2, 2])
    write_mesh(path, merged(one, one.with_vertices(one.vertices + 1.0)))
    loaded = Stations(Settings.of(str(path), size_mm=300.0, bodies="join")).loaded
    assert check_mesh(loaded.mesh).n_components == 1
    assert np.ptp(loaded.mesh.vertices, axis=0) == pytest.approx([300.0] * 3)
    assert loaded.left_out == 0.0
    assert Stations(Settings.of(str(path), size_mm=300.0, bodies="largest")).loaded.left_out == 0.5
