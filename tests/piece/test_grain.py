"""Plywood bends better across the grain of its face: pieces lie so where bends ask for it."""

import numpy as np
import pytest
from jobs import laid, plan_job, stations_of

from fabweave.piece import joined_object
from fabweave.piece.grain import ACROSS, tight_along
from fabweave.stock.material import (
    along_radius_mm,
    laid_across,
    material_library,
    material_named,
    min_bend_radius_mm,
    with_thickness,
)
from fabweave.stock.ribbon_limits import ribbon_limits, thread_limits

pytestmark = pytest.mark.usefixtures("quick_jobs")

MESH = {"refine": "catmull-clark:1", "effort": "quick"}


def chosen(size_mm, material="birch-veneer", **options):
    woven, settings, supplies = laid(
        "shape:cube", **MESH, size_mm=size_mm, material=material, **options
    )
    limits = thread_limits(supplies, woven.bunches)
    tight = tight_along(woven.ribbons, limits)
    return tight, woven, *stations_of(woven, settings).settled


@pytest.mark.parametrize("thickness_mm", [0.5, 0.8, 0.89, 1.5, 2.54, 3.1, 4.0])
def test_strips_across_the_grain_take_the_tables_second_column(thickness_mm):
    # AC 43.13-1B, table 1-2, in inches: at 90 degrees to the face grain, and at 0 or 45.
    thick = np.array([0.035, 0.070, 0.100, 0.125, 0.155]) * 25.4
    worse, better = np.array([[2.0, 5.2, 8.6, 12.0, 16.0], [1.1, 3.2, 5.2, 7.1, 10.0]]) * 25.4
    ply = with_thickness(material_named("birch-veneer"), thickness_mm)
    inside = np.clip(thickness_mm, thick[0], thick[-1])
    for material, table in ((ply, worse), (laid_across(ply), better)):
        wanted = np.interp(inside, thick, table) * thickness_mm / inside
        assert min_bend_radius_mm(material) == pytest.approx(wanted, rel=0.01)


def test_the_bend_about_the_grain_is_the_better_one_of_all_that_has_a_grain():
    grained = [one for one in material_library() if one.across_table_mm]
    assert {one.name for one in grained} == {"birch-veneer", "birch-ply-1.5", "birch-ply-3"}
    for material in grained:
        across = laid_across(material)
        assert min_bend_radius_mm(across) < 0.66 * min_bend_radius_mm(material)
        assert along_radius_mm(across) == min_bend_radius_mm(material)
        # What stretches more at its faces takes more twist, too.
        assert ribbon_limits(across).twist_deg > ribbon_limits(material).twist_deg
    card = material_named("card")
    assert laid_across(card) == card


def test_pieces_lie_across_only_where_bends_ask_for_it():
    small, _, settings, supplies = chosen(130.0)
    assert small.any()
    assert settings.stock.rotations == ACROSS
    assert min_bend_radius_mm(supplies.only) == pytest.approx(25.2, abs=0.05)
    for options in ({"size_mm": 200.0}, {"size_mm": 130.0, "material": "card"}):
        tight, _, settings, _ = chosen(**options)
        assert not tight.any()
        assert settings.stock.rotations == "auto"
    tight, _, settings, supplies = chosen(130.0, rotations="free")
    assert tight.any()
    assert settings.stock.rotations == "free"
    assert min_bend_radius_mm(supplies.only) == pytest.approx(45.8, abs=0.05)


def test_of_two_materials_only_the_one_with_a_grain_counts():
    _, woven, _, supplies = chosen(130.0, material="0=card,1=birch-veneer,2=card,3=card")
    limits = thread_limits(supplies, woven.bunches)
    assert np.array_equal(limits.along_mm > 0, woven.bunches == 1)
    tight = tight_along(woven.ribbons, limits)
    assert not tight[woven.bunches[woven.weave.threads.thread_of_pass] != 1].any()


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0, 10, 25, 40, 45])
def test_bends_that_turn_away_from_the_line_across_are_counted(tolerance):
    _, woven, settings, _supplies = chosen(130.0, rotations=f"across:{tolerance}deg", force=True)
    planned = plan_job(woven, settings)
    found = [one for one in planned.check.findings if one.rule == "grain"]
    tight = tight_along(planned.woven.ribbons, planned.check.limits)
    # By hand: the chord between two stations against the piece's length, and the tolerance on top.
    wrong, threads = 0, planned.woven.weave.threads
    for piece, first in zip(
        planned.piece_set.pieces, planned.split_plan.runs.first.tolist(), strict=True
    ):
        begin, count = threads.offsets[piece.thread], threads.lengths[piece.thread]
        for at, (x, y) in enumerate(np.diff(piece.points, axis=0).tolist()):
            slant = np.degrees(np.arccos(abs(x) / np.hypot(x, y)))
            wrong += bool(tight[begin + (first + at) % count] and slant + tolerance > 45.0)
    assert sum(one.count for one in found) == wrong
    assert all(one.of == tight.sum() for one in found)
    assert bool(found) == (tolerance >= 25)


def test_what_is_asked_for_room_lies_as_the_pieces_do(monkeypatch):
    """Where pieces may hardly turn, it matters how they lie on their shape."""
    asked = []

    def placed(outlines, *_):
        asked.extend(outlines)
        return np.ones(len(outlines), dtype=np.bool_)

    monkeypatch.setattr(joined_object, "outlines_with_place", placed)
    woven, settings, _supplies = laid(
        "shape:hypar?n=6", size_mm=300.0, rotations="grain:10deg", force=True
    )
    planned = plan_job(woven, settings)
    pieces = planned.piece_set.pieces
    for outline, piece in zip(asked[-len(pieces) :], pieces, strict=True):
        # It may be turned by half a turn.
        assert np.ptp(outline, axis=0) == pytest.approx(np.ptp(piece.outline, axis=0), abs=1e-6)
