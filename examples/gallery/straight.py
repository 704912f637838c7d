"""Straight strips: each ring of a kagome ball is one rectangle, and rows of them fill the sheet.

Run it with: python examples/gallery/straight.py straight.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("icosahedron", size=SIZE, refine="loop:2")
weave = fw.weave(mesh, pattern="kagome")
ribbons = weave.ribbons(material="card:sienna", strips="straight")
pieces = ribbons.pieces(sheet="1000x700mm", joint="tuck", fastener="none")
layout = pieces.nest(effort="quick")
exhibit = Exhibit(
    "A ball of straight strips",
    f"{len(weave.threads)} rings of {len(layout.pieces)} rectangles",
    mesh,
    ribbons,
    layout,
    parts=("woven", "sheet"),
)
exhibit.tell()
