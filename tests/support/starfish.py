"""A body with limbs."""

import numpy as np

from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.subdivide import parse_refinements, refine_mesh
from fabweave.mesh.triangulate import triangulate


def starfish(arms=5, reach=150.0, open_at=None):
    """Return a body with so many limbs; one may be open at its end."""
    turn = 2 * np.pi * np.arange(arms) / arms
    ring = [25 * np.array([np.cos(a - np.pi / arms), np.sin(a - np.pi / arms)]) for a in turn]
    flat, quads, sides = [*ring], [], []
    for k, angle in enumerate(turn):
        way = np.array([np.cos(angle), np.sin(angle)])
        right, left = k, (k + 1) % arms
        for far in np.linspace(25, reach, 6)[1:]:
            flat += [
                far * way + 14 * np.array([way[1], -way[0]]),
                far * way + 14 * np.array([-way[1], way[0]]),
            ]
            new_right, new_left = len(flat) - 2, len(flat) - 1
            quads.append([right, new_right, new_left, left])
            sides += [[right, new_right], [new_left, left]]
            right, left = new_right, new_left
        if k != open_at:
            sides.append([right, left])
    n, count = len(flat), np.array(flat)
    points = np.concatenate([np.column_stack([count, np.full(n, z)]) for z in (-14.0, 14.0)])
    top = [[v + n for v in face] for face in ([*range(arms)], *quads)]
    under = [face[::-1] for face in ([*range(arms)], *quads)]
    around = [[a, b, b + n, a + n] for a, b in sides]
    body = PolyMesh.from_faces(points, [*top, *under, *around])
    return triangulate(refine_mesh(body, parse_refinements("catmull-clark:2")))
