"""Separate the items of one sheet until all keep the gap, moving and turning all of them at once.

The overlap of two items is measured at samples of their outlines in each other's distance field.
Each step linearises these distances in the motions of all items, and solves for the least motion
that separates what is too near (Levenberg and Marquardt's method). It knows nothing of
permutations: items slide and turn, they do not jump.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.spatial import cKDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    frozen_value,
    offsets_of,
    places_in_groups,
)
from fabweave.nest.container import Container
from fabweave.nest.item_shape import ItemShape
from fabweave.nest.place.raster import closed_sides, filled_pixels, ring_sides


@dataclass(frozen=True)
class SeparationConfig:
    """The numbers of the separation; lengths are millimetres.

    Where no reason stands, a value was set by trial.
    """

    #: Between nodes of a field's grid, and between samples of an outline there. Both are in
    #: proportion less where the shape's mean width is less than ``steps_across`` steps, which may
    #: be this short.
    cell_mm: float = 2.0
    sample_mm: float = 3.0
    steps_across: float = 3.0
    least_step_mm: float = 0.2
    #: Cells of a field: a larger shape has a coarser grid.
    most_cells: int = 60_000
    #: Samples of an outline in a step, from which distances of nodes are measured.
    fine: float = 8.0
    #: Vertices that are off the line by less are not corners and need no sample.
    straight_mm: float = 0.05
    #: How far beyond the gap a field reaches: more than ``near_mm`` and some steps.
    reach_mm: float = 14.0
    #: How many samples are looked up together at first.
    block: int = 6
    #: Between nodes of the field of what is barred; more where a sheet has more than so many cells.
    barred_step_mm: float = 1.0
    barred_cells: int = 250_000
    #: The distance that is aimed at is larger than the gap by this, and what may be missing from it
    #: in the end: less, so that the gap is kept.
    spare_mm: float = 0.1
    done_mm: float = 0.09
    #: Pairs this much wider than the gap are kept for the next steps: as long as none of both has
    #: gone half as far, no pair is missed.
    near_mm: float = 6.0
    #: The longest motion in one step.
    step_mm: float = 3.0
    #: How much farther an item's outermost sample moves than one at its mean radius, about.
    outermost: float = 1.5
    #: Damping of a step: a share of the mean stiffness, and the least.
    damping: float = 0.01
    least_damping: float = 1e-3
    #: How much stiffer than items the border is.
    border: float = 3.0
    #: Poses are rounded to this fraction of a millimetre and of a radian, a power of two: no last
    #: bit is carried on.
    grain: float = 4096.0
    #: In so many steps the overlap must come down to this share, or the items are given up.
    patience: int = 12
    patience_share: float = 0.9


CONFIG = SeparationConfig()
#: The distance, millimetres, of what lies outside an item's field.
_FAR_MM = 1e9


@frozen_value
class ItemField:
    """A shape around its centroid, sampled, with its distance field.

    Parameters
    ----------
    outline : (K, 2) float array
        The shape's outline; its centroid is the origin.
    centre : (2,) float array
        That centroid in the shape's own frame.
    samples : (S, 2) float array
        Points along the outline, its vertices among them.
    distance : (H, W) float array
        Signed distance to the outline, negative inside, at the nodes of a grid.
    corner : (2,) float array
        Where the first node stands.
    step_mm : float
        Distance between nodes.
    radius_mm : float
        Root mean square distance of the samples from the centroid.
    area_mm2 : float
        Area of the shape.
    """

    outline: FloatArray
    centre: FloatArray
    samples: FloatArray
    distance: FloatArray
    corner: FloatArray
    step_mm: float
    radius_mm: float
    area_mm2: float


def item_field(shape: ItemShape, gap_mm: float) -> ItemField:
    """Return the field of a shape, which reaches somewhat beyond the gap.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 10.0], [0.0, 10.0]]))[0]
    >>> item = item_field(bar, 2.0)
    >>> bool(-5.0 <= item.distance.min() <= -4.0), item.centre.round(6).tolist()
    (True, [15.0, 5.0])
    """
    polygon = shapely.polygons(shape.outline)
    centre = shapely.get_coordinates(shapely.centroid(polygon))[0]
    outline = shape.outline - centre
    reach = gap_mm + CONFIG.reach_mm
    low, high = outline.min(axis=0) - reach, outline.max(axis=0) + reach
    width = shape.area_mm2 / max(float(shapely.length(polygon)) / 2.0, 1e-9)
    fine = max(width / CONFIG.steps_across, CONFIG.least_step_mm)
    least = float(np.sqrt(np.prod(high - low) / CONFIG.most_cells))
    step = max(min(CONFIG.cell_mm, fine), least)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    nodes = (int(rows), int(columns))
    distance = _node_distances(closed_sides(outline), low, nodes, step, reach)
    corners = shapely.get_coordinates(
        shapely.simplify(shapely.polygons(outline), CONFIG.straight_mm)
    )
    samples = _along(closed_sides(corners[:-1]), step * CONFIG.sample_mm / CONFIG.cell_mm)
    return ItemField(
        outline=outline,
        centre=centre,
        samples=samples,
        distance=distance,
        corner=low,
        step_mm=step,
        radius_mm=max(float(np.sqrt((samples**2).sum(axis=1).mean())), 1e-3),
        area_mm2=shape.area_mm2,
    )


def signed_distance_field(
    region: shapely.Geometry, low: FloatArray, high: FloatArray, step_mm: float, reach_mm: float
) -> FloatArray:
    """Return the signed distance to polygons, negative in them, at the nodes of a grid.

    Parameters
    ----------
    region : polygon or multipolygon
        May have holes.
    low, high : (2,) float array
        The first node, and what the last one reaches.
    step_mm : float
        Between nodes.
    reach_mm : float
        Beyond this, distances are this.

    Examples
    --------
    >>> import numpy as np
    >>> field = signed_distance_field(
    ...     shapely.box(0.0, 0.0, 2.0, 9.0), np.zeros(2), np.array([4.0, 9.0]), 1.0, 9.0
    ... )
    >>> field[4, 3:].round(2).tolist()
    [1.0, 2.0]
    """
    columns, rows = (np.ceil((high - low) / step_mm).astype(int) + 1).tolist()
    return _node_distances(ring_sides(region), low, (rows, columns), step_mm, reach_mm)


def _node_distances(
    sides: FloatArray, low: FloatArray, shape: tuple[int, int], step: float, reach: float
) -> FloatArray:
    """Return the signed distance to the closed sides (E, 2, 2) of rings at the nodes of a grid."""
    rows, columns = shape
    # Pixel centres are half a step from the corner: nodes are the centres of pixels around them.
    inside = filled_pixels((sides - low + step / 2.0)[None], shape, step)[0]
    nodes = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) * step + low
    near, _ = cKDTree(_along(sides, step / CONFIG.fine)).query(
        nodes.reshape(-1, 2), distance_upper_bound=reach
    )
    distance = np.minimum(near, reach).reshape(rows, columns)
    return np.where(inside, -distance, distance)


def _along(sides: FloatArray, step: float) -> FloatArray:
    """Return points along sides (E, 2, 2), at most a step apart, their first ends among them."""
    outline, side = sides[:, 0], sides[:, 1] - sides[:, 0]
    count = np.maximum(np.ceil(np.hypot(side[:, 0], side[:, 1]) / step), 1).astype(int)
    owner = np.repeat(np.arange(len(outline)), count)
    share = places_in_groups(count) / count[owner]
    return outline[owner] + share[:, None] * side[owner]


@frozen_value
class ItemArrays:
    """The fields of N items, laid end to end: S samples of outlines, in B blocks."""

    samples: FloatArray  # (S, 2)
    owner: IntArray  # (S,) the item of each sample
    starts: IntArray  # (N + 1,) where the samples of each item start
    blocks: IntArray  # (B + 1,) where the samples of each block start
    middles: IntArray  # (B,) the sample in the middle of each block
    radii: FloatArray  # (B,) greatest distance of a block's sample from the middle one
    field: FloatArray  # the distances of all fields, flat
    first: IntArray  # (N,) where each field starts
    extent: IntArray  # (N, 2) columns and rows of each field
    corner: FloatArray  # (N, 2) of each field
    step: FloatArray  # (N,) of each field
    radius: FloatArray  # (N,) root mean square distance of the samples from the centroid


@frozen_value
class PlacedItems:
    """Items at their poses on one sheet."""

    arrays: ItemArrays
    poses: FloatArray  # (N, 3) x, y and angle in radians of each item's centroid
    cosine: FloatArray  # (N,)
    sine: FloatArray  # (N,)
    arm: FloatArray  # (S, 2) from the centroid to each sample
    points: FloatArray  # (S, 2) where each sample is

    @property
    def low(self) -> FloatArray:
        """The least corner of each item's samples, (N, 2)."""
        return np.minimum.reduceat(self.points, self.arrays.starts[:-1])

    @property
    def high(self) -> FloatArray:
        """Their greatest corner, (N, 2)."""
        return np.maximum.reduceat(self.points, self.arrays.starts[:-1])


