"""Build a former: flat plates of a model's inside, slotted into one another, to lay strips on.

Slices stand across the model, side by side or around an axis, and spines hold them. Their edges
follow the inner side of the weave, and bear the name of each strip where it passes.

What a former is held to, here and in ``verify``, which allows a little more for rounding:

- A name stands on the edge of its plate, and from the middle line of its strip no farther than two
  layers and some millimetres.
- A way out is so wide that no rail of a strip in place, and no rim of the mesh, comes into the
  circle about its middle. It is as deep as it is straight on from there to the other side of the
  mesh, whose faces and openings are fans about the means of their corners.
- A plate comes out if it fits, or each part that it breaks into along its rows of slits, in a
  rectangle as broad as the way is wide, and as long as it is deep, or wide, if that is more. A row
  is nowhere solid for more than some millimetres.
"""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

import numpy as np
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from shapely.ops import substring

from fabweave.core.arrays import FloatArray, IntArray, frozen_value, unit
from fabweave.core.errors import CannotMakeError
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.triangulate import triangulate
from fabweave.piece.development import Runs
from fabweave.ribbon.lay import WovenObject
from fabweave.ribbon.project import Ribbons, following_rung
from fabweave.ribbon.stretches import facet_vertices, rung_ends
from fabweave.weave.threads import Threads

#: Between a plate and a strip, and between a plate and a slot, millimetres.
PLAY_MM, SLOT_PLAY_MM = 0.3, 0.1
#: A slice stands for every so many crossings along a thread; but no nearer than so many of its
#: thicknesses, and there are no more.
_CROSSINGS, _NEAREST_T, _MOST_SLICES = 2.0, 8.0, 32
#: A former has at most so many spines, chosen from so many places.
_MOST_SPINES, _PLACES = 4, 15
#: A plate is nowhere narrower, and two plates hold one another along no less, millimetres.
_NARROWEST_MM, _HOLD_MM = 6.0, 12.0
#: A slice that is higher is held by two spines, millimetres.
_TALL_MM = 100.0
#: A strip lies on an edge that is so near to it, millimetres beyond the layers' thickness.
_NEAR_MM = 6.0
#: A plane that meets a vertex is taken to pass beside it, millimetres.
_BESIDE_MM = 1e-7
#: What is to be taken out goes through nine tenths of the way; it breaks along slits of about this
#: length and width, with bridges between them and along edges, and is nowhere solid for more,
#: millimetres.
_OF_WAY, _SLIT_MM, _SLIT_WIDE_MM, _BRIDGE_MM, _SOLID_MM = 0.9, 8.0, 0.6, 1.5, 9.5
#: A strip that lies in a plane is named at such a share of a panel: not where another crosses it.
_BESIDE_CROSSING = 0.25
#: Slots begin so far outside their plates, millimetres.
_OUT_MM = 3.0
#: Plates of one plane are half their thickness apart, and so much.
_APART_MM = 0.2
#: Points and notches of plates are twice as wide, and slots are wider, millimetres.
_CUT_MM = 0.2
#: A former on which fewer of the pieces lie is none.
_LEAST_SHARE = 0.5
#: Sides of a quarter of a round corner.
_QUARTER = 3


@frozen_value
class Plane:
    """The plane of a plate: a point, and two unit vectors in it, which span its coordinates.

    Parameters
    ----------
    origin : (3,) float array
    axes : (2, 3) float array
    least : float
        The plate lies where the first coordinate is greater.
    """

    origin: FloatArray
    axes: FloatArray
    least: float = -np.inf

    @property
    def frame(self) -> FloatArray:
        """Both axes and the normal, (3, 3)."""
        return np.vstack((self.axes, np.cross(*self.axes)))

    def flat(self, points: FloatArray) -> FloatArray:
        """Return points in the plane's coordinates and their heights over it, (..., 3)."""
        return np.asarray((points - self.origin) @ self.frame.T)

    def raised(self, points: FloatArray) -> FloatArray:
        """Return points of the plane in space, (..., 3)."""
        return np.asarray(self.origin + points @ self.axes)


