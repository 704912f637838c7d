"""A grade is 10 where strips are even, smooth and broad, and each rule takes what it states."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.arc_path import straight_path
from fabweave.core.finding import Finding
from fabweave.form.settle import Form
from fabweave.mesh.likeness import likeness
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.piece.piece import Piece
from fabweave.plan.grade import BEST, grade, station_turns, station_widths
from fabweave.plan.verdict import Verdict

GOOD = Verdict(level="makeable", reasons=())


def piece(name="A1", turns_deg=(0.0,) * 6, widths=(10.0,) * 7):
    """Return a strip that turns so from crossing to crossing and is so wide there."""
    heading = np.radians(np.concatenate([[0.0], np.cumsum(turns_deg)]))
    ways = np.column_stack([np.cos(heading), np.sin(heading)])
    points = np.cumsum(20.0 * ways, axis=0)
    across = np.column_stack([-ways[:, 1], ways[:, 0]]) * np.array(widths)[:, None] / 2
    rails = np.stack([points - across, points + across], axis=1)
    outline = np.concatenate([rails[:, 0], rails[::-1, 1]])
    count = len(points)
    return Piece(
        id=name, thread=0, path=straight_path(outline), outline=outline,
        crossings=np.arange(count), points=points, directions=ways, rails=rails,
        over=np.zeros(count, dtype=bool), hole_mm=np.full(count, np.nan),
        start_joint=None, end_joint=None,
    )  # fmt: skip


@given(st.floats(-14.0, 14.0))
def test_straight_strips_and_arcs_of_one_width_have_the_best_grade(turn):
    strip = piece(turns_deg=(turn,) * 6)
    assert station_turns(strip) == pytest.approx(turn, abs=1e-9)
    assert station_widths(strip) == pytest.approx(10.0)
    found = grade([strip], GOOD)
    assert (found.score, found.lost, found.worst) == (BEST, (), ())


@given(st.floats(0.0, 12.0))
def test_a_wavy_strip_loses_what_its_turns_change_by(turn):
    """Turns of +t, -t, ... change by 2t at each inner crossing."""
    strip = piece(turns_deg=(turn, -turn) * 3)
    assert station_turns(strip) == pytest.approx([turn, -turn] * 3, abs=1e-9)
    lost = sum(one.points for one in grade([strip] * 1000, GOOD).lost)
    assert lost == pytest.approx(min(max(2 * turn - 5, 0) / 5, 2), abs=0.06)


def test_the_corners_of_a_rim_are_meant():
    """A strip that turns back by 98 degrees at two crossings is as smooth as one that goes on."""
    strip = piece(turns_deg=(0.0, 98.0, 0.0, 0.0, -98.0, 0.0))
    meant = replace(strip, rim_turns=np.array([1, 4]))
    assert [one.rule for one in grade([strip], GOOD).lost] == ["smooth"]
    assert (grade([meant], GOOD).score, grade([meant], GOOD).worst) == (BEST, ())


@given(st.floats(0.0, 1.0))
def test_a_patched_weave_loses_for_what_its_surface_does_not_need(share):
    lost = sum(one.points for one in grade([piece()], GOOD, irregular=share).lost)
    assert lost == pytest.approx(min(max(share - 0.04, 0.0) / 0.05, 4.0), abs=0.06)


def test_each_rule_takes_points_and_names_the_place():
    uneven = grade([piece(widths=(12.0,) * 6 + (8.0,))], GOOD)
    assert [one.rule for one in uneven.lost] == ["even"]
    assert uneven.lost[0].points == pytest.approx((12 / 8 - 1.15) / 0.25, abs=0.01)
    thin = grade([piece(), piece("B1", widths=(3.0,) * 7)], GOOD)
    assert [one.rule for one in thin.lost] == ["narrow"]
    assert [(one.piece, one.crossing) for one in thin.worst] == [("B1", 0)]
    kinked = grade([piece("C1", turns_deg=(0, 0, 40.0, 0, 0, 0))], GOOD)
    assert [(one.piece, one.crossing) for one in kinked.worst] == [("C1", 2)]
    care = Finding(rule="narrow", level="with care", text="so")
    assert grade([piece()], Verdict(level="with care", reasons=(care,))).score == BEST - 1
    stop = replace(care, level="not makeable")
    assert grade([piece()], Verdict(level="not makeable", reasons=(stop,))).score == 0.0


@given(st.floats(0.0, 12.0))
def test_a_narrow_strip_loses_by_how_far_it_is_from_tweezers(width):
    """Nothing at six millimetres, all at four, and half of that between."""
    lost = sum(one.points for one in grade([piece(widths=(width + 1e-9,) * 7)] * 9, GOOD).lost)
    assert lost == pytest.approx(min(max((6.0 - width) / 2.0, 0.0) * 10.0, 4.0), abs=0.06)


@pytest.mark.parametrize(("height", "points"), [(1.0, 0.0), (3.0, 0.0), (8.0, 0.5), (20.0, 1.0)])
def test_a_limb_that_is_cut_short_takes_up_to_a_point(height, points):
    """A ball of 200 mm with a spike lacks it where it is woven as a ball."""
    ball = parse_shape("shape:sphere?n=16&radius=100")
    spiked = ball.vertices.copy()
    spiked[np.argmax(spiked[:, 2])] *= 1.0 + height / 100.0
    like = likeness(ball.with_vertices(spiked), ball)
    found = {one.rule: one.points for one in grade([piece()], GOOD, like).lost}
    assert found.get("limbs", 0.0) == pytest.approx(points, abs=0.12)


@given(st.lists(st.floats(0.0, 30.0), min_size=2, max_size=6))
def test_what_sags_farther_has_no_better_grade(sags):
    form = Form(off_mm=1.0, off_mean_mm=0.5, off_where="top",
                settles_mm=1.0, mean_mm=0.5, where="top", bound_mm=3.0, size_mm=300.0, sags_mm=0.1,
                loose=0, pushed_mm=2.0, gives_mm_n=1.0, soft="top", apart=0, apart_n=0.0,
                strain=0.2, settled=True, air_mm=None, bodies=None)  # fmt: skip
    scores = [
        grade([piece()], GOOD, None, replace(form, sags_mm=sag)).score for sag in sorted(sags)
    ]
    assert scores == sorted(scores, reverse=True)
    assert (scores[0] == BEST) == (min(sags) <= 3.14)
    loaded = grade([piece()], GOOD, None, replace(form, loaded_mm=max(sags))).score
    assert loaded == scores[-1]
