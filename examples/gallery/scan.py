"""A found mesh, given by its path: whatever its faces, plain weave holds everywhere.

Run it with: python examples/gallery/scan.py scan.png
"""

import sys

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.read(sys.argv[1], size=SIZE, up="y", remesh="quads:300")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A found mesh in plain weave",
    f"{len(weave.threads)} threads, exact: {weave.exact}",
    mesh,
    ribbons,
    layout,
    parts=("mesh", "woven", "sheet"),
)
exhibit.tell()
