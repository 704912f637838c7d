"""Check in the model that the over strand lies outside, on its partner and in its place."""

import numpy as np

from fabweave.verify.crossing_map import Crossing, CrossingMap
from fabweave.verify.drawing import Floats
from fabweave.verify.measure.course import Panels, edge_quads, follows_walk, measure_panels
from fabweave.verify.measure.ends import kind_of
from fabweave.verify.measure.turning import check_turns
from fabweave.verify.measure.walks import LoadedMesh, Pass
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.statement import Place, Tally

#: Two strands that are to lie on each other are at least this far apart.
LEAST_APART_MM = 1e-3
#: Centres and stated positions agree to this.
CENTRED_MM = 0.01
#: A crossing stands no further from the middle of its edge's quad than this share of the quad.
PLACE_SHARE = 0.2


def check_space(job: Job, tally: Tally) -> None:
    """Check every crossing in the model.

    The two panels look outward, the over strand's centre stands outside the under strand's along
    the outward normal and nowhere else, as far as both layers (where a joint laps, both of its)
    and the clearance of the settings take; the stated position is midway and at the crossing's
    edge, and both strands run across the edge the way their threads walk. Where threads turn back
    at the boundary, their ribbons follow the boundary edges, each within its own triangle.
    """
    plan, mesh, model = required(job.map), required(job.mesh), required(job.model)
    passes, _ = job.passes
    panels: dict[int, Panels] = {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if not thread.crossings:
            continue
        if strip is None or len(strip.entry) != len(thread.crossings):
            tally.fail(f"thread {thread.label} is not checked: the model has not its panels")
            continue
        panels[thread.id] = measure_panels(strip)
        if thread.id in passes:
            walk = passes[thread.id]
            place = tally.at(f"thread {thread.label}")
            _check_course(thread.crossings, panels[thread.id], walk, mesh, place)
            check_turns(strip, walk, mesh, tally, turning=job.boundary == "turn")
        else:
            tally.fail(f"thread {thread.label} is not checked: it is no walk of the mesh")

    centre: dict[tuple[int, bool], Floats] = {}
    for thread in plan.threads:
        if thread.id in panels:
            for at, key in enumerate(zip(thread.crossings, thread.over, strict=True)):
                centre[key] = panels[thread.id].centre[at]
    edges = job.edges
    both = [
        crossing
        for crossing in plan.crossings
        if crossing.id in edges and (crossing.id, True) in centre and (crossing.id, False) in centre
    ]
    if len(both) < len(plan.crossings):
        tally.fail(f"{len(plan.crossings) - len(both)} crossings have not both strands in space")
    if not both:
        return
    over = np.array([centre[crossing.id, True] for crossing in both])
    under = np.array([centre[crossing.id, False] for crossing in both])
    stated = np.array([crossing.position for crossing in both])
    quads = edge_quads(mesh, np.array([edges[crossing.id] for crossing in both]))
    apart = np.einsum("ij,ij->i", over - under, quads.normal)
    beside = np.linalg.norm(over - under - apart[:, None] * quads.normal, axis=1)
    off = np.linalg.norm((over + under) / 2.0 - stated, axis=1)
    astray = np.linalg.norm(stated - quads.middle, axis=1)
    for at, crossing in enumerate(both):
        place = tally.at(f"crossing {crossing.id}")
        place.at_least(
            "apart_mm",
            apart[at],
            LEAST_APART_MM,
            "the over strand stands {} outside the under strand",
        )
        wanted = _layers_mm(job, plan, crossing)
        place.at_least(
            "air_mm",
            apart[at] - wanted,
            -CENTRED_MM,
            f"between the strands' layers, which take {wanted:.4f} mm from middle to middle, there "
            "are {}",
        )
        place.at_most(
            "off_centre_mm", beside[at], CENTRED_MM, "the strands' centres are {} beside each other"
        )
        place.at_most(
            "off_position_mm", off[at], CENTRED_MM, "the strands meet {} from the stated position"
        )
        place.expect(
            astray[at] <= PLACE_SHARE * quads.size[at],
            f"it is stated {astray[at]:.3f} mm from the middle of edge {crossing.edge}",
        )


def _layers_mm(job: Job, plan: CrossingMap, crossing: Crossing) -> float:
    """Return how far apart the middles of two strands must be; 0 if the settings do not say.

    Half of the strand above, half of what lies below (twice its thickness where it laps), and the
    clearance.
    """
    above, below = (
        job.supplies[strand.thread].thickness_mm for strand in (crossing.over, crossing.under)
    )
    if above is None or below is None:
        return 0.0
    station = plan.piece[crossing.under.piece].stations[crossing.under.station]
    joint = None if station.joint is None else plan.joint.get(station.joint)
    lapped = joint is not None and kind_of(joint).laps
    return (above + below * (2 if lapped else 1)) / 2.0 + (job.clearance_mm or 0.0)


def _check_course(
    crossings: tuple[int, ...],
    panels: Panels,
    passes: tuple[Pass, ...],
    mesh: LoadedMesh,
    place: Place,
) -> None:
    """Check that a strand's panels look outward and run across their edges as its thread walks."""
    quads = edge_quads(mesh, np.array([step.side for step in passes]))
    place.count(len(passes))
    for at in np.flatnonzero(np.einsum("ij,ij->i", panels.outward, quads.normal) <= 0.0):
        place.at(f"crossing {crossings[at]}").fail(
            "its panel looks inward, or right and left are exchanged"
        )
    for at in np.flatnonzero(~follows_walk(panels, passes, mesh)):
        place.at(f"crossing {crossings[at]}").fail(
            "the ribbon crosses the edge another way than the thread walks"
        )
