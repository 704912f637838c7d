"""Build solids of thin walls, and surfaces of revolution."""

from itertools import pairwise

import numpy as np

from fabweave.mesh.polymesh import PolyMesh


def revolved(profile, count=40):
    """Return a surface of revolution of quads, and triangles at its axis."""
    turn = 2.0 * np.pi * np.arange(count) / count
    points, rings = [], []
    ends = profile[:-1] if profile[0] == profile[-1] else profile
    for radius, height in ends:
        rings.append([len(points) + k * (radius > 0.0) for k in range(count)])
        some = turn if radius > 0.0 else turn[:1]
        points += [[radius * np.cos(a), radius * np.sin(a), height] for a in some]
    rings += rings[:1] * (len(profile) - len(ends))
    faces = [
        list(dict.fromkeys([low[k], low[(k + 1) % count], high[(k + 1) % count], high[k]]))
        for low, high in pairwise(rings)
        for k in range(count)
    ]
    return PolyMesh.from_faces(points, faces)


def opened_box(thick, x=80.0, y=60.0, z=50.0):
    """Return a box without a lid, of walls of some thickness."""
    corners = np.array([(0, 0), (x, 0), (x, y), (0, y)], dtype=float)
    inner = np.clip(corners, thick, (x - thick, y - thick))
    rings = [(corners, 0.0), (corners, z), (inner, z), (inner, thick)]
    points = [[*place, height] for ring, height in rings for place in ring]
    faces = [[3, 2, 1, 0], [12, 13, 14, 15]]
    faces += [
        [low + k, low + (k + 1) % 4, low + 4 + (k + 1) % 4, low + 4 + k]
        for low in (0, 4, 8)
        for k in range(4)
    ]
    return PolyMesh.from_faces(points, faces)