def item_arrays(items: Sequence[ItemField]) -> ItemArrays:
    """Lay the fields of items end to end.

    Examples
    --------
    >>> import numpy as np
    >>> from fabweave.nest.separate.separation import item_field
    >>> from fabweave.nest.item_shape import shape_of
    >>> bar = shape_of(np.array([[0.0, 0.0], [30.0, 0.0], [30.0, 9.0], [0.0, 9.0]]))[0]
    >>> item_arrays([item_field(bar, 2.0)] * 3).starts.tolist()
    [0, 26, 52, 78]
    """
    counts = np.array([len(item.samples) for item in items], dtype=np.int64)
    starts = offsets_of(counts)
    sizes = np.array([item.distance.size for item in items], dtype=np.int64)
    samples = np.concatenate([item.samples for item in items])
    blocks = np.concatenate(
        [np.arange(begin, end, CONFIG.block) for begin, end in pairwise(starts)]
    )
    ends = np.append(blocks[1:], len(samples))
    middles = (blocks + ends) // 2
    size = ends - blocks
    away = samples - samples[np.repeat(middles, size)]
    return ItemArrays(
        samples=samples,
        owner=np.repeat(np.arange(len(items)), counts),
        starts=starts,
        blocks=np.append(blocks, len(samples)),
        middles=middles,
        radii=np.sqrt(np.maximum.reduceat((away**2).sum(axis=1), blocks)),
        field=np.concatenate([item.distance.ravel() for item in items]),
        first=offsets_of(sizes)[:-1],
        extent=np.array([item.distance.shape[::-1] for item in items], dtype=np.int64),
        corner=np.array([item.corner for item in items]),
        step=np.array([item.step_mm for item in items]),
        radius=np.array([item.radius_mm for item in items]),
    )


