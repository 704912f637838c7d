"""A trefoil knot, woven: the tube that follows it is a torus, and so has an exact twill.

Run it with: python examples/gallery/knot.py knot.png
"""

from pathlib import Path

from studio import SIZE, Exhibit

import fabweave as fw

KNOT = Path(__file__).parents[1] / "meshes" / "knot.obj"
mesh = fw.read(KNOT, size=SIZE, up="y")
weave = fw.weave(mesh, pattern="twill")
ribbons = weave.ribbons(material="card", width="proportional")
layout = ribbons.pieces().nest(sheet="600x400mm", effort="quick")
exhibit = Exhibit(
    "A trefoil knot in 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions in {len(weave.threads)} threads",
    mesh,
    ribbons,
    layout,
)
exhibit.tell()
