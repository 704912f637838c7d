"""Make the mesh of the README's job: a lampshade of 16 × 6 quads, open at both ends.

Run it with: python examples/make_lampshade.py examples/lampshade.obj
"""

import sys
from pathlib import Path

import numpy as np

from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.polymesh import PolyMesh

AROUND, ROWS = 16, 6
HEIGHT_MM = 300.0

# Its radius in millimetres at the height t from 0 to 1: a belly, and a narrower neck.
t = np.linspace(0.0, 1.0, ROWS + 1)
radius = 85.0 + 50.0 * np.sin(np.pi * t) - 25.0 * t
# Each row stands half a quad further round than the row below, so that the threads spiral.
angle = 2 * np.pi * (np.arange(AROUND) + 0.5 * np.arange(ROWS + 1)[:, None]) / AROUND
vertices = np.stack(
    (
        radius[:, None] * np.cos(angle),
        radius[:, None] * np.sin(angle),
        np.broadcast_to(HEIGHT_MM * t[:, None], angle.shape),
    ),
    axis=-1,
).reshape(-1, 3)

row, column = np.divmod(np.arange(AROUND * ROWS), AROUND)
right = AROUND * row + (column + 1) % AROUND
above = right + AROUND, AROUND * row + column + AROUND
quads = np.column_stack((AROUND * row + column, right, *above))
Path(sys.argv[1]).write_bytes(obj_bytes(PolyMesh.from_faces(vertices.round(3), quads)))
