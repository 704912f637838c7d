"""Check joints by superposing their pieces: laps, holes, and ends that hold one another."""

from collections.abc import Callable
from functools import partial
from math import isnan, nan

import numpy as np
import shapely

from fabweave.verify.checks.plan.cutouts import check_layers, slot_ring, superposed_holes
from fabweave.verify.crossing_map import CrossingMap, Joint
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.development import Developed
from fabweave.verify.measure.ends import KINDS, LAPPED, Reach, cut_rungs
from fabweave.verify.measure.geometry import Motion, farthest, fit_motion
from fabweave.verify.read.job_files import Job
from fabweave.verify.report import Tally

HOLE_MM = 0.01
#: Edges that should lie on one another, or side by side, do so to this.
EDGE_MM = 0.05
#: Interlocking pieces stand apart by this at most.
MOST_AIR_MM = 0.2
_GRID_MM = 1e-6
#: Pulled apart by up to so much, straight or askew, interlocking pieces must collide ...
_PULLS_MM = (0.4, 0.8, 1.2, 1.6, 2.0)
_PULLS_DEG = (-15.0, 0.0, 15.0)
#: ... by this area at least.
_HOLD_MM2 = 0.1


def check_joints(job: Job, tally: Tally) -> None:
    """Check every joint by laying its second piece on its first, panel on panel."""
    plan = job.map
    if plan is None or job.model is None:
        return
    developed = job.developed
    for joint in plan.joints:
        first, second = (developed.get(name) for name in joint.pieces)
        if first is None or second is None:
            tally.fail(f"joint {joint.id} is not checked: pieces {joint.pieces} are not unfolded")
            continue
        tally.count()
        where = f"joint {joint.id} of pieces {joint.pieces[0]} and {joint.pieces[1]}"
        end, begin = first.panels[-1], second.panels[0]
        motion = fit_motion(begin, end)
        slack = first.slack_mm + second.slack_mm
        shape = farthest(motion.apply(begin), end)
        tally.measure(
            "panel_mm",
            shape,
            HOLE_MM + slack,
            f"{where}: the two copies of its panel differ by {shape:.4f} mm",
        )
        _check_holes(where, joint, plan, motion, slack, tally)
        _check_statement(where, joint, job.layers.get(joint.crossing, (0, nan))[1], tally)
        # A ring that is cut from one piece cannot be laid on itself as a whole.
        if joint.pieces[0] != joint.pieces[1]:
            own = job.supplies[plan.piece[joint.pieces[0]].thread].thickness_mm
            _check_fit(where, joint, _Laid(plan, joint, first, motion, slack), own, tally)
    check_layers(plan, developed, tally)


