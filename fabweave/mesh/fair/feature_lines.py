"""Find the boundary and the sharp edges of a mesh, and slide vertices along them."""

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, offsets_of, unit
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres

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
    edges = _line_edges(mesh, halfedges)
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


def _line_edges(mesh: PolyMesh, halfedges: Halfedges) -> IntArray:
    """Return a half-edge of each edge that is on the boundary or sharp."""
    centres = face_centres(mesh)[halfedges.face]
    spans = np.cross(
        mesh.vertices[halfedges.tail] - centres, mesh.vertices[halfedges.head] - centres
    )
    normal = unit(np.add.reduceat(spans, mesh.offsets[:-1], axis=0))
    first = halfedges.edge_halfedge
    twin = halfedges.twin[first]
    cosine = np.einsum("nd,nd->n", normal[halfedges.face[first]], normal[halfedges.face[twin]])
    return first[(twin < 0) | (cosine < np.cos(np.radians(SHARP_DEG)) - 1e-9)]


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
