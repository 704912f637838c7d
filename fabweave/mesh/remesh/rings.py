"""Lay rings around a surface: rows of quads that part at saddles, fans at maxima, n-gons at minima.

Such a mesh has an exact 2/2 twill.
"""

from collections import defaultdict
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from scipy import optimize, sparse

from fabweave.core.arrays import (
    FloatArray,
    IntArray,
    Progress,
    frozen_value,
    no_progress,
)
from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.mesh.check import check_mesh
from fabweave.mesh.fair.energy import Energy
from fabweave.mesh.fair.fairing import RING_STEPS, fair_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.mirror import find_mirror
from fabweave.mesh.one_rings import sum_at
from fabweave.mesh.polymesh import PolyMesh, without_loose
from fabweave.mesh.remesh.chart import Chart, Sheet, loops_of, sheet_of, tube_chart
from fabweave.mesh.remesh.engines import QSLIM, AttemptFailedError, Run, run_engine
from fabweave.mesh.remesh.fit import Model, fit, model_of
from fabweave.mesh.remesh.handle_cuts import cut_handles
from fabweave.mesh.remesh.level_cuts import (
    CutSurface,
    Part,
    cut_at,
    find_saddles,
    parts_of,
    saddle_cuts,
)
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    check_remeshed,
    cut_surface,
    finished_quads,
    ready_source,
    sound_faults,
)
from fabweave.mesh.remesh.request import checked_count
from fabweave.mesh.remesh.strand_flow import (
    FAN,
    LEAST,
    MOUTH,
    NEAREST,
    Field,
    away_from,
    choose_fluxes,
    field_of,
    find_poles,
    links_of,
)
from fabweave.mesh.remesh.triangles import split_longer
from fabweave.mesh.topology import label_links
from fabweave.mesh.triangulate import surface_area

#: Edges of the triangles are at most a share of a quad's between these, the larger where that makes
#: so many triangles; there are never more than the last.
_FINE, _ENOUGH_TRIANGLES, _MOST_TRIANGLES = (0.25, 0.35), 4_500, 20_000
#: A tube to a tip is laid out at least so far, in rows; what is shorter than that has no tip.
_SHORTEST, _NO_ROOM = 0.3, 0.02
#: Of more handles the choice of strands takes too long.
MOST_HANDLES = 12
#: Rounds of leaving out poles whose limbs are too short.
_LEAVING_OUT = 8
#: So many choices of poles are laid out, until so many are sound; of these the few of least energy
#: are faired, and the best is taken.
_CHOICES, _COMPARED, _FAIRED = 12, 7, 3
#: Strands with less room than so many millimetres are hard to make.
_ROOM_MM = 6.0
#: How much rows are spaced by the strands' width, and how much all alike.
_ALIKE = 0.5
#: Levels at which the length of rings is measured, and points around each.
_LEVELS, _AROUND = 24, 48
#: Rounds of fitting at the end, and how even vertices stand.
_FIT, _EVEN = 3, 1.0


class _UnsoundError(Exception):
    """These poles make no rings."""


class _ShortLimbError(_UnsoundError):
    """The limb of a pole has no room for a ring."""

    def __init__(self, pole: int) -> None:
        super().__init__("a limb is shorter than a quad")
        self.pole = pole


@frozen_value
class Tube:
    """A tube of rings.

    Parameters
    ----------
    chart : Chart
        From its lower end to its upper one.
    ends : (int, int)
        The saddles below and above; -1 - p at pole p, and V + p where pole p is a cut.
    at : tuple of two (K, 2) float arrays
        At each end, where the saddle is around the tube, and which vertex of the chart it is.
    rims : tuple of two (L,) int arrays
        At each end, the vertices of the cut surface around it.
    way : tuple of two (L,) float arrays
        Where these are around the tube.
    low, high : float
        The heights of its ends.
    """

    chart: Chart
    ends: tuple[int, int]
    at: tuple[FloatArray, FloatArray]
    rims: tuple[IntArray, IntArray]
    way: tuple[FloatArray, FloatArray]
    low: float
    high: float

    @cached_property
    def lengths(self) -> FloatArray:
        """How long rings are at some levels, evenly from end to end."""
        u = (np.arange(_LEVELS) + 0.5) / _LEVELS
        places = self.chart.places(u, np.linspace(0.0, 1.0, _AROUND, endpoint=False))
        return np.linalg.norm(np.roll(places, -1, axis=1) - places, axis=2).sum(axis=1)


