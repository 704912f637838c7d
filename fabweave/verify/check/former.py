"""Check a former: off all strips, slotted together, named where strips pass, and let out.

What makes it is held to the same, in ``fabweave/former/plates.py``, and a little more closely:

- A name stands on the edge of its plate, and from the middle line of its strip no farther than two
  layers and some millimetres.
- A way out is so wide that no rail of a strip in place, and no rim of the mesh, comes into the
  circle about its middle. It is as deep as it is straight on from there to the other side of the
  mesh, whose faces and openings are fans about the means of their corners.
- A plate comes out if it fits, or each part that it breaks into along its rows of slits, in a
  rectangle as broad as the way is wide, and as long as it is deep, or wide, if that is more. A row
  is nowhere solid for more than some millimetres.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from fabweave.verify.check.rim import check_side_sheet
from fabweave.verify.crossing_map import FormerRecord, PlateRecord, WayRecord
from fabweave.verify.drawing import ENGRAVE_LAYERS, HOLES, OUTLINES, Drawing, Floats
from fabweave.verify.measure.nearness import facets
from fabweave.verify.measure.walks import groups_of
from fabweave.verify.read.job_files import FORMER, FORMER_RECORD, Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Place, Tally

#: Figures are rounded to a thousandth; plates may go into one another no farther than this.
_ROUNDED_MM, _INTO_MM = 5e-3, 0.05
#: A name stands on the edge to this, its tick begins so near to it, and its strip is so near beyond
#: two layers, millimetres.
_ON_EDGE_MM, _TICK_MM, _NEAR_MM = 0.05, 0.5, 7.0
#: A rectangle for a part is looked for at so many turns of half a circle.
_TURNS = 360
#: Between two slits of a line along which a plate breaks there is no more than this.
_SOLID_MM = 10.0


#: The layer of ticks.
_TICKS = ENGRAVE_LAYERS[1]


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate as drawn, in its sheet's coordinates, and where that lies in space."""

    record: PlateRecord
    area: shapely.Polygon
    ticks: list[Floats]
    origin: Floats
    frame: Floats

    def flat(self, points: Floats) -> Floats:
        """Return points of space on its sheet, and how high they are above it."""
        return np.asarray((points - self.origin) @ self.frame.T)

    def raised(self, points: Floats) -> Floats:
        """Return points of its sheet in space."""
        return np.asarray(self.origin + points @ self.frame[:2])


def check_former(job: Job, tally: Tally) -> None:
    """Check every plate against all strips, the plates that it meets, and the way out."""
    asked, place = "former" in job.options, tally.at(FORMER_RECORD)
    if job.former is None or not asked:
        tally.at(FORMER).expect(
            job.former is None and not asked,
            "a former is asked for, and there is none" if asked else "nobody asked for it",
        )
        return
    record: FormerRecord | None = job.former.record
    if record is None:
        return
    for sheet in record["sheets"]:
        name, size = str(sheet["name"]), np.array([sheet["width_mm"], sheet["height_mm"]])
        drawing = job.former.dxf.get(name)
        if drawing is not None:
            spacing = float(sheet["margin_mm"]), float(sheet["gap_mm"])
            where = tally.at(FORMER, name)
            check_side_sheet(drawing, job.former.svg.get(name), size, spacing, where)
    plates = [
        plate
        for one in record["plates"]
        if (plate := _read(one, job.former.dxf.get(one["sheet"]), place.at(f"plate {one['id']}")))
    ]
    drawn = sorted(str(shape.piece) for drawing in job.former.dxf.values()
                   for shape in drawing.shapes if shape.layer == OUTLINES)  # fmt: skip
    place.same("plates that are drawn", drawn, sorted(one.record["id"] for one in plates))
    thick = record["thickness_mm"]
    layers = [supply.thickness_mm or 0.0 for supply in job.supplies.values()]
    strips = [one.rungs.reshape(-1, 3)[facets(one)] for one in required(job.model).values()]
    triangles = np.concatenate(strips).reshape(-1, 3, 3)
    for plate in plates:
        here = place.at(f"plate {plate.record['id']}")
        _check_clear(plate, triangles, thick, max(layers), here)
        _check_names(plate, job, 2.0 * max(layers) + _NEAR_MM, here)
        _check_snaps(plate, record["way_out"], here)
    _check_slots(plates, thick, place)
    if record["way_out"] is not None:
        _check_way(record["way_out"], job, place.at("way out"))


