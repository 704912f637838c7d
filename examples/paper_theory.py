"""Draw figures 5 to 9 of "Cyclic twill-woven objects" (2011): why strands weave, what a twill is.

``make_figures.py`` makes them with the others. What they count is computed: walks are traced,
linking numbers summed, conditions checked.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from PIL import Image, ImageDraw, ImageFont

from fabweave.core.arrays import BoolArray, FloatArray, IntArray, offsets_of, unit
from fabweave.core.messages import agree
from fabweave.mesh.halfedge import Halfedges, build_halfedges
from fabweave.mesh.polymesh import PolyMesh, face_centres
from fabweave.mesh.shapes.grids import grid_quads, hypar
from fabweave.mesh.shapes.solids import octahedron
from fabweave.picture.bodies import Body, joined_bodies, yarn_bodies
from fabweave.picture.camera import View
from fabweave.picture.object_picture import weave_picture
from fabweave.picture.render import object_frame, render_scene
from fabweave.picture.surfaces import ribbon_triangles
from fabweave.picture.yarns import Spines, Yarns, spin_yarns, sweep
from fabweave.ribbon.project import project_ribbons
from fabweave.weave.bunches import part_bunches
from fabweave.weave.pattern import Weave, over_of_passes, plain_weave, strand_passes
from fabweave.weave.strand_colours import SAFE_PALETTE
from fabweave.weave.threads import (
    Threads,
    corner_successor,
    order_states,
    thread_labels,
    trace_threads,
)
from fabweave.weave.twill.conditions import TwillConditions, count_broken, twill_conditions
from fabweave.weave.twill.decide import decide_twill

Colour: TypeAlias = tuple[int, int, int]

TILE, LOW_TILE, EDGE_TILE = (560, 460), (560, 400), (560, 190)
#: A ball, an edge, and what is flat.
BALL, ALONG, FLAT = View(-52.0, 68.0), View(-90.0, 78.0), View(-90.0, 90.0)
#: Edges that twist counter-clockwise, clockwise and not at all, as in the paper.
BLUE, RED, GREY = (20, 92, 200), (208, 40, 34), (128, 134, 142)
#: Strands: of the warp and of the weft, or the two of an edge; and what matters less.
GOLD, TEAL, FAINT = (236, 160, 20), (0, 140, 126), (222, 224, 228)
PALE, INK, WHITE = (232, 228, 218), (38, 43, 51), (255, 255, 255)
#: Half the width of an edge thickened to a strip, what it lacks at each end, as a share of the
#: edge, and how high a half-twist rises, relative to its width.
HALF_WIDTH, END, RISE = 0.16, 0.2, 0.65


#: A picture and its caption; what was counted, by its names.
Tile: TypeAlias = tuple[Image.Image, str]
Row: TypeAlias = dict[str, object]


class Figure(NamedTuple):
    """Pictures, and rows of counts."""

    tiles: list[Tile]
    rows: list[Row]


def trace_walks(halfedges: Halfedges, half_twists: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Trace the boundary of a mesh whose edges are strips with half-twists.

    An odd number of them swaps the two sides of an edge: a walk goes on there as a thread does,
    elsewhere around its face.

    Returns
    -------
    way, side, walk : (H,) int arrays
        The half-edges that walks follow, in walking order, the side on which each begins, 1 on the
        left and -1 on the right, and the walk of each.
    """
    count = halfedges.n_halfedges
    around = np.concatenate((halfedges.next, halfedges.prev + count))
    way = np.concatenate((halfedges.next, halfedges.twin))
    swaps = half_twists[halfedges.edge[way]] % 2 == 1
    states, walk, _ = order_states(np.where(swaps, corner_successor(halfedges), around), count)
    return way[states], np.where(states < count, 1, -1), walk


