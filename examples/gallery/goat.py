"""The head of a goat, woven on a coarser mesh of some 450 quads, in strips of one width.

Run it with: python examples/gallery/goat.py goat.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

GOAT = Path(__file__).parents[1] / "meshes" / "goathead.obj"
mesh = fw.read(GOAT, size=SIZE, up="y", remesh="quads:450")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "The head of a goat in plain weave",
    f"{len(mesh.faces)} quads, {len(layout.pieces)} pieces",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
