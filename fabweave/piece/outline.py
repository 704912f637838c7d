"""Turn unfolded strips into the outlines of pieces, in each piece's own frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from fabweave.core.arc_path import Path, straight_path
from fabweave.core.arrays import BoolArray, FloatArray, IntArray, flags, offsets_of
from fabweave.piece.development import Strips

#: A vertex where a polygon turns by more than this is a corner: it stays.
CORNER_DEG = 12.0
#: No arc sweeps more than this.
_MOST_SWEEP_DEG = 160.0
#: To a machine, a longer radius is not an arc.
_MOST_RADIUS_MM = 10_000.0
#: Spans of more sides than these are tried in ever longer steps.
_EVERY_SPAN, _GROWTH = 24, 1.15
#: A vertex at which so many spans one after another could not begin begins none that is longer.
_PATIENCE = 3
#: What coordinates and bulges lose by rounding in files.
_ROUNDING_MM = 2e-4


class _Chains(NamedTuple):
    """Polygons one after another, each from a corner around and back to it.

    ``end`` is, for each point, where the corner-free run in which it lies ends.
    """

    points: FloatArray
    end: IntArray
    offsets: IntArray


class _Arcs(NamedTuple):
    """Sides and arcs from one point of a chain to another, with how far they are off."""

    start: IntArray
    end: IntArray
    half: FloatArray
    off: FloatArray


def fit_paths(rings: Sequence[FloatArray], tolerance_mm: float) -> list[Path]:
    """Fit each of many closed polygons by a path of few sides and arcs.

    Parameters
    ----------
    rings : sequence of (K, 2) float arrays
        Closed polygons, first point not repeated, no two points together.
    tolerance_mm : float
        No point of a path is farther from its polygon, and no point of a polygon from its path.

    Returns
    -------
    list of Path
        Their points are vertices of the polygons, all corners of more than 12 degrees among them;
        arcs sweep at most 160 degrees, and no radius is over 10 m. Of all such paths (of spans
        over 24 vertices, not all are tried) these have the fewest sides, and of those the least
        sum of squared deviations.

    Examples
    --------
    >>> turn = np.deg2rad(np.arange(0.0, 360.0, 3.0))
    >>> circle = 10.0 * np.stack((np.cos(turn), np.sin(turn)), axis=1)
    >>> (path,) = fit_paths([circle], 0.01)
    >>> len(path.points), round(path.length / 20.0, 3)
    (3, 3.141)
    """
    if not rings:
        return []
    chains = _chains(rings)
    arcs = _fitting_arcs(chains, tolerance_mm - _ROUNDING_MM)
    taken = _fewest(chains, arcs)
    points = chains.points[arcs.start[taken]]
    bulges = np.tan(arcs.half[taken] / 2.0) + 0.0
    cuts = np.searchsorted(arcs.start[taken], chains.offsets[1:-1])
    return [
        Path(corners, bent)
        for corners, bent in zip(np.split(points, cuts), np.split(bulges, cuts), strict=True)
    ]


def _chains(rings: Sequence[FloatArray]) -> _Chains:
    """Open every ring at a corner, or at its first point."""
    counts = np.array([len(ring) for ring in rings])
    offsets = offsets_of(counts)
    points = np.concatenate(rings)
    ring = np.repeat(np.arange(len(rings)), counts)
    place = np.arange(len(points)) - offsets[ring]
    before, after = (offsets[ring] + (place + step) % counts[ring] for step in (-1, 1))
    (ax, ay), (bx, by) = (points - points[before]).T, (points[after] - points).T
    turn = np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
    corner = np.abs(turn) > np.deg2rad(CORNER_DEG)
    first = np.zeros(len(rings), dtype=np.int64)
    place_of = np.flatnonzero(corner)[::-1]
    first[ring[place_of]] = place[place_of]  # the lowest comes last
    corner[offsets[:-1] + first] = True

    longer = offsets_of(counts + 1)
    ring = np.repeat(np.arange(len(rings)), counts + 1)
    source = offsets[ring] + (first[ring] + np.arange(len(ring)) - longer[ring]) % counts[ring]
    ends = np.where(corner[source], np.arange(len(ring)), len(ring))
    # The next corner after each point; of a ring's last point, nothing comes of it.
    end = np.minimum.accumulate(ends[::-1])[::-1]
    end = np.append(end[1:], len(ring) - 1)
    end[longer[1:] - 1] = longer[1:] - 1
    return _Chains(points[source], end, longer)


def _fitting_arcs(chains: _Chains, tolerance: float) -> _Arcs:
    """Return every side, and every arc and longer straight side that fits."""
    n = len(chains.points)
    sides = np.flatnonzero(chains.end > np.arange(n))
    batches = [_Arcs(sides, sides + 1, np.zeros(len(sides)), np.zeros(len(sides)))]
    alive = sides[chains.end[sides] - sides >= 2]
    failures = np.zeros(n, dtype=np.int64)
    span = 2
    while len(alive):
        reach = np.minimum(alive + span, chains.end[alive])
        arcs = _fit(chains.points, alive, reach, tolerance)
        batches.append(arcs)
        failures[alive] += 1
        failures[arcs.start] = 0
        alive = alive[(reach < chains.end[alive]) & (failures[alive] < _PATIENCE)]
        span = span + 1 if span < _EVERY_SPAN else int(span * _GROWTH)
    return _Arcs(*(np.concatenate(column) for column in zip(*batches, strict=True)))


def _fit(points: FloatArray, start: IntArray, end: IntArray, tolerance: float) -> _Arcs:
    """Return the arcs that fit between pairs of points."""
    chord = points[end] - points[start]
    length = np.hypot(*chord.T)
    good = length > 10.0 * tolerance
    start, end, chord, length = start[good], end[good], chord[good], length[good]
    counts = end - start
    # The points between, and before each the middle of the side that leads to it.
    at, owner = _between(start, counts)
    u, v = _local(points, at, owner, start, chord, length)
    first = offsets_of(counts)[:-1]
    last_u, last_v = np.roll(u, 1), np.roll(v, 1)
    last_u[first] = last_v[first] = 0.0
    low, high = _admitted(u, v, length[owner], tolerance)
    # The end of the chord admits everything.
    ends = first + counts - 1
    low[ends], high[ends] = -np.inf, np.inf
    less, more = _admitted((u + last_u) / 2, (v + last_v) / 2, length[owner], tolerance)
    lowest = np.maximum.reduceat(np.maximum(low, less), first)
    highest = np.minimum.reduceat(np.minimum(high, more), first)
    half = (lowest + highest) / 2.0
    most = np.deg2rad(_MOST_SWEEP_DEG) / 2.0
    half = np.where(np.isfinite(half), half, np.inf)
    # An arc that leaves its chord by less than half the tolerance is straight, if that fits.
    faint = (lowest <= 0.0) & (highest >= 0.0) & (np.abs(half) * length < 2.0 * tolerance)
    half = np.where(faint, 0.0, half)
    long = length / 2.0 > _MOST_RADIUS_MM * np.sin(np.minimum(np.abs(half), most))
    kept = (lowest <= highest) & (np.abs(half) <= most) & ((half == 0.0) | ~long)
    inside = kept[owner]
    renumbered = np.cumsum(kept) - 1
    off = _deviation(
        np.stack((last_u, last_v, u, v))[:, inside],
        renumbered[owner[inside]],
        half[kept],
        length[kept],
    )
    fits = off <= tolerance
    kept[kept] = fits
    return _Arcs(start[kept], end[kept], half[kept], off[fits])


def _between(start: IntArray, counts: IntArray) -> tuple[IntArray, IntArray]:
    """Return the points after each start up to each end, and whose they are."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return start[owner] + 1 + np.arange(len(owner)) - offsets_of(counts)[owner], owner


