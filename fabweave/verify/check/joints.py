"""Check joints by superposing their pieces: laps, holes, and ends that hold one another."""

from collections.abc import Callable, Mapping
from functools import partial
from math import isnan, nan

import numpy as np
import shapely

from fabweave.verify.check.pieces import check_layers
from fabweave.verify.crossing_map import CrossingMap, Joint
from fabweave.verify.drawing import Floats, ring_points
from fabweave.verify.measure.development import (
    KINDS,
    kind_of,
    lap_rungs,
    lapped_stations,
    ring_of_rungs,
)
from fabweave.verify.measure.geometry import Motion, farthest, fit_motion
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally

HOLE_MM = 0.01
#: Edges that should lie on one another, or side by side, do so to this.
EDGE_MM = 0.05
#: Interlocking pieces stand apart by this at most.
MOST_AIR_MM = 0.2
_GRIP_MM = 2e-6
_GRID_MM = 1e-6
#: Pulled apart by up to so much, straight or askew, interlocking pieces must collide ...
_PULLS_MM = (0.4, 0.8, 1.2, 1.6, 2.0)
_PULLS_DEG = (-15.0, 0.0, 15.0)
#: ... by this area at least.
_HOLD_MM2 = 0.1


def check_joints(job: Job, tally: Tally) -> None:
    """Check every joint by laying its second piece on its first, panel on panel."""
    plan = required(job.map)
    developments = job.developments
    for joint in plan.joints:
        first, second = (developments.get(name) for name in joint.pieces)
        if first is None or second is None:
            tally.fail(f"joint {joint.id} is not checked: pieces {joint.pieces} are not unfolded")
            continue
        tally.count()
        place = tally.at(f"joint {joint.id} of pieces {joint.pieces[0]} and {joint.pieces[1]}")
        end, begin = first.panels[-1], second.panels[0]
        motion = fit_motion(begin, end)
        slack = first.slack_mm + second.slack_mm
        fitted = sum(plan.piece[name].fitted_mm for name in joint.pieces)
        place.at_most(
            "panel_mm",
            farthest(motion.apply(begin), end),
            HOLE_MM + slack,
            "the two copies of its panel differ by {}",
        )
        slack += fitted
        _check_holes(joint, plan, motion, slack, place)
        _check_statement(joint, job.layers.get(joint.crossing, (0, nan))[1], place)
        # A ring that is cut from one piece may wind back to its joint elsewhere, if it is wavy.
        if joint.pieces[0] != joint.pieces[1] or job.options.get("strips") == "straight":
            pair = _Pair(job, joint, motion, slack)
            for fit in kind_of(joint).fits:
                _FITS[fit](pair, place)
    check_layers(plan, developments, tally)


def _check_holes(
    joint: Joint, plan: CrossingMap, motion: Motion, slack: float, place: Place
) -> None:
    """Check that the holes of both pieces coincide."""
    holes = joint.holes
    stations = (plan.piece[joint.pieces[0]].stations[-1],
                plan.piece[joint.pieces[1]].stations[0])  # fmt: skip
    if stations[0].hole_mm is not None:
        # The station's own hole goes through both tabs, listed or not.
        pair = [[[station.x, station.y] for station in stations]]
        holes = np.concatenate([holes, np.array(pair)])
    if len(holes):
        off = np.hypot(*(holes[:, 0] - motion.apply(holes[:, 1])).T)
        worst = int(np.argmax(off))
        place.at_most(
            "hole_mm", float(off[worst]), HOLE_MM + slack, f"hole {worst} is {{}} off its partner"
        )


def _check_statement(joint: Joint, layers_mm: float, place: Place) -> None:
    """Check what the map says of a joint against itself."""
    if not place.expect(joint.kind in KINDS, f"there is no joint of kind {joint.kind!r}"):
        return
    kind = kind_of(joint)
    place.expect(
        len(joint.holes) == 0 or kind.fastened,
        f"it has {len(joint.holes)} fasteners, but is of kind {kind.name}",
    )
    lap = joint.lap_mm
    place.expect(
        lap is None or (lap > 0.0 if kind.laps else lap == 0.0),
        f"a joint of kind {kind.name} laps by {lap} mm",
    )
    if not isnan(layers_mm):
        place.number(
            "the grip of its fasteners",
            joint.grip_mm,
            layers_mm if len(joint.holes) else None,
            within=_GRIP_MM,
        )


