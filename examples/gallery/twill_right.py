"""A 2/1 twill whose diagonal climbs to the right: the hand is part of its name.

Run it with: python examples/gallery/twill_right.py twill_right.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("torus", m=18, n=9, size=SIZE)
weave = fw.weave(mesh, pattern="2/1/1")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ring in 2/1 twill, diagonal to the right",
    f"{sum(weave.threads[0].over)} of {len(weave.threads[0].over)} crossings over",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
