"""A job is not lost for its looks: strands that cross may have one tone, and sheets know none."""

import numpy as np
import pytest

from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.weave.strand_colours import crossing_colours


@pytest.mark.slow
def test_a_job_with_crossings_of_one_tone_is_proved(tmp_path):
    settings = Settings.of("shape:cube?n=2", size_mm=300.0, effort="quick", material="card:white")
    made = run_job(Stations(settings), tmp_path / "job")
    assert made.proof.ok
    shown = crossing_colours(made.job.weave, made.job.colours)
    below, above = shown[:, 0, :, None], shown[:, 1, None, :]
    alike = np.any(np.all(below == above, axis=-1), axis=(1, 2))
    # Directions cannot be told apart around the eight corners, where three edges meet.
    assert 0 < np.count_nonzero(alike) < len(alike) / 2
    assert len(np.unique(shown.reshape(-1, 3), axis=0)) == 3
    assert made.job.supplies.only.name == "card:white"
    assert not made.job.supplies.several
