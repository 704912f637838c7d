"""Check in the model that the over strand lies outside, on its partner and in its place."""

from dataclasses import dataclass

import numpy as np

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.loading import Job
from fabweave.verify.read_glb import Strip
from fabweave.verify.report import Tally
from fabweave.verify.walks import Pass, WovenMesh

#: Two strands that are to lie on each other are at least this far apart.
LEAST_APART_MM = 1e-3
#: Centres and stated positions agree to this.
CENTRED_MM = 0.01
#: A crossing stands no further from the middle of its edge's quad than this share of the quad.
PLACE_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class _Panels:
    """The crossing panels of one thread: middle, outward area vector and walking direction."""

    centre: Floats
    outward: Floats
    along: Floats


def _panels(strip: Strip) -> _Panels:
    """Measure the crossing panels of a strip."""
    start, end = strip.rungs[strip.entry], strip.rungs[strip.exit]
    along = (end - start).mean(axis=1)
    across = (start[:, 1] - start[:, 0] + end[:, 1] - end[:, 0]) / 2.0
    return _Panels((start + end).mean(axis=1) / 2.0, np.cross(along, across), along)


@dataclass(frozen=True, eq=False)
class _Quad:
    """What the mesh says about a crossing's edge, seen from one side of it."""

    normal: Floats
    middle: Floats
    edge: Floats
    over: Floats
    size: Floats


def _quads(mesh: WovenMesh, sides: Ints) -> _Quad:
    """Return normals, middles, edge vectors and crosswise vectors for sides of inner edges."""
    tail, head = mesh.vertices[mesh.corner[sides]], mesh.vertices[mesh.corner[mesh.next[sides]]]
    here, there = mesh.centres[mesh.face[sides]], mesh.centres[mesh.face[mesh.twin[sides]]]
    area = np.cross(head - tail, here - there)
    size = np.linalg.norm(area, axis=1)
    return _Quad(
        normal=area / np.maximum(size, 1e-300)[:, None],
        middle=(tail + head + here + there) / 4.0,
        edge=head - tail,
        over=there - here,
        size=np.linalg.norm(head - tail, axis=1) + np.linalg.norm(here - there, axis=1),
    )


def check_space(job: Job, tally: Tally) -> None:
    """Check every crossing in the model.

    The two panels look outward, the over strand's centre stands outside the under strand's along
    the outward normal and nowhere else, the stated position is midway and at the crossing's edge,
    and both strands run across the edge the way their threads walk.
    """
    plan, mesh, model = job.map, job.mesh, job.model
    if plan is None or mesh is None or model is None:
        return
    passes, _ = job.passes
    panels: dict[int, _Panels] = {}
    for thread in plan.threads:
        strip = model.get(thread.label)
        if not thread.crossings:
            continue
        if strip is None or len(strip.entry) != len(thread.crossings):
            tally.fail(f"thread {thread.label} is not checked: the model has not its panels")
            continue
        panels[thread.id] = _panels(strip)
        if thread.id in passes:
            _check_course(
                thread.label, thread.crossings, panels[thread.id], passes[thread.id], mesh, tally
            )
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
    quads = _quads(mesh, np.array([edges[crossing.id] for crossing in both]))
    apart = np.einsum("ij,ij->i", over - under, quads.normal)
    beside = np.linalg.norm(over - under - apart[:, None] * quads.normal, axis=1)
    off = np.linalg.norm((over + under) / 2.0 - stated, axis=1)
    astray = np.linalg.norm(stated - quads.middle, axis=1)
    for at, crossing in enumerate(both):
        where = f"crossing {crossing.id}"
        tally.measure(
            "apart_mm",
            apart[at],
            LEAST_APART_MM,
            f"{where}: the over strand stands {apart[at]:.4f} mm outside the under strand",
            least=True,
        )
        tally.measure(
            "off_centre_mm",
            beside[at],
            CENTRED_MM,
            f"{where}: the strands' centres are {beside[at]:.4f} mm beside each other",
        )
        tally.measure(
            "off_position_mm",
            off[at],
            CENTRED_MM,
            f"{where}: the strands meet {off[at]:.4f} mm from the stated position",
        )
        tally.expect(
            astray[at] <= PLACE_SHARE * quads.size[at],
            f"{where}: stated {astray[at]:.3f} mm from the middle of edge {crossing.edge}",
        )


def _check_course(
    label: str,
    crossings: tuple[int, ...],
    panels: _Panels,
    passes: tuple[Pass, ...],
    mesh: WovenMesh,
    tally: Tally,
) -> None:
    """Check that a strand's panels look outward and run across their edges as its thread walks."""
    quads = _quads(mesh, np.array([step.side for step in passes]))
    inward = np.flatnonzero(np.einsum("ij,ij->i", panels.outward, quads.normal) <= 0.0)
    tally.count(len(passes))
    for at in inward:
        tally.fail(
            f"thread {label}, crossing {crossings[at]}: its panel looks inward, or right and left "
            "are exchanged"
        )
    # From near the side's start a strand crosses towards its end, and otherwise backwards.
    sign = np.where([step.forward for step in passes], 1.0, -1.0)[:, None]
    own, other = quads.over + sign * quads.edge, quads.over - sign * quads.edge
    agrees = np.einsum("ij,ij->i", panels.along, own) / np.linalg.norm(own, axis=1)
    strays = np.einsum("ij,ij->i", panels.along, other) / np.linalg.norm(other, axis=1)
    for at in np.flatnonzero(~((agrees > 0.0) & (agrees > np.abs(strays)))):
        tally.fail(
            f"thread {label}, crossing {crossings[at]}: the ribbon crosses the edge another way "
            "than the thread walks"
        )
