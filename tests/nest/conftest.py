import runpy
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def piece_sets():
    """Give the functions of pieces_set.py, which the benchmark shares."""
    return runpy.run_path(str(Path(__file__).parents[1] / "support" / "pieces_set.py"))
