"""A koala, whose model is woven on a coarser mesh of some 350 quads, in strips of one width.

Run it with: python examples/gallery/koala.py koala.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

KOALA = Path(__file__).parents[1] / "meshes" / "koala.obj"
mesh = fw.read(KOALA, size=SIZE, up="y", remesh="quads:350")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A koala in plain weave",
    f"{len(mesh.faces)} quads, {len(layout.pieces)} pieces",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