def remesh_rings(mesh: PolyMesh, n_quads: int, *, progress: Progress = no_progress) -> Remeshed:
    """Lay rings of quads around a mesh, which then has an exact 2/2 twill.

    1. Tips of the surface may be poles of a harmonic function, and so may rims. Where whole fluxes
       add up to nothing, its lines are rings that as many strands cross as flow, and strands part
       at its saddles. Signs and fluxes are those with which quads are the most even.
    2. The surface is cut along the lines of its saddles, into tubes. Each is a chart, with rows of
       its own that are spaced by their girth, and begins and ends at the saddles.
    3. At a maximum a fan of triangles closes it, at a minimum a polygon; rims stay open.
    4. Handles are cut along short loops first. Both sides of a cut are lines, across which strands
       go on, and all ways around a handle have an even number of rows.

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
        If nothing sound came of it.

    Notes
    -----
    *Definition.* A mesh is of rings if each vertex has a height, a whole number, such that all
    faces are quads with the heights h, h, h + 1, h + 1 in order, triangles h, h, h + 1 in fans
    around their third corner, or polygons all of whose corners are at h and all of whose neighbours
    are above. The row of an edge is the sum of the heights at its ends.

    Around handles heights come back to themselves modulo 2.

    *Statement.* Each mesh of rings has an exact 2/2 twill, which its rows give; so each closed
    surface that can be oriented has one. The proof is at
    :func:`fabweave.weave.twill.rows.ring_rows`. Quads alone never do: some of their vertices have
    other than 4, 8, 12, ... edges.

    References
    ----------
    The statement is fabweave's own. Harmonic functions with whole fluxes as parameters: Tong,
    Alliez, Cohen-Steiner, Desbrun, "Designing quadrangulations with discrete harmonic forms", SGP
    2006. Saddles: Dong, Bremer, Garland, Pascucci, Hart, "Spectral surface quadrangulation", ACM
    TOG 25(3), 2006.
    """
    checked_count("rings", n_quads)
    source, notes = ready_source(mesh)
    handles = sum(int(genus or 0) for genus in check_mesh(source).component_genus)
    if handles > MOST_HANDLES:
        raise CannotMakeError(
            f"rings are laid around at most {MOST_HANDLES} handles, and this model has {handles}; "
            f"--bodies wrap closes small ones, and --remesh quads:{n_quads} works"
        )
    side = float(np.sqrt(surface_area(source) / n_quads))
    bodies = _bodies(source)
    laid, told = [], []
    for number, body in enumerate(bodies):
        progress("laying rings", number, len(bodies))
        made, text = _laid(body, side)
        laid.append(made)
        told.append(text)
    made = _together(laid)
    if faults := sound_faults(source, made, None):
        raise _failed("; ".join(faults))
    texts = Note.each("rings", told)
    return finished_quads(made, "rings", [*notes, *texts])


def _failed(why: str) -> CannotMakeError:
    return CannotMakeError(
        f"no rings could be laid around the mesh: {why}. What may help: another number of quads; "
        "--bodies wrap, if the mesh runs through itself; or --remesh quads"
    )


