"""Satin: over four, under one, never two neighbours at once, where warp and weft exist.

Run it with: python examples/gallery/satin.py satin.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("torus", m=20, n=10, size=SIZE)
weave = fw.weave(mesh, pattern="satin:5/2")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ring in satin",
    f"{sum(weave.threads[0].over)} of {len(weave.threads[0].over)} crossings over",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
