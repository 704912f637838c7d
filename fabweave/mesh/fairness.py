"""Measure how straight threads run over a mesh and how even ribbons are, and how to improve it."""

import numpy as np
from scipy import sparse

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.one_rings import sparse_rows
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.topology import label_links

#: Of the way from the vertex to the centre: no strand's middle comes nearer to either.
_LEAST = 0.2
_QUAD = 4


def portals_of(course: str, mesh: PolyMesh, halfedges: Halfedges) -> FloatArray | None:
    """Return where strands on a course cross each portal, (H,); None for the middle of all.

    Parameters
    ----------
    course : str
        ``straight``: where the medial line does. ``projection``: in the middle. ``auto``: straight
        in faces that are not quads.
    mesh, halfedges
        A mesh and its connectivity.

    Examples
    --------
    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> from fabweave.mesh.shapes.solids import cube, tetrahedron
    >>> mesh = tetrahedron()
    >>> portals_of("auto", mesh, build_halfedges(mesh)).round(9).tolist() == [0.75] * 12
    True
    >>> portals_of("auto", cube(), build_halfedges(cube())) is None
    True
    """
    quads = mesh.face_sizes == _QUAD
    if course == "projection" or (course == "auto" and quads.all()):
        return None
    portals = medial_portals(mesh, halfedges)
    return np.where(quads[halfedges.face], 0.5, portals) if course == "auto" else portals


def medial_portals(mesh: PolyMesh, halfedges: Halfedges) -> FloatArray:
    """Return where the line through the middles of edges crosses each portal, (H,).

    The middles a and b of the two edges of a corner and its vertex v span a plane. If the centre of
    the face, seen in it, is v + x (a - v) + y (b - v), the line from a to b is crossed at the share
    1 / (x + y) of the way from v to the centre.

    Parameters
    ----------
    mesh, halfedges
        A mesh and its connectivity.

    Returns
    -------
    (H,) float array
        Shares of the way from the vertex to the centre, from 0.2 to 0.8.

    Examples
    --------
    Half way in a square, three quarters of it in any triangle, a quarter in a regular hexagon:

    >>> from fabweave.mesh.halfedge import build_halfedges
    >>> square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    >>> turns = np.exp(1j * np.pi * np.arange(6) / 3)
    >>> hexagon = np.column_stack([turns.real, turns.imag, np.zeros(6)]).tolist()
    >>> for corners in (square, [[0, 0, 0], [5, 0, 0], [1, 2, 0]], hexagon):
    ...     mesh = PolyMesh.from_faces(corners, [list(range(len(corners)))])
    ...     print(set(medial_portals(mesh, build_halfedges(mesh)).round(9).tolist()))
    {0.5}
    {0.75}
    {0.25}
    """
    vertex = mesh.vertices[halfedges.head]
    before = mesh.vertices[halfedges.tail] - vertex
    after = mesh.vertices[halfedges.head[halfedges.next]] - vertex
    inward = face_centres(mesh)[halfedges.face] - vertex
    # x and y for whole edges; for half of them they are twice as large.
    aa, bb, ab = (_dots(p, q) for p, q in ((before, before), (after, after), (before, after)))
    ac, bc = _dots(before, inward), _dots(after, inward)
    area = aa * bb - ab * ab
    total = ac * bb - bc * ab + bc * aa - ac * ab
    flat = area <= 1e-9 * aa * bb
    share = np.divide(area, 2.0 * total, out=np.full(len(aa), 0.5), where=~flat & (total > 0))
    return np.clip(share, _LEAST, 1.0 - _LEAST)


def _dots(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("ij,ij->i", first, second))


@frozen_value
class Portals:
    """The portals of a mesh at some positions, one for each corner of a face.

    The portal of half-edge ``h`` runs from the centre of its face to its head; the thread that
    passes that corner comes over the edge of ``h`` and goes on over the next one. In between it
    runs straight across the crossings' quads, so it turns at portals only.

    Parameters
    ----------
    arriving, leaving, across : (H, 3) float arrays
        Unit vectors from the middle of the portal before to this one's, from this one's to the
        next one's, and along the portal. Meaningless where there is no crossing before or after.
    come, go, width : (H,) float arrays
        The lengths of these; 1 where they vanish.
    """

    arriving: FloatArray
    leaving: FloatArray
    across: FloatArray
    come: FloatArray
    go: FloatArray
    width: FloatArray


