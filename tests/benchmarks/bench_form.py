"""Plan objects with fasteners at joints, where they keep the form, and at all crossings; let go.

    python tests/benchmarks/bench_form.py [NAME ...]

One row an object and a way of fastening: crossings, fasteners, kinds of pieces, hours by hand, how
far it settles at most and in the root mean square, the sag under its own weight, how far that
pushes it, how it gives to a thumb, the pulls that part strands, stretch as a share of what the
material takes; the seconds to plan its pieces and to let it go.
"""

import sys
import time

from fabweave.estimate.costs import pieces_costs
from fabweave.job.letting_go import let_job_go
from fabweave.job.stations import Stations
from fabweave.options.settings import settings_from_options

SHARED, MODELS = "../shared/meshes/", "examples/meshes/"
OBJECTS = {
    "plain torus": ("shape:torus?m=24&n=12", {"size": "420mm"}),
    "twill torus": ("shape:torus?m=24&n=12", {"size": "420mm", "pattern": "twill"}),
    "narrow torus": ("shape:torus?m=24&n=12", {"size": "420mm", "width": "10mm"}),
    "lampshade": ("shape:tube?m=16&n=8", {"size": "300mm"}),
    "plain ball": ("shape:sphere?n=6", {"size": "300mm"}),
    "hemisphere": (SHARED + "open/hemisphere.obj", {"size": "300mm", "remesh": "quads:200"}),
    "hypar": ("shape:hypar?m=8&n=8", {"size": "300mm"}),
    "knot": (MODELS + "knot.obj", {"size": "400mm", "up": "y"}),
    "kagome ball": ("shape:icosahedron",
                    {"size": "300mm", "pattern": "kagome", "refine": "loop:2"}),
    "triaxial ball": ("shape:icosahedron",
                      {"size": "400mm", "pattern": "triaxial", "refine": "loop:1"}),
    "cube, refined": ("shape:cube", {"size": "300mm", "refine": "catmull-clark:2"}),
    "veneer torus": ("shape:torus?m=16&n=8", {"size": "600mm", "material": "birch-veneer"}),
    "aluminium ball": ("shape:sphere?n=4", {"size": "400mm", "material": "aluminium-5052"}),
    "felt ball": ("shape:sphere?n=4", {"size": "400mm", "material": "wool-felt-3"}),
    "slit": ("shape:slit", {"size": "400mm"}),
    "lamp": ("shape:sphere?n=4",
             {"size": "300mm", "leave_out": "top:80mm", "boundary": "turn", "load": "200g@top"}),
    "bob": (SHARED + "quad/bob_controlmesh.obj", {"size": "400mm", "up": "y"}),
    "double torus": (SHARED + "tri/double-torus.obj", {"size": "400mm", "remesh": "quads:300"}),
    "spot": (MODELS + "spot.obj", {"size": "300mm", "up": "y", "remesh": "quads:350"}),
    "koala": (MODELS + "koala.obj", {"size": "300mm", "up": "y", "remesh": "quads:350"}),
    "fish": (MODELS + "fish.obj", {"size": "300mm", "up": "y", "remesh": "quads:300"}),
    "goat": (MODELS + "goathead.obj", {"size": "300mm", "up": "y", "remesh": "quads:400"}),
}  # fmt: skip


def main(names):
    """Print the table."""
    print("object         fasten  cross. fastened kinds  hours  settles  mean  sags loaded pushed  "
          "mm/N apart     N stretch  plan    let go")  # fmt: skip
    for name in names or OBJECTS:
        source, options = OBJECTS[name]
        job = Stations(settings_from_options(source, force=True, **options))
        _ = job.ribbons
        for fasten in ("joints", "form", "all"):
            begun = time.perf_counter()
            planned = job.instead(job.asked.but(fasten=fasten)).planned
            made = time.perf_counter()
            form = let_job_go(planned).settled.form
            ended = time.perf_counter()
            pieces = planned.piece_set
            hands = pieces_costs(
                pieces, planned.woven, planned.settings.pieces, planned.supplies, 1.0
            ).assembly
            print(
                f"{name:14} {fasten:7} {len(pieces.fastened):6} {pieces.fastened.sum():8} "
                f"{pieces.kinds.count:5} {hands.practised_h:6.1f} {form.settles_mm:8.2f} "
                f"{form.mean_mm:5.2f} {form.sags_mm:5.2f} {form.loaded_mm or 0:6.2f} "
                f"{form.pushed_mm:6.1f} {form.gives_mm_n:5.2f} {form.apart:5} {form.apart_n:5.2f} "
                f"{form.strain:7.3f} {made - begun:5.1f} s {ended - made:5.1f} s"
                + ("" if form.settled else "  not at rest"),
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
