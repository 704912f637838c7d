"""Contact sheets keep pictures and captions in their places."""

import numpy as np
import pytest
from PIL import Image

from fabweave.core.errors import InputError
from fabweave.mesh.shapes.catalogue import SHAPES, parse_shape
from fabweave.picture.contact_sheet import contact_sheet
from fabweave.picture.object_picture import irregular_marks, mesh_picture, render_shapes


def tile(colour, size=(100, 60)):
    return Image.new("RGB", size, colour)


def test_every_picture_stands_whole_in_its_row_and_column():
    colours = [(10 * k + 40, 20, 200 - 10 * k) for k in range(7)]
    sheet = np.asarray(contact_sheet([tile(c) for c in colours], ["a"] * 7, columns=3))
    assert sheet.shape[1] == 12 + 3 * 112
    corners = []
    for colour in colours:
        rows, columns = np.nonzero(np.all(sheet == colour, axis=2))
        assert len(rows) == 6000
        assert (np.ptp(rows), np.ptp(columns)) == (59, 99)
        corners.append((rows.min(), columns.min()))
    assert [x for _, x in corners] == [12, 124, 236, 12, 124, 236, 12]
    assert len({y for y, _ in corners}) == 3


@pytest.mark.parametrize(
    "caption",
    ["shape:slit?genus=30&m=24&n=12&length=4&ring=35&tube=15\nand what it is, in many words", "a"],
)
def test_captions_stay_below_their_pictures(caption):
    sheet = np.asarray(contact_sheet([tile("white")] * 2, [caption, "b"], columns=2))
    ink = np.any(sheet < 200, axis=2)
    assert ink[72:, :112].any()
    assert ink[72:, 124:].any()
    assert not ink[:72].any()
    assert not ink[:, :11].any()
    assert not ink[:, 113:123].any()
    assert not ink[-1].any()


def test_a_longer_caption_makes_more_lines():
    def height(caption):
        return contact_sheet([tile("white")], [caption]).height

    assert height("word " * 30) > height("word") == height("w")
    assert height("one\ntwo") > height("one")


def test_signs_that_the_font_lacks_are_written_plainly():
    plain = contact_sheet([tile("white")], ["m x n^2 - 3"])
    assert contact_sheet([tile("white")], ["m × n² – 3"]).tobytes() == plain.tobytes()


@pytest.mark.parametrize(("tiles", "captions", "columns"), [(0, 0, 3), (2, 1, 3), (2, 2, 0)])
def test_captions_that_do_not_match_are_refused(tiles, captions, columns):
    with pytest.raises(InputError, match=f"{tiles} pictures with {captions} captions"):
        contact_sheet([tile("red")] * tiles, ["a"] * captions, columns=columns)


def test_shapes_are_all_shown_with_their_own_picture():
    some = [shape for shape in SHAPES if shape.name in ("cube", "hypar")]
    assert len(some) == 2
    sheet = np.asarray(render_shapes(some))
    for index, shape in enumerate(some):
        mesh = parse_shape(shape.example)
        marks = irregular_marks(mesh, radius_px=3.0)
        few = 4 * len(marks.points) <= mesh.n_vertices
        alone = np.asarray(mesh_picture(mesh, size_px=(380, 300), marks=marks if few else None))
        left = 12 + index * 392
        assert np.array_equal(sheet[12:312, left : left + 380], alone)
        assert np.any(alone < 240)
