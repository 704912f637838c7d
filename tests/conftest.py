"""Let tests import what they share (strategies, shared meshes, jobs), and settle Hypothesis."""

import os
import runpy
import sys
from collections import defaultdict
from pathlib import Path

import pytest
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent / "support"))
# What the person who runs the tests has in a configuration folder changes none of them.
os.environ["FABWEAVE_CONFIG_DIR"] = str(Path(__file__).parent / "support" / "no-configuration")

# A time limit for single examples fails on a busy machine, and says nothing about the code.
# Where every change is judged by one run, that run is the same for the same code, and ends soon;
# elsewhere each run looks at new examples, and at more of them.
judged = "CI" in os.environ
settings.register_profile(
    "fabweave", deadline=None, derandomize=judged, max_examples=50 if judged else 100
)
# For `make test`: a glance at each property.
settings.register_profile("glance", deadline=None, derandomize=judged, max_examples=15)
settings.load_profile("fabweave")


#: `make test` runs so many cases of a test: its first, and others at equal distances.
MOST_CASES = 2


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Make slow tests of most cases where a test has many: they show the same in many places."""
    cases = defaultdict(list)
    for item in items:
        if hasattr(item, "function") and item.get_closest_marker("slow") is None:
            cases[item.function].append(item)
    for family in cases.values():
        kept = {n * len(family) // MOST_CASES for n in range(MOST_CASES)}
        for number, item in enumerate(family):
            if number not in kept and len(family) > MOST_CASES:
                item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def piece_sets():
    """Give the functions of pieces_set.py, which the benchmark shares."""
    return runpy.run_path(str(Path(__file__).parent / "support" / "pieces_set.py"))


@pytest.fixture(scope="module")
def browser():
    reason = "the package playwright is absent"
    """Give the system's browser, in which pages are tried."""
    from viewer_tab import CHROMIUM, chromium  # noqa: PLC0415 - found beside the tests

    playwright = pytest.importorskip("playwright.sync_api", reason=reason)
    if CHROMIUM is None:
        pytest.skip("there is no chromium here")
    with playwright.sync_playwright() as tool, chromium(tool) as started:
        yield started


@pytest.fixture(scope="session", autouse=True)
def _quick_jobs():
    """Make jobs quickly, everywhere: see ``quick_jobs``."""
    from jobs import quick_jobs  # noqa: PLC0415 - found beside the tests

    with quick_jobs():
        yield


@pytest.fixture
def shipped():
    """Make jobs just as users do, in processes and with a large picture, in a test that asks."""
    from jobs import shipped_jobs  # noqa: PLC0415 - found beside the tests

    with shipped_jobs():
        yield


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """Return the store of finished jobs that all tests of this run share."""
    from jobs import JobStore  # noqa: PLC0415 - found beside the tests

    base = tmp_path_factory.getbasetemp()
    # With several processes, each has a folder of its own in one that they share.
    store = JobStore((base.parent if "PYTEST_XDIST_WORKER" in os.environ else base) / "finished")
    yield store
    store.require_unspoiled()