def turns_in_a_row(half: Halfedges, passed: BoolArray, length: int) -> sparse.csr_array:
    """Return the map from turns at portals to sums along threads, over as many as asked.

    A thread turns left at a portal by what it turns there when it passes the corner forward, and
    by the opposite when it passes it backward. Threads are walked both ways, which the factor
    √½ makes up for in squares.
    """
    count = half.n_halfedges
    # As threads are traced: a forward pass of a corner goes on over the next edge, backward.
    ahead, behind = half.twin[half.next], half.twin
    after = np.concatenate(
        [
            np.where(ahead >= 0, count + half.prev[ahead], -1),
            np.where(behind >= 0, behind, -1),
        ]
    )
    passed_either_way = np.tile(passed, 2)
    walk = [np.flatnonzero(passed_either_way)]
    for _ in range(length - 1):
        onward = after[walk[-1]]
        goes_on = (onward >= 0) & passed_either_way[onward]
        walk = [states[goes_on] for states in [*walk, onward]]
    states = np.stack(walk, axis=1)
    signs = np.where(states >= count, -1.0, 1.0) * np.sqrt(0.5)
    return sparse_rows(states % count, signs, count)


def ideal_cosines(half: Halfedges, n_vertices: int, sizes: IntArray) -> FloatArray:
    """Return the cosine at which threads would arrive at each portal if all were regular.

    The quad of a crossing has the angle 2π/k at a vertex with k edges and 2π/n at the centre of
    a face with n in a regular tiling, where the two add up to π; elsewhere they are scaled to.
    """
    edges = np.bincount(half.tail, minlength=n_vertices)
    # A straight boundary is half a turn.
    edges[half.tail[half.twin < 0]] *= 2
    return np.cos(np.pi * sizes / (sizes + edges[half.head]))


# What counts how much, as factors of residuals. Threads should keep their direction over two
# portals in a row, and over four: turns that add up make wavy strips, turns that cancel do not.
_STRAIGHT = {2: 1.0, 4: 0.5}
# They should meet portals at the angle of a regular tiling, which is the right one for quads.
_SQUARE = 0.35
# Ribbons should have room to be wide. The power makes narrow places count, and wide ones hardly.
_ROOM = 0.11
_POWER = 2.0
# Beyond this sine a thread runs along its portal, and nothing is learnt from the exact angle.
_LEAST_SINE = 1e-3


