"""Make jobs where random walks over the studio's controls end: by the page and from its job.toml.

Both are to be the same, byte for byte, or neither can be made. Run by hand, with the number of the
first walk and how many: ``python tests/tools/walks.py 0 1000``. A number is always the same walk.
"""

import shutil
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "studio"))
from jobs import quick_jobs, run
from test_work import walked

from fabweave.core.errors import CannotMakeError, FabweaveError
from fabweave.mesh.io.files import write_mesh
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.studio.work import make

#: Where walks begin: small meshes, the last of them a file.
MESHES = (
    "shape:octahedron", "shape:cube", "shape:tetrahedron", "shape:icosahedron",
    "shape:torus?m=5&n=3", "shape:hemisphere?n=2", "shape:hypar?m=4&n=4", "FOLDER/bowl.obj",
)  # fmt: skip
#: Steps of a walk, and crossings that it does not go beyond: a thousand walks are to end in hours.
STEPS, MOST_CROSSINGS = 12, 100
#: The codes of the command line, in words.
CODES = {0: "made", 1: "cannot be made", 2: "refused"}


def by_page(state, folder):
    """Make the job of a state as the page does; return how that ended, and where the job is."""
    (folder / "jobs").mkdir()
    options = {**state.options, "effort": "quick", "force": True}
    found = []
    try:
        make({}, {"mesh": state.mesh, "options": options, "folder": str(folder / "jobs")},
             found.append)  # fmt: skip
    except CannotMakeError:
        return "cannot be made", None
    except FabweaveError:
        return "refused", None
    made = next(values["made"] for values, _ in found if "made" in values)
    return "made", folder / "jobs" / made


def by_command(toml, folder):
    """Make the job of a job.toml by the command line; return how that ended, and where it is."""
    (folder / "job.toml").write_text(toml, "utf-8")
    code = run("make", "--config", folder / "job.toml", "--effort", "quick", "--force", "-q",
               "-o", folder / "again")  # fmt: skip
    return CODES.get(code, f"exit {code}"), folder / "again"


def outcome(number, folder):
    """Return how a walk ends, both ways in one word where they are the same."""
    mesh = MESHES[number % len(MESHES)].replace("FOLDER", str(folder.parent))
    *_, (state, seen) = walked(STEPS, number, mesh, {"size": "200mm"}, MOST_CROSSINGS)
    page, one = by_page(state, folder)
    command, two = by_command(seen["toml"], folder)
    if page != command:
        return f"DIFFERS: {page} by the page, {command} by the command"
    if page == "made":
        same = (one / "contents.json").read_bytes() == (two / "contents.json").read_bytes()
        return "equal" if same else "DIFFERS in contents.json"
    return f"both: {page}"


def main(first, count):
    with tempfile.TemporaryDirectory() as parent, quick_jobs():
        write_mesh(Path(parent) / "bowl.obj", parse_shape("shape:hemisphere?n=2"))
        counts, begun = Counter(), time.perf_counter()
        for number in range(first, first + count):
            folder = Path(parent) / str(number)
            folder.mkdir()
            since = time.perf_counter()
            how = outcome(number, folder)
            counts[how] += 1
            if how.startswith("DIFFERS"):
                shutil.copytree(folder, Path(tempfile.gettempdir()) / f"walk-{number}")
            shutil.rmtree(folder)
            print(f"{number}: {how} ({time.perf_counter() - since:.1f} s)", flush=True)
        each = (time.perf_counter() - begun) / count
        print(f"{count} walks, {each:.1f} s each: {dict(counts)}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
