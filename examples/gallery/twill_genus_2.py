"""Exact 2/2 twill on a surface with two holes: no condition is broken anywhere.

Run it with: python examples/gallery/twill_genus_2.py twill_genus_2.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("slit", genus=2, size=SIZE)
weave = fw.weave(mesh, pattern="twill")
ribbons = weave.ribbons(material="warp=card:navy,weft=card:gold")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A surface with two holes in exact 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions",
    mesh,
    ribbons,
    layout,
    parts=("mesh", "woven", "sheet"),
)
exhibit.tell()
