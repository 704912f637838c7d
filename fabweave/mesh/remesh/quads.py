"""Turn a mesh of triangles into a mesh of quads."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.spatial import cKDTree

from fabweave.core.arrays import Progress, no_progress
from fabweave.core.errors import CannotMakeError
from fabweave.core.finding import Note
from fabweave.core.messages import agree, few_of
from fabweave.mesh.bodies import bodies_of
from fabweave.mesh.check import check_mesh
from fabweave.mesh.halfedge import build_halfedges
from fabweave.mesh.intersections import self_intersections
from fabweave.mesh.likeness import likeness, nearly_as_like
from fabweave.mesh.mirror import Mirror, find_mirror, joined_with_image, sound_half
from fabweave.mesh.one_rings import find_irregular, interior_valences
from fabweave.mesh.polymesh import PolyMesh, face_centres, without_loose
from fabweave.mesh.remesh.coarse import cage_of_quads
from fabweave.mesh.remesh.engines import (
    ENGINES,
    LARGE,
    QSLIM,
    AttemptFailedError,
    Candidate,
    Engine,
    Run,
    Task,
    best_of,
    best_run,
    candidate_of,
    lacking,
    results_of,
    run_engine,
    runs_of,
)
from fabweave.mesh.remesh.fit import Model, fit, model_of
from fabweave.mesh.remesh.limbs import with_limbs
from fabweave.mesh.remesh.pairing import merge_pairs, pair_triangles
from fabweave.mesh.remesh.remeshed import (
    Remeshed,
    check_remeshed,
    cut_surface,
    evenness,
    finished_quads,
    ready_source,
    surface_faults,
)
from fabweave.mesh.remesh.request import LEAST, checked_count
from fabweave.mesh.topology import keep_faces

#: A symmetric result is not worse than another up to this factor, in its distances from the model
#: (of some 0.4 % of the size: half of that more is not seen, left unlike right is) and in the share
#: of irregular vertices, which come in pairs.
_WORSE = 1.5
#: Halves are remeshed so many times as often as wholes: they are quick, and of some models most do
#: not join to a surface (an edge across a half ends on the mirror twice). So many that do are
#: fitted, those with the fewest irregular vertices.
_TIMES, _MOST_FITTED = 2, 4
#: Boundary vertices of half an open surface nearer to the mirror than this share of the size belong
#: on it; of a closed one, all do.
_REACH = 0.01
#: Rounds of smoothing the boundary of half a mesh.
_SMOOTHED = 3
#: Turns of fitting and of making symmetric again, and the rounds of each fit.
_TURNS, _ROUNDS = 3, 3


def symmetric_quads(
    engine: Engine,
    source: PolyMesh,
    surface: PolyMesh,
    wanted: int,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
    mirror: Mirror | None = None,
) -> tuple[PolyMesh | None, str]:
    """Remesh half of a surface so that its boundary is on the mirror, and join it to its image.

    Where two quads met at the seam in a vertex with two edges, they become one. Then the whole is
    fitted to the surface, and kept symmetric.

    Parameters
    ----------
    engine : Engine
        The remesher.
    source, surface : PolyMesh
        The given surface, and triangles that the remesher sees.
    wanted : int
        About how many quads both halves have.
    seed : int
        The first seed.
    progress : callable
        Told about each run.
    mirror : Mirror, optional
        That of the surface, if it is known.

    Returns
    -------
    result : PolyMesh or None
        Exactly symmetric, and with the topology of the given surface; None if that is not symmetric
        or nothing sound came of it.
    why : str
        Why nothing did; empty where there is a result, or no symmetry.
    """
    mirror = mirror or find_mirror(surface)
    if not mirror.symmetric:
        return None, ""
    half = sound_half(surface, mirror)
    if half is None:
        return None, "its halves are no surfaces"
    size = float(np.ptp(surface.vertices, axis=0).max())
    reach = np.inf if check_mesh(source).closed else _REACH * size
    model = model_of(source, wanted)
    why: list[str] = []
    large = half.n_faces > LARGE
    runs = runs_of(engine, wanted // 2, seed, rim=True, large=large, times=_TIMES)
    tasks, join = [Task(engine, half, run) for run in runs], partial(_joined, half, mirror, reach)
    found: dict[bytes, tuple[int, PolyMesh, Run]] = {}  # seeds often give the same
    for task, result in results_of(tasks, join, progress):
        if isinstance(result, AttemptFailedError):
            why.append(str(result))
            continue
        key = result.vertices.tobytes() + result.indices.tobytes()
        found.setdefault(key, (len(find_irregular(result)), result, task.run))
    good: list[Candidate] = []
    refit = partial(_fitted, model, mirror, turns=1)
    for _, result, run in sorted(found.values(), key=lambda one: one[0]):
        fitted, faults = with_limbs(source, _fitted(model, mirror, result, _TURNS), refit, wanted)
        if faults := (*faults, *check_remeshed(source, fitted)):
            why.append("; ".join(faults))
            continue
        good.append(candidate_of(engine, source, fitted, run))
        if len(good) == _MOST_FITTED:
            break
    if not good:
        return None, min(why, key=len)
    return best_of(good, wanted).mesh, ""


def made_symmetric(
    source: PolyMesh, made: PolyMesh, model: Model, mirror: Mirror | None = None
) -> PolyMesh | None:
    """Join the better half of a mesh of quads of a closed symmetric surface to its image.

    The faces on one side of the mirror are taken, and their boundary is put on it; where it had
    corners, quads at the seam become one. Then the whole is fitted.

    Parameters
    ----------
    source : PolyMesh
        The given surface.
    made : PolyMesh
        Quads like it.
    model : Model
        The surface, for fitting.
    mirror : Mirror, optional
        That of the surface, if it is known.

    Returns
    -------
    PolyMesh or None
        Exactly symmetric, and not worse (see `not_worse`); None where there is no such.
    """
    mirror = mirror or find_mirror(source)
    if not mirror.symmetric or not check_mesh(source).closed:
        return None
    side = (face_centres(made) - mirror.point) @ mirror.normal > 0
    halfedges = build_halfedges(made)
    beside = halfedges.face[halfedges.twin].reshape(-1, 4)
    for _ in range(_SMOOTHED):
        # A face goes with three neighbours of four, so that the boundary has few corners.
        votes = side[beside].sum(axis=1)
        side = np.where(votes == 2, side, votes > 2)
    good: list[tuple[int, float, PolyMesh]] = []
    for part in (side, ~side):
        half = without_loose(PolyMesh.from_faces(made.vertices, made.indices.reshape(-1, 4)[part]))
        result, faults = _joined(half, mirror, np.inf, half)
        if faults or surface_faults(source, result):
            continue
        result = _fitted(model, mirror, result, _TURNS)
        if not check_remeshed(source, result) and not_worse(source, result, made):
            clashes, like = len(self_intersections(result)), likeness(source, result)
            good.append((clashes, like.in_rms_mm, result))
    return min(good, key=lambda one: one[:2])[2] if good else None


def _joined(
    half: PolyMesh, mirror: Mirror, reach: float, found: PolyMesh
) -> tuple[PolyMesh, tuple[str, ...]]:
    """Join half a result to its image; say what is wrong with it."""
    faults = () if found is half else surface_faults(half, found)
    if faults or not found.n_faces or check_mesh(found).fatal:
        return found, faults or ("a half is no surface",)
    joined = joined_with_image(found, mirror, reach)
    if check_mesh(joined).fatal:
        return joined, ("the halves do not join to a surface",)
    return without_doublets(joined), ()


def _fitted(model: Model, mirror: Mirror, mesh: PolyMesh, turns: int) -> PolyMesh:
    """Fit a symmetric mesh to a model so that it stays symmetric."""
    partner = cKDTree(mesh.vertices).query(mirror.image(mesh.vertices))[1]
    for _ in range(turns):
        points = fit(model, mesh, _ROUNDS).vertices
        mesh = mesh.with_vertices((points + mirror.image(points[partner])) / 2.0)
    return mesh


def without_doublets(mesh: PolyMesh) -> PolyMesh:
    """Return a mesh of quads in which no two lie on one another around a vertex with two edges.

    The two become one quad, and the vertex goes; that may make another such vertex, and so on.

    Examples
    --------
    >>> from fabweave.mesh.shapes.solids import cube
    >>> faces = cube().indices.reshape(-1, 4).tolist()
    >>> a, p, c, q = faces[0]
    >>> points = np.concatenate([cube().vertices, cube().vertices[[p]]])
    >>> doubled = PolyMesh.from_faces(points, [[8, a, p, c], [8, c, q, a], *faces[1:]])
    >>> without_doublets(doubled).n_faces, without_doublets(doubled).n_vertices
    (6, 8)
    """
    while True:
        vertices, valences = interior_valences(build_halfedges(mesh))
        faces = [face.tolist() for face in mesh.indices.reshape(-1, 4)]
        gone: set[int] = set()
        new = []
        for vertex in vertices[valences == 2].tolist():
            one, two = (at for at, face in enumerate(faces) if vertex in face)
            (a, p, c), (_, q, _) = (_after(faces[at], vertex) for at in (one, two))
            if p != q and not gone & {one, two}:
                gone |= {one, two}
                new.append([a, p, c, q])
        if not new:
            return mesh
        kept = [*(face for at, face in enumerate(faces) if at not in gone), *new]
        mesh = without_loose(PolyMesh.from_faces(mesh.vertices, np.array(kept)))


def without_tabs(mesh: PolyMesh) -> PolyMesh:
    """Return a mesh without faces that hang on by a single edge: no strip can turn around these.

    Where others would hang so then, as in a strip of faces, the mesh stays as it is.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import hypar
    >>> sheet = hypar(3, 3, 1.0, 0.0)
    >>> tab = PolyMesh.from_faces(
    ...     np.concatenate([sheet.vertices, [[-0.8, -0.2, 0.0], [-0.8, 0.2, 0.0]]]),
    ...     [*sheet.faces(), [1, 2, 17, 16]],
    ... )
    >>> without_tabs(sheet) is sheet, [without_tabs(tab).n_faces, tab.n_faces]
    (True, [9, 10])
    """
    hangs = build_halfedges(mesh).hanging
    if not hangs.any() or hangs.all():
        return mesh
    rest = without_loose(keep_faces(mesh, ~hangs))
    return mesh if build_halfedges(rest).hanging.any() else rest


def _after(face: list[int], vertex: int) -> list[int]:
    """Return the other corners of a face, in order from one."""
    at = face.index(vertex)
    return face[at + 1 :] + face[:at]


def not_worse(source: PolyMesh, symmetric: PolyMesh, whole: PolyMesh) -> bool:
    """Whether a symmetric mesh of quads is about as good as another.

    That is: its distances from the model, root mean square and greatest, and its share of irregular
    vertices are no more by more than a half, there are no more of them on the boundary, and it runs
    through itself in no more places.
    """
    odd, usual = find_irregular(symmetric), find_irregular(whole)
    return (
        nearly_as_like(source, symmetric, whole, _WORSE)
        and len(odd) * whole.n_vertices <= _WORSE * len(usual) * symmetric.n_vertices
        and odd.boundary.sum() <= usual.boundary.sum()
        and len(self_intersections(symmetric)) <= len(self_intersections(whole))
    )


#: Quads to aim at by default: half as many as triangles, but no more than a person can weave.
_DEFAULT_MOST = 3000
#: Quads that pairing gives are "about" the number asked for up to this factor either way.
_ABOUT = 2.0
#: Remeshers see at most so many triangles, in all or for each quad: what is finer makes them slow,
#: and lets them lose limbs. Surfaces with more than these by this factor are decimated.
_ENOUGH, _ENOUGH_EACH, _FAR_MORE = 10_000, 10, 1.2
#: Of a paired mesh, at most this share of the faces may be other than quads.
_STRAY = 1 / 8
#: Quads that a mesh has already are as good as new ones if they are so even, and no larger share of
#: their vertices is irregular: from 14 % on a weave looks patched.
_EVEN, _IRREGULAR = 0.45, 0.10


def remesh_quads(
    mesh: PolyMesh,
    n_quads: int | None,
    *,
    seed: int = 0,
    progress: Progress = no_progress,
    engines: Sequence[Engine] = ENGINES,
) -> Remeshed:
    """Turn a mesh into quads.

    1. Vertices at the same place are joined, and faces are turned to agree.
    2. A mesh whose triangles are split quads gets them back by pairing, and keeps its vertices,
       if the count is left open or they are about as many as asked for (up to factor 2).
    3. A refined mesh gets a cage of quads back, if that has about as many as asked for (up to
       factor 1.5). Where a count is asked for, either is taken only if its edges are even enough
       (see `evenness`), else ribbons would be narrow where quads are small; and only if at most a
       tenth of its vertices are irregular.
    4. Else remeshers lay a new mesh of quads over the surface: QuadriFlow, or where that fails
       Instant Meshes, each a few times. Results are fitted to the surface, and of those that pass
       `check_remeshed` the one that keeps the shape best is taken (see `best_run`). A scan with
       far more triangles than quads are wanted is decimated for them first.
    5. Where the model is mirror-symmetric, the same is done to one half, whose seam is a line of
       edges, and which is joined to its image; or half of the quads is joined to its image. That is
       taken if it is sound and not worse (see `not_worse`) than the first whole; else the notes say
       why not.
    6. Where no result passes, triangles that pair up completely are taken even if they do not
       look like split quads.

    Parameters
    ----------
    mesh : PolyMesh
        Any mesh, in millimetres (the notes say so of positions).
    n_quads : int or None
        About how many quads; None for those that pairing gives, or else half as many as
        triangles, at most 3000.
    seed : int
        The first seed of the remesher.
    progress : callable
        Told about each run.
    engines : sequence of Engine
        The remeshers in the order of preference.

    Returns
    -------
    Remeshed
        The same for the same arguments.

    Raises
    ------
    InputError
        If the mesh is not an oriented manifold surface and cannot be made one.
    CannotMakeError
        If nothing gave a mesh of quads; the message says why each attempt failed.

    Examples
    --------
    >>> from fabweave.mesh.shapes.grids import torus
    >>> from fabweave.mesh.triangulate import triangulate
    >>> remeshed = remesh_quads(triangulate(torus(12, 8, 35.0, 15.0)), None)
    >>> remeshed.method, remeshed.mesh.n_faces, len(remeshed.irregular)
    ('pairing', 96, 0)

    References
    ----------
    Huang, Zhou, Nießner, Shewchuk, Guibas, "QuadriFlow: a scalable and robust method for
    quadrangulation", Computer Graphics Forum 37(5), 2018. Jakob, Tarini, Panozzo,
    Sorkine-Hornung, "Instant field-aligned meshes", ACM TOG 34(6), 2015.
    """
    if n_quads is not None:
        checked_count("quads", n_quads)
    source, notes = ready_source(mesh)
    pairing = pair_triangles(source)
    paired = merge_pairs(source, pairing)
    kept = None
    if (pairing.split or _mostly_quads(source)) and _mostly_quads(paired):
        kept = _kept(source, paired, n_quads, notes)
        if kept is not None and (n_quads is None or not _unfit(kept)):
            return kept
        notes.append(Note("quads", _not_kept(paired, kept, n_quads), detail=True))
    surface = cut_surface(source)
    wanted = n_quads or min(max(LEAST["quads"], surface.n_faces // 2), _DEFAULT_MOST)
    if n_quads is None:
        text = f"no number of quads was given, so about {wanted} were aimed for"
        notes.append(Note("quads", text, detail=True))
    failures: list[str] = []
    surface = _reduced(surface, wanted)
    mirror = find_mirror(surface)
    for engine in engines:
        if engine.lack:
            failures.append(f"{engine.title}: {engine.lack} on this platform")
            continue
        halves, why = symmetric_quads(engine, source, surface, wanted, seed=seed, progress=progress)
        run = partial(best_run, engine, source, surface, wanted, seed=seed, progress=progress)
        # Beside halves that are as good as the first whole, no other is looked for.
        best, failed = run(most=None if halves is None else 1)
        if halves is not None and (best is None or not not_worse(source, halves, best.mesh)):
            halves, why = None, "they would keep its shape worse, or be less regular"
            if best is None or best.irregular:
                best, failed = run()
        failures += failed
        if best is not None:
            notes += _other_attempts(failures)
            chosen, told = _mirrored(engine, source, wanted, best, halves, why, mirror)
            return finished_quads(without_tabs(chosen), engine.name, [*notes, *told])
    return kept or _last_resort(source, n_quads, notes, failures)


def _kept(
    source: PolyMesh, paired: PolyMesh, n_quads: int | None, notes: list[str]
) -> Remeshed | None:
    """Return the quads that a mesh has already, or those of its cage, if they are about so many."""
    if _about(paired.n_faces, n_quads):
        return _from_pairing(source, paired, notes)
    cage = None if n_quads is None else cage_of_quads(source, n_quads)
    return None if cage is None else finished_quads(cage[0], "unrefining", [*notes, cage[1]])


def _not_kept(paired: PolyMesh, kept: Remeshed | None, n_quads: int | None) -> str:
    """Say why the quads that a mesh has are not taken."""
    if kept is None:
        return (
            f"the triangles pair up into {paired.n_faces} quads with "
            f"{len(find_irregular(paired))} irregular vertices, but about {n_quads} quads were "
            "asked for; --remesh quads keeps the pairs"
        )
    return (
        f"the mesh has {kept.mesh.n_faces} quads of its own, but {_unfit(kept)}; --remesh quads "
        "keeps its quads, --remesh coarse its cage"
    )


def _unfit(kept: Remeshed) -> str:
    """Say why quads that a mesh has are worse than new ones; empty if they are not."""
    odd, count = len(kept.irregular), len(np.unique(kept.mesh.indices))
    if odd > _IRREGULAR * count:
        return f"{odd} of their {count} vertices are irregular"
    if evenness(kept.mesh) < _EVEN:
        return "some are small beside others, or long and narrow, as ribbons would be"
    return ""


def _mirrored(
    engine: Engine, source: PolyMesh, wanted: int, best: Candidate, halves: PolyMesh | None,
    why: str, mirror: Mirror,
) -> tuple[PolyMesh, list[Note]]:  # fmt: skip
    """Return a mirror-symmetric result in place of another where it is as good; and notes."""
    if not best.irregular:  # nothing is better than a regular mesh
        return best.mesh, [best.note]
    if why:
        halves = made_symmetric(source, best.mesh, model_of(source, wanted), mirror)
    if halves is not None:
        told = (
            f"{engine.title} made {halves.n_faces} quads ({wanted} were wanted); the model is "
            "mirror-symmetric, and so are they: half was remeshed"
        )
        return halves, [Note("quads", told, detail=True)]
    told = "the model is mirror-symmetric, and the quads are not"
    return best.mesh, [*([Note("quads", told, f"For {why}")] if why else []), best.note]


def _reduced(surface: PolyMesh, wanted: int) -> PolyMesh:
    """Take triangles away where there are far more than remeshers need, if that goes well."""
    enough = max(_ENOUGH, _ENOUGH_EACH * wanted)
    if surface.n_faces < _FAR_MORE * enough:
        return surface
    try:
        fewer = run_engine(QSLIM, surface, Run(enough, 0, rim=False))
    except AttemptFailedError:
        return surface
    return surface if check_remeshed(surface, fewer, 3) else fewer


def _mostly_quads(mesh: PolyMesh) -> bool:
    return bool(np.mean(mesh.face_sizes != 4) <= _STRAY)


def _about(found: int, wanted: int | None) -> bool:
    return wanted is None or wanted / _ABOUT <= found <= wanted * _ABOUT


def _from_pairing(source: PolyMesh, paired: PolyMesh, notes: list[str]) -> Remeshed:
    """Describe a mesh that pairing gave."""
    merged = source.n_faces - paired.n_faces
    stray = np.flatnonzero(paired.face_sizes != 4)
    notes = list(notes)
    if merged:
        notes.append(
            f"{2 * merged} triangles were paired into {agree(merged, '{n} quad[|s]')}; "
            "every vertex stays where it was"
        )
    else:
        share = "nearly all faces are" if len(stray) else "all faces are"
        notes.append(f"{share} quads already, so the mesh was left as it is")
    if len(stray):
        some = few_of(stray.tolist(), 5)
        notes.append(
            agree(len(stray), "{n} [face is not a quad|faces are not quads] (face ")
            + f"{some}); one Catmull-Clark step turns all faces into quads"
        )
    return finished_quads(paired, "pairing" if merged else "unchanged", notes)


def _other_attempts(failures: list[str]) -> list[Note]:
    return [Note("quads", f"another attempt failed: {text}", detail=True) for text in failures]


def _last_resort(
    source: PolyMesh, n_quads: int | None, notes: list[str], failures: list[str]
) -> Remeshed:
    """Take pairs that do not look like split quads, or say that nothing helped."""
    paired = merge_pairs(source, pair_triangles(source, repair=True))
    stray = int(np.count_nonzero(paired.face_sizes != 4))
    if not stray and _about(paired.n_faces, n_quads):
        notes = [*notes, *_other_attempts(failures)]
        notes.append("the triangles do not look like split quads, so the new quads may be skewed")
        return _from_pairing(source, paired, notes)
    if stray:
        text = agree(stray, "{n} [face would not be a quad|faces would not be quads]")
    else:
        text = f"it gives {paired.n_faces} quads (--remesh quads keeps them)"
    failures = [*failures, f"pairing triangles: {text}"]
    if lack := lacking("quads"):
        raise CannotMakeError(f"{lack} (pairing triangles: {text})")
    raise CannotMakeError(
        "the mesh could not be turned into quads:\n"
        + "\n".join(f"  - {failure}" for failure in failures)
        + f"\nWhat may help: {'; '.join(_remedies(source))}; --remesh triangles:N, which "
        "keeps thin limbs; or leaving the mesh as it is and refining it (one Catmull-Clark step "
        "turns any mesh into quads)"
    )


def _remedies(source: PolyMesh) -> list[str]:
    """Return what may help against what is wrong with a mesh."""
    crossing = len(self_intersections(source))
    remedies = []
    if crossing and len(bodies_of(source)[1]) > 1:
        remedies.append(
            "--bodies join, which makes one surface of bodies that run into one another"
        )
    if crossing:
        remedies.append("--bodies wrap, which lays one closed surface around all of it")
    remedies.append("another number of quads (more where the mesh has thin bars or small holes)")
    if crossing:
        remedies.append(
            "moving apart what runs through itself "
            + agree(crossing, "({n} pair[|s] of faces [intersects or touches|intersect or touch])")
        )
    remedies.append("smoothing it first, if it is a scan")
    if np.any(build_halfedges(source).twin < 0):
        remedies.append("closing small holes")
    return remedies
