"""Lay a grid over a surface that has quads without any irregular vertex: a disc, a tube, a torus.

Rows and columns are lines of a chart of the surface, spaced evenly in space.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations, pairwise
from math import gcd

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import (
    BoolArray,
    FloatArray,
    IntArray,
    Progress,
    flags,
    frozen,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Note
from fabweave.core.messages import agree
from fabweave.mesh.automorphisms import best_motions
from fabweave.mesh.halfedge import build_halfedges, group_edges
from fabweave.mesh.mirror import Mirror, find_mirror
from fabweave.mesh.polymesh import PolyMesh, used_vertices
from fabweave.mesh.remesh.chart import (
    Chart,
    Loop,
    Sheet,
    crossing,
    disc_chart,
    loops_of,
    sheet_of,
    torus_chart,
    tube_chart,
    turns_along,
)
from fabweave.mesh.remesh.engines import QSLIM, AttemptFailedError, Run, run_engine
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    check_remeshed,
    cut_surface,
    edge_lengths,
    finished_quads,
    ready_source,
    sound_faults,
)
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.triangles import split_longer
from fabweave.mesh.shapes.grids import grid_quads
from fabweave.mesh.symmetrise import symmetrise
from fabweave.mesh.topology import boundary_loops, label_links
from fabweave.mesh.triangulate import surface_area
from fabweave.mesh.upright import largest_dimension


def lacks_grid(mesh: PolyMesh) -> str:
    """Say why a surface has no grid; empty if it has one. Only its topology is looked at.

    Parameters
    ----------
    mesh : PolyMesh
        An oriented manifold surface.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar, sphere, torus
    >>> lacks_grid(hypar(4, 4, 40.0, 10.0)), lacks_grid(torus(8, 8, 3.0, 1.0))
    ('', '')
    >>> lacks_grid(sphere(2, 1.0))
    'a grid needs a disc, a tube or a torus; this is closed and has no handle'
    """
    needs = "a grid needs a disc, a tube or a torus; this "
    edges = group_edges(mesh)
    used = used_vertices(mesh)
    bodies = label_links(edges.tail, edges.head, mesh.n_vertices)[0] - int((~used).sum())
    if bodies != 1:
        return needs + f"has {bodies} bodies"
    openings = boundary_loops(edges)[0]
    euler = int(used.sum()) - len(edges.sizes) + mesh.n_faces
    handles = (2 - euler - openings) // 2
    if (openings, handles) in ((1, 0), (2, 0), (0, 1)):
        return ""
    has = agree(openings, "has {n} opening[|s]") if openings else "is closed"
    more = agree(handles, " and has {n} handle[|s]") if handles else ""
    return needs + has + (more or ("" if openings else " and has no handle"))


# -- Rows and columns -----------------------------------------------------------------------------

#: Rounds in which rows and columns are spaced anew, and when they are even.
_SPACINGS, _SPACED = 60, 1e-9


@frozen_value
class Lines:
    """Rows and columns of a chart, and where they cross.

    Parameters
    ----------
    u, v : (M + 1,) and (N + 1,) float arrays
        Where the lines are in the chart; the last is the first where they are joined.
    places : (M + 1, N + 1, 3) float array
    joined : (bool, bool)
        Whether the first and last row are one, and the first and last column.
    corners : tuple of int
        The vertices of the mesh that are at corners of rims.
    """

    u: FloatArray
    v: FloatArray
    places: FloatArray
    joined: tuple[bool, bool]
    corners: tuple[int, ...] = ()

    @property
    def widths(self) -> tuple[FloatArray, FloatArray]:
        """How wide each row and each column is in the mean, (M,) and (N,)."""
        down, across = (np.linalg.norm(np.diff(self.places, axis=axis), axis=2) for axis in (0, 1))
        return np.asarray(down.mean(axis=1)), np.asarray(across.mean(axis=0))

    @property
    def mesh(self) -> PolyMesh:
        """The quads between them."""
        rows, columns = (size - 1 for size in self.places.shape[:2])
        height, width = rows + (not self.joined[0]), columns + (not self.joined[1])
        faces = grid_quads(rows, columns, wrap=self.joined)
        return PolyMesh.from_faces(self.places[:height, :width].reshape(-1, 3), faces)


def even_lines(chart: Chart, u: FloatArray, v: FloatArray, stay: BoolArray) -> Lines:
    """Space rows and columns so that each is as wide as the others in space, in the mean.

    Parameters
    ----------
    chart : Chart
    u, v : (M + 1,) and (N + 1,) float arrays
        Where to begin: rising, with both ends.
    stay : (N + 1,) bool array
        Columns that stay where they are; the first and the last do.
    """
    marks = np.flatnonzero(stay)
    lines = Lines(u, v, chart.places(u, v), chart.joined)
    for _ in range(_SPACINGS):
        rows, columns = lines.widths
        new_u = _spaced(lines.u, rows)
        parts = [
            _spaced(lines.v[a : b + 1], columns[a:b])[:-1] for a, b in pairwise(marks.tolist())
        ]
        new_v = np.concatenate([*parts, lines.v[-1:]])
        moved = max(np.abs(new_u - lines.u).max(), np.abs(new_v - lines.v).max())
        lines = Lines(new_u, new_v, chart.places(new_u, new_v), chart.joined)
        if moved < _SPACED:
            break
    return lines


def _spaced(lines: FloatArray, widths: FloatArray) -> FloatArray:
    """Return lines that part a way evenly, where the parts between the given ones are so wide."""
    way = np.concatenate([[0.0], np.cumsum(widths)])
    found = np.interp(np.linspace(0.0, way[-1], len(lines)), way, lines)
    found[[0, -1]] = lines[[0, -1]]
    return np.asarray(found)


def evened(chart: Chart, rows: int, columns: int, phase: float = 0.0) -> Lines:
    """Lay evenly spaced rows and columns over a chart, the first column at a phase."""
    stay = np.zeros(columns + 1, dtype=bool)
    stay[[0, -1]] = True
    u, v = np.linspace(0.0, 1.0, rows + 1), phase + np.linspace(0.0, 1.0, columns + 1)
    return even_lines(chart, u, v, stay)


#: Rows and columns of the trial grid by which a chart is measured.
_TRIAL = 24
#: How much more it costs to have another number of quads than was wanted than to have longish ones,
#: to have columns of two widths, and pieces of more kinds; and so many numbers of columns are tried
#: to either side.
_COUNT_COST, _PART_COST, _KIND_COST = 1.5, 4.0, 0.01
_NEAR = 8
_WHOLE = frozen(np.ones(1))
#: What has more turns than this is as good as round: a polygon of 40 sides is within 0.3 % of it.
_ROUND = 40


def counts(
    height: float, width: float, n_quads: int, *, least: tuple[int, int] = (2, 2), step: int = 1,
    parts: FloatArray = _WHOLE, turns: int = 0,
) -> tuple[int, IntArray] | None:  # fmt: skip
    """Return how many rows, and columns in each part, make nearly square quads, about so many.

    Parameters
    ----------
    height, width : float
        From the first row to the last, and from the first column to the last.
    n_quads : int
    least : (int, int)
        The fewest rows, and columns.
    step : int
        Columns in all are a multiple of this.
    parts : (K,) float array
        Shares of the width, each of whole columns.
    turns : int
        So many turns map a tube onto itself: the more of them map its columns and its threads onto
        one another, the fewer kinds of pieces there are. 0 where columns do not go around.

    Returns
    -------
    rows, columns : int and (K,) int array
        None where a part would have none.

    Examples
    --------
    >>> rows, columns = counts(50.0, 200.0, 400, step=2)
    >>> rows, columns.tolist()
    (10, [40])
    """
    ideal = int(np.sqrt(n_quads * width / height))
    tried = []
    for columns in range(max(least[1], ideal - _NEAR), max(least[1], ideal + _NEAR) + 1):
        each = np.rint(parts * columns).astype(np.int64)
        if columns % step or each.sum() != columns or not each.all():
            continue
        uneven = np.log(parts * columns / each)
        for rows in range(max(least[0], n_quads // columns - 1), n_quads // columns + 3):
            square = np.log((width / columns) / (height / rows))
            number = _COUNT_COST * np.log(rows * columns / n_quads)
            cost = square**2 + number**2 + (_PART_COST * uneven) @ (_PART_COST * uneven * parts)
            if turns:
                # Where threads turn back at rims, they close after a multiple of 2 rows turns.
                apart = columns / gcd(columns, turns) if turns < _ROUND else 1.0
                cost += _KIND_COST * np.log(apart**3 * columns / gcd(columns, 2 * rows))
            tried.append((round(float(cost), 9), rows, columns, each))
    if not tried:
        return None
    _, rows, _, each = min(tried, key=lambda one: one[:3])
    return rows, each


def square_lines(chart: Chart, n_quads: int, trial: int = _TRIAL) -> Lines | None:
    """Lay evenly spaced lines over a chart, so that quads are about square; None if too few fit."""
    height, width = (float(widths.sum()) for widths in evened(chart, trial, trial).widths)
    # A torus has an exact twill only if its rows or its columns are even in number.
    found = counts(height, width, n_quads, step=2 if chart.joined[1] else 1)
    return None if found is None else evened(chart, found[0], int(found[1].sum()))


def cost_of(places: FloatArray) -> float:
    """Return how uneven and oblique the quads of a grid of places, (M + 1, N + 1, 3), are.

    That is the root mean square of the logarithms of edges over the median, and of corners off
    right angles, as shares of one.
    """
    a, b, c, d = (places[i, j] for i, j in (
        (slice(None, -1), slice(None, -1)), (slice(1, None), slice(None, -1)),
        (slice(1, None), slice(1, None)), (slice(None, -1), slice(1, None)),
    ))  # fmt: skip
    ring = np.stack([a, b, c, d], axis=2)
    side = np.roll(ring, -1, axis=2) - ring
    length = np.maximum(np.linalg.norm(side, axis=3), 1e-300)
    back = np.roll(side, 1, axis=2)
    cosine = -np.einsum("ijkd,ijkd->ijk", side, back) / (length * np.roll(length, 1, axis=2))
    off = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))) - 90.0
    uneven = np.log(length / np.median(length))
    return float(np.sqrt(np.mean(uneven**2) + np.mean((off / 90.0) ** 2)))


#: A turn that maps a rim onto itself may be off by this share of its length.
_TURN_OFF = 1e-4


def turns_around(loops: Sequence[Loop]) -> int:
    """Return how many rotations map each rim onto itself, one at least.

    Only rims are looked at: how faces of a round surface are cut says nothing.
    """
    number = 0
    for loop in loops:
        out = np.linalg.norm(loop.points - loop.points.mean(axis=0), axis=1)
        step = np.diff(loop.way) * loop.length
        same = _TURN_OFF * loop.length
        number = gcd(
            number,
            sum(
                all(np.abs(np.roll(line, by) - line).max() < same for line in (out, step))
                for by in range(len(out))
            ),
        )
    return number


#: Shares of a rim that are nearer to one another are the same.
_SAME = 1e-6
#: Columns to the corners of two rims are one if they are nearer than this share of the way around.
_APART = 0.01
#: What is nearer to a corner of a rim than this share of half a quad is put there.
_SNAP = 0.2

# -- Tubes ----------------------------------------------------------------------------------------


def tube_lines(
    sheet: Sheet, loops: list[Loop], chart: Chart, n_quads: int, phase: float, turns: int
) -> Lines:
    """Lay rows around a tube, and columns along it that meet the corners of its rims.

    Parameters
    ----------
    sheet : Sheet
        A tube.
    loops : list of two Loop
    chart : Chart
        As from `tube_chart`.
    n_quads : int
        About how many quads.
    phase : float
        Where the first column is in the chart, if the rims have no corners.
    turns : int
        How many turns map the tube onto itself.
    """
    reach = 0.5 * np.sqrt(surface_area(sheet.mesh) / n_quads)
    corners = [loop.corners(reach / loop.length) for loop in loops]
    marks = [
        float(chart.flat[loop.sides[number], 1])
        for loop, some in zip(loops, corners, strict=True)
        for number in some
    ]
    while True:
        at = np.sort(np.array(marks or [phase]) % 1.0)
        # Corners of the two rims that are nearly above one another share a column.
        at = at[np.diff(at, append=at[0] + 1.0) > _APART]
        at = np.append(at, at[0] + 1.0)
        trial = evened(chart, _TRIAL, _TRIAL, float(at[0]))
        height, width = (float(widths.sum()) for widths in trial.widths)
        way = np.interp(at, trial.v, np.concatenate([[0.0], np.cumsum(trial.widths[1])]))
        found = counts(
            height, width, n_quads, least=(1, 4), step=2, parts=np.diff(way) / width, turns=turns
        )
        if found is not None:
            break
        marks.pop()
    rows, each = found
    parts = zip(at, at[1:], each.tolist(), strict=False)
    v = np.concatenate([*(np.linspace(a, b, n, endpoint=False) for a, b, n in parts), at[-1:]])
    stay = flags(len(v), np.concatenate([[0], np.cumsum(each)]))
    lines = even_lines(chart, np.linspace(0.0, 1.0, rows + 1), v, stay)
    places, on = lines.places.copy(), np.zeros(lines.places.shape[:2], dtype=bool)
    for row, loop, some in zip((0, -1), loops, corners, strict=True):
        for corner in loop.points[some]:
            near = np.linalg.norm(places[row] - corner, axis=1) < _SNAP * reach
            places[row, near], on[row, near] = corner, True
    return replace(lines, places=places, corners=tuple(np.flatnonzero(on[:, :-1]).tolist()))


# -- Discs ----------------------------------------------------------------------------------------

#: At most so many of the sharpest corners of a rim are tried as corners of the grid.
_MOST_SHARP = 7
#: What it costs to leave out a corner of the rim.
_LEFT_OUT = 0.2
#: Quads of the grids by which choices of corners are compared, and by how much of the rim corners
#: are moved.
_SAMPLE, _MOVES = 100, (1 / 16, 1 / 32, 1 / 64)
#: A place on an edge of the rim is a vertex already if it is nearer to one than this share of it.
_AT_VERTEX = 1e-3
#: Trials need so many triangles.
_ENOUGH = 3000
#: What costs less is good enough, and what gains less is not worth it.
_GOOD, _WORTH = 0.2, 0.01


def corner_choices(sharp: Sequence[float], axis: float | None) -> Iterator[tuple[float, ...]]:
    """Yield choices of four corners on the rim of a disc, as shares of its length, in order.

    Parameters
    ----------
    sharp : sequence of float
        Where it has corners, the sharpest first.
    axis : float or None
        Where a mirror crosses it.

    Examples
    --------
    >>> next(corner_choices([0.0, 0.5, 0.3, 0.8], None))
    (0.0, 0.3, 0.5, 0.8)
    """
    sharp = sorted(sharp[:_MOST_SHARP])
    yield from combinations(sharp, 4)
    if len(sharp) == 3:
        for here, there in ((0, 1), (1, 2), (2, 0)):
            a, b = sharp[here], sharp[there] + (there == 0)
            yield _in_order(*sharp, (a + b) / 2)
    if len(sharp) == 2:
        (a, b), (one, two) = sharp, (sharp[1] - sharp[0], 1.0 - sharp[1] + sharp[0])
        yield _in_order(a, b, a + one / 2, b + two / 2)
        yield _in_order(a, b, a + one / 3, b - one / 3)
        yield _in_order(a, b, b + two / 3, a - two / 3)
    start = axis if axis is not None else sharp[0] if sharp else 0.0
    for turn in (0.0, 1 / 8) if axis is not None else (0.0, 1 / 16, 1 / 8, 3 / 16):
        yield _in_order(*(start + turn + np.arange(4) / 4).tolist())


def _in_order(*at: float) -> tuple[float, ...]:
    return tuple(sorted(round(share % 1.0, 12) % 1.0 for share in at))


def _sides(loop: Loop, tails: IntArray, places: FloatArray) -> list[IntArray] | None:
    """Return the vertices of a rim from corner to corner; None where they are not in order."""
    near = [int(np.argmin(np.linalg.norm(loop.points - place, axis=1))) for place in places]
    steps = np.diff(near, append=near[0]) % len(tails)
    if steps.min() < 1 or steps.sum() != len(tails):
        return None
    twice = np.concatenate([tails, tails])
    return [twice[a : a + step + 1] for a, step in zip(near, steps.tolist(), strict=True)]


def with_corners(mesh: PolyMesh, loop: Loop, at: tuple[float, ...]) -> PolyMesh:
    """Return triangles that have vertices at some places of a rim."""
    way, faces, points = loop.way, mesh.indices.reshape(-1, 3).tolist(), mesh.vertices.tolist()
    whole = set(range(len(faces)))
    for share in at:
        number = min(int(np.searchsorted(way, share, side="right")), len(loop.sides)) - 1
        face, k = divmod(int(loop.sides[number]), 3)
        to_end = min(share - way[number], way[number + 1] - share)
        if to_end < _AT_VERTEX * (way[number + 1] - way[number]) or face not in whole:
            continue
        whole.remove(face)
        a, b, c = faces[face][k], faces[face][(k + 1) % 3], faces[face][(k + 2) % 3]
        faces[face] = [a, len(points), c]
        faces.append([len(points), b, c])
        points.append(loop.at(np.array([share]))[0].tolist())
    return PolyMesh.from_triangles(np.array(points), np.array(faces))


def disc_lines(sheet: Sheet, corners: FloatArray, n_quads: int, trial: int) -> Lines | None:
    """Lay rows and columns over a disc with corners at four places; None where they do not fit."""
    loop = loops_of(sheet.mesh, sheet.halfedges)[0]
    sides = _sides(loop, sheet.halfedges.tail[loop.sides], corners)
    if sides is None:
        return None
    chart = disc_chart(sheet, sides)
    if chart.folded:
        chart = disc_chart(sheet_of(sheet.mesh, positive=True), sides)
    lines = square_lines(chart, n_quads, trial)
    if lines is None:
        return None
    last = lines.places.shape[0] * lines.places.shape[1] - 1
    across = lines.places.shape[1] - 1
    return replace(lines, corners=(0, across, last - across, last))


def best_corners(sheet: Sheet, n_quads: int, axis: float | None) -> tuple[float, ...] | None:
    """Return the four places on the rim of a disc that make the best grid, as shares of the rim.

    Parameters
    ----------
    sheet : Sheet
        A disc.
    n_quads : int
    axis : float or None
        Where a mirror crosses the rim, as a share of its length.
    """
    loop = loops_of(sheet.mesh, sheet.halfedges)[0]
    reach = 0.5 * np.sqrt(surface_area(sheet.mesh) / n_quads) / loop.length
    sharp = [float(loop.way[k]) for k in loop.corners(reach, turns_along(sheet, loop))]
    few = _fewer(sheet)

    def cost(at: tuple[float, ...]) -> float:
        lines = disc_lines(few, loop.at(np.array(at)), _SAMPLE, _TRIAL // 2)
        left = sum(min(abs(_apart(one, a)) for a in at) > _SAME for one in sharp)
        return np.inf if lines is None else cost_of(lines.places) + _LEFT_OUT * left

    best: tuple[float, tuple[float, ...]] = (np.inf, ())
    for at in corner_choices(sharp, axis):
        # Where the corners of the rim make a good grid, nothing else is tried.
        if best[0] > _GOOD or set(at) <= set(sharp):
            best = min(best, (round(cost(at), 3), at), key=lambda one: one[0])
    for step in _MOVES:
        if best[0] > _GOOD:
            for at in _moved(best[1], step, sharp, axis):
                # What gains little is not worth a symmetry.
                if (found := round(cost(at), 3)) < best[0] - _WORTH:
                    best = found, at
    return best[1] or None


def _fewer(sheet: Sheet) -> Sheet:
    """Return a disc of fewer triangles, where there are far more than trials need."""
    if sheet.mesh.n_faces < 2 * _ENOUGH:
        return sheet
    try:
        fewer = run_engine(QSLIM, sheet.mesh, Run(_ENOUGH, 0, rim=False))
    except AttemptFailedError:
        return sheet
    return sheet if check_remeshed(sheet.mesh, fewer, 3) else sheet_of(fewer)


def _moved(
    at: tuple[float, ...], step: float, sharp: Sequence[float], axis: float | None
) -> Iterator[tuple[float, ...]]:
    """Yield choices in which corners that are not the rim's move, in pairs if they mirror."""
    image = None
    if axis is not None:
        away = [[abs(_apart(2 * axis - one, other)) for other in at] for one in at]
        image = (
            [int(np.argmin(row)) for row in away] if np.max(np.min(away, axis=1)) < _SAME else None
        )
    for number, one in enumerate(at):
        if any(abs(_apart(one, corner)) < _SAME for corner in sharp):
            continue
        for by in (step, -step):
            moved = list(at)
            moved[number] += by
            if image is not None and image[number] != number:
                moved[image[number]] -= by
            if image is None or (image[number] > number):
                yield _in_order(*moved)


