"""Count the threads of the five Platonic solids: they are the Petrie polygons.

Run it with: python examples/count_threads.py
"""

import fabweave as fw

for name in ("tetrahedron", "cube", "octahedron", "icosahedron", "dodecahedron"):
    threads = fw.weave(fw.shape(name)).threads
    print(f"{name}: {len(threads)} threads of {len(threads[0].crossings)} crossings")
