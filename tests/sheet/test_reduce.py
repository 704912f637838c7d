import numpy as np
import pytest

from fabweave.sheet import nest as nesting
from fabweave.sheet.check import check_layout
from fabweave.sheet.layout import SheetSize
from fabweave.sheet.nest import nest


def strips(piece_sets, count, seed):
    return [
        0.4 * piece for piece in piece_sets["measured_set"](count, seed=seed)
    ]  # of 40 to 200 mm


def test_emptying_sheets_never_takes_more_and_keeps_every_rule(piece_sets, monkeypatch):
    pieces = strips(piece_sets, 45, 1)
    stock = [SheetSize(240, 160)]
    found = nest(pieces, stock, margin_mm=4, gap_mm=1, effort="normal")
    monkeypatch.setattr(nesting, "reduced", lambda *_: iter(()))
    greedy = nest(pieces, stock, margin_mm=4, gap_mm=1, effort="normal")
    assert check_layout(found, pieces) == []
    assert len(found.sheets) <= len(greedy.sheets)
    assert {p.sheet for p in found.placements} == set(range(len(found.sheets)))


def test_ctrl_c_keeps_the_last_complete_layout_and_says_so(piece_sets):
    pieces = strips(piece_sets, 60, 1)
    placed = []

    def interrupt(_what, done, total):
        placed.append(done)
        if len(placed) > 1 and placed[-2] == total:  # all were placed, once
            raise KeyboardInterrupt

    layout = nest(
        pieces, [SheetSize(240, 160)], margin_mm=4, gap_mm=1, effort="normal", progress=interrupt
    )
    assert check_layout(layout, pieces) == []
    (note,) = layout.notes
    assert note.startswith(f"nesting was cut short: the pieces are on {len(layout.sheets)} sheets")


def test_ctrl_c_before_everything_is_placed_ends_it(piece_sets):
    def interrupt(*_said):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        nest(
            strips(piece_sets, 40, 3),
            [SheetSize(240, 160)],
            margin_mm=4,
            gap_mm=1,
            effort="normal",
            progress=interrupt,
        )


def test_pieces_that_fill_their_sheets_are_left_as_they_are():
    # Two squares of 50 mm cannot share 80 × 80 mm, whatever is tried.
    square = np.array([[0.0, 0.0], [50.0, 0.0], [50.0, 50.0], [0.0, 50.0]])
    layout = nest([square] * 3, [SheetSize(80, 80)], margin_mm=2, gap_mm=2, effort="normal")
    assert len(layout.sheets) == 3
    assert check_layout(layout, [square] * 3) == []


def test_last_sheet_is_packed_to_the_left(piece_sets):
    pieces = strips(piece_sets, 30, 1)
    layout = nest(pieces, [SheetSize(240, 160)], margin_mm=4, gap_mm=1, effort="normal")
    last = len(layout.sheets) - 1
    here = [p.apply(pieces[p.piece]) for p in layout.placements if p.sheet == last]
    # The leftmost piece stands on the margin, but for a pixel.
    assert min(points[:, 0].min() for points in here) <= 4 + 3
