"""Plan a ring around an opening: a band that lies on the ends of threads, in pieces that lap.

Fasteners of the crossings beside the rim go through it. The band is part of a cone, which unrolls
without stretching: its holes lie where the crossings' feet on that cone come to lie.
"""

import math
from collections.abc import Sequence

import numpy as np

from fabweave.core.arc_path import Path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, frozen_value
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.leave_out import Opening
from fabweave.piece.brief import Brief
from fabweave.piece.joint.fastening import beside_edges
from fabweave.piece.joint.holes import HoleRule
from fabweave.piece.stock_fit import alone_on_sheet
from fabweave.ribbon.lay import WovenObject

#: Fasteners can pull a band so far onto the strands, millimetres; a maker's estimate.
MOST_OFF_MM = 3.0
#: A band whose meridian is steeper than this has no use as a rim, degrees from level.
_STEEPEST_DEG = 75.0
#: No arc of an outline sweeps more.
_ARC_RAD = math.pi / 2.0
#: Fewer fasteners do not hold a ring.
_LEAST_HOLES = 4
#: A ring is not cut into more pieces to make them fit on a sheet.
_MOST_PIECES = 12
#: Vertices of a rim are on its circle to this, but for those that are told to be off it.
_ON_RIM_MM = 1e-3
#: Arcs of rings are nested as chords that are off by this at most, millimetres.
FLAT_MM = 0.01


@frozen_value
class RingPiece:
    """One piece of a ring, flat, in its own coordinates: the apex of the cone is their origin.

    Parameters
    ----------
    id : str
        Such as ``R1``.
    path : Path
        What is cut: arcs around the apex, and two straight ends.
    crossings : (H,) int array
        Whose fasteners go through its holes, in order; the first and the last are shared with the
        pieces before and after.
    holes : (H, 3) float array
        x, y and diameter.
    label : (4,) float array
        Where its id stands, covered by the piece before: x, y, the angle in degrees, the height.
    """

    id: str
    path: Path
    crossings: IntArray
    holes: FloatArray
    label: FloatArray

    @property
    def net_area_mm2(self) -> float:
        """Its area without holes."""
        return self.path.area - float(np.sum(math.pi * (self.holes[:, 2] / 2.0) ** 2))


@frozen_value
class RimRing:
    """A ring around an opening.

    Parameters
    ----------
    side : str
        ``top`` or ``bottom``.
    pieces : tuple of RingPiece
        In order around the opening, counter-clockwise as seen from above.
    opening_mm : float
        The diameter that it leaves open.
    width_mm : float
        Of the band.
    slope_deg : float
        Of the band, down from the opening; 0 is flat.
    off_mm : float
        How far a crossing is from where the band passes, at most.
    thickness_mm : float
        Of its material.
    """

    side: str
    pieces: tuple[RingPiece, ...]
    opening_mm: float
    width_mm: float
    slope_deg: float
    off_mm: float
    thickness_mm: float

    @property
    def crossings(self) -> IntArray:
        """The crossings whose fasteners hold it, those of laps twice."""
        return np.concatenate([piece.crossings for piece in self.pieces])


