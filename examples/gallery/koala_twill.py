"""A koala in an exact 2/2 twill: its mesh is laid in rows, and the height of a row gives the twist.

Run it with: python examples/gallery/koala_twill.py koala_twill.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

KOALA = Path(__file__).parents[1] / "meshes" / "koala.obj"
mesh = fw.read(KOALA, size=SIZE, up="y", remesh="rings:300")
weave = fw.weave(mesh, pattern="twill", colours="safe")
ribbons = weave.ribbons(material="card")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A koala in 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions in {len(weave.threads)} threads",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
