"""Make pictures of a weave on its mesh: twists of edges, broken conditions, seams of a twill."""

from typing import Literal, TypeAlias

import numpy as np
from PIL import Image

from fabweave.core.arrays import FloatArray, IntArray, frozen_value
from fabweave.core.colour_space import Colours
from fabweave.core.messages import agree
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
ViewOf: TypeAlias = Literal["twists", "faults", "seams"]

#: Edges that twist counter-clockwise, clockwise, and not at all (at the boundary).
_BLUE, _RED, _GREY = (20, 92, 200), (208, 40, 34), (120, 126, 134)
#: The mesh, and what is plain on it.
_PALE, _FAINT = (240, 238, 232), (205, 207, 210)
#: Broken edge, face and vertex conditions.
_OF_EDGE, _OF_FACE, _OF_VERTEX = (255, 122, 0), (0, 140, 96), (120, 20, 150)
#: Seams, faces with no diagonal, and diagonals.
_SEAM, _NO_DIAGONAL, _DIAGONAL = (208, 40, 34), (250, 200, 165), (40, 100, 190)
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
    edge of three, at a face, at a vertex. ``seams`` draws the diagonal of the twill on each quad,
    and the edges where it changes its direction.

    Parameters
    ----------
    what : str
        One of these three.
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
    twist_of_edge = _twist_of_edges(halfedges, weave)
    edge_colours = np.array([_RED, _BLUE, _GREY], dtype=np.uint8)[twist_of_edge]
    marks, drawn, owner = None, mesh, np.arange(mesh.n_faces)
    shown = np.full((mesh.n_faces, 3), _PALE, dtype=np.uint8)
    ends = np.column_stack((halfedges.tail, halfedges.head))
    colours = edge_colours[halfedges.edge]
    seams = None
    if what == "seams":
        seams = twill_seams(halfedges, weave)
        edge_colours = np.full((halfedges.n_edges, 3), _FAINT, dtype=np.uint8)
        edge_colours[seams.edges] = _SEAM
        shown[seams.across < 0] = _NO_DIAGONAL
        drawn, owner, ends, colours = _cut_along_diagonals(mesh, halfedges, seams, edge_colours)
    vertices, triangles, sides, face = polygon_triangles(drawn)
    view = choose_view(vertices, triangles) if view is None else view
    lines = _colours_of_sides(ends, colours, triangles)
    pixels = middle_edge_px(vertices, triangles, sides, view, size_px)
    if what == "faults":
        size = float(np.clip(_MARK_SHARE * pixels, _SMALLEST_PX, _LARGEST_PX))
        marks = Dots(*broken_places(mesh, halfedges, weave), size)
    picture = render_scene(
        vertices,
        triangles,
        shown[owner[face]],
        size_px=size_px,
        view=view,
        normals=np.repeat(face_normals(drawn)[face][:, None, :], 3, axis=1),
        edges=sides,
        edge_colours=lines,
        line_px=float(np.clip(_LINE_SHARE * pixels, _THINNEST_PX, _THICKEST_PX)),
        marks=marks,
        samples=3,
    )
    if not caption:
        return picture
    return contact_sheet([picture], [_caption(what, weave, halfedges, seams)])


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


@frozen_value
class Seams:
    """Where the diagonal of a 2/2 twill changes its direction.

    Parameters
    ----------
    across : (F,) int array
        The half-edge of each quad through which its diagonal comes; it goes out through the
        opposite one. -1 where there is none: quads of which not just one pair of opposite edges
        twists alike, and faces that are no quads.
    edges : (S,) int array
        Edges between two quads through which the diagonal of one goes, and that of the other does
        not.
    """

    across: IntArray
    edges: IntArray


def twill_seams(halfedges: Halfedges, weave: Weave) -> Seams:
    """Find the diagonal of the twill on each quad, and the edges where it changes direction.

    The lines of a 2/2 twill go from crossing to crossing at 45 degrees to the threads, and so
    through opposite edges of quads: these twist alike, and the other two do not, as of three
    crossings in a row along a thread the first and the last twist in opposite senses. In an exact
    twill the diagonals of neighbours are parallel.
    """
    twist = _twist_of_edges(halfedges, weave)[halfedges.edge]
    sizes = np.bincount(halfedges.face)
    after = halfedges.next
    opposite, before = after[after], after[after[after]]
    through = (
        (sizes[halfedges.face] == 4)
        & np.all(twist[np.stack((np.arange(len(twist)), after, opposite, before))] < 2, axis=0)
        & (twist == twist[opposite]) & (twist[after] != twist[before])
    )  # fmt: skip
    across = np.full(len(sizes), -1, dtype=np.int64)
    entered = np.flatnonzero(through)[::-1]
    across[halfedges.face[entered]] = entered
    here = weave.threads.crossing_halfedge
    there = halfedges.twin[here]
    both = (across[halfedges.face[here]] >= 0) & (across[halfedges.face[there]] >= 0)
    return Seams(across, halfedges.edge[here[both & (through[here] != through[there])]])


def _cut_along_diagonals(
    mesh: PolyMesh, halfedges: Halfedges, seams: Seams, edge_colours: Colours
) -> tuple[PolyMesh, IntArray, IntArray, Colours]:
    """Cut quads in two along their diagonals; return faces, whose they are, and lines to draw."""
    middle = mesh.n_vertices + halfedges.edge
    first = np.zeros(halfedges.n_edges, dtype=np.int64)
    first[halfedges.edge] = np.arange(halfedges.n_halfedges)
    middles = (mesh.vertices[halfedges.tail[first]] + mesh.vertices[halfedges.head[first]]) / 2
    faces, owner = [], []
    for face, here in enumerate(seams.across.tolist()):
        if here < 0:
            faces.append(mesh.indices[mesh.offsets[face] : mesh.offsets[face + 1]].tolist())
            owner.append(face)
            continue
        far = int(halfedges.next[halfedges.next[here]])
        tail, head = halfedges.tail, halfedges.head
        faces += [
            [tail[here], middle[here], middle[far], head[far]],
            [middle[here], head[here], tail[far], middle[far]],
        ]
        owner += [face, face]
    comes = seams.across[seams.across >= 0]
    goes = halfedges.next[halfedges.next[comes]]
    ends = np.concatenate((
        np.column_stack((halfedges.tail, halfedges.head)),
        np.column_stack((halfedges.tail, middle)),
        np.column_stack((middle, halfedges.head)),
        np.column_stack((middle[comes], middle[goes])),
    ))  # fmt: skip
    # Edges are drawn whole, and in the halves of quads that are cut.
    diagonals = np.full((len(comes), 3), _DIAGONAL, dtype=np.uint8)
    colours = np.concatenate((np.tile(edge_colours[halfedges.edge], (3, 1)), diagonals))
    cut = PolyMesh.from_faces(np.concatenate((mesh.vertices, middles)), faces)
    return cut, np.array(owner, dtype=np.int64), ends, colours


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


def _caption(what: ViewOf, weave: Weave, halfedges: Halfedges, seams: Seams | None) -> str:
    """Say what is shown, and how often it is there."""
    if seams is not None:
        none = int(np.count_nonzero(seams.across < 0))
        return agree(
            len(seams.edges), "{n} [edge|edges] (red) where the diagonal changes direction"
        ) + agree(none, "; {n} [face|faces] (orange) without a diagonal")
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
