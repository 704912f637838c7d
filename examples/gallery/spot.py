"""A cow, whose model is woven on a coarser mesh of some 300 quads, in strips of one width.

Run it with: python examples/gallery/spot.py spot.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

COW = Path(__file__).parents[1] / "meshes" / "spot.obj"
mesh = fw.read(COW, size=SIZE, up="y", remesh="quads:300")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A cow in plain weave",
    f"{len(mesh.faces)} quads, {len(layout.pieces)} pieces",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