class _Pair:
    """The two pieces of a joint as areas, the second laid on the first."""

    def __init__(self, job: Job, joint: Joint, motion: Motion, slack: float) -> None:
        ends, begins = (required(job.map).piece[name] for name in joint.pieces)
        first, second = (job.developments[name] for name in joint.pieces)
        self.joint, self.begins, self.development = joint, begins, second
        self.slack, self.thickness = slack, job.supplies[ends.thread].thickness_mm
        self.panel = first.panels[-1]
        middle = self.panel.reshape(2, 2, 2).mean(axis=1)
        self.centre = middle.mean(axis=0)
        self.way = (middle[1] - middle[0]) / np.hypot(*(middle[1] - middle[0]))
        corners = self.panel[[0, 2, 3, 1]]
        self.width = float(np.hypot(*(corners[3] - corners[0])))
        lap = ring_of_rungs(lap_rungs(first.window, self.panel, joint))
        # Only what is near: elsewhere the strip may wind back to where it was. The cross-lines
        # at which a lap ends may be longer than the panel's, and askew.
        reach = farthest(np.concatenate([self.panel, lap]), self.centre) + 0.5 * self.width
        near = shapely.Point(self.centre).buffer(reach)
        self.first = _intersection(_area(ends.outline), near)
        self.second = _intersection(_area(motion.apply(begins.outline)), near)
        self.lap = _area(lap)
        self.slots = [motion.apply(ring_points(slot)) for slot in begins.slots[:1]]


def _areas_only(figure: shapely.Geometry) -> shapely.Geometry:
    """Return the polygons of a figure, without points and lines where others only touch."""
    parts = shapely.get_parts(figure)
    flat = parts[shapely.get_dimensions(parts) == 2]
    return shapely.multipolygons(shapely.get_parts(flat))


def _overlay(
    overlay: Callable[..., shapely.Geometry], one: shapely.Geometry, two: shapely.Geometry
) -> shapely.Geometry:
    """Lay one area over another; with almost common edges, that is sound on a grid only."""
    return _areas_only(overlay(_areas_only(one), _areas_only(two), grid_size=_GRID_MM))


_intersection = partial(_overlay, shapely.intersection)
_difference = partial(_overlay, shapely.difference)
_symmetric_difference = partial(_overlay, shapely.symmetric_difference)
_union = partial(_overlay, shapely.union)


def _area(ring: Floats) -> shapely.Geometry:
    return _areas_only(shapely.make_valid(shapely.Polygon(ring)))


def _check_lap(pair: _Pair, place: Place) -> None:
    """Check that two laps are the same figure, as long as the map says."""
    if pair.joint.lap_mm is None:
        return
    # What both cover is the ribbon itself, half the lap to either side of the crossing's middle.
    shared = _part_near(_intersection(pair.first, pair.second), pair.centre)
    off = shapely.area(_symmetric_difference(shared, pair.lap))
    place.at_most(
        "lap_mm",
        off / shapely.length(pair.lap),
        EDGE_MM + pair.slack,
        f"its laps do not lie on one another over {pair.joint.lap_mm:g} mm: {off:.3f} mm² stand "
        "out, in the mean by {}",
    )


def _check_under(pair: _Pair, place: Place) -> None:
    """Check that a long lap has crossings for itself, and ends where its thread goes under."""
    stations, on = pair.begins.stations, lapped_stations(pair.development, pair.joint)
    least = kind_of(pair.joint).crossings
    place.expect(on + 1 >= least, f"its lap goes over {on + 1} crossings, not over {least}")
    place.expect(not stations[on].over, "its lap does not end under a strand")
    place.expect(
        on < len(stations) - 1 or pair.begins.joints[1] is None,
        "its lap goes on to the next joint of its thread",
    )
    held = [station.crossing for station in stations[1 : on + 1] if station.hole_mm is not None]
    place.expect(not held, f"only one of its layers has the holes of crossings {held}")