class Fairness:
    """The energy whose least value is the fairest mesh, for one connectivity.

    Let a thread arrive at a portal of length ``w`` at an angle with cosine ``a``, and leave it at
    one with cosine ``b``. The energy is a weighted sum of squares of

    - ``a - b`` added up over two and over four portals in a row, signed to the left: that is
      how much the developed thread turns there (a portal where ``a = b`` unfolds straight),
    - ``a`` and ``b``, less what they are in a regular tiling,
    - ``(W / w sin)²``, where ``w sin`` is the ribbon's room there, as wide as it can be made, and
      ``W`` the width of even portals; and likewise for the lengths of boundary edges.

    It does not depend on the mesh's scale.
    """

    def __init__(
        self, mesh: PolyMesh, halfedges: Halfedges, portals: FloatArray | None = None
    ) -> None:
        """Set up the sparse maps from positions to portals, crossed in the middle by default."""
        half, count, n_vertices = halfedges, halfedges.n_halfedges, mesh.n_vertices
        sizes = mesh.face_sizes[half.face]
        crossed = half.twin >= 0
        self.arrives = crossed.astype(np.float64)
        self.leaves = self.arrives[half.next]
        # A portal beside two boundary edges is passed by no ribbon.
        self._used: BoolArray = (self.arrives + self.leaves) > 0
        passed = crossed & crossed[half.next]
        self._turns = {length: turns_in_a_row(half, passed, length) for length in _STRAIGHT}
        self._passed = passed.astype(np.float64)
        drift = sparse.vstack(
            [weight * self._turns[length] for length, weight in _STRAIGHT.items()], format="csr"
        )
        self.drift, self.drift_back = drift, drift.T.tocsr()
        self.drift_squares = np.asarray(drift.multiply(drift).sum(axis=0)).reshape(-1)
        if portals is None:
            self.ideal = ideal_cosines(half, n_vertices, sizes)
            portals = np.full(count, 0.5)
        else:
            # In a regular tiling, medial lines meet portals at right angles.
            self.ideal = np.zeros(count)

        self._to_centres = sparse.csr_array(
            (1.0 / sizes, (half.face, half.tail)), shape=(mesh.n_faces, n_vertices)
        )
        own, other = n_vertices + half.face, n_vertices + half.face[half.twin]
        ends = np.stack([half.head, half.tail, own, other], axis=1)
        width = n_vertices + mesh.n_faces
        self._map = sparse.vstack(
            [
                # Beside a boundary edge, half its square's diagonal in place of what is not there.
                sparse_rows(
                    ends,
                    np.where(
                        crossed[:, None],
                        _way(portals, portals[half.twin]),
                        np.array([1, -1, 0, 0]) * np.sqrt(0.5),
                    ),
                    width,
                ),
                sparse_rows(
                    ends[half.next],
                    _way(portals[half.prev[half.twin[half.next]]], portals)[:, [0, 1, 3, 2]],
                    width,
                ),
                sparse_rows(ends[:, [0, 2]], np.array([1.0, -1.0]), width),
            ],
            format="csr",
        )
        self._back, self._centres_back = self._map.T.tocsr(), self._to_centres.T.tocsr()
        self._squares = self._back.power(2), self._centres_back.power(2)

        component = label_links(half.tail, half.head, n_vertices)[1][half.tail]
        square = self.portals(mesh.vertices).width ** 2 * self._used
        number = np.maximum(np.bincount(component, weights=self._used), 1.0)
        self.wanted = np.sqrt(np.bincount(component, weights=square) / number)[component]

    def portals(self, positions: FloatArray) -> Portals:
        """Return the portals of the mesh with its vertices at some positions, (V, 3)."""
        vectors = np.split(self.forward(positions), 3)
        lengths = [np.sqrt(_dot(vector, vector)) for vector in vectors]
        lengths = [np.where(length > 0, length, 1.0) for length in lengths]
        return Portals(
            *(vector / length[:, None] for vector, length in zip(vectors, lengths, strict=True)),
            *lengths,
        )

    def turning_deg(self, positions: FloatArray) -> FloatArray:
        """Return by how much developed threads turn over each crossing, unsigned.

        That is the turn at the portal before it plus that at the portal after it, so the zigzag
        of a regular triangle mesh is straight. Crossings next to the end of a thread are left out.
        """
        portals = self.portals(positions)
        turn = _angle(portals.leaving, portals.across) - _angle(portals.arriving, portals.across)
        # Each crossing is passed by a thread in either direction.
        sums = np.sqrt(2) * (self._turns[2] @ (self._passed * turn))
        return np.degrees(np.abs(sums))

    def widths(self, positions: FloatArray) -> FloatArray:
        """Return the length of every portal that a ribbon passes."""
        return self.portals(positions).width[self._used]

    def at(self, positions: FloatArray) -> "Slope":
        """Return the energy near some positions, to first order in its residuals."""
        return Slope(self, positions)

    def forward(self, positions: FloatArray) -> FloatArray:
        """Return what the vectors at portals become by positions or moves, (3H, 3)."""
        return np.asarray(self._map @ np.concatenate([positions, self._to_centres @ positions]))

    def adjoint(self, parts: FloatArray) -> FloatArray:
        """Return the transpose of `forward` applied to rows for the vectors at portals."""
        both = self._back @ parts
        n_vertices = self._centres_back.shape[0]
        return np.asarray(both[:n_vertices] + self._centres_back @ both[n_vertices:])

    def adjoint_squares(self, parts: FloatArray) -> FloatArray:
        """Return the same with squared coefficients, as if the centres were independent."""
        both = self._squares[0] @ parts
        n_vertices = self._centres_back.shape[0]
        return np.asarray(both[:n_vertices] + self._squares[1] @ both[n_vertices:])