def _read(record: PlateRecord, drawing: Drawing | None, place: Place) -> _Plate | None:
    """Return a plate as it is drawn, if it can be read."""
    place.expect(drawing is not None, f"{record['sheet']}.dxf could not be read")
    if drawing is None:
        return None
    lines = drawing.of(OUTLINES, record["id"])
    if not place.expect(len(lines) == 1 and lines[0].closed, "it has not one closed outline"):
        return None
    axes = np.array(record["axes"])
    place.expect(
        np.abs(axes @ axes.T - np.eye(2)).max() < 1e-9, "its axes are not of length 1, and square"
    )
    area = shapely.Polygon(
        lines[0].traced, [hole.traced for hole in drawing.of(HOLES, record["id"])]
    )
    if not place.expect(area.is_valid, "its lines run through one another"):
        return None
    ticks = [one.traced for one in drawing.of(_TICKS, record["id"])]
    frame = np.vstack((axes, np.cross(*axes)))
    return _Plate(record, area, ticks, np.array(record["origin"]), frame)


def _check_clear(
    plate: _Plate, triangles: Floats, thick: float, layer: float, place: Place
) -> None:
    """Check that no strip, twice as thick at its laps, comes into the plate.

    Of each facet that part counts which is no higher above or below the plate than both reach.
    """
    flat = plate.flat(triangles)
    reach = thick / 2.0 + layer
    height = flat[:, :, 2]
    flat = flat[(height.min(axis=1) < reach) & (height.max(axis=1) > -reach)]
    apart = np.inf
    for triangle in flat:
        corners = triangle
        for sign in (1.0, -1.0):
            corners = _below(corners, sign, reach)
        if len(corners):
            shadow = shapely.MultiPoint(corners[:, :2]).convex_hull
            apart = min(apart, float(shapely.distance(shadow, plate.area)))
    place.at_least("former_mm", apart, layer - _ROUNDED_MM, "a strip is {} from it")


def _below(corners: Floats, sign: float, level: float) -> Floats:
    """Return the part of a convex polygon below a height, or above its negative."""
    kept = []
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        low, high = sign * here[2] - level, sign * there[2] - level
        if low <= 0.0:
            kept.append(here)
        if (low < 0.0) != (high < 0.0) and low != high:
            kept.append(here + low / (low - high) * (there - here))
    return np.array(kept).reshape(-1, 3)


def _check_names(plate: _Plate, job: Job, near: float, place: Place) -> None:
    """Check that each name has a tick, stands on the edge, and near its strip."""
    place.number("ticks", len(plate.ticks), len(plate.record["strips"]), within=0)
    for strip in plate.record["strips"]:
        here, at = place.at(f"strip {strip['piece']}"), np.array(strip["at"])
        laid = job.developments.get(str(strip["piece"]))
        if not here.expect(laid is not None, "there is no such piece") or laid is None:
            continue
        off = plate.area.boundary.distance(shapely.Point(at))
        here.at_most("edge_mm", off, _ON_EDGE_MM, "it is {} off it")
        tick = min((float(np.hypot(*(one[0] - at))) for one in plate.ticks), default=np.inf)
        here.at_most("tick_mm", tick, _TICK_MM, "its tick begins {} from it")
        middle = laid.placed.mean(axis=1)
        away = _to_lines(plate.raised(at), middle[:-1], middle[1:])
        here.at_most("strip_mm", away, near, "the strip passes {} from it")


