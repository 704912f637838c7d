"""Decide which tori can be woven in exact 2/2 twill, weave one, and explain a mesh that cannot.

Run it with: python examples/exact_twill.py
"""

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.bunches import part_bunches
from fabweave.weave.threads import thread_labels, trace_threads
from fabweave.weave.twill.conditions import twill_conditions
from fabweave.weave.twill.decide import decide_twill
from fabweave.weave.twill.weaving import weave_twill

# An m × n quad torus has an exact twill if m or n is even, and only then.
print("    n = " + " ".join("345678"))
for m in range(3, 9):
    row = []
    for n in range(3, 9):
        halfedges = build_halfedges(parse_shape(f"shape:torus?m={m}&n={n}"))
        decision = decide_twill(twill_conditions(halfedges, trace_threads(halfedges)))
        row.append("T" if decision.twillable else ".")
    print(f"m = {m}   " + " ".join(row))

for shape in ("shape:torus?m=8&n=6", "shape:slit?genus=2", "shape:cube?n=2"):
    halfedges = build_halfedges(parse_shape(shape))
    threads = trace_threads(halfedges)
    labels = thread_labels(threads.n_threads)
    twill = weave_twill(halfedges, threads, part_bunches(threads), labels)
    if twill.obstruction is None:
        sequence = "".join("O" if over else "U" for over in twill.weave.over[:8])
        print(f"{shape}: exact; thread A goes {sequence} …")
    else:
        print(f"{shape}: {twill.obstruction.text}")
        print(
            f"  of {twill.n_conditions} conditions {twill.weave.broken.total} are broken, "
            f"and every weave breaks {twill.bound.least} or more"
        )
