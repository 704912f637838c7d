"""Put rings around limbs that a remesher left out and a fit drew out of a few quads."""

from collections.abc import Callable

import numpy as np

from fabweave.core.arrays import BoolArray, FloatArray, flags
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.one_rings import sum_at
from fabweave.mesh.polymesh import PolyMesh
from fabweave.mesh.remesh.remeshed import check_remeshed, edge_lengths
from fabweave.mesh.topology import label_links

#: An edge inside is long beyond so many medians: room for two rows. Beyond so many it is a spike
#: (remeshers aim at edges of one length: what they give without a limb lost is below three).
_LONG, _SPIKE = 2.2, 4.0
#: A mesh is drawn out, and rings are tried, if it has edges that are longer than so many medians.
_DRAWN = 2.7
#: Rings make the quads no more than so many times those that were wanted.
_MORE = 1.25
#: A limb's tip is what hangs together by shorter edges, and has at most this share of all vertices.
_TIP = 0.1
#: Rounds of putting rings in, and of drawing spikes back, and how far back each time.
_MOST_RINGS, _MOST_TRIMS, _STEP = 10, 100, 0.2


def pillowed(mesh: PolyMesh, inside: BoolArray) -> PolyMesh | None:
    """Put a ring of quads around some faces, between them and the rest.

    Parameters
    ----------
    mesh : PolyMesh
        Quads.
    inside : (F,) bool array
        Faces that make a disc.

    Returns
    -------
    PolyMesh or None
        The same surface, with one quad more for each edge around the faces, which get smaller; None
        if their boundary is not one simple loop.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> pillowed(cube(), np.arange(6) == 0).n_faces
    10
    """
    halfedges = build_halfedges(mesh)
    face, twin = halfedges.face, halfedges.twin
    around = np.flatnonzero(inside[face] & ((twin < 0) | ~inside[face[twin]]))
    tails = halfedges.tail[around]
    if (twin[around] < 0).any() or not len(around) or len(np.unique(tails)) != len(tails):
        return None
    loops, _ = label_links(tails, halfedges.head[around], mesh.n_vertices)
    if mesh.n_vertices - loops != len(around) - 1:
        return None
    number = np.arange(mesh.n_vertices)
    number[tails] = mesh.n_vertices + np.arange(len(tails))
    faces = mesh.indices.reshape(-1, 4).copy()
    corners = faces[inside]
    faces[inside] = number[corners]
    # What moves inwards stays between where it was and the middle of its faces there.
    sums = np.zeros((mesh.n_vertices, 4))
    centres = mesh.vertices[corners].mean(axis=1)
    np.add.at(sums, corners, np.column_stack([centres, np.ones(len(centres))])[:, None])
    new = mesh.vertices[tails] * 2 / 3 + sums[tails, :3] / sums[tails, 3:] / 3
    heads = halfedges.head[around]
    ring = np.column_stack([tails, heads, number[heads], number[tails]])
    return PolyMesh.from_faces(np.concatenate([mesh.vertices, new]), np.concatenate([faces, ring]))


def stretch(mesh: PolyMesh) -> float:
    """Return how many medians long the longest edge inside a mesh is.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> round(stretch(cube()), 9)
    1.0
    """
    return float(_medians(mesh, build_halfedges(mesh)).max(initial=1.0))


def drawn_out(mesh: PolyMesh) -> bool:
    """Tell whether a mesh has edges inside that are much longer than others."""
    return stretch(mesh) > _DRAWN


def with_limbs(
    source: PolyMesh, mesh: PolyMesh, refit: Callable[[PolyMesh], PolyMesh], wanted: int
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Give limbs that a fit drew out of a few quads rings of their own; take spikes back.

    Where a remesher leaves a limb out, a fit draws the quads there to its tip. A ring around the
    tip is put in, and all is fitted again, until edges are short enough or there are as many quads
    as may be. What is a spike even so goes back between its neighbours: the limb is cut off.

    Parameters
    ----------
    source : PolyMesh
        The given surface.
    mesh : PolyMesh
        Quads, fitted to it. What changes them must not bring faults of `check_remeshed`.
    refit : callable
        Fits a mesh.
    wanted : int
        About how many quads there are to be; rings make no more than a quarter more.

    Returns
    -------
    mesh : PolyMesh
        A symmetric mesh stays so if a fit keeps it so.
    faults : tuple of str
        That there still is a spike, if so.
    """

    def better(new: PolyMesh) -> bool:
        return (
            stretch(new) < stretch(mesh)
            and len(self_intersections(new)) <= clashes
            and len(check_remeshed(source, new)) <= faults
        )

    if not drawn_out(mesh):
        return mesh, ()
    clashes, faults, ringed = len(self_intersections(mesh)), len(check_remeshed(source, mesh)), mesh
    for _ in range(_MOST_RINGS):
        fewer = ringed
        ringed = _ringed(fewer)
        if ringed is fewer or ringed.n_faces > _MORE * wanted:
            break
        ringed = refit(ringed)
        mesh = ringed if better(ringed) else mesh
    if stretch(mesh) > _SPIKE:
        trimmed = _trimmed(mesh)
        mesh = trimmed if better(trimmed) else mesh
    times = stretch(mesh)
    if times <= _SPIKE:
        return mesh, ()
    length = float(np.median(edge_lengths(mesh))) * times
    return mesh, (f"an edge of {length:.0f} mm is {times:.1f} times as long as others",)


def _medians(mesh: PolyMesh, halfedges: Halfedges) -> FloatArray:
    """Return the length of each half-edge in medians; of those on the boundary 1, (H,)."""
    length = edge_lengths(mesh)
    return np.where(halfedges.twin < 0, 1.0, length / max(float(np.median(length)), 1e-300))


def _ringed(mesh: PolyMesh) -> PolyMesh:
    """Put a ring around each tip that only long edges link to the rest."""
    half = build_halfedges(mesh)
    short = _medians(mesh, half) <= _LONG
    label = label_links(half.tail[short], half.head[short], mesh.n_vertices)[1]
    size = np.bincount(label, minlength=mesh.n_vertices)
    corners = mesh.indices.reshape(-1, 4)
    for tip in np.flatnonzero((size > 0) & (size <= _TIP * mesh.n_vertices)).tolist():
        inside = flags(mesh.n_faces, np.flatnonzero((label[corners] == tip).any(axis=1)))
        mesh = pillowed(mesh, inside) or mesh
    return mesh


def _trimmed(mesh: PolyMesh) -> PolyMesh:
    """Move the ends of edges that are spikes towards the middle of their neighbours."""
    half = build_halfedges(mesh)
    rim = flags(mesh.n_vertices, half.tail[(half.twin < 0) | (half.twin[half.prev] < 0)])
    number = np.maximum(np.bincount(half.tail, minlength=mesh.n_vertices), 1)[:, None]
    for _ in range(_MOST_TRIMS):
        spike = _medians(mesh, half) > _SPIKE
        moved = flags(mesh.n_vertices, np.concatenate([half.tail[spike], half.head[spike]])) & ~rim
        if not moved.any():
            break
        middle = sum_at(half.tail, mesh.vertices[half.head], mesh.n_vertices) / number
        step = _STEP * moved[:, None]
        mesh = mesh.with_vertices((1.0 - step) * mesh.vertices + step * middle)
    return mesh
