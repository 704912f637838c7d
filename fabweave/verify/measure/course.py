"""Measure in the model which way ribbons run across the edges of the mesh."""

from dataclasses import dataclass

import numpy as np

from fabweave.verify.drawing import Flags, Floats, Ints
from fabweave.verify.measure.walks import LoadedMesh, Pass
from fabweave.verify.read.glb import Strip


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


def _diagonals(mesh: LoadedMesh, sides: Ints) -> tuple[tuple[Floats, Floats], ...]:
    """Return both ends of each edge, and the centres of the face on this side and beyond."""
    return (
        (mesh.vertices[mesh.corner[sides]], mesh.vertices[mesh.corner[mesh.next[sides]]]),
        (mesh.centres[mesh.face[sides]], mesh.centres[mesh.face[mesh.twin[sides]]]),
    )


def edge_quads(mesh: LoadedMesh, sides: Ints) -> EdgeQuads:
    """Return normals, middles and sizes for sides of inner edges.

    The middle is where the ways of the two strands meet, seen along the normal, in the plane
    through the mean of the quad's corners.
    """
    (tail, head), (here, there) = _diagonals(mesh, sides)
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
        size=np.linalg.norm(head - tail, axis=1) + np.linalg.norm(here - there, axis=1),
    )


def follows_walk(panels: Panels, passes: tuple[Pass, ...], mesh: LoadedMesh) -> Flags:
    """Say at which crossings a ribbon runs across the edge as the passes of a walk do.

    It has to run to the face beyond; and from near the side's start towards its end, or the other
    way. Where on the edge it does so, and how askew, does not matter.
    """
    sides = np.array([step.side for step in passes], dtype=np.int64)
    forward = np.array([step.forward for step in passes], dtype=np.bool_)
    (tail, head), (here, there) = _diagonals(mesh, sides)
    edge, beyond = head - tail, there - here
    area = np.cross(edge, beyond)
    # Shares of both directions in the panel's, times a positive factor.
    along_edge = np.einsum("ij,ij->i", np.cross(panels.along, beyond), area)
    to_beyond = np.einsum("ij,ij->i", np.cross(edge, panels.along), area)
    return (to_beyond > 0.0) & np.where(forward, along_edge > 0.0, along_edge < 0.0)
