import pickle
import shutil
from pathlib import Path

import pytest
from verify_specimen import make_specimen, octahedron, saddle, torus
from verify_writers import write_job


@pytest.fixture(scope="session")
def specimens():
    return {
        "torus": make_specimen(torus(6, 4)),
        "octahedron": make_specimen(octahedron(), joints=2),
        "saddle": make_specimen(saddle(), joints=1),
        "bent": make_specimen(octahedron(), joints=2, bent=True),
        "twill": make_specimen(torus(6, 4), pattern="twill"),
    }


@pytest.fixture(scope="session")
def frozen(specimens):
    """Return every specimen as bytes, which are copied faster than objects."""
    return {name: pickle.dumps(specimen) for name, specimen in specimens.items()}


@pytest.fixture
def specimen(frozen):
    """Return a copy of a specimen that a test may spoil."""
    return lambda name: pickle.loads(frozen[name])  # noqa: S301 - pickled above


@pytest.fixture(scope="session")
def true_jobs(specimens, tmp_path_factory):
    """Return the folder of a true job, written once, which no test may change."""
    root = tmp_path_factory.mktemp("true")

    def written(name):
        if not (root / name).exists():
            write_job(specimens[name], root / name)
        return root / name

    return written


@pytest.fixture
def job(true_jobs, tmp_path):
    """Return the folder of a true job, which a test may spoil."""

    def copied(name="octahedron"):
        return Path(shutil.copytree(true_jobs(name), tmp_path / "job", dirs_exist_ok=True))

    return copied