def place_items(arrays: ItemArrays, poses: FloatArray) -> PlacedItems:
    """Return items at poses (N, 3)."""
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    c, s = cosine.take(arrays.owner), sine.take(arrays.owner)
    x, y = arrays.samples.T
    arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
    return PlacedItems(arrays, poses, cosine, sine, arm, arm + poses[arrays.owner, :2])


def _field_coordinates(placed: PlacedItems, points: FloatArray, items: IntArray) -> FloatArray:
    """Return points (K, 2) in steps from the first node of one item's field each, (2, K)."""
    # Taken column by column, which is twice as fast as rows.
    left, low, x0, y0 = (
        column.take(items) for column in (*placed.arrays.corner.T, *placed.poses.T[:2])
    )
    c, s, step = (of.take(items) for of in (placed.cosine, placed.sine, placed.arrays.step))
    x, y = points[:, 0] - x0, points[:, 1] - y0
    return np.stack([(c * x + s * y - left) / step, (c * y - s * x - low) / step])


@frozen_value
class _Corners:
    """Where K points are in one item's field each, with the four nodes around each."""

    out: BoolArray  # (K,) beyond the field
    across: FloatArray  # (K,) share of a step from the left nodes
    up: FloatArray  # (K,) and from the lower ones
    nodes: tuple[FloatArray, ...]  # (K,) each: lower left, lower right, upper left, upper right


def _corners(placed: PlacedItems, points: FloatArray, items: IntArray) -> _Corners:
    """Look points (K, 2) up in one item's field each."""
    arrays = placed.arrays
    u, v = _field_coordinates(placed, points, items)
    columns, rows = (extent.take(items) for extent in arrays.extent.T)
    out = (u < 0.0) | (v < 0.0) | (u >= columns - 1) | (v >= rows - 1)
    column = np.where(out, 0, u).astype(np.int64)
    row = np.where(out, 0, v).astype(np.int64)
    node = arrays.first.take(items) + row * columns + column
    nodes = tuple(arrays.field.take(node + by) for by in (0, 1, columns, columns + 1))
    return _Corners(out, u - column, v - row, nodes)