def linking_numbers(halfedges: Halfedges, half_twists: IntArray) -> IntArray:
    """Return how often any two walks are linked, (W, W): half the signs of their crossings.

    The sides of a counter-clockwise edge are a right-handed helix: each half-twist counts 1 where
    both walks go one way, and -1 where they meet.
    """
    way, _, walk = trace_walks(halfedges, half_twists)
    sides = np.argsort(halfedges.edge[way], kind="stable").reshape(-1, 2)
    same = way[sides[:, 0]] == way[sides[:, 1]]
    signs = np.zeros((walk.max() + 1, walk.max() + 1), dtype=np.int64)
    np.add.at(signs, tuple(walk[sides].T), np.where(same, half_twists, -half_twists))
    np.fill_diagonal(signs, 0)
    return (signs + signs.T) // 2


class Strip(NamedTuple):
    """An edge as a strip: its middle line, and the directions to its left and up, (N, 3) each."""

    axis: FloatArray
    left: FloatArray
    up: FloatArray

    def turned(self, half_twists: int) -> tuple[FloatArray, FloatArray]:
        """Return the way to the side that begins on the left, and the strip's normals."""
        share = np.linspace(0.0, 1.0, len(self.axis))[:, None]
        turn = np.pi * half_twists * share * share * (3.0 - 2.0 * share)
        across = np.cos(turn) * self.left + RISE * np.sin(turn) * self.up
        return HALF_WIDTH * across, unit(np.cos(turn) * self.up - RISE * np.sin(turn) * self.left)

    def side(self, half_twists: int, side: int) -> FloatArray:
        """Return the side that begins on the left (1) or on the right (-1)."""
        return self.axis + side * self.turned(half_twists)[0]

    def surface(self, half_twists: int, colour: Colour) -> Body:
        """Return what lies between both sides."""
        across, normals = self.turned(half_twists)
        points = self.axis[:, None] + np.linspace(-1.0, 1.0, 9)[:, None] * across[:, None]
        return surface(points, colour, np.repeat(normals, 9, axis=0))


def surface(points: FloatArray, colour: Colour, normals: FloatArray) -> Body:
    """Return the surface over a grid of points, (M, N, 3)."""
    quads = grid_quads(len(points) - 1, points.shape[1] - 1, wrap=(False, False))
    points = points.reshape(-1, 3)
    colours = np.full(points.shape, colour, dtype=np.uint8)
    return Body("", colours, points, quads, np.zeros((0, 3), dtype=np.int64), normals)


def ball(radius: float, colour: Colour, centre: FloatArray | float = 0.0) -> Body:
    """Return a ball."""
    turn, rise = np.meshgrid(
        np.linspace(0, 2 * np.pi, 97), np.linspace(-0.5, 0.5, 49) * np.pi, indexing="ij"
    )
    out = np.stack((np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)), axis=2)
    return surface(centre + radius * out, colour, out.reshape(-1, 3))


def tubes(
    lines: Sequence[FloatArray], colours: Sequence[Colour], radius: float, *, ring: bool = False
) -> tuple[Body, ...]:
    """Return tubes along lines, or rings, each in its colour."""
    ways = [
        np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0) if ring else np.gradient(line, axis=0)
        for line in lines
    ]
    offsets, points = offsets_of(np.array([*map(len, lines)])), np.concatenate(lines)
    closed, radii = np.full(len(lines), ring), np.full(len(points), radius)
    ahead = unit(np.concatenate(ways))
    rim = sweep(Spines(offsets, closed, points, ahead, radii, np.arange(len(points))), 16)
    yarns = Yarns(offsets, closed, points, radii, rim, 0 * offsets, offsets[:0], 1.0)
    return yarn_bodies(yarns, thread_labels(len(lines)), np.array(colours, dtype=np.uint8))


def drawn(bodies: Sequence[Body], view: View, size_px: tuple[int, int] = TILE) -> Image.Image:
    """Return a picture of bodies that have normals."""
    return render_scene(
        *joined_bodies(bodies),
        np.concatenate([one.triangle_colours for one in bodies]),
        size_px=size_px,
        view=view,
        normals=np.concatenate([np.asarray(one.normals)[one.all_triangles] for one in bodies]),
        samples=3,
    )


