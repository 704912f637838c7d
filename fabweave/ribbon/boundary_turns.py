"""Lead ribbons round the boundary edges where their threads turn back."""

import numpy as np

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.errors import CannotMakeError, InputError
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.ribbon.width import WidthRule, shares_of
from fabweave.weave.threads import Threads

#: Rungs of a turn: where it begins, its middle, and where it ends.
RUNGS_A_TURN = 3

#: At the rim a ribbon keeps this share of the distance that it keeps from vertices and centres.
_RIM_SHARE = 0.25


def turn_rungs(
    mesh: PolyMesh,
    halfedges: Halfedges,
    threads: Threads,
    *,
    length: float,
    width: WidthRule | FloatArray,
    narrowing: FloatArray,
    portals: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Return the rungs of every turn: a planar panel in the half-quad of its boundary edge.

    A boundary edge owns the triangle of its end vertices and the centre of its face. Between its
    two portals, the segments from a vertex to the centre, no other strand passes. The panel lies
    in the triangle's plane, midway between over and under; its rails run along the edge, and its
    rungs point to the centre. Towards the centre it keeps the distance that all ribbons keep;
    towards the edge it is as wide as the ribbon that arrives, or as the triangle has room for.

    Parameters
    ----------
    mesh, halfedges, threads
        A mesh, its connectivity, and threads with turns.
    length : float
        Relative length of crossing panels, as in
        :func:`~fabweave.ribbon.project.project_ribbons`.
    width : WidthRule or (P,) float array
        How wide ribbons are.
    narrowing : (P,) float array
        Factor on the width at each pass; a turn has that of the pass before it.
    portals : (H,) float array, optional
        Where the middle of the strand crosses each portal, from the vertex to the centre.

    Returns
    -------
    right, left : (B, 3, 3) float arrays
        For each turn the ends of its three rungs, in walking order.

    Raises
    ------
    InputError
        If a half-quad has no area.
    """
    edge, forward = threads.turn_halfedge, threads.turn_forward[:, None]
    centre = face_centres(mesh)[halfedges.face[edge]]
    tail = mesh.vertices[halfedges.tail[edge]]
    head = mesh.vertices[halfedges.head[edge]]
    start, end = np.where(forward, tail, head), np.where(forward, head, tail)
    base = np.linalg.norm(head - tail, axis=1)
    arms = np.linalg.norm(tail - centre, axis=1) + np.linalg.norm(head - centre, axis=1)
    area = np.linalg.norm(np.cross(tail - centre, head - centre), axis=1)
    _require_area(halfedges, edge, area, base + arms)

    # The room across a turn is that of the portals by which the strand comes and goes.
    before = threads.turn_pass
    share = narrowing[before] * shares_of(width, before, arms / 2, most=length)
    middle = np.full(len(edge), 0.5)
    if portals is not None:
        middle = 1.0 - (portals[edge] + portals[halfedges.prev[edge]]) / 2
    share *= 2 * np.minimum(middle, 1.0 - middle)
    inner = middle - share / 2
    # As wide across the edge as the arriving ribbon is along its portals.
    outer = np.minimum(inner + share * arms * base / (2 * area), 1 - _RIM_SHARE * inner)
    rungs = []
    for u in (0.5 - length / 2, 0.5, 0.5 + length / 2):
        ray = (1 - u) * start + u * end - centre
        rungs.append((centre + outer[:, None] * ray, centre + inner[:, None] * ray))
    rim, inside = (np.stack(side, axis=1) for side in zip(*rungs, strict=True))
    # Forward along its half-edge, a strand has the edge to its right.
    outward = forward[:, :, None]
    return np.where(outward, rim, inside), np.where(outward, inside, rim)


def _require_area(
    halfedges: Halfedges, edge: IntArray, area: FloatArray, reach: FloatArray
) -> None:
    """Raise InputError if a boundary edge's half-quad has no area to turn in."""
    flat = np.flatnonzero(~(area > 1e-9 * reach**2))
    if len(flat):
        tails, heads = halfedges.tail[edge[flat[:4]]], halfedges.head[edge[flat[:4]]]
        pairs = ", ".join(f"{a}-{b}" for a, b in zip(tails, heads, strict=True))
        raise InputError(
            agree(len(flat), "{n} turn[ has|s have] no room at the boundary (")
            + agree(len(flat), "edge[|s] between vertices ")
            + f"{pairs}): the centre of the face lies on the edge; move its vertices apart, or use "
            "--boundary end"
        )


def require_no_loop(threads: Threads, halfedges: Halfedges) -> None:
    """Raise CannotMakeError where a thread turns right round a face and meets itself at once.

    A face that hangs by one edge only is such a place: the ribbon comes in across that edge and
    goes out across it, and in the plane its two ends lie on one another.
    """
    following = np.arange(1, len(threads.crossing) + 1)
    crossed = threads.woven
    following[threads.offsets[1:][crossed] - 1] = threads.offsets[:-1][crossed]
    before = np.unique(threads.turn_pass)
    loops = before[threads.crossing[before] == threads.crossing[following[before]]]
    if len(loops):
        faces = np.sort(halfedges.face[halfedges.twin[threads.halfedge[loops]]])
        names = ", ".join(map(str, faces[:6].tolist())) + (", …" if len(faces) > 6 else "")
        raise CannotMakeError(
            f"{agree(len(faces), '{n} [face hangs|faces hang]')} on by a single edge "
            f"({agree(len(faces), '[face|faces]')} {names}); a ribbon that turns around such a "
            "face overlaps itself and cannot be cut flat: remove or refine these faces, or use "
            "--boundary end"
        )
