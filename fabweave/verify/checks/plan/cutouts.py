"""Check what is cut out of pieces: where, how large, and through all layers at one place."""

import numpy as np
import shapely

from fabweave.verify.crossing_map import CrossingMap, Cutout, Joint, Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.arcs import ring_points
from fabweave.verify.measure.development import Development
from fabweave.verify.measure.ends import kind_of
from fabweave.verify.measure.geometry import distances, widest_miss
from fabweave.verify.statement import Place, Tally

#: Two records of one hole agree to this, in its place and its diameter.
SAME_MM = 1e-3
#: Holes of one fastener coincide to this, layer on layer.
LAYER_MM = 0.02
#: A slot's round ends may be polygons, which lie inside their circle.
_ROUND_MM = 0.02


def check_cutouts(plan: CrossingMap, tally: Tally) -> None:
    """Check that the cut-outs of each piece are those of its stations and joints, and no others."""
    joint_at = {joint.crossing: joint for joint in plan.joints}
    for piece in plan.pieces:
        if piece.cutouts is None:
            continue
        place = tally.at(f"piece {piece.id}")
        of_station: list[list[Cutout]] = [[] for _ in piece.stations]
        for cutout in piece.cutouts:
            if place.expect(
                0 <= cutout.station < len(of_station),
                f"a cut-out is at station {cutout.station}, which does not exist",
            ):
                of_station[cutout.station].append(cutout)
        for at, (cutouts, station) in enumerate(zip(of_station, piece.stations, strict=True)):
            here = place.at(f"station {at} (crossing {station.crossing})")
            _check_station(piece, at, cutouts, joint_at.get(station.crossing), here)


def _check_station(
    piece: Piece, at: int, cutouts: list[Cutout], joint: Joint | None, place: Place
) -> None:
    """Check the cut-outs of one station."""
    station = piece.stations[at]
    slots = [cutout.ring for cutout in cutouts if cutout.ring is not None]
    circles = [cutout.circle for cutout in cutouts if cutout.circle is not None]
    if slots:
        tabbed = joint is not None and kind_of(joint).slotted and joint.pieces[1] == piece.id
        if tabbed and at == 0 and station.hole_mm is None:
            place.equal("the number of cut-outs at the slot of its joint", len(cutouts), 1)
        elif place.expect(
            len(cutouts) == 1 and joint is None and station.hole_mm is not None,
            "it has a slot where there is a joint, no fastener, or another cut-out",
        ):
            _check_slide(slots[0], (station.x, station.y), station.hole_mm or 0.0, place)
        return
    wanted, diameter = _wanted(piece, at, joint)
    if not place.equal("the number of holes", len(circles), len(wanted)) or not circles:
        return
    holes = np.array(circles)
    place.expect(
        diameter is not None and float(np.max(np.abs(holes[:, 2] - diameter))) < SAME_MM,
        f"its holes have diameters {sorted(set(holes[:, 2].tolist()))}, but should have {diameter}",
    )
    if np.all(np.isfinite(wanted)):
        place.at_most(
            "record_mm",
            widest_miss(distances(wanted, holes[:, :2])),
            SAME_MM,
            "a hole is cut {} from where its station or joint says",
        )


def _wanted(piece: Piece, at: int, joint: Joint | None) -> tuple[Floats, float | None]:
    """Return where a station wants holes, NaN where only layers below tell, and how large."""
    station = piece.stations[at]
    if station.hole_mm is not None:
        return np.array([[station.x, station.y]]), station.hole_mm
    if joint is None or not len(joint.holes):
        return np.zeros((0, 2)), None
    if at == len(piece.stations) - 1 and joint.pieces[0] == piece.id and not station.over:
        return joint.holes[:, 0], joint.hole_mm
    if at == 0 and joint.pieces[1] == piece.id and not station.over:
        return joint.holes[:, 1], joint.hole_mm
    return np.full((len(joint.holes), 2), np.nan), joint.hole_mm


def _check_slide(ring: Floats, middle: tuple[float, float], diameter: float, place: Place) -> None:
    """Check that a slot holds its fastener in the middle, and lets it move one way only."""
    slot = shapely.Polygon(ring_points(ring))
    if not place.expect(slot.is_valid and slot.area > 0.0, "its slot is not simple"):
        return
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(slot))
    width, length = sorted(np.hypot(*np.diff(box[:3], axis=0).T).tolist())
    place.expect(
        abs(width - diameter) < _ROUND_MM and length > 1.2 * diameter,
        f"its slot is {width:.3f} × {length:.3f} mm for a fastener of {diameter:g} mm",
    )
    off = float(np.hypot(slot.centroid.x - middle[0], slot.centroid.y - middle[1]))
    place.at_most("slot_mm", off, _ROUND_MM, "its slot is {} off its station")


def check_layers(plan: CrossingMap, developments: dict[str, Development], tally: Tally) -> None:
    """Check in space that the holes of all layers of a crossing lie on one another."""
    layers: dict[int, list[tuple[str, Floats, Floats, float]]] = {}
    for piece in plan.pieces:
        development = developments.get(piece.id)
        if piece.cutouts is None or development is None:
            continue
        of_station: dict[int, list[tuple[float, float]]] = {}
        for cutout in piece.cutouts:
            station = (
                piece.stations[cutout.station] if cutout.station < len(piece.stations) else None
            )
            if cutout.circle is not None or (station is not None and station.hole_mm is not None):
                of_station.setdefault(cutout.station, []).append(cutout.centre)
        for at, centres in of_station.items():
            if at < len(development.space):
                panel = development.space[at]
                there = _lifted(np.array(centres), development.panels[at], panel)
                crossing = piece.stations[at].crossing
                layers.setdefault(crossing, []).append(
                    (piece.id, there, panel, development.slack_mm + piece.fitted_mm)
                )
    for crossing, strands in layers.items():
        place = tally.at(f"crossing {crossing}")
        name, first, panel, slack = strands[0]
        normal = np.cross(panel[2] - panel[0], panel[1] - panel[0])
        normal = normal / np.linalg.norm(normal)
        for other, points, _, more in strands[1:]:
            if not place.equal(
                f"the number of holes of {other}, which lies on {name},", len(points), len(first)
            ):
                continue
            apart = points[None, :] - first[:, None]
            apart = apart - (apart @ normal)[:, :, None] * normal
            place.at_most(
                "layer_mm",
                widest_miss(np.linalg.norm(apart, axis=2)),
                LAYER_MM + slack + more,
                f"a hole of {other} is {{}} off that of {name}",
            )


def _lifted(points: Floats, flat: Floats, space: Floats) -> Floats:
    """Return points of a flat panel where they are in space, (N, 3)."""
    ones = np.ones((len(flat), 1))
    motion, *_ = np.linalg.lstsq(np.hstack([flat, ones]), space, rcond=None)
    return np.asarray(np.hstack([points, np.ones((len(points), 1))]) @ motion)
