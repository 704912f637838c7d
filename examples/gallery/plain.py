"""Plain weave on a ball: over one, under one, on any mesh.

Run it with: python examples/gallery/plain.py plain.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("sphere", n=5, size=SIZE)
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ball in plain weave",
    f"{len(weave.threads)} rings, exact: {weave.exact}",
    mesh,
    ribbons,
    layout,
    parts=("mesh", "woven", "sheet"),
)
exhibit.tell()
