"""A head, whose scan is woven on a coarser mesh of some 300 quads, in strips of one width.

Run it with: python examples/gallery/nefertiti.py nefertiti.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

BUST = Path(__file__).parents[1] / "meshes" / "nefertiti.obj"
mesh = fw.read(BUST, size=SIZE, up="y", remesh="quads:300")
weave = fw.weave(mesh)
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "Nefertiti in plain weave",
    f"{len(mesh.faces)} quads, {len(layout.pieces)} pieces",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