def _to_lines(place: Floats, start: Floats, end: Floats) -> float:
    """Return how far a place is from the nearest of some lines; infinite where there is none."""
    side, arm = end - start, place - start
    square = np.maximum(np.sum(side**2, axis=1), 1e-300)
    share = np.clip(np.sum(arm * side, axis=1) / square, 0.0, 1.0)
    return float(np.linalg.norm(arm - share[:, None] * side, axis=1).min(initial=np.inf))


def _check_slots(plates: Sequence[_Plate], thick: float, place: Place) -> None:
    """Check that plates do not run into one another, and that slots hold all of them together."""
    pairs = []
    ends = {
        (plate.record["id"], slot["plate"]): plate.raised(np.array(slot["end"]))
        for plate in plates
        for slot in plate.record["slots"]
    }
    for one, other in combinations(plates, 2):
        here = place.at(f"plates {one.record['id']} and {other.record['id']}")
        into = _into(one, other, thick)
        here.at_most("into_mm", into, _INTO_MM, "they run {} into one another")
        pair = one.record["id"], other.record["id"]
        there, back = ends.get(pair), ends.get(pair[::-1])
        here.expect((there is None) == (back is None), "only one of them has a slot for the other")
        if there is not None and back is not None:
            gap = float(np.linalg.norm(there - back))
            here.at_most("slot_mm", gap, _INTO_MM, "their slots end {} from one another")
            pairs.append(pair)
    groups = groups_of([*pairs, *((one.record["id"], one.record["id"]) for one in plates)])
    place.expect(len(set(groups.values())) <= 1, "its plates do not hang together")


