"""Exact 2/2 twill on a surface with three holes: no condition is broken anywhere.

Run it with: python examples/gallery/twill_genus_3.py twill_genus_3.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("regular", face=8, valence=4, genus=3, size=SIZE)
weave = fw.weave(mesh, pattern="twill")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A surface with three holes in exact 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
