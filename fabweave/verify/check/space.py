"""Check in the model that the over strand lies outside, on its partner and in its place."""

import numpy as np

from fabweave.verify.crossing_map import Crossing, CrossingMap
from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.development import kind_of, lapped_stations
from fabweave.verify.measure.walks import (
    Panels,
    Pass,
    edge_quads,
    follows_walk,
    measure_panels,
    turns_back,
)
from fabweave.verify.read.glb import Strip
from fabweave.verify.read.job_files import Job, required
from fabweave.verify.read.mesh import LoadedMesh
from fabweave.verify.report import Place, Tally

#: A turning ribbon leaves its triangle, and the triangle's plane, by no more than this.
STRAY_MM = 0.01


def turns_after(step: Pass, mesh: LoadedMesh) -> list[Pass]:
    """Return where a strand turns back between a pass and its next one.

    Each is a boundary side, which it goes along (forward) or against, until it meets an inner one.
    """
    onward = mesh.prev if step.forward else mesh.next
    side = int(onward[mesh.twin[step.side]])
    turns = []
    while mesh.twin[side] < 0:
        turns.append(Pass(side, not step.forward))
        side = int(onward[side])
    return turns


def check_turns(
    strip: Strip, passes: tuple[Pass, ...], mesh: LoadedMesh, tally: Tally, *, turning: bool
) -> None:
    """Check every turn of one thread's ribbon, if threads turn.

    Between two panels with k boundary sides between them the ribbon has equally many rungs for
    each of these, two at least. They lie in the plane of the side's triangle (its ends and the
    centre of its face) and within it, follow one another the way the thread walks, and their
    right ends lie towards the side if it is walked forward, else their left ends.
    """
    place, count = tally.at(f"thread {strip.label}"), len(strip.rungs)
    turns: list[Pass] = []
    rungs, owners = [], []
    for at in np.flatnonzero(turns_back(passes, mesh)).tolist() if turning else ():
        bends = turns_after(passes[at], mesh)
        first = int(strip.exit[at]) + 1
        between = (int(strip.entry[(at + 1) % len(passes)]) - first) % count
        if not place.expect(
            between >= 2 * len(bends) and between % len(bends) == 0,
            f"between its places {at} and {at + 1} it turns at {len(bends)} boundary edges, but "
            f"its ribbon has {between} rungs there",
        ):
            continue
        owners.append(len(turns) + np.repeat(np.arange(len(bends)), between // len(bends)))
        rungs.append((first + np.arange(between)) % count)
        turns += bends
    if not turns:
        return
    owner = np.concatenate(owners)
    sides = np.array([turn.side for turn in turns])[owner]
    sign = np.where([turn.forward for turn in turns], 1.0, -1.0)[owner]
    places, stray = _places(strip.rungs[np.concatenate(rungs)], sides, mesh)
    # Along the side from its start to its end, and across it from the side to the centre.
    along = sign * places[:, :, 0].mean(axis=1)
    inward = sign * (places[:, 1, 1] - places[:, 0, 1])
    backwards = np.concatenate([[False], (np.diff(along) <= 0.0) & (np.diff(owner) == 0)])
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    farthest = np.maximum.reduceat(stray, starts).tolist()
    returns = np.logical_or.reduceat(backwards, starts).tolist()
    outward = (np.minimum.reduceat(inward, starts) > 0.0).tolist()
    for number, turn in enumerate(turns):
        here = place.at(
            f"turn at boundary edge {mesh.corner[turn.side]}-{mesh.corner[mesh.next[turn.side]]}"
        )
        here.at_most("stray_mm", farthest[number], STRAY_MM, "the ribbon leaves its triangle by {}")
        here.expect(not returns[number], "the ribbon does not follow the edge")
        here.expect(outward[number], "the ribbon looks inward, or right and left are exchanged")


def _places(rungs: Floats, sides: Ints, mesh: LoadedMesh) -> tuple[Floats, Floats]:
    """Return where the ends of rungs stand in the triangles of their sides.

    Returns
    -------
    places : (N, 2, 2) float array
        For right and left end: the share of the way along the side, and from it to the centre.
    stray : (N,) float array
        How far a rung reaches out of the triangle or its plane, in millimetres.
    """
    start = mesh.vertices[mesh.corner[sides]]
    along = mesh.vertices[mesh.corner[mesh.next[sides]]] - start
    inward = mesh.centres[mesh.face[sides]] - start
    normal = np.cross(along, inward)
    area = np.linalg.norm(normal, axis=1)
    normal = normal / area[:, None]
    arm = rungs - start[:, None]
    a = np.einsum("ned,nd->ne", np.cross(arm, inward[:, None]), normal) / area[:, None]
    b = np.einsum("nd,ned->ne", normal, np.cross(along[:, None], arm)) / area[:, None]
    # Distances within each of the three borders are shares of the heights over them.
    heights = [area / np.linalg.norm(edge, axis=1) for edge in (inward, along, inward - along)]
    inside = [
        share * height[:, None] for share, height in zip((a, b, 1 - a - b), heights, strict=True)
    ]
    height = np.abs(np.einsum("ned,nd->ne", arm, normal))
    stray = np.max([-part for part in inside] + [height], axis=(0, 2))
    return np.stack((a, b), axis=2), stray


#: Two strands that are to lie on each other are at least this far apart.
LEAST_APART_MM = 1e-3
#: Centres and stated positions agree to this.
CENTRED_MM = 0.01
#: A crossing stands no further from the middle of its edge's quad than this share of the quad.
PLACE_SHARE = 0.2


def check_space(job: Job, tally: Tally) -> None:
    """Check every crossing in the model.

    The two panels look outward at both ends, the over strand's centre stands outside the under
    strand's along the outward normal and nowhere else, as far as both layers (where a joint laps,
    both of its) and the clearance of the settings take; the stated position is midway and at the
    crossing's edge, and both strands run across the edge the way their threads walk. Where threads
    turn back at the boundary, their ribbons follow the boundary edges, each within its own
    triangle.
    """
    plan, mesh = required(job.map), required(job.mesh)
    passes, _ = job.passes
    panels: dict[int, Panels] = {}
    for thread in plan.threads:
        strip = job.strips.get(thread.id)
        if not thread.crossings:
            continue
        if strip is None:
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
    outward: dict[tuple[int, bool], Floats] = {}
    for thread in plan.threads:
        if thread.id in panels:
            for at, key in enumerate(zip(thread.crossings, thread.over, strict=True)):
                centre[key] = panels[thread.id].centre[at]
                outward[key] = panels[thread.id].outward[at].sum(axis=0)
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
    normal = quads.normal
    if job.options.get("strips") == "straight":
        # These lie where they rest, and flat on one another.
        normal = np.array([outward[crossing.id, True] for crossing in both])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
    apart = np.einsum("ij,ij->i", over - under, normal)
    beside = np.linalg.norm(over - under - apart[:, None] * normal, axis=1)
    off = np.linalg.norm((over + under) / 2.0 - stated, axis=1)
    astray = np.linalg.norm(stated - quads.middle, axis=1)
    doubled = _doubled(job, plan)
    for at, crossing in enumerate(both):
        place = tally.at(f"crossing {crossing.id}")
        place.at_least(
            "apart_mm",
            apart[at],
            LEAST_APART_MM,
            "the over strand stands {} outside the under strand",
        )
        wanted = _layers_mm(job, crossing, doubled)
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


def _doubled(job: Job, plan: CrossingMap) -> set[tuple[int, bool]]:
    """Return at which crossings the strand over, or the one under, has two layers."""
    doubled = set()
    for joint in plan.joints:
        begins = job.developments.get(joint.pieces[1])
        if kind_of(joint).laps and begins is not None:
            stations = plan.piece[joint.pieces[1]].stations
            lapped = stations[: 1 + lapped_stations(begins, joint)]
            doubled |= {(station.crossing, station.over) for station in lapped}
    return doubled


def _layers_mm(job: Job, crossing: Crossing, doubled: set[tuple[int, bool]]) -> float:
    """Return how far apart the middles of two strands must be; 0 if the settings do not say.

    Half of what lies above, half of what lies below (twice its thickness where it laps), and the
    clearance.
    """
    above, below = (
        job.supplies[strand.thread].thickness_mm for strand in (crossing.over, crossing.under)
    )
    if above is None or below is None:
        return 0.0
    layers = [1 + ((crossing.id, over) in doubled) for over in (True, False)]
    return (above * layers[0] + below * layers[1]) / 2.0 + (job.clearance_mm or 0.0)


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
    facing = np.einsum("ikj,ij->ik", panels.outward, quads.normal)
    for at in np.flatnonzero((facing <= 0.0).any(axis=1)):
        place.at(f"crossing {crossings[at]}").fail(
            "its panel looks inward, or right and left are exchanged"
        )
    for at in np.flatnonzero(~follows_walk(panels, passes, mesh)):
        place.at(f"crossing {crossings[at]}").fail(
            "the ribbon crosses the edge another way than the thread walks"
        )
