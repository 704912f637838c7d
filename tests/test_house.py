"""The package is a house of rooms: data flows one way, and what proves the files stands apart."""

from pathlib import Path
from textwrap import dedent

import pytest
from house import (
    against_the_flow,
    circles,
    imports_of,
    loose_modules,
    read_modules,
    unlike_rooms,
)

TESTS = Path(__file__).parent
HOUSE = read_modules(TESTS.parent / "fabweave")


@pytest.mark.slow
def test_nothing_flows_backwards_and_the_proof_stands_apart():
    assert len(imports_of(HOUSE)) > 1000
    assert against_the_flow(HOUSE) == []


@pytest.mark.slow
def test_no_imports_run_in_a_circle():
    assert circles(HOUSE) == []


def test_every_module_stands_in_a_room():
    assert loose_modules(HOUSE) == []


def test_tests_mirror_the_rooms():
    folders = {path.parent.relative_to(TESTS).parts[0] for path in TESTS.glob("*/**/*.py")}
    assert unlike_rooms(folders, {"benchmarks", "support", "tools"}) == []
    assert {path.stem for path in TESTS.glob("test_*.py")} == {
        "test_house", "test_papers", "test_release", "test_site",
    }  # fmt: skip


#: A house in good order.
SOUND = {
    "fabweave.__init__": """
        LAZY = {"make_job": "fabweave.job.pipeline"}
        def read(path):
            from fabweave.mesh.files import read_file
            return read_file(path)
        """,
    "fabweave.__main__": "from fabweave.cli.main import main",
    "fabweave.core.__init__": "",
    "fabweave.core.arrays": "import numpy.linalg",
    "fabweave.mesh.faces": "from fabweave.core.arrays import frozen",
    "fabweave.mesh.files": "from fabweave.mesh import faces",
    "fabweave.job.pipeline": """
        from fabweave import __version__
        from ..mesh.files import read_file
        def run():
            import fabweave.core.arrays
            from fabweave.verify import verify_job
        """,
    "fabweave.cli.main": 'CHECK = "fabweave.job.pipeline.run"',
    "fabweave.verify.__init__": "from fabweave.verify.proof import verify_job",
    "fabweave.verify.proof": 'PACKAGE = "fabweave"',
}
SOUND = {name: dedent(source) for name, source in SOUND.items()}


def test_a_house_in_good_order_is_found_to_be():
    found = {(one.source, one.target, one.at_once) for one in imports_of(SOUND)}
    assert found == {
        ("fabweave.__init__", "fabweave.job.pipeline", False),
        ("fabweave.__init__", "fabweave.mesh.files", False),
        ("fabweave.__main__", "fabweave.cli.main", True),
        ("fabweave.mesh.faces", "fabweave.core.arrays", True),
        ("fabweave.mesh.files", "fabweave.mesh.faces", True),
        ("fabweave.job.pipeline", "fabweave.__init__", True),
        ("fabweave.job.pipeline", "fabweave.mesh.files", True),
        ("fabweave.job.pipeline", "fabweave.core.arrays", False),
        ("fabweave.job.pipeline", "fabweave.verify.__init__", False),
        ("fabweave.cli.main", "fabweave.job.pipeline", False),
        ("fabweave.verify.__init__", "fabweave.verify.proof", True),
    }
    for rule in (against_the_flow, circles, loose_modules):
        assert rule(SOUND) == []


TYPES_ONLY = """
from typing import TYPE_CHECKING
if TYPE_CHECKING:
    from fabweave.job.pipeline import Job
"""


@pytest.mark.parametrize(
    ("module", "source", "complaint"),
    [
        ("core.arrays", "from fabweave.mesh import faces", "imports fabweave.mesh.faces"),
        ("mesh.faces", "import fabweave.job.pipeline as p", "imports fabweave.job.pipeline"),
        ("mesh.faces", "from ..job import pipeline", "imports fabweave.job.pipeline"),
        ("mesh.faces", "def f():\n from fabweave.cli import main", "imports fabweave.cli"),
        ("mesh.faces", TYPES_ONLY, "(line 4) imports fabweave.job.pipeline"),
        ("mesh.faces", 'import_module("fabweave.job.pipeline")', "imports fabweave.job.pipeline"),
        ("mesh.faces", "from fabweave.verify import verify_job", "imports fabweave.verify"),
        ("verify.proof", "from fabweave.core.arrays import frozen", "imports fabweave.core.arrays"),
        ("verify.proof", "from fabweave import __version__", "imports fabweave.__init__"),
        ("__init__", "from fabweave.mesh.files import read_file", "imports fabweave.mesh.files"),
        ("shed.tools", "from fabweave.core import arrays", "imports fabweave.core.arrays"),
    ],
)
def test_what_flows_backwards_is_found(module, source, complaint):
    (found,) = against_the_flow(SOUND | {f"fabweave.{module}": source})
    assert found.startswith(f"fabweave.{module} (line ")
    assert complaint in found


@pytest.mark.parametrize(
    ("module", "source", "members"),
    [
        # As soon as they are imported, in a function, and by a string.
        ("mesh.faces", "from fabweave.mesh import files", {"mesh.faces", "mesh.files"}),
        ("mesh.faces", "def f():\n import fabweave.mesh.files", {"mesh.faces", "mesh.files"}),
        ("mesh.faces", 'LATER = "fabweave.mesh.files.read"', {"mesh.faces", "mesh.files"}),
        ("verify.proof", "from fabweave import verify", {"verify.proof", "verify.__init__"}),
    ],
)
def test_circles_of_modules_are_found(module, source, members):
    (found,) = circles(SOUND | {f"fabweave.{module}": source})
    # A circle may be told from any of its members on.
    assert set(found.removeprefix("circle: ").split(" → ")) == {f"fabweave.{m}" for m in members}


@pytest.mark.parametrize(
    ("module", "complaint"),
    [
        ("helpers", "beside the rooms"),
        ("shed.tools", "in no room"),
        ("shed.__init__", "in no room"),
    ],
)
def test_modules_beside_the_rooms_are_found(module, complaint):
    name = f"fabweave.{module}"
    assert loose_modules(SOUND | {name: ""}) == [f"{name} is {complaint}"]