def colour_of(half_twists: int, plain: Colour = GREY) -> Colour:
    """Return the colour of an edge."""
    return BLUE if half_twists > 0 else RED if half_twists < 0 else plain


def figure_6() -> Figure:
    """Show an edge as a strip whose sides are the two strands."""
    x = np.linspace(-1.0, 1.0, 121)[:, None]
    strip = Strip(x * (1.0, 0.0, 0.0), 0.0 * x + (0.0, 1.0, 0.0), 0.0 * x + (0.0, 0.0, 1.0))
    found = Figure([], [])
    for half_twists, words in ((0, ""), (1, ", counter-clockwise"), (-1, ", clockwise"), (2, "")):
        sides = [strip.side(half_twists, side) for side in (1, -1)]
        left = sides[0][:, 1] > sides[1][:, 1]
        crossings = int(np.count_nonzero(left[1:] != left[:-1]))
        swap = "keep" if left[0] == left[-1] else "swap"
        bodies = [
            strip.surface(half_twists, PALE),
            *tubes(sides, (GOLD, TEAL), 0.036),
            *tubes([strip.axis], [colour_of(half_twists)], 0.022),
            *(ball(0.06, INK, end) for end in strip.axis[[0, -1]]),
        ]
        caption = agree(abs(half_twists), "{n} half-twist[|s]") + words
        caption += agree(crossings, "\n{n} crossing[|s]: the strands ") + f"{swap} sides"
        found.tiles.append((drawn(bodies, ALONG, EDGE_TILE), caption))
        found.rows.append(
            {"half-twists": half_twists, "crossings": crossings, "strands": f"{swap} sides"}
        )
    return found


def strips_of(mesh: PolyMesh, halfedges: Halfedges, end: float = END) -> list[Strip]:
    """Return the strip of every half-edge of a mesh on the unit sphere, without its ends."""
    strips = []
    for tail, head in mesh.vertices[np.column_stack((halfedges.tail, halfedges.head))]:
        angle = np.arccos(tail @ head)
        at = np.linspace(end, 1.0 - end, 41)[:, None] * angle
        axis = (np.sin(angle - at) * tail + np.sin(at) * head) / np.sin(angle)
        strips.append(Strip(axis, np.broadcast_to(unit(np.cross(tail, head)), axis.shape), axis))
    return strips


def rounded(before: FloatArray, after: FloatArray) -> FloatArray:
    """Return a curve from the end of a side to the start of another, without a kink."""
    start, end = before[-1], after[0]
    reach = 0.55 * np.linalg.norm(end - start)
    one, other = start + reach * unit(start - before[-2]), end + reach * unit(end - after[1])
    t = np.linspace(0.0, 1.0, 20)[1:-1, None]
    s = 1.0 - t
    curve = s**3 * start + 3 * s * s * t * one + 3 * s * t * t * other + t**3 * end
    return unit(curve) * np.linalg.norm(start)


def boundary(mesh: PolyMesh, half_twists: IntArray) -> list[FloatArray]:
    """Return the boundary of the strips of a mesh on the unit sphere: a ring for each walk."""
    halfedges = build_halfedges(mesh)
    strips, of_edge = strips_of(mesh, halfedges), half_twists[halfedges.edge]
    way, side, walk = trace_walks(halfedges, half_twists)
    sides = [strips[h].side(of_edge[h], left) for h, left in zip(way, side, strict=True)]
    rings = []
    for number in range(walk.max() + 1):
        own = [sides[at] for at in np.flatnonzero(walk == number)]
        corners = map(rounded, own, [*own[1:], own[0]])
        rings.append(np.concatenate([p for both in zip(own, corners, strict=True) for p in both]))
    return rings


