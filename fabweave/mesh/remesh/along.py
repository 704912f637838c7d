"""Lay quads along a direction: compare what remeshers make of grooved surfaces."""

import math
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import SuperLU, splu

from fabweave.core.arrays import FloatArray, IntArray, Progress, frozen_value, no_progress, unit
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import group_edges
from fabweave.mesh.one_rings import sum_at
from fabweave.mesh.polymesh import PolyMesh, triangle_normals
from fabweave.mesh.remesh.direction import (
    Alignment,
    Direction,
    mean_turn_deg,
    triangle_directions,
)
from fabweave.mesh.remesh.engines import (
    LARGE,
    MUCH_ALIKE,
    AttemptFailedError,
    Candidate,
    Engine,
    Run,
    Task,
    as_near,
    candidate_of,
    fitted_to,
    results_of,
    summed_up,
)
from fabweave.mesh.remesh.fit import fit, model_of
from fabweave.mesh.remesh.remeshed import check_remeshed
from fabweave.mesh.triangulate import surface_area

#: Grooves are so far apart, as a share of a quad's side, and no nearer than so many edges.
_SPACING = 0.5
_EDGES = 4.5
#: At most so many triangles: more would be slow, and grooves are wider then.
_MOST = 160_000
#: How often noise is filtered and pressed towards ridges and valleys, and how hard.
_PRESSINGS, _PRESS = 15, 2.0
#: The two scales of the filter are apart by this factor; it passes best what is between them.
_BAND = 2.0
_SEED = 18


@dataclass(frozen=True)
class Groove:
    """How a surface is grooved.

    Parameters
    ----------
    slope : float
        How steep its flanks are at most, as the tangent of an angle.
    length : float
        How straight grooves are kept: over so many times their spacing.
    """

    slope: float
    length: float


def groove_spacing(surface: PolyMesh, n_quads: int) -> float:
    """Return how far apart grooves are: about half the side of a quad.

    Parameters
    ----------
    surface : PolyMesh
        Triangles.
    n_quads : int
        How many quads are to cover it.
    """
    area = surface_area(surface)
    # Equilateral triangles with edges of a length h have an area of h² √3 / 4.
    least = math.sqrt(area / _MOST * 4.0 / math.sqrt(3.0)) * _EDGES
    return max(_SPACING * math.sqrt(area / n_quads), least)


def fine_enough(surface: PolyMesh, spacing: float) -> PolyMesh:
    """Cut edges of triangles in two until none is too long for grooves.

    Parameters
    ----------
    surface : PolyMesh
        Triangles.
    spacing : float
        How far apart the grooves will be.

    Returns
    -------
    PolyMesh
        The same surface.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import octahedron
    >>> fine_enough(octahedron(), float(np.ptp(octahedron().vertices))).n_faces
    128
    """
    points, triangles = surface.vertices, surface.indices.reshape(-1, 3)
    longest = spacing / _EDGES
    while len(triangles) < _MOST:
        ends = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1), axis=-1)
        length = np.linalg.norm(points[ends[..., 1]] - points[ends[..., 0]], axis=-1)
        long = length > longest
        if not long.any():
            break
        edges, number = np.unique(ends[long], axis=0, return_inverse=True)
        middle = np.full(triangles.shape, -1)
        middle[long] = len(points) + number.reshape(-1)
        points = np.concatenate([points, points[edges].mean(axis=1)])
        triangles = _cut(triangles, middle)
    return PolyMesh.from_faces(points, triangles)


def _cut(triangles: IntArray, middle: IntArray) -> IntArray:
    """Cut triangles at the middles of their sides; -1 where a side is left whole."""
    cuts = (middle >= 0).sum(axis=1)
    # Where one side is cut it comes first; where two are, the whole one comes last.
    turn = np.where(cuts == 1, np.argmax(middle >= 0, axis=1), (np.argmin(middle, axis=1) + 1) % 3)
    order = (turn[:, None] + np.arange(3)) % 3
    (a, b, c), (p, q, r) = (
        np.take_along_axis(values, order, axis=1).T for values in (triangles, middle)
    )
    one, two, three = (cuts == number for number in (1, 2, 3))
    parts = [
        np.stack([a, b, c], axis=1)[cuts == 0],
        *(np.stack(corners, axis=1)[one] for corners in ((a, p, c), (p, b, c))),
        *(np.stack(corners, axis=1)[two] for corners in ((p, b, q), (a, p, q), (a, q, c))),
        *(
            np.stack(corners, axis=1)[three]
            for corners in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))
        ),
    ]
    return np.concatenate(parts)


