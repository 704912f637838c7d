"""What a job is called: as its maker says, or in plain words."""

import pytest

from fabweave.mesh.shapes.catalogue import SHAPES, object_title


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.name)
def test_shapes_are_called_by_words(shape):
    counts = [item.name for item in shape.parameters if item.whole]
    for query in ("", "?" + "&".join(f"{name}=4" for name in counts)):
        mesh = f"shape:{shape.name}" + (query if counts else "")
        title = object_title(mesh)
        assert not set(title) & set(":?&=_{}"), title
        assert title[0].isupper()


@pytest.mark.parametrize(
    ("mesh", "title"),
    [
        ("spot_control_mesh.obj", "Spot control mesh"),
        ("/a/b/catmark-torus.v2.PLY", "Catmark torus v2"),
        ("hexaSphere.obj", "HexaSphere"),
        ("octahedron", "Octahedron"),
        ("__.obj", "__"),
        ("größe 3.stl", "Größe 3"),
    ],
)
def test_files_are_called_by_the_words_of_their_names(mesh, title):
    assert object_title(mesh) == title


def test_what_the_maker_says_wins():
    assert object_title("shape:torus", "Fruit bowl") == "Fruit bowl"
