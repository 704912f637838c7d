"""Make the picture at the front of the README: plain weave, 2/2 twill and a kagome basket.

Run it with: python examples/make_pictures.py examples/woven.png
"""

import sys

from PIL import Image

from fabweave.app.request import complete_settings
from fabweave.app.settings import Settings
from fabweave.app.woven_object import weave_object
from fabweave.picture.camera import choose_view
from fabweave.picture.object_picture import weave_picture
from fabweave.picture.strand_colours import strand_colours
from fabweave.picture.surfaces import ribbon_triangles

OBJECTS = (
    ("shape:sphere", {}),
    ("shape:slit?genus=3", {"pattern": "twill"}),
    ("shape:icosahedron", {"refine": "loop:2", "pattern": "kagome", "open": 0.1}),
)
TILE = (480, 420)

picture = Image.new("RGB", (TILE[0] * len(OBJECTS), TILE[1]), "white")
for number, (shape, options) in enumerate(OBJECTS):
    settings, material = complete_settings(
        Settings(shape, size_mm=400.0, effort="quick", **options)
    )
    woven = weave_object(settings, material)
    vertices, triangles, _ = ribbon_triangles(woven.ribbons)
    colours = strand_colours(woven.weave, woven.bunches, settings.colours)
    view = choose_view(vertices, triangles)
    tile = weave_picture(woven.ribbons, colours, size_px=TILE, view=view, samples=3)
    picture.paste(tile, (number * TILE[0], 0))
# A palette keeps the file small; the eye sees no difference.
picture.quantize(256, dither=Image.Dither.NONE).save(sys.argv[1], optimize=True)