def thickened(mesh: PolyMesh, half_twists: IntArray) -> list[Body]:
    """Return the strips of a mesh on the unit sphere, joined around its vertices."""
    halfedges = build_halfedges(mesh)
    strips, share = strips_of(mesh, halfedges), np.linspace(0.0, 1.0, 5)[:, None, None]
    bodies = [
        strips[h].surface(twists, colour_of(twists, PALE))
        for h, twists in zip(halfedges.edge_halfedge, half_twists.tolist(), strict=True)
    ]
    for h, after in enumerate(halfedges.next):
        into, out, beyond = (
            strips[k].side(0, side) for k, side in ((h, 1), (after, 1), (after, -1))
        )
        rim = np.concatenate((into[-1:], rounded(into, out), out[:1], beyond[:1]))[::-1]
        sector = unit((1.0 - share) * mesh.vertices[halfedges.head[h]] + share * rim)
        bodies.append(surface(sector * np.linalg.norm(rim[0]), PALE, sector.reshape(-1, 3)))
    return bodies


def figure_7() -> Figure:
    """Show the boundary of strips: unlinked rings, and linked ones where edges are twisted."""
    mesh = octahedron()
    halfedges = build_halfedges(mesh)
    half, top = halfedges.edge_halfedge, mesh.vertices[:, 2].argmax()
    at_top = (halfedges.tail[half] == top) | (halfedges.head[half] == top)
    strips = strips_of(mesh, halfedges, 0.0)
    edges = [strips[h].axis for h in half]
    tiles: list[Tile] = []
    rows: list[Row] = []
    for half_twists, core in ((0 * half, 0.98), (1 * at_top, 0.86)):
        rings, links = boundary(mesh, half_twists), linking_numbers(halfedges, half_twists)
        links = np.abs(links[np.triu_indices(len(links))])
        linked, most = int(np.count_nonzero(links)), int(links.max())
        lines = tubes(edges, [colour_of(twists) for twists in half_twists], 0.025)
        dots = [ball(0.05, INK, vertex) for vertex in mesh.vertices]
        round_them = tubes(rings, SAFE_PALETTE[: len(rings)].tolist(), 0.03, ring=True)
        twisted = int(np.count_nonzero(half_twists))
        knot = f"{{n}} pair[|s] linked {most} times" if linked else "unlinked"
        tiles += [
            (
                drawn([ball(0.985, PALE), *lines, *dots], BALL),
                agree(twisted, "octahedron, {n} edge[|s] twisted"),
            ),
            (
                drawn([ball(core, WHITE), *thickened(mesh, half_twists)], BALL),
                "its edges as strips",
            ),
            (
                drawn([ball(core, WHITE), *round_them], BALL),
                agree(len(rings), "their boundary: {n} ring[|s]\n") + agree(linked, knot),
            ),
        ]
        rows.append({"twisted edges": twisted, "face walks": len(rings),
                     "linked pairs": linked, "linking number": most})  # fmt: skip
    return Figure(tiles, rows)


#: A label: where, its words, and the ground on which they stand.
Note: TypeAlias = tuple[FloatArray, str, Colour]


def written(
    picture: Image.Image,
    lines: Iterable[tuple[FloatArray, Colour, float]] = (),
    notes: Iterable[Note] = (),
) -> Image.Image:
    """Draw lines, in colours and widths, over a picture, and notes over them; return it."""
    fine = 4
    layer = Image.new("RGBA", (fine * picture.width, fine * picture.height))
    draw, font = ImageDraw.Draw(layer), ImageFont.load_default(size=fine * 22)
    for points, colour, width in lines:
        draw.line([*map(tuple, fine * points[:, :2])], fill=colour, width=round(fine * width))
        for x, y in fine * points[:, :2]:
            draw.circle((x, y), fine * width / 2, fill=colour)
    for at, text, ground in notes:
        x, y = fine * at[:2]
        high = 15 * fine
        wide = max(high, font.getlength(text) / 2 + 8 * fine)
        box = (x - wide, y - high, x + wide, y + high)
        draw.rounded_rectangle(box, high, fill=ground, outline=INK, width=2 * fine)
        ink = INK if sum(ground) > 600 else WHITE
        draw.text((x, y), text, fill=ink, font=font, anchor="mm")
    layer = layer.resize(picture.size, Image.Resampling.LANCZOS)
    picture.paste(layer, mask=layer)
    return picture


