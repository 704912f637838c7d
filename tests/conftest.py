"""Let tests import what they share (strategies, shared meshes, jobs), and settle Hypothesis."""

import os
import runpy
import sys
from pathlib import Path

import pytest
from hypothesis import settings

sys.path.insert(0, str(Path(__file__).parent / "support"))
# What the person who runs the tests has in a configuration folder changes none of them.
os.environ["FABWEAVE_CONFIG_DIR"] = str(Path(__file__).parent / "support" / "no-configuration")

# A time limit for single examples fails on a busy machine, and says nothing about the code.
# Where every change is judged by one run, that run is the same for the same code; elsewhere each
# run looks at new examples, and at more of them.
judged = "CI" in os.environ
settings.register_profile(
    "fabweave", deadline=None, derandomize=judged, max_examples=20 if judged else 50
)
# For `make test`: a glance at each property.
settings.register_profile("glance", deadline=None, derandomize=judged, max_examples=10)
settings.load_profile("fabweave")


@pytest.hookimpl(wrapper=True)
def pytest_collect_file(file_path):
    """Look for no examples in the docstrings of tests: they have none, and it takes a second."""
    found = yield
    if file_path.name.startswith("test_"):
        found = [one for one in found if type(one) is pytest.Module]
    return found


@pytest.fixture(scope="session")
def piece_sets():
    """Give the functions of pieces_set.py, which the benchmark shares."""
    return runpy.run_path(str(Path(__file__).parent / "support" / "pieces_set.py"))


@pytest.fixture(scope="module")
def browser():
    """Give the system's browser, in which pages are tried."""
    from viewer_tab import CHROMIUM, chromium  # noqa: PLC0415 - found beside the tests

    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is absent")
    if CHROMIUM is None:
        pytest.skip("there is no chromium here")
    with playwright.sync_playwright() as tool, chromium(tool) as started:
        yield started


@pytest.fixture(scope="module")
def quick_jobs():
    """Make jobs quickly in a module that asks for it: where pictures and sheets are not looked at.

    Nothing is patched elsewhere: see ``quick_jobs`` of jobs.py for what is.
    """
    from jobs import quick_jobs  # noqa: PLC0415 - found beside the tests

    with quick_jobs():
        yield


@pytest.fixture
def shipped():
    """Make jobs just as users do, in a test of such a module."""
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