def _apart(one: float, other: float) -> float:
    """Return how far it is on a rim from one share to another, at most a half either way."""
    return (one - other + 0.5) % 1.0 - 0.5


# -- The remesher ---------------------------------------------------------------------------------

#: Edges of the triangles that charts are made of are at most this share of a quad's, unless there
#: were more than so many.
_FINE, _MOST_TRIANGLES = 0.5, 20_000
#: A grid is made symmetric if no vertex moves by more than about this share of the size.
_ASYMMETRY = 0.0025
#: ... and its own image in the mirror of its model, if none is farther off than this share of an
#: edge.
_ASKEW = 0.35
#: A grid may cost at most so much. Measured: bowls 0.3, canopies 0.1 to 0.4, a vase that is three
#: times as wide in one place as in another 0.35; a canopy with a long tongue 0.9.
_MOST_COST = 0.45


def remesh_grid(mesh: PolyMesh, n_quads: int, *, progress: Progress = no_progress) -> Remeshed:
    """Lay rows and columns of quads over a disc, a tube or a torus, without any irregular vertex.

    1. A chart of the surface is made of two harmonic functions. A tube has one that is 0 on one rim
       and 1 on the other, and one around it; a disc is a rectangle, whose corners are at those of
       the rim, or where they make the best quads; a torus is cut along its two shortest ways.
    2. Rows and columns are spaced so that each is as wide as the others in space, in the mean, and
       quads are about square. The first and last row of a tube are its rims.
    3. What is then symmetric but for noise is made exactly so.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres.
    n_quads : int
        About how many quads.
    progress : callable

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If the surface has no grid, or none with good quads.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> remeshed = remesh_grid(hypar(5, 5, 40.0, 10.0), 64)
    >>> remeshed.mesh.n_faces, len(remeshed.irregular)
    (64, 0)

    References
    ----------
    Tutte, "How to draw a graph", 1963; Gortler, Gotsman, Thurston, "Discrete one-forms on meshes
    and applications to 3D mesh parameterization", CAGD 23(2), 2006; Aigerman, Lipman, "Orbifold
    Tutte embeddings", ACM TOG 34(6), 2015.
    """
    checked_count("grid", n_quads)
    source, notes = ready_source(mesh)
    if lack := lacks_grid(source):
        raise CannotMakeError(lack)
    progress("laying rows and columns", 0, 1)
    surface = cut_surface(source)
    area = surface_area(surface)
    longest = max(_FINE * np.sqrt(area / n_quads), np.sqrt(area / (0.43 * _MOST_TRIANGLES)))
    sheet = sheet_of(split_longer(surface, float(longest)))
    found = find_mirror(source)
    mirror = found if found.symmetric else None
    grids = [_symmetric(lines, mirror) for lines in _laid(source, sheet, n_quads, mirror)]
    if not grids:
        raise _failed("its rim has no four places between which rows and columns fit")
    made, lines = max(grids, key=lambda one: one[0])[1:]
    if cost_of(lines.places) > _MOST_COST:
        short, long = np.quantile(edge_lengths(made), (0.05, 0.95))
        raise _failed(
            f"its quads would be too uneven: some edges {long / short:.1f} times as long as others"
        )
    if faults := sound_faults(source, made, 4):
        raise _failed("; ".join(faults))
    rows, columns = (size - 1 for size in lines.places.shape[:2])
    told = f"a grid of {rows} × {columns} quads was laid over it ({n_quads} were wanted)"
    return finished_quads(made, "grid", [*notes, Note("grid", told, detail=True)])


