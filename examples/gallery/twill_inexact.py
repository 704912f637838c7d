"""A rounded cube that has no exact twill, as near as the search comes to one.

Run it with: python examples/gallery/twill_inexact.py twill_inexact.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("cube", size=SIZE, refine="catmull-clark:2")
weave = fw.weave(mesh, pattern="twill")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A rounded cube in 2/2 twill, as near as can be",
    f"{sum(weave.broken.values())} broken conditions",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
