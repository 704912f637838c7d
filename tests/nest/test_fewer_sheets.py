import numpy as np
import pytest
from sheet_fit import bar

from fabweave.nest import nesting
from fabweave.nest.container import container_of
from fabweave.nest.item_shape import shape_of
from fabweave.nest.nesting import nest
from fabweave.nest.separate import fewer_sheets as emptying
from fabweave.nest.separate.fewer_sheets import CoarseSearch, SeparationProblem, shortfall_mm
from fabweave.nest.separate.separation import item_field
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import FREE
from fabweave.stock.sheet_size import SheetSize


def strips(piece_sets, count, seed):
    # Of 40 to 200 mm.
    return [0.4 * piece for piece in piece_sets["measured_set"](count, seed=seed)]


@pytest.mark.slow
def test_emptying_sheets_never_takes_more_and_keeps_every_rule(piece_sets, monkeypatch):
    pieces = strips(piece_sets, 45, 1)
    stock = [SheetSize(240, 160)]
    found = nest(pieces, stock, margin_mm=4, gap_mm=1, effort="normal")
    monkeypatch.setattr(nesting, "fewer_sheets", lambda *_: iter(()))
    greedy = nest(pieces, stock, margin_mm=4, gap_mm=1, effort="normal")
    assert check_layout(found, pieces) == []
    assert len(found.sheets) <= len(greedy.sheets)
    assert {p.sheet for p in found.placements} == set(range(len(found.sheets)))


@pytest.mark.slow
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
    assert len(layout.notes) == 1


def test_ctrl_c_before_everything_is_placed_ends_it(piece_sets):
    def interrupt(*_said):
        raise KeyboardInterrupt

    rules = {"margin_mm": 4, "gap_mm": 1, "effort": "normal"}
    with pytest.raises(KeyboardInterrupt):
        nest(strips(piece_sets, 40, 3), [SheetSize(240, 160)], progress=interrupt, **rules)


def test_pieces_that_fill_their_sheets_are_left_as_they_are():
    # Two squares of 50 mm cannot share 80 × 80 mm, whatever is tried.
    square = bar(50.0, 50.0)
    layout = nest([square] * 3, [SheetSize(80, 80)], margin_mm=2, gap_mm=2, effort="normal")
    assert len(layout.sheets) == 3
    assert check_layout(layout, [square] * 3) == []


def test_pieces_far_from_those_that_move_stay_and_change_nothing(monkeypatch):
    shape = shape_of(bar(30.0, 6.0))[0]
    container = container_of(SheetSize(410, 260), 5.0, 1.0, FREE)
    items = [item_field(shape, 1.0)] * 101
    problem = SeparationProblem(items, [container], [None], 1.0, CoarseSearch())
    # Ten columns of ten, and one more that lies across a few at their upper end.
    rows, columns = np.divmod(np.arange(100), 10)
    poses = np.column_stack([20.0 + 39.0 * columns, 10.0 + 8.6 * rows, np.zeros(100)])
    poses = np.concatenate([poses, [[25.0, 93.0, 0.1]]])
    moving = np.hypot(*(poses[:, :2] - poses[-1, :2]).T) < 90.0
    assert 10 < moving.sum() < 60
    separated = problem.separated(range(101), poses, 0, moving=moving)
    monkeypatch.setattr(emptying, "_AWAY_MM", 1e6)
    assert np.array_equal(separated, problem.separated(range(101), poses, 0, moving=moving))
    assert np.array_equal(separated[~moving], poses[~moving])
    assert shortfall_mm(items, separated, container, 1.0) <= 1e-9