def _bodies(source: PolyMesh) -> list[PolyMesh]:
    half = build_halfedges(source)
    label = label_links(half.tail, half.head, source.n_vertices)[1]
    label = label[source.indices[source.offsets[:-1]]]
    faces = source.faces()
    return [
        without_loose(
            PolyMesh.from_faces(
                source.vertices,
                [f for f, name in zip(faces, label.tolist(), strict=True) if name == one],
            )
        )
        for one in np.unique(label).tolist()
    ]


def _together(meshes: list[PolyMesh]) -> PolyMesh:
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = [
        [v + int(start) for v in face]
        for mesh, start in zip(meshes, starts[:-1], strict=True)
        for face in mesh.faces()
    ]
    return PolyMesh.from_faces(np.concatenate([mesh.vertices for mesh in meshes]), faces)


def _fine(source: PolyMesh, side: float) -> PolyMesh:
    """Return a surface in triangles that are small against quads, but not too many."""
    surface = cut_surface(source)
    if surface.n_faces > 2 * _MOST_TRIANGLES:
        try:
            fewer = run_engine(QSLIM, surface, Run(_MOST_TRIANGLES, 0, rim=False))
        except AttemptFailedError:
            fewer = surface
        surface = surface if check_remeshed(surface, fewer, 3) else fewer
    area, (fine, coarse) = surface_area(surface), _FINE
    enough, least = np.sqrt(area / (0.43 * np.array([_ENOUGH_TRIANGLES, _MOST_TRIANGLES])))
    return split_longer(surface, max(float(np.clip(enough, fine * side, coarse * side)), least))


def _laid(body: PolyMesh, side: float) -> tuple[PolyMesh, str]:
    """Return rings around one body, and words on them."""
    cut, pairs = cut_handles(_fine(body, side))
    sheet = sheet_of(cut, positive=True)
    links = links_of(sheet, pairs)
    mirror = find_mirror(body)
    loops = loops_of(sheet.mesh, sheet.halfedges)
    rims = [sheet.halfedges.tail[loop.sides] for loop in loops]
    at_cuts = np.concatenate([np.zeros(0, dtype=np.int64), *(np.concatenate(p) for p in pairs)])
    rims = [rim for rim in rims if rim[0] not in at_cuts]
    poles = find_poles(
        sheet, links, rims, [2] * len(rims), pairs, side, mirror if mirror.symmetric else None
    )
    field = field_of(sheet, links, poles, side)
    model = model_of(body, int(surface_area(body) / side**2))
    found: list[tuple[float, IntArray, PolyMesh]] = []
    without: set[int] = set()
    tried: set[tuple[int, ...]] = set()
    why = "it has no two ends"
    for _ in range(_LEAVING_OUT):
        n_without = len(without)
        for flux in choose_fluxes(field, _CHOICES, without):
            named = tuple(flux.tolist())
            if named in tried or any(flux[poles.kind == kind].any() for kind in without):
                continue
            tried.add(named)
            try:
                made = fit(model, _rings(sheet, field, flux, side), _FIT, _EVEN)
            except _ShortLimbError as error:
                without.add(int(poles.kind[error.pole]))
                why = str(error)
                continue
            except _UnsoundError as error:
                why = str(error)
                continue
            if faults := sound_faults(body, made, None):
                why = "; ".join(faults)
                continue
            found.append((_waviness(model, made), flux, made))
            if len(found) == _COMPARED:
                break
        if len(found) == _COMPARED or len(without) == n_without:
            break
    if not found:
        raise _failed(why)
    few = sorted(found, key=lambda one: one[0])[:_FAIRED]
    faired = [_waviness(model, fair_mesh(one, model, RING_STEPS).mesh) for _, _, one in few]
    _, flux, made = few[int(np.argmin(faired))]
    points = np.array([len(site) == 1 for site in poles.sites])
    fans, polygons = int(np.sum(points & (flux > 0))), int(np.sum(points & (flux < 0)))
    told = agree(fans, "rings: {n} tip[|s] with a fan") + agree(
        polygons, ", {n} with a polygon, and strands "
    )
    return made, told + few_of([str(abs(n)) for n in flux[flux != 0].tolist()], 20)


