"""Small realistic sheets: wavy strips with holes, ticks and labels."""

import numpy as np
import pytest
from hypothesis import strategies as st

from fabweave.sheet.drawing import Circle, Layer, PieceDrawing, Polyline, SheetDrawing
from fabweave.sheet.labels.lettering import place_text
from fabweave.sheet.sheet_notes import sheet_notes
from fabweave.stock.sheet_size import SheetSize

PITCH_MM = 30.0


def wavy_piece(
    name,
    origin,
    *,
    angle_deg=0.0,
    length=80.0,
    amplitude=4.0,
    width=12.0,
    stations=12,
    holes=3,
    hole_mm=2.4,
):
    """Return a wavy strip along x with its label, ticks, holes and outline, turned and moved."""
    run = np.linspace(0.0, 1.0, stations)
    centre = np.stack([length * run, amplitude * np.sin(7.0 * run)], axis=1)
    half = np.array([0.0, width / 2.0])
    angle = np.deg2rad(angle_deg)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def placed(points):
        return points @ rotation.T + np.asarray(origin)

    at = np.linspace(1, stations - 2, holes).round().astype(int)
    entities = []
    if name.isascii():
        middle = placed(centre[stations // 2 : stations // 2 + 2].mean(axis=0, keepdims=True))[0]
        strokes = place_text(name, 2.5, middle, angle_deg)
        entities += [Polyline(Layer.ENGRAVE_LABEL, stroke) for stroke in strokes]
    for i in at:
        tick = np.array([centre[i] + half * 0.95, centre[i] + half * 0.75])
        entities.append(Polyline(Layer.ENGRAVE_MARK, placed(tick)))
    for x, y in placed(centre[at]).tolist():
        entities.append(Circle(Layer.CUT_INNER, x, y, hole_mm / 2.0))
    outline = np.concatenate([centre - half, (centre + half)[::-1]])
    entities.append(Polyline(Layer.CUT_OUTER, placed(outline), closed=True))
    return PieceDrawing(name, tuple(entities))


def make_sheet(pieces, *, width=220.0, height=160.0, lines=("VASE SHEET 1/2",)):
    """Return a sheet with notes."""
    return SheetDrawing(
        "sheet_01", width, height, tuple(pieces), sheet_notes(SheetSize(width, height), lines).drawn
    )


@pytest.fixture(scope="session")
def make_piece():
    return wavy_piece


@pytest.fixture(scope="session")
def sheet_of():
    return make_sheet


@pytest.fixture(scope="session")
def sheet():
    """Return a sheet with four pieces."""
    return make_sheet(
        wavy_piece(name, (10.0 + 90.0 * (k % 2), 25.0 + 50.0 * (k // 2)), angle_deg=angle)
        for k, (name, angle) in enumerate([("A1", 0.0), ("A2", 10.0), ("B66", -7.5), ("C9", 33.0)])
    )


@pytest.fixture(scope="session")
def sheets():
    """Return a strategy for sheets of up to four pieces with lengths of no round numbers."""

    @st.composite
    def draw_sheet(draw):
        pieces = [
            wavy_piece(
                f"{draw(st.sampled_from('ABCXYZ'))}{k}",
                (draw(st.floats(0.0, 20.0)), 20.0 + 2.0 * PITCH_MM * k),
                angle_deg=draw(st.floats(-180.0, 180.0)),
                length=draw(st.floats(40.0, 90.0)),
                amplitude=draw(st.floats(0.0, 8.0)),
                width=draw(st.floats(8.0, 20.0)),
                stations=draw(st.integers(6, 20)),
                holes=draw(st.integers(0, 3)),
                hole_mm=draw(st.floats(1.0, 5.0)),
            )
            for k in range(draw(st.integers(0, 4)))
        ]
        sides = [draw(st.integers(1000, 30000)) / 100.0 for _ in range(2)]
        return make_sheet(pieces, width=sides[0], height=sides[1])

    return draw_sheet()
