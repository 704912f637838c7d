"""Where few designs can be built, a search goes on near them; where none can, it says why."""

import math
from dataclasses import replace

import pytest
from designs import candidate
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.finding import Finding
from fabweave.design import search
from fabweave.design.beside import beside, otherwise
from fabweave.design.candidate import Candidate, Tried
from fabweave.design.search import ENOUGH, Trials, nearest, search_designs, why_text
from fabweave.design.variety import MOST, NARROW, name_of
from fabweave.design.wishes import Wishes
from fabweave.options.settings import Settings
from fabweave.plan.verdict import Verdict, excess, judge, refused
from fabweave.ribbon.rules.broken_rule import BrokenRule

pytestmark = pytest.mark.usefixtures("quick_jobs")

ASKED = Settings.of("cow.obj", size_mm=300.0, material="birch-veneer")
GOOD = candidate()


def stopped(rule, by, name="D"):
    """Return a design that a rule stops, by how much."""
    reason = Finding(rule=rule, level="not makeable", text=f"{rule} is broken")
    return replace(candidate(name, Verdict(level="not makeable", reasons=(reason,))), excess=by)


def failed(name="D"):
    """Return a design whose mesh could not be made."""
    return Candidate(key=name, name=name, command="", verdict=refused("no such mesh"), figures=None)


def quads(count, **changes):
    return ASKED.but(remesh=f"quads:{count}", **changes)


def finding(rule, count, of, far):
    return BrokenRule(rule, "warn", 1.0, 2.0, "mm", "A", 1, 2, None, (0, 0, 0), count, of, far)


@given(
    st.sampled_from(["width", "bend", "twist", "crease", "layers", "clearance"]),
    st.integers(1, 400),
    st.integers(0, 400),
)
def test_what_care_makes_up_for_has_no_excess_above_one(rule, count, far):
    found = finding(rule, count, 400, min(far, count))
    assert (excess([found]) <= 1.0) == (judge([found], narrowest_mm=9.0).level == "with care")


def beside_none(designs, found, asked=ASKED):
    """Return what is tried beside designs where nothing is wished for."""
    return beside(asked, list(zip(designs, found, strict=True)), Wishes())


def test_what_serves_is_tried_a_little_finer_and_coarser_and_narrower():
    found = beside_none([quads(100)], [GOOD])
    assert found == [quads(120), quads(80), quads(100).narrower(NARROW)]
    # Beside that comes what mends the others, and nothing twice.
    found = beside_none([quads(100), quads(200)], [GOOD, stopped("bend", 9.0)])
    assert found[:2] == [quads(120), quads(80)]
    assert len(set(map(str, found))) == len(found)
    assert quads(200, pattern="twill") in found


@pytest.mark.parametrize(
    ("rule", "expected"),
    [
        ("twist", ["narrower", "quads:50 catmull-clark:1"]),
        ("bend", ["quads:120", "twill"]),
        ("width", ["quads:50 catmull-clark:1", "quads:120"]),
        ("clearance", ["narrower"]),
    ],
)
def test_what_helps_follows_from_what_stands_in_the_way(rule, expected):
    known = {
        "twill": quads(200, pattern="twill"),
        "quads:50 catmull-clark:1": quads(50, refine="catmull-clark:1"),
        "quads:120": quads(120),
    }
    found = beside_none([quads(200)], [stopped(rule, 2.0)])
    for name in expected:
        if name == "narrower":
            assert quads(200).narrower(NARROW) in found
        else:
            assert known[name] in found


def test_what_is_stated_stays_and_no_mesh_is_too_fine():
    asked = ASKED.but(remesh="quads:200", fair=20, pattern="plain")
    found = beside_none([asked], [stopped("width", 2.0)], asked)
    assert {(one.mesh.remesh, one.mesh.fair) for one in found} <= {("quads:200", 20)}
    fine = beside_none([quads(MOST)], [stopped("bend", 2.0)])
    assert all(int(one.mesh.remesh.partition(":")[2]) <= MOST for one in fine)


def test_a_mesh_that_cannot_be_made_is_wrapped():
    tried = [quads(50), quads(100), quads(200)]
    failures = [failed() for _ in tried]
    assert beside_none(tried, failures) == [quads(200, bodies="wrap")]
    # What could be made so of one density is tried of the others, coarsest last.
    found = beside_none([*tried, quads(200, bodies="wrap")], [*failures, stopped("bend", 2.0)])
    assert found[:2] == [quads(100, bodies="wrap"), quads(50, bodies="wrap")]
    found = beside_none([quads(100), quads(50)], [failed(), stopped("bend", 2.0)])
    assert not any(one.mesh.bodies == "wrap" for one in found)


