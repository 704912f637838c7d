"""Check that pieces are developments of the model, and that joined tabs superpose."""

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.check_ribbons import check_ribbon_figures
from fabweave.verify.crossing_map import Piece
from fabweave.verify.developing import Developed
from fabweave.verify.drawing import Floats
from fabweave.verify.geometry import farthest, fit_motion
from fabweave.verify.loading import Job
from fabweave.verify.report import Tally

STATION_MM = 0.02
OUTLINE_MM = 0.12
LENGTH_MM = 0.02
HOLE_MM = 0.01


def check_unfolding(job: Job, tally: Tally) -> None:
    """Check stations, lengths and outlines of every piece against the unfolded model.

    The figures that are stated of whole ribbons are checked, too.
    """
    plan = job.map
    if plan is None or job.model is None:
        return
    developed = job.developed
    for piece in plan.pieces:
        own = developed.get(piece.id)
        if own is None:
            tally.fail(
                f"piece {piece.id} is not unfolded: its stations are no run of its thread, or the "
                "model has not that thread's panels"
            )
            continue
        _check_piece(piece, own, tally)
    check_ribbon_figures(job, tally)


def _check_piece(piece: Piece, own: Developed, tally: Tally) -> None:
    """Check one piece against its development."""
    where = f"piece {piece.id}"
    stations = np.array([(station.x, station.y) for station in piece.stations])
    off = farthest(own.stations, stations)
    tally.measure(
        "station_mm",
        off,
        STATION_MM + own.slack_mm,
        f"{where}: a station stands {off:.4f} mm from where the unfolded model has it",
    )
    if len(stations) > 1:
        change = np.hypot(*np.diff(stations, axis=0).T) - np.hypot(*np.diff(own.stations, axis=0).T)
        worst = int(np.argmax(np.abs(change)))
        tally.measure(
            "length_mm",
            abs(float(change[worst])),
            LENGTH_MM + own.slack_mm,
            f"{where}: stations {worst} and {worst + 1} are {change[worst]:+.4f} mm further apart "
            "than in the model",
        )
    rails = own.outline
    border, ring = shapely.LinearRing(piece.outline), shapely.LinearRing(rails)
    out = float(np.max(shapely.distance(_along(rails), border)))
    back = float(np.max(shapely.distance(_along(piece.outline), ring)))
    tally.measure(
        "outline_mm",
        max(out, back),
        OUTLINE_MM + own.slack_mm,
        f"{where}: its outline leaves the unfolded ribbon by {max(out, back):.4f} mm",
    )


def _along(ring: Floats) -> npt.NDArray[np.object_]:
    """Return the vertices of a ring and the middles of its sides."""
    shares = np.array([0.0, 0.5])[:, None, None]
    steps = np.roll(ring, -1, axis=0) - ring
    return np.asarray(shapely.points((ring + shares * steps).reshape(-1, 2)))


def check_joints(job: Job, tally: Tally) -> None:
    """Check that holes coincide when the two copies of a joint's panel are superposed."""
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
        holes = joint.holes
        stations = (plan.piece[joint.pieces[0]].stations[-1],
                    plan.piece[joint.pieces[1]].stations[0])  # fmt: skip
        if stations[0].hole_mm is not None:
            # The station's own hole goes through both tabs, listed or not.
            pair = [[[station.x, station.y] for station in stations]]
            holes = np.concatenate([holes, np.array(pair)])
        if len(holes):
            off = np.hypot(*(motion.apply(holes[:, 1]) - holes[:, 0]).T)
            worst = int(np.argmax(off))
            tally.measure(
                "hole_mm",
                float(off[worst]),
                HOLE_MM + slack,
                f"{where}: hole {worst} is {off[worst]:.4f} mm off its partner",
            )
