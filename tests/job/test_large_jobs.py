"""What a job is too large for is left out, said, and missed by nobody; its memory is bounded."""

import json

import pypdf
import pytest

from fabweave.job import papers
from fabweave.job.run import run_job
from fabweave.job.stations import Stations
from fabweave.options.settings import Settings
from fabweave.show import paper_limits

pytestmark = pytest.mark.usefixtures("quick_jobs")


@pytest.fixture
def small_limits(monkeypatch):
    """Take every job for too large to be shown whole."""
    for module in (paper_limits, papers):
        monkeypatch.setattr(module, "MOST_PICTURED", 3)
        monkeypatch.setattr(module, "MOST_VIEWED", 11)


@pytest.mark.slow
@pytest.mark.usefixtures("small_limits")
def test_what_a_job_is_too_large_for_is_left_out_and_said(tmp_path):
    folder = tmp_path / "job"
    finished = run_job(Stations(Settings.of("shape:cube", size_mm=200.0, effort="quick")), folder)
    assert finished.job.weave.threads.n_crossings == 12
    assert finished.proof.ok
    assert not (folder / "assembly.html").exists()
    notes = "\n".join(finished.job.notes)
    assert "assembly.html is left out: 12 crossings" in notes
    assert "without a picture of each" in notes
    document = json.loads((folder / "crossing_map.json").read_text())
    pages = pypdf.PdfReader(folder / "assembly.pdf").pages
    text = " ".join(page.extract_text() for page in pages)
    assert all(f"Step {number}" in text for number in range(1, len(document["steps"]) + 1))
    assert "Turn the object" not in text