@pytest.fixture
def explored(monkeypatch):
    """Stand in for what tries designs: by the number of quads, with a record of all."""
    calls = []

    def outcome(design):
        count = int((design.mesh.remesh or "quads:999").partition(":")[2])
        if design.mesh.size_mm > 500.0:
            return GOOD
        good = 60 <= count <= 90
        found = GOOD if good else stopped("bend", abs(math.log(count / 75)) + 1.01)
        return replace(found, figures=replace(GOOD.figures, lost=(repr(design),)))

    def explore(_, designs, *__, **___):
        calls.append(list(designs))
        return [Tried(candidate=outcome(one), picture=None) for one in designs]

    monkeypatch.setattr(search, "explore", explore)
    return calls


def test_a_search_goes_on_until_enough_can_be_built(explored):
    found = search_designs(Trials(ASKED), [quads(40), quads(200)], 12)
    assert sum(one.makeable for one in found.candidates) >= ENOUGH
    assert len(found.tried) == sum(map(len, explored)) <= 12
    assert (found.why, found.otherwise) == ("", ())
    # Where enough can be built, what was planned is tried, and nothing else.
    explored.clear()
    planned = [quads(60), quads(70), quads(80), quads(300)]
    found = search_designs(Trials(ASKED), planned, 12, first=3)
    assert explored == [planned[:3], planned[3:]]


def test_of_designs_that_come_to_the_same_one_is_kept(monkeypatch):
    asis = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=None, likeness_mean_mm=None))
    kept = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=0.0, likeness_mean_mm=0.0))
    other = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=0.1, likeness_mean_mm=0.0))
    refused_one = replace(failed(), excess=5.0)
    found = [asis, kept, other, refused_one, refused_one, kept, asis]
    designs = [*(quads(count) for count in range(40, 46)), quads(46, pattern="twill")]
    monkeypatch.setattr(
        search,
        "explore",
        lambda _, some, *__, **___: [
            Tried(candidate=found[designs.index(one)], picture=None) for one in some
        ],
    )
    result = search_designs(Trials(ASKED), designs, len(designs))
    assert result.candidates == [asis, other, refused_one, refused_one, asis]
    assert result.designs == tuple(designs[at] for at in (0, 2, 3, 4, 6))


def test_where_none_can_be_built_it_says_why_and_what_would_help(explored):
    found = search_designs(Trials(ASKED), [quads(500), quads(800)], 2)
    assert not any(one.makeable for one in found.candidates)
    assert len(found.tried) == 2
    assert [design.mesh.size_mm for design in (one for call in explored[1:] for one in call)] == [
        380.0, 480.0, 750.0, 1200.0, 300.0, 300.0, 300.0, 300.0
    ]  # fmt: skip
    assert [one.makeable for one in (tried.candidate for tried in found.helps)] == [True, True]


def test_the_nearest_is_what_misses_least():
    some = [failed(), stopped("bend", 3.0), GOOD, stopped("width", 2.0)]
    tried = [(quads(count), one) for count, one in zip((10, 20, 30, 40), some, strict=True)]
    # What bends too much is mended by size, or thinner sheet; what is too narrow, hardly.
    assert nearest(tried) == tried[1]
    assert nearest([tried[0], *tried[2:]]) == tried[3]
    assert nearest([(quads(10), stopped("twist", 4.0)), tried[1]]) == tried[1]
    assert nearest(tried[:1]) is None


def test_what_cannot_be_built_is_tried_larger_thinner_and_of_card():
    design = quads(100)
    some = list(otherwise(ASKED, design))
    assert [(one.mesh.size_mm, one.stock.thickness_mm, one.stock.material) for one in some] == [
        *((size, None, "birch-veneer") for size in (380.0, 480.0, 750.0, 1200.0)),
        *((300.0, thickness, "birch-veneer") for thickness in (0.6, 0.4, 0.2)),
        (300.0, None, "card"),
    ]
    bad = stopped("bend", 2.0, "bad")
    names = [name_of(one, ASKED) for one in some]
    helps = [replace(GOOD if at in (1, 7) else bad, name=names[at]) for at in range(8)]
    told = why_text(ASKED, [(design, bad)], helps)
    assert [name for name in names if name in told] == [names[1], names[7]]
    assert why_text(ASKED, [(design, GOOD), (design, GOOD)], []) == ""