@frozen_value
class StripMark:
    """Where a strip passes the edge of a plate, in the plate's coordinates.

    Parameters
    ----------
    piece : int
    point, inward : (2,) float arrays
        On the edge, and the unit vector from there into the plate.
    """

    piece: int
    point: FloatArray
    inward: FloatArray


@frozen_value
class Join:
    """A slot: the number of the plate that goes into it, its inner end, and the unit way there."""

    plate: int
    point: FloatArray
    way: FloatArray


@frozen_value
class Plate:
    """A flat part of a former.

    Parameters
    ----------
    id : str
    spine : bool
        Whether it holds slices, or is one.
    plane : Plane
    outline : shapely.Polygon
        What is cut, slots included; holes may be in it.
    marks : tuple of StripMark
    joins : tuple of Join
    snaps : tuple of (2, 2) float arrays
        Lines along which it breaks, where it could not be taken out whole.
    """

    id: str
    spine: bool
    plane: Plane
    outline: shapely.Polygon
    marks: tuple[StripMark, ...]
    joins: tuple[Join, ...]
    snaps: tuple[FloatArray, ...] = ()


@frozen_value
class Former:
    """All plates of a former, slices first, and their thickness in millimetres."""

    plates: tuple[Plate, ...]
    thickness_mm: float


@frozen_value
class WayOut:
    """A straight way out of the object.

    Parameters
    ----------
    at, inward : (3,) float arrays
        Where it opens, and its direction from there.
    wide_mm, deep_mm : float
        The circle that it lets through, and how far it goes on inside.
    before : int or None
        The place in the order of the piece before which the former is taken out; None where an
        opening of the finished object lets it out.
    """

    at: FloatArray
    inward: FloatArray
    wide_mm: float
    deep_mm: float
    before: int | None

    @property
    def gap(self) -> str:
        """What it is called."""
        return "opening" if self.before is None else "gap"


@frozen_value
class Laid:
    """A former and its way out; None where it stays inside.

    ``unnamed`` are the ids of plates where a strip's name has no room, and of that piece.
    """

    former: Former
    way: WayOut | None
    unnamed: tuple[tuple[str, str], ...] = ()


class _Inside:
    """What bounds a former: the model, closed, and all strips, from which it keeps away."""

    def __init__(self, woven: WovenObject, layer_mm: float, thick: float) -> None:
        ribbons = woven.ribbons
        self.points, self.triangles = closed_triangles(woven.mesh, woven.halfedges)
        near = np.flatnonzero(following_rung(ribbons.offsets, ribbons.closed) >= 0)
        self.facets = rung_ends(ribbons)[facet_vertices(ribbons, near)]
        #: A lap is twice as thick: its faces are a layer away from the middle of both.
        self.away = layer_mm + PLAY_MM
        self.depth = 2.0 * layer_mm + PLAY_MM
        self.half = thick / 2.0

    def section(self, plane: Plane, *, closely: bool) -> list[shapely.Polygon]:
        """Return the polygons of a plane where a plate has room; ``closely`` minds every strip."""
        flat = plane.flat(self.points)
        flat[np.abs(flat[:, 2]) < _BESIDE_MM, 2] = _BESIDE_MM
        area = level_area(flat, self.triangles).buffer(-self.depth)
        if closely:
            area = area.difference(self._taken(plane))
        if np.isfinite(plane.least):
            low, high = flat[:, :2].min(axis=0), flat[:, :2].max(axis=0)
            area = area.intersection(shapely.box(plane.least, low[1], high[0], high[1]))
        # What is narrow breaks off, and holds nothing.
        area = area.buffer(-_NARROWEST_MM / 2.0).buffer(_NARROWEST_MM / 2.0 - 0.05)
        parts = [part.simplify(0.05) for part in shapely.get_parts(area).tolist()]
        return [part for part in parts if part.area > _HOLD_MM**2]

    def _taken(self, plane: Plane) -> shapely.Geometry:
        """Return what strips take of a plate's room: their shadows where they pass through it."""
        flat, reach = plane.flat(self.facets), self.half + self.away
        height = flat[:, :, 2]
        flat = flat[(height.min(axis=1) < reach) & (height.max(axis=1) > -reach)]
        corners = [flat]
        for level in (reach, -reach):
            for here, there in ((0, 1), (1, 2), (2, 0)):
                below, above = flat[:, here], flat[:, there]
                rise = above[:, 2] - below[:, 2]
                share = (level - below[:, 2]) / np.where(rise == 0.0, 1.0, rise)
                share = np.where((rise != 0.0) & (share > 0.0) & (share < 1.0), share, np.nan)
                corners.append((below + share[:, None] * (above - below))[:, None])
        points = np.concatenate(corners, axis=1)
        inside = np.abs(points[:, :, 2]) <= reach * (1.0 + 1e-9)
        shadows = [
            shapely.MultiPoint(some[kept, :2]).convex_hull
            for some, kept in zip(points, inside, strict=True)
            if kept.any()
        ]
        # Circles of few corners, around the true ones.
        away, few = self.away / np.cos(np.pi / (4 * _QUARTER)), _QUARTER
        return shapely.union_all(shapely.buffer(shadows, away, quad_segs=few))


