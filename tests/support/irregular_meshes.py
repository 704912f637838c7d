"""Random meshes such as people bring: triangles of all sizes and shapes."""

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

import fabweave as fw
from fabweave.core.arrays import FloatArray, IntArray


def lumpy_ball(seed: int, points: int, lumps: float = 0.2) -> tuple[FloatArray, IntArray]:
    """The hull of random points on a squashed sphere, its vertices moved in and out."""
    rng = np.random.default_rng(seed)
    ball = rng.normal(size=(points, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    faces = ConvexHull(ball).simplices.astype(np.int64)
    outward = np.linalg.det(ball[faces]) > 0
    faces[~outward] = faces[~outward][:, ::-1]
    squash = np.array([1.0, *rng.uniform(0.2, 1.0, 2)])
    bumps = 1.0 + lumps * rng.normal(size=(points, 1)).clip(-2.0, 2.0)
    return ball * bumps * squash, faces


def flat_ball(seed: int, points: int = 80) -> tuple[FloatArray, IntArray]:
    """A lumpy ball, pressed to a quarter of its width, with sharp bends along its rim."""
    vertices, faces = lumpy_ball(seed, points, lumps=0.3)
    return vertices / np.ptp(vertices, axis=0) * (1.0, 0.9, 0.25), faces


def pieces_of(mesh: tuple[FloatArray, IntArray], **options: object) -> "fw.Pieces":
    """All pieces of a job, as they are cut, whether hands could build it or not."""
    return fw.weave(fw.mesh(*mesh), force=True, **options).ribbons().pieces()


def steep_sheet(seed: int, points: int, height: float = 1.5) -> tuple[FloatArray, IntArray]:
    """A triangulation of random points in a square, in waves and bumps much steeper than wide."""
    rng = np.random.default_rng(seed)
    plane = np.concatenate((rng.uniform(size=(points, 2)), [[0, 0], [0, 1], [1, 0], [1, 1]]))
    waves = np.sin(5 * plane[:, 0]) * np.cos(4 * plane[:, 1])
    bumps = waves + 0.3 * rng.normal(size=len(plane))
    return np.column_stack((plane, height * bumps)), Delaunay(plane).simplices.astype(np.int64)
