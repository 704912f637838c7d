"""Check a former: off all strips, slotted together, named where strips pass, and let out."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import shapely

from fabweave.verify.check.rim import check_side_sheet
from fabweave.verify.crossing_map import PlateRecord, WayRecord
from fabweave.verify.drawing import HOLES, OUTLINES, Drawing, Floats, traced
from fabweave.verify.measure.walks import groups_of
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import FORMER, FORMER_RECORD, Job, required
from fabweave.verify.report import Place, Tally

#: Figures are rounded to a thousandth; plates may go into one another no farther than this.
_ROUNDED_MM, _INTO_MM = 5e-3, 0.05
#: A name's tick stands on the edge to this, and so near to its strip, millimetres.
_ON_EDGE_MM, _NEAR_MM = 0.05, 15.0
#: Faces that are not flat may lie elsewhere by this, millimetres.
_BENT_MM = 3.0
#: Between two slits of a line along which a plate breaks there is no more than this.
_SOLID_MM = 10.0


@dataclass(frozen=True, eq=False)
class _Plate:
    """A plate as drawn, in its sheet's coordinates, and where that lies in space."""

    record: PlateRecord
    area: shapely.Polygon
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
    record = job.former.record
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
    facets = _facets(list(required(job.model).values()))
    for plate in plates:
        here = place.at(f"plate {plate.record['id']}")
        _check_clear(plate, facets, thick, max(layers), here)
        _check_names(plate, job, here)
        _check_snaps(plate, record["way_out"], here)
    _check_slots(plates, thick, place)
    if record["way_out"] is not None:
        _check_way(record["way_out"], job, place.at("way out"))


def _read(record: PlateRecord, drawing: Drawing | None, place: Place) -> _Plate | None:
    """Return a plate as it is drawn, if it can be read."""
    if not place.expect(drawing is not None, f"{record['sheet']}.dxf could not be read"):
        return None
    lines = drawing.of(OUTLINES, record["id"]) if drawing is not None else []
    if not place.expect(len(lines) == 1 and lines[0].closed, "it has not one closed outline"):
        return None
    axes = np.array(record["axes"])
    place.expect(
        np.abs(axes @ axes.T - np.eye(2)).max() < 1e-9, "its axes are not of length 1, and square"
    )
    inner = [
        traced(one) for one in (drawing.of(HOLES, record["id"]) if drawing is not None else [])
    ]
    area = shapely.Polygon(traced(lines[0]), inner)
    if not place.expect(area.is_valid, "its lines run through one another"):
        return None
    return _Plate(record, area, np.array(record["origin"]), np.vstack((axes, np.cross(*axes))))


def _facets(strips: Sequence[Strip]) -> Floats:
    """Return the two triangles between neighbouring rungs of all strips, (F, 3, 3)."""
    found = []
    for strip in strips:
        after = np.roll(strip.rungs, -1, axis=0)
        steps = len(strip.from_right)
        a, d = strip.rungs[:steps, 0], strip.rungs[:steps, 1]
        b, c = after[:steps, 0], after[:steps, 1]
        way = strip.from_right[:, None, None]
        found.append(np.where(way, np.stack((a, b, c), 1), np.stack((a, b, d), 1)))
        found.append(np.where(way, np.stack((a, c, d), 1), np.stack((b, c, d), 1)))
    return np.concatenate(found)


def _check_clear(plate: _Plate, facets: Floats, thick: float, layer: float, place: Place) -> None:
    """Check that no strip, twice as thick at its laps, comes into the plate.

    Of each facet that part counts which is no higher above or below the plate than both reach.
    """
    flat = plate.flat(facets)
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


def _check_names(plate: _Plate, job: Job, place: Place) -> None:
    """Check that each name stands on the edge where its strip passes."""
    for strip in plate.record["strips"]:
        here, at = place.at(f"strip {strip['piece']}"), shapely.Point(strip["at"])
        lines = job.developments.get(str(strip["piece"]))
        if not here.expect(lines is not None, "there is no such piece") or lines is None:
            continue
        here.at_most("edge_mm", plate.area.boundary.distance(at), _ON_EDGE_MM, "it is {} off it")
        entry, leave = lines.space[:, :2].mean(axis=1), lines.space[:, 2:].mean(axis=1)
        flat = plate.flat(np.stack((entry, leave), axis=1).reshape(-1, 3))
        start, way = flat[:-1], np.diff(flat, axis=0)
        share = np.clip(-start[:, 2] / np.where(way[:, 2] == 0.0, 1.0, way[:, 2]), 0.0, 1.0)
        nearest = start + share[:, None] * way
        passes = np.abs(nearest[:, 2]) < _NEAR_MM
        away = np.hypot(*(nearest[passes, :2] - np.array(strip["at"])).T)
        here.at_most(
            "strip_mm", float(away.min(initial=np.inf)), _NEAR_MM, "the strip passes {} from it"
        )


def _check_slots(plates: Sequence[_Plate], thick: float, place: Place) -> None:
    """Check that plates do not run into one another, and that slots hold all of them together."""
    pairs = []
    for one, other in combinations(plates, 2):
        here = place.at(f"plates {one.record['id']} and {other.record['id']}")
        into = _into(one, other, thick)
        here.at_most("into_mm", into, _INTO_MM, "they run {} into one another")
        named = [
            other.record["id"] in [slot["plate"] for slot in one.record["slots"]],
            one.record["id"] in [slot["plate"] for slot in other.record["slots"]],
        ]
        here.expect(named[0] == named[1], "only one of them has a slot for the other")
        if all(named):
            ends = [
                plate.raised(np.array([slot["end"] for slot in plate.record["slots"]
                                       if slot["plate"] == partner.record["id"]]))
                for plate, partner in ((one, other), (other, one))
            ]  # fmt: skip
            gap = float(np.linalg.norm(ends[0][0] - ends[1][0]))
            here.at_most("slot_mm", gap, _INTO_MM, "their slots end {} from one another")
            pairs.append((one.record["id"], other.record["id"]))
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
    for part in parts:
        corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(part))
        sides = sorted(np.hypot(*np.diff(corners[:3], axis=0).T).tolist())
        place.at_most("broad_mm", sides[0], way["wide_mm"], "a part is {} broad")
        most = max(way["deep_mm"], way["wide_mm"])
        place.at_most("long_mm", sides[1], most + _ROUNDED_MM, "a part is {} long")


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
        share = np.sum((at - start) * (end - start), axis=1) / np.sum((end - start) ** 2, axis=1)
        edge = start + np.clip(share, 0.0, 1.0)[:, None] * (end - start)
        away = np.linalg.norm(edge - at, axis=1)
    else:
        there = set(order[: way["before"]])
        laid = [one.space.reshape(-1, 3) for name, one in job.developments.items() if name in there]
        away = np.linalg.norm(np.concatenate([*laid, np.full((1, 3), 1e9)]) - at, axis=1)
    place.at_least(
        "wide_mm", 2.0 * float(away.min(initial=np.inf)), way["wide_mm"] - _ROUNDED_MM,
        "it is {} wide",
    )  # fmt: skip
    place.expect(
        way["before"] is None or 0 < way["before"] < len(order), "it is before no piece that comes"
    )
    # Faces as fans: where they are bent, they may be cut otherwise.
    fans = np.stack(
        (mesh.vertices[mesh.corner], mesh.vertices[mesh.corner[mesh.next]],
         mesh.centres[mesh.face]), axis=1,
    )  # fmt: skip
    place.at_least("deep_mm", _depth(fans, at, inward), way["deep_mm"] - _BENT_MM, "it is {} deep")


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
