"""Where few designs can be built, a search goes on near them; where none can, it says why."""

import math
from dataclasses import replace

import pytest
from designs import outcome
from hypothesis import given
from hypothesis import strategies as st

from fabweave.core.finding import Finding
from fabweave.design import search
from fabweave.design.beside import ENOUGH, apart, beside, near_rounds, nearest, otherwise, why_few
from fabweave.design.search import Search
from fabweave.design.tried import Tried
from fabweave.design.variety import MOST, NARROW
from fabweave.design.wishes import Wishes
from fabweave.options.settings import Settings
from fabweave.plan.verdict import Verdict, excess, judge, refused
from fabweave.ribbon.rules.broken_rule import BrokenRule

pytestmark = pytest.mark.usefixtures("quick_jobs")

ASKED = Settings.of("cow.obj", size_mm=300.0, material="birch-veneer")
GOOD = outcome()


def stopped(rule, by, name="D"):
    """Return a design that a rule stops, by how much."""
    reason = Finding(rule=rule, level="not makeable", text=f"{rule} is broken")
    return replace(outcome(name, Verdict(level="not makeable", reasons=(reason,))), excess=by)


def failed(name="D"):
    """Return a design whose mesh could not be made."""
    return Tried(ASKED, name, refused("no such mesh"), None)


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


def of_designs(designs, found):
    """Return what designs came to."""
    return [replace(one, design=design) for design, one in zip(designs, found, strict=True)]


def beside_none(designs, found, asked=ASKED):
    """Return what is tried beside designs where nothing is wished for."""
    return beside(asked, of_designs(designs, found), Wishes())


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

    def trying(design, name, *_, **__):
        calls.append(design)
        count = int((design.mesh.remesh or "quads:999").partition(":")[2])
        large = design.mesh.size_mm > 500.0
        good = large or 60 <= count <= 90
        found = GOOD if good else stopped("bend", abs(math.log(count / 75)) + 1.01)
        figures = GOOD.figures if large else replace(GOOD.figures, lost=(repr(design),))
        return replace(found, design=design, name=name, figures=figures)

    monkeypatch.setattr(search, "try_design", trying)
    return calls


def searched(planned, most, **options):
    found = Search(ASKED)
    found.run(near_rounds(found, planned, most, **options))
    return found


def test_a_search_goes_on_until_enough_can_be_built(explored):
    found = searched([quads(40), quads(200)], 12)
    assert len(found.ranked) >= ENOUGH
    assert len(found.tried) == len(explored) <= 12
    assert why_few(found) == ""
    # Where enough can be built, what was planned is tried, and nothing else.
    explored.clear()
    planned = [quads(60), quads(70), quads(80), quads(300)]
    searched(planned, 12, first=3)
    assert explored == planned


def test_of_designs_that_come_to_the_same_one_is_kept():
    asis = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=None, likeness_mean_mm=None))
    kept = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=0.0, likeness_mean_mm=0.0))
    other = replace(GOOD, figures=replace(GOOD.figures, likeness_mm=0.1, likeness_mean_mm=0.0))
    refused_one = replace(failed(), excess=5.0)
    found = [asis, kept, other, refused_one, refused_one, kept, asis]
    designs = [*(quads(count) for count in range(40, 46)), quads(46, pattern="twill")]
    tried = [replace(one, name=str(at)) for at, one in enumerate(of_designs(designs, found))]
    assert apart(tried) == [tried[at] for at in (0, 2, 3, 4, 6)]


def test_where_none_can_be_built_it_says_why_and_what_would_help(explored):
    found = searched([quads(500), quads(800)], 2)
    assert not found.ranked
    assert len(found.tried) == 2
    why = why_few(found)
    assert [design.mesh.size_mm for design in explored[2:]] == [
        380.0, 480.0, 750.0, 1200.0, 300.0, 300.0, 300.0, 300.0
    ]  # fmt: skip
    assert [one.name in why for one in found.tried[2:]] == [False, False, True, True, *[False] * 4]


def test_the_nearest_is_what_misses_least():
    some = [failed(), stopped("bend", 3.0), GOOD, stopped("width", 2.0)]
    # What bends too much is mended by size, or thinner sheet; what is too narrow, hardly.
    assert nearest(some) is some[1]
    assert nearest([some[0], *some[2:]]) is some[3]
    assert nearest([stopped("twist", 4.0), some[1]]) is some[1]
    assert nearest(some[:1]) is None


def test_what_cannot_be_built_is_tried_larger_thinner_and_of_card():
    some = list(otherwise(ASKED, quads(100)))
    assert [(one.mesh.size_mm, one.stock.thickness_mm, one.stock.material) for one in some] == [
        *((size, None, "birch-veneer") for size in (380.0, 480.0, 750.0, 1200.0)),
        *((300.0, thickness, "birch-veneer") for thickness in (0.6, 0.4, 0.2)),
        (300.0, None, "card"),
    ]
