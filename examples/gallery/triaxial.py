"""Triaxial twill: three directions, exact on every mesh once its edges are halved.

Run it with: python examples/gallery/triaxial.py triaxial.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("icosahedron", size=SIZE, refine="loop:1")
# The paper's course covers the surface; straight strips would leave it open.
weave = fw.weave(mesh, pattern="triaxial", course="projection", colours="direction")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A ball in triaxial twill",
    f"{sum(weave.broken.values())} broken conditions in {len(weave.threads)} rings",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
