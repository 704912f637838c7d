"""Measure in the model which way ribbons run across the edges of the mesh."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.walks import LoadedMesh, Pass
from fabweave.verify.read.glb import Strip

Flags: TypeAlias = npt.NDArray[np.bool_]

#: Of two ways that a strand may take across an edge, it goes along its own by so much of the other
#: at least: on slanting quads they differ by a few degrees, and panels are no truer than that.
_OWN_SHARE = 0.98


@dataclass(frozen=True, eq=False)
class Panels:
    """The crossing panels of one thread: middle, outward area vector and walking direction."""

    centre: Floats
    outward: Floats
    along: Floats


def measure_panels(strip: Strip) -> Panels:
    """Measure the crossing panels of a strip."""
    start, end = strip.rungs[strip.entry], strip.rungs[strip.exit]
    along = (end - start).mean(axis=1)
    across = (start[:, 1] - start[:, 0] + end[:, 1] - end[:, 0]) / 2.0
    return Panels((start + end).mean(axis=1) / 2.0, np.cross(along, across), along)


@dataclass(frozen=True, eq=False)
class EdgeQuads:
    """What the mesh says about a crossing's edge, seen from one side of it."""

    normal: Floats
    middle: Floats
    #: The ways of the strand that comes from near the side's start, and of the one from its end.
    forward: Floats
    backward: Floats
    size: Floats


def portal_points(mesh: LoadedMesh, sides: Ints) -> Floats:
    """Return where strands pass between the end of sides and the centres of their faces.

    That is half way; or, as the course of the mesh says, where the line between the middles of the
    two sides at that vertex does, but in the middle three fifths.
    """
    vertex = mesh.vertices[mesh.corner[mesh.next[sides]]]
    centre = mesh.centres[mesh.face[sides]]
    before = mesh.vertices[mesh.corner[sides]] - vertex
    after = mesh.vertices[mesh.corner[mesh.next[mesh.next[sides]]]] - vertex
    # The centre in terms of both half sides, and where the sum of such terms is 1.
    halves = np.stack([before, after], axis=2) / 2.0
    terms = np.linalg.pinv(halves) @ (centre - vertex)[:, :, None]
    total = terms.sum(axis=(1, 2))
    flat = np.linalg.norm(np.cross(before, after), axis=1) ** 2 <= 1e-9 * (
        (before**2).sum(axis=1) * (after**2).sum(axis=1)
    )
    share = np.where(flat | (total <= 0.0), 0.5, 1.0 / np.where(total > 0.0, total, 1.0))
    share = np.clip(share, 0.2, 0.8)
    if mesh.course == "projection":
        share[:] = 0.5
    elif mesh.course != "straight":
        share[np.bincount(mesh.face)[mesh.face[sides]] == 4] = 0.5
    return np.asarray(vertex + share[:, None] * (centre - vertex))


def edge_quads(mesh: LoadedMesh, sides: Ints) -> EdgeQuads:
    """Return normals, middles and the ways of both strands for sides of inner edges.

    The middle is where the two ways meet, seen along the normal, in the plane through the mean of
    the quad's corners.
    """
    tail, head = mesh.vertices[mesh.corner[sides]], mesh.vertices[mesh.corner[mesh.next[sides]]]
    here, there = mesh.centres[mesh.face[sides]], mesh.centres[mesh.face[mesh.twin[sides]]]
    area = np.cross(head - tail, here - there)
    size = np.linalg.norm(area, axis=1)
    beyond = mesh.twin[sides]
    enters, leaves = portal_points(mesh, mesh.prev[sides]), portal_points(mesh, mesh.prev[beyond])
    comes, goes = portal_points(mesh, sides), portal_points(mesh, beyond)
    normal = area / np.maximum(size, 1e-300)[:, None]
    forward, backward = leaves - enters, goes - comes
    # Cramer's rule for enters + s forward = comes + t backward, in the plane.
    over = np.einsum("ij,ij->i", np.cross(forward, backward), normal)
    met = np.abs(over) > 1e-12 * np.maximum(size, 1e-300)
    safe, between = np.where(met, over, 1.0), comes - enters
    share = np.where(met, np.einsum("ij,ij->i", np.cross(between, backward), normal) / safe, 0.5)
    meeting = enters + share[:, None] * forward
    height = np.einsum("ij,ij->i", (tail + head + here + there) / 4.0 - meeting, normal)
    return EdgeQuads(
        normal=normal,
        middle=meeting + height[:, None] * normal,
        forward=forward,
        backward=backward,
        size=np.linalg.norm(head - tail, axis=1) + np.linalg.norm(here - there, axis=1),
    )


def follows_walk(panels: Panels, passes: tuple[Pass, ...], mesh: LoadedMesh) -> Flags:
    """Say at which crossings a ribbon runs across the edge as the passes of a walk do.

    From near the side's start a strand crosses towards its end, and otherwise backwards. Where both
    ways are nearly the same, either is right.
    """
    quads = edge_quads(mesh, np.array([step.side for step in passes], dtype=np.int64))
    forward = np.array([step.forward for step in passes], dtype=np.bool_)[:, None]
    own = np.where(forward, quads.forward, quads.backward)
    other = np.where(forward, quads.backward, quads.forward)
    agrees = np.einsum("ij,ij->i", panels.along, own) / np.linalg.norm(own, axis=1)
    strays = np.einsum("ij,ij->i", panels.along, other) / np.linalg.norm(other, axis=1)
    return (agrees > 0.0) & (agrees > _OWN_SHARE * np.abs(strays))