def grooved(surface: PolyMesh, direction: Direction, groove: Groove, spacing: float) -> PolyMesh:
    """Press grooves along a direction into a surface.

    Noise is smoothed, much along the direction and little across it, so that waves of one length
    remain, and pressed towards ridges and valleys; after some rounds these run along the direction,
    evenly spaced. Where the direction does not matter they run any way, and are shallow.

    Parameters
    ----------
    surface : PolyMesh
        Triangles that are fine enough.
    direction : Direction
    groove : Groove
    spacing : float
        From ridge to ridge.

    Returns
    -------
    PolyMesh
        The same triangles; the boundary stays.

    References
    ----------
    Witkin, Kass, "Reaction-diffusion textures", SIGGRAPH 1991: stripes that follow a field, from
    diffusion that is stronger along it.
    """
    triangles = surface.indices.reshape(-1, 3)
    along = triangle_directions(surface, direction)
    strength = np.linalg.norm(along, axis=1)
    mass, gradient, area = _operators(surface)
    weighed = sparse.diags_array(area)
    stiff = sum(part.T @ weighed @ part for part in gradient)
    down = sum(sparse.diags_array(unit(along)[:, k]) @ gradient[k] for k in range(3))
    strong = (groove.length * spacing) ** 2 * (
        down.T @ sparse.diags_array(area * np.minimum(strength, 1.0)) @ down
    )
    # The difference of two filters passes best the waves whose number is 1 / sqrt(fine wide).
    fine = spacing / (2.0 * math.pi) / math.sqrt(_BAND)
    filters = [
        _solver(sparse.diags_array(mass) + scale**2 * stiff + strong)
        for scale in (fine, _BAND * fine)
    ]
    height = np.random.default_rng(_SEED).standard_normal(len(mass))
    for _ in range(_PRESSINGS):
        height = filters[0].solve(mass * height) - filters[1].solve(mass * height)
        size = math.sqrt(float(mass @ height**2) / float(mass.sum())) or 1.0
        height = np.tanh(_PRESS * height / size)
    matters = sum_at(triangles.reshape(-1), np.repeat(area * strength, 3)[:, None], len(mass))
    depth = groove.slope * spacing / (2.0 * math.pi)
    height = height * depth * np.minimum(matters[:, 0] / (3.0 * mass), 1.0)
    height[group_edges(surface).rim] = 0.0
    normal = unit(
        sum_at(triangles.reshape(-1), np.repeat(triangle_normals(surface), 3, axis=0), len(mass))
    )
    return surface.with_vertices(surface.vertices + height[:, None] * normal)


def _solver(matrix: sparse.sparray) -> SuperLU:
    """Factor a symmetric positive definite matrix; so it takes half the time of a general one."""
    return splu(
        sparse.csc_array(matrix),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )


def _operators(surface: PolyMesh) -> tuple[FloatArray, list[sparse.csr_array], FloatArray]:
    """Return the area of each vertex, the gradient on each triangle by axis, and its area."""
    triangles, count = surface.indices.reshape(-1, 3), surface.n_vertices
    normal = triangle_normals(surface)
    twice = np.linalg.norm(normal, axis=1)
    safe = np.where(twice > 0, twice, np.inf)
    corner = surface.vertices[triangles]
    # The gradient of a corner's share is the opposite side, turned by a right angle, over twice
    # the area.
    opposite = np.roll(corner, -2, axis=1) - np.roll(corner, -1, axis=1)
    slope = np.cross((normal / safe[:, None])[:, None, :], opposite) / safe[:, None, None]
    offsets = 3 * np.arange(len(triangles) + 1)
    gradient = [
        sparse.csr_array(
            (slope[:, :, axis].reshape(-1), triangles.reshape(-1), offsets),
            shape=(len(triangles), count),
        )
        for axis in range(3)
    ]
    mass = np.bincount(triangles.reshape(-1), np.repeat(twice / 6.0, 3), minlength=count)
    least = float(mass.max(initial=1.0)) * 1e-9
    return np.maximum(mass, least), gradient, twice / 2.0


#: Grooves that are tried: on spot, bob and a sphere, along x and y, each was the best of some.
#: Instant Meshes makes holes of all but the gentlest.
_GENTLE = Groove(0.5, 1.0)
_GROOVES = (Groove(0.8, 1.0), Groove(0.8, 0.5), _GENTLE, Groove(1.2, 0.7))
#: Results with as many quads as wanted up to this factor are taken first.
_ABOUT = 1.3
#: Rounds of fitting in which edges turn.
_ROUNDS = 8
#: More quads than these are as fine as the grooves can be, and go their own ways between them.
_MOST_GROOVED = 2500
#: Results follow the direction as well as one another up to this difference, in degrees.
_ALIKE_DEG = 1.0