def rim_loops(halfedges: Halfedges) -> list[list[int]]:
    """Return the vertices around each opening, in the order of the boundary's half-edges."""
    rim = np.flatnonzero(halfedges.twin < 0)
    after = dict(zip(halfedges.tail[rim].tolist(), halfedges.head[rim].tolist(), strict=True))
    loops = []
    while after:
        loop = [next(iter(after))]
        while (onward := after.pop(loop[-1])) != loop[0]:
            loop.append(onward)
        loops.append(loop)
    return loops


def closed_triangles(mesh: PolyMesh, halfedges: Halfedges) -> tuple[FloatArray, IntArray]:
    """Return a mesh as points and triangles, its openings closed by fans."""
    cut = triangulate(mesh)
    points, triangles = [cut.vertices], [cut.indices.reshape(-1, 3)]
    for count, loop in enumerate(rim_loops(halfedges), start=cut.n_vertices):
        points.append(mesh.vertices[loop].mean(axis=0, keepdims=True))
        triangles.append(
            np.column_stack((np.roll(loop, -1), loop, np.full(len(loop), count, dtype=np.int64)))
        )
    return np.concatenate(points), np.concatenate(triangles)


def level_area(flat: FloatArray, triangles: IntArray) -> shapely.Geometry:
    """Return what closed bodies of triangles enclose at height 0, where no vertex may be."""
    above = flat[triangles, 2] > 0.0
    triangles = triangles[above.any(axis=1) & ~above.all(axis=1)]
    sides = np.stack((triangles, np.roll(triangles, -1, axis=1)), axis=2).reshape(-1, 2)
    # From the same end for both triangles of a side, so that lines meet exactly.
    sides = np.sort(sides[np.prod(np.sign(flat[sides, 2]), axis=1) < 0.0], axis=1)
    below, rise = flat[sides[:, 0]], flat[sides[:, 1]] - flat[sides[:, 0]]
    points = below - rise * (below[:, 2] / rise[:, 2])[:, None]
    lines = shapely.multilinestrings(shapely.linestrings(points[:, :2].reshape(-1, 2, 2)))
    # Bodies may stand in one another: their outlines cross.
    return shapely.build_area(shapely.node(lines))


@frozen_value
class _Layout:
    """Where slices stand, and how a spine lies at a level over the first of its axes."""

    slices: tuple[Plane, ...]
    spine: Plane

    def spine_at(self, level: float) -> Plane:
        """Return the plane of a spine at a level."""
        frame = self.spine.frame
        return Plane(self.spine.origin + level * frame[2], self.spine.axes)


