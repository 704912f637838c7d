"""Let objects go, and tell how far they settle: with bare crossings, pinned ones, and glued ones.

    python tests/benchmarks/bench_form.py [NAME ...]

One row an object and a way of fastening: crossings, how far it settles at most and in the root
mean square, the sag under its own weight, loose modes, seconds.
"""

import sys
import time

import numpy as np

from fabweave.form.body import BARE, PINNED, RIVETED, body_of
from fabweave.form.settle import settle
from fabweave.options.settings import Settings
from fabweave.plan.ask import brief_of, complete_settings, lay_asked, load_asked

SHARED = "../shared/meshes/"
OBJECTS = {
    "plain torus": ("shape:torus?m=24&n=12", 420.0, "plain", "card", None),
    "twill torus": ("shape:torus?m=24&n=12", 420.0, "twill", "card", None),
    "plain lampshade": ("shape:tube?m=16&n=8", 300.0, "plain", "card", None),
    "plain sphere": ("shape:sphere?n=6", 300.0, "plain", "card", None),
    "hemisphere": ("shape:hemisphere?n=6", 300.0, "plain", "card", None),
    "hypar": ("shape:hypar?m=8&n=8", 300.0, "plain", "card", None),
    "knot": ("shape:knot", 400.0, "plain", "card", None),
    "kagome ball": ("shape:icosahedron", 300.0, "kagome", "card", "loop:2"),
    "triaxial ball": ("shape:icosahedron", 300.0, "triaxial", "card", "loop:2"),
    "cube, refined": ("shape:cube", 300.0, "plain", "card", "catmull-clark:2"),
    "veneer torus": ("shape:torus?m=16&n=8", 600.0, "plain", "birch-veneer", None),
    "aluminium ball": ("shape:sphere?n=4", 400.0, "plain", "aluminium-5052", None),
    "slit": ("shape:slit", 300.0, "plain", "card", None),
}


def main(names):
    """Print the table."""
    print("object                  crossings  pins      settles  mean   sags  loose      s")
    for name in names or OBJECTS:
        source, size_mm, pattern, material, refine = OBJECTS[name]
        asked = Settings.of(
            source, size_mm=size_mm, pattern=pattern, material=material, refine=refine
        )
        settings, supplies = complete_settings(asked)
        woven = lay_asked(load_asked(settings), settings, supplies)
        body = body_of(woven, brief_of(settings, supplies))
        for how, stiffness in (("bare", BARE), ("pinned", PINNED), ("glued", RIVETED)):
            pins = np.full(woven.weave.threads.n_crossings, stiffness)
            begun = time.perf_counter()
            form = settle(body, pins).form
            taken = time.perf_counter() - begun
            rest = "" if form.settled else "  not at rest"
            figures = f"{form.settles_mm:8.2f} {form.mean_mm:5.2f} {form.sags_mm:6.2f}"
            more = f"{form.gives_mm_n:7.3f} mm/N {form.apart:4} {form.apart_n:6.3f} N {form.strain:6.3f}"
            line = f"{name:22} {len(pins):10}  {how:8} {figures} {form.loose:6} {more} {taken:6.1f}"
            print(line + rest, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
