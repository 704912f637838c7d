"""The axis that points up is told by a base or by symmetry, whatever way a mesh lies."""

import numpy as np
import pytest

from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import SHAPES, parse_shape
from fabweave.mesh.upright import guess_up, turn_upright
from fabweave.options.settings import Settings
from fabweave.plan.ask import load_asked


def lying(mesh: PolyMesh) -> PolyMesh:
    """Turn a mesh with z up so that y is up: the way back of ``turn_upright``."""
    x, y, z = mesh.vertices.T
    return mesh.with_vertices(np.column_stack((x, z, -y)))


def bird() -> PolyMesh:
    """Return a body that stands on nothing, with left and right along y and no other mirror."""
    ball = parse_shape("shape:sphere?n=8")
    x, y, z = ball.vertices.T
    return ball.with_vertices(
        np.column_stack((2 * x + 0.02 * x * x, y, z + 0.03 * x * x + x * 0.5))
    )


@pytest.mark.parametrize("mesh", [parse_shape("shape:hemisphere"), parse_shape("shape:torus")])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_base_tells_the_axis_at_any_scale_and_turn_about_it(mesh, scale):
    for turn in (0.0, 0.4):
        cosine, sine = np.cos(turn), np.sin(turn)
        about = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
        standing = mesh.with_vertices(scale * mesh.vertices @ about.T)
        assert guess_up(standing) == ("z", "base")
        assert guess_up(lying(standing)) == ("y", "base")


def test_where_nothing_stands_a_sole_mirror_along_z_makes_y_point_up():
    left_and_right_along_y = bird()
    assert guess_up(left_and_right_along_y) is None
    assert guess_up(lying(left_and_right_along_y)) == ("y", "symmetry")


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_no_shape_of_ours_is_turned(shape):
    guess = guess_up(shape.make())
    assert guess is None or guess[0] == "z"


def test_what_has_no_surface_is_not_guessed():
    flat = PolyMesh.from_faces([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]])
    broken = flat.with_vertices(flat.vertices * np.nan)
    assert guess_up(flat) is guess_up(broken) is None


def test_a_guess_is_used_and_said_and_kept(tmp_path):
    bowl = parse_shape("shape:hemisphere")
    write_mesh(tmp_path / "bowl.obj", lying(bowl))
    settings = Settings.of(str(tmp_path / "bowl.obj"))
    loaded = load_asked(settings)
    assert loaded.up == "y"
    assert any(note.startswith("up: y, guessed from its base") for note in loaded.notes)
    assert np.allclose(np.ptp(loaded.mesh.vertices, axis=0), np.ptp(bowl.vertices, axis=0))
    kept = load_asked(Settings.of(settings.mesh.source, up="z"))
    assert kept.up == "z"
    assert np.allclose(turn_upright(kept.mesh, "y").vertices, loaded.mesh.vertices)
    # A mesh from memory, and a shape of ours, stand as they are.
    assert load_asked(settings, given_mesh=lying(bowl)).up == "z"
    assert load_asked(Settings.of("shape:hemisphere")).up is None