def _layouts(points: FloatArray, pitch: float, thick: float) -> list[_Layout]:
    """Return the ways in which slices may stand: across each axis, and around the upright one."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2.0, high - low
    axes, layouts = np.eye(3), []
    for across, along, up in itertools.permutations(range(3)):
        count = int(np.clip(size[across] // pitch, 2, _MOST_SLICES))
        places = (np.arange(count) + 0.5) / count * size[across] - size[across] / 2.0
        layouts.append(
            _Layout(
                tuple(Plane(middle + place * axes[across], axes[[along, up]]) for place in places),
                Plane(middle, axes[[across, along]]),
            )
        )
    away = np.hypot(*(points - middle)[:, :2].T)
    count = int(np.clip(2.0 * np.pi * away.mean() // pitch, 5, _MOST_SLICES))
    turns = 2.0 * np.pi * np.arange(count) / count
    # Around the axis slices leave room for one another.
    least = count * (thick + 2.0 * PLAY_MM) / (2.0 * np.pi) + thick
    slices = tuple(
        Plane(middle, np.array([[np.cos(turn), np.sin(turn), 0.0], axes[2]]), least)
        for turn in turns
    )
    return [*layouts, _Layout(slices, Plane(middle, axes[:2]))]


def build_former(
    woven: WovenObject,
    runs: Runs,
    *,
    layer_mm: float,
    thickness_mm: float,
    prefix: str = "F",
) -> Former:
    """Build the former on whose edges most strips lie.

    Plates keep half the thickness of a lap, and some play, from every strip. Slots go half-way,
    from the near side in slices and from the far side in spines, so that slices are pushed on.

    Parameters
    ----------
    woven : WovenObject
    runs : Runs
        What passes each piece carries.
    layer_mm, thickness_mm : float
        Of the thickest strip, and of the plates.
    prefix : str
        What plates are called before their numbers.

    Raises
    ------
    CannotMakeError
        If no plate has room.
    """
    inside = _Inside(woven, layer_mm, thickness_mm)
    strips = _MiddleLines(woven.ribbons, woven.weave.threads, runs)
    pitch = max(_CROSSINGS * strips.step_mm, _NEAREST_T * thickness_mm)
    best = max(
        _layouts(inside.points, pitch, thickness_mm),
        key=lambda layout: _worth(_joined(layout, inside, strips, thickness_mm, closely=False)),
    )
    plates = _joined(best, inside, strips, thickness_mm, closely=True)
    carried = len({mark.piece for plate in plates for mark in plate.marks})
    if carried < _LEAST_SHARE * len(runs.thread):
        raise CannotMakeError(
            f"a former of {thickness_mm:g} mm has too little room inside: {carried} of "
            f"{len(runs.thread)} pieces would lie on it"
        )
    named = [replace(one, id=f"{prefix}{number}") for number, one in enumerate(plates, start=1)]
    return Former(tuple(named), thickness_mm)


def _worth(plates: Sequence[Plate]) -> float:
    """Say how good a former is: how many strips lie on it, less what its plates take to cut."""
    return sum(len(plate.marks) for plate in plates) - 0.5 * len(plates)


class _MiddleLines:
    """The middle lines of strips, and which piece each part of them is of."""

    def __init__(self, ribbons: Ribbons, threads: Threads, runs: Runs) -> None:
        following = following_rung(ribbons.offsets, ribbons.closed)
        near = np.flatnonzero(following >= 0)
        middle = (ribbons.right + ribbons.left) / 2.0
        self.ends = np.stack((middle[near], middle[following[near]]), axis=1)
        self.panel = np.isin(near, ribbons.entry)
        owner, steps = np.empty(len(threads.crossing), dtype=np.int64), []
        for piece, (thread, first, last) in enumerate(runs.rows):
            passes = threads.offsets[thread] + np.arange(first, last + 1) % threads.lengths[thread]
            # Where two pieces lap, the one that begins there goes on.
            owner[passes[:-1]] = piece
            if not threads.closed[thread] and last == threads.lengths[thread] - 1:
                owner[passes[-1]] = piece
            centre = ribbons.centre[threads.crossing[passes]]
            steps.append(np.linalg.norm(np.diff(centre, axis=0), axis=1))
        self.step_mm = float(np.median(np.concatenate(steps)))
        own = np.searchsorted(ribbons.offsets, near, side="right") - 1
        at = np.searchsorted(ribbons.entry, near, side="right") - 1
        # Before its first pass, a ring comes from its last one.
        begin = threads.offsets[own]
        behind = np.where(threads.closed[own], threads.offsets[own + 1] - 1, begin)
        self.owner = owner[np.where(at < begin, behind, at)]

    def marks(
        self, plane: Plane, outline: shapely.Polygon, slotted: shapely.Polygon, reach: float
    ) -> tuple[StripMark, ...]:
        """Return where strips pass the edge of a plate, but for the mouths of its slots.

        A strip that lies in the plane passes at its crossings.
        """
        flat = plane.flat(self.ends)
        above = flat[:, :, 2] > -_BESIDE_MM
        lies = self.panel & np.all(np.abs(flat[:, :, 2]) < _BESIDE_MM, axis=1)
        through = np.flatnonzero((above[:, 0] != above[:, 1]) | lies)
        start, end = flat[through, 0], flat[through, 1]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip(start[:, 2] / (start[:, 2] - end[:, 2]), 0.0, 1.0)
        share = np.where(lies[through], _BESIDE_CROSSING, share)[:, None]
        points = (start + share * (end - start))[:, :2]
        places = shapely.points(points)
        whole, feet = (
            shapely.get_coordinates(shapely.shortest_line(area.boundary, places))[::2]
            for area in (outline, slotted)
        )
        away = np.linalg.norm(feet - points, axis=1)
        near = (away < reach) & (points[:, 0] > plane.least) & (away > 0.0)
        # Where a slot begins there is no edge.
        near &= np.linalg.norm(feet - whole, axis=1) < 2.0 * _CUT_MM
        return tuple(
            StripMark(int(self.owner[through[at]]), feet[at], unit(feet[at] - points[at]))
            for at in np.flatnonzero(near).tolist()
        )


def _joined(
    layout: _Layout, inside: _Inside, strips: _MiddleLines, thick: float, *, closely: bool
) -> list[Plate]:
    """Return the plates of a layout with slots and marks: the largest group that holds together."""

    def sections(plane: Plane) -> list[_Part]:
        return [(plane, part) for part in inside.section(plane, closely=closely)]

    slices = [part for plane in layout.slices for part in sections(plane)]
    height = inside.points @ layout.spine.frame[2] - layout.spine.origin @ layout.spine.frame[2]
    levels = np.linspace(height.min(), height.max(), _PLACES + 2)[1:-1]
    spines = [sections(layout.spine_at(level)) for level in levels.tolist()]
    held = [
        {row: spans[0].long for row, part in enumerate(slices) for spine in some
         if (spans := _common(part, spine, thick)) and spans[0].long > _HOLD_MM}
        for some in spines
    ]  # fmt: skip
    # A tall slice rocks on a single spine.
    wanted = [2 if np.ptp(np.array(part.bounds)[[1, 3]]) > _TALL_MM else 1 for _, part in slices]
    chosen: list[int] = []
    while len(chosen) < _MOST_SPINES:
        count = [sum(row in held[at] for at in chosen) for row in range(len(slices))]
        gains = [sum(count[row] < wanted[row] for row in rows) for rows in held]
        best = max(
            (at for at in range(len(spines)) if all(abs(at - one) > 1 for one in chosen)),
            key=lambda at: (gains[at], sum(held[at].values()), -at),
            default=None,
        )
        if best is None or not gains[best]:
            break
        chosen.append(best)
    standing = [part for at in sorted(chosen) for part in spines[at]]
    return _slotted(slices, standing, strips, inside.depth + _NEAR_MM, thick)


_Part: TypeAlias = tuple[Plane, shapely.Polygon]


class _Span(NamedTuple):
    """Where two plates meet along a line, and how far each goes on there."""

    low: float
    high: float
    mine: tuple[float, float]
    its: tuple[float, float]

    @property
    def long(self) -> float:
        """How long they meet."""
        return self.high - self.low


def _common(one: _Part, other: _Part, thick: float) -> list[_Span]:
    """Return where a slice and a spine meet along the slice's first axis, the longest first.

    Each is taken as far as the other's thickness covers it.
    """
    (plane, outline), (across, spine) = one, other
    reach = 4.0 * float(np.abs(shapely.bounds([outline, spine])).max())
    ends = _on_line(one, across, np.array([-reach, reach]))
    spans = []
    for way, area in ((plane, outline), (across, spine)):
        line = shapely.LineString(way.flat(ends)[:, :2])
        band = line.buffer((thick + SLOT_PLAY_MM) / 2.0, cap_style="flat")
        runs = [
            shapely.line_locate_point(line, shapely.points(shapely.get_coordinates(part))) - reach
            for part in shapely.get_parts(band.intersection(area)).tolist()
            if part.area > 0.0
        ]
        spans.append([(float(run.min()), float(run.max())) for run in runs])
    shared = [
        _Span(max(mine[0], its[0]), min(mine[1], its[1]), mine, its)
        for mine in spans[0]
        for its in spans[1]
    ]
    return sorted((span for span in shared if span.long > 0.0), key=lambda span: -span.long)


def _on_line(one: _Part, across: Plane, places: FloatArray) -> FloatArray:
    """Return points in space where a slice meets the plane of a spine, (N, 3)."""
    plane = one[0]
    level = float(across.flat(plane.origin)[2] / -(across.frame[2] @ plane.axes[1]))
    return plane.raised(np.column_stack((places, np.full(len(places), level))))


def _slotted(
    slices: Sequence[_Part],
    spines: Sequence[_Part],
    strips: _MiddleLines,
    reach: float,
    thick: float,
) -> list[Plate]:
    """Cut slots where slices and spines meet, and keep the largest group that hangs together."""
    parts = [*slices, *spines]
    gone: list[list[shapely.Geometry]] = [[] for _ in parts]
    joins: list[list[Join]] = [[] for _ in parts]
    for row, at in itertools.product(range(len(slices)), range(len(slices), len(parts))):
        across = parts[at][0]
        for number, span in enumerate(_common(parts[row], parts[at], thick)):
            middle = (span.low + span.high) / 2.0
            held = number == 0 and span.long > _HOLD_MM
            # A plate that meets another twice, or hardly, makes way there. The corners of a slot's
            # end are round, and it is so much deeper.
            cuts = (
                [
                    (row, span.mine[0] - _OUT_MM, middle + _CUT_MM),
                    (at, middle - _CUT_MM, span.its[1] + _OUT_MM),
                ]
                if held
                else [(at, span.its[0] - _OUT_MM, span.its[1] + _OUT_MM)]
            )
            for part, start, end in cuts:
                ends = _on_line(parts[row], across, np.array([start, end]))
                way = shapely.LineString(parts[part][0].flat(ends)[:, :2])
                gone[part].append(way.buffer((thick + SLOT_PLAY_MM) / 2.0, cap_style="flat"))
            if held:
                meet = _on_line(parts[row], across, np.array([middle, middle + 1.0]))
                mine, its = parts[row][0].flat(meet)[:, :2], across.flat(meet)[:, :2]
                joins[row].append(Join(at, mine[0], mine[1] - mine[0]))
                joins[at].append(Join(row, its[0], its[0] - its[1]))
    left = list[shapely.Polygon]()
    for (plane, outline), cuts_of in zip(parts, gone, strict=True):
        rest = shapely.get_parts(outline.difference(shapely.union_all(cuts_of))).tolist()
        whole = _cuttable(max(rest, key=lambda one: one.area))
        beside = [one for (other, _), one in zip(parts, left, strict=False) if other is plane]
        taken = shapely.buffer(shapely.union_all(beside), thick / 2.0 + _APART_MM)
        free = shapely.get_parts(whole.difference(taken)).tolist() if beside else [whole]
        left.append(max(free, key=lambda one: one.area, default=shapely.Polygon()))
    # What falls off takes its slots with it.
    there = {
        (part, join.plate)
        for part, own in enumerate(joins)
        for join in own
        if left[part].distance(shapely.Point(join.point)) < 2.0 * _CUT_MM
    }
    links = [(row, at) for row, at in there if row < at and (at, row) in there]
    joined = np.array(sorted(links), dtype=np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(links)), (joined[0], joined[1])), shape=(len(parts), len(parts)))
    group = connected_components(graph, directed=False)[1]
    kept = np.flatnonzero(group == np.bincount(group).argmax()).tolist() if links else []
    numbers = {part: place for place, part in enumerate(kept)}
    plates = []
    for part in kept:
        plane, outline = parts[part]
        plates.append(
            Plate(
                "",
                part >= len(slices),
                plane,
                left[part],
                strips.marks(plane, outline, left[part], reach),
                tuple(
                    replace(join, plate=numbers[join.plate])
                    for join in joins[part]
                    if (part, join.plate) in there and (join.plate, part) in there
                ),
            )
        )
    return plates


def _cuttable(area: shapely.Polygon) -> shapely.Polygon:
    """Return a polygon without the points and notches that a cut is too wide for."""
    for off in (-_CUT_MM, 2.0 * _CUT_MM, -_CUT_MM):
        area = area.buffer(off, quad_segs=_QUARTER)
    return max(shapely.get_parts(area.simplify(0.02)).tolist(), key=lambda one: one.area)


def snapped(plate: Plate, wide_mm: float, deep_mm: float) -> Plate | None:
    """Return a plate with lines of slits along which it breaks into parts that a way lets out.

    A part fits in a rectangle of nine tenths of what the way lets through. Slits keep off edges, so
    that nothing falls off. None where a line would be solid for too long.

    Examples
    --------
    >>> flat = Plane(np.zeros(3), np.eye(3)[:2])
    >>> disc = Plate("F1", False, flat, shapely.Point(0, 0).buffer(50), (), ())
    >>> len(snapped(disc, 60.0, 120.0).snaps), len(snapped(disc, 120.0, 120.0).snaps)
    (1, 0)
    """
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(plate.outline))
    first, second = corners[1] - corners[0], corners[2] - corners[1]
    sides = (first, second) if np.hypot(*first) <= np.hypot(*second) else (second, first)
    broad, long = _OF_WAY * wide_mm, _OF_WAY * max(deep_mm, wide_mm)
    lines = []
    for way, across, most in ((*sides, broad), (*sides[::-1], long)):
        count = int(np.ceil(np.hypot(*way) / most))
        middle = corners[:4].mean(axis=0)
        lines += [
            middle + (number / count - 0.5) * way + np.outer([-0.51, 0.51], across)
            for number in range(1, count)
        ]
    rows = shapely.linestrings(np.array(lines).reshape(-1, 2, 2))
    slits, inner = [], plate.outline.buffer(-_BRIDGE_MM)
    for run in shapely.get_parts(shapely.intersection(rows, inner)).tolist():
        count = max(1, round(run.length / (_SLIT_MM + _BRIDGE_MM)))
        pitch = run.length / count
        if pitch > 2.0 * _BRIDGE_MM:
            slits += [
                substring(run, at * pitch + _BRIDGE_MM / 2.0, (at + 1) * pitch - _BRIDGE_MM / 2.0)
                for at in range(count)
            ]
    cuts = shapely.buffer(slits, _SLIT_WIDE_MM / 2.0, cap_style="flat")
    outline = _cuttable(plate.outline.difference(shapely.union_all(cuts)))
    solid = shapely.length(shapely.get_parts(shapely.intersection(rows, outline)))
    if solid.max(initial=0.0) > _SOLID_MM:
        return None
    return replace(plate, outline=outline, snaps=tuple(lines))


def plate_body(plate: Plate, thickness_mm: float) -> FloatArray:
    """Return a plate as a closed body: the corners of its triangles in space, (F, 3, 3)."""
    cut = shapely.get_parts(shapely.constrained_delaunay_triangles(plate.outline)).tolist()
    flat = np.array([triangle.exterior.coords[:3] for triangle in cut]).reshape(-1, 3, 2)
    turn = np.linalg.det(np.diff(flat, axis=1)) < 0.0
    flat[turn] = flat[turn, ::-1]
    half = thickness_mm / 2.0 * plate.plane.frame[2]
    middle = plate.plane.raised(flat)
    bodies = [middle + half, middle[:, ::-1] - half]
    for ring in (plate.outline.exterior, *plate.outline.interiors):
        here = plate.plane.raised(np.array(ring.coords))
        start, end = here[:-1], here[1:]
        bodies.append(np.stack((start - half, end - half, end + half), axis=1))
        bodies.append(np.stack((start - half, end + half, start + half), axis=1))
    return np.concatenate(bodies)
