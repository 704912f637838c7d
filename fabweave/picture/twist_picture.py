"""Make pictures of a weave on its mesh: twists of edges, broken conditions."""

from typing import Literal, TypeAlias

import numpy as np
from PIL import Image

from fabweave.core.arrays import FloatArray, IntArray
from fabweave.core.colour_space import Colours
from fabweave.mesh.halfedge import Halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.picture.camera import View, choose_view
from fabweave.picture.contact_sheet import contact_sheet
from fabweave.picture.render import Dots, middle_edge_px, render_scene
from fabweave.picture.surfaces import face_normals, polygon_triangles
from fabweave.weave.pattern import Weave
from fabweave.weave.threads import Threads
from fabweave.weave.twill.conditions import (
    broken_pairs,
    broken_windows,
    count_broken,
    twill_conditions,
)

#: What a picture of a weave on its mesh may show.
ViewOf: TypeAlias = Literal["twists", "faults"]

#: Edges that twist counter-clockwise, clockwise, and not at all (at the boundary).
_BLUE, _RED, _GREY = (20, 92, 200), (208, 40, 34), (120, 126, 134)
#: The mesh.
_PALE = (240, 238, 232)
#: Broken edge, face and vertex conditions.
_OF_EDGE, _OF_FACE, _OF_VERTEX = (255, 122, 0), (0, 140, 96), (120, 20, 150)
#: Widths of lines and marks, as shares of the middle edge in the picture, and bounds in pixels.
_LINE_SHARE, _THINNEST_PX, _THICKEST_PX = 0.16, 1.6, 7.0
_MARK_SHARE, _SMALLEST_PX, _LARGEST_PX = 0.13, 2.5, 9.0


def weave_on_mesh(
    what: ViewOf,
    mesh: PolyMesh,
    halfedges: Halfedges,
    weave: Weave,
    view: View | None = None,
    size_px: tuple[int, int] = (1000, 800),
    *,
    caption: bool = True,
) -> Image.Image:
    """Make a picture of a mesh that shows the weave on it.

    ``twists`` draws edges that twist counter-clockwise blue, and clockwise ones red, as the figures
    of the paper do. ``faults`` marks there what breaks a condition of the 2/2 twill: at the middle
    edge of three, at a face, at a vertex.

    Parameters
    ----------
    what : str
        One of these two.
    mesh, halfedges, weave
        The mesh, its connectivity, and the weave on it.
    view : View or None
        From where; None chooses.
    size_px : (int, int)
        Width and height.
    caption : bool
        Whether a line below says what is shown and how often.

    Returns
    -------
    Image
        RGB.

    References
    ----------
    Akleman, Chen, Chen, Xing, Gross, "Cyclic twill-woven objects" (2011), figures 9, 10 and 17.
    """
    edge_colours = np.array([_RED, _BLUE, _GREY], dtype=np.uint8)[_twist_of_edges(halfedges, weave)]
    ends = np.column_stack((halfedges.tail, halfedges.head))
    marks = None
    vertices, triangles, sides, face = polygon_triangles(mesh)
    view = choose_view(vertices, triangles) if view is None else view
    lines = _colours_of_sides(ends, edge_colours[halfedges.edge], triangles)
    pixels = middle_edge_px(vertices, triangles, sides, view, size_px)
    if what == "faults":
        size = float(np.clip(_MARK_SHARE * pixels, _SMALLEST_PX, _LARGEST_PX))
        marks = Dots(*broken_places(mesh, halfedges, weave), size)
    picture = render_scene(
        vertices,
        triangles,
        _PALE,
        size_px=size_px,
        view=view,
        normals=np.repeat(face_normals(mesh)[face][:, None, :], 3, axis=1),
        edges=sides,
        edge_colours=lines,
        line_px=float(np.clip(_LINE_SHARE * pixels, _THINNEST_PX, _THICKEST_PX)),
        marks=marks,
        samples=3,
    )
    if not caption:
        return picture
    return contact_sheet([picture], [_caption(what, weave, halfedges)])


