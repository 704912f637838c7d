"""Everything engraved lies inside its piece, off its edge, its holes and other letters."""

import itertools

import numpy as np
import pytest
import shapely

from fabweave.cut.marks import CLEAR_MM, ID_HEIGHTS_MM, WORD_SPACE_MM, Marks, mark_piece
from fabweave.flat.path import straight_path
from fabweave.flat.piece import Piece


def strip(
    *, stations: int = 5, pitch: float = 20.0, width: float = 12.0, hole: float = np.nan
) -> Piece:
    """A straight piece along x with evenly spaced crossings, joints 6 and 9 at its ends."""
    points = np.column_stack(
        (pitch / 2 + pitch * np.arange(stations), np.full(stations, width / 2))
    )
    half = np.array([0.0, width / 2])
    outline = np.array([[0.0, 0], [pitch * stations, 0], [pitch * stations, width], [0, width]])
    return Piece(
        id="A6",
        thread=0,
        path=straight_path(outline),
        outline=outline,
        crossings=np.arange(stations),
        points=points,
        directions=np.tile([1.0, 0.0], (stations, 1)),
        rails=np.stack((points - half, points + half), axis=1),
        over=np.arange(stations) % 2 == 1,
        hole_mm=np.full(stations, hole),
        start_joint=6,
        end_joint=9,
    )


def arc(*, radius: float, width: float, hole: float = np.nan) -> Piece:
    """A quarter ring, crossed at five places."""
    angle = np.linspace(np.pi, np.pi / 2, 41)
    circle = np.column_stack((np.cos(angle), np.sin(angle)))
    inner, outer = (radius - width / 2) * circle, (radius + width / 2) * circle
    at = np.arange(4, 41, 8)
    points = radius * circle[at]
    directions = np.column_stack((circle[at, 1], -circle[at, 0]))
    outline = np.concatenate((inner, outer[::-1]))
    return Piece(
        id="BC12",
        thread=1,
        path=straight_path(outline),
        outline=outline,
        crossings=np.arange(5),
        points=points,
        directions=directions,
        rails=np.stack((inner[at], outer[at]), axis=1),
        over=np.arange(5) % 2 == 0,
        hole_mm=np.full(5, hole),
        start_joint=None,
        end_joint=123,
    )


PIECES = [
    strip(),
    strip(hole=2.5),
    strip(width=4.5, hole=1.0, pitch=10.0),
    strip(width=2.0, pitch=8.0),
    arc(radius=60.0, width=12.0, hole=3.3),
    arc(radius=60.0, width=5.0),
]


def marked(piece: Piece) -> Marks:
    return mark_piece(piece, [f"C{k}" for k in range(len(piece.crossings))])


def label_lines(marks: Marks) -> list[shapely.MultiLineString]:
    return [shapely.MultiLineString(list(label.strokes)) for label in marks.labels]


@pytest.mark.parametrize("piece", PIECES)
def test_letters_keep_clear_of_edge_holes_ticks_and_each_other(piece):
    marks = marked(piece)
    ring = shapely.LinearRing(piece.outline)
    polygon = shapely.Polygon(piece.outline)
    drilled = ~np.isnan(piece.hole_mm)
    holes = shapely.buffer(shapely.points(piece.points[drilled]), piece.hole_mm[drilled] / 2)
    ticks = [shapely.LineString(tick) for tick in marks.ticks]
    lines = label_lines(marks)
    for number, line in enumerate(lines):
        assert polygon.contains(line)
        for thing in [ring, *holes, *ticks, *lines[:number]]:
            # Three sample points stand for a tick, which may take a little off the clearance.
            assert shapely.distance(line, thing) >= CLEAR_MM - 0.05


@pytest.mark.parametrize("piece", PIECES)
def test_every_label_is_placed_or_reported(piece):
    marks = marked(piece)
    told = sorted([(label.kind, label.text) for label in marks.labels] + list(marks.dropped))
    joints = [f"#{joint}" for joint in (piece.start_joint, piece.end_joint) if joint is not None]
    partners = [f"C{k}" for k in range(len(piece.crossings))]
    assert told == sorted(
        [("id", piece.id)]
        + [("joint", text) for text in joints]
        + [("partner", text) for text in partners]
    )


@pytest.mark.parametrize("piece", PIECES[:2] + PIECES[4:5])
def test_a_wide_ribbon_carries_everything(piece):
    marks = marked(piece)
    assert not marks.dropped
    heights = {label.text: label.height_mm for label in marks.labels}
    assert heights.pop(piece.id) == ID_HEIGHTS_MM[0]
    assert min(heights.values()) >= 2.0


@pytest.mark.parametrize("piece", PIECES[:4])
def test_labels_in_one_line_are_a_space_apart(piece):
    # These pieces lie along x: labels that share a height must not read as one.
    boxes = [line.bounds for line in label_lines(marked(piece))]
    for a, b in itertools.combinations(boxes, 2):
        if a[1] < b[3] and b[1] < a[3]:
            assert max(a[0], b[0]) - min(a[2], b[2]) >= WORD_SPACE_MM - 1e-9


def test_labels_stand_beside_their_station():
    piece = strip(hole=2.5)
    for label in marked(piece).labels:
        if label.kind != "partner":
            continue
        station = int(label.text[1:])
        x, _ = np.concatenate(label.strokes).mean(axis=0)
        assert np.argmin(np.abs(piece.points[:, 0] - x)) == station


def test_letters_read_along_the_thread():
    # In "A6" the A comes first: its strokes lie before those of the 6 along the direction.
    piece = strip()
    label = next(label for label in marked(piece).labels if label.kind == "id")
    assert label.strokes[0][:, 0].max() < label.strokes[-1][:, 0].max()
    # Upright: the A's apex is its highest point, away from the right edge at y = 0.
    assert np.concatenate(label.strokes)[:, 1].max() > piece.points[0, 1]


@pytest.mark.parametrize("piece", PIECES)
def test_ticks_tell_over_from_under_and_lie_inside(piece):
    marks = marked(piece)
    polygon = shapely.Polygon(piece.outline).buffer(-CLEAR_MM + 0.02)
    assert all(polygon.covers(shapely.LineString(tick)) for tick in marks.ticks)
    nearest = [
        int(np.argmin(np.hypot(*(piece.points - tick.mean(axis=0)).T))) for tick in marks.ticks
    ]
    counts = np.bincount(nearest, minlength=len(piece.crossings))
    assert np.array_equal(counts, np.where(piece.over, 2, 4))


def test_nothing_fits_a_hair():
    marks = marked(strip(width=1.2, pitch=8.0))
    assert marks.labels == ()
    assert marks.ticks == ()
    assert len(marks.dropped) == 8
