"""Compare whole jobs with those of an older commit, in one run; run by hand.

    python tests/benchmarks/bench_jobs.py [COMMIT] [--only NAME ...]
    make bench BEFORE=COMMIT

Without a commit, the seconds of this tree alone are printed. Each command is run once by each tree,
one after the other, each in a process of its own; seconds are those of the processor, of that
process and, on Linux, of all that it started. Printed are their ratio, and of what was made, what
says whether it is as good: pieces, sheets, how full the last one is, and the grade.
"""

import argparse
import compileall
import contextlib
import ctypes
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_SHEET, _MESHES = ("--sheet", "600x400mm"), "examples/meshes/"
#: Meshes are those of this tree.
JOBS = {
    "torus": ("make", "shape:torus?m=24&n=12", "--size", "400mm", "--pattern", "twill", *_SHEET),
    "lampshade": (
        "make", "examples/lampshade.obj", "--size", "300mm", "--pattern", "twill", *_SHEET,
        "--effort", "quick",
    ),
    "koala": ("make", _MESHES + "koala.obj", "--size", "400mm", "--remesh", "quads:350", *_SHEET),
    "plain spot": ("make", _MESHES + "spot.obj", "--size", "400mm", *_SHEET),
    "plain head": ("make", _MESHES + "nefertiti.obj", "--size", "400mm", *_SHEET),
    "straight ball": (
        "make", "shape:sphere?n=6", "--size", "200mm", "--strips", "straight", *_SHEET,
    ),
    "2,304 crossings": (
        "make", "shape:torus?m=48&n=24", "--size", "900mm", *_SHEET, "--effort", "quick",
    ),
    "inspect lampshade": ("inspect", "examples/lampshade.obj", "--size", "300mm"),
    "inspect koala": ("inspect", _MESHES + "koala.obj", "--size", "400mm"),
    "inspect spot": ("inspect", _MESHES + "spot.obj", "--size", "400mm"),
}  # fmt: skip


#: prctl: what a child leaves behind becomes this process's.
_SUBREAPER = 36


def made(tree: Path, job: tuple[str, ...], folder: Path) -> tuple[float, dict[str, str]]:
    """Run a command by a tree; return the seconds that it took, and what it made."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    out = ("-o", str(folder), "--quiet") if job[0] == "make" else ()
    subprocess.run(
        [sys.executable, "-P", "-m", "fabweave", *job, *out], check=True, cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(tree), "PYTHONDONTWRITEBYTECODE": ""},
        stdout=subprocess.DEVNULL,
    )  # fmt: skip
    # What it started counts once it is waited for.
    with contextlib.suppress(ChildProcessError):
        while True:
            os.waitpid(-1, 0)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    if not out:
        return seconds, {}
    waste, verdict = (
        json.loads((folder / name).read_text()) for name in ("waste.json", "verdict.json")
    )
    sheets = waste["sheets"]
    return seconds, {
        "pieces": str(waste["totals"]["pieces"]),
        "sheets": str(len(sheets)),
        "last": f"{min(sheet['utilisation'] for sheet in sheets):.0%}",
        "grade": str(verdict["grade"]["score"]),
    }


def main() -> None:
    """Print a line for each job and tree."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "commit", nargs="?", help="the older commit", default=os.environ.get("BEFORE")
    )
    parser.add_argument("--only", nargs="+", choices=JOBS, default=list(JOBS))
    asked = parser.parse_args()
    ctypes.CDLL(None).prctl(_SUBREAPER, 1, 0, 0, 0)
    with tempfile.TemporaryDirectory() as folder:
        trees = {"now": ROOT}
        if asked.commit:
            old = Path(folder) / "old"
            git = ["git", "-C", str(ROOT)]
            subprocess.run([*git, "worktree", "add", "-q", "--detach", str(old), asked.commit],
                           check=True)  # fmt: skip
            trees = {asked.commit: old} | trees
        for tree in trees.values():  # as users have it: compiled once
            compileall.compile_dir(tree / "fabweave", quiet=2)
        try:
            for name in asked.only:
                first = 0.0
                for number, (title, tree) in enumerate(trees.items()):
                    seconds, figures = made(tree, JOBS[name], Path(folder) / f"{name} {number}")
                    first = first or seconds
                    told = ", ".join(f"{key} {value}" for key, value in figures.items())
                    print(f"{name:16} {title:10} {seconds:7.1f} s  {seconds / first:5.2f}  {told}",
                          flush=True)  # fmt: skip
        finally:
            if asked.commit:
                subprocess.run([*git, "worktree", "remove", "--force", str(old)], check=True)


if __name__ == "__main__":
    main()
