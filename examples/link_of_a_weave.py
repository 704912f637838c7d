"""Write the link that a weave on a sphere makes: the tetrahedron gives the Borromean rings.

Run it with: python examples/link_of_a_weave.py
"""

import numpy as np

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.link import gauss_text, pd_text, planar_diagram, trace_twisted

halfedges = build_halfedges(parse_shape("shape:tetrahedron"))
# Plain weave: every edge has one half-twist, all of the same sense.
threads = trace_twisted(halfedges, np.ones(halfedges.n_edges, dtype=int))
print(f"{threads.n_threads} rings, {threads.n_crossings} crossings")
print(gauss_text(threads), end="")

# Any two rings are unlinked: the signs of their crossings cancel. All three hold together.
rings = threads.thread_of_pass[threads.passes]
for a, b in ((0, 1), (0, 2), (1, 2)):
    between = (rings == [a, b]).all(axis=1) | (rings == [b, a]).all(axis=1)
    print(f"linking number of {'ABC'[a]} and {'ABC'[b]}: {threads.signs[between].sum() // 2}")

# For a knot-theory program; on the command line: fabweave inspect shape:tetrahedron --pd rings.txt
print(pd_text(planar_diagram(halfedges, threads)))
