"""Count the threads of the five Platonic solids: they are the Petrie polygons.

Run it with: python examples/count_threads.py
"""

from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.shapes.catalogue import parse_shape
from fabweave.weave.threads import trace_threads

for name in ("tetrahedron", "cube", "octahedron", "icosahedron", "dodecahedron"):
    threads = trace_threads(build_halfedges(parse_shape(f"shape:{name}")))
    print(f"{name}: {threads.n_threads} threads of {threads.lengths[0]} crossings")
