"""Micro-joints leave bridges of the width asked for, and nothing else changes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.arc_path import Path, stretch
from fabweave.sheet.drawing import (
    Circle,
    Layer,
    PieceDrawing,
    Polyline,
    SheetDrawing,
    check_drawing,
)
from fabweave.sheet.kerf import MicroJoints, bridged, kerf_notes, kerfed_sheets, parse_micro_joints


def sheet(*entities):
    return SheetDrawing("sheet_01", 900.0, 900.0, (PieceDrawing("A1", entities),), ())


def length(run):
    chords = np.hypot(*np.diff(run.points, axis=0).T)
    bulges = np.zeros(len(chords)) if run.bulges is None else run.bulges[:-1]
    return float(np.sum(chords * stretch(bulges)))


@st.composite
def outlines(draw):
    """Return a closed outline of sides and arcs about the middle of the sheet."""
    n = draw(st.integers(3, 30))
    radii = np.array(draw(st.lists(st.floats(40.0, 300.0), min_size=n, max_size=n)))
    bulges = np.array(draw(st.lists(st.floats(-0.2, 0.3), min_size=n, max_size=n)))
    angles = 2.0 * np.pi * np.arange(n) / n
    points = 450.0 + radii[:, None] * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    bulges[np.abs(bulges) < 1e-3] = 0.0
    return Polyline(Layer.CUT_OUTER, points, closed=True, bulges=bulges)


@given(outlines(), st.integers(1, 12), st.floats(0.1, 1.0), st.sampled_from([0.0, 0.2]))
def test_runs_and_bridges_make_the_outline(outline, count, width, kerf):
    drawing = sheet(outline)
    opened = bridged(drawing, MicroJoints(count, width), kerf_mm=kerf)
    check_drawing(opened)
    runs = opened.pieces[0].entities
    if len(runs) == 1 and runs[0].closed:
        assert runs[0] is outline
        return
    assert 1 <= len(runs) <= count
    assert not any(run.closed for run in runs)
    gaps = [
        np.hypot(*(after.points[0] - run.points[-1]))
        for run, after in zip(runs, [*runs[1:], *runs[:1]], strict=True)
    ]
    # Over a gap an arc stands off by a hundredth at most: the chord is as long as the arc.
    assert gaps == pytest.approx([width + kerf] * len(gaps), abs=1e-3)
    whole = Path(outline.points, outline.bulges).length
    assert sum(map(length, runs)) == pytest.approx(whole - len(runs) * (width + kerf), rel=1e-9)
    # Every corner of the outline is on a run still.
    corners = {tuple(point) for run in runs for point in run.points.round(9).tolist()}
    assert {tuple(point) for point in outline.points.round(9).tolist()} <= corners


def test_equal_sides_get_equal_shares():
    corners = np.array([[0.0, 0], [100, 0], [100, 100], [0, 100]])
    runs = bridged(sheet(Polyline(Layer.CUT_OUTER, corners, True)), MicroJoints(4)).pieces[0]
    assert [length(run) for run in runs.entities] == pytest.approx([99.75] * 4)


def test_short_outlines_have_fewer_and_crooked_ones_none():
    small = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [10, 0], [10, 6], [0, 6]]), True)
    assert len(bridged(sheet(small), MicroJoints(9)).pieces[0].entities) == 2
    turns = np.linspace(0.0, 2.0 * np.pi, 41)[:-1]
    crooked = Polyline(
        Layer.CUT_OUTER, 2.0 + np.stack((np.cos(turns), np.sin(turns)), axis=1), True
    )
    ready = kerfed_sheets([sheet(crooked)], 0.0, MicroJoints(4))
    assert ready[0].pieces[0].entities == (crooked,)
    assert "1 piece has no micro-joints" in kerf_notes(ready, 0.0, MicroJoints(4))[1]


def test_holes_are_cut_through():
    hole = Circle(Layer.CUT_INNER, 5.0, 5.0, 1.0)
    outline = Polyline(Layer.CUT_OUTER, np.array([[0.0, 0], [90, 0], [90, 60], [0, 60]]), True)
    first, *runs = bridged(sheet(hole, outline), MicroJoints(3)).pieces[0].entities
    assert first is hole
    assert len(runs) == 3


@given(st.integers(1, 50), st.integers(10, 500))
def test_the_text_comes_back(count, hundredths):
    wanted = MicroJoints(count, hundredths / 100.0)
    assert parse_micro_joints(str(wanted)) == wanted