class Cloth(NamedTuple):
    """A flat weave of two bunches: the warp, which is upright, and the weft."""

    mesh: PolyMesh
    halfedges: Halfedges
    conditions: TwillConditions
    weave: Weave

    @property
    def warp(self) -> BoolArray:
        """Which passes are of the warp, (P,)."""
        threads = self.weave.threads
        return part_bunches(threads)[threads.thread_of_pass] == 0

    @property
    def warp_on_top(self) -> BoolArray:
        """Where warp lies over weft, (X,)."""
        return self.warp[strand_passes(self.weave)[:, 1]]

    @property
    def ends(self) -> FloatArray:
        """The ends of the edges at which strands cross, (X, 2, 3)."""
        half = self.weave.threads.crossing_halfedge
        return self.mesh.vertices[np.column_stack((self.halfedges.tail, self.halfedges.head))[half]]

    def spoiled(self, crossing: int) -> "Cloth":
        """Return the same with one crossing turned over."""
        threads, twist = self.weave.threads, self.weave.twist.copy()
        twist[crossing] ^= True
        return self._replace(weave=twill_of(threads, self.conditions, twist))

    def examples(self) -> dict[str, IntArray]:
        """Return the crossings of one condition of each kind, the nearest to the middle.

        Three along the weft, from the left, which lies over, over and under; and four edges around
        a face and a vertex, of which the middle two differ, with the warp on top at three.
        """
        threads, top, places = self.weave.threads, self.warp_on_top, self.ends.mean(axis=1)
        passes = sliding_window_view(np.arange(len(threads.crossing)), 3)
        passes = passes[np.ptp(threads.thread_of_pass[passes], axis=1) == 0]
        along = threads.crossing[passes[~self.warp[passes[:, 0]]]]
        along = np.where(places[along[:, :1], 0] < places[along[:, 2:], 0], along, along[:, ::-1])
        kinds = {"edge": along[np.all(top[along] == (False, False, True), axis=1)]}
        for kind, rows in (("face", self.conditions.face), ("vertex", self.conditions.vertex)):
            differ = self.weave.twist[rows[:, 1]] != self.weave.twist[rows[:, 2]]
            kinds[kind] = rows[differ & (top[rows].sum(axis=1) == 3)]
        away = places - places.mean(axis=0)
        return {
            kind: rows[np.linalg.norm(away[rows].mean(axis=1), axis=1).argmin()]
            for kind, rows in kinds.items()
        }


def twill_of(threads: Threads, conditions: TwillConditions, twist: BoolArray) -> Weave:
    """Return the weave of these twists."""
    over, broken = over_of_passes(threads, twist), count_broken(conditions, twist)
    return Weave(threads, "twill", twist, over, broken)


def squares(columns: int, rows: int) -> PolyMesh:
    """Return a patch of squares that stand on a corner, so that the weft is level."""
    centres = [(i, j) for i in range(columns + 1) for j in range(rows + 1) if (i + j) % 2 == 0]
    corners = np.array(centres)[:, None] + [(-1, 0), (0, -1), (1, 0), (0, 1)]
    points, number = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return PolyMesh.from_faces(np.pad(points, ((0, 0), (0, 1))), number.reshape(-1, 4).tolist())


def twill_cloth(columns: int = 6, rows: int = 5) -> Cloth:
    """Weave squares in exact 2/2 twill."""
    mesh = squares(columns, rows)
    halfedges = build_halfedges(mesh)
    threads = trace_threads(halfedges)
    conditions = twill_conditions(halfedges, threads)
    twist = np.asarray(decide_twill(conditions).twist)
    return Cloth(mesh, halfedges, conditions, twill_of(threads, conditions, twist))


def paler(colour: Colour) -> Colour:
    """Return a pale tint of a colour."""
    red, green, blue = (round(0.3 * part + 0.7 * 255) for part in colour)
    return red, green, blue


