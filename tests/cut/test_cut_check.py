"""The check objects to every kind of spoiled drawing, and all writers ask it."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from fabweave.core.errors import InputError
from fabweave.cut.drawing import Circle, Layer, PieceDrawing, Polyline
from fabweave.cut.drawing_check import check_drawing
from fabweave.cut.line_overlap import overlapping
from fabweave.cut.write.dxf import dxf_bytes
from fabweave.cut.write.preview import png_bytes
from fabweave.cut.write.svg import svg_text
from fabweave.verify.checks.sheets.lines import _on_others


def outline(points, layer=Layer.CUT_OUTER, closed=True):
    return Polyline(layer, np.array(points, dtype=float), closed)


TRIANGLE = outline([[10, 10], [20, 10], [10, 20]])
HOLE = Circle(Layer.CUT_INNER, 13.0, 13.0, 1.0)
MARK = outline([[11, 11], [12, 11]], Layer.ENGRAVE_MARK, closed=False)


#: What is wrong, the entities of piece Q7 that are so, and the words of the message.
SPOILED = [
    ("nan", [outline([[0, 0], [9, 0], [0, np.nan]])], "1 point.*not finite.*Q7"),
    ("infinite", [outline([[0, 0], [np.inf, 0], [0, 9]])], "not finite.*Q7"),
    ("nan centre", [Circle(Layer.CUT_INNER, np.nan, 1.0, 1.0), TRIANGLE], "not finite.*Q7"),
    ("nan radius", [Circle(Layer.CUT_INNER, 1.0, 1.0, np.nan), TRIANGLE], "not finite.*Q7"),
    ("short", [outline([[0, 0], [9, 0], [9.05, 0.05], [0, 9]])], "1 segment.*shorter.*Q7"),
    ("repeated last", [outline([[0, 0], [9, 0], [0, 9], [0, 0]])], "1 segment.*shorter.*Q7"),
    ("short mark", [outline([[0, 0], [0.05, 0]], Layer.ENGRAVE_MARK, False), TRIANGLE], "shorter"),
    ("open outline", [outline([[0, 0], [9, 0], [0, 9]], closed=False)], "cut are open.*Q7"),
    ("open hole", [outline([[0, 0], [9, 0]], Layer.CUT_INNER, False), TRIANGLE], "open.*Q7"),
    ("two points", [outline([[0, 0], [9, 0]])], "too few points.*Q7"),
    ("one point", [outline([[0, 0]], Layer.ENGRAVE_MARK, False), TRIANGLE], "too few points.*Q7"),
    ("3-D", [Polyline(Layer.CUT_OUTER, np.zeros((4, 3)), True)], "too few points.*Q7"),
    ("flat array", [Polyline(Layer.CUT_OUTER, np.zeros(6), True)], "too few points.*Q7"),
    ("small circle", [Circle(Layer.CUT_INNER, 1.0, 1.0, 0.0), TRIANGLE], "radius.*Q7"),
    ("negative", [Circle(Layer.CUT_INNER, 1.0, 1.0, -3.0), TRIANGLE], "radius.*Q7"),
    ("metres", [outline([[0, 0], [1e6, 0], [0, 9]])], "100 m away.*Q7"),
    ("hole last", [TRIANGLE, HOLE], "not in cutting order.*Q7"),
    ("mark after hole", [HOLE, MARK, TRIANGLE], "not in cutting order.*Q7"),
    ("note", [TRIANGLE, outline([[0, 0], [9, 0]], Layer.NOTES, False)], "on NOTES.*Q7"),
    ("no outline", [MARK, HOLE], "no outline.*Q7"),
    ("nothing", [], "no outline.*Q7"),
    ("hole twice", [HOLE, HOLE, TRIANGLE], "1 circle.*twice.*Q7"),
    ("outline twice", [TRIANGLE, TRIANGLE], "3 segment.*twice.*Q7"),
    ("there and back", [outline([[0, 0], [9, 0], [9, 9], [9, 0]])], "2 segment.*twice.*Q7"),
    (
        "reversed mark",
        [MARK, outline([[12, 11], [11, 11]], Layer.ENGRAVE_MARK, False), TRIANGLE],
        "1 segment.*twice.*Q7",
    ),
    ("part of it twice", [outline([[0, 0], [9, 0], [9, 9], [9, 3], [0, 3]])], "1.*lie on o.*Q7"),
    ("along the outline", [TRIANGLE, outline([[12, 10], [25, 10], [25, 5]])], "1.*lie on o.*Q7"),
    (
        "along it at an angle",
        [outline([[17, 13], [13, 17], [5, 5]], Layer.CUT_INNER), TRIANGLE],
        "1.*lie on o.*Q7",
    ),
]


@pytest.mark.parametrize("seed", range(8))
def test_overlaps_are_those_that_lines_share(seed):
    # On a grid, turned and shifted, many lines overlap; what two share has a length or has none.
    rng = np.random.default_rng(seed)
    ends = rng.integers(0, 5, (70, 2, 2))
    ends = ends[np.any(ends[:, 0] != ends[:, 1], axis=1)]
    lines = shapely.linestrings(ends.astype(float))
    shared = shapely.length(shapely.intersection(lines[:, None], lines[None]))
    wanted = np.flatnonzero(np.any(np.tril(shared > 1e-9, -1), axis=1))
    angle = rng.uniform(0.0, 2.0 * np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    placed = ends @ turn.T * rng.uniform(0.5, 90.0) + rng.uniform(0.0, 2000.0, 2)
    assert 5 < len(wanted) < 65
    assert overlapping(placed[:, 0], placed[:, 1]).tolist() == wanted.tolist()
    # verify finds the same by code of its own.
    assert _on_others(placed[:, 0], placed[:, 1]).tolist() == wanted.tolist()


def test_lines_that_are_side_by_side_or_end_on_end_share_nothing():
    starts = np.array([[0.0, 0.0], [10.0, 0.0], [2.0, 0.01], [5.0, -3.0]])
    ends = np.array([[10.0, 0.0], [20.0, 0.0], [8.0, 0.01], [5.0, 3.0]])
    assert overlapping(starts, ends).tolist() == []
    assert _on_others(starts, ends).tolist() == []


@pytest.fixture
def spoil(sheet_of, make_piece):
    """Return a function that adds a piece Q7 to a good sheet."""
    good = sheet_of([make_piece("A1", (10.0, 40.0))])

    def spoiled(entities):
        return replace(good, pieces=(*good.pieces, PieceDrawing("Q7", tuple(entities))))

    return spoiled


@pytest.mark.parametrize(("_what", "entities", "message"), SPOILED, ids=[row[0] for row in SPOILED])
def test_spoiled_pieces_are_refused_and_named(_what, entities, message, spoil):
    with pytest.raises(InputError, match=message) as caught:
        check_drawing(spoil(entities))
    assert "A1" not in str(caught.value)


@pytest.mark.parametrize("write", [dxf_bytes, svg_text, png_bytes])
@pytest.mark.parametrize("row", [0, 4, 16, 18], ids=lambda row: SPOILED[row][0])
def test_no_writer_writes_a_spoiled_drawing(write, row, spoil):
    with pytest.raises(InputError, match="Q7"):
        write(spoil(SPOILED[row][1]))


def test_the_unspoiled_drawing_passes(spoil, sheet):
    check_drawing(spoil([MARK, HOLE, TRIANGLE]))
    check_drawing(sheet)


def test_segments_of_just_the_limit_pass(spoil):
    for turn in np.linspace(0.0, 6.0, 50):
        near = [50.0 + 0.1 * np.cos(turn), 50.0 + 0.1 * np.sin(turn)]
        far = [50.0 - 20.0 * np.sin(turn), 50.0 + 20.0 * np.cos(turn)]
        check_drawing(spoil([outline([[50.0, 50.0], near, far])]))


def test_a_line_may_not_be_shared_by_two_pieces(sheet_of):
    left = outline([[0, 0], [9, 0], [9, 9]])
    right = outline([[9, 9], [9, 0], [18, 0]])
    drawing = sheet_of([PieceDrawing("L", (left,)), PieceDrawing("R", (right,))])
    with pytest.raises(InputError, match=r"1 segment.*twice, in R"):
        check_drawing(drawing)


@pytest.mark.parametrize("layer", [layer for layer in Layer if layer is not Layer.NOTES])
def test_notes_are_on_no_layer_of_the_pieces(layer, sheet):
    stray = outline([[1, 1], [9, 1], [1, 9]], layer)
    with pytest.raises(InputError, match=f"layer of the pieces, in {layer.value}"):
        check_drawing(replace(sheet, notes=(*sheet.notes, stray)))


def test_spoiled_notes_are_named_as_notes(sheet):
    bad = outline([[1, 1], [np.nan, 1]], Layer.NOTES, closed=False)
    with pytest.raises(InputError, match="in the notes"):
        check_drawing(replace(sheet, notes=(bad,)))


@pytest.mark.parametrize(
    "changes",
    [
        *({"pieces": (PieceDrawing(name, (TRIANGLE,)),), "notes": ()}
          for name in ("", "A 1", "A\n1", "Ä1", "A" * 61, "A\x00")),
        *({side: size} for side in ("width_mm", "height_mm")
          for size in (0.0, -1.0, float("nan"), float("inf"), 1e6)),
        *({"name": name} for name in ("", "  ", "a\nb")),
    ],
)  # fmt: skip
def test_names_and_sizes_that_a_file_cannot_carry_are_refused(changes, sheet):
    with pytest.raises(InputError):
        check_drawing(replace(sheet, **changes))


def test_an_id_that_occurs_twice_is_refused(sheet):
    with pytest.raises(InputError, match="in A1"):
        check_drawing(replace(sheet, pieces=(*sheet.pieces, replace(sheet.pieces[0]))))


def test_many_offenders_are_counted_and_a_few_named(sheet_of):
    pieces = [PieceDrawing(f"P{k}", ()) for k in range(20)]
    with pytest.raises(InputError, match=r"^20 piece.*P7 and 12 more"):
        check_drawing(sheet_of(pieces))
