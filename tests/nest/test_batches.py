"""Very many pieces: what batches promise, with small numbers in place of large ones."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from sheet_fit import bar

from fabweave.core.errors import CannotMakeError
from fabweave.core.parallel.executors import processes
from fabweave.nest import nesting
from fabweave.nest import nesting as batches
from fabweave.nest.container import container_of
from fabweave.nest.fits import fits_on
from fabweave.nest.item_shape import shapes_of
from fabweave.nest.layout import effort_named
from fabweave.nest.nesting import nest
from fabweave.nest.place.fill import NestingJob
from fabweave.plan.nest_pieces import check_layout
from fabweave.stock.rotations import FREE
from fabweave.stock.sheet_size import SheetSize

STOCK = [SheetSize(120, 80)]
RULES = {"margin_mm": 3.0, "gap_mm": 1.0}


@pytest.fixture
def small(monkeypatch):
    """Make batches of some twenty pieces, about two sheets each."""
    monkeypatch.setattr(batches, "_PIECES", 20)
    monkeypatch.setattr(batches, "_LEAST_SHEETS", 1)


@pytest.fixture
def hasty(monkeypatch):
    """Let nesting lose patience soon."""
    monkeypatch.setattr(
        nesting, "effort_named", lambda name: replace(effort_named(name), rounds=3, patience=1)
    )


def strips(piece_sets, count, seed=0):
    return [0.2 * piece for piece in piece_sets["measured_set"](count, seed=seed)]


def job_of(pieces, stock=STOCK):
    shapes, poses = shapes_of(pieces)
    containers = tuple(container_of(sheet, 3.0, 1.0, FREE) for sheet in stock)
    effort, names = effort_named("quick"), [str(number) for number in range(len(pieces))]
    fits = fits_on(shapes, containers, 1.0, effort)
    return NestingJob(
        shapes=shapes, poses=poses, names=names, stock=tuple(stock), effort=effort, workers=1,
        containers=containers, fits=fits, near_mm=10.0, **RULES,
    )  # fmt: skip


def test_every_piece_is_dealt_once_and_batches_are_about_equal(piece_sets):
    pieces = strips(piece_sets, 240)
    job = job_of(pieces)
    dealt = batches.deal(job, 5)
    assert sorted(piece for batch in dealt for piece in batch) == list(range(240))
    area = [sum(job.shapes[job.poses[piece].shape].area_mm2 for piece in batch) for batch in dealt]
    longest = [max(np.ptp(pieces[piece], axis=0).max() for piece in batch) for batch in dealt]
    assert max(area) < 1.25 * min(area)
    assert max(longest) < 1.6 * min(longest)  # each has long ones to begin with


def test_congruent_pieces_stay_together_as_far_as_batches_are_equal():
    bars = [bar(length, 5.0) for length in np.repeat(np.geomspace(20.0, 70.0, 12), 8)]
    order = np.random.default_rng(2).permutation(len(bars))
    job = job_of([bars[number] for number in order])
    for batch in batches.deal(job, 4):
        counts = Counter(job.poses[piece].shape for piece in batch)
        assert set(counts.values()) == {8}


@pytest.mark.slow
@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("effort", ["quick", pytest.param("normal", marks=pytest.mark.slow)])
def test_layout_is_the_same_here_and_in_processes_and_hardly_worse_than_one_batch(
    effort, piece_sets, monkeypatch
):
    pieces = strips(piece_sets, 72)
    together = nest(pieces, STOCK, effort=effort, **RULES)
    monkeypatch.setattr(batches, "_PIECES", 20)
    monkeypatch.setattr(batches, "_LEAST_SHEETS", 1)
    here = nest(pieces, STOCK, effort=effort, **RULES)
    beside = nest(pieces, STOCK, effort=effort, executors=processes(2), **RULES)
    assert here == beside
    assert check_layout(here, pieces) == []
    assert [placement.piece for placement in here.placements] == list(range(72))
    assert here != together  # so there were batches
    assert len(here.sheets) <= math.ceil(1.15 * len(together.sheets))


@pytest.mark.slow
@pytest.mark.usefixtures("small")
def test_scarce_sheets_are_never_used_twice(piece_sets):
    pieces = strips(piece_sets, 80)
    stock = [SheetSize(150, 90, 2), SheetSize(120, 80)]
    layout = nest(pieces, stock, effort="quick", **RULES)
    assert check_layout(layout, pieces) == []
    used = Counter(sheet.width_mm for sheet in layout.sheets)
    assert used[150] == 2
    assert used[120] == len(layout.sheets) - 2
    # Just enough: whatever the batches waste, a single one finds its way.
    enough = len(nest(pieces, STOCK, effort="quick", **RULES).sheets)
    scarce = nest(pieces, [SheetSize(120, 80, enough)], effort="quick", **RULES)
    assert check_layout(scarce, pieces) == []
    with pytest.raises(CannotMakeError, match="the sheets run out"):
        nest(pieces, [SheetSize(120, 80, 3)], effort="quick", **RULES)


@pytest.mark.usefixtures("small", "hasty")
def test_ctrl_c_while_batches_get_better_keeps_what_is_complete(piece_sets):
    pieces = strips(piece_sets, 65)
    said = []

    def interrupt(_what, done, _total):
        said.append(done)
        if len(said) > 1 and done < max(said[:-1]):  # all were placed once, and it began anew
            raise KeyboardInterrupt

    layout = nest(pieces, STOCK, effort="normal", progress=interrupt, **RULES)
    assert check_layout(layout, pieces) == []
    assert layout.recorded
    assert len(layout.notes) == 1
