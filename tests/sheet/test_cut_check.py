"""The check objects to every kind of spoiled drawing, and all writers ask it."""

from dataclasses import replace

import numpy as np
import pytest

from fabweave.core.errors import InputError
from fabweave.sheet.drawing import Circle, Layer, PieceDrawing, Polyline, check_drawing
from fabweave.sheet.write.dxf import dxf_bytes
from fabweave.sheet.write.preview import png_bytes
from fabweave.sheet.write.svg import svg_text


def outline(points, layer=Layer.CUT_OUTER, closed=True):
    return Polyline(layer, np.array(points, dtype=float), closed)


TRIANGLE = outline([[10, 10], [20, 10], [10, 20]])
HOLE = Circle(Layer.CUT_INNER, 13.0, 13.0, 1.0)
MARK = outline([[11, 11], [12, 11]], Layer.ENGRAVE_MARK, closed=False)


#: What is wrong, the entities of piece Q7 that are so, and the words of the message.
SPOILED = {
    "nan": ([outline([[0, 0], [9, 0], [0, np.nan]])], "1 point.*not finite.*Q7"),
    "infinite": ([outline([[0, 0], [np.inf, 0], [0, 9]])], "not finite.*Q7"),
    "nan centre": ([Circle(Layer.CUT_INNER, np.nan, 1.0, 1.0), TRIANGLE], "not finite.*Q7"),
    "nan radius": ([Circle(Layer.CUT_INNER, 1.0, 1.0, np.nan), TRIANGLE], "not finite.*Q7"),
    "metres": ([outline([[0, 0], [1e6, 0], [0, 9]])], "500 m away.*Q7"),
    "open outline": ([outline([[0, 0], [9, 0], [0, 9]], closed=False)], "cut are open.*Q7"),
    "open hole": ([outline([[0, 0], [9, 0]], Layer.CUT_INNER, False), TRIANGLE], "open.*Q7"),
    "hole last": ([TRIANGLE, HOLE], "not in cutting order.*Q7"),
    "mark after hole": ([HOLE, MARK, TRIANGLE], "not in cutting order.*Q7"),
    "note": ([TRIANGLE, outline([[0, 0], [9, 0]], Layer.NOTES, False)], "among the notes.*Q7"),
    "no outline": ([MARK, HOLE], "no outline.*Q7"),
    "nothing": ([], "no outline.*Q7"),
}  # fmt: skip


@pytest.fixture
def spoil(sheet_of, make_piece):
    """Return a function that adds a piece Q7 to a good sheet."""
    good = sheet_of([make_piece("A1", (10.0, 40.0))])

    def spoiled(entities):
        return replace(good, pieces=(*good.pieces, PieceDrawing("Q7", tuple(entities))))

    return spoiled


@pytest.mark.parametrize("name", SPOILED)
def test_spoiled_pieces_are_refused_and_named(name, spoil):
    entities, message = SPOILED[name]
    with pytest.raises(InputError, match=message) as caught:
        check_drawing(spoil(entities))
    assert "A1" not in str(caught.value)


@pytest.mark.parametrize("write", [dxf_bytes, svg_text, png_bytes])
@pytest.mark.parametrize("name", ["nan", "open outline", "hole last"])
def test_no_writer_writes_a_spoiled_drawing(write, name, spoil):
    with pytest.raises(InputError, match="Q7"):
        write(spoil(SPOILED[name][0]))


def test_the_unspoiled_drawing_passes(spoil, sheet):
    check_drawing(spoil([MARK, HOLE, TRIANGLE]))
    check_drawing(sheet)


@pytest.mark.parametrize("layer", [layer for layer in Layer if layer is not Layer.NOTES])
def test_notes_are_on_no_layer_of_the_pieces(layer, sheet):
    stray = outline([[1, 1], [9, 1], [1, 9]], layer)
    with pytest.raises(InputError, match="the notes"):
        check_drawing(replace(sheet, notes=(*sheet.notes, stray)))


def test_spoiled_notes_are_named_as_notes(sheet):
    bad = outline([[1, 1], [np.nan, 1]], Layer.NOTES, closed=False)
    with pytest.raises(InputError, match="in the notes"):
        check_drawing(replace(sheet, notes=(bad,)))
