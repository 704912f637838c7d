"""Lay a grid over a surface that has quads without any irregular vertex: a disc, a tube, a torus.

A chart maps the surface to a rectangle whose sides may be joined, by two harmonic functions; rows
and columns are lines of the chart, spaced evenly in space.
"""

from collections.abc import Iterator
from itertools import combinations, pairwise
from math import gcd

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    flags,
    frozen,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.automorphisms import find_symmetry
from fabweave.mesh.halfedge import Halfedges, build_halfedges, group_edges
from fabweave.mesh.mirror import Mirror, find_mirror
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import find_rim
from fabweave.mesh.polymesh import PolyMesh, used_vertices
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    cut_surface,
    finished_quads,
    ready_source,
    sound_faults,
)
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.triangles import split_longer
from fabweave.mesh.symmetrise import symmetrise
from fabweave.mesh.topology import boundary_loops, label_links, walk_from
from fabweave.mesh.triangulate import surface_area


def lacks_grid(mesh: PolyMesh) -> str:
    """Say why a surface has no grid; empty if it has one. Only its topology is looked at.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold surface.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar, sphere, torus
    >>> lacks_grid(hypar(4, 4, 40.0, 10.0)), lacks_grid(torus(8, 8, 3.0, 1.0))
    ('', '')
    >>> lacks_grid(sphere(2, 1.0))
    'a grid needs a disc, a tube or a torus; this is closed and has no handle'
    """
    needs = "a grid needs a disc, a tube or a torus; this "
    edges = group_edges(mesh)
    used = used_vertices(mesh)
    bodies = label_links(edges.tail, edges.head, mesh.n_vertices)[0] - int((~used).sum())
    if bodies != 1:
        return needs + f"has {bodies} bodies"
    openings = boundary_loops(edges)[0]
    euler = int(used.sum()) - len(edges.sizes) + mesh.n_faces
    handles = (2 - euler - openings) // 2
    if (openings, handles) in ((1, 0), (2, 0), (0, 1)):
        return ""
    has = agree(openings, "has {n} opening[|s]") if openings else "is closed"
    return (
        needs
        + has
        + (
            agree(handles, " and [has |]{n} handle[|s]")
            if handles
            else " and has no handle"
            if not openings
            else ""
        )
    )


# -- Harmonic functions ---------------------------------------------------------------------------


@frozen_value
class Sheet:
    """Triangles, their connectivity, and the weights of their edges.

    Parameters
    ----------
    mesh : PolyMesh
        Triangles.
    halfedges : Halfedges
    weights : (E,) float array
        The cotangent weights: with them sums of squares of differences are Dirichlet's energy.
    """

    mesh: PolyMesh
    halfedges: Halfedges
    weights: FloatArray

    @property
    def corners(self) -> IntArray:
        """The vertices of the triangles, (T, 3)."""
        return self.mesh.indices.reshape(-1, 3)

    def along(self, values: FloatArray, jumps: FloatArray) -> FloatArray:
        """Return by how much a function with jumps grows along each half-edge, (H,)."""
        half = self.halfedges
        sign = np.where(half.edge_halfedge[half.edge] == np.arange(half.n_halfedges), 1.0, -1.0)
        return np.asarray(values[half.head] - values[half.tail] + sign * jumps[half.edge])

    def at_corners(self, values: FloatArray, jumps: FloatArray) -> FloatArray:
        """Return a function with jumps at the corners of triangles, continuous in each, (T, 3)."""
        step = self.along(values, jumps).reshape(-1, 3)
        first = values[self.corners[:, 0]]
        return np.column_stack([first, first + step[:, 0], first + step[:, 0] + step[:, 1]])


#: No edge weighs less than this where charts must not fold (cotangents of usual triangles are about
#: one half).
_LEAST_WEIGHT = 0.02


def sheet_of(mesh: PolyMesh, *, positive: bool = False) -> Sheet:
    """Prepare triangles for harmonic functions.

    Parameters
    ----------
    mesh : PolyMesh
        Triangles with an area.
    positive : bool
        Whether all weights are made positive, so that no chart can fold (Tutte's theorem); the
        functions are then less smooth.
    """
    half = build_halfedges(mesh)
    points = mesh.vertices
    a, b, tip = points[half.tail], points[half.head], points[half.tail[half.prev]]
    doubled = np.linalg.norm(np.cross(a - tip, b - tip), axis=1)
    size = np.linalg.norm(a - tip, axis=1) * np.linalg.norm(b - tip, axis=1)
    cotangent = np.einsum("hd,hd->h", a - tip, b - tip) / np.maximum(doubled, 1e-9 * size + 1e-300)
    weights = np.bincount(half.edge, weights=cotangent / 2.0, minlength=half.n_edges)
    if positive:
        weights = np.maximum(weights, _LEAST_WEIGHT)
    return Sheet(mesh, half, np.asarray(weights, dtype=np.float64))