def _waviness(model: Model, mesh: PolyMesh) -> float:
    """Return the energy by half-edge; more where a strand has no room."""
    energy = Energy(mesh, model)
    room = float(energy.rooms(mesh.vertices).min())
    lack = max(float(np.log(_ROOM_MM / max(room, 1e-6))), 0.0)
    return energy.at(mesh.vertices).value / mesh.n_corners + lack


def _rings(sheet: Sheet, field: Field, flux: IntArray, side: float) -> PolyMesh:
    """Return rings whose strands come together as given."""
    height = field.height(flux)
    # No two vertices inside are as high.
    rim = np.zeros(len(height), dtype=bool)
    rim[sheet.halfedges.tail[sheet.halfedges.twin < 0]] = True
    height = height + np.where(rim, 0.0, 1e-9 * np.arange(len(height)) / len(height))
    try:
        saddles = find_saddles(sheet.halfedges, height, len(height))
    except ValueError as error:
        raise _UnsoundError(str(error)) from error
    surface = saddle_cuts(sheet.mesh.vertices, sheet.corners, height, saddles)
    tubes = [_tube(surface, part, saddles, field, flux, side) for part in parts_of(surface)]
    strands = _strands(tubes, saddles, field, flux)
    rows = _rows(tubes, strands, sheet.mesh.n_vertices, side)
    return _assembled(sheet, tubes, strands, rows, saddles, field)


def _tube(
    surface: CutSurface,
    part: Part,
    saddles: list[int],
    field: Field,
    flux: IntArray,
    side: float,
) -> Tube:
    """Make a chart of a part, from its lower end to its upper one."""
    poles = field.poles
    sites = {
        int(v): p
        for at in (poles.sites, poles.backs)
        for p, site in enumerate(at)
        if flux[p]
        for v in site
    }
    rim_of = {v: p for v, p in sites.items() if len(poles.sites[p]) > 1}
    points = [k for k, v in enumerate(part.vertex.tolist()) if v in sites and v not in rim_of]
    vertex, heights = part.vertex, surface.height[part.vertex]
    mesh = part.mesh
    ended = -1
    if len(points) > 1:
        raise _UnsoundError("two tips are in one tube")
    if points:
        ended = sites[int(vertex[points[0]])]
        try:
            mesh, vertex, heights = _without_tip(part, heights, points[0], int(flux[ended]), side)
        except _UnsoundError as error:
            raise _ShortLimbError(ended) from error
    sheet = sheet_of(mesh, positive=True)
    loops = loops_of(mesh, sheet.halfedges)
    if len(loops) != 2:
        raise _UnsoundError(f"a part between saddles has {len(loops)} ends")
    tails = [sheet.halfedges.tail[loop.sides] for loop in loops]
    level = [float(np.median(heights[tail])) for tail in tails]
    order = [0, 1] if level[0] < level[1] else [1, 0]
    chart = tube_chart(sheet, [loops[k].sides for k in order])
    around = np.full(mesh.n_vertices, 0.0)
    around[sheet.corners.reshape(-1)] = chart.flat[: 3 * mesh.n_faces, 1] % 1.0
    ends, at, sides, ways = [], [], [], []
    for k in order:
        tail = tails[k]
        own = vertex[tail]
        here = [saddle for saddle in saddles if saddle in own]
        rims_here = {rim_of[int(v)] for v in own if int(v) in rim_of}
        if len(here) == 1 and not rims_here:
            copies = tail[own == here[0]]
            at.append(around[copies])
            ends.append(here[0])
        elif len(rims_here) == 1 and not here:
            (p,) = rims_here
            # Both sides of a cut begin at one place.
            both = [site[0] for site in (poles.sites[p], poles.backs[p]) if len(site)]
            at.append(around[tail[np.isin(own, both)]] if len(both) == 2 else np.zeros(0))
            ends.append(len(field.potentials[0]) + p if len(both) == 2 else -1 - p)
        elif ended >= 0 and not here:
            at.append(np.zeros(0))
            ends.append(-1 - ended)
        else:
            raise _UnsoundError("a tube ends at several saddles")
        sides.append(own)
        ways.append(around[tail])
    return Tube(
        chart,
        (ends[0], ends[1]),
        (at[0], at[1]),
        (sides[0], sides[1]),
        (ways[0], ways[1]),
        level[order[0]],
        level[order[1]],
    )


