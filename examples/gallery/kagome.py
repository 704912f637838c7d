"""Kagome: plain weave on triangles, the open basket, with its openings left open.

Run it with: python examples/gallery/kagome.py kagome.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("icosahedron", size=SIZE, refine="loop:2")
weave = fw.weave(mesh, pattern="kagome")
ribbons = weave.ribbons(material="card:sienna", width="open:0.2")
layout = ribbons.pieces(kinds="fewest").nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ball as a kagome basket",
    f"{len(layout.pieces)} pieces of {len(set(layout.pieces.kinds))} kinds",
    mesh,
    ribbons,
    layout,
    parts=("mesh", "woven", "sheet"),
)
exhibit.tell()