def plan_ring(
    side: str,
    crossings: IntArray,
    points: FloatArray,
    centre: tuple[float, float],
    diameter_mm: float,
    *,
    count: int,
    first: int,
    hole_mm: FloatArray,
    edge_mm: float,
    thickness_mm: float,
    clearance_mm: float = 0.0,
    prefix: str = "R",
) -> RimRing:
    """Plan a ring through the fasteners of some crossings.

    The cone about the upright axis through the opening is the one nearest to the crossings, by
    least squares; the band lies above it.

    Parameters
    ----------
    side : str
        ``top`` or ``bottom``, which says what is above.
    crossings : (H,) int array
    points : (H, 3) float array
        Where they are.
    centre : (float, float)
        The middle of the opening in plan.
    diameter_mm : float
        Of the opening.
    count : int
        How many pieces, two at least.
    first : int
        The number of the first piece.
    hole_mm : (H,) float array
        Diameter of the hole at each.
    edge_mm : float
        The least distance of a hole to an edge.
    thickness_mm, clearance_mm : float
        Of the material, and the air between two strands: the band lies above both.
    prefix : str
        What its pieces are called before their numbers, from ``free_prefix``.

    Raises
    ------
    CannotMakeError
        If there are too few crossings, or no such band comes near all of them.

    Examples
    --------
    >>> angle = np.arange(8) * np.pi / 4
    >>> flat = np.column_stack((50 * np.cos(angle), 50 * np.sin(angle), np.zeros(8)))
    >>> ring = plan_ring("top", np.arange(8), flat, (0.0, 0.0), 80.0, count=2, first=1,
    ...     hole_mm=np.full(8, 2.0), edge_mm=4.0, thickness_mm=0.8)
    >>> [piece.crossings.tolist() for piece in ring.pieces], ring.opening_mm, ring.width_mm
    ([[5, 6, 7, 0, 1], [1, 2, 3, 4, 5]], 80.0, 14.0)
    """
    if len(crossings) < max(_LEAST_HOLES, count):
        raise CannotMakeError(
            f"a ring around the opening at the {side} would be held by {len(crossings)} fasteners "
            "only; a finer mesh has more crossings there, and --fastener a hole that has room"
        )
    offset = points[:, :2] - centre
    away, turn = np.hypot(*offset.T), np.arctan2(offset[:, 1], offset[:, 0])
    order = np.argsort(turn, kind="stable")
    away, turn, crossings = away[order], turn[order], crossings[order]
    hole_mm = hole_mm[order]
    slope, base = np.polyfit(away, points[order, 2], 1) if np.ptp(away) > 1e-6 else (0.0, 0.0)
    if np.ptp(away) <= 1e-6:
        base = float(points[:, 2].mean())
    stretch = math.hypot(1.0, slope)
    off = (points[order, 2] - base - slope * away) / stretch
    steep = math.degrees(math.atan(abs(slope)))
    if np.abs(off).max() > MOST_OFF_MM or steep > _STEEPEST_DEG:
        raise CannotMakeError(
            f"a ring around the opening at the {side} would be up to {np.abs(off).max():.1f} mm "
            f"off the strands, at {steep:.0f}° to the level; {MOST_OFF_MM:g} mm and "
            f"{_STEEPEST_DEG:g}° can be fastened: try another diameter, or a finer mesh"
        )
    # Upwards of a band at the bottom is down.
    above = 1.5 * thickness_mm + clearance_mm / 2.0
    lift = (-1.0 if side == "bottom" else 1.0) * above * -slope / stretch
    ways = (away + off * slope / stretch + lift) * stretch
    inner = (diameter_mm / 2.0 + lift) * stretch
    inner, outer = min(inner, float(ways.min()) - edge_mm), float(ways.max()) + edge_mm
    if inner <= 0.0:
        raise CannotMakeError(
            f"a ring around the opening at the {side} has no room for an opening; try a wider one"
        )
    angles = turn / stretch
    whole = 2.0 * math.pi / stretch
    cuts = _cuts(angles, whole, (edge_mm + hole_mm) / ways, count)
    if cuts is None:
        raise CannotMakeError(
            f"a ring around the opening at the {side} cannot be cut into {count} pieces: its holes "
            "are too near to one another for laps; a smaller --fastener or a coarser mesh helps"
        )
    pieces = []
    for number in range(count):
        at = np.arange(cuts[number], cuts[number + 1] + 1)
        here = at % len(crossings)
        pieces.append(
            _piece(
                f"{prefix}{first + number}",
                crossings[here],
                ways[here],
                angles[here] + whole * (at // len(crossings)),
                hole_mm[here],
                (inner, outer, edge_mm),
            )
        )
    return RimRing(
        side=side,
        pieces=tuple(pieces),
        opening_mm=round(2.0 * (inner / stretch - lift), 3),
        width_mm=round(outer - inner, 3),
        slope_deg=round(steep, 3),
        off_mm=round(float(np.abs(off).max()), 3),
        thickness_mm=thickness_mm,
    )


def beside_opening(woven: WovenObject, opening: Opening) -> BoolArray:
    """Return which crossings lie beside the rim of a round opening, (X,)."""
    halfedges, vertices = woven.halfedges, woven.mesh.vertices
    away = np.hypot(vertices[:, 0] - (opening.x_mm or 0.0), vertices[:, 1] - (opening.y_mm or 0.0))
    near = np.abs(away - (opening.diameter_mm or 0.0) / 2.0) <= opening.off_mm + _ON_RIM_MM
    rim = (halfedges.twin < 0) & near[halfedges.tail] & near[halfedges.tail[halfedges.next]]
    return beside_edges(woven.weave.threads, halfedges, rim)


def plan_rings(
    woven: WovenObject,
    brief: Brief,
    beside: Sequence[BoolArray],
    fastened: BoolArray,
    rules: Sequence[HoleRule],
    size_mm: FloatArray,
) -> tuple[RimRing, ...]:
    """Plan a ring for each opening, of as few pieces as fit on a sheet of the first material.

    Parameters
    ----------
    woven : WovenObject
    brief : Brief
    beside : sequence of (X,) bool arrays
        For each opening that is to have a ring, which crossings are beside it.
    fastened : (X,) bool array
    rules : sequence of HoleRule
    size_mm : (X,) float array
        Diameters of holes.
    """
    rings: list[RimRing] = []
    # Around the widest hole there is the most room to keep.
    edge_mm = rules[0].edge_mm if rules else 0.0
    thickness = brief.supplies.materials[0].thickness_mm
    for opening, crossings in zip(woven.source.rims, beside, strict=True):
        held = np.flatnonzero(crossings & fastened)
        first = 1 + sum(len(ring.pieces) for ring in rings)
        for count in range(2, _MOST_PIECES + 1):
            ring = plan_ring(
                opening.side,
                held,
                woven.ribbons.centre[held],
                (opening.x_mm or 0.0, opening.y_mm or 0.0),
                opening.diameter_mm or 0.0,
                count=count,
                first=first,
                hole_mm=size_mm[held],
                edge_mm=edge_mm,
                thickness_mm=thickness,
                clearance_mm=brief.ribbons.clearance_mm,
                prefix=free_prefix("R", woven.labels),
            )
            if count == _MOST_PIECES or _fits(ring, brief):
                break
        rings.append(ring)
    return tuple(rings)


def _fits(ring: RimRing, brief: Brief) -> bool:
    """Return whether each piece of a ring fits on a sheet of the first material, alone."""
    outlines = [piece.path.flattened(FLAT_MM) for piece in ring.pieces]
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


def _cuts(angles: FloatArray, whole: float, room: FloatArray, count: int) -> IntArray | None:
    """Return at which holes a ring is cut, and the first once more after the last; None if nowhere.

    They are spread as evenly as may be, where no other hole is so near that a lap would reach it.
    """
    gap = np.diff(angles, append=angles[0] + whole)
    free = np.flatnonzero(np.minimum(gap, np.roll(gap, 1)) >= room)
    if len(free) < count:
        return None
    chosen = free[np.rint(np.arange(count) * len(free) / count).astype(np.int64)]
    return np.append(chosen, chosen[0] + len(angles))


def _piece(
    name: str,
    crossings: IntArray,
    ways: FloatArray,
    angles: FloatArray,
    hole_mm: FloatArray,
    sizes: tuple[float, float, float],
) -> RingPiece:
    """Return a piece of the band from its first hole to its last, and an edge beyond either."""
    inner, outer, edge_mm = sizes
    # Laid so that its middle is at a right angle: then its length lies along x.
    angles = angles - (angles[0] + angles[-1]) / 2.0 + math.pi / 2.0
    begin = float(angles[0]) - math.asin(edge_mm / float(ways[0]))
    end = float(angles[-1]) + math.asin(edge_mm / float(ways[-1]))
    steps = math.ceil((end - begin) / _ARC_RAD)
    turns = np.linspace(begin, end, steps + 1)
    arc = np.column_stack((np.cos(turns), np.sin(turns)))
    bulge = math.tan((end - begin) / steps / 4.0)
    points = np.concatenate((outer * arc, inner * arc[::-1]))
    bulges = np.array([*[bulge] * steps, 0.0, *[-bulge] * steps, 0.0])
    holes = np.column_stack((ways * np.cos(angles), ways * np.sin(angles), hole_mm))
    # In the middle between the hole and the farther border.
    first, sense = float(ways[0]), 1.0 if outer - ways[0] >= ways[0] - inner else -1.0
    radius = float(hole_mm[0]) / 2.0
    free = (outer - first if sense > 0 else first - inner) - radius
    middle = first + sense * (radius + free / 2.0)
    place = middle * np.array([math.cos(angles[0]), math.sin(angles[0])])
    reading = math.degrees(float(angles[0])) - 90.0
    height = min(2.5, 0.6 * free)
    return RingPiece(
        id=name,
        path=Path(points, bulges),
        crossings=crossings,
        holes=holes,
        label=np.array([*place, reading, height]),
    )
