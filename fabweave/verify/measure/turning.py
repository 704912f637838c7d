"""Check in the model that ribbons turn back at the boundary within their own triangles."""

from dataclasses import dataclass

import numpy as np

from fabweave.verify.drawing import Floats, Ints
from fabweave.verify.measure.walks import LoadedMesh, Pass
from fabweave.verify.read.glb import Strip
from fabweave.verify.statement import Tally

#: A turning ribbon leaves its triangle, and the triangle's plane, by no more than this.
STRAY_MM = 0.01


@dataclass(frozen=True)
class Turn:
    """A strand turning back at a boundary side, along it (forward) or against it."""

    side: int
    forward: bool


def turns_after(step: Pass, mesh: LoadedMesh) -> list[Turn]:
    """Return where a strand turns back between a pass and its next one.

    Having crossed a side forward, a strand goes on to the side before that in the face beyond,
    and otherwise to the one after; it passes boundary sides until it meets an inner one.
    """
    onward = mesh.prev if step.forward else mesh.next
    side = int(onward[mesh.twin[step.side]])
    turns = []
    while mesh.twin[side] < 0:
        turns.append(Turn(side, not step.forward))
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
    turns: list[Turn] = []
    rungs, owners = [], []
    for at in _places_before_turns(passes, mesh) if turning else ():
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


def _places_before_turns(passes: tuple[Pass, ...], mesh: LoadedMesh) -> list[int]:
    """Return the places along a thread after which it turns."""
    beyond = mesh.twin[np.array([step.side for step in passes], dtype=np.int64)]
    forward = np.array([step.forward for step in passes], dtype=np.bool_)
    onward = np.where(forward, mesh.prev[beyond], mesh.next[beyond])
    return np.asarray(np.flatnonzero(mesh.twin[onward] < 0)).tolist()


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
