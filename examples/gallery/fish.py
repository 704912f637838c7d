"""A fish, whose model is woven on a coarser mesh of some 250 quads, in strips of one width.

Run it with: python examples/gallery/fish.py fish.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

BLUB = Path(__file__).parents[1] / "meshes" / "fish.obj"
mesh = fw.read(BLUB, size=SIZE, up="y", remesh="quads:250")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A fish in plain weave",
    f"{len(mesh.faces)} quads, {len(layout.pieces)} pieces",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
