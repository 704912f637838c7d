"""Contact sheets keep pictures and captions in their places."""

import numpy as np
from PIL import Image

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
