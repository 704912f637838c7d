"""Everything engraved lies inside its piece, off its edge, its holes and other letters."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely

from fabweave.core.arc_path import straight_path
from fabweave.piece.piece import Piece
from fabweave.sheet.labels.marks import (
    CLEAR_MM,
    COVER_MM,
    WORD_SPACE_MM,
    Marks,
    covers_of,
    mark_pieces,
    seen_mm,
    ticks_of,
)
from fabweave.sheet.labels.texts import (
    ARROW,
    LOW_ID_HEIGHTS_MM,
    OVER_SIGN,
    TEXT_HEIGHTS_MM,
    UNDER_SIGN,
    id_stations,
    told_stations,
)


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


def crossed(piece: Piece) -> list[Piece]:
    """The piece with its mates A7 and A5, and the piece C1 that crosses it everywhere."""
    count = len(piece.crossings)
    mates = [
        replace(strip(), id=name, crossings=piece.crossings[[at]], points=np.array([[10.0, 6.0]]),
                directions=np.array([[1.0, 0.0]]), rails=np.array([[[10.0, 0.0], [10.0, 12.0]]]),
                over=piece.over[[at]], hole_mm=piece.hole_mm[[at]], start_joint=joints[0],
                end_joint=joints[1], outline=np.array([[0.0, 0], [20, 0], [20, 12], [0, 12]]))
        for name, at, joints in (
            ("A5", 0, (None, piece.start_joint)), ("A7", -1, (piece.end_joint, None))
        )
        if any(joint is not None for joint in joints)
    ]  # fmt: skip
    other = replace(strip(stations=count), id="C1", crossings=piece.crossings, over=~piece.over)
    other = replace(other, start_joint=None, end_joint=None)
    return [piece, *mates, other]


def marked(piece: Piece, **options: str) -> Marks:
    return mark_pieces(crossed(piece), len(piece.crossings), **options)[0]


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
        for woven in [ring, *holes, *ticks, *lines[:number]]:
            # Three sample points stand for a tick, which may take a little off the clearance.
            assert shapely.distance(line, woven) >= CLEAR_MM - 0.05


@pytest.mark.parametrize("piece", PIECES)
def test_everything_is_told_once_or_reported(piece):
    marks = marked(piece)
    told = [(kind, label.station) for label in marks.labels for kind in label.kinds]
    told += [(missing.kind, missing.station) for missing in marks.dropped]
    last = len(piece.crossings) - 1
    ends = [at for at, joint in ((0, piece.start_joint), (last, piece.end_joint)) if joint]
    wanted = [("id", None), ("arrow", None)]
    wanted += [(kind, at) for kind in ("joint", "mate") for at in ends]
    wanted += [(kind, at) for kind in ("partner", "sign") for at in range(last + 1)]
    assert sorted(told, key=str) == sorted(wanted, key=str)


def test_what_labels_say():
    piece = strip()
    texts = {(label.kinds[0], label.station): label.text for label in marked(piece).labels}
    assert texts.pop(("id", None)) == f"A6{ARROW}"
    assert texts.pop(("joint", 0)) == "#6>A5"
    assert texts.pop(("joint", 4)) == "#9>A7"
    assert texts == {("partner", k): f"{OVER_SIGN if k % 2 else UNDER_SIGN}C1" for k in range(5)}


def test_a_crowded_piece_shortens_labels_then_drops_the_least_important():
    tight = strip(pitch=7.5, width=5.0, hole=1.0)
    marks = marked(tight)
    dropped = {missing.kind for missing in marks.dropped}
    assert {"sign", "partner"} & dropped
    assert not {"id", "arrow", "joint"} & dropped
    assert {label.text for label in marks.labels} >= {"#6", "#9"}


@pytest.mark.parametrize("piece", PIECES)
def test_nothing_is_too_low_to_read(piece):
    least = {"id": min(LOW_ID_HEIGHTS_MM)}
    assert least["id"] == 1.2
    for label in marked(piece).labels:
        assert label.height_mm >= least.get(label.kinds[0], min(TEXT_HEIGHTS_MM))


@pytest.mark.parametrize("width", [6.0, 9.0, 14.0])
def test_for_a_school_no_letter_but_an_id_is_lower_than_asked(width):
    piece = strip(width=width)
    low, high = (
        mark_pieces(crossed(piece), len(piece.crossings), "full", least_mm=least)[0]
        for least in (0.0, 3.0)
    )
    assert min(label.height_mm for label in low.labels if "id" not in label.kinds) < 3.0
    heights = [label.height_mm for label in high.labels if "id" not in label.kinds]
    assert min(heights, default=3.0) >= 3.0
    # What finds no room is reported, never forgotten: the id stands even so.
    assert any("id" in label.kinds for label in high.labels)
    assert len(high.dropped) >= len(low.dropped)


def test_numbers_are_ids_alone_and_none_is_nothing():
    bare = marked(strip(hole=2.5), labels="numbers")
    assert [label.text for label in bare.labels] == ["A6"]
    assert bare.ticks == ()
    assert bare.dropped == ()
    # Without holes there is nothing else to align the joints by.
    guided = replace(strip(), guides=(np.array([[9.0, 6.0], [11.0, 6.0]]),))
    assert len(marked(guided, labels="numbers").ticks) == 1
    none = marked(strip(), labels="none")
    assert (none.labels, none.ticks, none.dropped) == ((), (), ())


def test_on_the_inside_letters_are_mirrored_about_their_line():
    outer, inner = (marked(PIECES[4], side=side).labels for side in ("outside", "inside"))
    for one, other in zip(outer, inner, strict=True):
        assert (one.text, one.rotation_deg) == (other.text, other.rotation_deg)
        np.testing.assert_array_equal(one.centre, other.centre)
        along = np.exp(1j * np.deg2rad(one.rotation_deg))
        for line, mirrored in zip(one.strokes, other.strokes, strict=True):
            flat, back = ((run - one.centre) @ [1, 1j] / along for run in (line, mirrored))
            np.testing.assert_allclose(back, flat.conj(), atol=1e-9)


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
        if label.station is not None:
            assert np.argmin(np.abs(piece.points[:, 0] - label.centre[0])) == label.station


# --- hidden -------------------------------------------------------------------------------------


def covered(piece: Piece, size: float) -> Piece:
    """The piece with squares over the stations where it goes under, as along as they are wide."""
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * size / 2
    return replace(piece, covers=tuple(point + square for point in piece.points[~piece.over]))


@pytest.mark.parametrize("piece", [strip(), strip(hole=2.5), strip(stations=9, pitch=14.0)])
def test_hidden_letters_stand_inside_what_covers_them(piece):
    piece = covered(piece, 12.0)
    marks = marked(piece, labels="hidden")
    covers = shapely.union_all([shapely.Polygon(cover) for cover in piece.covers])
    assert marks.labels
    assert not marks.seen
    for line in label_lines(marks):
        assert shapely.contains(shapely.buffer(covers, -COVER_MM, join_style="mitre"), line)
    assert seen_mm([piece], [marks]) == 0.0
    assert {label.height_mm for label in marks.labels if label.kinds[0] != "id"} <= set(
        TEXT_HEIGHTS_MM
    )
    assert all(OVER_SIGN not in label.text for label in marks.labels)


def test_an_id_without_a_cover_is_small_and_in_sight_and_told():
    piece = covered(strip(), 2.0)
    marks = marked(piece, labels="hidden")
    (label,) = marks.labels
    assert (label.text, label.kinds, label.hidden) == ("A6", ("id",), False)
    assert label.height_mm == 2.0
    assert "id" not in {missing.kind for missing in marks.dropped}
    ink = shapely.MultiLineString(list(label.strokes))
    covers = shapely.union_all([shapely.Polygon(cover) for cover in piece.covers])
    assert seen_mm([piece], [marks]) == pytest.approx(ink.difference(covers).length)


def test_a_cover_that_runs_through_itself_by_a_rounding_still_hides():
    # Such a cover killed a random job (seed 50220): no union of it could be found.
    piece = covered(strip(), 12.0)
    first, *others = piece.covers
    hair = first[-1] + np.array([[0.0, 1e-9], [1e-9, -1e-9], [-1e-9, 0.0]])
    piece = replace(piece, covers=(np.concatenate([first, hair]), *others))
    assert not shapely.Polygon(piece.covers[0]).is_valid
    assert all(cover.is_valid for cover in covers_of(piece))
    shown, smooth = (marked(one, labels="hidden") for one in (piece, covered(strip(), 12.0)))
    assert [one.text for one in shown.labels] == [one.text for one in smooth.labels]
    assert seen_mm([piece], [shown]) == 0.0


def test_hidden_names_stand_at_every_crossing_and_brief_ones_at_every_third():
    piece = strip(stations=11)
    assert told_stations(piece, "full") == list(range(11))
    assert told_stations(piece, "brief") == [0, 3, 6, 9, 10]
    # Those at which it goes under are 0, 2, 4, 6, 8, 10.
    assert told_stations(piece, "hidden") == [0, 2, 4, 6, 8, 10]
    told = {label.station for label in marked(piece, labels="brief").labels} - {None}
    assert told == {0, 3, 6, 9, 10}


def test_a_long_piece_bears_its_id_at_both_ends_and_every_100_mm():
    piece = strip(stations=15)  # 280 mm from its first station to its last
    for labels in ("full", "brief", "hidden"):
        own = covered(piece, 12.0)
        ids = sorted(
            label.station
            for label in marked(own, labels=labels).labels
            if label.kinds == ("id",) and label.station is not None
        )
        assert (ids[0], ids[-1]) == (0, 14)
        assert max(np.diff(ids)) * 20.0 <= 120.0  # the stations are 20 mm apart
    assert id_stations(strip(), range(5)) == []


def test_the_step_stands_beside_the_id():
    marks = mark_pieces([strip()], 5, "full", steps={"A6": 17})[0]
    first = marks.labels[0]
    assert (first.text, first.kinds) == (f"A6{ARROW} (17)", ("id", "arrow", "step"))
    assert {missing.kind for missing in marks.dropped}.isdisjoint({"id", "arrow", "step"})
    # Where there is no room beside it, it stands by itself.
    narrow = mark_pieces([strip(width=4.0, pitch=11.0)], 5, "full", steps={"A6": 17})[0]
    assert any("step" in label.kinds for label in narrow.labels)


@pytest.mark.parametrize("width", [3.0, 6.0, 12.0, 40.0])
def test_a_crossing_without_a_hole_has_a_tick_at_both_edges_of_its_lower_strand(width):
    piece = strip(width=width)
    room = shapely.Polygon(piece.outline).buffer(-0.2, join_style="mitre")
    ticks = ticks_of(piece, room)
    assert list(ticks) == [0, 2, 4]  # where it goes under, in the middle of each 20 mm
    lines = np.array(list(ticks.values()))
    assert lines[:, :, :, 0].tolist() == [[[x, x]] * 2 for x in (10.0, 50.0, 90.0)]
    right, left = lines[:, 0, :, 1], lines[:, 1, :, 1]
    np.testing.assert_allclose(right + left, width)
    assert np.all(right < width / 2)
    assert np.all(np.diff(right) <= 2.0 + 1e-9)
    assert np.all((lines[:, :, :, 1] >= 0.2) & (lines[:, :, :, 1] <= width - 0.2))
    assert ticks_of(strip(width=width, hole=2.5), room) == {}
    # Where something covers less of it, they are nearer; what does not cover the crossing is none.
    half = room & shapely.box(0.0, 0.25 * width, 40.0, width)
    assert ticks_of(piece, half)[0][:, :, 1].min() == pytest.approx(0.25 * width)
    assert list(ticks_of(piece, half)) == [0]


def test_lines_that_are_not_covered_are_left_out_if_marks_are_to_be_hidden():
    cross, far = (np.array([[x - 1.0, 6.0], [x + 1.0, 6.0]]) for x in (10.0, 20.0))
    piece = covered(replace(strip(), guides=(cross, far)), 12.0)
    # Two ticks at the crossing between its joints, which have guides.
    assert [len(marked(piece, labels=labels).ticks) for labels in ("brief", "hidden")] == [4, 3]
    assert marked(piece, labels="hidden").ticked == (2,)
    bare = marked(covered(piece, 8.0), labels="hidden")
    assert (len(bare.ticks), bare.ticked) == (3, (2,))