def _check_flush(pair: _Pair, place: Place, most_air: float = MOST_AIR_MM) -> None:
    """Check that two pieces lie side by side, without overlap and nearly without a gap."""
    common = shapely.area(_intersection(pair.first, pair.second))
    place.at_most(
        "overlap_mm",
        common / pair.width,
        EDGE_MM + pair.slack,
        f"its pieces should lie side by side, and overlap by {common:.3f} mm², in the mean by {{}}",
    )
    panel = shapely.Polygon(pair.panel[[0, 2, 3, 1]])
    bare = _difference(panel, _union(pair.first, pair.second))
    # The seam: where either piece's edge runs inside the panel.
    inner = shapely.buffer(panel, -EDGE_MM)
    seam = shapely.length(shapely.intersection(shapely.boundary(pair.first), inner))
    place.at_most(
        "air_mm",
        shapely.area(bare) / max(seam, pair.width / 2.0),
        most_air + pair.slack,
        "its pieces stand {} apart along their seam",
    )


def _check_hold(pair: _Pair, place: Place) -> None:
    """Check that two pieces collide when they are pulled apart along the thread."""
    for angle in _PULLS_DEG:
        turn = np.exp(1j * np.radians(angle)) * complex(*pair.way)
        way = np.array([turn.real, turn.imag])
        held = 0.0
        for pull in _PULLS_MM:
            moved = shapely.transform(pair.second, lambda xy, d=pull * way: xy + d)
            held = max(held, float(shapely.area(_intersection(pair.first, moved))))
        place.at_least(
            "hold_mm2",
            held,
            _HOLD_MM2,
            f"pulled apart at {angle:g}° to the thread, its pieces collide on {{}} only",
        )


def _check_tab(pair: _Pair, place: Place) -> None:
    """Check that the first piece's tab goes through the second one's slot, up to its shoulders."""
    if not place.expect(len(pair.slots) == 1, "its second piece has no slot"):
        return
    slot = shapely.Polygon(pair.slots[0])
    if not place.expect(slot.is_valid and slot.area > 0.0, "its slot is not simple"):
        return
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(slot))
    steps = np.diff(corners[:3], axis=0)
    sizes = np.hypot(*steps.T)
    width, length = float(sizes.min()), float(sizes.max())
    across = steps[int(np.argmax(sizes))] / length
    if pair.thickness is not None:
        place.at_least("slot_mm", width, pair.thickness, "its slot is {} wide")
    middle = shapely.get_coordinates(slot.centroid)[0]
    ahead = pair.way * width / 2.0

    def breadth(at: Floats) -> float:
        """Return how wide the first piece is along a line across."""
        line = shapely.linestrings([at - pair.width * across, at + pair.width * across])
        return float(shapely.length(_part_near(shapely.intersection(pair.first, line), at)))

    tab = breadth(middle + 1.5 * ahead)
    place.expect(0.0 < tab < length, f"its tab is {tab:.3f} mm wide, its slot {length:.3f} mm")
    shoulder = breadth(middle - 3.0 * ahead)
    place.expect(shoulder > length, "it has no shoulders, the tab slips through its slot")
    behind = _half_plane(middle, pair.way, 4.0 * pair.width + length)
    beyond = _part_near(_difference(pair.first, behind), middle)
    out = shapely.area(_difference(beyond, pair.second.buffer(EDGE_MM)))
    place.expect(
        shapely.area(beyond) > 0.0 and out <= EDGE_MM * pair.width,
        "its tab does not lie on the second piece behind the slot",
    )


#: How pieces are checked, by the names that kinds of joints give it.
_FITS: Mapping[str, Callable[[_Pair, Place], None]] = {
    "lap": _check_lap,
    "under": _check_under,
    "flush": _check_flush,
    "abut": partial(_check_flush, most_air=EDGE_MM),
    "hold": _check_hold,
    "tab": _check_tab,
}


def _part_near(figure: shapely.Geometry, point: Floats) -> shapely.Geometry:
    """Return the part of a figure that lies at a point: a piece may wind back beside its end."""
    parts = shapely.get_parts(figure)
    near = shapely.distance(parts, shapely.Point(point)) < EDGE_MM
    return shapely.union_all(parts[near])


def _half_plane(at: Floats, way: Floats, size: float) -> shapely.Polygon:
    """Return a large square behind a line square to a direction."""
    side = np.array([-way[1], way[0]]) * size
    back = at - way * size
    return shapely.Polygon([at - side, at + side, back + side, back - side])