def cloth_picture(
    cloth: Cloth, crossings: IntArray, notes: Sequence[str] = (), *, strands: bool, edges: bool
) -> Image.Image:
    """Return a picture of cloth, its strands or its edges or both, with notes at some crossings.

    In full colours are the edges of these crossings, and the strands that pass two of them.
    """
    threads, twist = cloth.weave.threads, cloth.weave.twist
    ribbons = project_ribbons(
        cloth.mesh, cloth.halfedges, cloth.weave, height_mm=0.04, length=0.75, width=0.7
    )
    frame = object_frame(*ribbon_triangles(ribbons)[:2], FLAT, TILE)
    ends = frame.pixels(cloth.ends.reshape(-1, 3)).reshape(-1, 2, 3)
    places = ends.mean(axis=1)[crossings]
    picture = Image.new("RGB", TILE, WHITE)
    if strands:
        own = threads.thread_of_pass[np.isin(threads.crossing, crossings)]
        full = np.bincount(own, minlength=threads.n_threads)[threads.thread_of_pass] > 1
        tones = np.array([[paler(TEAL), TEAL], [paler(GOLD), GOLD]], dtype=np.uint8)
        painted = np.repeat(tones[cloth.warp * 1, full * 1][:, None], 2, axis=1)
        picture = weave_picture(
            ribbons, painted, size_px=TILE, view=FLAT, floor=False, samples=3
        )  # fmt: skip
    colours = [BLUE if counter_clockwise else RED for counter_clockwise in twist]
    lines = []
    if not strands:
        lines = [(line, paler(colour), 4.0) for line, colour in zip(ends, colours, strict=True)]
        lines += [(places, GREY, 4.0)] * (len(places) == 3)
    if edges:
        lines += [(ends[at], colours[at], 6.0 if strands else 9.0) for at in crossings]
    return written(picture, lines, [(*note, WHITE) for note in zip(places, notes, strict=False)])


def figure_5() -> Figure:
    """Show the conditions on the fabric, along a strand and around a gap, and how they break."""
    cloth, found = twill_cloth(), Figure([], [])
    along, gap = (cloth.examples()[kind] for kind in ("edge", "face"))
    odd = gap[~cloth.warp_on_top[gap]].item()
    for one, crossings in (
        (cloth, along), (cloth.spoiled(along[2]), along), (cloth, gap), (cloth.spoiled(odd), gap),
    ):  # fmt: skip
        top = one.warp_on_top[crossings]
        if crossings is along:
            notes = ["under" if warp else "over" for warp in top]
            caption = f"along a strand: first and third {'agree' if top[0] == top[2] else 'differ'}"
        else:
            notes = ["warp" if warp else "weft" for warp in top]
            caption = f"around a gap: warp on top at {top.sum()} of {len(top)}"
        broken, count = one.weave.broken, one.conditions.count
        caption += f"\n{broken.total} of {count} conditions broken"
        found.tiles.append(
            (cloth_picture(one, crossings, notes, strands=True, edges=False), caption)
        )
        found.rows.append({"crossings": ", ".join(notes), "conditions": count,
                           "broken edge conditions": broken.edge, "face": broken.face,
                           "vertex": broken.vertex})  # fmt: skip
    return found


def figure_9() -> Figure:
    """Show the three conditions on the mesh, and the strands over and under."""
    cloth = twill_cloth()
    meshes, strands, rows = [], [], []
    for kind, crossings in cloth.examples().items():
        names, top = "123" if kind == "edge" else "abcd", cloth.warp_on_top[crossings]
        twist = cloth.weave.twist[crossings]
        outer = "differ" if twist[0] != twist[-1] else "agree"
        if kind == "edge":
            rule = f"1 and 3 {outer}"
            over = "the weft: " + ", ".join("under" if warp else "over" for warp in top)
        else:
            rule = f"b and c {'differ' if twist[1] != twist[2] else 'agree'}, a and d {outer}"
            over = "warp on top at " + ", ".join(np.array([*names])[top])
        meshes.append((
            cloth_picture(cloth, crossings, names, strands=False, edges=True),
            f"{kind} condition\n{rule}",
        ))  # fmt: skip
        strands.append((cloth_picture(cloth, crossings, strands=True, edges=True), over))
        rows.append({
            "condition": kind,
            "in this patch": len(getattr(cloth.conditions, kind)),
            "broken": getattr(cloth.weave.broken, kind),
            "broken with one edge turned": getattr(cloth.spoiled(crossings[0]).weave.broken, kind),
        })  # fmt: skip
    return Figure(meshes + strands, rows)


