"""Story sticks are true to size, on whatever paper, as a stranger's reader measures them."""

import io
import itertools

import numpy as np
import pytest
from crossing_maps import piece_record, small_map, station_record
from hypothesis import given
from hypothesis import strategies as st
from jobs import OCTAHEDRON, STRAIGHT
from read_sticks import MM, joined, read_pages, read_tapes

from fabweave.plan.crossing_map import JointRecord, read_crossing_map
from fabweave.show.sticks import LAP_MM, lengths, sticks_pdf

PAPERS = {"a4": (297.0, 210.0), "letter": (279.4, 215.9), "a3": (420.0, 297.0)}
HEIGHT_MM = 9.0


def strip(name, kind, places, length_mm, *, turned=False, joint=None, hole=2.5):
    """Return a straight piece, away from the origin, with a hole at each third station."""
    low = np.array([13.0, -4.0])
    corners = np.array([[0, 0], [length_mm, 0], [length_mm, HEIGHT_MM], [0, HEIGHT_MM]]) + low
    over = [at % 2 == 0 for at in range(len(places))]
    holes = [hole if at % 3 == 0 else None for at in range(len(places))]
    where = np.column_stack((places, np.full(len(places), HEIGHT_MM / 2))) + low
    rows = list(zip(over, holes, where.tolist(), strict=True))
    if turned:
        turn = corners.min(axis=0) + corners.max(axis=0)
        rows = [(up, wide, (turn - spot).tolist()) for up, wide, spot in rows[::-1]]
    last = len(places) - 1
    return piece_record(
        name, corners.tolist(), kind=kind, turned=turned or None, joints=(None, joint),
        stations=tuple(
            station_record(at, over=up, partner=f"P{at}{name}", x=x, y=y, hole_mm=wide,
                           joint=joint if at == last else None)
            for at, (up, wide, (x, y)) in enumerate(rows)
        ),
    )  # fmt: skip


def map_of(*pieces, **parts):
    joint = JointRecord(
        id=7, pieces=("A1", "J9"), crossing=0, kind="glue", holes=(), hole_mm=None, lap_mm=9.0,
        grip_mm=None,
    )  # fmt: skip
    return small_map(pieces=pieces, joints=[joint], **parts)


def uneven(length_mm, count, seed=3):
    """Return places of marks that are nowhere even, so that no two can be taken for each other."""
    steps = np.random.default_rng(seed).uniform(0.4, 1.6, count + 1)
    return (length_mm * np.cumsum(steps) / steps.sum())[:-1]


def pages_of(plan, paper):
    return read_pages(io.BytesIO(sticks_pdf(plan, "Ball", paper)))


LONG = {1: (uneven(2345.678, 61), 2345.678), 2: (uneven(181.25, 8), 181.25)}


@pytest.fixture(scope="module", params=[*PAPERS, "roll"])
def printed(request):
    plan = map_of(
        strip("A1", 1, *LONG[1], joint=7),
        strip("B1", 2, *LONG[2]),
        strip("C1", 1, *LONG[1], turned=True),
    )
    return request.param, plan, pages_of(plan, request.param)


def test_every_mark_of_glued_tapes_is_true_over_two_metres(printed):
    paper, _, pages = printed
    tapes = read_tapes(pages)
    found = joined(tapes)
    assert len(found) == len(LONG)
    assert (len(tapes) == len(LONG)) == (paper == "roll")
    for (marks, end), (places, length_mm) in zip(found, LONG.values(), strict=True):
        assert end == pytest.approx(length_mm, abs=0.1)
        assert np.abs(marks - places).max() <= 0.1


def test_tapes_sum_to_the_strip_and_what_is_glued(printed):
    _, _, pages = printed
    tapes = read_tapes(pages)
    shown = sum(MM * (tape.right - tape.left) for tape in tapes)
    laps = sum(len(tape.joins) for tape in tapes) / 2
    total = sum(length_mm for _, length_mm in LONG.values())
    assert shown - laps * LAP_MM == pytest.approx(total, abs=0.01 * len(tapes))


def test_tapes_keep_clear_of_one_another_and_of_borders(printed):
    paper, _, pages = printed
    wide, high = pages[0].size
    if paper != "roll":
        assert (MM * wide, MM * high) == pytest.approx(PAPERS[paper], abs=0.2)
    # Programs that draw with cairo fit other pages to whole points, and shrink them.
    assert (np.array([page.size for page in pages]) % 1.0 == 0.0).all()
    for page in pages:
        assert (page.lines >= 25.0).all()
        assert (page.lines <= np.tile(page.size, 2) - 25.0).all()
    tapes = read_tapes(pages)
    for one, other in itertools.pairwise(tapes):
        assert one.page < other.page or one.foot - other.top > 40.0
    for tape in tapes:
        assert MM * (tape.top - tape.foot) >= 8.0
        assert (
            np.diff(np.sort(np.concatenate((tape.marks, tape.joins)))).min(initial=99.0) * MM > 4.0
        )


