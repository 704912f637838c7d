"""Measure in the model which way ribbons run across the edges of the mesh."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.walks import LoadedMesh, Pass
from fabweave.verify.read.glb import Strip

Flags: TypeAlias = npt.NDArray[np.bool_]


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
    edge: Floats
    over: Floats
    size: Floats


def edge_quads(mesh: LoadedMesh, sides: Ints) -> EdgeQuads:
    """Return normals, middles, edge vectors and crosswise vectors for sides of inner edges."""
    tail, head = mesh.vertices[mesh.corner[sides]], mesh.vertices[mesh.corner[mesh.next[sides]]]
    here, there = mesh.centres[mesh.face[sides]], mesh.centres[mesh.face[mesh.twin[sides]]]
    area = np.cross(head - tail, here - there)
    size = np.linalg.norm(area, axis=1)
    return EdgeQuads(
        normal=area / np.maximum(size, 1e-300)[:, None],
        middle=(tail + head + here + there) / 4.0,
        edge=head - tail,
        over=there - here,
        size=np.linalg.norm(head - tail, axis=1) + np.linalg.norm(here - there, axis=1),
    )


def follows_walk(panels: Panels, passes: tuple[Pass, ...], mesh: LoadedMesh) -> Flags:
    """Say at which crossings a ribbon runs across the edge as the passes of a walk do.

    From near the side's start a strand crosses towards its end, and otherwise backwards.
    """
    quads = edge_quads(mesh, np.array([step.side for step in passes], dtype=np.int64))
    sign = np.where([step.forward for step in passes], 1.0, -1.0)[:, None]
    own, other = quads.over + sign * quads.edge, quads.over - sign * quads.edge
    agrees = np.einsum("ij,ij->i", panels.along, own) / np.linalg.norm(own, axis=1)
    strays = np.einsum("ij,ij->i", panels.along, other) / np.linalg.norm(other, axis=1)
    return (agrees > 0.0) & (agrees > np.abs(strays))
