"""Make the mesh of a trefoil knot: a tube of 66 × 8 quads, so that it is a torus to threads.

Run it with: python examples/make_knot.py examples/meshes/knot.obj
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from fabweave.core.arrays import FloatArray
from fabweave.mesh.io.text import obj_bytes
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.shapes.grids import grid_quads

#: Turns around the axis and around the ring; quads along the knot and around its tube.
P, Q, ALONG, AROUND = 2, 3, 66, 8
#: Radii of the ring, of the torus that the knot winds around, and of the tube.
RING, TORUS, TUBE = 1.0, 0.5, 0.31


def curve(turn: FloatArray) -> FloatArray:
    """Return places on the knot."""
    out = RING + TORUS * np.cos(Q * turn)
    return np.stack([out * np.cos(P * turn), out * np.sin(P * turn), -TORUS * np.sin(Q * turn)], 1)


# At even distances along the knot.
fine = np.linspace(0.0, 2 * np.pi, 4000)
steps = np.linalg.norm(np.diff(curve(fine), axis=0), axis=1)
far = np.concatenate([[0.0], np.cumsum(steps)])
middle = curve(np.interp(np.arange(ALONG) * far[-1] / ALONG, far, fine))
tangent = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
tangent /= np.linalg.norm(tangent, axis=1)[:, None]

# A frame turns as little as it can from place to place, and a little more so that it closes up.
normals = [np.cross(tangent[0], [0.0, 0.0, 1.0]) / np.linalg.norm(tangent[0, :2])]
for here, there in zip(tangent, np.roll(tangent, -1, axis=0), strict=True):
    axis = np.cross(here, there)
    angle = np.arctan2(np.linalg.norm(axis), here @ there)
    axis *= angle / np.linalg.norm(axis)
    normals.append(Rotation.from_rotvec(axis).apply(normals[-1]))
first, last = normals[0], normals.pop()
missing = np.arctan2(np.cross(first, last) @ tangent[0], last @ first)
turns = missing * np.arange(ALONG)[:, None] / ALONG + 2 * np.pi * np.arange(AROUND) / AROUND
normal, across = np.array(normals)[:, None], np.cross(normals, tangent)[:, None]
ring = np.cos(turns)[..., None] * normal + np.sin(turns)[..., None] * across
places = (middle[:, None] + TUBE * ring).reshape(-1, 3)

# y points up, and the largest dimension is 1.
places = places[:, [0, 2, 1]] * [1.0, 1.0, -1.0] / np.ptp(places, axis=0).max()
quads = grid_quads(ALONG, AROUND, wrap=(True, True))
Path(sys.argv[1]).write_bytes(obj_bytes(PolyMesh.from_faces(places.round(6), quads)))
