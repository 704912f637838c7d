"""Make the finished jobs of the folder outputs, as a person would get them.

Run it with: python tests/tools/make_outputs.py outputs
or, for some of them: python tests/tools/make_outputs.py outputs torus
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
#: Each job's folder, and what is typed to make it. Paths count from the repository.
JOBS = {
    "torus": (
        "shape:torus?m=10&n=5", "--size", "300mm", "--pattern", "twill",
        "--material", "warp=card:navy,weft=card:gold", "--colours", "material",
        "--sheet", "600x400mm", "--template", "none", "--effort", "quick",
        "--title", "Twill ring in two colours",
    ),
    "kagome_ball": (
        "shape:icosahedron", "--size", "300mm", "--refine", "loop:1", "--pattern", "kagome",
        "--material", "card:sienna", "--width", "open:0.2", "--kinds", "fewest",
        "--labels", "kinds",
        "--sheet", "600x400mm", "--template", "none", "--effort", "quick", "--title", "Kagome ball",
    ),
    # Straight edges between crossings and numbers alone keep the files small.
    "fish": (
        "examples/meshes/fish.obj", "--up", "y", "--size", "650mm", "--remesh", "quads:250",
        "--sheet", "600x400mm", "--smooth", "1", "--labels", "numbers", "--template", "none",
        "--effort", "quick", "--title", "Fish",
    ),
}  # fmt: skip

#: Processors that know AVX-512 add in another order, and so round otherwise: none is to use it.
ROUNDING = {
    "OPENBLAS_CORETYPE": "Haswell",
    "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR",
}


def make(name: str, folder: Path) -> None:
    """Make one of the jobs; it names its mesh as it is typed in the repository."""
    command = [sys.executable, "-m", "fabweave", "make", *JOBS[name], "-o", str(folder), "--quiet"]
    subprocess.run(command, cwd=ROOT, check=True, env={**os.environ, **ROUNDING})


if __name__ == "__main__":
    target = Path(sys.argv[1]).resolve()
    target.mkdir(parents=True, exist_ok=True)
    for name in sys.argv[2:] or JOBS:
        make(name, target / name)
        print(target / name)