def harmonic(sheet: Sheet, fixed: IntArray, values: FloatArray, jumps: FloatArray) -> FloatArray:
    """Return the smoothest function with given values at some vertices, and given jumps, (V,).

    Where nothing is fixed along a rim, its lines meet the rim at right angles.

    Parameters
    ----------
    sheet : Sheet
    fixed : (K,) int array
        Vertices, at least one of each body.
    values : (K,) float array
        What the function is there.
    jumps : (E,) float array
        What is added along the first half-edge of each edge; around each triangle they add up to 0.
    """
    count, half = sheet.mesh.n_vertices, sheet.halfedges
    first = half.edge_halfedge
    rows = np.arange(half.n_edges)
    growth = sparse.csr_array(
        (
            np.repeat([1.0, -1.0], half.n_edges),
            (np.tile(rows, 2), np.concatenate([half.head[first], half.tail[first]])),
        ),
        shape=(half.n_edges, count),
    )
    stiff = sparse.csr_array(growth.T @ (sheet.weights[:, None] * growth))
    found = np.zeros(count)
    found[fixed] = values
    free = np.ones(count, dtype=bool)
    free[fixed] = False
    right = -(growth.T @ (sheet.weights * jumps)) - stiff @ found
    inner = np.flatnonzero(free)
    if len(inner):
        # The matrix is symmetric, and so is how it is factored, which takes half of the time.
        factors = splu(
            sparse.csc_array(stiff[inner][:, inner]),
            permc_spec="MMD_AT_PLUS_A",
            options={"SymmetricMode": True},
        )
        found[inner] = factors.solve(right[inner])
    return found


def jump_across(sheet: Sheet, start: IntArray, end: IntArray) -> FloatArray:
    """Return jumps of 1 for each turn around a tube, (E,): across a path from rim to rim.

    Parameters
    ----------
    sheet : Sheet
    start, end : (K,) int arrays
        The half-edges of the two rims.
    """
    half = sheet.halfedges
    inner = np.flatnonzero(half.twin >= 0)
    offsets, links = _rows(half.face[inner], half.face[half.twin[inner]], sheet.mesh.n_faces)
    order, before = walk_from(half.face[start[:1]], offsets, links)
    came = np.full(sheet.mesh.n_faces, -1)
    came[order] = before
    goals = half.face[end]
    reached = np.full(sheet.mesh.n_faces, len(order))
    reached[order] = np.arange(len(order))
    last = int(np.argmin(reached[goals]))
    path = [int(goals[last])]
    while path[-1] != half.face[start[0]]:
        path.append(int(came[path[-1]]))
    jumps = np.zeros(half.n_edges)
    _cross(jumps, half, int(end[last]), 1.0)
    _cross(jumps, half, int(start[0]), -1.0)
    for here, there in zip(path[1:], path, strict=False):
        sides = 3 * here + np.arange(3)
        twins = half.twin[sides]
        _cross(jumps, half, int(sides[(twins >= 0) & (half.face[twins] == there)][0]), 1.0)
    return jumps


def _cross(jumps: FloatArray, half: Halfedges, side: int, by: float) -> None:
    """Add a jump along a half-edge."""
    edge = half.edge[side]
    jumps[edge] += by if half.edge_halfedge[edge] == side else -by


