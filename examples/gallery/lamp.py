"""A lamp: a ball with an opening for the bulb, 80 mm wide, whose rim threads turn back.

Run it with: python examples/gallery/lamp.py lamp.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("sphere", n=4, size=SIZE, leave_out="top:80mm")
weave = fw.weave(mesh, boundary="turn")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A lamp with an opening of 80 mm",
    f"{len(mesh.faces)} of 96 faces are left",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
