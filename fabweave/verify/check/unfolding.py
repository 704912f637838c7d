"""Check that pieces are developments of the model."""

import numpy as np
import numpy.typing as npt
import shapely

from fabweave.verify.crossing_map import Piece
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.development import Development, Reach, reaches
from fabweave.verify.measure.geometry import farthest
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.report import Place, Tally

STATION_MM = 0.02
OUTLINE_MM = 0.12
LENGTH_MM = 0.02
#: Less than half of the least play of a fastener, which is 0.1 mm: two pieces meet there.
FIT_MM = 0.041


def check_unfolding(job: Job, tally: Tally) -> None:
    """Check stations, lengths and outlines of every piece against the unfolded model."""
    plan, developments = required(job.map), job.developments
    for piece in plan.pieces:
        development = developments.get(piece.id)
        if development is None:
            tally.fail(
                f"piece {piece.id} is not unfolded: its stations are no run of its thread, or the "
                "model has not that thread's panels"
            )
            continue
        _check_piece(piece, development, reaches(plan, piece), tally.at(f"piece {piece.id}"))


def _check_piece(
    piece: Piece, development: Development, ends: tuple[Reach, Reach], place: Place
) -> None:
    """Check one piece against its development; what is fitted may be as far off as is said."""
    stations = piece.points
    place.at_most("fitted_mm", piece.fitted_mm, FIT_MM, "it is fitted to others by {}")
    slack_mm = development.slack_mm + piece.fitted_mm
    place.at_most(
        "station_mm",
        farthest(development.stations, stations),
        STATION_MM + slack_mm,
        "a station stands {} from where the unfolded model has it",
    )
    if len(stations) > 1:
        stated, true = (np.diff(points, axis=0) for points in (stations, development.stations))
        change = np.hypot(*stated.T) - np.hypot(*true.T)
        worst = int(np.argmax(np.abs(change)))
        place.at_most(
            "length_mm",
            abs(float(change[worst])),
            LENGTH_MM + slack_mm + piece.fitted_mm,
            f"stations {worst} and {worst + 1} are {{}} "
            + ("further apart" if change[worst] > 0.0 else "nearer to each other")
            + " than in the model",
        )
    rails = development.outline
    border, ring = shapely.LinearRing(piece.outline), shapely.LinearRing(rails)
    wanted, there = _along(rails), _along(piece.outline)
    outside = np.concatenate([shapely.distance(wanted, border), shapely.distance(there, ring)])
    # Where a joint shapes an end, its outline stays in the ribbon; how it fits is the joint's.
    shaped = [
        shapely.Polygon(development.panels[at][[0, 2, 3, 1]])
        for at, end in zip((0, -1), ends, strict=True)
        if end.shaped
    ]
    if shaped:
        whole = shapely.union_all(_facets(development.window))
        points = np.concatenate([wanted, there])
        free = shapely.dwithin(points, shapely.union_all(shaped), OUTLINE_MM)
        outside[free] = shapely.distance(points[free], whole)
    place.at_most(
        "outline_mm",
        float(np.max(outside)),
        OUTLINE_MM + slack_mm,
        "its outline leaves the unfolded ribbon by {}",
    )


def _along(ring: Floats) -> npt.NDArray[np.object_]:
    """Return the vertices of a ring and the middles of its sides."""
    shares = np.array([0.0, 0.5])[:, None, None]
    steps = np.roll(ring, -1, axis=0) - ring
    return np.asarray(shapely.points((ring + shares * steps).reshape(-1, 2)))


def _facets(rungs: Floats) -> npt.NDArray[np.object_]:
    """Return the quads between rungs as polygons: a border would part what comes over itself."""
    quads = np.stack([rungs[:-1, 0], rungs[1:, 0], rungs[1:, 1], rungs[:-1, 1]], axis=1)
    return shapely.make_valid(shapely.polygons(quads))