class Slope:
    """An energy at one place: its residuals and their derivatives."""

    def __init__(self, fairness: Fairness, positions: FloatArray) -> None:
        """Find the residuals and their derivatives by cosines and by logarithms of lengths.

        Residuals are drifts; then, for arriving and for leaving, how far from square, and the
        lack of room; at last how short boundary edges are.
        """
        self._fairness, portals = fairness, fairness.portals(positions)
        a, b = _dot(portals.arriving, portals.across), _dot(portals.leaving, portals.across)
        residuals = [fairness.drift @ (a - b)]
        self._square, self._by_cosine, self._by_log = [], [], []
        for cosine, ideal, is_there in (
            (a, fairness.ideal, fairness.arrives),
            (b, -fairness.ideal, fairness.leaves),
        ):
            sine2 = np.maximum(1 - cosine**2, _LEAST_SINE**2)
            room = np.sqrt(sine2) * portals.width
            lack = _ROOM * is_there * (fairness.wanted / room) ** _POWER
            residuals += [_SQUARE * is_there * (cosine - ideal), lack]
            self._square.append(_SQUARE * is_there)
            self._by_cosine.append(_POWER * lack * cosine / sine2)
            self._by_log.append(-_POWER * lack)
        short = _ROOM * (1.0 - fairness.arrives) * (fairness.wanted / portals.come) ** _POWER
        self._residuals, self._short = [*residuals, short], -_POWER * short
        self.energy = float(sum(np.sum(part**2) for part in self._residuals))
        a, b = a[:, None], b[:, None]
        come, go, width = (part[:, None] for part in (portals.come, portals.go, portals.width))
        # Derivatives of the cosines and of the logarithms by the vectors.
        self._a_arriving = (portals.across - a * portals.arriving) / come
        self._b_leaving = (portals.across - b * portals.leaving) / go
        self._a_across = (portals.arriving - a * portals.across) / width
        self._b_across = (portals.leaving - b * portals.across) / width
        self._log_across = portals.across / width
        self._log_arriving = portals.arriving / come

    def gradient(self) -> FloatArray:
        """Return half the gradient of the energy, (V, 3)."""
        return self._pull(self._residuals)

    def curvature(self, move: FloatArray) -> FloatArray:
        """Return what the Gauss-Newton matrix makes of a move, (V, 3)."""
        arriving, leaving, across = np.split(self._fairness.forward(move), 3)
        a = _dot(self._a_arriving, arriving) + _dot(self._a_across, across)
        b = _dot(self._b_leaving, leaving) + _dot(self._b_across, across)
        log = _dot(self._log_across, across)
        changes = [self._fairness.drift @ (a - b)]
        for k, cosine in enumerate((a, b)):
            changes += [
                self._square[k] * cosine,
                self._by_cosine[k] * cosine + self._by_log[k] * log,
            ]
        return self._pull([*changes, self._short * _dot(self._log_arriving, arriving)])

    def stiffness(self) -> FloatArray:
        """Return about the mean diagonal of that matrix at each vertex, (V,)."""
        a, b = (
            self._fairness.drift_squares + self._square[k] ** 2 + self._by_cosine[k] ** 2
            for k in range(2)
        )
        log = self._by_log[0] ** 2 + self._by_log[1] ** 2
        arriving = a * _size2(self._a_arriving) + self._short**2 * _size2(self._log_arriving)
        across = a * _size2(self._a_across) + b * _size2(self._b_across)
        across += log * _size2(self._log_across)
        parts = np.concatenate([arriving, b * _size2(self._b_leaving), across])
        return self._fairness.adjoint_squares(parts / 3)

    def _pull(self, values: list[FloatArray]) -> FloatArray:
        """Return the transposed derivatives applied to values for the residuals."""
        drift, a_square, a_lack, b_square, b_lack, short = values
        turn = self._fairness.drift_back @ drift
        a = (turn + self._square[0] * a_square + self._by_cosine[0] * a_lack)[:, None]
        b = (self._square[1] * b_square + self._by_cosine[1] * b_lack - turn)[:, None]
        log = (self._by_log[0] * a_lack + self._by_log[1] * b_lack)[:, None]
        arriving = a * self._a_arriving + (self._short * short)[:, None] * self._log_arriving
        across = a * self._a_across + b * self._b_across + log * self._log_across
        return self._fairness.adjoint(np.concatenate([arriving, b * self._b_leaving, across]))


def _way(end: FloatArray, start: FloatArray) -> FloatArray:
    """Return coefficients of the way from one place on a portal to one on the next, (H, 4).

    They belong to the vertices at the end and at the start, and to the centres likewise.
    """
    return np.stack([1.0 - end, start - 1.0, end, -start], axis=1)


def _angle(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the angles between vectors in radians, exact for small ones too."""
    cross = np.linalg.norm(np.cross(first, second), axis=1)
    return np.arctan2(cross, _dot(first, second))


def _size2(vectors: FloatArray) -> FloatArray:
    return _dot(vectors, vectors)


def _dot(first: FloatArray, second: FloatArray) -> FloatArray:
    return np.einsum("nd,nd->n", first, second)
