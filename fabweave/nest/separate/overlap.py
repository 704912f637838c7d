"""Find where the pieces on one sheet are near each other: samples against distance fields."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of
from fabweave.nest.separate.item_field import REACH_MM, Body

_BLOCK = 6  # samples that are looked up together at first
_FAR_MM = 1e9


@frozen_value
class Crowd:
    """The bodies on one sheet, laid end to end in arrays: N bodies, S samples, B blocks of them."""

    samples: FloatArray  # (S, 2)
    owner: IntArray  # (S,) the body of each sample
    starts: IntArray  # (N + 1,) where the samples of each body start
    blocks: IntArray  # (B + 1,) where the samples of each block start
    middles: IntArray  # (B,) the sample in the middle of each block
    radii: FloatArray  # (B,) greatest distance of a block's sample from the middle one
    field: FloatArray  # all fields, flat
    first: IntArray  # (N,) where each field starts
    extent: IntArray  # (N, 2) columns and rows of each field
    corner: FloatArray  # (N, 2) of each field
    step: FloatArray  # (N,) of each field
    radius: FloatArray  # (N,) root mean square distance of the samples from the centroid


@frozen_value
class Stand:
    """A crowd at its poses: (N, 3) x, y and angle in radians of each body's centroid."""

    poses: FloatArray
    cosine: FloatArray  # (N,)
    sine: FloatArray  # (N,)
    arm: FloatArray  # (S, 2) from the centroid to each sample
    world: FloatArray  # (S, 2) where each sample stands


def crowd_of(bodies: Sequence[Body]) -> Crowd:
    """Lay bodies end to end.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.separate.item_field import body_of
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 9.0], [0.0, 9.0]]))[0]
    >>> crowd_of([body_of(bar, 2.0)] * 3).starts.tolist()
    [0, 26, 52, 78]
    """
    counts = np.array([len(body.samples) for body in bodies], dtype=np.int64)
    starts = offsets_of(counts)
    sizes = np.array([body.field.size for body in bodies], dtype=np.int64)
    samples = np.concatenate([body.samples for body in bodies])
    blocks = np.concatenate([np.arange(begin, end, _BLOCK) for begin, end in pairwise(starts)])
    ends = np.append(blocks[1:], len(samples))
    middles = (blocks + ends) // 2
    size = ends - blocks
    away = samples - samples[np.repeat(middles, size)]
    return Crowd(
        samples=samples,
        owner=np.repeat(np.arange(len(bodies)), counts),
        starts=starts,
        blocks=np.append(blocks, len(samples)),
        middles=middles,
        radii=np.sqrt(np.maximum.reduceat((away**2).sum(axis=1), blocks)),
        field=np.concatenate([body.field.ravel() for body in bodies]),
        first=offsets_of(sizes)[:-1],
        extent=np.array([body.field.shape[::-1] for body in bodies], dtype=np.int64),
        corner=np.array([body.corner for body in bodies]),
        step=np.array([body.step_mm for body in bodies]),
        radius=np.array([body.radius_mm for body in bodies]),
    )