def broken_places(mesh: PolyMesh, halfedges: Halfedges, weave: Weave) -> tuple[FloatArray, Colours]:
    """Find where the conditions of a 2/2 twill are broken, one place for each.

    Returns
    -------
    points : (N, 3) float array
        The middle of an edge, of a face, or a vertex.
    colours : (N, 3) uint8 array
        By which of these three it is.
    """
    threads = weave.threads
    conditions = twill_conditions(halfedges, threads)
    first = threads.crossing_halfedge
    tail, head = halfedges.tail[first], halfedges.head[first]
    middle = (mesh.vertices[tail] + mesh.vertices[head]) / 2
    pairs = conditions.edge[broken_pairs(conditions.edge, weave.twist)]
    between = _between(threads)
    of_edge = middle[[between[one, other] for one, other in pairs.tolist()]].reshape(-1, 3)
    windows = conditions.face[broken_windows(conditions.face, weave.twist)]
    beside = np.stack((halfedges.face[first], halfedges.face[halfedges.twin[first]]), axis=1)
    of_face = face_centres(mesh)[_common(beside[windows])]
    windows = conditions.vertex[broken_windows(conditions.vertex, weave.twist)]
    of_vertex = mesh.vertices[_common(np.stack((tail, head), axis=1)[windows])]
    kinds = np.repeat(
        np.array([_OF_EDGE, _OF_FACE, _OF_VERTEX], dtype=np.uint8),
        [len(of_edge), len(of_face), len(of_vertex)],
        axis=0,
    )
    return np.concatenate((of_edge, of_face, of_vertex)), kinds


def _twist_of_edges(halfedges: Halfedges, weave: Weave) -> IntArray:
    """Return 1 for edges that twist counter-clockwise, 0 for the other way, 2 for the boundary."""
    twist = np.full(halfedges.n_edges, 2, dtype=np.int64)
    twist[halfedges.edge[weave.threads.crossing_halfedge]] = weave.twist
    return twist


def _between(threads: Threads) -> dict[tuple[int, int], int]:
    """Return the crossing between any two that are two steps apart along a thread."""
    found: dict[tuple[int, int], int] = {}
    crossing = threads.crossing.tolist()
    for start, end in zip(threads.offsets[:-1].tolist(), threads.offsets[1:].tolist(), strict=True):
        own = crossing[start:end]
        for at in range(len(own)):
            found[own[at - 2], own[at]] = own[at - 1]
    return found


def _common(pairs: IntArray) -> IntArray:
    """Return the number that all pairs of each row have, (N,) of (N, 4, 2)."""
    candidates = pairs[:, 0]
    held = np.all(np.any(pairs[:, :, None, :] == candidates[:, None, :, None], axis=3), axis=1)
    return np.asarray(np.where(held[:, 0], candidates[:, 0], candidates[:, 1]))


def _colours_of_sides(ends: IntArray, colours: Colours, triangles: IntArray) -> Colours:
    """Return the colour of the line on each side of triangles; where there is none, any one.

    Parameters
    ----------
    ends : (L, 2) int array
        The ends of each line.
    colours : (L, 3) uint8 array
    triangles : (T, 3) int array

    Returns
    -------
    (T, 3, 3) uint8 array
    """
    count = int(max(ends.max(), triangles.max())) + 1
    key = ends.min(axis=1) * count + ends.max(axis=1)
    order = np.argsort(key, kind="stable")
    after = np.roll(triangles, -1, axis=1)
    wanted = np.minimum(triangles, after) * count + np.maximum(triangles, after)
    place = np.minimum(np.searchsorted(key[order], wanted), len(order) - 1)
    return np.asarray(colours[order[place]])


def _caption(what: ViewOf, weave: Weave, halfedges: Halfedges) -> str:
    """Say what is shown, and how often it is there."""
    if what == "faults":
        conditions = twill_conditions(halfedges, weave.threads)
        broken = count_broken(conditions, weave.twist)
        return (
            f"{broken.total} of {conditions.count} conditions of a 2/2 twill are broken\n"
            f"{broken.edge} edge (orange), {broken.face} face (green), "
            f"{broken.vertex} vertex (violet)"
        )
    blue = int(np.count_nonzero(weave.twist))
    return f"{blue} edges twist counter-clockwise (blue), {len(weave.twist) - blue} clockwise (red)"