def distances(placed: PlacedItems, points: FloatArray, items: IntArray) -> FloatArray:
    """Return the signed distance of points from one item each.

    Parameters
    ----------
    placed : PlacedItems
    points : (K, 2) float array
        Points of the sheet, millimetres.
    items : (K,) int array
        The item for each.

    Returns
    -------
    (K,) float array
        Very large outside an item's field.
    """
    at = _corners(placed, points, items)
    here, right, above, beyond = at.nodes
    lower = here + at.across * (right - here)
    upper = above + at.across * (beyond - above)
    return np.where(at.out, _FAR_MM, lower + at.up * (upper - lower))


def gradients(placed: PlacedItems, points: FloatArray, items: IntArray) -> FloatArray:
    """Return the gradient of :func:`distances` in the coordinates of the sheet, (K, 2)."""
    at = _corners(placed, points, items)
    here, right, above, beyond = at.nodes
    low, high = right - here, beyond - above
    dx, dy = low + at.up * (high - low), above + at.across * high - (here + at.across * low)
    c, s, step = (of.take(items) for of in (placed.cosine, placed.sine, placed.arrays.step))
    return np.stack([c * dx - s * dy, s * dx + c * dy], axis=1) / step[:, None]


def near_samples(
    placed: PlacedItems, near_mm: float, moving: BoolArray
) -> tuple[IntArray, IntArray]:
    """Return samples, and the items, not their own, that they are nearer to than this.

    Of two items one at least is moving. Blocks of samples are looked up first, by the one in
    their middle. What is nearer than ``near_mm`` is found; some that is a little farther may be,
    too.
    """
    arrays, low, high = placed.arrays, placed.low, placed.high
    meet = (low[:, None] - near_mm <= high[None]) & (low[None] - near_mm <= high[:, None])
    both = np.logical_and(meet[..., 0], meet[..., 1]) & (moving[:, None] | moving[None])
    np.fill_diagonal(both, False)
    first, second = np.nonzero(both)
    # The blocks of each first item of a pair, against the second.
    begin = np.searchsorted(arrays.blocks, arrays.starts)
    block, pair = _ranges(begin[first], np.diff(begin)[first])
    item = second[pair]
    points = placed.points[arrays.middles[block]]
    reach = (near_mm + arrays.radii[block])[:, None]
    kept = ((points + reach >= low[item]) & (points - reach <= high[item])).all(axis=1)
    block, item, points, reach = block[kept], item[kept], points[kept], reach[kept, 0]
    # Outside the field nothing is nearer than the field reaches; so there, look at the samples.
    distance = distances(placed, points, item)
    outside = distance == _FAR_MM
    kept = (distance < np.minimum(reach, near_mm + CONFIG.reach_mm)) | outside
    # A block whose middle is out of a field by more than the block's size has no sample in it.
    position = _field_coordinates(placed, points[kept], item[kept])
    slack = arrays.radii[block[kept]] / arrays.step[item[kept]]
    beyond = np.maximum(-position, position - (arrays.extent[item[kept]].T - 1)).max(axis=0)
    near = np.flatnonzero(kept)[beyond <= slack]
    block, item = block[near], item[near]
    begin = arrays.blocks[block]
    samples, which = _ranges(begin, arrays.blocks[block + 1] - begin)
    item = item[which]
    distance = distances(placed, placed.points[samples], item)
    kept = distance < near_mm
    return samples[kept], item[kept]


def _ranges(begin: IntArray, count: IntArray) -> tuple[IntArray, IntArray]:
    """Return the numbers of all ranges one after another, and the range of each."""
    owner = np.repeat(np.arange(len(count)), count)
    return begin[owner] + places_in_groups(count), owner


@frozen_value
class ObstacleField:
    """What is barred, as an item that never moves."""

    barred: shapely.Geometry
    placed: PlacedItems

    def distances(self, points: FloatArray) -> FloatArray:
        """Return the signed distance of points (K, 2) from what is barred."""
        return distances(self.placed, points, np.zeros(len(points), dtype=np.int64))

    def gradients(self, points: FloatArray) -> FloatArray:
        """Return its gradient, (K, 2)."""
        return gradients(self.placed, points, np.zeros(len(points), dtype=np.int64))