def _rows(node: IntArray, link: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Return links sorted by node as compressed rows."""
    order = np.lexsort((link, node))
    offsets = np.concatenate([[0], np.cumsum(np.bincount(node, minlength=count))])
    return offsets, link[order]


# -- Charts ---------------------------------------------------------------------------------------


@frozen_value
class Chart:
    """A map from the unit square onto a surface.

    Parameters
    ----------
    flat : (S, 2) float array
        Corners of triangles in the square, three for each. Where sides of the square are joined,
        some triangles are there twice.
    points : (S, 3) float array
        Where these corners are in space.
    joined : (bool, bool)
        Whether the first and last row are one, and the first and last column.
    folded : bool
        Whether some triangle is turned over.
    """

    flat: FloatArray
    points: FloatArray
    joined: tuple[bool, bool]
    folded: bool

    def __post_init__(self) -> None:
        """Sort the triangles."""
        flat = np.column_stack([self.flat, np.zeros(len(self.flat))])
        surface = Surface(flat, np.arange(len(flat)).reshape(-1, 3))
        object.__setattr__(self, "_surface", surface)

    def places(self, u: FloatArray, v: FloatArray) -> FloatArray:
        """Return where the crossings of some rows and columns are, (M, N, 3)."""
        asked = [
            value % 1.0 if joined else value
            for value, joined in zip((u, v), self.joined, strict=True)
        ]
        grid = np.stack(np.meshgrid(*asked, indexing="ij"), axis=-1).reshape(-1, 2)
        surface: Surface = self._surface  # type: ignore[attr-defined]
        feet = surface.feet(np.column_stack([grid, np.zeros(len(grid))]))
        found = np.einsum("nk,nkd->nd", feet.shares, self.points[feet.corners])
        return np.asarray(found.reshape(len(u), len(v), 3))


def chart_of(sheet: Sheet, u: FloatArray, v: FloatArray, joined: tuple[bool, bool]) -> Chart:
    """Build a chart from two functions at the corners of triangles, (T, 3) each."""
    flat = np.stack([u, v], axis=-1)
    sides = flat[:, 1:] - flat[:, :1]
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    if area.sum() < 0:
        area = -area
        flat[:, :, 1] = -flat[:, :, 1] if joined[1] else 1.0 - flat[:, :, 1]
    points = sheet.mesh.vertices[sheet.corners]
    for axis in np.flatnonzero(joined):
        flat[:, :, axis] -= np.floor(flat[:, :, axis].mean(axis=1, keepdims=True))
        ends = flat[:, :, axis]
        shift = np.eye(2)[axis]
        below, above = ends.min(axis=1) < 1e-9, ends.max(axis=1) > 1.0 - 1e-9
        flat = np.concatenate([flat, flat[below] + shift, flat[above] - shift])
        points = np.concatenate([points, points[below], points[above]])
    return Chart(flat.reshape(-1, 2), points.reshape(-1, 3), joined, bool(np.any(area <= 0)))


def tube_chart(sheet: Sheet, loops: list[IntArray]) -> Chart:
    """Lay out a tube: rows go around it, from one rim to the other.

    Parameters
    ----------
    sheet : Sheet
        A tube.
    loops : list of two (K,) int arrays
        The half-edges of its rims.
    """
    half, still = sheet.halfedges, np.zeros(sheet.halfedges.n_edges)
    ends = [half.tail[loop] for loop in loops]
    fixed = np.concatenate(ends)
    height = harmonic(sheet, fixed, np.repeat([0.0, 1.0], [len(end) for end in ends]), still)
    jumps = jump_across(sheet, *loops)
    around = harmonic(sheet, fixed[:1], np.zeros(1), jumps)
    return chart_of(
        sheet,
        np.clip(sheet.at_corners(height, still), 0.0, 1.0),
        sheet.at_corners(around, jumps),
        (False, True),
    )


def disc_chart(sheet: Sheet, sides: list[IntArray]) -> Chart:
    """Lay out a disc as a rectangle.

    Parameters
    ----------
    sheet : Sheet
        A disc.
    sides : list of four (K,) int arrays
        The vertices of the rim from corner to corner, both included.
    """
    still = np.zeros(sheet.halfedges.n_edges)
    found = []
    for low, high in ((3, 1), (0, 2)):
        fixed = np.concatenate([sides[low], sides[high]])
        values = np.repeat([0.0, 1.0], [len(sides[low]), len(sides[high])])
        line = harmonic(sheet, fixed, values, still)
        found.append(np.clip(sheet.at_corners(line, still), 0.0, 1.0))
    return chart_of(sheet, found[0], found[1], (False, False))


# -- Rows and columns -----------------------------------------------------------------------------

#: Rounds in which rows and columns are spaced anew, and when they are even.
_SPACINGS, _SPACED = 60, 1e-9


@frozen_value
class Lines:
    """Rows and columns of a chart, and where they cross.

    Parameters
    ----------
    u, v : (M + 1,) and (N + 1,) float arrays
        Where the lines are in the chart; the last is the first where they are joined.
    places : (M + 1, N + 1, 3) float array
    joined : (bool, bool)
        Whether the first and last row are one, and the first and last column.
    """

    u: FloatArray
    v: FloatArray
    places: FloatArray
    joined: tuple[bool, bool]

    @property
    def widths(self) -> tuple[FloatArray, FloatArray]:
        """How wide each row and each column is in the mean, (M,) and (N,)."""
        down, across = (np.linalg.norm(np.diff(self.places, axis=axis), axis=2) for axis in (0, 1))
        return np.asarray(down.mean(axis=1)), np.asarray(across.mean(axis=0))

    @property
    def mesh(self) -> PolyMesh:
        """The quads between them."""
        rows, columns = (size - 1 for size in self.places.shape[:2])
        height, width = rows + (not self.joined[0]), columns + (not self.joined[1])
        i, j = (grid.reshape(-1) for grid in np.mgrid[:rows, :columns])
        down, right = (i + 1) % height, (j + 1) % width
        faces = np.column_stack(
            [row * width + column for row, column in ((i, j), (down, j), (down, right), (i, right))]
        )
        return PolyMesh.from_faces(self.places[:height, :width].reshape(-1, 3), faces)


def even_lines(chart: Chart, u: FloatArray, v: FloatArray, stay: BoolArray) -> Lines:
    """Space rows and columns so that each is as wide as the others in space, in the mean.

    Parameters
    ----------
    chart : Chart
    u, v : (M + 1,) and (N + 1,) float arrays
        Where to begin: rising, with both ends.
    stay : (N + 1,) bool array
        Columns that stay where they are; the first and the last do.
    """
    marks = np.flatnonzero(stay)
    lines = Lines(u, v, chart.places(u, v), chart.joined)
    for _ in range(_SPACINGS):
        rows, columns = lines.widths
        new_u = _spaced(lines.u, rows)
        parts = [
            _spaced(lines.v[a : b + 1], columns[a:b])[:-1] for a, b in pairwise(marks.tolist())
        ]
        new_v = np.concatenate([*parts, lines.v[-1:]])
        moved = max(np.abs(new_u - lines.u).max(), np.abs(new_v - lines.v).max())
        lines = Lines(new_u, new_v, chart.places(new_u, new_v), chart.joined)
        if moved < _SPACED:
            break
    return lines


def _spaced(lines: FloatArray, widths: FloatArray) -> FloatArray:
    """Return lines that part a way evenly, where the parts between the given ones are so wide."""
    way = np.concatenate([[0.0], np.cumsum(widths)])
    found = np.interp(np.linspace(0.0, way[-1], len(lines)), way, lines)
    found[[0, -1]] = lines[[0, -1]]
    return np.asarray(found)


def evened(chart: Chart, rows: int, columns: int, phase: float = 0.0) -> Lines:
    """Lay evenly spaced rows and columns over a chart, the first column at a phase."""
    stay = np.zeros(columns + 1, dtype=bool)
    stay[[0, -1]] = True
    u, v = np.linspace(0.0, 1.0, rows + 1), phase + np.linspace(0.0, 1.0, columns + 1)
    return even_lines(chart, u, v, stay)


#: Rows and columns of the trial grid by which a chart is measured.
_TRIAL = 24
#: How much more it costs to have another number of quads than was wanted than to have longish ones,
#: to have columns of two widths, and pieces of more kinds; and so many numbers of columns are tried
#: to either side.
_COUNT_COST, _PART_COST, _KIND_COST = 1.5, 4.0, 0.015
_NEAR = 8
_WHOLE = frozen(np.ones(1))


def counts(
    height: float, width: float, n_quads: int, *, least: tuple[int, int] = (2, 2), step: int = 1,
    parts: FloatArray = _WHOLE, turns: int = 0,
) -> tuple[int, IntArray] | None:  # fmt: skip
    """Return how many rows, and columns in each part, make nearly square quads, about so many.

    Parameters
    ----------
    height, width : float
        From the first row to the last, and from the first column to the last.
    n_quads : int
    least : (int, int)
        The fewest rows, and columns.
    step : int
        Columns in all are a multiple of this.
    parts : (K,) float array
        Shares of the width, each of whole columns.
    turns : int
        So many turns map a tube onto itself: the more of them map its columns and its threads onto
        one another, the fewer kinds of pieces there are. 0 where columns do not go around.

    Returns
    -------
    rows, columns : int and (K,) int array
        None where a part would have none.

    Examples
    --------
    >>> rows, columns = counts(50.0, 200.0, 400, step=2)
    >>> rows, columns.tolist()
    (10, [40])
    """
    ideal = int(np.sqrt(n_quads * width / height))
    tried = []
    for columns in range(max(least[1], ideal - _NEAR), max(least[1], ideal + _NEAR) + 1):
        each = np.rint(parts * columns).astype(np.int64)
        if columns % step or each.sum() != columns or not each.all():
            continue
        uneven = np.log(parts * columns / each)
        for rows in range(max(least[0], n_quads // columns - 1), n_quads // columns + 3):
            square = np.log((width / columns) / (height / rows))
            number = _COUNT_COST * np.log(rows * columns / n_quads)
            cost = square**2 + number**2 + (_PART_COST * uneven) @ (_PART_COST * uneven * parts)
            if turns:
                # Where threads turn back at rims, they close after a multiple of 2 rows turns.
                alike = gcd(columns, turns) * gcd(columns, 2 * rows) / columns**2
                cost -= _KIND_COST * np.log(alike)
            tried.append((round(float(cost), 9), rows, columns, each))
    if not tried:
        return None
    _, rows, _, each = min(tried, key=lambda one: one[:3])
    return rows, each


def square_lines(chart: Chart, n_quads: int, trial: int = _TRIAL) -> Lines | None:
    """Lay evenly spaced lines over a chart, so that quads are about square; None if too few fit."""
    height, width = (float(widths.sum()) for widths in evened(chart, trial, trial).widths)
    found = counts(height, width, n_quads)
    return None if found is None else evened(chart, found[0], int(found[1].sum()))


#: A quad is bad if it is so much longer than wide, or a corner is farther from a right angle.
_BAD_ASPECT, _BAD_DEG = 2.5, 50.0


@frozen_value
class Looks:
    """How good the quads between lines are.

    Parameters
    ----------
    cost : float
        Root mean square of logarithms of edges over the median, and of corners off right angles.
    bad : float
        Share of the area in bad quads.
    """

    cost: float
    bad: float


def looks_of(places: FloatArray) -> Looks:
    """Judge the quads of a grid of places, (M + 1, N + 1, 3)."""
    a, b, c, d = (places[i, j] for i, j in (
        (slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)),
        (slice(1, None), slice(1, None)), (slice(None, -1), slice(1, None)),
    ))  # fmt: skip
    ring = np.stack([a, b, c, d], axis=2)
    side = np.roll(ring, -1, axis=2) - ring
    length = np.maximum(np.linalg.norm(side, axis=3), 1e-300)
    back = np.roll(side, 1, axis=2)
    cosine = -np.einsum("ijkd,ijkd->ijk", side, back) / (length * np.roll(length, 1, axis=2))
    off = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) - 90.0
    area = np.linalg.norm(np.cross(c - a, d - b), axis=2)
    down, across = length[:, :, ::2].sum(axis=2), length[:, :, 1::2].sum(axis=2)
    bad = np.abs(np.log(down / across)) > np.log(_BAD_ASPECT)
    bad |= np.abs(off).max(axis=2) > _BAD_DEG
    uneven = np.log(length / np.median(length))
    cost = np.sqrt(np.mean(uneven**2) + np.mean((off / 90.0) ** 2))
    return Looks(float(cost), float(area[bad].sum() / max(area.sum(), 1e-300)))


# -- Rims -----------------------------------------------------------------------------------------

#: A rim has a corner where it turns by more than this within a quad: an octagon has none, a hexagon
#: has.
_CORNER_DEG = 50.0
#: At a corner that turns in by more than this, as seen along the surface, no grid has its corner.
_REFLEX_DEG = -20.0


@frozen_value
class Loop:
    """A rim, as it runs with the surface on its left.

    Parameters
    ----------
    sides : (K,) int array
        Its half-edges, in order.
    points : (K, 3) float array
        Where they begin.
    """

    sides: IntArray
    points: FloatArray

    @property
    def way(self) -> FloatArray:
        """How far along the rim each point is, as a share of its length, (K + 1,)."""
        step = np.linalg.norm(np.roll(self.points, -1, axis=0) - self.points, axis=1)
        way = np.concatenate([[0.0], np.cumsum(step)])
        return np.asarray(way / way[-1])

    @property
    def length(self) -> float:
        """How long it is."""
        return float(np.linalg.norm(np.roll(self.points, -1, axis=0) - self.points, axis=1).sum())

    def at(self, share: FloatArray) -> FloatArray:
        """Return the points at some shares of the way around, (N, 3)."""
        ring = np.concatenate([self.points, self.points[:1]])
        return np.column_stack([np.interp(share % 1.0, self.way, ring[:, k]) for k in range(3)])

    def corners(self, window: float, turn_in: FloatArray | None = None) -> list[int]:
        """Return the points at which the rim has a corner, the sharpest first.

        Parameters
        ----------
        window : float
            The rim's direction is looked at so far before and behind, as a share of its length.
        turn_in : (K,) float array, optional
            By how many degrees the rim turns at each point, as seen along the surface.
        """
        way = self.way[:-1]
        before, after = self.points - self.at(way - window), self.at(way + window) - self.points
        cosine = np.einsum("nd,nd->n", before, after) / np.maximum(
            np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1), 1e-300
        )
        turn = np.round(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), 6)
        found: list[int] = []
        apart = np.ones(len(way))
        for number in np.argsort(-turn, kind="stable").tolist():
            if turn[number] <= _CORNER_DEG:
                break
            away = np.abs((way - way[number] + 0.5) % 1.0 - 0.5)
            if apart[number] > 2.0 * window:
                apart = np.minimum(apart, away)
                near = away <= window
                if turn_in is None or turn_in[near].sum() > _REFLEX_DEG:
                    found.append(number)
        return found


def loops_of(mesh: PolyMesh, half: Halfedges) -> list[Loop]:
    """Return the rims of a surface, each from its first vertex."""
    rim = find_rim(half, mesh.n_vertices)
    side_at = np.full(mesh.n_vertices, -1)
    open_sides = np.flatnonzero(half.twin < 0)
    side_at[half.tail[open_sides]] = open_sides
    left, loops = rim.on.copy(), []
    for start in np.flatnonzero(rim.on).tolist():
        if left[start]:
            ring = [start]
            while (after := int(rim.after[ring[-1]])) != start:
                ring.append(after)
            left[ring] = False
            loops.append(Loop(side_at[ring], mesh.vertices[ring]))
    return loops


#: A turn that maps a mesh onto itself may be off by this share of its size.
_TURN_OFF = 1e-4


def turns_around(mesh: PolyMesh) -> int:
    """Return how many rotations map a tube and its first rim onto themselves, one at least."""
    half = build_halfedges(mesh)
    group = find_symmetry(mesh, half, tolerance=_TURN_OFF, reflections=False)
    sides = loops_of(mesh, half)[0].sides
    back = np.isin(group.images(sides[:1])[:, 0], sides)
    return int(np.count_nonzero(group.proper & ~group.reverses & back))


def crossing(loop: Loop, mirror: Mirror) -> float | None:
    """Return where a mirror first crosses a rim, as a share of its length; None if nowhere."""
    height = (loop.points - mirror.point) @ mirror.normal
    height = np.where(np.abs(height) < 1e-9 * loop.length, 0.0, height)
    after = np.roll(height, -1)
    found = np.flatnonzero((height == 0) | (height * after < 0))
    if not len(found):
        return None
    number = int(found[0])
    share = 0.0 if not height[number] else height[number] / (height[number] - after[number])
    return float(loop.way[number] + share * (loop.way[number + 1] - loop.way[number]))


def turns_along(sheet: Sheet, loop: Loop) -> FloatArray:
    """Return by how many degrees a rim turns at each point, as seen along the surface, (K,)."""
    half, points = sheet.halfedges, sheet.mesh.vertices
    here = points[half.tail]
    to, back = points[half.head] - here, points[half.tail[half.prev]] - here
    size = np.linalg.norm(to, axis=1) * np.linalg.norm(back, axis=1)
    cosine = np.einsum("hd,hd->h", to, back) / np.maximum(size, 1e-300)
    angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
    inside = np.bincount(half.tail, weights=angle, minlength=sheet.mesh.n_vertices)
    return np.asarray(180.0 - inside[half.tail[loop.sides]])


# -- Tubes ----------------------------------------------------------------------------------------


def tube_lines(
    sheet: Sheet, loops: list[Loop], chart: Chart, n_quads: int, phase: float, turns: int
) -> Lines:
    """Lay rows around a tube, and columns along it that meet the corners of its rims.

    Parameters
    ----------
    sheet : Sheet
        A tube.
    loops : list of two Loop
    chart : Chart
        As from `tube_chart`.
    n_quads : int
        About how many quads.
    phase : float
        Where the first column is in the chart, if the rims have no corners.
    turns : int
        How many turns map the tube onto itself.
    """
    reach = 0.5 * np.sqrt(surface_area(sheet.mesh) / n_quads)
    marks = [
        float(chart.flat[loop.sides[number], 1])
        for loop in loops
        for number in loop.corners(reach / loop.length)
    ]
    while True:
        at = np.unique(np.round(np.array(marks or [phase]) % 1.0, 6))
        at = np.append(at, at[0] + 1.0)
        trial = evened(chart, _TRIAL, _TRIAL, float(at[0]))
        height, width = (float(widths.sum()) for widths in trial.widths)
        way = np.interp(at, trial.v, np.concatenate([[0.0], np.cumsum(trial.widths[1])]))
        found = counts(
            height, width, n_quads, least=(1, 4), step=2, parts=np.diff(way) / width, turns=turns
        )
        if found is not None:
            break
        marks.pop()
    rows, each = found
    parts = zip(at, at[1:], each.tolist(), strict=False)
    v = np.concatenate([*(np.linspace(a, b, n, endpoint=False) for a, b, n in parts), at[-1:]])
    stay = flags(len(v), np.concatenate([[0], np.cumsum(each)]))
    return even_lines(chart, np.linspace(0.0, 1.0, rows + 1), v, stay)


# -- Discs ----------------------------------------------------------------------------------------

#: At most so many of the sharpest corners of a rim are tried as corners of the grid.
_MOST_SHARP = 7
#: Shares of the rim that sides are tried to have.
_SIDES = (0.25, 0.2, 0.3, 0.15, 0.35)
#: What it costs to leave out a corner of the rim.
_LEFT_OUT = 0.2
#: Quads of the grids by which choices of corners are compared.
_SAMPLE = 100


def corner_choices(sharp: list[float], axis: float | None) -> Iterator[tuple[float, ...]]:
    """Yield choices of four corners on the rim of a disc, as shares of its length, in order.

    Parameters
    ----------
    sharp : list of float
        Where it has corners, the sharpest first.
    axis : float or None
        Where a mirror crosses it.

    Examples
    --------
    >>> list(corner_choices([0.0, 0.5, 0.3, 0.8], None))
    [(0.0, 0.3, 0.5, 0.8)]
    """
    sharp = sharp[:_MOST_SHARP]
    if len(sharp) >= 4:
        yield from combinations(sorted(sharp), 4)
        return
    for a, b in combinations(sorted(sharp), 2):
        one, two = b - a, 1.0 - (b - a)
        for more in ((a + one / 2, b + two / 2), (a + one / 3, a + 2 * one / 3),
                     (b + two / 3, b + 2 * two / 3)):  # fmt: skip
            yield _in_order(a, b, *more)
    if len(sharp) == 3:
        for here, there in ((0, 1), (1, 2), (2, 0)):
            a, b = sorted(sharp)[here], sorted(sharp)[there] + (there == 0)
            for share in (1 / 3, 1 / 2, 2 / 3):
                yield _in_order(*sharp, a + share * (b - a))
    start = axis if axis is not None else sharp[0] if sharp else 0.0
    for side in _SIDES:
        for opposite in _SIDES:
            flank = (1.0 - side - opposite) / 2
            yield _in_order(*(start - side / 2 + np.cumsum([0, side, flank, opposite])).tolist())
        yield _in_order(*(start + np.array([0.0, side, 0.5, 1.0 - side])).tolist())
    if axis is None:
        for turn in np.arange(1, 8) / 16:
            for side in _SIDES:
                at = start + turn + np.array([0.0, side, 0.5, 0.5 + side])
                yield _in_order(*at.tolist())


def _in_order(*at: float) -> tuple[float, ...]:
    return tuple(sorted(round(share % 1.0, 12) % 1.0 for share in at))


def _sides(loop: Loop, tails: IntArray, at: tuple[float, ...]) -> list[IntArray] | None:
    """Return the vertices of the rim from corner to corner; None where two corners are one."""
    near = [int(np.argmin(np.abs((loop.way[:-1] - one + 0.5) % 1.0 - 0.5))) for one in at]
    if any(b - a < 2 for a, b in zip(near, [*near[1:], near[0] + len(tails)], strict=True)):
        return None
    twice = np.concatenate([tails, tails])
    return [twice[a : b + 1] for a, b in zip(near, [*near[1:], near[0] + len(tails)], strict=True)]


def with_corners(mesh: PolyMesh, loop: Loop, at: tuple[float, ...]) -> PolyMesh:
    """Return triangles that have vertices at some places of a rim."""
    way, faces, points = loop.way, mesh.indices.reshape(-1, 3).tolist(), mesh.vertices.tolist()
    for share in at:
        number = int(np.searchsorted(way, share, side="right")) - 1
        number = min(number, len(loop.sides) - 1)
        if min(share - way[number], way[number + 1] - share) < 1e-3 * (
            way[number + 1] - way[number]
        ):
            continue
        face, k = divmod(int(loop.sides[number]), 3)
        a, b, c = faces[face][k], faces[face][(k + 1) % 3], faces[face][(k + 2) % 3]
        faces[face] = [a, len(points), c]
        faces.append([len(points), b, c])
        points.append(loop.at(np.array([share]))[0].tolist())
    return PolyMesh.from_triangles(np.array(points), np.array(faces))


def disc_lines(sheet: Sheet, at: tuple[float, ...], n_quads: int, trial: int) -> Lines | None:
    """Lay rows and columns over a disc with given corners; None where that folds."""
    loop = loops_of(sheet.mesh, sheet.halfedges)[0]
    sides = _sides(loop, sheet.halfedges.tail[loop.sides], at)
    if sides is None:
        return None
    chart = disc_chart(sheet, sides)
    if chart.folded:
        chart = disc_chart(sheet_of(sheet.mesh, positive=True), sides)
    return square_lines(chart, n_quads, trial)


def best_corners(sheet: Sheet, n_quads: int, axis: float | None) -> tuple[float, ...] | None:
    """Return the four places on the rim of a disc that make the best grid, as shares of the rim.

    Parameters
    ----------
    sheet : Sheet
        A disc.
    n_quads : int
    axis : float or None
        Where a mirror crosses the rim, as a share of its length.
    """
    loop = loops_of(sheet.mesh, sheet.halfedges)[0]
    reach = 0.5 * np.sqrt(surface_area(sheet.mesh) / n_quads) / loop.length
    sharp = [float(loop.way[k]) for k in loop.corners(reach, turns_along(sheet, loop))]
    tried = []
    for order, at in enumerate(corner_choices(sharp, axis)):
        lines = disc_lines(sheet, at, _SAMPLE, _TRIAL // 2)
        if lines is None:
            continue
        looks = looks_of(lines.places)
        left = sum(min(abs((one - a + 0.5) % 1.0 - 0.5) for a in at) > 1e-6 for one in sharp)
        tried.append((round(looks.cost + _LEFT_OUT * left, 3), order, at))
    return min(tried)[2] if tried else None


# -- Tori -----------------------------------------------------------------------------------------


def torus_chart(sheet: Sheet) -> Chart:
    """Lay out a torus, by the two shortest ways around it."""
    half, n_faces = sheet.halfedges, sheet.mesh.n_faces
    offsets, links = _rows(half.tail, half.head, sheet.mesh.n_vertices)
    order, before = walk_from(np.zeros(1, dtype=np.int64), offsets, links)
    tree = {(int(a), int(b)) for a, b in zip(order[1:], before[1:], strict=True)}
    pairs = zip(half.tail.tolist(), half.head.tolist(), strict=True)
    apart = np.array([pair not in tree and pair[::-1] not in tree for pair in pairs])
    across = np.flatnonzero(apart)
    offsets, links = _rows(half.face[across], half.face[half.twin[across]], n_faces)
    order, before = walk_from(np.zeros(1, dtype=np.int64), offsets, links)
    came = np.full(n_faces, -1)
    came[order[1:]] = before[1:]
    crossed = np.zeros(half.n_edges, dtype=bool)
    into = np.full(n_faces, -1)
    for side in across.tolist():
        face = int(half.face[half.twin[side]])
        if came[face] == half.face[side] and into[face] < 0:
            into[face] = side
            crossed[half.edge[side]] = True
    forms = []
    for edge in np.flatnonzero(~crossed & apart[half.edge_halfedge]).tolist():
        side = int(half.edge_halfedge[edge])
        jumps = np.zeros(half.n_edges)
        _cross(jumps, half, side, 1.0)
        for face, by in ((int(half.face[side]), 1.0), (int(half.face[half.twin[side]]), -1.0)):
            here = face
            while into[here] >= 0:
                _cross(jumps, half, int(into[here]), by)
                here = int(came[here])
        forms.append(jumps)
    fixed, zero = np.zeros(1, dtype=np.int64), np.zeros(1)

    def whole(jumps: FloatArray) -> FloatArray:
        growth = sheet.along(harmonic(sheet, fixed, zero, jumps), jumps)
        return np.asarray(growth[half.edge_halfedge])

    one, two = forms
    while True:  # Gauss's reduction of a basis
        a, b = whole(one), whole(two)
        if a @ (sheet.weights * a) > b @ (sheet.weights * b):
            one, two, a, b = two, one, b, a
        often = float(np.rint((a @ (sheet.weights * b)) / (a @ (sheet.weights * a))))
        if not often:
            break
        two = two - often * one
    u, v = (sheet.at_corners(harmonic(sheet, fixed, zero, form), form) for form in (one, two))
    return chart_of(sheet, u, v, (True, True))


# -- The remesher ---------------------------------------------------------------------------------

#: Edges of the triangles that charts are made of are at most this share of a quad's, unless there
#: were more than so many.
_FINE, _MOST_TRIANGLES = 0.35, 40_000
#: A grid is made symmetric if no vertex moves by more than about this share of the size.
_ASYMMETRY = 0.0025
#: At most this share of the area may be in bad quads.
_MOST_BAD = 0.2


def remesh_grid(mesh: PolyMesh, n_quads: int, *, progress: Progress = no_progress) -> Remeshed:
    """Lay rows and columns of quads over a disc, a tube or a torus, without any irregular vertex.

    1. A chart of the surface is made of two harmonic functions. A tube has one that is 0 on one rim
       and 1 on the other, and one around it; a disc is a rectangle, whose corners are at those of
       the rim, or where they make the best quads; a torus is cut along its two shortest ways.
    2. Rows and columns are spaced so that each is as wide as the others in space, in the mean, and
       quads are about square. The first and last row of a tube are its rims.
    3. What is then symmetric but for noise is made exactly so.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_quads : int
        About how many quads.
    progress : callable

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If the surface has no grid, or none with good quads.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> remeshed = remesh_grid(hypar(5, 5, 40.0, 10.0), 64)
    >>> remeshed.mesh.n_faces, len(remeshed.irregular)
    (64, 0)

    References
    ----------
    Tutte, "How to draw a graph", 1963; Gortler, Gotsman, Thurston, "Discrete one-forms on meshes
    and applications to 3D mesh parameterization", CAGD 23(2), 2006; Aigerman, Lipman, "Orbifold
    Tutte embeddings", ACM TOG 34(6), 2015.
    """
    checked_count("grid", n_quads)
    source, notes = ready_source(mesh)
    if lack := lacks_grid(source):
        raise CannotMakeError(lack)
    progress("laying rows and columns", 0, 2)
    surface = cut_surface(source)
    area = surface_area(surface)
    longest = max(_FINE * np.sqrt(area / n_quads), np.sqrt(area / (0.43 * _MOST_TRIANGLES)))
    sheet = sheet_of(split_longer(surface, float(longest)))
    grids = [_symmetric(lines.mesh, lines) for lines in _laid(source, sheet, n_quads)]
    if not grids:
        raise _failed("its rim has no four places between which rows and columns fit")
    made, lines = max(grids, key=lambda one: one[0])[1:]
    looks = looks_of(lines.places)
    if looks.bad > _MOST_BAD:
        raise _failed(f"{looks.bad:.0%} of it would be in quads that are too long or too oblique")
    if faults := sound_faults(source, made, 4):
        raise _failed("; ".join(faults))
    rows, columns = (size - 1 for size in lines.places.shape[:2])
    told = f"a grid of {rows} × {columns} quads was laid over it ({n_quads} were wanted)"
    return finished_quads(made, "grid", [*notes, Note("grid", told, detail=True)])


def _laid(source: PolyMesh, sheet: Sheet, n_quads: int) -> Iterator[Lines]:
    """Yield grids, the best of which is that with the most symmetry."""
    loops = loops_of(sheet.mesh, sheet.halfedges)
    if not loops:
        if (lines := square_lines(torus_chart(sheet), n_quads)) is not None:
            yield lines
        return
    mirror = find_mirror(source)
    axis = crossing(loops[0], mirror) if mirror.symmetric else None
    if len(loops) == 2:
        chart = tube_chart(sheet, [loop.sides for loop in loops])
        if chart.folded:
            sheet = sheet_of(sheet.mesh, positive=True)
            chart = tube_chart(sheet, [loop.sides for loop in loops])
        sides = loops[0].sides
        turns = turns_around(source)
        # Along the rim the chart is linear between its points.
        rim = np.unwrap(chart.flat[np.append(sides, sides[0]), 1], period=1.0)
        for share in (0.0,) if axis is None else (0.0, axis):
            phase = float(np.interp(share, loops[0].way, rim))
            yield tube_lines(sheet, loops, chart, n_quads, phase, turns)
        return
    at = best_corners(sheet, n_quads, axis)
    if at is not None:
        fine = sheet_of(with_corners(sheet.mesh, loops[0], at))
        if (lines := disc_lines(fine, at, n_quads, _TRIAL)) is not None:
            yield lines


def _symmetric(mesh: PolyMesh, lines: Lines) -> tuple[int, PolyMesh, Lines]:
    """Make a grid symmetric that is so but for noise; and say how many motions it has."""
    try:
        made = symmetrise(mesh, [_ASYMMETRY])
    except CannotMakeError:
        return 1, mesh, lines
    return made.symmetry.order, made.mesh, lines


def _failed(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"no grid could be laid over the mesh: {why}. What may help: another number of quads, or "
        "--remesh quads"
    )
