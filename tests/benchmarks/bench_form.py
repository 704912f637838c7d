"""Say how near objects come to their models as they are cut; run by hand.

    python tests/benchmarks/bench_form.py [--only NAME ...]

Each is planned in this process and let go roughly, as compensation does it. Printed are how far
crossings are off in the end, at most and in the root mean square, as drawn and as cut, in
millimetres and as shares of the size; steps, seconds of the processor for that alone; tight bends
and twists as drawn and as cut; fasteners; and the grade as foretold.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from fabweave.core.errors import FabweaveError
from fabweave.job.figures import figures_of
from fabweave.job.stations import Stations

ROOT = Path(__file__).resolve().parents[2]
MESHES, SHADE = ROOT / "examples/meshes", ROOT / "examples/lampshade.obj"
_BALL = {"size": "300mm", "refine": "loop:2", "pattern": "kagome"}
_HUNG = {"size": "300mm", "hang": "top:3", "load": "200g@top:3"}


def _quads(count: int, **more: str) -> dict[str, str]:
    return {"size": "400mm", "up": "y", "remesh": f"quads:{count}"} | more


#: Closed and open, of card, veneer and aluminium, wavy and straight; five were found.
OBJECTS: dict[str, tuple[str | Path, dict[str, str]]] = {
    "torus": ("shape:torus?m=16&n=8", {"size": "300mm"}),
    "torus, twill": ("shape:torus?m=24&n=12", {"size": "400mm", "pattern": "twill"}),
    "torus, veneer": ("shape:torus?m=16&n=8", {"size": "400mm", "material": "birch-veneer"}),
    "torus, aluminium": ("shape:torus?m=24&n=12", {"size": "800mm", "material": "aluminium-5052"}),
    "torus, satin": ("shape:torus?m=20&n=10", {"size": "400mm", "pattern": "satin:5/2"}),
    "torus, straight": ("shape:torus?m=16&n=8", {"size": "300mm", "strips": "straight"}),
    "lampshade": (SHADE, {"size": "300mm"}),
    "lampshade, hung": (SHADE, _HUNG),
    "lampshade, twill": (SHADE, {"size": "300mm", "pattern": "twill", "boundary": "turn"}),
    "lamp": ("shape:sphere?n=4", {"size": "300mm", "leave_out": "top:80mm"}),
    "ball": ("shape:sphere?n=5", {"size": "300mm"}),
    "kagome ball": ("shape:icosahedron", _BALL),
    "kagome ball, straight": ("shape:icosahedron", _BALL | {"strips": "straight"}),
    "triaxial ball": ("shape:icosahedron", _BALL | {"refine": "loop:1", "pattern": "triaxial"}),
    "tube": ("shape:tube?m=12&n=8", {"size": "300mm"}),
    "hypar": ("shape:hypar?m=8&n=8", {"size": "300mm"}),
    "bowl": ("shape:hemisphere", {"size": "300mm"}),
    "slit, genus 2": ("shape:slit?genus=2", {"size": "400mm"}),
    "genus 3": ("shape:regular?face=8&valence=4&genus=3", {"size": "400mm"}),
    "knot": (MESHES / "knot.obj", {"size": "400mm", "up": "y", "pattern": "twill"}),
    "fish": (MESHES / "fish.obj", _quads(250, size="650mm")),
    "koala": (MESHES / "koala.obj", _quads(350)),
    "spot": (MESHES / "spot.obj", _quads(300)),
    "head": (MESHES / "nefertiti.obj", _quads(300)),
}  # fmt: skip


def row(name: str) -> str:
    """Return the figures of an object, in a line of a table."""
    mesh, options = OBJECTS[name]
    asked = {"effort": "quick", "force": True, **options}
    seconds, steps = [0.0], []

    def progress(what: str, *_: int) -> None:
        if what == "form":
            steps.append(what)

    class Timed(Stations):
        def _compensated(self, drawn):
            begun = time.process_time()
            found = super()._compensated(drawn)
            seconds[0] += time.process_time() - begun
            return found

    job = Timed.read(str(mesh), asked)
    job.progress = progress
    try:
        woven = job.planned.woven
    except FabweaveError as error:
        return f"| {name} | {str(error).splitlines()[0][:80]} |"
    size_mm, aim, foretold = woven.size_mm, woven.aim, job.foretold
    if aim is not None:
        off = [
            (float(away.max()), float(np.sqrt((away**2).mean())))
            for away in (aim.drawn_mm, aim.left_mm)
        ]
    else:
        away = np.linalg.norm(foretold.moves, axis=1)
        off = [(float(away.max()), float(np.sqrt((away**2).mean())))] * 2
    told = [f"{most:.2f}/{mean:.2f}" for most, mean in off]
    shares = " | ".join(f"{100 * value / size_mm:.2f}" for value in off[-1])
    drawn, cut = job._checked(job.drawn.woven), job._checked(woven)
    broken = " | ".join(f"{_count(drawn, rule)}, {_count(cut, rule)}" for rule in ("bend", "twist"))
    fasteners, grade = int(job.piece_set.fastened.sum()), figures_of(job).grade
    how = "" if aim is not None else " (as drawn)"
    return (
        f"| {name}{how} | {job.n_crossings} | {told[0]} | {told[1]} | {shares} | {len(steps)} | "
        f"{seconds[0]:.1f} | {broken} | {fasteners} | {grade:.1f} |"
    )


def _count(check, rule: str) -> int:
    return sum(one.count for one in check.findings if one.rule == rule)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=list(OBJECTS), metavar="NAME")
    print(
        "| object | crossings | drawn, mm | cut, mm | most, % | rms, % | steps | s | bends | "
        "twists | fasteners | grade |\n|---" + "|---" * 11 + "|"
    )
    for each in parser.parse_args().only:
        print(row(each), flush=True)