def _without_tip(
    part: Part, heights: FloatArray, tip: int, flux: int, side: float
) -> tuple[PolyMesh, IntArray, FloatArray]:
    """Cut the end off a part with a tip: a ring goes around it there."""
    mesh = part.mesh
    away = away_from(links_of(sheet_of(mesh)), np.array([tip])) / side
    reach = max(NEAREST, (FAN if flux > 0 else MOUTH) * abs(flux))
    sign = 1.0 if flux > 0 else -1.0
    up = sign * heights
    half = build_halfedges(mesh)
    other = up.min()
    crossing = (away[half.tail] < reach) != (away[half.head] < reach)
    if not crossing.any():
        raise _UnsoundError("a limb is shorter than a quad")
    level = float(np.mean((up[half.tail] + up[half.head])[crossing]) / 2.0)
    # Where there is no room for a row, a little of the limb is left to lay out its only ring.
    top = float(np.delete(up, tip).max())
    level = min(max(level, other + _SHORTEST), other + 0.5 * (top - other))
    if level - other < _NO_ROOM:
        raise _UnsoundError("a limb is shorter than a quad")
    level *= sign
    near = np.abs(heights - level) < 1e-9
    level += 1e-7 * bool(near.any())
    triangles = mesh.indices.reshape(-1, 3)
    surface = CutSurface(mesh.vertices, heights, triangles, np.zeros((0, 2), dtype=np.int64))
    low, high = heights[triangles].min(axis=1), heights[triangles].max(axis=1)
    cut = cut_at(surface, level, (low < level) & (high > level))
    kept = sign * cut.height[cut.triangles].mean(axis=1) < sign * level
    whole = PolyMesh.from_triangles(cut.points, cut.triangles[kept])
    used = np.zeros(len(cut.points), dtype=bool)
    used[whole.indices] = True
    vertex = np.concatenate([part.vertex, np.full(len(cut.points) - len(part.vertex), -1)])
    return without_loose(whole), vertex[used], cut.height[used]


def _strands(tubes: list[Tube], saddles: list[int], field: Field, flux: IntArray) -> IntArray:
    """Return how many strands each tube has: what comes to a saddle leaves it."""
    count, n_vertices = len(tubes), len(field.potentials[0])
    low, high = np.array([tube.ends for tube in tubes]).T
    rows, wanted = [(high == node) * 1.0 - (low == node) for node in saddles], [0.0] * len(saddles)
    for p in np.flatnonzero(flux).tolist():
        if field.poles.ends[p]:
            rows.append((high == -1 - p) * 1.0 - (low == -1 - p))
            wanted.append(float(flux[p]))
        else:
            rows += [(end == n_vertices + p) * 1.0 for end in (low, high)]
            wanted += [float(abs(flux[p]))] * 2
    found = optimize.milp(
        np.ones(count),
        constraints=optimize.LinearConstraint(np.array(rows), wanted, wanted),
        integrality=np.ones(count, dtype=np.int64),
        bounds=optimize.Bounds(LEAST, np.inf),
    )
    if found.x is None:
        raise _UnsoundError("a limb would have fewer than four strands")
    return np.rint(found.x).astype(np.int64)


def _density(tube: Tube, strands: int, side: float) -> FloatArray:
    """Return how many rows there are up to some levels of a tube, (L + 1,)."""
    width = tube.lengths / strands / side
    step = (tube.high - tube.low) / _LEVELS * width**_ALIKE
    return np.concatenate([[0.0], np.cumsum(step)])


