"""Exact 2/2 twill on a surface with thirty holes: no condition is broken anywhere.

At 300 mm its ribbons would be too narrow to cut, so there are none of its pieces here.

Run it with: python examples/gallery/twill_genus_30.py twill_genus_30.png
"""

from studio import SIZE, Exhibit

import fabweave as fw

mesh = fw.shape("slit", genus=30, size=SIZE)
weave = fw.weave(mesh, pattern="twill")
genus = 1 - (len(mesh.vertices) - len(mesh.edges) + len(mesh.faces)) // 2
exhibit = Exhibit(
    "A surface with thirty holes in exact 2/2 twill",
    f"{sum(weave.broken.values())} broken conditions on genus {genus}",
    mesh,
    weave.ribbons(material="warp=card:navy,weft=card:gold"),
)
exhibit.tell()
