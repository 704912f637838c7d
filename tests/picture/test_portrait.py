"""The picture of a job shows the woven object from two sides, in the colours of its threads."""

import numpy as np
import pytest
from weaving_meshes import walked

from fabweave.core.colour_space import Colours
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.mesh.upright import resize_mesh
from fabweave.picture import object_picture
from fabweave.picture.camera import View
from fabweave.picture.contact_sheet import titled
from fabweave.picture.object_picture import (
    object_portrait,
    second_view,
)
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.ribbon.project import Ribbons, project_ribbons
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import plain_weave
from fabweave.weave.strand_colours import thread_colours

#: Smaller than users get them: two views are drawn beside one another.
SIDE_PX = 300


@pytest.fixture
def small(monkeypatch) -> None:
    monkeypatch.setattr(object_picture, "SIDE_PX", (SIDE_PX, SIDE_PX))


def woven(name: str) -> tuple[Ribbons, Colours]:
    mesh, _ = resize_mesh(parse_shape(f"shape:{name}"), size_mm=200.0)
    halfedges, threads = walked(mesh)
    ribbons = project_ribbons(mesh, halfedges, plain_weave(threads), height_mm=0.3)
    return ribbons, thread_colours(part_bunches(threads))


def hues(pixels: np.ndarray) -> np.ndarray:
    """Return which channel is the strongest where a pixel is clearly coloured, else -1."""
    low, high = pixels.min(axis=-1).astype(int), pixels.max(axis=-1).astype(int)
    return np.where(high - low > 60, pixels.argmax(axis=-1), -1)


@pytest.mark.usefixtures("small")
def test_both_halves_show_warp_and_weft_and_the_corners_are_white():
    ribbons, colours = woven("torus?m=12&n=8")
    pixels = np.asarray(object_portrait(ribbons, colours))
    middle = SIDE_PX
    for half in (pixels[:, :middle], pixels[:, middle:]):
        shown = hues(half)
        # Vermilion and blue, each on a good part of the picture.
        for channel in (0, 2):
            assert np.mean(shown == channel) > 0.08
        assert (half[0, 0] == 255).all()
        assert (half[-1, -1] == 255).all()


@pytest.mark.parametrize(
    ("name", "axes", "where"),
    [
        ("torus?m=10&n=5", [0, 1, 2], "from above"),
        ("tube", [0, 1, 2], "from above"),
        # It lies on its side.
        ("hemisphere", [2, 1, 0], "from behind"),
    ],
)
def test_what_looks_the_same_from_behind_is_shown_from_above(name, axes, where):
    vertices, triangles, _ = ribbon_triangles(woven(name)[0])
    assert second_view(vertices[:, axes], triangles, View(-60.0, 30.0))[1] == where


def shown_box(pixels: np.ndarray) -> tuple[float, float]:
    """Return how much of a picture's width and height coloured pixels take."""
    rows, columns = np.nonzero(np.ptp(pixels.astype(int), axis=2) > 60)
    high, wide = pixels.shape[:2]
    return np.ptp(columns) / wide, np.ptp(rows) / high


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize(
    ("name", "stretched"), [("torus?m=12&n=8", 1), ("tube", 1), ("tube", 4), ("hypar", 1)]
)
def test_the_object_fills_its_frame_and_no_word_crosses_it(name, stretched, monkeypatch):
    mesh, _ = resize_mesh(parse_shape(f"shape:{name}"), size_mm=200.0)
    mesh = mesh.with_vertices(mesh.vertices * [1, 1, stretched])
    halfedges, threads = walked(mesh)
    ribbons = project_ribbons(mesh, halfedges, plain_weave(threads), height_mm=0.3)
    tiles: list[np.ndarray] = []

    def kept(picture, text):
        tiles.append(np.asarray(picture))
        return titled(picture, text)

    monkeypatch.setattr(object_picture, "titled", kept)
    whole = np.asarray(object_portrait(ribbons, thread_colours(part_bunches(threads)), "let go"))
    boxes = [shown_box(tile) for tile in tiles]
    assert max(max(box) for box in boxes) > 0.85
    assert all(max(box) > 0.25 for box in boxes)  # both are of one scale
    # Below the pictures is a band that holds words and nothing of the object.
    high = len(tiles[0])
    assert (whole[:high] == np.hstack(tiles)).all()
    band = whole[high:].astype(int)
    assert band.min() < 100
    assert np.ptp(band, axis=2).max() < 60