def _local(
    points: FloatArray,
    at: IntArray,
    owner: IntArray,
    start: IntArray,
    chord: FloatArray,
    length: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return points along their chord and to its left."""
    ex, ey = (chord / length[:, None]).T
    dx = points[at, 0] - points[start, 0][owner]
    dy = points[at, 1] - points[start, 1][owner]
    return dx * ex[owner] + dy * ey[owner], dy * ex[owner] - dx * ey[owner]


def _admitted(
    u: FloatArray, v: FloatArray, c: FloatArray, tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """Return between which half sweeps an arc is nowhere farther than the tolerance from points."""
    across, along = c * v, tolerance**2 - u * (u - c) - v * v
    rho = np.hypot(along, across)
    middle = -np.arctan2(across, along)
    reach = tolerance * c / np.maximum(rho, 1e-300)
    spread = np.where(reach < 1.0, np.arcsin(np.minimum(reach, 1.0)), np.inf)
    return middle - spread, middle + spread


def _deviation(sides: FloatArray, owner: IntArray, half: FloatArray, c: FloatArray) -> FloatArray:
    """Return how far each arc is from the sides it replaces; infinite where it does not follow.

    ``sides`` are the rows u, v of their beginnings and u, v of their ends, in the frames of the
    chords; those of one arc are neighbours.
    """
    if not len(half):
        return np.zeros(0)
    sine, cosine, length = np.sin(half)[owner], np.cos(half)[owner], c[owner]
    last_u, last_v, u, v = sides
    du, dv = u - last_u, v - last_v
    bend = 2.0 * sine / length  # signed curvature

    def height(u: FloatArray, v: FloatArray) -> FloatArray:
        """Return how far points are outside the circle; on the right, where it is a line."""
        g = bend * (u * (u - length) + v * v) - 2.0 * cosine * v
        return np.asarray(g / (1.0 + np.sqrt(np.maximum(1.0 + bend * g, 0.0))))

    # The foot of the perpendicular from the centre, as a share of the side: it minimises
    # bend (u² - c u + v²) - 2 cos v, whose derivative along the side is linear.
    slope = bend * ((2.0 * last_u - length) * du + 2.0 * last_v * dv) - 2.0 * cosine * dv
    curve = 2.0 * bend * (du * du + dv * dv)
    share = np.divide(-slope, curve, out=np.zeros_like(slope), where=curve != 0.0)
    share = np.clip(share, 0.0, 1.0)
    off = np.maximum(np.abs(height(u, v)), np.abs(height(last_u + share * du, last_v + share * dv)))
    # As seen from the centre, the side leads onwards.
    onwards = bend * ((last_u - length / 2.0) * dv - last_v * du) + cosine * du
    off[~(onwards > 0.0)] = np.inf
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return np.maximum.reduceat(off, first)


def _fewest(chains: _Chains, arcs: _Arcs) -> IntArray:
    """Return the arcs of the paths with the fewest arcs, in order."""
    n = len(chains.points)
    begins = flags(n, chains.offsets[:-1])
    inner = chains.end[:-1]
    begins[inner[inner > np.arange(n - 1)]] = True
    begin = np.maximum.accumulate(np.where(begins, np.arange(n), 0))
    # All runs at once: first all arcs that end one point after their run's beginning, and so on.
    depth = arcs.end - begin[arcs.end - 1]
    order = np.lexsort((arcs.start, arcs.end, depth))
    worst = max(float(arcs.off.max(initial=0.0)), 1e-12)
    # Sums of squares stay below one: one arc less counts more than any deviation.
    price = 1.0 + np.round((arcs.off / worst) ** 2, 9) * 1e-6
    cost = np.full(n, np.inf)
    cost[begins] = 0.0
    came = np.full(n, -1)
    bounds = np.searchsorted(depth[order], np.arange(1, depth.max(initial=0) + 2))
    for begin_at, end_at in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        level = order[begin_at:end_at]
        total = cost[arcs.start[level]] + price[level]
        first = np.flatnonzero(np.diff(arcs.end[level], prepend=-1))
        least = np.minimum.reduceat(total, first)
        goal = arcs.end[level[first]]
        groups = np.repeat(np.arange(len(first)), np.diff(np.append(first, len(level))))
        hits = np.flatnonzero(total <= least[groups])
        came[goal[groups[hits[::-1]]]] = level[hits[::-1]]
        inside = ~begins[goal]
        cost[goal[inside]] = least[inside]
    taken = np.zeros(len(arcs.start), dtype=bool)
    here = np.flatnonzero(begins & (came >= 0))
    lasts = chains.offsets[1:] - 1
    here = np.unique(np.concatenate([here, lasts]))
    while len(here):
        taken[came[here]] = True
        here = arcs.start[came[here]]
        here = here[~begins[here]]
    chosen = np.flatnonzero(taken)
    return chosen[np.argsort(arcs.start[chosen])]


#: Outlines have no side shorter than this: cutters and their software stumble over shorter ones.
SHORTEST_SIDE_MM = 0.1

#: Vertices that stand off their neighbours' line by less than this are dropped.
STRAIGHT_MM = 0.02

#: What is cut stays this near to the exact development, wherever it is.
FIT_MM = 0.02

#: Polygons inscribed in what is cut stay this near to it.
INSCRIBED_MM = 0.01


@dataclass(frozen=True)
class RigidMotion:
    """The rigid motion from a strip's frame to its piece's frame: p -> R(angle) p + shift."""

    angle: float
    shift: FloatArray

    def apply(self, points: FloatArray) -> FloatArray:
        """Return points in the piece's frame."""
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        return points @ np.array([[cosine, sine], [-sine, cosine]]) + self.shift


def strip_outline(right: FloatArray, left: FloatArray) -> FloatArray:
    """Return the outline of a strip: along its right rail and back along its left one.

    Sides shorter than 0.1 mm and vertices on a straight line are left out; the four end corners
    stay.

    Returns
    -------
    (K, 2) float array
        Counter-clockwise, first point not repeated; fewer than four points if the strip is
        narrower than the shortest side.
    """
    rails = np.concatenate((_thin(right), _thin(left)[::-1]))
    if np.hypot(*(right[0] - left[0])) < SHORTEST_SIDE_MM:
        rails = rails[:-1]
    if np.hypot(*(right[-1] - left[-1])) < SHORTEST_SIDE_MM:
        rails = np.delete(rails, len(_thin(right)), axis=0)
    return rails


def _thin(rail: FloatArray) -> FloatArray:
    """Drop points nearer than the shortest side to the last kept one; keep both ends."""
    steps = np.hypot(*np.diff(rail, axis=0).T)
    if np.all(steps >= SHORTEST_SIDE_MM):
        return rail
    kept = [0]
    for index in range(1, len(rail) - 1):
        if np.hypot(*(rail[index] - rail[kept[-1]])) >= SHORTEST_SIDE_MM:
            kept.append(index)
    while len(kept) > 1 and np.hypot(*(rail[-1] - rail[kept[-1]])) < SHORTEST_SIDE_MM:
        kept.pop()
    kept.append(len(rail) - 1)
    return rail[kept]


def strip_outlines(strips: Strips) -> list[FloatArray]:
    """Return the outline of every strip in its own frame, in order."""
    raw = raw_outlines(strips)
    polygons = shapely.polygons([shapely.LinearRing(p) if len(p) >= 3 else None for p in raw])
    simple = shapely.is_valid(polygons)
    thinner = shapely.simplify(polygons, STRAIGHT_MM, preserve_topology=True)
    return [
        shapely.get_coordinates(new)[:-1] if ok else points
        for new, ok, points in zip(thinner, simple, raw, strict=True)
    ]


def ring_paths(raw: Sequence[FloatArray]) -> list[Path]:
    """Return each of some closed polygons as a path of few sides and arcs.

    No point of a path is more than 0.02 mm from its polygon, and no point of the polygon from
    the path; turns of more than 12 degrees stay as they are.
    """
    paths = fit_paths(raw, FIT_MM)
    polygons = shapely.polygons([shapely.LinearRing(path.flattened(FIT_MM / 10)) for path in paths])
    # A strip narrower than the tolerance might cross itself.
    return [
        path if ok else straight_path(points)
        for path, ok, points in zip(paths, shapely.is_valid(polygons), raw, strict=True)
    ]


def inscribed_polygon(path: Path) -> FloatArray:
    """Return the polygon for nesting and marks: its corners are on the path, 0.01 mm near."""
    return path.flattened(INSCRIBED_MM, least_mm=SHORTEST_SIDE_MM)


def raw_outlines(strips: Strips) -> list[FloatArray]:
    """Return the outlines with all vertices."""
    bounds = strips.offsets.tolist()
    return [strip_outline(strips.right[a:b], strips.left[a:b]) for a, b in pairwise(bounds)]


def simple(outlines: Sequence[FloatArray]) -> BoolArray:
    """Say which outlines are simple polygons.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> simple([square, square[[0, 2, 1, 3]], square[:2]]).tolist()
    [True, False, False]
    """
    polygons = [
        shapely.Polygon(outline) if len(outline) >= 3 else shapely.Polygon() for outline in outlines
    ]
    return np.asarray(shapely.is_valid(polygons) & ~shapely.is_empty(polygons))


def resting_frame(outline: FloatArray, start: FloatArray, end: FloatArray) -> RigidMotion:
    """Return the motion that lays an outline along +x in its smallest rectangle, corner at 0.

    Parameters
    ----------
    outline : (K, 2) float array
        A polygon.
    start, end : (2,) float arrays
        Two of its points; ``end`` comes to lie to the right of ``start``.
    """
    hull = shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(outline)))
    sides = np.diff(hull, axis=0)
    angles = -np.arctan2(sides[:, 1], sides[:, 0])
    cosine, sine = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x = cosine * hull[:, 0] - sine * hull[:, 1]
    y = sine * hull[:, 0] + cosine * hull[:, 1]
    wide, high = np.ptp(x, axis=1), np.ptp(y, axis=1)
    # Rounding makes ties fall the same way on every machine.
    best = int(np.argmin(np.round(wide * high, 6)))
    angle = float(angles[best])
    if high[best] > wide[best]:
        angle += np.pi / 2
    way = end - start
    if np.cos(angle) * way[0] - np.sin(angle) * way[1] < 0:
        angle += np.pi
    turned = RigidMotion(angle, np.zeros(2)).apply(outline)
    return RigidMotion(angle, -turned.min(axis=0))