def stand_at(crowd: Crowd, poses: FloatArray) -> Stand:
    """Return where the samples of a crowd stand."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    c, s = cosine[crowd.owner], sine[crowd.owner]
    x, y = crowd.samples.T
    arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
    return Stand(poses, cosine, sine, arm, arm + poses[crowd.owner, :2])


def local_points(crowd: Crowd, stand: Stand, points: FloatArray, bodies: IntArray) -> FloatArray:
    """Return points (K, 2) in the field coordinates, in steps, of one body each (K,)."""
    away = points - stand.poses[bodies, :2]
    c, s = stand.cosine[bodies], stand.sine[bodies]
    turned = np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], axis=1)
    return (turned - crowd.corner[bodies]) / crowd.step[bodies][:, None]


def distances(
    crowd: Crowd, stand: Stand, points: FloatArray, bodies: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return the signed distance of points from one body each, and its gradient.

    Parameters
    ----------
    crowd, stand
        The bodies and where they stand.
    points : (K, 2) float array
        Points of the sheet, millimetres.
    bodies : (K,) int array
        The body for each.

    Returns
    -------
    distance : (K,) float array
        Very large outside a body's field.
    gradient : (K, 2) float array
        In the coordinates of the sheet.
    """
    u, v = local_points(crowd, stand, points, bodies).T
    columns, rows = crowd.extent[bodies].T
    out = (u < 0.0) | (v < 0.0) | (u >= columns - 1) | (v >= rows - 1)
    column = np.where(out, 0, u).astype(np.int64)
    row = np.where(out, 0, v).astype(np.int64)
    across, up = u - column, v - row
    node = crowd.first[bodies] + row * columns + column
    here, right = crowd.field[node], crowd.field[node + 1]
    above, beyond = crowd.field[node + columns], crowd.field[node + columns + 1]
    low, high = right - here, beyond - above
    lower, upper = here + across * low, above + across * high
    dx, dy = low + up * (high - low), upper - lower
    distance = np.where(out, _FAR_MM, lower + up * dy)
    c, s, step = stand.cosine[bodies], stand.sine[bodies], crowd.step[bodies]
    return distance, np.stack([c * dx - s * dy, s * dx + c * dy], axis=1) / step[:, None]


def near_pairs(
    crowd: Crowd, stand: Stand, near_mm: float, moving: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return samples and the bodies, not their own, that they are nearer to than this.

    Of two bodies one at least is moving. Blocks of samples are looked up first, by the one in
    their middle. What is nearer than ``near_mm`` is found; some that is a little farther may be,
    too.
    """
    low = np.minimum.reduceat(stand.world, crowd.starts[:-1])
    high = np.maximum.reduceat(stand.world, crowd.starts[:-1])
    meet = (low[:, None] - near_mm <= high[None]) & (low[None] - near_mm <= high[:, None])
    both = np.logical_and(meet[..., 0], meet[..., 1]) & (moving[:, None] | moving[None])
    np.fill_diagonal(both, False)
    first, second = np.nonzero(both)
    # The blocks of each first body of a pair, against the second.
    begin = np.searchsorted(crowd.blocks, crowd.starts)
    block, pair = _expanded(begin[first], np.diff(begin)[first])
    body = second[pair]
    points = stand.world[crowd.middles[block]]
    reach = (near_mm + crowd.radii[block])[:, None]
    kept = ((points + reach >= low[body]) & (points - reach <= high[body])).all(axis=1)
    block, body, points, reach = block[kept], body[kept], points[kept], reach[kept, 0]
    # Outside the field nothing is nearer than the field reaches; so there, look at the samples.
    distance, _ = distances(crowd, stand, points, body)
    outside = distance == _FAR_MM
    kept = (distance < np.minimum(reach, near_mm + REACH_MM)) | outside
    # A block whose middle is out of a field by more than the block's size has no sample in it.
    position = local_points(crowd, stand, points[kept], body[kept])
    slack = crowd.radii[block[kept]] / crowd.step[body[kept]]
    beyond = np.maximum(-position, position - (crowd.extent[body[kept]] - 1)).max(axis=1)
    chosen = np.flatnonzero(kept)[beyond <= slack]
    block, body = block[chosen], body[chosen]
    samples, which = _expanded(crowd.blocks[block], crowd.blocks[block + 1] - crowd.blocks[block])
    body = body[which]
    distance, _ = distances(crowd, stand, stand.world[samples], body)
    kept = distance < near_mm
    return samples[kept], body[kept]


def _expanded(begin: IntArray, count: IntArray) -> tuple[IntArray, IntArray]:
    """Return the numbers of all ranges one after another, and the range of each."""
    owner = np.repeat(np.arange(len(count)), count)
    return np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count) + begin[owner], owner
