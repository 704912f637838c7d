"""An open basket whose threads turn back at the rim, as in a plaited mat.

Run it with: python examples/gallery/basket.py basket.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

SHADE = Path(__file__).parents[1] / "lampshade.obj"
mesh = fw.read(SHADE, size=SIZE)
weave = fw.weave(mesh, pattern="twill", boundary="turn")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A lampshade with turned rims in 2/2 twill",
    f"{len(weave.threads)} threads, {len(weave.crossings)} crossings",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
