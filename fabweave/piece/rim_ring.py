"""Plan rings along the rims of an open object: bands over the ends of its strips, in flat pieces.

A band is a ribbon between the rim of the mesh and the crossings beside it, whose fasteners go
through it. Triangle by triangle it unfolds exactly: on a tube to a straight strip, on a cone to a
sector, on a disc to an annulus, and along a crooked edge to a crooked strip. It is as wide as the
farthest of these crossings needs.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
import shapely
from shapely import ops

from fabweave.core.arc_path import Path, flattened
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, frozen_value, unit
from fabweave.core.errors import CannotMakeError
from fabweave.core.messages import agree, few_of
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres, face_normals
from fabweave.piece.brief import Brief
from fabweave.piece.development import unfold_rails
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.outline import fit_paths
from fabweave.piece.stock_fit import alone_on_sheet
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import better_diagonals
from fabweave.weave.threads import Threads

#: Places with their normals, both (K, 3).
Lifted: TypeAlias = tuple[FloatArray, FloatArray]

#: A rim turns at a corner by more than this, degrees; else the border is an arc from vertex to
#: vertex. Eight vertices of a circle turn by 45.
_CORNER_DEG = 50.0
#: Fewer fasteners do not hold a ring.
_LEAST_HOLES = 4
#: A band is not cut into more pieces to make them fit on a sheet.
_MOST_PIECES = 24
#: Pieces go on beyond their last holes by steps of this, millimetres, up to so many times the
#: distance that holes keep from edges.
_STEP_MM, _FARTHEST = 0.25, 3.0
#: Outlines are arcs that are off the band by this at most, millimetres; and its own arcs are
#: measured as chords so close to them.
_FIT_MM, _CHORD_MM = 0.01, 0.002
#: Arcs of rings are nested as chords that are off by this at most, millimetres.
FLAT_MM = 0.01
#: Widths are whole hundredths of a millimetre, but for rounding of the lengths before.
_ROUNDING = 1e-6
#: What bends to a larger radius is as good as flat.
_FLATTEST_MM = 10_000.0
#: A rim in the uppermost or lowermost share of the object is at the top or the bottom.
_SIDE = 0.25


@frozen_value
class RingPiece:
    """One piece of a ring, flat, in its own coordinates; the rim is above its crossings.

    Parameters
    ----------
    id : str
        Such as ``R1``.
    inside : bool
        Whether it lies inside the object; it is drawn as seen from there.
    path : Path
        What is cut.
    crossings : (H,) int array
        Whose fasteners go through its holes, in order; the first and the last are shared with the
        pieces before and after.
    holes : (H, 3) float array
        x, y and diameter.
    outward : (H, 2) float array
        From each hole square to the border along the rim.
    label : (4,) float array
        Where its id stands, covered by the piece before: x, y, the angle in degrees, the height.
    vertices, feet : (K,) int arrays
        The vertices of the mesh and the crossings that its rungs lead from and to.
    rim, foot : (K, 2) float arrays
        Where these lie on it.
    """

    id: str
    inside: bool
    path: Path
    crossings: IntArray
    holes: FloatArray
    outward: FloatArray
    label: FloatArray
    vertices: IntArray
    feet: IntArray
    rim: FloatArray
    foot: FloatArray

    @property
    def net_area_mm2(self) -> float:
        """Its area without holes."""
        return self.path.area - float(np.sum(math.pi * (self.holes[:, 2] / 2.0) ** 2))


@frozen_value
class RimRing:
    """A ring along a rim.

    Parameters
    ----------
    side : str
        ``top``, ``bottom`` or ``side``, where the rim is.
    pieces : tuple of RingPiece
        In order along the rim, to the right as seen with the rim above; those that lie outside
        come first.
    width_mm, over_mm : float
        Of the band, and how much of it stands out over the rim, where holes are near that.
    thickness_mm : float
        Of its material.
    radius_mm : float or None
        To which it is bent along the rim, at the tightest; None where it stays flat.
    """

    side: str
    pieces: tuple[RingPiece, ...]
    width_mm: float
    over_mm: float
    thickness_mm: float
    radius_mm: float | None

    @property
    def crossings(self) -> IntArray:
        """The crossings whose fasteners hold it, those of laps twice."""
        return np.concatenate([piece.crossings for piece in self.pieces])

    @property
    def courses(self) -> tuple[tuple[RingPiece, ...], ...]:
        """Its pieces outside, and those inside if it is doubled; each course goes once around."""
        parts = [tuple(one for one in self.pieces if one.inside == it) for it in (False, True)]
        return tuple(part for part in parts if part)


@frozen_value
class Rungs:
    """The rungs of a band around a loop of the boundary, in the order of its half-edges.

    Parameters
    ----------
    vertices : (K,) int array
        Where each rung begins, on the rim. A vertex has a rung for each crossing beside it there:
        those of the first and the last edge that lead from it into the mesh.
    feet : (K,) int array
        The crossing where it ends. A vertex of one face alone shares that of the vertex before.
    """

    vertices: IntArray
    feet: IntArray

    @property
    def reversed(self) -> "Rungs":
        """The same rungs the other way."""
        return Rungs(self.vertices[::-1], self.feet[::-1])


def rim_rungs(halfedges: Halfedges, threads: Threads) -> list[Rungs]:
    """Return the rungs of each loop of the boundary, in the order of their first half-edges.

    Raises
    ------
    CannotMakeError
        If some crossing is beside two rims, or twice beside one: bands would lie on one another.
    """
    crossing = np.zeros(halfedges.n_edges, dtype=np.int64)
    crossing[halfedges.edge[threads.crossing_halfedge]] = np.arange(threads.n_crossings)
    seen, loops, visits = halfedges.twin >= 0, list[Rungs](), list[int]()
    seen = seen.copy()
    for start in np.flatnonzero(~seen).tolist():
        rows, at = list[tuple[int, int]](), start
        while not seen[at]:
            seen[at] = True
            at = int(halfedges.next[at])
            met = list[int]()
            while halfedges.twin[at] >= 0:
                met.append(int(crossing[halfedges.edge[at]]))
                at = int(halfedges.next[halfedges.twin[at]])
            outer = dict.fromkeys(met[:1] + met[-1:] if met else [-1])
            rows += [(int(halfedges.tail[at]), key) for key in outer]
        if not rows:
            continue
        vertices, feet = np.array(rows).T
        first = int(np.argmax(feet >= 0))
        vertices, feet = np.roll(vertices, -first), np.roll(feet, -first)
        feet = feet[np.maximum.accumulate(np.where(feet >= 0, np.arange(len(feet)), 0))]
        loops.append(Rungs(vertices, feet))
        visits += feet[feet != np.roll(feet, 1)].tolist() if feet[0] >= 0 else []
    names, times = np.unique(visits, return_counts=True)
    twice = names[times > 1].tolist()
    if twice:
        raise CannotMakeError(
            f"rim: {agree(len(twice), '{n} crossing[ lies|s lie]')} beside the rim twice "
            f"(crossings {few_of(twice)}), where only one row of faces parts a rim from another: "
            "rings there would lie on one another; a finer mesh helps, such as --refine "
            "catmull-clark:1, or leave out --rim"
        )
    return loops


def beside_rims(loops: Sequence[Rungs], count: int) -> BoolArray:
    """Return which of so many crossings are beside a rim, (X,)."""
    return flags(count, np.concatenate([np.zeros(0, dtype=np.int64), *(one.feet for one in loops)]))


@frozen_value
class _Flat:
    """A band unfolded four times around, as one strip, so that pieces can begin anywhere.

    Parameters
    ----------
    rungs : Rungs
        Once around, in the order of the strip.
    rim, foot : (4K, 2) float arrays
        Both ends of each rung.
    line : LineString
        The border along the rim, with arcs in place of chords where it bends gently.
    way, depth, outward : (3K,), (3K,) and (3K, 2) float arrays
        How far along the line each foot is, how far from it, and which way; not for the last lap.
    corners : (C,) float array
        How far along the line its corners are.
    """

    rungs: Rungs
    rim: FloatArray
    foot: FloatArray
    line: shapely.LineString
    way: FloatArray
    depth: FloatArray
    outward: FloatArray
    corners: FloatArray


def _unfolded(rungs: Rungs, rim: FloatArray, foot: FloatArray) -> _Flat:
    """Unfold a band, given its rungs in space: from left to right as seen with the rim above."""
    count = len(rim)
    left, right = np.tile(rim, (4, 1)), np.tile(foot, (4, 1))
    following = np.append(np.arange(1, 4 * count), -1)
    diagonal = better_diagonals(right, left, following)
    flat_foot, flat_rim = unfold_rails(right, left, diagonal, np.array([0, 4 * count]))
    vertices = np.tile(rungs.vertices, 4)
    new = np.append(True, vertices[1:] != vertices[:-1])
    number = np.cumsum(new) - 1
    points = flat_rim[new]
    turn = _turns(points)
    bulges = _bulges(turn)
    parts = [
        flattened(points[k : k + 2], bulges[k : k + 2], _CHORD_MM, closed=False)
        for k in range(len(points) - 1)
    ]
    lengths = [np.hypot(*np.diff(part, axis=0).T).sum() for part in parts]
    begins = np.append(0.0, np.cumsum(lengths))
    way, depth, outward = np.zeros(3 * count), np.zeros(3 * count), np.zeros((3 * count, 2))
    for at in range(3 * count):
        # A foot is nearest to a side beside its own vertex, not to one on which the rim comes back.
        low, high = max(int(number[at]) - 2, 0), int(number[at]) + 2
        near = shapely.LineString(np.concatenate(parts[low:high]))
        along = near.project(shapely.Point(flat_foot[at]))
        back = np.array(near.interpolate(along).coords[0]) - flat_foot[at]
        way[at], depth[at], outward[at] = begins[low] + along, np.hypot(*back), unit(back)
    line = shapely.LineString(np.concatenate([points[:1], *(part[1:] for part in parts)]))
    corners = begins[1:-1][np.abs(turn) > math.radians(_CORNER_DEG)]
    return _Flat(rungs, flat_rim, flat_foot, line, way, depth, outward, corners)


def _turns(points: FloatArray) -> FloatArray:
    """Return by how much a line turns at each of its points but its ends, (N - 2,)."""
    ways = np.diff(points, axis=0) @ np.array([1.0, 1.0j])
    return np.asarray(np.angle(ways[1:] / ways[:-1]))


def _bulges(turn: FloatArray) -> FloatArray:
    """Return how the sides of a line bulge that are arcs where it bends gently, (N,).

    On a circle each arc is of that circle; elsewhere it sweeps as little as the line turns at
    either end, and nothing where that is to both sides.
    """
    turn = np.where(np.abs(turn) > math.radians(_CORNER_DEG), 0.0, turn)
    one, two = np.append(turn[:1], turn), np.append(turn, turn[-1:])
    sweep = np.where(one * two > 0.0, np.sign(one) * np.minimum(np.abs(one), np.abs(two)), 0.0)
    return np.append(np.tan(sweep / 4.0), 0.0)


def plan_ring(
    side: str,
    rungs: Rungs,
    rim: Lifted,
    foot: Lifted,
    hole_mm: FloatArray,
    *,
    edge_mm: float,
    thickness_mm: float,
    clearance_mm: float = 0.0,
    double: bool = False,
    fits: Callable[[Sequence[RingPiece]], bool] = lambda _: True,
    first: int = 1,
    prefix: str = "R",
) -> RimRing:
    """Plan a ring along a rim, of as few pieces as fit, two at least.

    Parameters
    ----------
    side : str
        ``top``, ``bottom`` or ``side``.
    rungs : Rungs
    rim, foot : pairs of (K, 3) float arrays
        Both ends of each rung on the surface, each with its normals.
    hole_mm : (X,) float array
        Diameter of the hole at each crossing, NaN where no fastener goes through it.
    edge_mm : float
        The least distance of a hole to an edge.
    thickness_mm, clearance_mm : float
        Of the material, and the air between two strands: the band lies above both.
    double : bool
        Whether there is a second band inside.
    fits : callable, optional
        Tells whether all pieces fit on a sheet.
    first : int
        The number of the first piece.
    prefix : str
        What its pieces are called before their numbers, from ``free_prefix``.

    Raises
    ------
    CannotMakeError
        If there are too few crossings, or the band cannot be cut.

    Examples
    --------
    >>> turn = -np.arange(8) * np.pi / 4
    >>> way = np.column_stack((np.cos(turn), np.sin(turn), np.zeros(8)))
    >>> level = np.tile([0.0, 0.0, 1.0], (8, 1))
    >>> ring = plan_ring("top", Rungs(np.arange(8), np.arange(8)), (50 * way, level),
    ...     (60 * way, level), np.full(8, 2.0), edge_mm=4.0, thickness_mm=0.8)
    >>> [piece.crossings.tolist() for piece in ring.pieces], ring.width_mm
    ([[7, 6, 5, 4, 3], [3, 2, 1, 0, 7]], 14.0)
    """
    # The band outside runs against the half-edges, the other with them: to the right either way.
    above = 1.5 * thickness_mm + clearance_mm / 2.0
    flats = [_unfolded(rungs.reversed, *(_raised(one, above)[::-1] for one in (rim, foot)))]
    if double:
        flats.append(_unfolded(rungs, *(_raised(one, -above) for one in (rim, foot))))
    told = f"a ring along the rim at the {side}"
    owns = [_held(flat, hole_mm) for flat in flats]
    if len(owns[0]) < _LEAST_HOLES:
        beside = len(set(rungs.feet.tolist()))
        helps = "a larger --size has room for more, and so has a smaller --fastener"
        if beside < _LEAST_HOLES:
            helps = "a finer mesh has more crossings there, such as --refine catmull-clark:1"
        raise CannotMakeError(
            f"{told} would be held by {agree(len(owns[0]), '{n} fastener[|s]')} only, at "
            f"{agree(beside, '{n} crossing[|s]')}; {helps}"
        )
    depths = np.concatenate([flat.depth[own] for flat, own in zip(flats, owns, strict=True)])
    width, over = (
        math.ceil(100.0 * room - _ROUNDING) / 100.0
        for room in (float(depths.max()) + edge_mm, max(edge_mm - float(depths.min()), 0.0))
    )
    pieces = list[RingPiece]()
    for number, (flat, own) in enumerate(zip(flats, owns, strict=True)):
        band = _Band(flat, own, hole_mm, edge_mm, width, over, number == 1)
        pieces += band.pieces(told, fits, prefix, first + len(pieces))
    radius = _tightest(*rim)
    return RimRing(side, tuple(pieces), round(width + over, 3), over, thickness_mm, radius)


def _tightest(rim: FloatArray, normal: FloatArray) -> float | None:
    """Return the least radius of a surface along a line on it; None if it bends nowhere.

    From vertex to vertex that is the length over the turn of the normal about the strip's width;
    what it turns about the line is twist.
    """
    way = np.roll(rim, -1, axis=0) - rim
    turn = np.abs(np.einsum("kd,kd->k", np.roll(normal, -1, axis=0) - normal, way))
    far = np.einsum("kd,kd->k", way, way)
    if np.all(turn * _FLATTEST_MM <= far):
        return None
    return round(float((far[turn > 0.0] / turn[turn > 0.0]).min()), 1)


def _raised(lifted: Lifted, by: float) -> FloatArray:
    """Return places that are raised along their normals."""
    place, normal = lifted
    return np.asarray(place + by * normal)


def _held(flat: _Flat, hole_mm: FloatArray) -> IntArray:
    """Return the rungs with which the crossings begin that have fasteners, once around."""
    feet = flat.rungs.feet
    return np.flatnonzero((feet != np.roll(feet, 1)) & ~np.isnan(hole_mm[feet]))


@dataclass(frozen=True)
class _Band:
    """A band that is to be cut into pieces."""

    flat: _Flat
    own: IntArray
    hole_mm: FloatArray
    edge_mm: float
    width: float
    over: float
    inside: bool

    def pieces(
        self, told: str, fits: Callable[[Sequence[RingPiece]], bool], prefix: str, first: int
    ) -> tuple[RingPiece, ...]:
        """Return as few pieces as fit; raise CannotMakeError where there are none."""
        narrow = (
            "a finer mesh makes it narrower, such as --remesh quads:N with more of them or "
            "--refine catmull-clark:1, and so does a smaller --fastener"
        )
        count = len(self.flat.rungs.feet)
        rungs = np.concatenate([count + self.own, 2 * count + self.own])
        way = self.flat.way[rungs]
        ends, clear = self._ends(rungs)
        n = len(self.own)
        free = np.flatnonzero(clear[np.append(n, np.arange(1, n))])
        reason = (
            f"{told} cannot be cut into pieces: its holes are too near to one another for laps; a "
            "smaller --fastener or a coarser mesh helps"
        )
        for pieces in range(2, min(_MOST_PIECES, len(free)) + 1):
            cuts = self._cuts(free, way[free], pieces)
            made = list[RingPiece]()
            for low, high in pairwise([*cuts.tolist(), int(cuts[0]) + n]):
                own, name = rungs[low : high + 1], f"{prefix}{first + len(made)}"
                piece = self._piece(name, own, ends[low, 0], ends[high, 1])
                if piece is None:
                    at = self._feet(own)
                    reason = (
                        f"{told} would be {self.width + self.over:.1f} mm wide, and as flat as it "
                        f"is cut it would lie on itself or lose a hole (near crossings {at}); "
                        f"{narrow}"
                    )
                    break
                made.append(piece)
            if len(made) == pieces:
                if fits(made):
                    return tuple(made)
                reason = (
                    f"{told} fits on no sheet, not even in {pieces} pieces; name a larger --sheet"
                )
        raise CannotMakeError(reason)

    def _cuts(self, free: IntArray, way: FloatArray, pieces: int) -> IntArray:
        """Return at which of some crossings the band is cut: far from corners, spread evenly.

        Laps inside lie between those outside.
        """
        shifts = np.arange(max(len(free) // pieces, 1))
        spread = np.arange(pieces) * len(free) // pieces
        chosen = (spread + shifts[:, None] + int(self.inside) * (len(shifts) // 2)) % len(free)
        corners = self.flat.corners
        if not len(corners):
            return np.sort(free[chosen[0]])
        away = np.abs(way[:, None] - corners).min(axis=1)
        return np.sort(free[chosen[np.argmax(away[chosen].min(axis=1))]])

    def _feet(self, rungs: IntArray) -> str:
        feet = self.flat.rungs.feet
        return few_of(list(dict.fromkeys(feet[rungs % len(feet)].tolist())))

    def _ends(self, rungs: IntArray) -> tuple[FloatArray, BoolArray]:
        """Return where pieces begin and end along the line that have their outer holes at rungs.

        An end is square to the rim, and keeps its distance from the hole. Beside it is whether
        no other hole is so near that a lap there would reach it.
        """
        line, ends = self.flat.line, np.zeros((len(rungs), 2))
        clear, feet = np.ones(len(rungs), dtype=np.bool_), self.flat.foot[rungs]
        hole = self.hole_mm[self.flat.rungs.feet[rungs % len(self.flat.rungs.feet)]]
        steps = np.arange(_STEP_MM, _FARTHEST * self.edge_mm + _STEP_MM, _STEP_MM)
        for row, at in enumerate(rungs.tolist()):
            for column, sense in enumerate((-1.0, 1.0)):
                places = self.flat.way[at] + sense * steps
                here, behind = (
                    shapely.get_coordinates(line.interpolate(places - sense * less))
                    for less in (0.0, _CHORD_MM)
                )
                square = unit(here - behind)
                away = np.einsum("nd,nd->n", here - feet[row], square)
                end = int(np.argmax(away >= self.edge_mm))
                ends[row, column] = places[end]
                other = row + (1 if sense > 0.0 else -1)
                if 0 <= other < len(rungs):
                    beyond = float((feet[other] - here[end]) @ square[end])
                    clear[row] &= beyond >= hole[other]
        return ends, clear

    def _piece(self, name: str, rungs: IntArray, begin: float, end: float) -> RingPiece | None:
        """Return the piece with holes at some rungs; None if it cannot be cut."""
        flat, count = self.flat, len(self.flat.rungs.feet)
        if end <= begin:
            return None
        part = ops.substring(flat.line, begin, end)
        upper = np.array(part.coords) if self.over == 0.0 else _beside(part, self.over)
        lower = _beside(part, -self.width)
        if upper is None or lower is None:
            return None
        outline = np.concatenate([lower, upper[::-1]])
        outline = outline[np.hypot(*(outline - np.roll(outline, 1, axis=0)).T) > 1e-6]
        polygon = shapely.Polygon(outline)
        holes = flat.foot[rungs]
        names = flat.rungs.feet[rungs % count]
        near = shapely.distance(shapely.points(holes), polygon.exterior)
        if not (
            polygon.is_valid
            and polygon.exterior.is_ccw
            and shapely.contains_xy(polygon, holes).all()
            and near.min() >= self.edge_mm - 2.0 * _FIT_MM
        ):
            return None
        # Its length lies along x, the rim above.
        ahead = (holes[-1] - holes[0]) @ np.array([1.0, 1.0j])
        spin = np.conj(ahead) / abs(ahead)
        turn = np.array([[spin.real, spin.imag], [-spin.imag, spin.real]])
        middle = (outline.min(axis=0) + outline.max(axis=0)) / 2.0
        (path,) = fit_paths([(outline - middle) @ turn], _FIT_MM)
        holes, outward = (holes - middle) @ turn, flat.outward[rungs] @ turn
        window = np.arange(rungs[0], rungs[-1] + 1)
        size = self.hole_mm[names]
        radius, depth = float(size[0]) / 2.0, float(flat.depth[rungs[0]])
        above, below = depth + self.over - radius, self.width - depth - radius
        free, sense = max((above, 1.0), (below, -1.0))
        return RingPiece(
            id=name,
            inside=self.inside,
            path=path,
            crossings=names,
            holes=np.column_stack((holes, size)),
            outward=outward,
            # In the middle between the hole and the farther border.
            label=np.array(
                [
                    *(holes[0] + sense * (radius + free / 2.0) * outward[0]),
                    math.degrees(math.atan2(outward[0, 1], outward[0, 0])) - 90.0,
                    min(2.5, 0.6 * free),
                ]
            ),
            vertices=flat.rungs.vertices[window % count],
            feet=flat.rungs.feet[window % count],
            rim=(flat.rim[window] - middle) @ turn,
            foot=(flat.foot[window] - middle) @ turn,
        )


def _beside(line: shapely.LineString, away: float) -> FloatArray | None:
    """Return a line beside another, to its left if that is positive; None if there is not one."""
    # Points that are on a line but for rounding would break it.
    line = line.simplify(_CHORD_MM / 10.0)
    beside = shapely.line_merge(
        shapely.offset_curve(line, away, join_style="mitre", mitre_limit=5.0)
    )
    if beside.is_empty or beside.geom_type != "LineString":
        return None
    points = np.array(beside.coords)
    start = np.array(line.coords[0])
    ends = np.hypot(*(points[[0, -1]] - start).T)
    return points if ends[0] <= ends[1] else points[::-1]


def plan_rings(
    woven: WovenObject,
    brief: Brief,
    loops: Sequence[Rungs],
    fastened: BoolArray,
    rules: Sequence[HoleRule],
    size_mm: FloatArray,
) -> tuple[RimRing, ...]:
    """Plan a ring along each rim, of as few pieces as fit on a sheet of the first material.

    Parameters
    ----------
    woven : WovenObject
    brief : Brief
    loops : sequence of Rungs
        One for each rim that is to have a ring.
    fastened : (X,) bool array
    rules : sequence of HoleRule
    size_mm : (X,) float array
        Diameters of holes.
    """
    rings: list[RimRing] = []
    mesh, centre = woven.mesh, woven.ribbons.centre
    out, level = _normals(mesh, woven.halfedges, woven.weave.threads)
    low, high = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    for rungs in loops:
        height = (mesh.vertices[rungs.vertices, 2].mean() - low) / max(high - low, FLAT_MM)
        rings.append(
            plan_ring(
                "bottom" if height < _SIDE else "top" if height > 1.0 - _SIDE else "side",
                rungs,
                (mesh.vertices[rungs.vertices], out[rungs.vertices]),
                (centre[rungs.feet], level[rungs.feet]),
                np.where(fastened, size_mm, np.nan),
                # Around the widest hole there is the most room to keep.
                edge_mm=rules[0].edge_mm if rules else 0.0,
                thickness_mm=brief.supplies.materials[0].thickness_mm,
                clearance_mm=brief.ribbons.clearance_mm,
                double=woven.source.rim == "double",
                fits=lambda pieces: _fits(pieces, brief),
                first=1 + sum(len(ring.pieces) for ring in rings),
                prefix=free_prefix("R", woven.labels),
            )
        )
    return tuple(rings)


def _normals(
    mesh: PolyMesh, halfedges: Halfedges, threads: Threads
) -> tuple[FloatArray, FloatArray]:
    """Return unit normals of the surface at vertices, (V, 3), and at crossings, (X, 3)."""
    faces, centres = face_normals(mesh), face_centres(mesh)
    at = np.zeros_like(mesh.vertices)
    np.add.at(at, halfedges.tail, faces[halfedges.face])
    one = threads.crossing_halfedge
    along = mesh.vertices[halfedges.head[one]] - mesh.vertices[halfedges.tail[one]]
    across = centres[halfedges.face[one]] - centres[halfedges.face[halfedges.twin[one]]]
    return unit(at), unit(np.cross(along, across))


def _fits(pieces: Sequence[RingPiece], brief: Brief) -> bool:
    """Return whether each piece of a ring fits on a sheet of the first material, alone."""
    outlines = [piece.path.flattened(FLAT_MM) for piece in pieces]
    return bool(
        alone_on_sheet(outlines, brief.supplies.each[0], brief.supplies, brief.effort).all()
    )


def free_prefix(letter: str, labels: Sequence[str]) -> str:
    """Return the letters before numbers of parts that are of no thread: one, or more of it.

    Parameters
    ----------
    letter : str
    labels : sequence of str
        Those of the threads, which pieces of theirs begin with.

    Examples
    --------
    >>> free_prefix("R", ["A", "B"]), free_prefix("R", ["A", "R"])
    ('R', 'RR')
    """
    prefix = letter
    while prefix in labels:
        prefix += letter
    return prefix
