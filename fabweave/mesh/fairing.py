"""Fair a mesh: move its vertices along its surface so that threads run straight and even."""

from dataclasses import dataclass

import numpy as np

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
    offsets_of,
    unit,
)
from fabweave.core.errors import InputError
from fabweave.mesh.fairness import Fairness, Slope
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.nearest import Surface
from fabweave.mesh.polymesh import (
    PolyMesh,
    face_centres,
    face_normals,
    face_of_corner,
    next_corner,
    previous_corner,
)
from fabweave.mesh.triangulate import fans

#: An edge is sharp where its faces turn by more than this, and so is a corner of a boundary or of
#: a sharp line: a regular octagon's corners are not, a hexagon's are.
SHARP_DEG = 50.0


@frozen_value
class Lines:
    """The boundary and the sharp edges of a mesh, as lines along which vertices may slide.

    Parameters
    ----------
    fixed : (V,) bool array
        Vertices that stay: corners, ends and meeting points of lines.
    sliding : (S,) int array
        Vertices that slide, line by line, in their order along it.
    place : (S,) float array
        Where they are: all lines laid out in a row with gaps, measured from the start of the row.
    start, length : (S,) float arrays
        Where the line of each sliding vertex starts, and how long it is.
    closed : (S,) bool array
        Whether that line is a ring.
    knots : (K,) float array
        Places of the bends of all lines.
    points : (K, 3) float array
        Positions there.
    before, after : (S,) int arrays
        The neighbours in ``sliding``; -1 for a fixed one.
    """

    fixed: BoolArray
    sliding: IntArray
    place: FloatArray
    start: FloatArray
    length: FloatArray
    closed: BoolArray
    knots: FloatArray
    points: FloatArray
    before: IntArray
    after: IntArray

    def at(self, place: FloatArray) -> FloatArray:
        """Return the positions of sliding vertices at places of their lines, (S, 3)."""
        if not len(place):
            return np.zeros((0, 3))
        place = self.wrapped(place)
        after = np.clip(np.searchsorted(self.knots, place, side="right"), 1, len(self.knots) - 1)
        low, high = self.knots[after - 1], self.knots[after]
        share = np.clip((place - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)[:, None]
        return np.asarray((1 - share) * self.points[after - 1] + share * self.points[after])

    def room(self, place: FloatArray) -> FloatArray:
        """Return how far each sliding vertex is from its nearer neighbour along the line, (S,)."""
        ends = self.start, self.start + self.length
        last = np.where(self.before >= 0, place[self.before], ends[0])
        following = np.where(self.after >= 0, place[self.after], ends[1])
        # Around a ring the first vertex follows the last one.
        last = np.where(self.closed & (last >= place), last - self.length, last)
        following = np.where(self.closed & (following <= place), following + self.length, following)
        return np.minimum(place - last, following - place)

    def directions(self, place: FloatArray) -> FloatArray:
        """Return the directions of the lines at places, as unit vectors (S, 3)."""
        reach = 1e-6 * self.length
        low, high = self.start, self.start + self.length
        ahead = np.where(self.closed, place + reach, np.minimum(place + reach, high))
        behind = np.where(self.closed, place - reach, np.maximum(place - reach, low))
        return unit(self.at(ahead) - self.at(behind))

    def wrapped(self, place: FloatArray) -> FloatArray:
        """Bring places back to their lines: around rings, and no further than the end of others."""
        round_it = self.start + np.mod(place - self.start, np.where(self.closed, self.length, 1.0))
        return np.where(self.closed, round_it, np.clip(place, self.start, self.start + self.length))


def find_lines(mesh: PolyMesh, halfedges: Halfedges) -> Lines:
    """Find the lines of a mesh along which its vertices may slide.

    Lines are boundary edges and edges whose faces turn by more than `SHARP_DEG`. A vertex slides if
    just two of these edges meet there and turn by no more than that angle; other vertices of lines
    are fixed.

    Parameters
    ----------
    mesh, halfedges
        An oriented manifold mesh.

    Returns
    -------
    Lines

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> mesh = hypar(3, 3, 30.0, 0.0)
    >>> lines = find_lines(mesh, build_halfedges(mesh))
    >>> int(lines.fixed.sum()), len(lines.sliding)
    (4, 8)
    """
    edges = halfedges.edge_halfedge[sharp_edges(mesh, halfedges)]
    ends = np.column_stack([halfedges.tail[edges], halfedges.head[edges]])
    number = np.bincount(ends.reshape(-1), minlength=mesh.n_vertices)
    pairs: list[list[int]] = [[] for _ in range(mesh.n_vertices)] if len(ends) else []
    for a, b in ends.tolist():
        pairs[a].append(b)
        pairs[b].append(a)
    fixed = (number > 0) & (number != 2)
    two = np.flatnonzero(number == 2)
    if len(two):
        sides = np.array([pairs[vertex] for vertex in two.tolist()])
        inward = unit(mesh.vertices[two] - mesh.vertices[sides[:, 0]])
        outward = unit(mesh.vertices[sides[:, 1]] - mesh.vertices[two])
        straight = np.einsum("nd,nd->n", inward, outward)
        fixed[two[~(straight >= np.cos(np.radians(SHARP_DEG)) - 1e-9)]] = True
    return _laid_out(mesh, _chains(pairs, fixed, number > 0), fixed)


def sharp_edges(mesh: PolyMesh, halfedges: Halfedges) -> BoolArray:
    """Return which edges are on the boundary, or have faces that turn by more than `SHARP_DEG`."""
    normal = face_normals(mesh)
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    cosine = np.einsum("nd,nd->n", normal[halfedges.face[first]], normal[halfedges.face[twin]])
    return np.asarray((twin < 0) | (cosine < np.cos(np.radians(SHARP_DEG)) - 1e-9))


def _chains(pairs: list[list[int]], fixed: BoolArray, on: BoolArray) -> list[list[int]]:
    """Walk lines from fixed vertex to fixed vertex, then rings; a ring repeats its start."""
    stops = fixed.tolist()
    seen = np.zeros(len(fixed), dtype=bool).tolist()
    chains = []
    # Every vertex is passed once: walking is linear in the length of the lines.
    for start in [*np.flatnonzero(fixed).tolist(), *np.flatnonzero(on & ~fixed).tolist()]:
        for onward in pairs[start]:
            if seen[onward] or seen[start] or (stops[start] and stops[onward]):
                continue
            chain, last, here = [start], start, onward
            while not stops[here] and here != start:
                seen[here] = True
                chain.append(here)
                one, other = pairs[here]
                last, here = here, other if one == last else one
            chains.append([*chain, here])
            seen[start] = not stops[start]
    return chains


def _laid_out(mesh: PolyMesh, chains: list[list[int]], fixed: BoolArray) -> Lines:
    """Lay lines out in a row."""
    sizes = np.array([len(chain) for chain in chains], dtype=np.int64)
    offsets = offsets_of(sizes)
    flat = np.array([vertex for chain in chains for vertex in chain], dtype=np.int64)
    line = np.repeat(np.arange(len(sizes)), sizes)
    points = mesh.vertices[flat].reshape(-1, 3)
    step = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    # A gap before each line, so that no place belongs to two.
    step[offsets[:-1]] = 0.0
    step[offsets[:-1]] = step.mean() if len(step) else 0.0
    knots = np.cumsum(step)
    start, end = knots[offsets[:-1]], knots[offsets[1:] - 1]
    ring = flat[offsets[:-1]] == flat[offsets[1:] - 1]
    ring &= ~fixed[flat[offsets[:-1]]]
    # A fixed vertex stays, and the last vertex of a ring is its first one.
    moving = ~fixed[flat]
    moving[offsets[1:] - 1] = False
    sliding = np.flatnonzero(moving)
    number = np.full(len(flat), -1, dtype=np.int64)
    number[sliding] = np.arange(len(sliding))
    number[offsets[1:][ring] - 1] = number[offsets[:-1][ring]]
    first = ring[line[sliding]] & (sliding == offsets[line[sliding]])
    return Lines(
        fixed=fixed,
        sliding=flat[sliding],
        place=knots[sliding],
        start=start[line[sliding]],
        length=(end - start)[line[sliding]],
        closed=ring[line[sliding]],
        knots=knots,
        points=points,
        before=number[np.where(first, offsets[line[sliding] + 1] - 2, sliding - 1)],
        after=number[sliding + 1],
    )


# A step is no longer than this share of a vertex's shortest portal or edge, or of the way to its
# neighbour on a line: two neighbours never pass one another.
_STRIDE = 0.35
# No triangle around a face's centre gets flatter than this (1 is a right angle between sides of
# equal length) unless it was, and then no flatter than it was.
_FLATTEST = 0.15
# Halvings of a step that would turn faces over, before their vertices stay where they are.
_HALVINGS = 4


@frozen_value
class Footing:
    """Where the vertices of a mesh stand on a surface.

    Parameters
    ----------
    positions : (V, 3) float array
    normals : (V, 3) float array
        Unit normals of the surface there.
    places : (S,) float array
        Where sliding vertices are on their lines.
    flatness : (H,) float array
        For each half-edge's triangle with its face's centre, twice its area as seen along the
        surface's normal, divided by the square of the longer side at the centre; negative if the
        triangle is turned over.
    """

    positions: FloatArray
    normals: FloatArray
    places: FloatArray
    flatness: FloatArray


class Ground:
    """The surface and the lines on which the vertices of a mesh move."""

    def __init__(self, mesh: PolyMesh, surface: Surface, lines: Lines) -> None:
        """Find out which vertices are free, which slide, and which stay."""
        self._mesh, self._surface, self._lines = mesh, surface, lines
        self._face = face_of_corner(mesh)
        self._next, self._previous = next_corner(mesh), previous_corner(mesh)
        free = np.zeros(mesh.n_vertices, dtype=bool)
        free[mesh.indices] = True
        free[lines.fixed] = False
        free[lines.sliding] = False
        self._free: IntArray = np.flatnonzero(free)

    def start(self) -> Footing:
        """Return where the vertices of the mesh itself stand."""
        positions = self._mesh.vertices
        normals = self._surface.closest(positions)[1]
        return Footing(positions, normals, self._lines.place, self._flatness(positions, normals))

    def allowed(self, footing: Footing) -> FloatArray:
        """Return what projects moves to those along the surface or the lines, (V, 3, 3)."""
        result = np.zeros((self._mesh.n_vertices, 3, 3))
        normal = footing.normals[self._free]
        result[self._free] = np.eye(3) - normal[:, :, None] * normal[:, None, :]
        along = self._lines.directions(footing.places)
        result[self._lines.sliding] = along[:, :, None] * along[:, None, :]
        return result

    def moved(self, footing: Footing, move: FloatArray) -> Footing:
        """Return where an allowed move leads to, shortened where faces would turn over.

        Parameters
        ----------
        footing : Footing
        move : (V, 3) float array
            Along the surface or the lines; long steps are shortened.

        Returns
        -------
        Footing
            Vertices on the surface or on their lines, without a triangle that became flatter
            than is allowed.
        """
        length = np.linalg.norm(move, axis=1)
        move = move * np.minimum(1.0, self._reach(footing) / np.maximum(length, 1e-300))[:, None]
        least = np.minimum(footing.flatness, _FLATTEST) - 1e-12
        share = np.ones(len(move))
        changed = np.any(move != 0, axis=1)
        reached, tries = footing, 0
        # This terminates: vertices of faces that stay too flat go back to where they were one by
        # one.
        while changed.any():
            reached = self._placed(footing, reached, move * share[:, None], changed)
            spoilt = np.zeros(self._mesh.n_faces, dtype=bool)
            spoilt[self._face[~(reached.flatness >= least)]] = True
            changed = np.zeros(len(move), dtype=bool)
            changed[self._mesh.indices[spoilt[self._face]]] = True
            changed &= share > 0
            tries += 1
            share[changed] = share[changed] / 2 if tries <= _HALVINGS else 0.0
        return reached

    def _reach(self, footing: Footing) -> FloatArray:
        """Return how far each vertex may move in one step, (V,)."""
        here, portal = self._around(footing.positions)
        edge = here[self._next] - here
        short = np.minimum(np.sum(portal**2, axis=1), np.sum(edge**2, axis=1))
        # An edge counts at both of its ends.
        short = np.minimum(short, np.sum((here - here[self._previous]) ** 2, axis=1))
        reach = np.full(self._mesh.n_vertices, np.inf)
        np.minimum.at(reach, self._mesh.indices, np.sqrt(short))
        sliding = self._lines.sliding
        reach[sliding] = np.minimum(reach[sliding], self._lines.room(footing.places))
        return np.asarray(_STRIDE * reach)

    def _placed(
        self, start: Footing, last: Footing, move: FloatArray, changed: BoolArray
    ) -> Footing:
        """Return where a move leads from the start; where not changed, as in the last try."""
        positions, normals = last.positions.copy(), last.normals.copy()
        free = self._free[changed[self._free]]
        up = start.normals[free]
        aims = self._surface.dropped(start.positions[free] + move[free], up)
        points, normal, _ = self._surface.closest(aims)
        # The closest point may be on the other side of something thin.
        stays = np.einsum("nd,nd->n", normal, up) <= 0
        stays |= ~np.any(move[free], axis=1)
        positions[free] = np.where(stays[:, None], start.positions[free], points)
        normals[free] = np.where(stays[:, None], start.normals[free], normal)

        slides = changed[self._lines.sliding]
        vertices = self._lines.sliding[slides]
        along = self._lines.directions(start.places)[slides]
        step = np.einsum("nd,nd->n", move[vertices], along)
        places = last.places.copy()
        places[slides] = start.places[slides] + step
        places = self._lines.wrapped(places)
        points = self._lines.at(places)[slides]
        positions[vertices] = np.where(step[:, None] == 0, start.positions[vertices], points)
        normals[vertices] = self._surface.closest(positions[vertices])[1]
        return Footing(positions, normals, places, self._flatness(positions, normals))

    def _around(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the position of each corner, and that relative to its face's centre."""
        here = positions[self._mesh.indices]
        return here, here - face_centres(self._mesh.with_vertices(positions))[self._face]

    def _flatness(self, positions: FloatArray, normals: FloatArray) -> FloatArray:
        starts = self._mesh.offsets[:-1]
        normal = unit(np.add.reduceat(normals[self._mesh.indices], starts, axis=0))[self._face]
        here = self._around(positions)[1]
        there = here[self._next]
        longer = np.maximum(np.sum(here**2, axis=1), np.sum(there**2, axis=1))
        area = np.einsum("hd,hd->h", np.cross(here, there), normal)
        return area / np.where(longer > 0, longer, 1.0)


#: Vertices end on the surface within this share of the mesh's size.
ON_SURFACE = 1e-6

# Steps of the linear solver in an iteration, and the share of the error that is left to the next
# iteration anyway: more cost more than they gain.
_SOLVER_STEPS = 6
_SOLVED = 1e-6
# A step of less than this share of the size does not count.
_AT_REST = 1e-9
# How much steps are damped at first, relative to the stiffness.
_DAMPING = 1e-2


@dataclass(frozen=True)
class Waviness:
    """How wavy the threads of a mesh are, and how even the ribbons.

    Parameters
    ----------
    turning_deg : float
        Mean angle by which the middle of a developed strip changes its direction over a crossing,
        from the portal before it to the portal after it.
    width_spread : float
        The width that 5 % of the portals fall short of, divided by the median; 1 is even.
    shortest_edge : float
        In the mesh's unit.
    """

    turning_deg: float
    width_spread: float
    shortest_edge: float


@frozen_value
class Faired:
    """A faired mesh, and what fairing did.

    Parameters
    ----------
    mesh : PolyMesh
        The same connectivity; vertices on the given mesh's surface.
    iterations : int
        How many were made: fewer than asked if nothing moved any more.
    before, after : Waviness
    off_surface : float
        Largest distance of a vertex from the given surface, in the mesh's unit.
    centres_off : float
        Largest distance of the centre of a face from the given surface.
    moved : float
        Largest distance that a vertex moved.
    n_fixed : int
        Vertices that stay: corners of the boundary, and ends and corners of sharp edges.
    """

    mesh: PolyMesh
    iterations: int
    before: Waviness
    after: Waviness
    off_surface: float
    centres_off: float
    moved: float
    n_fixed: int

    def note(self, scale: float = 1.0) -> str:
        """Say what fairing did; lengths are multiplied by a scale."""
        before, after = self.before, self.after
        iterations = "iteration" if self.iterations == 1 else "iterations"
        text = (
            f"fairing: in {self.iterations} {iterations} vertices moved by up to "
            f"{self.moved * scale:.1f} mm along the surface. On average, threads turn by "
            f"{after.turning_deg:.1f}° at a crossing ({before.turning_deg:.1f}° before); one "
            f"ribbon width in twenty is below {after.width_spread:.0%} of the median "
            f"({before.width_spread:.0%} before); the shortest edge is "
            f"{after.shortest_edge * scale:.2f} mm ({before.shortest_edge * scale:.2f} mm before). "
            f"Centres of faces are up to {self.centres_off * scale:.2f} mm off the first surface"
        )
        return text + (f"; {self.n_fixed} corners stay" if self.n_fixed else "")


def fair_mesh(
    mesh: PolyMesh,
    iterations: int,
    *,
    portals: FloatArray | None = None,
    progress: Progress = no_progress,
) -> Faired:
    """Move the vertices of a mesh along its surface so that threads run straighter and more evenly.

    The surface is that of the triangles between each face's edges and its centre, on which
    ribbons are laid. Each iteration is a damped Gauss-Newton step of the energy in
    :class:`~fabweave.mesh.fairness.Fairness` in the tangent planes, projected back to the
    closest point of the surface. Vertices on the boundary and on sharp edges slide along these
    lines; their corners stay. No step is taken that turns a face over or raises the energy.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold mesh.
    iterations : int
        How many steps, 0 or more.
    portals : (H,) float array, optional
        Where threads cross each portal, from the vertex to the centre, as from
        :func:`~fabweave.mesh.fairness.portals_of`; in the middle by default.
    progress : callable

    Returns
    -------
    Faired

    Raises
    ------
    InputError
        If the number of iterations is negative, or no face has an area.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> flat = hypar(4, 4, 40.0, 0.0)
    >>> bent = flat.vertices + np.where(np.arange(25) == 12, 3.0, 0.0)[:, None] * [1, 1, 0]
    >>> faired = fair_mesh(flat.with_vertices(bent), 40)
    >>> faired.before.turning_deg > 5, faired.after.turning_deg < 1
    (True, True)
    """
    if iterations < 0:
        raise InputError(f"the mesh cannot be faired {iterations} times; write 0 or more")
    halfedges = build_halfedges(mesh)
    fairness = Fairness(mesh, halfedges, portals)
    try:
        surface = Surface(*fans(mesh))
    except ValueError as error:
        raise InputError(f"the mesh cannot be faired: {error}") from error
    lines = find_lines(mesh, halfedges)
    ground = Ground(mesh, surface, lines)
    footing = ground.start()
    slope = fairness.at(footing.positions)
    size = float(np.ptp(mesh.vertices, axis=0).max())
    damping, made = _DAMPING, 0
    for made in range(1, iterations + 1):
        progress("fairing", made - 1, iterations)
        tried = ground.moved(footing, _solve(slope, ground.allowed(footing), damping))
        if np.abs(tried.positions - footing.positions).max() < _AT_REST * size:
            break
        nearby = fairness.at(tried.positions)
        # Steps grow bolder while they lead down, and more careful where they do not.
        if nearby.energy < slope.energy:
            footing, slope, damping = tried, nearby, max(damping / 4, _DAMPING / 100)
        else:
            damping *= 8
    faired = mesh.with_vertices(footing.positions)
    return Faired(
        faired,
        made,
        _waviness(fairness, mesh.vertices, halfedges.tail, halfedges.head),
        _waviness(fairness, faired.vertices, halfedges.tail, halfedges.head),
        off_surface=float(surface.closest(faired.vertices)[2].max(initial=0.0)),
        centres_off=float(surface.closest(face_centres(faired))[2].max(initial=0.0)),
        moved=float(np.linalg.norm(faired.vertices - mesh.vertices, axis=1).max(initial=0.0)),
        n_fixed=int(np.count_nonzero(lines.fixed)),
    )


def _waviness(
    fairness: Fairness, positions: FloatArray, tail: IntArray, head: IntArray
) -> Waviness:
    turning, widths = fairness.turning_deg(positions), fairness.widths(positions)
    edges = np.linalg.norm(positions[head] - positions[tail], axis=1)
    return Waviness(
        float(turning.mean()) if len(turning) else 0.0,
        float(np.quantile(widths, 0.05) / np.median(widths)) if len(widths) else 1.0,
        float(edges.min()),
    )


def _solve(slope: Slope, allowed: FloatArray, damping: float) -> FloatArray:
    """Return the Gauss-Newton step that is allowed, by preconditioned conjugate gradients."""
    weight = np.maximum(slope.stiffness(), 1e-300)[:, None]
    scale = 1.0 / ((1.0 + damping) * weight)
    residual = _project(allowed, -slope.gradient())
    move = np.zeros_like(residual)
    ahead = scale * residual
    direction, size = ahead, float(np.sum(residual * ahead))
    goal = _SOLVED * size
    for _ in range(_SOLVER_STEPS):
        if size <= goal:
            break
        bent = _project(allowed, slope.curvature(direction) + damping * weight * direction)
        step = size / float(np.sum(direction * bent))
        move += step * direction
        residual -= step * bent
        ahead = scale * residual
        last, size = size, float(np.sum(residual * ahead))
        direction = ahead + (size / last) * direction
    return move


def _project(allowed: FloatArray, move: FloatArray) -> FloatArray:
    return np.einsum("vij,vj->vi", allowed, move)
