"""Small meshes of rings."""

from itertools import pairwise

import numpy as np

from fabweave.mesh.polymesh import PolyMesh

FAN, POLYGON = "fan", "polygon"


def ball(strands: int, rows: int, low: str = POLYGON, high: str = FAN) -> PolyMesh:
    """Return rings of so many strands, closed below and above."""
    ring = np.arange(strands)
    level = [(strands * k + ring).tolist() for k in range(rows + 1)]
    faces = [[a[k - 1], a[k], b[k], b[k - 1]] for a, b in pairwise(level) for k in ring.tolist()]
    count = strands * (rows + 1)
    for end, ways, points in ((low, level[0], -1), (high, level[-1], 1)):
        if end == POLYGON:
            faces.append(ways[::points])
        else:
            faces += [[ways[k - 1], ways[k], count][::points] for k in ring.tolist()]
            count += 1
    turn = 2 * np.pi * np.arange(count) / strands
    return PolyMesh.from_faces(
        np.column_stack([np.cos(turn), np.sin(turn), np.arange(count) // strands]), faces
    )


def chain(ways: list[tuple[int, int]], strands: int = 4) -> PolyMesh:
    """Return a ball that parts into two tubes and joins again, once for each pair of rows.

    Tubes of so many strands have these rows; where they part and join is a vertex of valence 8.
    """
    faces: list[list[int]] = []
    count = 0

    def ring(n: int) -> list[int]:
        nonlocal count
        count += n
        return [*range(count - n, count)]

    def tube(low: list[int], high: list[int], rows: int) -> None:
        lines = [low, *(ring(len(low)) for _ in range(rows - 1)), high]
        for a, b in pairwise(lines):
            faces.extend([a[k - 1], a[k], b[k], b[k - 1]] for k in range(len(a)))

    below = ring(2 * strands)
    faces.append(below[::-1])
    for one, other in ways:
        # Two rings of so many edges that share a vertex are one of twice as many.
        low, high = ring(2 * strands - 1), ring(2 * strands - 1)
        low, high = ([line[0], *line[1:strands], line[0], *line[strands:]] for line in (low, high))
        tube(below, low, 1)
        tube(low[:strands], high[:strands], one)
        tube(low[strands:], high[strands:], other)
        below = ring(2 * strands)
        tube(high, below, 1)
    count += 1
    faces.extend([below[k - 1], below[k], count - 1] for k in range(len(below)))
    return PolyMesh.from_faces(np.random.default_rng(0).normal(size=(count, 3)), faces)