def obstacle_field(container: Container, gap_mm: float) -> ObstacleField | None:
    """Return the field of what is barred in a container; None if nothing is.

    Examples
    --------
    >>> container = Container((80.0, 60.0), shapely.box(20.0, 20.0, 30.0, 30.0))
    >>> field = obstacle_field(container, 2.0)
    >>> field.distances(np.array([[25.0, 33.0], [25.0, 21.5]])).round(2).tolist()
    [3.0, -1.5]
    """
    if container.barred is None:
        return None
    reach = gap_mm + CONFIG.reach_mm
    low, high = np.full(2, -reach), np.array(container.size_mm) + reach
    step = max(CONFIG.barred_step_mm, float(np.sqrt(np.prod(high - low) / CONFIG.barred_cells)))
    # Beyond the usable area nothing is nearer than its rim, which the border keeps.
    deep = float(np.hypot(*container.size_mm))
    item = ItemField(
        outline=np.zeros((1, 2)),
        centre=np.zeros(2),
        samples=np.zeros((1, 2)),
        distance=signed_distance_field(container.barred, low, high, step, deep),
        corner=low,
        step_mm=step,
        radius_mm=1.0,
        area_mm2=0.0,
    )
    return ObstacleField(container.barred, place_items(item_arrays([item]), np.zeros((1, 3))))


def separate(
    arrays: ItemArrays,
    poses: FloatArray,
    container: Container,
    gap_mm: float,
    *,
    steps: int,
    pull_mm: tuple[float, float] = (0.0, 0.0),
    pulls: int = 0,
    obstacle: ObstacleField | None = None,
    moving: BoolArray | None = None,
) -> FloatArray | None:
    """Move the items of a sheet until they keep the gap, or give up.

    Parameters
    ----------
    arrays : ItemArrays
        N items.
    poses : (N, 3) float array
        Where they are: centroids in millimetres from the corner of the usable area, and angles in
        radians.
    container : Container
        The usable area, and the angles at which items may lie; the poses must keep this rule.
    gap_mm : float
        The least distance.
    steps : int
        How many steps to try.
    pull_mm : (float, float)
        How far free items move in each of the first ``pulls`` steps.
    pulls : int
        How many steps pull.
    obstacle : ObstacleField, optional
        What items keep the gap from besides.
    moving : (N,) bool array, optional
        The items that may move; the others keep the gap from one another, and stay. All may move
        unless this is given.

    Returns
    -------
    (N, 3) float array or None
        Poses that keep the gap as far as samples say: for a proof, distances must be measured
        exactly. None if that takes too long, or the overlap no longer becomes less.
    """
    aim = gap_mm + CONFIG.spare_mm
    moving = np.ones(len(poses), dtype=np.bool_) if moving is None else moving
    usable, rotations = np.array(container.size_mm), container.rotations
    drift = np.inf
    energies: list[float] = []
    for step in range(steps + pulls):
        placed = place_items(arrays, poses)
        if drift > CONFIG.near_mm:
            samples, items = near_samples(placed, aim + CONFIG.near_mm, moving)
            drift = 0.0
        equations = _normal_equations(placed, samples, items, usable, aim, obstacle, moving)
        if step >= pulls:
            if equations.worst_mm < CONFIG.done_mm:
                if 2.0 * drift <= CONFIG.near_mm:
                    return poses
                drift = np.inf
                continue
            energies.append(equations.energy)
            if (
                len(energies) > CONFIG.patience
                and energies[-1] > CONFIG.patience_share * energies[-1 - CONFIG.patience]
            ):
                return None
        force, matrix = equations.force.copy(), equations.matrix.copy()
        stiff = np.diag(matrix)
        if rotations.fixed:
            matrix[2::3] = matrix[:, 2::3] = force[:, 2] = 0.0
        damping = (
            CONFIG.damping * float(stiff.sum()) / max(int((stiff > 0.0).sum()), 1)
            + CONFIG.least_damping
        )
        matrix[np.diag_indices(len(matrix))] += damping
        if step < pulls:
            force[:, :2] += damping * np.array(pull_mm)
        move = np.linalg.solve(matrix, force.ravel()).reshape(-1, 3)
        size = np.sqrt((move**2).sum(axis=1))
        move *= np.minimum(1.0, CONFIG.step_mm / np.maximum(size, 1e-9))[:, None]
        drift += float(np.minimum(size, CONFIG.step_mm).max(initial=0.0)) * CONFIG.outermost
        move[:, 2] /= arrays.radius[moving]
        moved = np.round((poses[moving] + move) * CONFIG.grain) / CONFIG.grain
        moved[:, 2] = rotations.nearest(moved[:, 2])
        poses = poses.copy()
        poses[moving] = moved
    return None


