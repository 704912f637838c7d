"""Whether a thing can be built follows from what was found, and from nothing else."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fabweave.job.stations import Stations
from fabweave.options.settings import settings_from_options
from fabweave.plan.verdict import COAXED, NARROW_MM, NotMakeableError, judge, verdict_words
from fabweave.ribbon.rules.broken_rule import BrokenRule

pytestmark = pytest.mark.usefixtures("quick_jobs")

RULES = st.sampled_from(sorted(COAXED))


def found(rule, count, of, far=0, severity="warn"):
    return BrokenRule(
        rule, severity, 1.0, 2.0, "mm", "A", 0, 0, None, (0, 0, 0), count, of, far=far
    )


@given(RULES, st.integers(100, 10_000))
def test_what_is_broken_in_too_many_places_cannot_be_built(rule, of):
    most = int(COAXED[rule] * of)
    assert judge([found(rule, most, of)], narrowest_mm=9.0).level == "with care"
    assert judge([found(rule, most + 1, of)], narrowest_mm=9.0).level == "not makeable"


@given(RULES.filter(lambda rule: rule != "width"), st.integers(1000, 10_000))
def test_what_is_broken_by_far_in_some_places_cannot_be_built(rule, of):
    few = int(0.005 * of)
    assert judge([found(rule, few, of, far=few)], narrowest_mm=9.0).level == "with care"
    broken = judge([found(rule, few + 1, of, far=few + 1)], narrowest_mm=9.0)
    assert broken.level == "not makeable"
    assert [reason.rule for reason in broken.stops] == [rule]


def test_a_ribbon_that_is_far_too_narrow_at_one_place_breaks_there():
    assert judge([found("width", 1, 1000)], narrowest_mm=0.9).level == "with care"
    assert judge([found("width", 1, 1000, far=1)], narrowest_mm=0.3).level == "not makeable"


@given(st.floats(0.5, 50.0), st.integers(0, 4), st.integers(0, 4), st.integers(0, 100))
def test_narrow_ribbons_loose_bodies_and_missing_ids_want_care(
    narrowest_mm, bodies, unnamed, percent
):
    verdict = judge(
        [], narrowest_mm=narrowest_mm, bodies=bodies, left_out=percent / 100, unnamed=unnamed
    )
    expected = {
        "narrow": narrowest_mm < NARROW_MM,
        "bodies": bodies > 1,
        "left-out": percent > 0,
        "ids": unnamed > 0,
    }
    assert {reason.rule for reason in verdict.reasons} == {k for k, v in expected.items() if v}
    assert verdict.level == ("with care" if any(expected.values()) else "makeable")
    assert verdict_words(verdict).startswith("Yes")


def test_the_worst_comes_first_and_what_is_forced_says_so():
    findings = [found("bend", 1, 100), found("twist", 90, 100), found("hole", 99, 100, far=99)]
    verdict = judge(findings, narrowest_mm=9.0, forced=True)
    assert [reason.rule for reason in verdict.reasons] == ["twist", "bend", "hole"]
    assert verdict.forced
    assert not judge(findings[:1], narrowest_mm=9.0, forced=True).forced


@pytest.mark.slow
@pytest.mark.parametrize(("material", "good"), [("card", True), ("museum-board", False)])
def test_a_small_ball_of_board_is_refused_before_it_is_nested(material, good):
    asked = settings_from_options("shape:sphere?n=3", size="110mm", material=material)
    if good:
        assert not Stations(asked).buildable.verdict.stops
    else:
        with pytest.raises(NotMakeableError, match="bend: a radius") as refusal:
            _ = Stations(asked).buildable
        assert refusal.value.verdict.stops
        assert "--force" in str(refusal.value)