def self_crossings(threads: Threads) -> IntArray:
    """Return the two passes of each crossing that a thread meets twice, in their order, (N, 2)."""
    passes = np.argsort(threads.crossing, kind="stable").reshape(-1, 2)
    thread = threads.thread_of_pass[passes]
    return passes[thread[:, 0] == thread[:, 1]]


def mat(columns: int, rows: int) -> tuple[PolyMesh, Halfedges, Weave]:
    """Weave a mat of squares, at whose rim threads turn back."""
    square = hypar(columns, rows, 1.0, 0.0)
    points = square.vertices * (columns, rows, 1.0)
    mesh = PolyMesh.from_faces(points, square.indices.reshape(-1, 4).tolist())
    halfedges = build_halfedges(mesh)
    return mesh, halfedges, plain_weave(trace_threads(halfedges, turn=True))


def mat_picture(
    mesh: PolyMesh, halfedges: Halfedges, weave: Weave, first: int, stop: int
) -> Image.Image:
    """Return a picture of a mat, some passes of its first thread numbered.

    Where they are not all, an x marks the crossing before and after them.
    """
    threads, labels = weave.threads, thread_labels(weave.threads.n_threads)
    whole = stop - first == threads.lengths[0]
    colours = np.full((len(threads.crossing), 2, 3), FAINT, dtype=np.uint8)
    colours[: threads.lengths[0]] = paler(GOLD)
    colours[first:stop] = GOLD
    if not whole:
        colours[first - 1, 1] = colours[stop, 0] = GOLD
    yarns = spin_yarns(mesh, halfedges, weave, labels, radius_mm=0.1, sides=16)
    bodies = yarn_bodies(yarns, labels, colours)
    half = threads.halfedge
    tail, head = mesh.vertices[halfedges.tail[half]], mesh.vertices[halfedges.head[half]]
    crossing = (tail + head) / 2
    # Strands come to a crossing halfway between a vertex and the centre of a face.
    before = np.where(threads.forward[:, None], tail, head) / 2
    before += face_centres(mesh)[halfedges.face[half]] / 2
    pixels = object_frame(*joined_bodies(bodies), FLAT, LOW_TILE).pixels
    places = pixels(crossing + 0.8 * (before - crossing))
    notes = [
        (places[p], str(p - first + 1), WHITE if (p - first) % 2 else INK)
        for p in range(first, stop)
    ]
    if not whole:
        notes.append((pixels(crossing)[stop], "x", GREY))
    return written(drawn(bodies, FLAT, LOW_TILE), [], notes)


def figure_8() -> Figure:
    """Show that cycles, and their parts between two visits of one crossing, are even."""
    found = Figure([], [])
    for columns, rows in ((4, 2), (3, 2)):
        woven = mat(columns, rows)
        threads = woven[2].threads
        visits, length = self_crossings(threads), int(threads.lengths[0])
        between = visits[:, 1] - visits[:, 0] - 1
        first, second = visits[np.where(visits[:, 1] < length, between, -1).argmax()].tolist()
        cycles = agree(threads.n_threads, "{n} cycle[|s]") + f" of {length} passes"
        part = agree(second - first - 1, "{n} pass[|es] between two visits of x")
        found.tiles.append((mat_picture(*woven, 0, length), cycles))
        found.tiles.append((mat_picture(*woven, first + 1, second), part))
        found.rows.append({
            "squares": f"{columns} × {rows}", "cycles": threads.n_threads,
            "passes of each": length, "self-crossings": len(visits),
            "passes between two visits": ", ".join(map(str, np.unique(between))),
        })  # fmt: skip
    return found


#: The figures by their numbers.
FIGURES = {5: figure_5, 6: figure_6, 7: figure_7, 8: figure_8, 9: figure_9}
