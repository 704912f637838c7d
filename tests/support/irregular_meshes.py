"""Random meshes such as people bring: triangles of all sizes and shapes."""

import numpy as np
from scipy.spatial import ConvexHull

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


def pieces_of(mesh: tuple[FloatArray, IntArray], **options: object) -> "fw.Pieces":
    """All pieces of a job, as they are cut."""
    return fw.weave(fw.mesh(*mesh), **options).ribbons().pieces()
