"""Map surfaces to rectangles by harmonic functions: discs, tubes and tori.

Rows and columns of a grid are lines of such a chart; so can the rings around a limb be.
"""

from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.mirror import Mirror
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import find_rim
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.topology import walk_from

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

    @cached_property
    def growth(self) -> sparse.csr_array:
        """Rows that give by how much a function grows along each edge's first half-edge, (E, V)."""
        half, first = self.halfedges, self.halfedges.edge_halfedge
        rows = np.tile(np.arange(half.n_edges), 2)
        ends = np.concatenate([half.head[first], half.tail[first]])
        return sparse.csr_array(
            (np.repeat([1.0, -1.0], half.n_edges), (rows, ends)),
            shape=(half.n_edges, self.mesh.n_vertices),
        )

    @cached_property
    def stiff(self) -> sparse.csr_array:
        """What Dirichlet's energy of functions without jumps is as a quadratic form, (V, V)."""
        return sparse.csr_array(self.growth.T @ (self.weights[:, None] * self.growth))

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
    count, stiff = sheet.mesh.n_vertices, sheet.stiff
    found = np.zeros(count)
    found[fixed] = values
    free = np.ones(count, dtype=bool)
    free[fixed] = False
    right = -(sheet.growth.T @ (sheet.weights * jumps)) - stiff @ found
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


# -- Rims ------------------------------------------------------------------------------------------

#: A rim has a corner where it turns by more than this within a quad: an octagon has none, a hexagon
#: has.
_CORNER_DEG = 50.0
#: The direction of a rim is looked at within this share of it at the most.
_WIDEST = 1 / 16
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
        way, window = self.way[:-1], min(window, _WIDEST)
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
