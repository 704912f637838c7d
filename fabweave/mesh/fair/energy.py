"""Measure how far a mesh is from one that weaves well and is like its model.

What is measured is calculated together with its derivatives.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value, unit
from fabweave.mesh.fair.portals import crossing_shares, walks
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.nearest import Surface
from fabweave.mesh.one_rings import interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_normals
from fabweave.mesh.remesh.fit import Model, line_edges
from fabweave.mesh.triangulate import fans

#: Lengths below this are taken for it, so that nothing is divided by zero.
_TINY = 1e-300


@dataclass(frozen=True)
class Varying:
    """Numbers that vary with some coordinates, and how fast (forward differentiation).

    Parameters
    ----------
    value : (N,) or (N, 3) float array
    slope : (N, C) or (N, 3, C) float array
        The derivative by each of C coordinates.
    """

    value: FloatArray
    slope: FloatArray

    def __add__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the sum."""
        if isinstance(other, Varying):
            return Varying(self.value + other.value, self.slope + other.slope)
        return Varying(self.value + other, self.slope)

    def __sub__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the difference."""
        return self + other * -1.0

    def __mul__(self, other: "Varying | FloatArray | float") -> "Varying":
        """Return the product of numbers."""
        if isinstance(other, Varying):
            slope = self.slope * other.value[..., None] + other.slope * self.value[..., None]
            return Varying(self.value * other.value, slope)
        return Varying(self.value * other, self.slope * np.asarray(other)[..., None])

    def __truediv__(self, other: "Varying") -> "Varying":
        """Return the quotient of numbers."""
        return self * other.by(1.0 / other.value, -1.0 / other.value**2)

    def by(self, value: FloatArray, rate: FloatArray) -> "Varying":
        """Return a function of these numbers: its values, and its derivatives by them."""
        return Varying(value, rate[..., None] * self.slope)

    def log(self) -> "Varying":
        """Return the logarithm of numbers."""
        return self.by(np.log(self.value), 1.0 / self.value)

    def root(self) -> "Varying":
        """Return the square root of numbers that are not negative."""
        root = np.sqrt(np.maximum(self.value, _TINY))
        return self.by(root, 0.5 / root)

    def size(self) -> "Varying":
        """Return how large numbers are."""
        return self.by(np.abs(self.value), np.sign(self.value))

    def over(self, bound: float = 0.0) -> "Varying":
        """Return by how much numbers exceed a bound, or zero."""
        more = self.value > bound
        return self.by(np.where(more, self.value - bound, 0.0), more.astype(np.float64))

    def dot(self, other: "Varying") -> "Varying":
        """Return the scalar product of vectors."""
        slope = np.einsum("nd,ndc->nc", self.value, other.slope)
        slope += np.einsum("nd,ndc->nc", other.value, self.slope)
        return Varying(np.einsum("nd,nd->n", self.value, other.value), slope)

    def cross(self, other: "Varying") -> "Varying":
        """Return the vector product."""
        slope = np.cross(self.value[:, :, None], other.slope, axis=1)
        slope -= np.cross(other.value[:, :, None], self.slope, axis=1)
        return Varying(np.cross(self.value, other.value), slope)

    def unit(self) -> tuple["Varying", "Varying"]:
        """Return vectors at length one, and their lengths."""
        length = self.dot(self).root()
        way = self.value / length.value[:, None]
        slope = self.slope - way[:, :, None] * length.slope[:, None, :]
        return Varying(way, slope / length.value[:, None, None]), length


def combined(points: FloatArray, shares: FloatArray | list[float]) -> Varying:
    """Return sums of K points by shares, as they vary with the coordinates of these points.

    Parameters
    ----------
    points : (N, K, 3) float array
    shares : (N, K) or (K,) float array

    Returns
    -------
    Varying
        Vectors; the coordinates are those of the first point, then those of the second, and so on.
    """
    count, number = points.shape[:2]
    share = np.broadcast_to(shares, (count, number))
    slope = np.einsum("nk,de->ndke", share, np.eye(3)).reshape(count, 3, 3 * number)
    return Varying(np.einsum("nk,nkd->nd", share, points), slope)


@dataclass(frozen=True)
class Wish:
    """What ribbons should be like; the defaults are those of card.

    Parameters
    ----------
    least_mm, most_mm : float
        Narrower and wider ones are a nuisance to hands.
    radius_mm : float
        The least to which the material bends.
    twist_deg : float
        The most by which it twists over a length that equals its width.
    """

    least_mm: float = 6.0
    most_mm: float = 30.0
    radius_mm: float = 8.0
    twist_deg: float = 31.0


@dataclass(frozen=True)
class EnergyConfig:
    """The numbers of the energy: weights of its terms, and from where on these count.

    All are without unit: lengths count in mean edges, and rooms as logarithms. They were set by
    trial; none is derived from theory.
    """

    #: Strands turn little over so many portals in a row, by weight: turns that add up make wavy
    #: strips, turns that cancel do not.
    turns: tuple[tuple[int, float], ...] = ((2, 2.0), (4, 1.0))
    #: They meet portals at right angles.
    square: float = 0.3
    #: Rooms change little along a strand, and are even all over;
    along: float = 1.2
    even: float = 0.6
    #: they are not too narrow for the one width that most ribbons have,
    narrow: float = 4.0
    #: nor wider than wished for.
    wide: float = 1.0
    #: Spans bend little, and not more tightly than the material takes;
    bend: float = 0.05
    tight: float = 2.0
    #: so with twist.
    twist: float = 0.1
    wrung: float = 4.0
    #: Quads are flat.
    plane: float = 0.05
    #: The mesh is near the model, and the model near it.
    close: float = 6.0
    cover: float = 6.0
    #: Vertices with three edges stay near it by so many times as much: strands around one run
    #: straight where it stands out like the corner of a cube, which looks like a wart.
    corner: float = 4.0
    #: Thin parts are not thinner than ribbons like.
    thin: float = 1.5
    #: Boundaries and sharp lines stay lines.
    line: float = 3.0
    #: Ribbons take this share of their room.
    share: float = 0.65
    #: Bends and twists begin to count at such shares of what the material takes.
    firm: float = 1.5
    loose: float = 0.8
    #: Samples as far off as this share of the mean edge count twice, so that tips come out.
    far: float = 0.25
    #: Both sides of a part are as far apart as so many of the narrowest ribbons; what is sought are
    #: faces whose normals have a scalar product below this.
    thick: float = 2.5
    opposed: float = -0.5
    #: No wish for a least width is larger than this share of the mean room, nor one for a greatest
    #: width smaller than its inverse.
    usual: float = 0.5
    #: Ribbons of one width take that share of the mean room.
    one_width: float = 0.75
    #: No wish for a least radius is larger than this share of the mean edge: so stiff a material
    #: would flatten the model.
    tightest: float = 0.3
    #: The flattened quad of a crossing has at least this area, in squares of the mean edge.
    thinnest: float = 1e-4


CONFIG = EnergyConfig()

#: Beyond this squared sine a strand runs along its portal.
_LEAST_SINE2 = 1e-6

#: What is nearer than this many mean edges touches.
_TOUCHING = 1e-9

#: Quantities, (N,), and their derivatives by the coordinates of vertices: all x, all y, all z.
_Rows: TypeAlias = tuple[FloatArray, sparse.csr_array]


@frozen_value
class QuadraticModel:
    """The energy near some positions.

    Parameters
    ----------
    positions : (V, 3) float array
    linked, alone : pairs of arrays
        Quantities that count together, and those that stand alone, with their derivatives.
    together : (N, N) sparse array
        How the former count together.
    """

    positions: FloatArray
    linked: _Rows
    alone: _Rows
    together: sparse.csr_array

    @cached_property
    def _pulled(self) -> FloatArray:
        return np.asarray(self.together @ self.linked[0])

    @cached_property
    def value(self) -> float:
        """The energy."""
        values, others = self.linked[0], self.alone[0]
        return float(values @ self._pulled + others @ others)

    @cached_property
    def gradient(self) -> FloatArray:
        """Half its gradient, (3V,)."""
        others, by_others = self.alone
        return np.asarray(self.linked[1].T @ self._pulled + by_others.T @ others)

    @cached_property
    def curvature(self) -> sparse.csc_array:
        """Half its curvature, (3V, 3V)."""
        slopes, by_others = self.linked[1], self.alone[1]
        return (slopes.T @ (self.together @ slopes) + by_others.T @ by_others).tocsc()


class Energy:
    """A sum of squares whose least value is the mesh that weaves best.

    Let a strand arrive at a portal (from vertex to face centre) along A and leave it along B, both
    chords between the points at which it crosses portals, and a, b be their cosines with the
    portal. Developed, it turns by the difference of their angles; its room is the length of the
    portal times the sine. Crossings have the normals of their quads; a span between two of them
    with slopes α and β against its chord of length l bends by k = |α + β| + √(2 α² + 2 β²) over l.

    It is a function of positions alone: the closest points are found anew for each. Lengths count
    in mean edges of the mesh at first, so that it does not depend on scale if the wish goes along.

    Parameters
    ----------
    mesh : PolyMesh
        The mesh to be woven.
    model : Model
        What it is to be like.
    wish : Wish
        What ribbons are to be like.
    course : str
        How strands cross faces, as ``--course`` says it.
    """

    def __init__(
        self, mesh: PolyMesh, model: Model, wish: Wish | None = None, course: str = "auto"
    ) -> None:
        """Set up what does not depend on positions."""
        half = build_halfedges(mesh)
        self._mesh, self._model, self._wish = mesh, model, wish or Wish()
        n_vertices = mesh.n_vertices
        first = half.edge_halfedge
        ends = np.stack([half.tail[first], half.head[first]], axis=1)
        self.unit = float(np.linalg.norm(np.diff(mesh.vertices[ends], axis=1), axis=2).mean())
        centres = sparse.csr_array(
            (1.0 / mesh.face_sizes[half.face], (half.face, half.tail)),
            shape=(mesh.n_faces, n_vertices),
        )
        self._all = sparse.vstack([sparse.eye_array(n_vertices), centres], format="csr")
        self._xyz = sparse.kron(sparse.eye_array(3), self._all, format="csr")
        middles = _rows(ends, np.full(ends.shape, 0.5), n_vertices)
        self._close = sparse.vstack([self._all, middles], format="csr")
        self._closely = np.full(self._close.shape[0], CONFIG.close)
        inside, valence = interior_valences(half)
        self._closely[inside[valence == 3]] *= CONFIG.corner

        crossed = half.twin >= 0
        passed = crossed & crossed[half.next]
        own, other = n_vertices + half.face, n_vertices + half.face[half.twin]
        around = half.tail, half.head, half.head[half.next], own, other, other[half.next]
        self._stencil = np.stack(around, axis=1)[passed]
        shares = crossing_shares(mesh, half, course)
        before, after = half.twin, half.prev[half.twin[half.next]]
        self._shares = np.stack([shares, shares[before], shares[after]], axis=1)[passed]
        self._two, self._together = _links(half, passed)
        # Beside the boundary a portal has one crossing, and its room is as long as it is.
        self._rim = np.stack([half.head, own], axis=1)[crossed != crossed[half.next]]
        rim_shares = shares[crossed != crossed[half.next]]
        self._rim_free = np.log(2.0 * CONFIG.share * np.minimum(rim_shares, 1.0 - rim_shares))
        self._quads = mesh.indices[mesh.offsets[:-1][mesh.face_sizes == 4, None] + np.arange(4)]

        on_line = line_edges(model, mesh, half)
        self._lines = []
        inner = crossed[first]
        for which, line in ((~inner, model.rim), (inner, model.sharp)):
            edges = np.flatnonzero(on_line & which)
            if len(edges) and len(line.points):
                corners = np.unique(ends[edges])
                kept = np.concatenate([corners, self._all.shape[0] + edges])
                self._lines.append((self._close[kept], line))

        rooms = self.rooms(mesh.vertices) / self.unit
        usual = float(rooms.mean()) if passed.any() else 1.0
        self._usual, self._least = float(np.log(usual)), CONFIG.one_width * usual
        self._radius = min(self._wish.radius_mm, CONFIG.tightest * self.unit)
        self._most = max(self._wish.most_mm / self.unit, usual / CONFIG.usual)
        points, self._triangles = fans(mesh)
        feet = Surface(points, self._triangles).feet(model.places)
        # The closest point of a sheet that looks the other way is on the far side of a thin limb.
        fits = np.einsum("nd,nd->n", feet.normals, model.normals) > 0
        self._samples = model.places[fits]
        self._opposite(mesh, points[n_vertices:], usual)

    def _opposite(self, mesh: PolyMesh, centres: FloatArray, usual: float) -> None:
        """Find faces that look at one another or away from one another, and their least gaps."""
        thick = CONFIG.thick * min(self._wish.least_mm, CONFIG.usual * usual * self.unit)
        normals = face_normals(mesh)
        close = cKDTree(centres).query_pairs(2.0 * thick, output_type="ndarray")
        pairs = np.concatenate([close, close[:, ::-1]]).astype(np.int64)
        own, facing = normals[pairs[:, 0]], normals[pairs[:, 1]]
        offset = centres[pairs[:, 0]] - centres[pairs[:, 1]]
        away = np.einsum("nd,nd->n", own, offset) > 0
        opposed = np.flatnonzero(np.einsum("nd,nd->n", own, facing) < CONFIG.opposed)
        order = opposed[np.argsort(np.linalg.norm(offset[opposed], axis=1), kind="stable")]
        # Of all that are opposite to a face on either side of it, the nearest.
        side = 2 * pairs[order, 0] + away[order]
        kept = order[np.unique(side, return_index=True)[1]]
        self._across = np.where(away[kept], 1.0, -1.0)[:, None] * unit(own[kept] - facing[kept])
        # A part gets thicker; ribbons on two parts come no nearer.
        gap = np.einsum("nd,nd->n", offset[kept], self._across)
        self._gap = np.where(away[kept], thick, np.minimum(gap, thick))
        signs = np.broadcast_to([1.0, -1.0], (len(kept), 2))
        ends = _rows(mesh.n_vertices + pairs[kept], signs, self._all.shape[0])
        self._sides = ends @ self._all

    def at(self, positions: FloatArray) -> QuadraticModel:
        """Return the energy near some positions, (V, 3)."""
        linked, alone = self._portal_rows(positions)
        alone += [*self._face_rows(positions), *self._distance_rows(positions)]
        return QuadraticModel(positions, _stacked(linked), _stacked(alone), self._together)

    def turns_deg(self, positions: FloatArray) -> FloatArray:
        """Return by how much developed strands turn over each crossing, walked both ways."""
        a, b, _ = self._rooms(self._around(positions))
        turn = np.arccos(np.clip(b.value, -1, 1)) - np.arccos(np.clip(a.value, -1, 1))
        return np.degrees(np.abs(self._two @ turn))

    def rooms(self, positions: FloatArray) -> FloatArray:
        """Return how wide ribbons would be at each portal that they pass, by their usual share."""
        return self.unit * np.exp(self._rooms(self._around(positions))[2].value)

    def _around(self, positions: FloatArray) -> FloatArray:
        """Return the points on which the quantities of each portal depend, (N, 6, 3)."""
        return np.asarray((self._all @ positions)[self._stencil])

    def _rooms(self, points: FloatArray) -> tuple[Varying, Varying, Varying]:
        """Return both cosines at each portal, and the logarithm of the room in mean edges."""
        s, before, after = self._shares.T
        none = np.zeros(len(s))
        here = np.stack([none, 1 - s, none, s, none, none], axis=1)
        back = np.stack([1 - before, none, none, none, before, none], axis=1)
        onward = np.stack([none, none, 1 - after, none, none, after], axis=1)
        arriving, _ = combined(points, here - back).unit()
        leaving, _ = combined(points, onward - here).unit()
        portal, length = combined(points, [0.0, 1, 0, -1, 0, 0]).unit()
        a, b = arriving.dot(portal), leaving.dot(portal)
        slant = (a + b) * 0.5
        sine2 = (slant * slant * -1.0 + 1.0).over(_LEAST_SINE2) + _LEAST_SINE2
        free = 2.0 * CONFIG.share * np.minimum(s, 1.0 - s)
        return a, b, (length * (1.0 / self.unit)).log() + sine2.log() * 0.5 + np.log(free)

    def _portal_rows(self, positions: FloatArray) -> tuple[list[_Rows], list[_Rows]]:
        """Return the quantities that go together along strands, and those that stand alone."""
        points = self._around(positions)
        a, b, room = self._rooms(points)
        across = combined(points, [-1.0, 1, 0, 0, 0, 0]), combined(points, [0.0, -1, 1, 0, 0, 0])
        centres = combined(points, [0.0, 0, 0, 1, -1, 0]), combined(points, [0.0, 0, 0, 1, 0, -1])
        (one, first), (two, second) = (
            e.cross(c).unit() for e, c in zip(across, centres, strict=True)
        )
        # Flattened, the quad of a crossing has less room the more it is folded. Strands halve its
        # sides: its area over twice the way between these middles is what they have.
        scale, panels = 1.0 / self.unit, []
        for area, e, c in ((first, across[0], centres[0]), (second, across[1], centres[1] * -1.0)):
            wide = (area * scale * scale + CONFIG.thinnest).log() - (
                (e + c).unit()[1] * scale
            ).log()
            panels.append((wide + np.log(CONFIG.share)) * -1.0)
        way, length = combined(points, [-0.25, 0, 0.25, 0, -0.25, 0.25]).unit()
        start, end = way.dot(one) * -1.0, way.dot(two) * -1.0
        need = (start + end).size() + ((start * start + end * end) * 2.0).root()
        bend, twist = need / length, way.dot(one.cross(two))
        width = room.by(np.exp(room.value), np.exp(room.value))
        limit = CONFIG.loose * np.radians(self._wish.twist_deg)
        linked = a - b, a + b, room - self._usual
        alone = (
            (room * -1.0).over(-np.log(self._least)) * CONFIG.narrow,
            *(panel.over(-np.log(self._least)) * CONFIG.narrow for panel in panels),
            room.over(np.log(self._most)) * CONFIG.wide,
            bend * (CONFIG.bend * self.unit),
            (bend * (CONFIG.firm * self._radius)).over(1.0) * CONFIG.tight,
            twist * CONFIG.twist,
            (twist.size() * width / length * (self.unit / limit)).over(1.0) * CONFIG.wrung,
        )
        stencil = self._stencil
        return (
            [self._rows_of(quantity, stencil, np.ones(len(stencil), bool)) for quantity in linked],
            [self._rows_of(quantity, stencil, quantity.value != 0) for quantity in alone],
        )

    def _face_rows(self, positions: FloatArray) -> list[_Rows]:
        """Return how uneven rooms are beside the boundary, and how far from flat quads are."""
        rim = combined((self._all @ positions)[self._rim], [1.0, -1.0]).unit()[1]
        rim = (rim * (1.0 / self.unit)).log()
        rooms = (rim + (self._rim_free - self._usual)) * CONFIG.even
        points = positions[self._quads]
        diagonals = combined(points, [-1.0, 0, 1, 0]), combined(points, [0.0, -1, 0, 1])
        normal, _ = diagonals[0].cross(diagonals[1]).unit()
        apart = combined(points, [1.0, -1, 1, -1]).dot(normal) * (CONFIG.plane / self.unit)
        return [
            self._rows_of(quantity, points, quantity.value != 0)
            for quantity, points in ((rooms, self._rim), (apart, self._quads))
        ]

    def _rows_of(self, quantity: Varying, points: IntArray, kept: BoolArray) -> _Rows:
        """Return some quantities that vary with points as they vary with the vertices."""
        total = self._all.shape[0]
        columns = points[kept][:, :, None] + total * np.arange(3)
        columns = columns.reshape(len(columns), 3 * points.shape[1])
        return quantity.value[kept], _rows(columns, quantity.slope[kept], 3 * total) @ self._xyz

    def _distance_rows(self, positions: FloatArray) -> list[_Rows]:
        """Return how far the mesh is from its model, the model from it, and lines from lines."""
        points = self._close @ positions
        feet = self._model.surface.feet(points)
        share = np.sqrt(len(positions) / len(points))
        rows = [
            self._distances(self._close, points - feet.points, feet.normals, self._closely * share)
        ]
        points = points[: self._all.shape[0]]
        feet = Surface(points, self._triangles).feet(self._samples)
        found = _rows(feet.corners, feet.shares, len(points)) @ self._all
        share = np.sqrt(len(positions) / max(len(self._samples), 1))
        way = feet.points - self._samples
        rows.append(
            self._distances(found, way, feet.normals, CONFIG.cover * share, CONFIG.far * self.unit)
        )
        for which, line in self._lines:
            points = which @ positions
            way = points - line.nearest(points)
            rows.append(self._distances(which, way, way, CONFIG.line))
        gap = np.einsum("nd,nd->n", self._sides @ positions, self._across)
        lack = np.maximum(self._gap - gap, 0.0) * (CONFIG.thin / self.unit)
        rate = np.where(lack > 0, -CONFIG.thin / self.unit, 0.0)[:, None]
        return [*rows, (lack, _directed(self._sides, rate * self._across))]

    def _distances(
        self,
        rows: sparse.csr_array,
        way: FloatArray,
        normals: FloatArray,
        weight: FloatArray | float,
        far: float = np.inf,
    ) -> _Rows:
        """Return lengths of ways, and more of those that are far, and how they change."""
        length = np.linalg.norm(way, axis=1)
        weight = weight / self.unit
        # Where a point is on the surface, it leaves it along the normal.
        direction = np.where(length[:, None] > _TOUCHING * self.unit, unit(way), normals)
        rate = weight * (1.0 + 2.0 * length / far)
        return weight * (length + length**2 / far), _directed(rows, rate[:, None] * direction)


def _links(half: Halfedges, passed: BoolArray) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return sums of turns over two portals in a row, and how quantities count together.

    The latter has the weights of products of turns, then of squares, then of rooms.
    """
    count = int(np.count_nonzero(passed))
    number = np.cumsum(passed) - 1
    # Strands are walked both ways, which the factor √½ makes up for in squares.
    sums, turns = [], 0.0
    for length, weight in CONFIG.turns:
        portals, left = walks(half, passed, length)
        sums.append(_rows(number[portals], left, count))
        turns = turns + 0.5 * weight**2 * (sums[-1].T @ sums[-1])
    portals, left = walks(half, passed, 2)
    change = _rows(number[portals], np.broadcast_to([1.0, -1.0], left.shape), count)
    one = sparse.eye_array(count, format="csr")
    rooms = 0.5 * CONFIG.along**2 * (change.T @ change) + CONFIG.even**2 * one
    together = sparse.block_diag([turns, CONFIG.square**2 * one, rooms])
    return sums[0], sparse.csr_array(together)


def _rows(columns: IntArray, values: FloatArray, width: int) -> sparse.csr_array:
    """Return a sparse map whose rows hold values at columns, (N, K) each."""
    count, size = columns.shape
    starts = np.arange(0, count * size + 1, size) if size else np.zeros(count + 1, dtype=np.int64)
    return sparse.csr_array((np.ravel(values), columns.reshape(-1), starts), shape=(count, width))


def _directed(rows: sparse.csr_array, directions: FloatArray) -> sparse.csr_array:
    """Return how scalar products of points with directions vary with x, y and z of vertices."""
    row = np.repeat(np.arange(len(directions)), np.diff(rows.indptr))
    columns = rows.indices[:, None] + rows.shape[1] * np.arange(3)
    values = rows.data[:, None] * directions[row]
    return sparse.csr_array(
        (values.reshape(-1), columns.reshape(-1), 3 * rows.indptr),
        shape=(rows.shape[0], 3 * rows.shape[1]),
    )


def _stacked(rows: list[_Rows]) -> _Rows:
    """Return all quantities, one below the other."""
    return (
        np.concatenate([values for values, _ in rows]),
        sparse.vstack([slopes for _, slopes in rows], format="csr"),
    )
