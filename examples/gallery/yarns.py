"""Yarns in place of ribbons: tubes that touch nowhere, for pictures and for printing.

Run it with: python examples/gallery/yarns.py yarns.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("torus", m=16, n=8, size=SIZE)
weave = fw.weave(mesh, pattern="twill")
yarns = weave.yarns(sides=16)
exhibit = Exhibit(
    "A ring of yarns in 2/2 twill",
    f"{len(yarns.bodies)} yarns, up to {2 * yarns.radius_mm.max():.1f} mm thick",
    mesh,
    yarns,
)
exhibit.tell()
