"""What a job is called: as its maker says, or in plain words."""

import pytest

from fabweave.mesh.shapes.catalogue import object_title


@pytest.mark.parametrize(
    ("mesh", "title"),
    [
        ("spot_control_mesh.obj", "Spot control mesh"),
        ("/a/b/catmark-torus.v2.PLY", "Catmark torus v2"),
        ("hexaSphere.obj", "HexaSphere"),
        ("shape:torus?m=4&n=4", "Torus, 4 by 4"),
        ("__.obj", "__"),
        ("größe 3.stl", "Größe 3"),
    ],
)
def test_files_are_called_by_the_words_of_their_names(mesh, title):
    assert object_title(mesh) == title
