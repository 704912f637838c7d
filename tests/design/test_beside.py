"""Beside the nearest design are tried those that should come nearer, and the reasons are told."""

import math
import re
from types import SimpleNamespace

import pytest
from designs import outcome

from fabweave.design import making, search
from fabweave.design.beside import beside
from fabweave.design.search import Search
from fabweave.design.tried import try_design
from fabweave.design.variety import MOST
from fabweave.design.wishes import Wishes, distance, misses, values_text
from fabweave.job.ask import complete_settings
from fabweave.options.settings import Settings
from fabweave.options.table import option_named

ASKED = Settings.of("cow.obj", size_mm=400.0)
BEST = ASKED.but(remesh="quads:200")


def nearer(wishes, asked=ASKED, best=BEST, **figures):
    return beside(asked, [outcome(design=best, **figures)], Wishes(**wishes))


def test_a_met_wish_needs_no_more():
    assert nearer({"pieces": 100}, pieces=101) == []
    assert nearer({"sheets": 2, "likeness_mm": 9.0}, sheets=2, likeness_mm=3.0) == []


def test_a_limit_is_missed_only_beyond_it():
    figures = outcome(pieces=200, sheets=1).figures
    assert misses(figures, Wishes(pieces=100, sheets=4)) == {
        "pieces": pytest.approx(math.log(2.0)),
        "sheets": 0.0,
    }
    assert values_text(figures, Wishes(pieces=100, sheets=4)) == (
        "200 pieces (about 100 wished), 1 sheets (at most 4 wished)"
    )


@pytest.mark.parametrize(
    ("wish", "figures", "helps"),
    [
        (
            {"pieces": 50},
            {"pieces": 100, "longest_mm": 300.0},
            [
                {"remesh": "quads:100"},
                {"max_length_mm": 600.0},
                {"prefer": "work"},
                {"remesh": "quads:50", "refine": "catmull-clark:1"},
            ],
        ),
        (
            {"ribbon_mm": 10.0},
            {"median_mm": 12.0},
            [
                {"width": option_named("width").kind.parse("even,10mm")},
                {"remesh": "quads:290"},
            ],
        ),
        ({"likeness_mm": 5.0}, {"likeness_mm": 10.0}, [{"remesh": "quads:400"}]),
        ({"sheets": 2}, {"sheets": 4}, [{"prefer": "waste"}]),
    ],
    ids=["fewer pieces", "narrower ribbons", "a nearer surface", "fewer sheets"],
)
def test_a_wish_that_is_missed_is_come_nearer_by_what_helps(wish, figures, helps):
    found = nearer(wish, **figures)
    assert all(BEST.but(**changes) in found for changes in helps)
    assert BEST not in found
    assert len(set(map(str, found))) == len(found)
    narrower = any(one.width_rule.relative < BEST.width_rule.relative for one in found)
    assert narrower or "sheets" not in wish


def test_what_was_tried_tells_how_far_to_go():
    """Where twice the faces gave half as many pieces more, four times as many give the double."""
    designs = [BEST, BEST.but(remesh="quads:100"), BEST.but(max_length_mm=150.0)]
    known = [
        outcome(design=one, pieces=n, longest_mm=300.0)
        for one, n in zip(designs, (150, 100, 225), strict=True)
    ]
    found = beside(ASKED, known, Wishes(pieces=170))
    power = math.log(1.5) / math.log(2.0)
    faces = 200 * (170 / 150) ** (1 / power)
    assert BEST.but(remesh=f"quads:{10 * round(faces / 10)}") in found
    (length,) = {one.pieces.max_length_mm for one in found} - {None}
    assert length == pytest.approx(300 * (150 / 170) ** (1 / power), rel=0.03)


def test_what_is_stated_stays():
    asked = BEST.but(fair=20, prefer="work", max_length_mm=200.0,
        width=option_named("width").kind.parse("12mm"),
    )  # fmt: skip
    wishes = {"pieces": 10, "ribbon_mm": 3.0, "sheets": 1, "likeness_mm": 0.1}
    assert nearer(wishes, asked, asked, pieces=100, sheets=9, likeness_mm=9.0) == []


