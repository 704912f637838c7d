"""Exact 2/2 twill on a ring: no condition is broken anywhere.

Run it with: python examples/gallery/twill_genus_1.py twill_genus_1.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("torus", m=16, n=8, size=SIZE)
weave = fw.weave(mesh, pattern="twill")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ring in exact 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
