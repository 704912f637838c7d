import copy
import sys
from pathlib import Path

import pytest

# The specimen maker is a module of its own beside the tests.
sys.path.insert(0, str(Path(__file__).parent))

from verify_specimen import make_specimen, octahedron, saddle, torus
from verify_writers import write_job


@pytest.fixture(scope="session")
def specimens():
    return {
        "torus": make_specimen(torus(6, 4), offcentre=True),
        "octahedron": make_specimen(octahedron(), joints=2),
        "saddle": make_specimen(saddle(), joints=1),
        "twill": make_specimen(torus(6, 4), pattern="twill"),
    }


@pytest.fixture
def specimen(specimens):
    """Return a copy of a specimen that a test may spoil."""
    return lambda name: copy.deepcopy(specimens[name])


@pytest.fixture
def job(specimen, tmp_path):
    """Return the folder of a true job, which a test may spoil."""
    return lambda name="octahedron": write_job(specimen(name), tmp_path / "job")
