"""Random meshes with random settings are proved, or refused in words that name the cause."""

import pytest
from random_jobs import outcome_of


# tests/tools/random_jobs.py makes as many as one likes.
@pytest.mark.parametrize("seed", range(100))
def test_a_random_job_is_proved_or_refused_in_words(seed):
    outcome, said = outcome_of(seed)
    assert outcome in ("proved", "cannot be made", "bad input"), said
    assert outcome == "proved" or len(said) > 20