def _laid(source: PolyMesh, sheet: Sheet, n_quads: int, mirror: Mirror | None) -> Iterator[Lines]:
    """Yield grids, the best of which is that with the most symmetry."""
    loops = loops_of(sheet.mesh, sheet.halfedges)
    if not loops:
        if (lines := square_lines(torus_chart(sheet), n_quads)) is not None:
            yield lines
        return
    axis = None if mirror is None else crossing(loops[0], mirror)
    if len(loops) == 2:
        chart = tube_chart(sheet, [loop.sides for loop in loops])
        if chart.folded:
            sheet = sheet_of(sheet.mesh, positive=True)
            chart = tube_chart(sheet, [loop.sides for loop in loops])
        sides = loops[0].sides
        turns = turns_around(loops_of(source, build_halfedges(source)))
        # Along the rim the chart is linear between its points.
        rim = np.unwrap(chart.flat[np.append(sides, sides[0]), 1], period=1.0)
        for share in (0.0,) if axis is None else (0.0, axis):
            phase = float(np.interp(share, loops[0].way, rim))
            yield tube_lines(sheet, loops, chart, n_quads, phase, turns)
        return
    at = best_corners(sheet, n_quads, axis)
    if at is not None:
        fine = sheet_of(with_corners(sheet.mesh, loops[0], at))
        if (lines := disc_lines(fine, loops[0].at(np.array(at)), n_quads, _TRIAL)) is not None:
            yield lines


