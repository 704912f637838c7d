"""A found mesh, given by its path: whatever its faces, plain weave holds everywhere.

What can be cut of it, and at which size, ``fabweave inspect`` tells.

Run it with: python examples/gallery/scan.py cow.obj cow.png
"""

import sys

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.read(sys.argv[1], size=SIZE, up="y", remesh="quads:300")
weave = fw.weave(mesh)
exhibit = Exhibit(
    "A found mesh in plain weave",
    f"{len(weave.threads)} threads, exact: {weave.exact}",
    mesh,
    weave.ribbons(material="card"),
    parts=("mesh", "woven"),
)
exhibit.tell()
