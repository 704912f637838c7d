"""What is marked on straight strips: the same for all pieces of a kind, and as rules have it."""

import csv
import io
from fractions import Fraction
from itertools import chain

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jobs import STRAIGHT

from fabweave.piece.congruence import SAME_MM
from fabweave.plan.crossing_map import read_crossing_map
from fabweave.plan.csv_tables import stick_table
from fabweave.plan.sticks import nearest_inches, story_sticks

#: Pieces of a kind are the same to this, and distances are rounded.
SLACK_MM = SAME_MM + 0.01


@pytest.fixture(scope="module")
def plan(finished):
    return read_crossing_map(finished(*STRAIGHT) / "crossing_map.json")


@pytest.mark.slow
def test_every_piece_has_the_marks_of_its_kind(plan):
    """Seen from its own end: each station, hole and slot of it is in a row of its kind."""
    rows = list(csv.DictReader(io.StringIO(stick_table(plan))))
    assert {row["mark"] for row in rows} == {"cut", "crossing", "joint", "hole", "slot"}
    assert any(piece.turned for piece in plan.pieces)
    for piece in plan.pieces:
        low, high = np.min(piece.outline, axis=0), np.max(piece.outline, axis=0)
        own = [row for row in rows if row["kind"] == str(piece.kind)]
        size = [(float(row["length_mm"]), float(row["width_mm"])) for row in own]
        assert size == pytest.approx(np.tile(high - low, (len(own), 1)), abs=SLACK_MM)
        there = np.array([(float(row["distance_mm"]), float(row["across_mm"])) for row in own])
        assert (np.diff(there[:, 0]) >= 0.0).all()
        assert there[[0, -1], 0] == pytest.approx([0.0, high[0] - low[0]], abs=SLACK_MM)

        def row_of(spot, at, *, what, piece=piece, own=own, there=there, low=low, high=high):
            off = there - (high - spot if piece.turned else spot - low)
            station = str(len(piece.stations) - 1 - at if piece.turned else at)
            found = [
                row for row, each in zip(own, np.hypot(*off.T), strict=True)
                if each < SLACK_MM and row["station"] == station and row["mark"] in what
            ]  # fmt: skip
            assert len(found) == 1
            return found[0]

        for at, station in enumerate(piece.stations):
            joint = station.joint is not None
            what = {"joint"} if joint else {"joint", "crossing"}
            row = row_of((station.x, station.y), at, what=what)
            assert row["lies"] == ("over" if station.over else "under")
        for cutout in piece.cutouts:
            if cutout.hole is None:
                path = np.array(cutout.path)[:, :2]
                spot = (path.min(axis=0) + path.max(axis=0)) / 2
                assert row_of(spot, cutout.station, what={"slot"})["hole_mm"] == ""
            else:
                row = row_of(cutout.hole[:2], cutout.station, what={"joint", "crossing", "hole"})
                assert float(row["hole_mm"]) == cutout.hole[2]


def test_the_table_has_a_row_for_each_mark_and_names_all_that_is_cut(plan):
    rows = list(csv.DictReader(io.StringIO(stick_table(plan))))
    assert len(rows) == sum(len(stick.marks) for stick in story_sticks(plan))
    named = {row["kind"]: row["pieces"].split() for row in rows}
    assert sorted(chain(*named.values())) == sorted(piece.id for piece in plan.to_cut)
    turned = {name for row in rows for name in row["turned"].split()}
    assert turned == {piece.id for piece in plan.pieces if piece.turned}
    for row in rows:
        inches = float(row["distance_mm"]) / 25.4
        assert float(row["distance_in"]) == pytest.approx(inches, abs=8e-4)
        nearest = sum(map(Fraction, row["nearest_in"].split()))
        assert float(nearest) == pytest.approx(inches, abs=1 / 64 + 3e-4)


@given(st.floats(0.0, 1e5))
def test_rules_in_inches_are_read_to_the_nearest_thirty_second(length_mm):
    words = nearest_inches(length_mm).split()
    value = sum(map(Fraction, words))
    assert abs(float(value) * 25.4 - length_mm) <= 25.4 / 64.0 + 1e-6
    assert value.denominator in (1, 2, 4, 8, 16, 32)
    whole, *part = words
    assert len(part) < 2
    assert all(0 < Fraction(one) < 1 and "/" not in whole for one in part)
    assert words == [str(Fraction(word)) for word in words]  # in lowest terms