def _rows(tubes: list[Tube], strands: IntArray, n_vertices: int, side: float) -> IntArray:
    """Return how many rows each tube has: none where two saddles, or one and a tip, are near.

    Each line between tubes is even or odd, so that all ways around a handle are even.
    """
    ideal = np.array(
        [float(_density(tube, n, side)[-1]) for tube, n in zip(tubes, strands, strict=True)]
    )
    ends = np.array([tube.ends for tube in tubes])
    # A line that touches itself cannot be that of a tip, of a cut, or another such line.
    touching = np.array([max(len(at) for at in tube.at) == 2 for tube in tubes])
    plain = np.array([min(len(at) for at in tube.at) == 1 for tube in tubes])
    plain |= ~touching & (ends.max(axis=1) >= 0)
    least = np.where(plain & (ends.max(axis=1) < n_vertices), 0, 1)
    _, node = np.unique(ends, return_inverse=True)
    node = node.reshape(-1, 2)
    count, n_nodes = len(tubes), int(node.max()) + 1
    # Unknowns: whether each node is odd, rows, half of the even rest, and how far off rows are.
    odd = sparse.csr_array(
        (
            np.tile([-1.0, 1.0], count),
            (np.repeat(np.arange(count), 2), node.reshape(-1)),
        ),
        shape=(count, n_nodes),
    )
    eye = sparse.eye_array(count)
    whole = sparse.hstack([odd, -eye, 2.0 * eye, 0.0 * eye])
    none = sparse.csr_array((count, n_nodes))
    off = [sparse.hstack([none, s * eye, 0.0 * eye, eye]) for s in (1.0, -1.0)]
    found = optimize.milp(
        np.concatenate([np.zeros(n_nodes + 2 * count), 1.0 / (1.0 + ideal)]),
        constraints=[
            optimize.LinearConstraint(sparse.csc_array(whole), 0.0, 0.0),
            optimize.LinearConstraint(sparse.csc_array(off[0]), ideal, np.inf),
            optimize.LinearConstraint(sparse.csc_array(off[1]), -ideal, np.inf),
        ],
        integrality=np.repeat([1, 1, 1, 0], [n_nodes, count, count, count]),
        bounds=optimize.Bounds(
            np.concatenate([np.zeros(n_nodes), least, np.full(2 * count, -np.inf)]),
            np.concatenate([np.ones(n_nodes), np.full(3 * count, np.inf)]),
        ),
    )
    if found.x is None:
        raise _UnsoundError("rows around a handle do not fit")
    return np.rint(found.x[n_nodes : n_nodes + count]).astype(np.int64)


def _laid_along(tube: Tube, n: int, rows: int) -> tuple[FloatArray, int]:
    """Return the points of a tube's rings, and by how many the last begins after the first.

    The first point of the first ring is at the saddle below, and the turn to the saddle above is
    made on the way, by half a quad at most.
    """
    known = [at[0] for at in tube.at if len(at)] or [0.0]
    first, last = known[0], known[-1]
    turn = round(n * (last - first))
    way = _density(tube, n, 1.0)
    share = np.interp(
        np.arange(rows + 1) / max(rows, 1), way / way[-1], np.linspace(0.0, 1.0, _LEVELS + 1)
    )
    if not rows:
        # Both ends are one line: in the middle, or on that of the saddle if there is a tip.
        share = np.array([0.5 if min(tube.ends) >= 0 else float(tube.ends[0] < 0)])
    ease = share * share * (3.0 - 2.0 * share)
    phase = first + ease * (last - turn / n - first) * (rows > 0)
    around = np.arange(n) / n
    points = [
        tube.chart.places(np.array([u]), p + around)[0] for u, p in zip(share, phase, strict=True)
    ]
    return np.concatenate(points), turn