def _symmetric(lines: Lines, mirror: Mirror | None) -> tuple[int, PolyMesh, Lines]:
    """Make a grid symmetric that is so but for noise; and say how many motions it has."""
    mesh, corners = lines.mesh, list(lines.corners)
    made = None
    with suppress(CannotMakeError):
        made = symmetrise(mesh, [_ASYMMETRY])
    # Products of many motions may be off by more than each.
    if made is None or made.moved.max() > _ASYMMETRY * largest_dimension(mesh):
        image = None if mirror is None else mirrored(mesh, mirror)
        return (1, mesh, lines) if image is None else (2, image, lines)
    points = made.mesh.vertices
    if corners:
        # Noise inside must not turn the corners of rims away, which are exact.
        here, there = points[corners], mesh.vertices[corners]
        middle, goal = here.mean(axis=0), there.mean(axis=0)
        turn = best_motions(here - middle, there - goal, mirrors=False)
        points = (points - middle) @ turn.T + goal
    return made.symmetry.order, mesh.with_vertices(points), lines


def mirrored(mesh: PolyMesh, mirror: Mirror) -> PolyMesh | None:
    """Return a grid that is its own image in the mirror of its model; None if none is near."""
    image = mirror.image(mesh.vertices)
    partner = np.asarray(cKDTree(mesh.vertices).query(image)[1])
    away = np.linalg.norm(mesh.vertices[partner] - image, axis=1)
    faces = mesh.indices.reshape(-1, 4)
    one, other = (np.unique(np.sort(some, axis=1), axis=0) for some in (faces, partner[faces]))
    near = away.max() < _ASKEW * float(np.median(edge_lengths(mesh)))
    if not near or len(one) != len(other) or np.any(one != other):
        return None
    return mesh.with_vertices((mesh.vertices + image[partner]) / 2.0)


def _failed(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"no grid could be laid over the mesh: {why}. What may help: another number of quads, or "
        "--remesh quads"
    )
