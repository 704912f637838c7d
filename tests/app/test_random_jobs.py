"""Random meshes with random settings are proved, or refused in words that name the cause."""

import numpy as np
import pytest
from jobs import quick_jobs
from random_jobs import earlier_stock, hull, outcome, outcome_of


# tests/tools/random_jobs.py makes as many as one likes.
@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(n, marks=pytest.mark.slow) for n in range(4, 30))]
)
def test_a_random_job_is_proved_or_refused_in_words(seed):
    outcome, said = outcome_of(seed)
    assert outcome in ("proved", "cannot be made", "bad input"), said
    assert outcome == "proved" or len(said) > 20


@pytest.fixture(scope="module")
def stocks(tmp_path_factory):
    with quick_jobs():
        return earlier_stock(tmp_path_factory.mktemp("earlier"))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(91000, 91012))
def test_a_random_job_on_offcuts_of_earlier_ones_is_proved_or_refused_in_words(seed, stocks):
    outcome, said = outcome_of(seed, small=True, stocks=stocks)
    assert outcome in ("proved", "cannot be made", "bad input"), said


@pytest.mark.slow
def test_a_flat_sheet_is_flat_however_it_is_rounded():
    # Radii of 10^15 and of 10^6 mm are one and the same.
    assert outcome_of(79) == ("proved", "")


@pytest.mark.slow
def test_where_strands_meet_is_known_on_slanting_triangles():
    # Flat triangles far from regular: the mean of the portals is not where the strands meet.
    assert outcome_of(50175) == ("proved", "")


@pytest.mark.slow
def test_ribbons_that_run_through_themselves_by_nothing_are_counted_either_way():
    # Cross-lines of blocks meet the border of facets exactly; rounding says which side of it.
    assert outcome_of(30146) == ("proved", "")


@pytest.mark.slow
def test_a_long_lap_that_ends_askew_is_proved():
    # Its last cross-line slants across the ribbon, with an end farther from the crossing than
    # half the lap and half the width there.
    options = {"size": "400mm", "lap": "100mm", "effort": "quick", "force": True}
    assert outcome(*hull(np.random.default_rng(6)), options) == ("proved", "")


@pytest.mark.slow
def test_a_station_in_the_gap_of_a_dovetail_is_drawn_on_its_card():
    # A line across the piece there meets nothing of it.
    assert outcome_of(71113, small=True) == ("proved", "")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [71316, 71669, 72089, 72114, 74669])
def test_long_and_short_laps_slanting_necks_and_small_flat_sheets_are_proved(seed):
    # Laps longer than any panel add to what is cut; a neck is measured from its middle; what is
    # flat to the last digit of its model is flat; a slot stays in a lap shorter than its panel.
    assert outcome_of(seed, small=True) == ("proved", "")


@pytest.mark.slow
def test_what_joints_make_too_stiff_is_refused_in_words():
    # It bends just enough with laps at every crossing, but not with laps where its joints are.
    outcome, said = outcome_of(74758, small=True)
    assert outcome == "cannot be made"
    assert "is too stiff" in said
    assert "from 42mm on" in said


@pytest.mark.slow
@pytest.mark.parametrize("seed", [76619, 76674, 77583])
def test_strands_that_run_nearly_the_same_way_across_an_edge_are_told_apart(seed):
    # Two bodies of two slim triangles each; and a quad that had to be made convex.
    assert outcome_of(seed, small=True) == ("proved", "")


@pytest.mark.slow
def test_a_panel_that_is_a_dart_is_covered_as_any_other():
    # The proof took its normal from the corner that is bent in, and looked for covers below it.
    assert outcome_of(78108, small=True) == ("proved", "")