def _assembled(
    sheet: Sheet,
    tubes: list[Tube],
    strands: IntArray,
    rows: IntArray,
    saddles: list[int],
    field: Field,
) -> PolyMesh:
    """Join the rings of all tubes at saddles, and close them at tips."""
    places: list[FloatArray] = []
    rings: list[tuple[IntArray, IntArray]] = []
    faces: list[list[int]] = []
    count = 0
    for tube, n, r in zip(tubes, strands.tolist(), rows.tolist(), strict=True):
        points, turn = _laid_along(tube, n, r)
        places.append(points)
        number = count + np.arange((r + 1) * n).reshape(r + 1, n)
        count += len(points)
        rings.append((number[0], np.roll(number[-1], -turn)))
        a, b = number[:-1], number[1:]
        quads = np.stack([a, b, np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)], axis=-1)
        faces += quads.reshape(-1, 4).tolist()
        below, above = (
            -1 - end if end < 0 and len(field.poles.sites[-1 - end]) == 1 else -1
            for end in tube.ends
        )
        if below >= 0:
            faces.append(number[0].tolist())
        if above >= 0:
            ring = number[-1].tolist()
            faces += [[ring[k - 1], count, ring[k]] for k in range(n)]
            places.append(sheet.mesh.vertices[field.poles.sites[above]])
            count += 1
    same = [pair for saddle in saddles for pair in _joined(saddle, tubes, strands, rings)]
    for node in {end for tube in tubes for end in tube.ends if end >= sheet.mesh.n_vertices}:
        # Where a handle was cut, one tube ends and the next begins.
        (ends,) = (r[1] for t, r in zip(tubes, rings, strict=True) if t.ends[1] == node)
        (begins,) = (r[0] for t, r in zip(tubes, rings, strict=True) if t.ends[0] == node)
        same += zip(ends.tolist(), begins.tolist(), strict=True)
    one, other = np.array(same, dtype=np.int64).reshape(-1, 2).T
    n_vertices, label = label_links(one, other, count)
    total = sum_at(label, np.concatenate(places), n_vertices)
    joined = [label[face].tolist() for face in faces]
    if any(len(set(face)) < len(face) for face in joined):
        raise _UnsoundError("two saddles are at one place")
    return PolyMesh.from_faces(total / np.bincount(label, minlength=n_vertices)[:, None], joined)


def _joined(
    saddle: int, tubes: list[Tube], strands: IntArray, rings: list[tuple[IntArray, IntArray]]
) -> Iterator[tuple[int, int]]:
    """Yield which points of rings are the same, at a saddle."""
    sides: dict[int, list[int]] = defaultdict(list)
    for number, tube in enumerate(tubes):
        for end in (0, 1):
            if tube.ends[end] == saddle:
                sides[end].append(number)
    # Tubes below a saddle end there with their upper end.
    if sorted(len(sides[end]) for end in (0, 1)) != [1, 2]:
        raise _UnsoundError("a saddle has other than three tubes")
    one = 1 if len(sides[1]) == 1 else 0
    (trunk,), limbs = sides[one], sides[1 - one]
    tube, ring = tubes[trunk], rings[trunk][one]
    a, b = tube.at[one]
    between = (b - a) % 1.0
    way = (tube.way[one] - a) % 1.0
    in_first = set(tube.rims[one][(way > 1e-9) & (way < between - 1e-9)].tolist())
    first, second = limbs
    if len(in_first & set(tubes[first].rims[1 - one].tolist())) <= 1:
        first, second = second, first
    if not len(in_first & set(tubes[first].rims[1 - one].tolist())):
        raise _UnsoundError("limbs at a saddle do not fit")
    n_first = int(strands[first])
    for limb, start in ((first, 0), (second, n_first)):
        own = rings[limb][1 - one]
        for k, v in enumerate(own.tolist()):
            yield int(ring[(start + k) % len(ring)]), v
    yield int(ring[0]), int(ring[n_first])