@pytest.mark.parametrize("pieces", [1, 100_000])
def test_no_density_is_beyond_what_a_person_weaves(pieces):
    counts = [
        int(one.mesh.remesh.split(":")[1])
        for one in nearer({"pieces": 100}, pieces=pieces)
        if not one.mesh.refine
    ]
    assert counts
    assert all(20 <= count <= MOST for count in counts)


def test_the_search_goes_where_the_wish_is(monkeypatch):
    """With pieces in proportion to faces, the number wished for is found, and tries are few."""
    tries = []

    def trying(design, name, *_, **__):
        tries.append(design)
        pieces = int(0.7 * int(design.mesh.remesh.split(":")[1]))
        return outcome(name, design=design, pieces=pieces, longest_mm=300.0)

    planned = [ASKED.but(remesh=f"quads:{count}") for count in (70, 240, 800)]
    monkeypatch.setattr(search, "try_design", trying)
    monkeypatch.setattr(making, "variety", lambda *_: planned)
    monkeypatch.setattr(Search, "model", lambda _: SimpleNamespace(mesh=None))
    told = []
    chosen, _ = making.meet_wishes(Search(ASKED, better=told.append, wishes=Wishes(pieces=300)))
    assert chosen.mesh.remesh == "quads:430"
    # Each that is told is nearer than the one before, and the last is what is chosen.
    away = [abs(math.log(int(re.search(r": (\d+) pieces", line)[1]) / 300)) for line in told]
    assert len(told) > 1
    assert away == sorted(set(away), reverse=True)
    assert told[-1].startswith("best so far: ")
    assert ": 301 pieces" in told[-1]
    assert len(tries) <= 24
    assert len({str(one) for one in tries}) == len(tries)
    assert distance(outcome(pieces=301), Wishes(pieces=300)) < 0.01


@pytest.mark.parametrize(("most", "kept"), [(0, 0), (3, 3), (11, 11)])
def test_ctrl_c_keeps_the_nearest_that_was_tried(monkeypatch, most, kept):
    tried = []

    def attempt(design, name, *_, **__):
        if len(tried) == most:
            raise KeyboardInterrupt
        tried.append(design)
        return outcome(name, design=design, pieces=int(design.mesh.remesh.split(":")[1]))

    planned = [ASKED.but(remesh=f"quads:{70 + 10 * number}") for number in range(9)]
    monkeypatch.setattr(search, "try_design", attempt)
    monkeypatch.setattr(making, "variety", lambda *_: planned)
    monkeypatch.setattr(Search, "model", lambda _: SimpleNamespace(mesh=None))
    wishing = Search(ASKED, wishes=Wishes(pieces=500), partly=True)
    if not kept:
        with pytest.raises(KeyboardInterrupt):
            making.meet_wishes(wishing)
        return
    chosen, _ = making.meet_wishes(wishing)
    assert len(tried) == kept
    most_faces = max(tried, key=lambda one: int(one.mesh.remesh.split(":")[1]))
    assert chosen == most_faces


def test_a_budget_is_held_against_whole_sheets_at_worst():
    material = Settings.of("shape:octahedron", size_mm=200.0, material="card")
    tried = try_design(material, "D").figures
    supplies = complete_settings(material)[1]
    sheet = supplies.sheets[0]
    width, height = sheet.width_mm, sheet.height_mm
    price_per_m2 = supplies.only.price_per_m2
    most = price_per_m2[1] if isinstance(price_per_m2, tuple) else price_per_m2
    assert tried.price[1] >= round(tried.sheets * width * height * 1e-6 * most, 2) > 0.0
    between = sum(tried.price) / 2.0
    assert misses(tried, Wishes(budget=between))["budget"] > 0.0
    assert misses(tried, Wishes(budget=tried.price[1]))["budget"] == 0.0