@frozen_value
class _NormalEquations:
    """The normal equations of one step for the M moving items, and the overlap."""

    matrix: FloatArray  # (3 M, 3 M)
    force: FloatArray  # (M, 3)
    worst_mm: float  # what the worst sample misses
    energy: float  # sum of squares of what is missing


def _normal_equations(
    placed: PlacedItems,
    samples: IntArray,
    items: IntArray,
    usable: FloatArray,
    aim: float,
    obstacle: ObstacleField | None,
    moving: BoolArray,
) -> _NormalEquations:
    """Return the equations that correct the distances of samples from items below the aim."""
    arrays, points = placed.arrays, placed.points
    # What does not move shares one more place in the equations, which is dropped.
    count = int(moving.sum())
    place = np.where(moving, np.cumsum(moving) - 1, count)
    distance = distances(placed, points[samples], items)
    hit = distance < aim
    samples, items = samples[hit], items[hit]
    normal = gradients(placed, points[samples], items)
    missing = aim - distance[hit]
    owner = arrays.owner[samples]
    arm, other_arm = placed.arm[samples], points[samples] - placed.poses[items, :2]
    rows = np.concatenate(
        [
            normal,
            _lever(arm, normal, arrays.radius[owner]),
            -normal,
            -_lever(other_arm, normal, arrays.radius[items]),
        ],
        axis=1,
    )
    # The border: what is outside, or would be with the aim's spare.
    beyond = np.concatenate([-points, points - usable], axis=1) + CONFIG.spare_mm
    beyond[~moving[arrays.owner]] = 0.0
    outside, side = np.nonzero(beyond > 0.0)
    inward = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[side]
    excess = beyond[outside, side]
    if obstacle is not None:
        apart = obstacle.distances(points)
        near = np.flatnonzero((apart < aim) & moving[arrays.owner])
        outside = np.concatenate([outside, near])
        inward = np.concatenate([inward, obstacle.gradients(points[near])])
        excess = np.concatenate([excess, aim - apart[near]])
    border_owner = arrays.owner[outside]
    lever = _lever(placed.arm[outside], inward, arrays.radius[border_owner])
    walls = np.concatenate([inward, lever, np.zeros((len(outside), 3))], axis=1) * CONFIG.border
    rows = np.concatenate([rows, walls])
    residual = np.concatenate([missing, CONFIG.border * excess])
    pairs = [np.append(owner, border_owner), np.append(items, border_owner)]
    column = 3 * place[np.stack(pairs, axis=1)]
    column = (column[:, :, None] + np.arange(3)).reshape(-1, 6)
    size = 3 * (count + 1)
    cell = (column[:, :, None] * size + column[:, None, :]).ravel()
    weight = (rows[:, :, None] * rows[:, None, :]).ravel()
    # Of nothing, bincount returns counts: whole numbers.
    matrix = np.bincount(cell, weight, minlength=size * size).astype(np.float64)
    forces = (rows * residual[:, None]).ravel()
    force = np.bincount(column.ravel(), forces, minlength=size).astype(np.float64)
    return _NormalEquations(
        matrix=matrix.reshape(size, size)[:-3, :-3],
        force=force[:-3].reshape(count, 3),
        worst_mm=max(float(missing.max(initial=0.0)), float(excess.max(initial=0.0))),
        energy=float((residual**2).sum()),
    )


def _lever(arm: FloatArray, normal: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how turning an item by one over its radius moves a point along a normal, (K, 1)."""
    return ((arm[:, 0] * normal[:, 1] - arm[:, 1] * normal[:, 0]) / radius)[:, None]