def _into(one: _Plate, other: _Plate, thick: float) -> float:
    """Return how far, along the line where their planes meet, two plates take the same place.

    Planes that do not cross at right angles are as far apart as one plate's corners are from the
    other's plane, where that plate is.
    """
    half = thick / 2.0
    if abs(one.frame[2] @ other.frame[2]) > 1e-6:
        corners = other.flat(one.raised(shapely.get_coordinates(one.area)))
        near = shapely.distance(other.area, shapely.points(corners[:, :2])) < half
        least = np.abs(corners[near, 2]).min(initial=np.inf)
        return max(0.0, thick - float(least)) if near.any() else 0.0
    line = np.cross(one.frame[2], other.frame[2])
    taken = []
    for plate, partner in ((one, other), (other, one)):
        # The band of the plate in which the other one's thickness lies, and its place on the line.
        normal, along = plate.frame[:2] @ partner.frame[2], plate.frame[:2] @ line
        offset = (plate.origin - partner.origin) @ partner.frame[2]
        middle, far = -offset * normal, 1e5
        band = shapely.Polygon(
            [middle + u * far * along + v * half * normal
             for u, v in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        )  # fmt: skip
        start = float(plate.origin @ line)
        runs = []
        for part in shapely.get_parts(shapely.intersection(band, plate.area)).tolist():
            if part.area > half * _INTO_MM:
                places = shapely.get_coordinates(part) @ along + start
                runs.append(shapely.LineString([(places.min(), 0.0), (places.max(), 0.0)]))
        taken.append(shapely.union_all(runs))
    return float(shapely.intersection(*taken).length)


def _check_snaps(plate: _Plate, way: WayRecord | None, place: Place) -> None:
    """Check that the plate, or each part that it breaks into, fits through the way out."""
    if way is None:
        return
    lines = [shapely.LineString(line) for line in plate.record["snaps"]]
    solid = [
        run.length
        for line in lines
        for run in shapely.get_parts(line.intersection(plate.area)).tolist()
    ]
    place.at_most("solid_mm", max(solid, default=0.0), _SOLID_MM, "it is to break {} at once")
    cut = shapely.buffer(lines, 0.01, cap_style="flat")
    parts = shapely.get_parts(plate.area.difference(shapely.union_all(cut))).tolist()
    turns = np.pi / _TURNS * np.arange(_TURNS)
    ways = np.stack((np.cos(turns), np.sin(turns)))
    most = way["wide_mm"], max(way["deep_mm"], way["wide_mm"])
    for part in parts:
        sides = np.ptp(shapely.get_coordinates(part) @ ways, axis=0)
        across = np.roll(sides, _TURNS // 2)
        # The turn at which it fits best, by the side that is over its limit by more.
        best = int(np.maximum(sides - most[0], across - most[1]).argmin())
        place.at_most("broad_mm", float(sides[best]), most[0], "a part is {} broad")
        place.at_most("long_mm", float(across[best]), most[1], "a part is {} long")


def _check_way(way: WayRecord, job: Job, place: Place) -> None:
    """Check that the way is as wide and as deep as it is said to be."""
    plan, mesh = required(job.map), required(job.mesh)
    at, inward = np.array(way["at"]), np.array(way["inward"])
    place.number("inward", float(np.linalg.norm(inward)), 1.0, within=1e-5)
    order = [name for step in plan.steps for name in step.pieces]
    if way["before"] is None:
        rim = np.flatnonzero(mesh.twin < 0)
        start = mesh.vertices[mesh.corner[rim]]
        end = mesh.vertices[mesh.corner[mesh.next[rim]]]
    else:
        there = set(order[: way["before"]])
        laid = [one.placed for name, one in job.developments.items() if name in there]
        start, end = (
            np.concatenate([np.empty((0, 3)), *(rungs[own].reshape(-1, 3) for rungs in laid)])
            for own in (slice(None, -1), slice(1, None))
        )
    wide = 2.0 * _to_lines(at, start, end)
    place.at_least("wide_mm", wide, way["wide_mm"] - _ROUNDED_MM, "it is {} wide")
    place.expect(
        way["before"] is None or 0 < way["before"] < len(order), "it is before no piece that comes"
    )
    deep = _depth(_fans(mesh), at, inward)
    place.at_least("deep_mm", deep, way["deep_mm"] - _ROUNDED_MM, "it is {} deep")


def _fans(mesh: LoadedMesh) -> Floats:
    """Return the triangles about the means of all faces and openings, (F, 3, 3)."""
    start, end = mesh.corner, mesh.corner[mesh.next]
    fans = [np.stack((mesh.vertices[start], mesh.vertices[end], mesh.centres[mesh.face]), axis=1)]
    rim = np.flatnonzero(mesh.twin < 0)
    sides = np.stack((start[rim], end[rim]), axis=1)
    groups = groups_of(map(tuple, sides.tolist()))
    loops = np.array([groups[corner] for corner in sides[:, 0].tolist()])
    for loop in set(loops.tolist()):
        own = mesh.vertices[sides[loops == loop]]
        mean = own[:, 0].mean(axis=0)
        fans.append(np.insert(own, 2, mean, axis=1))
    return np.concatenate(fans)


def _depth(triangles: Floats, start: Floats, way: Floats) -> float:
    """Return how far from a point, a little inside, a ray goes before it meets a triangle.

    Each triangle is looked at along the ray: it is met where the three areas there are of one sign.
    """
    across = np.linalg.svd(way[None])[2][1:]
    seen = (triangles - start) @ across.T
    areas = np.stack(
        [seen[:, k, 0] * seen[:, k - 1, 1] - seen[:, k, 1] * seen[:, k - 1, 0] for k in range(3)],
        axis=1,
    )
    signs = np.sign(areas)
    met = (np.abs(areas.sum(axis=1)) > 0.0) & (
        np.abs(signs.sum(axis=1)) == np.abs(signs).sum(axis=1)
    )
    # Opposite corners weigh as the areas do.
    weights = areas[met][:, [2, 0, 1]] / areas[met].sum(axis=1, keepdims=True)
    depth = np.einsum("fk,fk->f", weights, (triangles[met] - start) @ way)
    return float(depth[depth > 1.0].min(initial=np.inf))
