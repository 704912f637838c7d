"""Straight strips are cut so that they fill rows, and never to more waste than before."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import laid

from fabweave.job.ask import brief_of
from fabweave.nest.strips import fill_rows, row_rests
from fabweave.piece import joined_strands
from fabweave.piece.development import unfold_runs
from fabweave.piece.joined_strands import object_repeats, plan_pieces
from fabweave.piece.outline import strip_outlines
from fabweave.piece.split.row_filling import climb
from fabweave.stock.sheet_size import SheetSize, parse_roll, usable_size

ROW_MM = 100.0


@given(st.lists(st.integers(1, 100), min_size=1, max_size=30))
def test_waste_is_less_than_what_rows_have_free_and_none_if_they_are_full(lengths) -> None:
    strips = [float(length) for length in lengths]
    free = ROW_MM * len(fill_rows(strips, ROW_MM)) - sum(lengths)
    assert -1e-9 <= row_rests(strips, ROW_MM) <= free + 1e-9
    assert row_rests([ROW_MM] * len(strips), ROW_MM) == 0.0
    # Nearer to full rows, less is wasted by two strips that share one.
    low, high = sorted([strips[0], ROW_MM / 2])
    assert row_rests([low, ROW_MM - low], ROW_MM) <= row_rests([high], ROW_MM) + 1e-9


@given(st.lists(st.floats(0.0, 9.0), min_size=6, max_size=6), st.booleans())
def test_a_climb_ends_no_higher_than_it_began_and_on_ways_to_cut(prices, closed) -> None:
    seen = []

    def worth(cut, _limit: float) -> float:
        seen.append(cut)
        return sum(prices[site] for site in cut.tolist()) + 20.0 * abs(len(cut) - 2)

    end = climb(np.array([0, 3]), 6, worth, closed=closed)
    assert worth(end, np.inf) <= worth(np.array([0, 3]), np.inf)
    for cut in seen:
        assert len(cut)
        assert (np.diff(cut) > 0).all()
        assert closed or (cut[0] == 0 and cut[-1] < 5)
    # Where each cut has its own price, one change after another finds the best of all.
    ways = [cut for cut in combinations(range(6 if closed else 5), 2) if closed or cut[0] == 0]
    least = min(sum(prices[site] for site in cut) for cut in ways)
    end = climb(end, 6, worth, closed=closed)
    assert worth(end, np.inf) == pytest.approx(least, abs=0.01)


@pytest.fixture(scope="module")
def ball():
    return laid(
        "shape:icosahedron", refine="loop:1", pattern="kagome", strips="straight", size_mm=200.0,
        force=True,
    )  # fmt: skip


@pytest.mark.parametrize("alike", [True, False])
@pytest.mark.parametrize("length_mm", [None, 150.0])
def test_a_ball_wastes_no_more_of_rows_than_cut_without_a_thought_for_them(
    ball, alike, length_mm, monkeypatch
) -> None:
    woven, settings, supplies = ball
    brief = brief_of(settings.but(max_length_mm=length_mm), supplies)
    repeats = object_repeats(woven, brief.pieces, supplies) if alike else None

    def lengths():
        plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, brief, repeats=repeats)
        outlines = strip_outlines(unfold_runs(woven.ribbons, plan.runs))
        return [float(np.ptp(outline[:, 0])) for outline in outlines]

    filled = lengths()
    monkeypatch.setattr(joined_strands, "strip_rests", lambda *_: None)
    plain = lengths()
    row_mm = max(usable_size(supplies.sheets[0], supplies.margin_mm))
    assert max(filled) <= (length_mm or row_mm)
    assert len(fill_rows(filled, row_mm)) <= len(fill_rows(plain, row_mm))
    assert len(filled) <= 1.4 * len(plain)


def test_no_strip_lies_askew_on_a_sheet_that_is_longer_that_way(ball) -> None:
    woven, settings, supplies = ball
    stock = (SheetSize(320.0, 320.0),)
    each = tuple(replace(supply, sheets=stock) for supply in supplies.each)
    brief = brief_of(settings, replace(supplies, sheets=stock, each=each))
    plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, brief)
    outlines = strip_outlines(unfold_runs(woven.ribbons, plan.runs))
    assert max(float(np.ptp(outline[:, 0])) for outline in outlines) <= 300.0 + 1e-6


def test_rolls_have_no_rows_to_fill(ball, monkeypatch) -> None:
    woven, settings, supplies = ball
    roll = (parse_roll("roll:9mm:50m"),)
    rolls = replace(
        supplies, sheets=roll, each=tuple(replace(e, sheets=roll) for e in supplies.each)
    )
    monkeypatch.delattr(joined_strands, "strip_rests")
    plan = plan_pieces(woven.ribbons, woven.weave, woven.labels, brief_of(settings, rolls))
    assert len(plan.runs.thread)