@frozen_value
class _Result:
    """A result, and how far its edges turn from the direction in the end, and before they turned.

    Parameters
    ----------
    candidate : Candidate
    on : PolyMesh
        What the remesher saw.
    turn_deg, plain_deg : float
    """

    candidate: Candidate
    on: PolyMesh
    turn_deg: float
    plain_deg: float


def best_along(
    engines: Sequence[Engine],
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    direction: Direction,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
) -> tuple[Candidate | None, Alignment | None, list[str]]:
    """Lay quads over a surface whose edges run along a direction.

    Remeshers are run on the surface as it is, and on the surface with fine grooves along the
    direction, which they follow (see `grooves`). All results are fitted to the given surface, and
    their edges turned into the direction as far as that goes. Of those that pass the check, do not
    run through themselves, have about as many quads as wanted (30 %), and are nearly as near to the
    given surface as the nearest one (root mean square; half as far again, or 0.02 % of the size),
    the one with the least mean angle is taken; of those within one degree of it, the one with the
    fewest irregular vertices.

    Parameters
    ----------
    engines : sequence of Engine
        The remeshers; all that are installed are compared.
    source, surface : PolyMesh
        The given surface, and triangles that the remeshers see.
    wanted : int
        About how many quads.
    direction : Direction
    seed : int
        The first seed; following runs take the following ones.
    progress : callable
        Told about each run.

    Returns
    -------
    best : Candidate or None
    alignment : Alignment or None
        How well it follows the direction.
    failures : list of str
        Why the runs that gave nothing failed.
    """
    engines = [engine for engine in engines if engine.installed]
    rim = not check_mesh(source).closed
    progress("grooving the surface", 0, 1)
    tasks = _tasks(engines, surface, wanted, direction, seed, rim=rim)
    model = model_of(source, wanted)
    good: list[_Result] = []
    failures: dict[str, list[str]] = {engine.name: [] for engine in engines}
    judge = partial(fitted_to, model, source, wanted)
    with closing(results_of(tasks, judge, progress)) as found:
        for task, plain in found:
            if isinstance(plain, AttemptFailedError):
                failures[task.engine.name].append(str(plain))
                continue
            turned = fit(model, plain, _ROUNDS, along=direction)
            if check_remeshed(source, turned):
                turned = plain
            run = replace(task.run, n_faces=wanted)
            good.append(
                _Result(
                    candidate_of(task.engine, source, turned, run),
                    task.surface,
                    mean_turn_deg(turned, direction),
                    mean_turn_deg(plain, direction),
                )
            )
    told = [text for engine in engines for text in summed_up(engine, failures[engine.name])]
    if not good:
        return None, None, told
    best = _best(good, wanted)
    # The first result for which nothing was done shows what the wish has changed.
    unturned = next((one.plain_deg for one in good if one.on is surface), math.nan)
    alignment = Alignment(direction.title, best.turn_deg, unturned, len(good))
    return best.candidate, alignment, told


def _tasks(
    engines: Sequence[Engine],
    surface: PolyMesh,
    wanted: int,
    direction: Direction,
    seed: int,
    *,
    rim: bool,
) -> list[Task]:
    """Return the runs to compare: first those on the surface as it is."""
    runs = {engine.name: [(surface, wanted)] for engine in engines}
    if wanted <= _MOST_GROOVED and surface.n_faces <= LARGE:
        spacing = groove_spacing(surface, wanted)
        fine = fine_enough(surface, spacing)
        for groove in _GROOVES:
            rough = grooved(fine, direction, groove, spacing)
            # Remeshers see flanks as more surface to cover.
            aim = round(wanted * surface_area(rough) / surface_area(fine))
            for engine in engines:
                if engine.seeded or groove is _GENTLE:
                    runs[engine.name].append((rough, aim))
    return [
        Task(engine, one, Run(aim, seed + number, rim=rim))
        for engine in engines
        for number, (one, aim) in enumerate(runs[engine.name])
    ]


def _best(good: Sequence[_Result], wanted: int) -> _Result:
    """Return the best of some results (see best_along)."""
    number = [one.candidate.mesh.n_faces / wanted for one in good]
    about = [one for one, ratio in zip(good, number, strict=True) if 1 / _ABOUT <= ratio <= _ABOUT]
    good = about or good
    near = set(map(id, as_near([one.candidate for one in good], MUCH_ALIKE)))
    alike = [one for one in good if id(one.candidate) in near]
    least = min(one.turn_deg for one in alike)
    close = [one for one in alike if one.turn_deg <= least + _ALIKE_DEG]
    return min(close, key=lambda one: (one.candidate.irregular, one.turn_deg))
