"""What is marked on straight strips: the same for all pieces of a kind, and as rules have it."""

import csv
import io
from dataclasses import replace
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
from fabweave.plan.sticks import nearest_inches, station_of, story_sticks


@pytest.fixture(scope="module")
def plan(finished):
    return read_crossing_map(finished(*STRAIGHT) / "crossing_map.json")


def test_every_piece_has_the_marks_of_its_kind(plan):
    sticks = story_sticks(plan)
    assert len(sticks) < len(plan.pieces)
    assert {mark.what for stick in sticks for mark in stick.marks} == {
        "cut", "crossing", "joint", "hole", "slot",
    }  # fmt: skip
    assert any(piece.turned for piece in plan.pieces)
    for stick in sticks:
        assert {piece.kind for piece in stick.pieces} == {stick.kind}
        for piece in stick.pieces:
            (alone,) = story_sticks(replace(plan, pieces=(piece,), spares=None))
            assert alone.length_mm == pytest.approx(stick.length_mm, abs=SAME_MM)
            assert alone.width_mm == pytest.approx(stick.width_mm, abs=SAME_MM)
            way, end = (-1.0, stick.length_mm) if piece.turned else (1.0, 0.0)
            own = [
                (one.what, None if one.station is None else station_of(piece, one.station),
                 one.over, one.hole_mm, end + way * one.along_mm)
                for one in alone.marks[:: int(way)]
            ]  # fmt: skip
            theirs = [(m.what, m.station, m.over, m.hole_mm, m.along_mm) for m in stick.marks]
            # Those of a kind may begin at either end of a thread, so joints are one's own.
            assert [row[1:4] for row in own if row[0] != "slot"] == [
                row[1:4] for row in theirs if row[0] != "slot"
            ]
            apart = np.subtract([row[4] for row in own], [row[4] for row in theirs])
            assert np.abs(apart).max() <= SAME_MM


def test_the_table_has_a_row_for_each_mark_and_names_all_that_is_cut(plan):
    rows = list(csv.DictReader(io.StringIO(stick_table(plan))))
    assert len(rows) == sum(len(stick.marks) for stick in story_sticks(plan))
    named = {row["kind"]: row["pieces"].split() for row in rows}
    assert sorted(chain(*named.values())) == sorted(piece.id for piece in plan.to_cut)
    turned = {name for row in rows for name in row["turned"].split()}
    assert turned == {piece.id for piece in plan.pieces if piece.turned}
    for row in rows:
        assert float(row["distance_in"]) * 25.4 == pytest.approx(
            float(row["distance_mm"]), abs=0.02
        )


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