def test_every_page_has_rulers_of_true_length(printed):
    for page in printed[2]:
        x, low, u, high = page.lines.T
        lengths_mm = MM * (u - x)[(low == high) & (low < 80.0)]
        assert lengths_mm == pytest.approx([250.0, 101.6], abs=1e-2)
        uprights = np.unique(x[(x == u) & (low < 80.0)].round(2))
        assert MM * (uprights - uprights[0]) == pytest.approx([0, 100, 101.6, 250], abs=1e-2)


def test_what_each_piece_meets_stands_below_its_marks_in_order(printed):
    _, plan, pages = printed
    text = " ".join(page.text for page in pages)
    for piece in plan.pieces:
        met = [station.partner for station in piece.stations][:: -1 if piece.turned else 1]
        places = [text.find(name) for name in met]
        assert min(places) >= 0
        assert places == sorted(places)
    assert "#7>J9" in text
    assert text.count("#7>") == 1


def test_many_pieces_of_a_kind_go_on_on_the_next_page():
    names = [f"{letter}{number}" for letter in "ABCDEFG" for number in range(1, 20)]
    plan = map_of(*(strip(name, 1, *LONG[2]) for name in names))
    pages = pages_of(plan, "a4")
    assert len(read_tapes(pages)) == 1
    assert len(pages) > 2
    words = " ".join(page.text for page in pages).split()
    assert set(names) <= set(words)
    for page in pages:
        assert (page.lines >= 25.0).all()
        assert {"0", "1", "2", "3"} <= set(page.text.split())


@pytest.mark.parametrize("apart_mm", [12.0, 5.0, 2.5])
def test_crowded_marks_keep_their_places_and_stay_on_the_page(apart_mm):
    places = np.arange(apart_mm, 400.0, apart_mm)
    pages = pages_of(map_of(*(strip(f"AB{n}", 1, places, 403.0) for n in range(10, 13))), "a4")
    for page in pages:
        assert (page.lines >= 25.0).all()
        assert (page.lines <= np.tile(page.size, 2) - 25.0).all()
    ((marks, _),) = joined(read_tapes(pages))
    assert np.abs(marks - places).max() <= 0.1


def test_what_is_longer_than_a_page_can_be_is_printed_in_lengths():
    places = uneven(12_345.6, 200)
    pages = pages_of(map_of(strip("A1", 1, places, 12_345.6)), "roll")
    assert max(max(page.size) for page in pages) <= 14_400.0
    ((marks, end),) = joined(read_tapes(pages))
    assert end == pytest.approx(12_345.6, abs=0.1)
    assert np.abs(marks - places).max() <= 0.1


@pytest.mark.slow
def test_tapes_of_a_job_have_the_marks_of_its_pieces(finished):
    folder = finished(*STRAIGHT)
    pieces = read_crossing_map(folder / "crossing_map.json").pieces
    found = joined(read_tapes(read_pages(folder / "sticks.pdf")))
    assert len(found) == len({piece.kind for piece in pieces})
    for piece in pieces:
        marks, end = found[piece.kind - 1]
        x = np.array([point[0] for point in piece.outline])
        places = np.array([station.x for station in piece.stations]) - x.min()
        if piece.turned:
            places = (np.ptp(x) - places)[::-1]
        assert end == pytest.approx(np.ptp(x), abs=0.1)
        assert np.abs(marks - places).max() <= 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "files"),
    [
        (OCTAHEDRON, set()),
        (STRAIGHT, {"sticks.csv", "sticks.pdf"}),
        ((*STRAIGHT, "--sticks", "none"), {"sticks.csv"}),
    ],
)
def test_jobs_of_straight_strips_have_tapes_unless_none_are_wanted(options, files, finished):
    folder = finished(*options)
    assert {path.name for path in folder.glob("sticks.*")} == files
    page = (folder / "index.html").read_text("utf-8")
    assert {name for name in ("sticks.csv", "sticks.pdf") if f'href="{name}"' in page} == files


def test_no_strips_are_no_tapes():
    (page,) = pages_of(map_of(), "a4")
    assert read_tapes([page]) == []


@given(st.lists(st.floats(0.1, 400.0), min_size=1, max_size=60), st.floats(60.0, 5000.0))
def test_lengths_cover_a_strip_and_have_room_for_what_is_glued(steps, room_mm):
    places = [0.0, *np.cumsum(steps).tolist()]
    parts = lengths(places, room_mm)
    assert (parts[0][0], parts[-1][1]) == (0.0, places[-1])
    assert all(one[1] == other[0] for one, other in itertools.pairwise(parts))
    assert all(start < end for start, end in parts)
    assert all(end + LAP_MM <= start + room_mm + 1e-9 for start, end in parts[:-1])
    assert parts[-1][1] - parts[-1][0] <= room_mm
    # Each takes at least half of the room that it has.
    assert all(end - start >= (room_mm - LAP_MM) / 2 for start, end in parts[:-1])


@given(st.integers(1, 40), st.floats(60.0, 500.0))
def test_tapes_do_not_part_at_a_mark_where_marks_have_room(count, room_mm):
    places = [0.0, *(15.0 * np.arange(1, count + 1)).tolist()]
    for _, stop in lengths(places, room_mm)[:-1]:
        assert np.abs(stop - np.array(places)).min() >= 6.0 - 1e-9