def _check_holes(
    where: str, joint: Joint, plan: CrossingMap, motion: Motion, slack: float, tally: Tally
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
        off, told = superposed_holes(where, holes[:, 0], motion.apply(holes[:, 1]))
        tally.measure("hole_mm", off, HOLE_MM + slack, told)


def _check_statement(where: str, joint: Joint, layers_mm: float, tally: Tally) -> None:
    """Check what the map says of a joint against itself."""
    if not tally.expect(joint.kind in KINDS, f"{where}: there is no joint of kind {joint.kind!r}"):
        return
    tally.expect(
        len(joint.holes) == 0 or joint.kind == "rivet",
        f"{where}: has {len(joint.holes)} fasteners, but is of kind {joint.kind}",
    )
    lap = joint.lap_mm
    lapped = joint.kind in (*LAPPED, "slot")
    tally.expect(
        lap is None or (lap > 0.0 if lapped else lap == 0.0),
        f"{where}: a joint of kind {joint.kind} laps by {lap} mm",
    )
    if joint.grip_mm is not None and not isnan(layers_mm):
        tally.expect(
            len(joint.holes) > 0 and abs(joint.grip_mm - layers_mm) < 2e-6,
            f"{where}: its fasteners grip {joint.grip_mm} mm, the layers are {layers_mm:g}",
        )


class _Laid:
    """The two pieces of a joint as areas, the second laid on the first."""

    def __init__(
        self, plan: CrossingMap, joint: Joint, first: Developed, motion: Motion, slack: float
    ) -> None:
        one, two = (plan.piece[name] for name in joint.pieces)
        self.slack = slack
        self.panel = first.panels[-1]
        middle = self.panel.reshape(2, 2, 2).mean(axis=1)
        self.centre = middle.mean(axis=0)
        self.way = (middle[1] - middle[0]) / np.hypot(*(middle[1] - middle[0]))
        corners = self.panel[[0, 2, 3, 1]]
        self.width = float(np.hypot(*(corners[3] - corners[0])))
        # Only what is near: elsewhere the strip may wind back to where it was.
        halves = np.hypot(*(self.panel - self.centre).T).max()
        reach = max(halves, (joint.lap_mm or 0.0) / 2.0) + 0.5 * self.width
        near = shapely.Point(self.centre).buffer(reach)
        self.first = _intersection(_area(one.outline), near)
        self.second = _intersection(_area(motion.apply(two.outline)), near)
        half = Reach((joint.lap_mm or 0.0) / 2.0)
        entered = int(np.argmin(np.hypot(*(first.window[:, 0] - self.panel[0]).T)))
        self.lap = _area(_ring(cut_rungs(first.window, entered, entered, (half, half))))
        self.slots = [motion.apply(slot_ring(slot)) for slot in two.slots[:1]]


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


def _ring(rungs: Floats) -> Floats:
    return np.concatenate([rungs[:, 0], rungs[::-1, 1]])


def _check_fit(
    where: str, joint: Joint, laid: _Laid, thickness: float | None, tally: Tally
) -> None:
    """Check how the two pieces lie on or beside one another."""
    if joint.kind in LAPPED:
        _check_lap(where, joint, laid, tally)
    elif joint.kind == "slot":
        _check_slot(where, laid, thickness, tally)
    else:
        most = MOST_AIR_MM if joint.kind == "dovetail" else EDGE_MM
        _check_flush(where, laid, most, tally)
        if joint.kind == "dovetail":
            _check_hold(where, laid, tally)


def _check_lap(where: str, joint: Joint, laid: _Laid, tally: Tally) -> None:
    """Check that two laps are the same figure, as long as the map says."""
    if joint.lap_mm is None:
        return
    # What both cover is the ribbon itself, half the lap to either side of the crossing's middle.
    shared = _part_near(_intersection(laid.first, laid.second), laid.centre)
    off = shapely.area(_symmetric_difference(shared, laid.lap))
    tally.measure(
        "lap_mm",
        off / shapely.length(laid.lap),
        EDGE_MM + laid.slack,
        f"{where}: its laps do not lie on one another over {joint.lap_mm:g} mm: {off:.3f} mm² "
        "stand out",
    )


def _check_flush(where: str, laid: _Laid, most: float, tally: Tally) -> None:
    """Check that two pieces lie side by side, without overlap and nearly without a gap."""
    common = shapely.area(_intersection(laid.first, laid.second))
    tally.measure(
        "overlap_mm",
        common / laid.width,
        EDGE_MM + laid.slack,
        f"{where}: its pieces overlap by {common:.3f} mm², and should lie side by side",
    )
    panel = shapely.Polygon(laid.panel[[0, 2, 3, 1]])
    bare = _difference(panel, _union(laid.first, laid.second))
    # The seam: where either piece's edge runs inside the panel.
    inner = shapely.buffer(panel, -EDGE_MM)
    seam = shapely.length(shapely.intersection(shapely.boundary(laid.first), inner))
    air = shapely.area(bare) / max(seam, laid.width / 2.0)
    tally.measure(
        "air_mm",
        air,
        most + laid.slack,
        f"{where}: its pieces stand {air:.3f} mm apart along their seam",
    )


def _check_hold(where: str, laid: _Laid, tally: Tally) -> None:
    """Check that two pieces collide when they are pulled apart along the thread."""
    for angle in _PULLS_DEG:
        turn = np.exp(1j * np.radians(angle)) * complex(*laid.way)
        way = np.array([turn.real, turn.imag])
        held = 0.0
        for pull in _PULLS_MM:
            moved = shapely.transform(laid.second, lambda xy, d=pull * way: xy + d)
            held = max(held, float(shapely.area(_intersection(laid.first, moved))))
        tally.measure(
            "hold_mm2",
            held,
            _HOLD_MM2,
            f"{where}: its pieces can be pulled apart at {angle:g}° to the thread",
            least=True,
        )


def _check_slot(where: str, laid: _Laid, thickness: float | None, tally: Tally) -> None:
    """Check that the first piece's tab goes through the second one's slot, up to its shoulders."""
    if not tally.expect(len(laid.slots) == 1, f"{where}: its second piece has no slot"):
        return
    slot = shapely.Polygon(laid.slots[0])
    if not tally.expect(slot.is_valid and slot.area > 0.0, f"{where}: its slot is not simple"):
        return
    corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(slot))
    steps = np.diff(corners[:3], axis=0)
    sizes = np.hypot(*steps.T)
    width, length = float(sizes.min()), float(sizes.max())
    across = steps[int(np.argmax(sizes))] / length
    if thickness is not None:
        tally.measure(
            "slot_mm", width, thickness, f"{where}: its slot is {width:.3f} mm wide", least=True
        )
    middle = shapely.get_coordinates(slot.centroid)[0]
    ahead = laid.way * width / 2.0

    def breadth(at: Floats) -> float:
        """Return how wide the first piece is along a line across."""
        line = shapely.linestrings([at - laid.width * across, at + laid.width * across])
        return float(shapely.length(_part_near(shapely.intersection(laid.first, line), at)))

    tab = breadth(middle + 1.5 * ahead)
    tally.expect(
        0.0 < tab < length, f"{where}: its tab is {tab:.3f} mm wide, its slot {length:.3f}"
    )
    shoulder = breadth(middle - 3.0 * ahead)
    tally.expect(shoulder > length, f"{where}: it has no shoulders, the tab slips through its slot")
    behind = _half_plane(middle, laid.way, 4.0 * laid.width + length)
    beyond = _part_near(_difference(laid.first, behind), middle)
    out = shapely.area(_difference(beyond, laid.second.buffer(EDGE_MM)))
    tally.expect(
        shapely.area(beyond) > 0.0 and out <= EDGE_MM * laid.width,
        f"{where}: its tab does not lie on the second piece behind the slot",
    )


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
