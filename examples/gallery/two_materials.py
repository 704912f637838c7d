"""Two materials: warp and weft each from its own, on sheets of its own.

Run it with: python examples/gallery/two_materials.py two_materials.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("torus", m=16, n=8, size=SIZE)
weave = fw.weave(mesh, pattern="twill", colours="material")
ribbons = weave.ribbons(material="warp=card:navy,weft=birch-veneer")
layout = ribbons.pieces().nest(sheet="600x400mm")
exhibit = Exhibit(
    "A ring of card and birch veneer",
    f"{len(layout.sheets)} sheets of two materials",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
