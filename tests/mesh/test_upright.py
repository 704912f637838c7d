"""What points up is told by a base or by symmetry, and becomes z by a rotation."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from mesh_writers import write_mesh

from fabweave.core.errors import InputError
from fabweave.job.stations import Stations
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.upright import AXES, guess_up, parse_up, turn_of, turn_upright
from fabweave.options.settings import Settings


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


COORDINATES = st.one_of(
    st.floats(-1.0, 1.0), st.floats(-1e-9, 1e-9), st.sampled_from((0.0, 1.0, -1.0, 1e-300, 1e308))
)


@st.composite
def directions(draw):
    way = [draw(COORDINATES) for _ in range(3)]
    assume(any(way))
    return way


def written(way):
    return parse_up(",".join(repr(float(value)) for value in way))


def numbers(up):
    return np.array(AXES.get(up) or [float(number) for number in up.split(",")])


@given(directions())
def test_a_direction_becomes_z_by_a_rotation(way):
    up = written(way)
    turn = turn_of(up)
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 1e-12
    assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-12)
    unit = np.array(way) / np.abs(way).max()
    # A direction is written to ten decimals.
    turned = turn @ (unit / np.linalg.norm(unit))
    assert np.abs(turned - (0.0, 0.0, 1.0)).max() < 2e-10
    told = numbers(up)
    assert np.abs(turn @ told / np.linalg.norm(told) - (0.0, 0.0, 1.0)).max() < 1e-12


@given(directions(), st.floats(1e-3, 1e3))
def test_a_direction_has_one_form_whatever_its_length(way, scale):
    up = written(way)
    assert parse_up(up) == up
    again = written([scale * (value / max(map(abs, way))) for value in way])
    assert np.abs(numbers(up) - numbers(again)).max() < 2e-10


@pytest.mark.parametrize(
    "text", ["", "up", "Z", "1", "1,2", "0,0,0", "nan,0,1", "inf,0,1", "1,2,3,"]
)
def test_what_is_no_direction_is_refused(text):
    with pytest.raises(InputError):
        parse_up(text)


@pytest.mark.parametrize("mesh", [parse_shape("shape:hemisphere"), parse_shape("shape:torus")])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e4])
def test_a_base_tells_the_axis_at_any_scale_and_turn_about_it(mesh, scale):
    for turn in (0.0, 0.4):
        cosine, sine = np.cos(turn), np.sin(turn)
        about = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
        standing = mesh.with_vertices(scale * mesh.vertices @ about.T)
        assert guess_up(standing) == ("z", "base")
        assert guess_up(lying(standing)) == ("y", "base")


@pytest.mark.parametrize(("lifted", "told"), [(0.1, "rim"), (0.6, None)])
def test_what_stands_on_no_base_stands_on_its_rim_if_that_is_flat(lifted, told):
    """A cap whose rim is cut askew, a little or much."""
    cap = parse_shape("shape:hemisphere")
    x, y, z = (cap.vertices / np.ptp(cap.vertices[:, 2])).T
    cap = cap.with_vertices(np.column_stack((x, y, z + lifted * (x + y))))
    found = [guess_up(cap), guess_up(lying(cap))]
    assert found == ([("z", told), ("y", told)] if told else [None, None])


def test_where_nothing_stands_a_sole_mirror_along_z_makes_y_point_up():
    left_and_right_along_y = bird()
    assert guess_up(left_and_right_along_y) is None
    assert guess_up(lying(left_and_right_along_y)) == ("y", "symmetry")


@pytest.mark.parametrize(("kind", "told"), [("obj", ("y", "symmetry")), ("stl", None), ("", None)])
def test_what_mirrors_along_x_alone_has_y_up_where_models_are_made(kind, told):
    ball = parse_shape("shape:sphere?n=8")
    x, y, z = (ball.vertices / np.abs(ball.vertices).max()).T
    head = np.column_stack((x, 1.3 * y + 0.5 * z + 0.4 * y * z, 1.6 * z - 0.5 * y + 0.3 * y * y))
    assert guess_up(ball.with_vertices(head), kind) == told


@pytest.mark.parametrize("scale", [(1e300, 1.0, 1.0), (1e200, 1e200, 1e200), (1.0, 1e-12, 1.0)])
def test_nothing_is_guessed_of_what_has_no_areas_to_compare(scale):
    mesh = parse_shape("shape:octahedron")
    assert guess_up(mesh.with_vertices(mesh.vertices * scale)) is None


def test_a_guess_is_used_and_said_and_kept(tmp_path):
    bowl = parse_shape("shape:hemisphere")
    write_mesh(tmp_path / "bowl.obj", lying(bowl))
    settings = Settings.of(str(tmp_path / "bowl.obj"))
    loaded = Stations(settings).loaded
    assert loaded.up == "y"
    assert any(note.startswith("up: y, guessed from its base") for note in loaded.notes)
    assert np.allclose(np.ptp(loaded.mesh.vertices, axis=0), np.ptp(bowl.vertices, axis=0))
    kept = Stations(Settings.of(settings.mesh.source, up="z")).loaded
    assert kept.up == "z"
    assert np.allclose(turn_upright(kept.mesh, "y").vertices, loaded.mesh.vertices)
    # A mesh from memory, and a shape of ours, stand as they are.
    assert Stations(settings, lying(bowl)).loaded.up == "z"
    assert Stations(Settings.of("shape:hemisphere")).loaded.up is None
